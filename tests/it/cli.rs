//! The command line as its users and their scripts meet it: exit codes, streams, JSON, files.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

pub fn model(name: &str) -> String {
    format!("{}/models/{name}/model.ron", env!("CARGO_MANIFEST_DIR"))
}

fn misra() -> String {
    model("nist/Misra1a")
}

pub fn phical(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_phical")).args(arguments).output().unwrap()
}

/// Standard output, of a run that ends with `code`.
pub fn ends(code: i32, arguments: &[&str]) -> String {
    let output = phical(arguments);
    let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{out}\n{err}");
    if code == 2 && !arguments.contains(&"json") {
        assert_eq!(out, "", "{arguments:?}");
        assert!(err.contains("error"), "{err}");
    }
    out
}

pub fn json(code: i32, arguments: &[&str]) -> Value {
    let mut all = arguments.to_vec();
    all.extend(["--format", "json"]);
    serde_json::from_str(&ends(code, &all)).unwrap()
}

/// The codes of the errors of a run with wrong input.
pub fn refused(arguments: &[&str]) -> Vec<String> {
    ends(2, arguments);
    let errors = json(2, arguments);
    errors["errors"].as_array().unwrap().iter().map(|e| e["code"].as_str().unwrap_or("usage").to_owned()).collect()
}

/// A directory with files in it.
fn files(all: &[(&str, &str)]) -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in all {
        fs::write(directory.path().join(name), text).unwrap();
    }
    directory
}

pub fn path(directory: &TempDir, name: &str) -> String {
    directory.path().join(name).display().to_string()
}

/// A straight line with a datum that is missing: only `a + c` is seen.
const LINE: &str = r#"(
    name: "line",
    units: (length: "mm", angle: "deg"),
    parameters: {
        "a": Scalar(Free("0 mm")), "b": Scalar(Free(nominal: "0 mm", min: "-10 mm", max: "10 mm")), "c": Scalar(Held("0 mm")),
        "place": Scalar(value: Free("0 mm"), family: true),
    },
    measurements: {
        "point": (
            data: [(file: "line.csv"), (file: "check.csv", role: Check)],
            keys: ["at"],
            inputs: { "x": (), "y": (unit: "mm", sigma: "0.1 mm") },
            residuals: { "r": (value: "y - a - c - b*x - place[at]", sigma: "0.1 mm") },
            outputs: { "line": "a + b*x" },
        ),
        "daily": ( inputs: { "t": (unit: "m") }, residuals: { "d": "vec(a - t, b, place_at)" }, define: { "place_at": "a" } ),
        "datum": ( residuals: { "d": (value: "a", sigma: "0.001 mm") } ),
    },
    scenarios: { "s": (seed: 3, truth: { "b": "2 mm" }, measurements: {
        "point": (rows: 8, draw: { "x": Uniform(0, 1), "at": Cycle(["p", "q"]) }, set: { "y": "a + b*x + place[at]" }),
    }) },
)"#;

const ROWS: &str = "x,y,at\n0,0.1,p\n1,2.2,p\n2,3.9,p\n0,1.1,q\n1,3.0,q\n2,5.1,q\n";

fn line() -> TempDir {
    files(&[("model.ron", LINE), ("line.csv", ROWS), ("check.csv", "x,y,at\n0,7.1,new\n1,9.0,new\n")])
}

#[test]
fn a_good_fit_ends_with_zero_and_has_every_key() {
    let fit = json(0, &["calibrate", &misra()]);
    for key in [
        "status",
        "converged",
        "cost",
        "sum_of_squares",
        "dof",
        "sigma0",
        "iterations",
        "rank",
        "trace",
        "parameters",
        "null_directions",
        "provenance",
        "correlations",
        "residual_rms",
        "timings_ns",
        "warnings",
    ] {
        assert!(!fit[key].is_null(), "{key}");
    }
    for key in ["read", "compile", "evaluate", "linear_algebra", "total", "per_row_per_iteration"] {
        assert!(fit["timings_ns"][key].as_f64().unwrap() >= 0.0, "{key}");
    }
    for key in ["name", "value", "unit", "sigma", "estimable", "at_bound"] {
        assert!(fit["parameters"][0].get(key).is_some(), "{key}");
    }
    let provenance = &fit["provenance"];
    assert_eq!(provenance["model_fingerprint"].as_str().unwrap().len(), 64);
    assert_eq!(provenance["data"][0]["rows"], 14);
    assert_eq!(provenance["data"][0]["fingerprint"].as_str().unwrap().len(), 64);
    for key in ["weights", "solver", "fix", "free", "start"] {
        assert!(provenance["options"].get(key).is_some(), "{key}");
    }
    assert!((fit["parameters"][0]["value"].as_f64().unwrap() / 238.942_129_18 - 1.0).abs() < 1e-9);
}

#[test]
fn the_verdict_is_the_first_sentence() {
    assert!(
        ends(0, &["calibrate", &misra()])
            .starts_with("Trustworthy: converged, all 2 parameters estimable; weights are unit")
    );
    let directory = line();
    let model = path(&directory, "model.ron");
    let text = ends(1, &["calibrate", &model, "--free", "c", "--fix", "place[*]"]);
    assert!(text.starts_with("Not trustworthy: "), "{text}");
    let fit = json(1, &["calibrate", &model, "--free", "c"]);
    assert_eq!(fit["converged"], true);
    assert!(fit["parameters"].as_array().unwrap().iter().any(|p| p["estimable"] == false && p["sigma"].is_null()));
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let directory = tempfile::tempdir().unwrap();
    let file = path(&directory, "fit.json");
    let fit = json(0, &["calibrate", &misra(), "--out", &file]);
    let written: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(fit["parameters"], written["parameters"]);
    assert_eq!(fit["trace"], written["trace"]);
    let evaluation = json(0, &["evaluate", &misra(), "--fit", &file]);
    assert_eq!(evaluation["measurements"]["observation"]["residuals"][0]["rms"], fit["residual_rms"]["r"]);
    assert_eq!(evaluation["values"]["same_model"], true);

    let again = json(0, &["calibrate", &misra(), "--start", &file]);
    assert_eq!(again["converged"], true);
    assert!(again["iterations"].as_u64().unwrap() <= 1, "{}", again["iterations"]);
    let at = json(0, &["jacobian", &misra(), "--at", &file]);
    assert_eq!(at["at"]["fit"]["q"][1], fit["parameters"][1]["value"]);
}

#[test]
fn nothing_is_left_of_a_file_that_cannot_be_written() {
    let directory = tempfile::tempdir().unwrap();
    assert_eq!(refused(&["calibrate", &misra(), "--out", &path(&directory, "no/fit.json")]), ["E043"]);
    let file = path(&directory, "fit.json");
    fs::write(&file, "before").unwrap();
    // a mistake that shows only after the file was asked for
    assert_eq!(refused(&["calibrate", &misra(), "--out", &file, "--start", "nowhere.json"]), ["E002"]);
    assert_eq!(fs::read_to_string(&file).unwrap(), "before");
    assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
}

#[test]
fn wrong_input_ends_with_two_and_names_its_code() {
    let directory = line();
    let model = path(&directory, "model.ron");
    fs::write(directory.path().join("broken.ron"), "(name: \"x\"").unwrap();
    fs::write(directory.path().join("bad.json"), "{\"a\": \"one\"}").unwrap();
    let bad = path(&directory, "bad.json");
    for (arguments, codes) in [
        (&["check", "no/such.ron"][..], &["E002"][..]),
        (&["check", &path(&directory, "broken.ron")], &["E001"]),
        (&["calibrate", &model, "--data", "poin=x.csv"], &["E024"]),
        (&["calibrate", &model, "--data", "point=none.csv"], &["E027"]),
        (&["calibrate", &model, "--data", "point"], &["usage"]),
        (&["calibrate", &model, "--fix", "z"], &["E022"]),
        (&["calibrate", &model, "--free", "z"], &["E022"]),
        (&["calibrate", &model, "--fix", "a=1 deg"], &["E012"]),
        (&["calibrate", &model, "--start", &bad], &["E041"]),
        (&["calibrate", &model, "--norm", "l1"], &["E042"]),
        (&["calibrate", &model, "--keep", "3", "--start", &bad], &["E042", "E041"]),
        (&["calibrate", &model, "--loss", "hubr"], &["E006"]),
        (&["calibrate", &model, "--loss", "huber:-1"], &["E020"]),
        (&["calibrate", &model, "--solver", "newton"], &["usage"]),
        (&["evaluate", &model, "--fit", &bad], &["E041"]),
        (&["evaluate", &model, "--expr", "a +"], &["E010"]),
        (&["jacobian", &model, "--at", &bad], &["E041"]),
        (&["simulate", &model, "--scenario", "t"], &["E025"]),
        (&["simulate", &model, "--rows", "poin=3"], &["E024"]),
        (&["simulate", &model, "--rows", "daily=3"], &["E024"]),
        (&["simulate", &model, "--rows", "point=many"], &["usage"]),
        (&["explain", "E999"], &["usage"]),
        (&["design", &model, "--pick", "many"], &["usage"]),
    ] {
        assert_eq!(refused(arguments), codes, "{arguments:?}");
    }
    assert_eq!(refused(&["calibrate", &model, "--weights", "sigma", "--data", "daily=-"]), ["E035"]);
}

#[test]
fn a_constant_cannot_be_fixed() {
    let theodolites = model("two_theodolite");
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().display().to_string();
    ends(0, &["simulate", &theodolites, "--rows", "vo_line=5", "--out", &out]);
    let data = format!("vo_line={}", path(&directory, "vo_line.csv"));
    assert_eq!(refused(&["calibrate", &theodolites, "--data", &data, "--fix", "L0.phi"]), ["E023"]);
    let found = json(2, &["calibrate", &theodolites, "--data", &data, "--fix", "L1.alhpa"]);
    assert!(found["errors"][0]["hint"].as_str().unwrap().contains("did you mean `L1.alpha`"));
}

#[test]
fn check_summarises() {
    let directory = line();
    let found = json(0, &["check", &path(&directory, "model.ron")]);
    assert_eq!(found["ok"], true);
    assert_eq!(found["units"]["angle"], "deg");
    let names: Vec<&str> =
        found["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["a", "b", "c", "place[*]"]);
    assert_eq!(found["parameters"][1]["max"], 10.0);
    assert_eq!(found["parameters"][2]["role"], "held");
    let point = &found["measurements"][0];
    assert_eq!(point["inputs"], serde_json::json!(["x", "y"]));
    assert_eq!(point["columns"][1]["sigma"], 0.1);
    assert_eq!(point["parameters_used"], serde_json::json!(["a", "b", "c", "place"]));
    assert!(found["operations"]["per_row"].as_u64().unwrap() > 0);
    assert_eq!(found["scenarios"][0]["measurements"][0]["rows"], 8);
    assert!(ends(0, &["check", &path(&directory, "model.ron")]).contains("[-10, 10]"));
}

#[test]
fn members_that_the_fit_has_not_seen_are_estimated_alone() {
    let directory = line();
    let (model, fit) = (path(&directory, "model.ron"), path(&directory, "fit.json"));
    let fitted = json(0, &["calibrate", &model, "--weights", "sigma", "--out", &fit]);
    let names: Vec<&str> =
        fitted["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["a", "b", "place[p]", "place[q]"]);
    let checked = json(0, &["evaluate", &model, "--fit", &fit, "--check"]);
    let estimated = checked["estimated"]["parameters"].as_array().unwrap();
    assert_eq!(estimated.len(), 1);
    assert_eq!(estimated[0]["name"], "place[new]");
    // the mean of what the line leaves: all else stays at the fit's values
    let value = |name: &str| {
        let all = fitted["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).unwrap()["value"].as_f64().unwrap()
    };
    let expected = (7.1 + 9.0 - value("b")) / 2.0 - value("a");
    assert!((estimated[0]["value"].as_f64().unwrap() - expected).abs() < 1e-12);
    let sigma = estimated[0]["sigma"].as_f64().unwrap();
    assert!((sigma - 0.1 / 2f64.sqrt()).abs() < 1e-12);

    let same = json(0, &["evaluate", &model, "--fit", &fit]);
    assert!(same["estimated"].is_null());
    let nominal = json(0, &["evaluate", &model, "--check"]);
    assert!(nominal["estimated"].is_null());
    assert_eq!(nominal["measurements"]["point"]["residuals"][0]["max_abs"], 9.0);
}

#[test]
fn data_are_replaced_and_vectors_have_a_length() {
    let directory = line();
    let model = path(&directory, "model.ron");
    let other = path(&directory, "other.csv");
    fs::write(&other, "t\n0.003\n0.004\n").unwrap();
    let values = path(&directory, "values.json");
    // outside the bounds of a fit, and evaluated all the same
    fs::write(&values, r#"{"a": 0, "b": 12, "place[p]": 0, "place[q]": 0}"#).unwrap();
    let data = format!("daily={other}");
    let found = json(0, &["evaluate", &model, "--fit", &values, "--data", &data, "--expr", "a - t"]);
    let daily = &found["measurements"]["daily"];
    assert_eq!(daily["rows"], 2);
    assert_eq!(daily["residuals"][1]["mean"], 12.0);
    assert_eq!(daily["residuals"][0]["worst_row"], 2);
    assert_eq!(daily["vectors"][0]["name"], "d");
    assert!((daily["vectors"][0]["rms"].as_f64().unwrap() - 156.5f64.sqrt()).abs() < 1e-13);
    assert_eq!(daily["outputs"][0]["values"], serde_json::json!([-3.0, -4.0]));
    // given data, it looks at nothing else
    assert!(found["measurements"]["point"].is_null());
}

#[test]
fn a_jacobian_has_rows_of_its_own_members_and_reported_units() {
    let directory = line();
    let model = path(&directory, "model.ron");
    let found = json(0, &["jacobian", &model, "--fix", "a"]);
    let point = &found["measurements"]["point"];
    assert_eq!(point["parameters"], serde_json::json!(["b", "place[p]", "place[q]"]));
    assert_eq!(point["rows"][1], serde_json::json!([1.0, 2.2]));
    let at = &point["at"]["nominal"];
    assert_eq!(at["dr_dq"][2][0], serde_json::json!([-2.0, -1.0, 0.0]));
    assert_eq!(at["dr_dq"][5][0], serde_json::json!([-2.0, 0.0, -1.0]));
    assert_eq!(at["dr_dx"][5][0], serde_json::json!([0.0, 1.0]));
    assert_eq!(at["r"][5][0], 5.1);
    assert!(ends(0, &["jacobian", &model]).contains("d/d place[q]"));
    // degrees: the derivative of sin at 60° by one degree
    let turned = files(&[
        (
            "model.ron",
            r#"(name: "t", units: (angle: "deg"), parameters: {"q": Scalar(Free("60 deg"))},
                measurements: {"m": (data: "d.csv", inputs: {"x": (unit: "gon")}, residuals: {"r": "sin(q) - x"})})"#,
        ),
        ("d.csv", "x\n100\n"),
    ]);
    let found = json(0, &["jacobian", &path(&turned, "model.ron")]);
    let at = &found["at"]["nominal"];
    assert_eq!(found["rows"][0][0], 90.0);
    assert!((at["q"][0].as_f64().unwrap() - 60.0).abs() < 1e-13);
    let unit = found["units"]["r"].as_str().unwrap();
    let one = if unit == "deg" { 1.0 } else { 1f64.to_radians() };
    assert!((at["dr_dq"][0][0][0].as_f64().unwrap() - 0.5 * one).abs() < 1e-15, "{unit}");
    assert!((at["dr_dx"][0][0][0].as_f64().unwrap() + one).abs() < 1e-15);
}

#[test]
fn simulation_writes_data_and_truth_and_the_same_again() {
    let directory = line();
    let model = path(&directory, "model.ron");
    let (one, two) = (path(&directory, "made/one"), path(&directory, "two"));
    let made = json(0, &["simulate", &model, "--rows", "point=5", "--seed", "9", "--out", &one]);
    assert_eq!((&made["seed"], &made["files"][0]["rows"]), (&9.into(), &5.into()));
    ends(0, &["simulate", &model, "--rows", "point=5", "--seed", "9", "--out", &two]);
    for name in ["point.csv", "truth.json"] {
        let read = |folder: &str| fs::read(Path::new(folder).join(name)).unwrap();
        assert_eq!(read(&one), read(&two), "{name}");
    }
    ends(0, &["simulate", &model, "--exact", "--out", &one]);
    let truth = path(&directory, "made/one/truth.json");
    let data = format!("point={}", path(&directory, "made/one/point.csv"));
    let exact = json(0, &["evaluate", &model, "--fit", &truth, "--data", &data]);
    let rms = exact["measurements"]["point"]["residuals"][0]["rms"].as_f64().unwrap();
    assert!(rms < 1e-12, "{rms}");
}

#[test]
fn standard_input_is_data() {
    let directory = line();
    let model = path(&directory, "model.ron");
    let mut child = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(["calibrate", &model, "--data", "point=-", "--format", "json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(ROWS.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let fit: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(fit["provenance"]["data"][0]["fingerprint"], phical::data::fingerprint(ROWS.as_bytes()));
    assert_eq!(fit["provenance"]["data"][0]["rows"], 6);
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(["jacobian", &misra()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
}

#[test]
fn warnings_go_to_standard_error_and_into_the_json() {
    let directory = tempfile::tempdir().unwrap();
    let out: PathBuf = directory.path().into();
    ends(0, &["simulate", &model("two_theodolite"), "--rows", "vo_line=40", "--out", &out.display().to_string()]);
    let data = format!("vo_line={}", path(&directory, "vo_line.csv"));
    let output = phical(&["calibrate", &model("two_theodolite"), "--data", &data]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("W007"));
    assert!(!String::from_utf8_lossy(&output.stdout).contains("W007"));
    let codes = |arguments: &[&str]| -> Vec<String> {
        let fit = json(0, arguments);
        fit["warnings"].as_array().unwrap().iter().map(|w| w["code"].as_str().unwrap().to_owned()).collect()
    };
    assert!(codes(&["calibrate", &model("two_theodolite"), "--data", &data]).contains(&"W007".into()));
    let unit = codes(&["calibrate", &model("two_theodolite"), "--data", &data, "--weights", "unit"]);
    assert!(unit.contains(&"W007".into()));
}

#[test]
fn every_code_is_explained() {
    let all = json(0, &["explain", "--all"]);
    for entry in all["codes"].as_array().unwrap() {
        let code = entry["code"].as_str().unwrap();
        assert_eq!(&json(0, &["explain", code]), entry);
    }
    assert_eq!(ends(0, &["explain"]), ends(0, &["explain", "--all"]));
    assert!(ends(0, &["explain", "e012"]).starts_with("E012"));
}
