//! `--solver sequential` as its users meet it: pipes, saved states, parts from several processes.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::cli::{ends, json, model, path, refused};
use crate::shared::project;

const BY_ROWS: [&str; 2] = ["--solver", "sequential"];

fn lines() -> Vec<String> {
    let text = fs::read_to_string(project("models/two_theodolite/vo_line.csv")).unwrap();
    text.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect()
}

/// A file of the flagship's rows from one to another.
fn part(directory: &tempfile::TempDir, rows: std::ops::Range<usize>) -> String {
    let all = lines();
    let text = [&all[..1], &all[1 + rows.start..1 + rows.end]].concat().join("\n") + "\n";
    let file = path(directory, &format!("{}-{}.csv", rows.start, rows.end));
    fs::write(&file, text).unwrap();
    format!("vo_line={file}")
}

fn calibrate(code: i32, more: &[&str]) -> Value {
    let flagship = model("two_theodolite");
    json(code, &[&["calibrate", &flagship], more].concat())
}

/// The same estimates to a share of their sigmas, and the same sigmas.
#[track_caller]
fn same(one: &Value, other: &Value, share: f64) {
    let all = |fit: &Value| fit["parameters"].as_array().unwrap().clone();
    assert_eq!((one["dof"].as_u64(), one["rank"].as_u64()), (other["dof"].as_u64(), other["rank"].as_u64()));
    for (a, b) in all(one).iter().zip(all(other)) {
        let of = |p: &Value, key: &str| p[key].as_f64().unwrap();
        let sigma = of(&b, "sigma");
        assert!((of(a, "value") - of(&b, "value")).abs() <= share * sigma, "{a} {b}");
        assert!((of(a, "sigma") / sigma - 1.0).abs() <= share.max(1e-6), "{a} {b}");
    }
}

fn piped(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[test]
fn one_after_the_other_is_all_at_once() {
    let batch = calibrate(0, &[]);
    let by_rows = calibrate(0, &BY_ROWS);
    same(&by_rows, &batch, 1e-7);
    assert_eq!(by_rows["provenance"]["options"]["solver"], "sequential");
    assert_eq!(by_rows["provenance"]["options"]["keep"], "all");
    assert_eq!(by_rows["provenance"]["data"], batch["provenance"]["data"]);
    let last = calibrate(0, &[&BY_ROWS[..], &["--keep", "50"]].concat());
    assert_eq!(last["provenance"]["options"]["keep"], "50");
    // rows that are gone are those of a slightly other linearisation
    same(&last, &batch, 0.2);
}

#[test]
fn estimates_come_before_the_pipe_ends() {
    let flagship = model("two_theodolite");
    let all = lines();
    let arguments =
        ["calibrate", &flagship, "--solver", "sequential", "--data", "vo_line=-", "--every", "20", "--format", "json"];
    let mut child = piped(&arguments);
    let mut stdin = child.stdin.take().unwrap();
    let mut out = BufReader::new(child.stdout.take().unwrap()).lines();
    stdin.write_all((all[..21].join("\n") + "\n").as_bytes()).unwrap();
    stdin.flush().unwrap();
    // the pipe is open still
    let first: Value = serde_json::from_str(&out.next().unwrap().unwrap()).unwrap();
    assert_eq!((first["rows"].as_u64(), first["equations"].as_u64()), (Some(20), Some(100)));
    stdin.write_all((all[21..61].join("\n") + "\n").as_bytes()).unwrap();
    drop(stdin);
    let rest: Vec<Value> = out.map(|line| serde_json::from_str(&line.unwrap()).unwrap()).collect();
    assert_eq!(rest.iter().map(|v| v["rows"].as_u64()).collect::<Vec<_>>(), [Some(40), Some(60), None]);
    assert!(child.wait().unwrap().code().is_some_and(|code| code < 2));
    let directory = tempfile::tempdir().unwrap();
    let batch = calibrate(0, &["--data", &part(&directory, 0..60)]);
    same(&rest[2], &batch, 1e-7);
    same(&rest[1], &batch, 1e-7);
}

#[test]
fn a_pipe_that_ends_within_a_row_leaves_the_rows_before_it() {
    let flagship = model("two_theodolite");
    let all = lines();
    let directory = tempfile::tempdir().unwrap();
    let state = path(&directory, "state.json");
    let mut child = piped(&["calibrate", &flagship, "--solver", "sequential", "--data", "vo_line=-", "--save", &state]);
    // even a last number that looks whole may have lost digits
    let text = all[..41].join("\n") + "\n" + all[41].trim_end_matches(|c: char| c.is_ascii_digit());
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let (mut out, mut err) = (String::new(), String::new());
    child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(2), "{err}");
    assert!(err.contains("E060") && err.contains("row 41") && out.is_empty(), "{err}");
    let resumed = calibrate(0, &[&BY_ROWS[..], &["--resume", &state, "--data", &part(&directory, 40..100)]].concat());
    same(&resumed, &calibrate(0, &["--data", &part(&directory, 0..100)]), 1e-7);
}

#[test]
fn parts_of_several_processes_are_one_fit() {
    let directory = tempfile::tempdir().unwrap();
    let parts = [0..100, 100..170, 170..300];
    for (how, share) in [("--keep=all", 1e-7), ("--hold-point", 1e-8)] {
        let mut resume = Vec::new();
        for (k, rows) in parts.iter().enumerate() {
            let state = path(&directory, &format!("{k}{how}.json"));
            let data = part(&directory, rows.clone());
            let _ = run_any(&[&BY_ROWS[..], &[how, "--data", &data, "--save", &state]].concat());
            resume.extend(["--resume".to_owned(), state]);
        }
        let resume: Vec<&str> = resume.iter().map(String::as_str).collect();
        let merged = run_any(&[&BY_ROWS[..], &[how], &resume].concat());
        let whole = match how {
            "--hold-point" => run_any(&[&BY_ROWS[..], &[how]].concat()),
            _ => calibrate(0, &[]),
        };
        same(&merged, &whole, share);
    }
}

/// A fit, trustworthy or not.
fn run_any(more: &[&str]) -> Value {
    let flagship = model("two_theodolite");
    let output = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args([&["calibrate", &flagship, "--format", "json"], more].concat())
        .output()
        .unwrap();
    assert!(output.status.code().is_some_and(|code| code < 2), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const PLACES: &str = r#"(
    name: "places",
    units: (length: "mm"),
    parameters: { "a": Scalar(Free("0 mm")), "place": Scalar(value: Free("0 mm"), family: true) },
    measurements: {
        "point": (keys: ["at"], inputs: { "y": (unit: "mm", sigma: "0.1 mm") }, residuals: { "r": "y - a - place[at]" }),
        "datum": (inputs: { "z": (unit: "mm", sigma: "0.05 mm") }, residuals: { "d": "z - a" }),
    },
)"#;

#[test]
fn members_may_come_later_by_the_pipe() {
    let directory = tempfile::tempdir().unwrap();
    // the third place comes when rows of the others are gone already
    let row = |i: usize| {
        let (place, at) = if i == 130 || i > 145 { ("r", 4.0) } else { [("p", 2.0), ("q", 3.0)][i % 2] };
        format!("{},{place}\n", at + 0.1 * ((i * i) as f64).sin())
    };
    let points = "y,at\n".to_owned() + &(0..150).map(row).collect::<String>();
    for (name, text) in [("model.ron", PLACES), ("datum.csv", "z\n1.0\n1.1\n"), ("point.csv", &points)] {
        fs::write(directory.path().join(name), text).unwrap();
    }
    let (model, datum) = (path(&directory, "model.ron"), format!("datum={}", path(&directory, "datum.csv")));
    let file = format!("point={}", path(&directory, "point.csv"));
    let batch = json(0, &["calibrate", &model, "--data", &datum, "--data", &file]);
    for keep in ["all", "0"] {
        let state = path(&directory, "state.json");
        let mut child = piped(&[
            "calibrate",
            &model,
            "--solver",
            "sequential",
            "--keep",
            keep,
            "--data",
            &datum,
            "--data",
            "point=-",
            "--every",
            "1",
            "--format",
            "json",
            "--save",
            &state,
        ]);
        let text = fs::read(directory.path().join("point.csv")).unwrap();
        child.stdin.take().unwrap().write_all(&text).unwrap();
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let all: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let members: Vec<usize> = all.iter().map(|v| v["parameters"].as_array().unwrap().len()).collect();
        assert_eq!((members.len(), &members[..5]), (153, &[1, 1, 2, 3, 3][..]));
        assert_eq!((members[131], members[132], members[152]), (3, 4, 4));
        let saved: Value = serde_json::from_str(&fs::read_to_string(&state).unwrap()).unwrap();
        assert_eq!(saved["absorbed"].is_null(), keep == "all");
        same(all.last().unwrap(), &batch, 1e-9);
        // it says what it was, and another choice is refused
        assert!(ends(0, &["calibrate", &model, "--solver", "sequential", "--resume", &state]).contains("place[r]"));
        let other = ["calibrate", &model, "--solver", "sequential", "--resume", &state, "--fix", "a"];
        assert_eq!(refused(&other), ["E061"]);
    }
}
