//! What no compiler checks: imports point down, files stay small, every code is explained.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::shared::project;

/// The folders of `src`, lowest first. A folder imports only from those before it.
const LAYERS: &[&[&str]] = &[
    &["diag", "guide", "unit", "simd", "statistics"],
    &["graph", "linalg"],
    &["lang", "model", "eval", "solve"],
    &["symbolic"],
    &["compile"],
    &["data"],
    &["simulate", "problem"],
    &["fit"],
    &["evaluate", "identify", "derive"],
    &["audit", "survey"],
    &["session", "emit"],
    &["compare", "coverage", "design", "exchange"],
    &["report"],
    &["cli", "testing"],
];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The folders (or files) of the crate that a text names as `crate::x`; test modules and doc lines are left out.
fn imports(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or("");
    let code = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| line.split("crate::").skip(1).map(str::to_owned).collect::<Vec<_>>())
        .map(|rest| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect())
        .collect()
}

/// Imports that do not point down, as "from → to in file".
fn violations(files: &BTreeMap<String, Vec<(PathBuf, String)>>) -> Vec<String> {
    let layer = |folder: &str| LAYERS.iter().position(|layer| layer.contains(&folder));
    let mut wrong = Vec::new();
    for (folder, texts) in files {
        let Some(from) = layer(folder) else {
            wrong.push(format!("{folder} is in no layer"));
            continue;
        };
        for (path, text) in texts {
            for to in imports(text).iter().filter(|to| *to != folder) {
                match layer(to) {
                    Some(to_layer) if to_layer < from => {}
                    _ => wrong.push(format!("{folder} -> {to} in {}", path.display())),
                }
            }
        }
    }
    wrong
}

fn read_all() -> BTreeMap<String, Vec<(PathBuf, String)>> {
    let root = project("src");
    let mut files: BTreeMap<String, Vec<(PathBuf, String)>> = BTreeMap::new();
    for path in sources(&root) {
        let inside = path.strip_prefix(&root).expect("below src");
        let first = inside.components().next().expect("a name").as_os_str().to_string_lossy().into_owned();
        let folder = first.trim_end_matches(".rs").to_owned();
        let is_test =
            inside.components().any(|part| matches!(part.as_os_str().to_str(), Some("tests" | "tests.rs" | "laws.rs")));
        if is_test || matches!(folder.as_str(), "lib" | "main") {
            continue;
        }
        let text = std::fs::read_to_string(&path).expect("readable");
        files.entry(folder).or_default().push((path, text));
    }
    files
}

#[test]
fn imports_point_down() {
    let wrong = violations(&read_all());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn an_import_that_points_up_is_found() {
    let text = "use crate::cli::run;\n// crate::report is only named here\n";
    let files = BTreeMap::from([("graph".to_owned(), vec![(PathBuf::from("x.rs"), text.to_owned())])]);
    assert_eq!(violations(&files), ["graph -> cli in x.rs"]);
}

#[test]
fn files_have_one_idea() {
    const MOST: usize = 450;
    let long: Vec<String> = read_all()
        .into_values()
        .flatten()
        .filter(|(_, text)| text.lines().count() > MOST)
        .map(|(path, text)| format!("{} has {} lines", path.display(), text.lines().count()))
        .collect();
    assert!(long.is_empty(), "{long:#?}");
}
