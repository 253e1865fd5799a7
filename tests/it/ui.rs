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

/// The shortest message with a code, of all cases.
fn shortest(id: &str, all: &[String]) -> Option<String> {
    let begins = |message: &&str| ["error", "warning"].iter().any(|what| message.starts_with(&format!("{what}[{id}]")));
    let messages = all.iter().flat_map(|said| {
        let said = said.split("--- stderr\n").nth(1).and_then(|rest| rest.split("--- stdout\n").next()).unwrap_or("");
        said.split("\n\n").map(str::trim_end).filter(begins).map(|message| format!("{message}\n"))
    });
    messages.min_by_key(String::len)
}

/// `phical explain CODE` shows a message of a case, for each code.
#[test]
fn every_code_has_a_case_and_its_example_is_from_one() {
    let all: Vec<String> =
        cases().iter().map(|case| std::fs::read_to_string(case.join("expected")).unwrap_or_default()).collect();
    let mut wrong = Vec::new();
    // a machine without room for temporary files, and somebody who presses Ctrl-C, are no cases
    let elsewhere = |code: &&Code| !matches!(code, Code::RowsInMemory | Code::Interrupted);
    for code in Code::ALL.iter().filter(elsewhere) {
        let Some(message) = shortest(code.id(), &all) else {
            wrong.push(format!("{code}: no case"));
            continue;
        };
        if std::env::var_os("PHICAL_UPDATE").is_some() {
            std::fs::write(project(&format!("src/diag/examples/{code}.txt")), &message).expect("writable");
        } else if code.example() != message {
            wrong.push(format!("{code}: the example is not\n{message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
