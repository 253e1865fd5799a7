//! What a run leaves behind that did not come to its end: interrupted, killed, or without room to write.
//!
//! `PHICAL_KILLS=200 cargo test whole` kills more often, and prints where the kills fell.
#![cfg(unix)]

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use serde_json::Value;

use crate::cli::path;
use crate::shared::project;

const SIGINT: i32 = 2;
const SIGTERM: i32 = 15;

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn send(child: &Child, signal: i32) {
    Command::new("kill").arg(format!("-{signal}")).arg(child.id().to_string()).status().unwrap();
}

/// Runs with a signal after a while. The while is found that brings `wanted`: shorter after what came too late, longer after
/// what came too early, which ends by the signal.
fn interrupted(arguments: &[&str], signal: i32, wanted: impl Fn(&Output) -> bool) -> Output {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut wait = 0.2;
    for _ in 0..30 {
        let child = start(arguments);
        sleep(Duration::from_secs_f64(wait));
        send(&child, signal);
        let out = child.wait_with_output().unwrap();
        if wanted(&out) {
            return out;
        }
        *(if out.status.signal().is_some() { &mut low } else { &mut high }) = wait;
        wait = if high.is_finite() { f64::midpoint(low, high) } else { 2.0 * wait };
    }
    panic!("no moment was found at which a signal stops {arguments:?}");
}

fn stderr(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

/// A model whose minimum is singular (Powell 1962), so that the way there is long, of rows that take long.
fn slow(directory: &tempfile::TempDir) -> String {
    let sines = (0..60).fold("x".to_owned(), |inner, _| format!("sin({inner})"));
    let model = format!(
        r#"(
            name: "slow",
            parameters: {{
                "a": Scalar(Free(nominal: 3, min: -9, max: 9)), "b": Scalar(Free(nominal: -1, min: -9, max: 9)),
                "c": Scalar(Free(nominal: 0.5, min: -9, max: 9)), "d": Scalar(Free(nominal: 1, min: -9, max: 9)),
            }},
            measurements: {{ "m": (
                data: "rows.csv",
                inputs: {{ "x": (unit: "1") }},
                define: {{ "w": "2 + {sines}" }},
                residuals: {{
                    "e": "w*(a + 10*b)", "f": "w*sqrt(5)*(c - d)", "g": "w*(b - 2*c)^2", "h": "w*sqrt(10)*(a - d)^2",
                }},
            ) }},
            scenarios: {{ "s": (measurements: {{ "m": (rows: 20000, draw: {{ "x": Uniform(0, 1) }}) }}) }},
        )"#
    );
    let rows: String = (0..30_000).map(|i| format!("{}\n", f64::from(i) * 1e-4)).collect();
    fs::write(directory.path().join("rows.csv"), format!("x\n{rows}")).unwrap();
    let file = path(directory, "model.ron");
    fs::write(&file, model).unwrap();
    file
}

/// Files of a directory that are nobody's.
fn left(directory: &Path) -> Vec<String> {
    let names = fs::read_dir(directory).unwrap().flatten().map(|entry| entry.file_name().into_string().unwrap());
    names.filter(|name| name.contains(".phical-")).collect()
}

#[test]
fn an_interrupted_fit_keeps_what_it_has() {
    let directory = tempfile::tempdir().unwrap();
    let (model, fit) = (slow(&directory), path(&directory, "fit.json"));
    for (signal, more) in [
        (SIGINT, &["--weights", "unit"][..]),
        (SIGTERM, &["--solver", "clarabel"]),
        (SIGINT, &["--solver", "clarabel", "--norm", "huber"]),
        (SIGINT, &["--starts", "40"]),
        (SIGINT, &["--loss", "cauchy"]),
        (SIGINT, &["--solver", "sequential"]),
    ] {
        let arguments = [&["calibrate", &model, "--out", &fit, "--format", "json"], more].concat();
        let said = |out: &Output| stderr(out).contains("warning[W050]");
        let out = interrupted(&arguments, signal, said);
        assert_eq!(out.status.code(), Some(1), "{more:?}: {}", stderr(&out));
        let written: Value = serde_json::from_slice(&fs::read(&fit).unwrap()).unwrap();
        let shown: Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!((&written["status"], &written["converged"]), (&"interrupted".into(), &false.into()), "{more:?}");
        assert_eq!(written, shown);
        assert!(written["warnings"].as_array().unwrap().iter().any(|warning| warning["code"] == "W050"));
        assert!(written["parameters"].as_array().unwrap().iter().all(|parameter| parameter["value"].is_f64()));
        assert_eq!(left(directory.path()), [""; 0], "{more:?}");
        fs::remove_file(&fit).unwrap();
    }
}

#[test]
fn runs_that_were_made_count() {
    let directory = tempfile::tempdir().unwrap();
    let model = slow(&directory);
    let arguments = ["coverage", &model, "--seeds", "100000", "--rows", "m=20", "--format", "json"];
    let out = interrupted(&arguments, SIGINT, |out| out.status.signal().is_none());
    assert_eq!(out.status.code(), Some(1));
    assert!(stderr(&out).contains("warning[W050]: interrupted after "), "{}", stderr(&out));
    let found: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!((1..100_000).contains(&found["runs"].as_u64().unwrap()));
}

#[test]
fn reading_ends_at_once_and_so_does_a_second_signal() {
    let directory = tempfile::tempdir().unwrap();
    let (model, fit) = (slow(&directory), path(&directory, "fit.json"));
    // of a pipe that says nothing
    let child = start(&["calibrate", &model, "--data", "m=-", "--out", &fit]);
    sleep(Duration::from_millis(500));
    send(&child, SIGINT);
    let out = child.wait_with_output().unwrap();
    assert_eq!((out.status.signal(), out.stdout.len()), (Some(SIGINT), 0));
    // one row at a time there is something to keep
    let state = path(&directory, "state.json");
    let child = start(&["calibrate", &model, "--solver", "sequential", "--data", "m=-", "--save", &state]);
    {
        use std::io::Write;
        child.stdin.as_ref().unwrap().write_all(b"x\n1\n2\n3\n").unwrap();
    }
    sleep(Duration::from_millis(1000));
    send(&child, SIGINT);
    // the pipe stays open: nobody waits for it
    let mut child = child;
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(begun.elapsed() < Duration::from_secs(20), "it waits for the pipe");
        sleep(Duration::from_millis(20));
    }
    let out = child.wait_with_output().unwrap();
    assert_eq!(out.status.code(), Some(1), "{}", stderr(&out));
    let saved: Value = serde_json::from_slice(&fs::read(&state).unwrap()).unwrap();
    assert_eq!(saved["rows"]["m"].as_array().unwrap().len(), 3);
    // two at once
    let child = start(&["calibrate", &model, "--out", &fit]);
    let begun = Instant::now();
    sleep(Duration::from_millis(400));
    send(&child, SIGINT);
    send(&child, SIGINT);
    let out = child.wait_with_output().unwrap();
    assert!(begun.elapsed() < Duration::from_secs(20));
    assert!(out.status.signal() == Some(SIGINT) || out.status.code().is_some());
    assert_eq!(left(directory.path()), [""; 0]);
}

/// A model with so many parameters that its fit file takes a while to be written.
fn large(directory: &tempfile::TempDir) -> String {
    const MEMBERS: usize = 160;
    let model = r#"(
        name: "large",
        parameters: { "p": Scalar(value: Free(0), family: true) },
        measurements: { "m": (
            data: "rows.csv", keys: ["of", "to"], inputs: { "x": (unit: "1", sigma: 0.1) },
            residuals: { "r": "p[of] + 0.3*p[to] - x" },
        ) },
    )"#;
    let row = |i: usize| format!("{},{},{}\n", i % MEMBERS, (i * 7 + i / MEMBERS) % MEMBERS, (i as f64).sin() * 0.1);
    let rows: String = (0..3 * MEMBERS).map(row).collect();
    fs::write(directory.path().join("rows.csv"), format!("of,to,x\n{rows}")).unwrap();
    let file = path(directory, "model.ron");
    fs::write(&file, model).unwrap();
    file
}

/// A file, if it is what a run has written as a whole: all its members, in their order, without times.
fn whole(file: &str) -> Option<Value> {
    let mut json: Value = serde_json::from_slice(&fs::read(file).ok()?).ok()?;
    json.as_object_mut()?.get_mut("timings_ns")?.take();
    Some(json)
}

#[test]
fn a_killed_run_leaves_the_old_file_or_the_new_one() {
    let kills: u32 = std::env::var("PHICAL_KILLS").map_or(20, |n| n.parse().expect("a number"));
    let directory = tempfile::tempdir().unwrap();
    let (model, fit) = (large(&directory), path(&directory, "fit.json"));
    let arguments = ["calibrate", &model, "--out", &fit];
    let run = || {
        let begun = Instant::now();
        let out = start(&arguments).wait_with_output().unwrap();
        assert!(out.status.code().is_some_and(|code| code < 2), "{}", stderr(&out));
        begun.elapsed().as_secs_f64()
    };
    run();
    let new = whole(&fit).expect("a fit");
    let size = fs::metadata(&fit).unwrap().len();
    assert!(size > 1_000_000, "{size} bytes");
    let old = b"{\"old\": true}\n".to_vec();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    // the end of a run, which a busy machine delays: kept up with by what was just seen
    let (mut early, mut late) = (0.5 * run(), run());
    let size_of = |name: &String| fs::metadata(directory.path().join(name)).map_or(0, |file| file.len());
    let part = || left(directory.path()).iter().any(|name| size_of(name) > 0);
    let (mut before, mut amid, mut after) = (0, 0, 0);
    for kill in 0..kills {
        fs::write(&fit, &old).unwrap();
        let mut child = start(&arguments);
        // writing does not take long: every fourth waits for it
        let aimed = kill % 4 == 0;
        let wait = random.random_range(early..1.1 * late);
        if aimed {
            while !part() && child.try_wait().unwrap().is_none() {}
        } else {
            sleep(Duration::from_secs_f64(wait));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        if fs::read(&fit).unwrap() != old {
            assert!(whole(&fit).as_ref() == Some(&new), "a part of a file, killed after {wait} s");
            after += 1;
            late = if aimed { late } else { 0.9 * late + 0.1 * wait };
        } else {
            *(if part() { &mut amid } else { &mut before }) += 1;
            (early, late) = if aimed { (early, late) } else { (0.9 * early + 0.1 * wait, late.max(1.02 * wait)) };
        }
        for name in left(directory.path()) {
            fs::remove_file(directory.path().join(name)).unwrap();
        }
    }
    eprintln!("{size} bytes, {kills} kills: {before} before, {amid} amid and {after} after writing");
    assert_eq!(before + amid + after, kills);
    assert!(kills < 20 || (before > 0 && amid > 0 && after > 0), "{before} before, {amid} amid, {after} after");
    // what a killed run has left is cleared up, what one that still writes has is not
    let remains = fs::File::create(directory.path().join(".fit.json.phical-AbCdEf")).unwrap();
    remains.lock().unwrap();
    run();
    assert_eq!(left(directory.path()), [".fit.json.phical-AbCdEf"]);
    drop(remains);
    run();
    assert_eq!(left(directory.path()), [""; 0]);
}

#[test]
fn places_that_take_nothing_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let flagship = project("models/two_theodolite/model.ron").display().to_string();
    let refused = |arguments: &[&str], why: &str| {
        let out = start(arguments).wait_with_output().unwrap();
        let said = stderr(&out);
        assert_eq!(out.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(why), "{arguments:?}: {said}");
    };
    // a folder that is a file, and one that nobody can write to
    let file = path(&directory, "file");
    fs::write(&file, "old").unwrap();
    let inside = format!("{file}/out");
    for place in [inside.as_str(), "/proc/phical"] {
        let why = format!("`{place}");
        refused(&["calibrate", &flagship, "--out", place], &why);
        refused(&["calibrate", &flagship, "--observations", place], &why);
        refused(&["calibrate", &flagship, "--solver", "sequential", "--save", place], &why);
        refused(&["derive", &flagship, "--to", "c", "--out", place], &why);
        refused(&["simulate", &flagship, "--out", place], &why);
        refused(&["design", &flagship, "--pick", "30", "--rows", "vo_line=60", "--out", place], &why);
    }
    if Path::new("/dev/full").exists() {
        refused(
            &["calibrate", &flagship, "--out", "/dev/full"],
            "error[E043]: `/dev/full` cannot be written: no storage space",
        );
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let out = Command::new(env!("CARGO_BIN_EXE_phical")).args(["check", &flagship]).stdout(full).output().unwrap();
        assert_eq!(out.status.code(), Some(2));
        assert!(stderr(&out).contains("standard output cannot be written: "), "{}", stderr(&out));
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "old");
    assert_eq!(left(directory.path()), [""; 0]);
}
