//! One calibration after the other, the second with what the first has found out: where all is linear, the fit of all data at once.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::cli::{json, path, refused};

/// A line, of which `first` sees all but how its height is made up, and `second` one part of the height and what the line bends by.
const LINE: &str = r#"Model(
    name: "a line, then a curve",
    units: (length: "mm", angle: "rad"),
    parameters: {
        "gain": Scalar(Free(1)), "left": Scalar(Free("1 mm")), "right": Scalar(Free("2 mm")), "bend": Scalar(value: Free(0), unit: "1/mm"),
        "other": Scalar(value: Free(nominal: "0 mm", sigma: "1 mm")),
    },
    measurements: {
        "first": (
            inputs: { "x": (unit: "mm"), "y": (unit: "mm", sigma: "0.1 mm") },
            residuals: { "line": "y - gain*x - left - right - other" },
        ),
        "second": (
            inputs: { "x": (unit: "mm"), "y": (unit: "mm", sigma: "0.2 mm") },
            residuals: { "curve": "y - gain*x - left - bend*x*x" },
        ),
    },
)"#;

/// A body is turned and shifted: `first` sees how it is turned, `second` how it is shifted, and a little of its turn.
const BODY: &str = r#"Model(
    name: "a body",
    units: (length: "mm", angle: "rad"),
    parameters: { "turn": Rotation(Free((0.5, -0.4, 0.9))), "shift": Vec3(Free((10, 20, 30))) },
    measurements: {
        "first": (
            inputs: { "a": (unit: "mm"), "b": (unit: "mm"), "c": (unit: "mm"),
                "x": (unit: "mm", sigma: "0.05 mm"), "y": (unit: "mm", sigma: "0.05 mm"), "z": (unit: "mm", sigma: "0.05 mm") },
            residuals: { "point": "turn * vec(a, b, c) - vec(x, y, z)" },
        ),
        "second": (
            inputs: { "a": (unit: "mm"), "b": (unit: "mm"), "c": (unit: "mm"),
                "x": (unit: "mm", sigma: "0.1 mm"), "y": (unit: "mm", sigma: "0.1 mm"), "z": (unit: "mm", sigma: "0.1 mm") },
            residuals: { "point": "shift + turn * vec(a, b, c) - vec(x, y, z)" },
        ),
    },
    scenarios: { "noisy": (
        seed: 1,
        truth: { "turn.rx": 0.51, "turn.ry": -0.42, "turn.rz": 0.93, "shift.x": 11 },
        measurements: {
            "first": (rows: 12, draw: { "a": Uniform(-300, 300), "b": Uniform(-300, 300), "c": Uniform(-300, 300) },
                define: { "p": "turn * vec(a, b, c)" }, set: { "x": "p.x", "y": "p.y", "z": "p.z" }),
            "second": (rows: 5, draw: { "a": Uniform(-300, 300), "b": Uniform(-300, 300), "c": Uniform(-300, 300) },
                define: { "p": "shift + turn * vec(a, b, c)" }, set: { "x": "p.x", "y": "p.y", "z": "p.z" }),
        },
    ) },
)"#;

fn write(directory: &TempDir, name: &str, text: &str) -> String {
    let file = path(directory, name);
    fs::write(&file, text).unwrap();
    file
}

/// A fit in the second step, and the fit of everything.
fn both(directory: &TempDir, model: &str, first: &str, second: &str, code: i32) -> (Value, Value) {
    let (first, second) = (format!("first={first}"), format!("second={second}"));
    let fit = path(directory, "first.json");
    json(1, &["calibrate", model, "--data", &first, "--out", &fit]);
    let cascade = json(code, &["calibrate", model, "--data", &second, "--known", &fit]);
    (cascade, json(code, &["calibrate", model, "--data", &first, "--data", &second]))
}

/// The same values to a share of their sigmas, the same sigmas to the same share, and the same of what is not estimable.
#[track_caller]
fn same(cascade: &Value, common: &Value, share: f64) {
    for (one, other) in cascade["parameters"].as_array().unwrap().iter().zip(common["parameters"].as_array().unwrap()) {
        assert_eq!((&one["name"], &one["estimable"]), (&other["name"], &other["estimable"]));
        let Some(sigma) = other["sigma"].as_f64() else {
            assert!(one["sigma"].is_null(), "{one} {other}");
            continue;
        };
        let apart = one["value"].as_f64().unwrap() - other["value"].as_f64().unwrap();
        assert!(apart.abs() <= share * sigma, "{one} {other}");
        assert!((one["sigma"].as_f64().unwrap() / sigma - 1.0).abs() <= share, "{one} {other}");
    }
}

fn curve() -> (String, String) {
    let noise = |i: i32| f64::from(i * 37 % 11 - 5) / 40.0;
    let row = |i: i32, bend: f64| {
        let x = f64::from(i);
        format!("{x},{}\n", 3.2 + 1.1 * x + bend * x * x + noise(i))
    };
    let table = |bend: f64| format!("x,y\n{}", (0..12).map(|i| row(i, bend)).collect::<String>());
    (table(0.0), table(0.01))
}

#[test]
fn of_a_line_is_the_common_fit() {
    let directory = tempfile::tempdir().unwrap();
    let model = write(&directory, "model.ron", LINE);
    let (first, second) = curve();
    let (first, second) = (write(&directory, "first.csv", &first), write(&directory, "second.csv", &second));
    // `right` and `other` are seen together only; the prior of `other` was used in the first step and is not used again
    let (cascade, common) = both(&directory, &model, &first, &second, 0);
    same(&cascade, &common, 1e-9);
    assert_eq!(cascade["provenance"]["options"]["known"].as_array().unwrap().len(), 1);
}

#[test]
fn what_the_first_step_cannot_see_stays_unseen() {
    let directory = tempfile::tempdir().unwrap();
    let text = LINE.replace("value: Free(nominal: \"0 mm\", sigma: \"1 mm\")", "Free(\"0 mm\")");
    let model = write(&directory, "model.ron", &text);
    let (first, second) = curve();
    let (first, second) = (write(&directory, "first.csv", &first), write(&directory, "second.csv", &second));
    let (cascade, common) = both(&directory, &model, &first, &second, 1);
    same(&cascade, &common, 1e-9);
    assert_eq!(cascade["null_directions"].as_array().unwrap().len(), 1, "{}", cascade["null_directions"]);
}

#[test]
fn parameters_that_the_second_model_has_not_are_eliminated() {
    let directory = tempfile::tempdir().unwrap();
    let model = write(&directory, "model.ron", LINE);
    let (first, second) = curve();
    let (first, second) = (write(&directory, "first.csv", &first), write(&directory, "second.csv", &second));
    let (_, common) = both(&directory, &model, &first, &second, 0);
    // as LINE without `right`, `other` and the first measurement
    let from = LINE.find("        \"first\": (").unwrap();
    let to = LINE.find("        \"second\": (").unwrap();
    let text = format!("{}{}", &LINE[..from], &LINE[to..])
        .replace("\"right\": Scalar(Free(\"2 mm\")), ", "")
        .replace("        \"other\": Scalar(value: Free(nominal: \"0 mm\", sigma: \"1 mm\")),\n", "");
    let rest = write(&directory, "rest.ron", &text);
    let fit = path(&directory, "first.json");
    let cascade = json(0, &["calibrate", &rest, "--data", &format!("second={second}"), "--known", &fit]);
    let of = |name: &str| {
        let find =
            |fit: &Value| fit["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name).unwrap().clone();
        (find(&cascade), find(&common))
    };
    for name in ["gain", "left", "bend"] {
        let (one, other) = of(name);
        let (a, b) = (one["sigma"].as_f64().unwrap(), other["sigma"].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-9, "{one} {other}");
        assert!((one["value"].as_f64().unwrap() - other["value"].as_f64().unwrap()).abs() < 1e-9 * b, "{one} {other}");
    }
}

#[test]
fn of_a_turned_body_is_the_common_fit_but_for_its_curvature() {
    let directory = tempfile::tempdir().unwrap();
    let model = write(&directory, "model.ron", BODY);
    for seed in ["1", "2", "3"] {
        let out = path(&directory, seed);
        json(0, &["simulate", &model, "--seed", seed, "--out", &out]);
        let (cascade, common) = both(&directory, &model, &format!("{out}/first.csv"), &format!("{out}/second.csv"), 0);
        same(&cascade, &common, 1e-3);
    }
}

#[test]
fn what_is_known_enters_every_solver() {
    let directory = tempfile::tempdir().unwrap();
    let model = write(&directory, "model.ron", LINE);
    let (first, second) = curve();
    let (first, second) = (write(&directory, "first.csv", &first), write(&directory, "second.csv", &second));
    let (cascade, _) = both(&directory, &model, &first, &second, 0);
    let (fit, second) = (path(&directory, "first.json"), format!("second={second}"));
    for solver in ["clarabel", "sequential"] {
        let other = json(0, &["calibrate", &model, "--data", &second, "--known", &fit, "--solver", solver]);
        same(&other, &cascade, 1e-7);
        assert_eq!((&other["dof"], &other["priors"]), (&cascade["dof"], &cascade["priors"]));
    }
}

#[test]
fn what_is_known_exactly_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let model = write(&directory, "model.ron", LINE);
    let (first, second) = curve();
    let first = format!("first={}", write(&directory, "first.csv", &first));
    let second = format!("second={}", write(&directory, "second.csv", &second));
    let fit = path(&directory, "first.json");
    json(1, &["calibrate", &model, "--data", &first, "--out", &fit]);
    let mut known: Value = serde_json::from_str(&fs::read_to_string(&fit).unwrap()).unwrap();
    known["covariance"]["matrix"].as_array_mut().unwrap().iter_mut().for_each(|row| row[0] = 0.0.into());
    known["covariance"]["matrix"][0].as_array_mut().unwrap().iter_mut().for_each(|entry| *entry = 0.0.into());
    fs::write(&fit, known.to_string()).unwrap();
    assert_eq!(refused(&["calibrate", &model, "--data", &second, "--known", &fit]), ["E041"]);
}
