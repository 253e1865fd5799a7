//! What a person at a terminal has: colours there and nowhere else, quiet, completions, manual pages, a model to begin with.

use std::process::Command;

use crate::cli::{ends, json, model, path, refused};

/// The two streams of a run.
fn streams(arguments: &[&str]) -> (String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_phical")).args(arguments).output().unwrap();
    (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
}

const ESCAPE: char = '\u{1b}';

#[test]
fn colours_are_where_they_are_asked_for() {
    let flagship = model("two_theodolite");
    let (plain, warned) = streams(&["calibrate", &flagship]);
    assert!(!plain.contains(ESCAPE) && !warned.contains(ESCAPE) && warned.contains("W007"));
    let (coloured, warned) = streams(&["calibrate", &flagship, "--color", "always"]);
    assert!(coloured.contains(ESCAPE) && warned.contains(ESCAPE));
    // the verdict alone is coloured, and nothing is lost
    let mut bare = String::new();
    let mut inside = false;
    for c in coloured.chars() {
        match (inside, c) {
            (false, ESCAPE) => inside = true,
            (true, 'm') => inside = false,
            (false, c) => bare.push(c),
            (true, _) => {}
        }
    }
    assert_eq!(bare, plain);
    let (json, _) = streams(&["calibrate", &flagship, "--color", "always", "--format", "json"]);
    assert!(!json.contains(ESCAPE));
}

#[test]
fn quiet_leaves_results_and_refusals() {
    let flagship = model("two_theodolite");
    let (loud, _) = streams(&["calibrate", &flagship]);
    assert_eq!(streams(&["calibrate", &flagship, "--quiet"]), (loud, String::new()));
    let (out, err) = streams(&["check", "none.ron", "-q"]);
    assert!(out.is_empty() && err.contains("E002"), "{err}");
}

#[test]
fn shells_complete_every_command() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = ends(0, &["completions", shell]);
        for command in ["calibrate", "identify", "report", "--weights"] {
            let wanted = if shell == "fish" { command.trim_start_matches("--") } else { command };
            assert!(script.contains(wanted), "{shell}: {command}");
        }
    }
    refused(&["completions", "none"]);
}

#[test]
fn every_command_has_a_manual_page() {
    let directory = tempfile::tempdir().unwrap();
    let written = json(0, &["man", "--out", &path(&directory, "man")]);
    let pages: Vec<&str> = written["pages"].as_array().unwrap().iter().map(|page| page.as_str().unwrap()).collect();
    let named = |name: &str| pages.iter().find(|page| page.ends_with(name)).copied();
    let main = std::fs::read_to_string(named("/phical.1").unwrap()).unwrap();
    assert!(main.starts_with(".ie") && main.contains("calibrate"));
    for command in ["check", "simulate", "calibrate", "identify", "design", "report", "explain"] {
        let page = std::fs::read_to_string(named(&format!("/phical-{command}.1")).unwrap()).unwrap();
        assert!(page.contains(".SH SYNOPSIS") && page.contains(".SH OPTIONS"), "{command}");
    }
    assert!(ends(0, &["man"]).contains(".SH"));
}

#[test]
fn a_starter_is_sound_and_is_not_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let folder = path(&directory, "polar");
    let begun = json(0, &["init", &folder]);
    let file = begun["model"].as_str().unwrap().to_owned();
    let (said, warned) = streams(&["check", &file]);
    assert!(said.starts_with("No mistakes found.") && warned.is_empty(), "{warned}");
    assert!(ends(0, &["identify", &file, "--structural"]).starts_with("All 8 parameters can be known"));
    // what it says comes next does what it says, whatever the seed
    for seed in ["1", "2", "3"] {
        ends(0, &["simulate", &file, "--seed", seed, "--out", &folder]);
        let page = path(&directory, "polar/report.html");
        let fit = json(0, &["calibrate", &file, "--report", &page]);
        assert_eq!(fit["trustworthy"], true);
        assert!(std::fs::read_to_string(&page).unwrap().contains("<th>truth</th>"));
    }
    assert_eq!(refused(&["init", &folder]), ["E043"]);
}
