//! The guide in `docs/`, done as it says: every chapter in a folder of its own, command by command.
//!
//! In a `console` block every line that begins with `$ ` is run, and what follows is what it prints; a line `…` stands for any lines.
//! Before a block whose commands are refused stands `(refused)`, and what follows is on standard error. A block after
//! `<!-- file=NAME -->` is the file NAME.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::readme::matches;
use crate::shared::project;

/// What a reader does.
#[derive(Debug, PartialEq)]
enum Act {
    Write { file: String, text: String },
    Run { command: String, expected: Vec<String>, refused: bool },
}

fn acts(text: &str) -> Vec<Act> {
    let mut all = Vec::new();
    let mut lines = text.lines();
    let mut before = "";
    while let Some(line) = lines.next() {
        let Some(what) = line.strip_prefix("```").filter(|what| !what.is_empty()) else {
            before = if line.trim().is_empty() { before } else { line };
            continue;
        };
        let inside: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        let file = before.strip_prefix("<!-- file=").and_then(|rest| rest.strip_suffix(" -->"));
        if let Some(file) = file {
            all.push(Act::Write { file: file.to_owned(), text: inside.join("\n") + "\n" });
        } else if what == "console" {
            let refused = before.contains("(refused)");
            for line in inside {
                match (line.strip_prefix("$ "), all.last_mut()) {
                    (Some(command), _) => {
                        all.push(Act::Run { command: command.to_owned(), expected: Vec::new(), refused });
                    }
                    (None, Some(Act::Run { expected, .. })) => expected.push(line.to_owned()),
                    (None, _) => {}
                }
            }
        }
        before = "";
    }
    all
}

/// Runs a chapter; what is not as it says.
fn wrong(text: &str) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    let (from, to) = (project("models"), directory.path().join("models"));
    copied(&from, &to);
    let mut wrong = Vec::new();
    for act in acts(text) {
        let (command, expected, refused) = match act {
            Act::Write { file, text } => {
                std::fs::write(directory.path().join(file), text).unwrap();
                continue;
            }
            Act::Run { command, expected, refused } => (command, expected, refused),
        };
        let Some(arguments) = command.strip_prefix("phical ") else {
            wrong.push(format!("{command}: not a command of phical"));
            continue;
        };
        let output = Command::new(env!("CARGO_BIN_EXE_phical"))
            .args(arguments.split_whitespace())
            .current_dir(directory.path())
            .env("PHICAL_INSTRUCTIONS", "baseline")
            .env("COLUMNS", "100")
            .output()
            .unwrap();
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        let found = if refused { &err } else { &out };
        let lines: Vec<&str> = found.lines().collect();
        if (output.status.code() == Some(2)) != refused || !matches(&lines, &expected) {
            wrong.push(format!("{command}\nprints\n{out}\n{err}"));
        }
    }
    wrong
}

fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        match entry.path().is_dir() {
            true => copied(&entry.path(), &to.join(entry.file_name())),
            false => drop(std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap()),
        }
    }
}

fn chapters() -> Vec<PathBuf> {
    let all = std::fs::read_dir(project("docs")).unwrap().flatten().map(|entry| entry.path());
    let mut all: Vec<PathBuf> = all.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect();
    all.sort();
    all
}

#[test]
fn the_guide_is_what_happens() {
    let mut found = Vec::new();
    let mut commands = 0;
    for chapter in chapters() {
        let text = std::fs::read_to_string(&chapter).unwrap();
        commands += acts(&text).len();
        found.extend(wrong(&text).into_iter().map(|what| format!("{}: {what}", chapter.display())));
    }
    assert!(found.is_empty(), "{}", found.join("\n\n"));
    assert!(commands > 20, "{commands}");
}

#[test]
fn a_chapter_that_is_not_true_is_noticed() {
    let fence = "```";
    let said = |code: &str, line: &str| format!("{fence}console\n$ phical explain {code}\n{line}\n…\n{fence}\n");
    assert!(wrong(&said("E012", "E012: the unit does not fit")).is_empty());
    assert_eq!(wrong(&said("E012", "E012: all is well")).len(), 1);
    // a refusal that is not announced, and one that is
    let refused = format!("{fence}console\n$ phical check none.ron\n…\n{fence}\n");
    assert_eq!((wrong(&refused).len(), wrong(&format!("(refused)\n\n{refused}")).len()), (1, 0));
    // a file is there when it is needed
    let file = |message: &str| {
        format!(
            "<!-- file=m.ron -->\n{fence}ron\n(name: \"m\")\n{fence}\n(refused)\n{fence}console\n$ phical check m.ron\n{message}\n…\n{fence}\n"
        )
    };
    assert!(wrong(&file("error[E026]: the model states nothing that must vanish")).is_empty());
    assert_eq!(wrong(&file("error[E002]: there is no such file")).len(), 1);
}

/// Links of the guide and of the READMEs lead somewhere.
#[test]
fn links_lead_to_files() {
    let mut dead = Vec::new();
    let readmes = ["README.md", "models/README.md"].map(project);
    for file in chapters().into_iter().chain(readmes) {
        let text = std::fs::read_to_string(&file).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = link.split('#').next().unwrap_or("");
            let outside = link.contains("://") || path.is_empty();
            // a rustdoc link has no ending and no folder
            let of_rustdoc = link.contains("::") || link.contains('@') || link.ends_with("()");
            if !outside && !of_rustdoc && !file.with_file_name(path).exists() {
                dead.push(format!("{}: {link}", file.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{dead:#?}");
}
