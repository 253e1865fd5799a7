//! Wrong files beside the message expected: every folder of `tests/ui` has the arguments, the files, perhaps what comes by standard
//! input, and what `phical` says.
//!
//! `PHICAL_UPDATE=1 cargo test ui` writes the expectations anew; look at the difference before it is kept.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

use phical::diag::Code;

use crate::shared::project;

/// What a run prints, with its exit code.
fn run(folder: &Path) -> String {
    let args = std::fs::read_to_string(folder.join("args")).expect("args");
    let stdin = File::open(folder.join("stdin")).map_or_else(|_| Stdio::null(), Stdio::from);
    let out = Command::new(env!("CARGO_BIN_EXE_phical"))
        .env("PHICAL_INSTRUCTIONS", "baseline")
        .args(args.split_whitespace())
        .stdin(stdin)
        .current_dir(folder)
        .env("COLUMNS", "100")
        .output()
        .expect("phical runs");
    let say = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    format!(
        "exit {}\n--- stderr\n{}--- stdout\n{}",
        out.status.code().unwrap_or(-1),
        say(&out.stderr),
        say(&out.stdout)
    )
}

fn cases() -> Vec<std::path::PathBuf> {
    let mut cases: Vec<_> =
        std::fs::read_dir(project("tests/ui")).expect("readable").flatten().map(|e| e.path()).collect();
    cases.sort();
    cases
}

#[test]
fn every_mistake_says_what_is_expected() {
    let update = std::env::var_os("PHICAL_UPDATE").is_some();
    let mut wrong = Vec::new();
    for case in cases() {
        let found = run(&case);
        let file = case.join("expected");
        if update {
            std::fs::write(&file, &found).expect("writable");
        }
        let expected = std::fs::read_to_string(&file).unwrap_or_default();
        if found != expected {
            wrong.push(format!("{}\nexpected\n{expected}\nfound\n{found}", case.display()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn every_error_has_a_case() {
    let all: String =
        cases().iter().map(|case| std::fs::read_to_string(case.join("expected")).unwrap_or_default()).collect();
    let missing: Vec<&str> = Code::ALL
        .iter()
        .map(|code| code.id())
        .filter(|id| id.starts_with('E') && !all.contains(&format!("[{id}]")))
        .collect();
    assert!(missing.is_empty(), "no case for {missing:?}");
}
