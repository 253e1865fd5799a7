//! `evaluate` says how well its outputs are known: closed forms through files, and files that do not say.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::shared::numbers;

const LINE: &str = r#"(
    name: "line", units: (length: "mm"),
    parameters: { "a": Scalar(Free("0 mm")), "b": Scalar(Free(0)), "place": Scalar(value: Free("0 mm"), family: true) },
    measurements: {
        "point": (
            data: "line.csv", inputs: { "x": (unit: "mm"), "y": (unit: "mm") },
            residuals: { "r": (value: "y - a - b*x", sigma: "0.1 mm") },
        ),
        "daily": (
            keys: ["at"], inputs: { "x": (unit: "mm", sigma: "0.03 mm"), "y": (unit: "mm") },
            residuals: { "r": (value: "y - a - b*x - place[at]", sigma: "0.2 mm") },
            outputs: { "line": "a + b*x", "own": "a + b*x + place[at]" },
        ),
    },
)"#;

const X: [f64; 5] = [0.0, 1.0, 2.0, 3.0, 5.0];
const Y: [f64; 5] = [0.1, 2.2, 3.9, 6.1, 10.1];

fn run(directory: &Path, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(arguments)
        .args(["--format", "json"])
        .current_dir(directory)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}\n{text}\n{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).unwrap()
}

fn line() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let rows: String = X.iter().zip(Y).map(|(x, y)| format!("{x},{y}\n")).collect();
    for (name, text) in [
        ("model.ron", LINE),
        ("line.csv", &format!("x,y\n{rows}")),
        ("daily.csv", "at,x,y\nwall,1.5,4\nwall,-2,-3\nfloor,4,9\n"),
    ] {
        fs::write(directory.path().join(name), text).unwrap();
    }
    directory
}

fn output<'v>(found: &'v Value, name: &str) -> &'v Value {
    let outputs = found["measurements"]["daily"]["outputs"].as_array().unwrap();
    outputs.iter().find(|output| output["name"] == name).unwrap()
}

#[test]
fn a_line_is_known_as_its_formula_says() {
    let directory = line();
    let mean = |of: &dyn Fn(usize) -> f64| (0..5).map(of).sum::<f64>() / 5.0;
    let (mx, my) = (mean(&|i| X[i]), mean(&|i| Y[i]));
    let sxx = 5.0 * mean(&|i| (X[i] - mx).powi(2));
    let b = 5.0 * mean(&|i| (X[i] - mx) * (Y[i] - my)) / sxx;
    let a = my - b * mx;
    let scatter = (0..5).map(|i| (Y[i] - a - b * X[i]).powi(2)).sum::<f64>() / 3.0;
    for (weights, variance, dof) in [("sigma", 0.01, f64::INFINITY), ("unit", scatter, 3.0)] {
        run(directory.path(), &["calibrate", "model.ron", "--weights", weights, "--out", "fit.json"]);
        let found = run(directory.path(), &["evaluate", "model.ron", "--fit", "fit.json", "--data", "daily=daily.csv"]);
        let uncertainty = &output(&found, "line")["uncertainty"];
        let (caa, cab, cbb) = (variance * (0.2 + mx * mx / sxx), -variance * mx / sxx, variance / sxx);
        let mut sums = [0.0; 2];
        for (sigma, x) in numbers(&uncertainty["sigma"]).into_iter().zip([1.5, -2.0, 4.0]) {
            let parts = [b * b * 0.03f64.powi(2), caa + 2.0 * x * cab + x * x * cbb];
            let expected = (parts[0] + parts[1]).sqrt();
            assert!((sigma / expected - 1.0).abs() < 1e-9, "{weights} {x}: {sigma} {expected}");
            sums = [sums[0] + parts[0], sums[1] + parts[1]];
        }
        let total = sums[0] + sums[1];
        let shares: Vec<f64> =
            uncertainty["budget"].as_array().unwrap().iter().map(|part| part["share"].as_f64().unwrap()).collect();
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(shares[0], sums[0] / total);
        near(shares[1], sums[1] / total);
        assert_eq!((&uncertainty["budget"][0]["group"], shares[2]), (&"length".into(), 0.0));
        near(uncertainty["rms"].as_f64().unwrap(), (total / 3.0).sqrt());
        match uncertainty["effective_dof"].as_f64() {
            Some(found) => near(found / (dof * (total / sums[1]).powi(2)), 1.0),
            None => {
                assert!(dof.is_infinite() && (uncertainty["coverage_factor"].as_f64().unwrap() - 1.96).abs() < 1e-3)
            }
        }
        // members estimated for these rows, two of one and one of the other: by declared sigmas, or by their scatter
        let own = &output(&found, "own")["uncertainty"];
        assert_eq!(own["budget"][2]["group"], "members");
        if weights == "sigma" {
            let more: Vec<f64> = numbers(&own["sigma"])
                .iter()
                .zip(numbers(&uncertainty["sigma"]))
                .map(|(own, line)| own * own - line * line)
                .collect();
            [0.02, 0.02, 0.04].iter().zip(more).for_each(|(expected, found)| near(found, *expected));
        }
        let together = &found["measurements"]["daily"]["covariance"];
        let (first, line) = (numbers(&together[0][0]), uncertainty["sigma"][0].as_f64().unwrap());
        near(first[0], line * line);
        near(first[1], line * line);
    }
}

#[test]
fn a_file_that_does_not_say_how_well_gives_no_uncertainty() {
    let directory = line();
    let evaluate = |fit: &str| {
        run(directory.path(), &["evaluate", "model.ron", "--fit", fit, "--data", "daily=daily.csv", "--expr", "2*x"])
    };
    run(directory.path(), &["calibrate", "model.ron", "--weights", "sigma", "--out", "fit.json"]);
    let fit: Value = serde_json::from_str(&fs::read_to_string(directory.path().join("fit.json")).unwrap()).unwrap();
    let without = |change: &dyn Fn(&mut Value)| {
        let mut fit = fit.clone();
        change(&mut fit);
        fs::write(directory.path().join("other.json"), fit.to_string()).unwrap();
        evaluate("other.json")
    };
    let remove = |fit: &mut Value, key: &str| {
        fit.as_object_mut().unwrap().remove(key);
    };
    for (found, why) in [
        (without(&|fit| *fit = serde_json::json!({"a": 0.1, "b": 2.0})), "states values"),
        (without(&|fit| remove(fit, "covariance")), "nothing of its covariance"),
        (without(&|fit| fit["covariance"] = Value::Null), "how large errors are"),
        (without(&|fit| fit["converged"] = false.into()), "did not converge"),
        (without(&|fit| remove(fit, "provenance")), "of which model"),
        (without(&|fit| fit["provenance"]["model_fingerprint"] = "other".into()), "another model"),
    ] {
        assert!(found["notes"].to_string().contains(why), "{}", found["notes"]);
        let line = &output(&found, "line")["uncertainty"];
        assert!(line["sigma"].as_array().unwrap().iter().all(Value::is_null), "{why}");
        assert_eq!((&line["gaps"][0]["why"], &line["coverage_factor"]), (&"unstated".into(), &Value::Null));
        // what depends on readings alone does not need to be told
        assert_eq!(numbers(&output(&found, "2*x")["uncertainty"]["sigma"]), [0.06; 3]);
    }
    let nominal = run(directory.path(), &["evaluate", "model.ron", "--data", "daily=daily.csv", "--expr", "x + a"]);
    assert!(nominal["notes"].to_string().contains("of the readings alone"));
    assert_eq!(numbers(&output(&nominal, "x + a")["uncertainty"]["sigma"]), [0.03; 3]);
    assert_eq!(output(&nominal, "line")["uncertainty"]["gaps"][0]["why"], "nothing");
}
