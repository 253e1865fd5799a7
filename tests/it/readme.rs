//! The commands of README.md and of the models' READMEs, run as they stand there.
//!
//! In a `console` block every line that begins with `$ ` is run at the project's root, and what follows it, up to the next one,
//! is what it prints; a line `…` stands for any lines. In the models' READMEs indented lines that begin with `phical` are run, and
//! must not be refused.

use std::path::PathBuf;
use std::process::{Command, Output};

use crate::shared::project;

/// Runs a command line; `phical` and `cargo run --release --` are the binary under test. Nothing else is run.
fn run(line: &str) -> Option<Output> {
    let arguments = line.strip_prefix("phical ").or_else(|| line.strip_prefix("cargo run --release -- "))?;
    let arguments = arguments.split(" #").next().unwrap_or("").split_whitespace();
    let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
    command.env("PHICAL_INSTRUCTIONS", "baseline");
    Some(command.args(arguments).current_dir(project("")).env("COLUMNS", "100").output().expect("phical runs"))
}

/// Commands of the `console` blocks, each with what should follow.
fn commands(text: &str) -> Vec<(String, Vec<String>)> {
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        match (inside, line.strip_prefix("$ ")) {
            (false, _) => inside = line == "```console",
            (true, _) if line == "```" => inside = false,
            (true, Some(command)) => all.push((command.to_owned(), Vec::new())),
            (true, None) => {
                if let Some((_, expected)) = all.last_mut() {
                    expected.push(line.to_owned());
                }
            }
        }
    }
    all
}

/// Whether lines are the expected ones, `…` standing for any number of lines.
pub fn matches(found: &[&str], expected: &[String]) -> bool {
    match expected.split_first() {
        None => found.is_empty(),
        Some((first, rest)) if first.trim() == "…" => (0..=found.len()).any(|skip| matches(&found[skip..], rest)),
        Some((first, rest)) => found.first() == Some(&first.as_str()) && matches(&found[1..], rest),
    }
}

#[test]
fn the_readme_is_what_happens() {
    let text = std::fs::read_to_string(project("README.md")).expect("README.md");
    let all = commands(&text);
    assert!(all.len() >= 3, "{all:?}");
    for (command, expected) in all {
        let Some(output) = run(&command) else {
            assert_eq!(command, "cargo test", "a command that is not tested");
            continue;
        };
        let found = String::from_utf8_lossy(&output.stdout).into_owned();
        let lines: Vec<&str> = found.lines().collect();
        assert!(matches(&lines, &expected), "{command}\nprints\n{found}\n{}", String::from_utf8_lossy(&output.stderr));
    }
}

#[test]
fn a_line_that_is_not_printed_is_noticed() {
    let expected = ["a".to_owned(), "…".to_owned(), "c".to_owned()];
    assert!(matches(&["a", "b", "b", "c"], &expected));
    assert!(matches(&["a", "c"], &expected));
    assert!(!matches(&["a", "b"], &expected));
    assert!(!matches(&["x", "c"], &expected));
}

/// The blocks of Rust code of a text, line by line, without lines that are hidden.
fn rust_blocks(text: &str, prefix: &str, fence: &str) -> Vec<Vec<String>> {
    let mut all: Vec<Vec<String>> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        let Some(line) = line.strip_prefix(prefix).or((line == prefix.trim_end()).then_some("")) else { continue };
        match (inside, line) {
            (true, "```") => inside = false,
            (false, _) if line == fence => {
                inside = true;
                all.push(Vec::new());
            }
            (true, _) if !line.starts_with("# ") => all.last_mut().expect("begun").push(line.to_owned()),
            _ => {}
        }
    }
    all
}

/// What README.md shows of the library is compiled and run as the example of the module it is about.
#[test]
fn rust_code_is_that_of_a_doc_test() {
    let text = std::fs::read_to_string(project("README.md")).expect("README.md");
    let module = std::fs::read_to_string(project("src/testing/mod.rs")).expect("the module");
    let module = module.split("mod chains;").next().unwrap_or("");
    let (shown, run) = (rust_blocks(&text, "", "```rust"), rust_blocks(module, "//! ", "```"));
    assert_eq!(shown.len(), 1);
    assert_eq!(shown, run);
}

#[test]
fn the_quick_start_is_trustworthy() {
    let output = run("cargo run --release -- calibrate models/two_theodolite/model.ron").expect("a command");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The folders of `models`, and those in them.
fn folders() -> Vec<PathBuf> {
    let inside = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let first: Vec<PathBuf> = inside(project("models")).filter(|path| path.is_dir()).collect();
    first.iter().cloned().chain(first.iter().cloned().flat_map(inside).filter(|path| path.is_dir())).collect()
}

#[test]
fn commands_of_the_models_are_not_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let elsewhere = format!(" --out {}/", directory.path().display());
    for folder in folders() {
        let Ok(text) = std::fs::read_to_string(folder.join("README.md")) else { continue };
        // a command may go on in the next line
        let text = text.replace("\\\n", " ");
        for line in text.lines().filter_map(|line| line.strip_prefix("    phical ")) {
            // a line that writes somewhere, or reads what another wrote, is an example of its kind
            if line.contains("/tmp/") || line.contains("--fit") || line.contains('>') {
                continue;
            }
            // what takes minutes is the same command with less to do
            let line = line.replace("--seeds 1000", "--seeds 3").replace(" --out ", &elsewhere);
            let output = run(&format!("phical {line}")).expect("a command");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            let absent = said.contains("[W003]") || said.contains("[E035]");
            assert!(output.status.code() != Some(2) || absent, "phical {line}\n{said}");
        }
    }
}
