//! Models compared: nested fits, fits with other datums, repeated rows, rows held out, components of variance.

use std::fmt::Write as _;
use std::fs;

use phical::session::Procedure;

use crate::cli::{json, model, path, refused};
use crate::close::close;
use crate::fitting::{bound, fitted, table};
use crate::flagship::compiled;

const LINE: &str = r#"(
    name: "line",
    parameters: { "a": Scalar(Free(0)), "b": Scalar(Free(1)), "c": Scalar(Held(0)) },
    measurements: { "point": (data: "data.csv", inputs: {"x": (), "y": (SIGMA)}, residuals: {"r": "y - a - b*x - c*x^2"}) },
)"#;

/// A folder with the model and data of a parabola that is almost a line.
fn folder(sigma: &str, bend: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("model.ron"), LINE.replace("SIGMA", sigma)).expect("written");
    let mut text = "x,y\n".to_owned();
    for k in 0..40 {
        let x = f64::from(k / 2) / 4.0;
        let noise = 0.1 * (f64::from(k) * 12.9898).sin() + 0.07 * (f64::from(k) * 78.233).cos();
        let _ = writeln!(text, "{x},{}", 1.0 + 2.0 * x + bend * x * x + noise);
    }
    fs::write(folder.path().join("data.csv"), text).expect("written");
    folder
}

fn number(value: &serde_json::Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{pointer} in {value}"))
}

#[test]
fn a_parameter_that_is_needed_pays_and_one_that_is_not_does_not() {
    for (sigma, bend, pays) in
        [("", 0.05, true), ("", 0.0, false), ("sigma: 0.1", 0.05, true), ("sigma: 0.1", 0.0, false)]
    {
        let folder = folder(sigma, bend);
        let (file, small, large) = (path(&folder, "model.ron"), path(&folder, "s.json"), path(&folder, "l.json"));
        let code = if bend > 0.0 && !sigma.is_empty() { 1 } else { 0 };
        let one = json(code, &["calibrate", &file, "--out", &small]);
        let two = json(0, &["calibrate", &file, "--free", "c", "--out", &large]);
        let found = json(0, &["compare", &file, &small, &large]);
        assert_eq!(found.pointer("/nested/pays"), Some(&serde_json::json!(pays)), "{sigma} {bend}: {found}");
        assert_eq!(found["nested"]["smaller"], serde_json::json!(small));
        let (s0, s1) = (2.0 * number(&one, "/cost"), 2.0 * number(&two, "/cost"));
        if sigma.is_empty() {
            // F = t² of the parameter between them
            let c = two["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "c").unwrap();
            let t = number(c, "/value") / number(c, "/sigma");
            close(&[number(&found, "/nested/f/statistic")], &[t * t], 1e-8, "F");
            close(&[number(&found, "/nested/f/statistic")], &[(s0 - s1) / (s1 / 37.0)], 1e-9, "F");
        } else {
            close(&[number(&found, "/nested/likelihood_ratio/statistic")], &[s0 - s1], 1e-9, "likelihood ratio");
        }
    }
}

#[test]
fn what_cannot_be_compared_says_why() {
    let folder = folder("", 0.0);
    let (file, fit) = (path(&folder, "model.ron"), path(&folder, "f.json"));
    json(0, &["calibrate", &file, "--out", &fit]);
    let found = json(0, &["compare", &file, &fit, &fit]);
    assert_eq!(found["nested"]["comparable"], false);
    assert_eq!(refused(&["compare", &file, &fit, "none.json"]), ["E002"]);
    fs::write(folder.path().join("bad.json"), "{\"a\": \"x\"}").unwrap();
    assert_eq!(refused(&["compare", &file, &fit, &path(&folder, "bad.json")]), ["E041"]);
}

/// Two datums of the flagship: the base held along the left standing axis, or along the right one.
#[test]
fn another_datum_is_no_difference() {
    let folder = tempfile::tempdir().expect("a folder");
    let (left, right) = (path(&folder, "left.json"), path(&folder, "right.json"));
    let file = model("two_theodolite");
    let one = json(0, &["calibrate", &file, "--out", &left]);
    // a datum that is not that of the other: the offset of the right axis at a tenth of a millimetre
    let two = json(0, &["calibrate", &file, "--free", "L1.b", "--fix", "R1.b=0.1 mm", "--out", &right]);
    close(&[number(&one, "/cost")], &[number(&two, "/cost")], 1e-9, "the same minimum");
    let value = |fit: &serde_json::Value, name: &str| {
        let all = fit["parameters"].as_array().unwrap();
        all.iter().find(|p| p["name"] == name).map_or(f64::NAN, |p| number(p, "/value"))
    };
    let moved = value(&two, "L1.b");
    assert!(moved.abs() > 0.3, "the datum moves L1.b by {moved}");
    let found = json(0, &["compare", &file, &left, &right]);
    let agreement = &found["agreement"];
    assert_eq!((agreement["invisible"].as_u64(), agreement["dof"].as_u64()), (Some(1), Some(20)));
    for difference in agreement["differences"].as_array().unwrap() {
        // first order: the curve of equally good points bends
        let (d, sigma) = (number(difference, "/value"), number(difference, "/sigma"));
        assert!(d.abs() < 0.02 * sigma, "{difference}");
    }
    assert!(number(agreement, "/test/statistic") < 0.1);
}

#[test]
fn repeated_rows_show_a_lack_of_fit() {
    let found = json(0, &["calibrate", &path(&folder("", 0.0), "model.ron")]);
    assert!(number(&found, "/lack_of_fit/upper_tail") > 0.01);
    assert_eq!((found["lack_of_fit"]["groups"].as_u64(), found["lack_of_fit"]["dof"].as_u64()), (Some(20), Some(20)));
    let bent = folder("", 0.1);
    let found = json(0, &["calibrate", &path(&bent, "model.ron")]);
    assert!(number(&found, "/lack_of_fit/upper_tail") < 1e-4);
    // by hand: pairs of rows scatter around their means
    let text = fs::read_to_string(bent.path().join("data.csv")).unwrap();
    let y: Vec<f64> = text.lines().skip(1).map(|line| line.split(',').nth(1).unwrap().parse().unwrap()).collect();
    let pure: f64 = y.chunks(2).map(|pair| (pair[0] - pair[1]).powi(2) / 2.0).sum();
    close(&[number(&found, "/lack_of_fit/pure_error")], &[pure], 1e-9, "pure error");
    let s = 2.0 * number(&found, "/cost");
    close(&[number(&found, "/lack_of_fit/f")], &[((s - pure) / 18.0) / (pure / 20.0)], 1e-9, "F");
}

#[test]
fn rows_held_out_are_predicted_as_by_hand() {
    let folder = folder("", 0.0);
    let found = json(0, &["calibrate", &path(&folder, "model.ron"), "--folds", "4"]);
    let text = fs::read_to_string(folder.path().join("data.csv")).unwrap();
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let program = compiled(&LINE.replace("SIGMA", ""));
    let mut squares = 0.0;
    for fold in 0..4 {
        let (mut kept, mut held) = (Vec::new(), Vec::new());
        rows.iter()
            .enumerate()
            .for_each(|(k, row)| if k % 4 == fold { held.push(row) } else { kept.push(row.clone()) });
        let fit = fitted(&program, &[table(&kept)]);
        let (a, b) = (fit.parameters[0].value, fit.parameters[1].value);
        squares += held.iter().map(|row| (row[1] - a - b * row[0]).powi(2)).sum::<f64>();
    }
    close(&[number(&found, "/hold_out/per_equation")], &[squares / 40.0], 1e-9, "squares");
    assert!(number(&found, "/hold_out/within") < number(&found, "/hold_out/per_equation"));
    assert_eq!(refused(&["calibrate", &path(&folder, "model.ron"), "--folds", "1"]), ["E035"]);
}

#[test]
fn the_size_of_errors_is_found_by_groups() {
    // y is declared three times too good, z twice too bad
    let program = compiled(
        r#"(
        name: "two lines",
        parameters: { "a": Scalar(Free(0)), "b": Scalar(Free(1)) },
        measurements: { "point": (
            inputs: { "x": (), "y": (sigma: 0.1, group: "y"), "z": (sigma: 0.2, group: "z") },
            residuals: { "y": "y - a - b*x", "z": "z + a - b*x" },
        ) },
    )"#,
    );
    let normal = |k: usize, salt: f64| {
        let u = |s: f64| ((k as f64 + 1.0) * s + salt).sin().mul_add(43758.5453, 0.0).rem_euclid(1.0);
        (-2.0 * u(12.9898).max(1e-12).ln()).sqrt() * (std::f64::consts::TAU * u(78.233)).cos()
    };
    let rows: Vec<Vec<f64>> = (0..2000)
        .map(|k| {
            let x = k as f64 / 200.0;
            vec![x, 1.0 + 2.0 * x + 0.3 * normal(k, 0.1), -1.0 + 2.0 * x + 0.1 * normal(k, 0.7)]
        })
        .collect();
    let problem = bound(&program, &[table(&rows)], phical::problem::Selection::default(), None);
    let procedure = Procedure { variance_components: true, ..Procedure::default() };
    let fit = phical::session::fit_by(&problem, &procedure).expect("it fits");
    let of = |group: &str| fit.components.iter().find(|c| c.group == group).expect("known");
    for (group, factor) in [("y", 3.0), ("z", 0.5)] {
        let found = of(group);
        let sigma = found.sigma.expect("controlled");
        assert!((found.factor - factor).abs() < 3.5 * sigma, "{group}: {} ± {sigma}", found.factor);
        assert!(sigma < 0.03 * factor);
    }
    // with these the errors are as large as they are said to be
    let chi = fit.chi_squared.expect("real");
    assert!((chi.value / chi.dof as f64 - 1.0).abs() < 1e-6);
    let unit =
        bound(&program, &[table(&rows)], phical::problem::Selection::default(), Some(phical::problem::Weights::Unit));
    assert!(phical::session::fit_by(&unit, &procedure).is_err());
}

#[test]
fn snooping_takes_out_what_was_planted_and_nothing_else() {
    let program = compiled(&LINE.replace("SIGMA", "sigma: 0.1"));
    let noise = |k: usize| 0.15 * ((k * k) as f64 * 0.7 + k as f64).sin();
    let rows: Vec<Vec<f64>> = (0..60)
        .map(|k| {
            let x = k as f64 / 10.0;
            let gross = if k == 17 || k == 41 { 2.0 } else { 0.0 };
            vec![x, 1.0 + 2.0 * x + noise(k) + gross]
        })
        .collect();
    let problem = bound(&program, &[table(&rows)], phical::problem::Selection::default(), None);
    let procedure = Procedure { snoop: true, ..Procedure::default() };
    let fit = phical::session::fit_by(&problem, &procedure).expect("it fits");
    let mut removed: Vec<usize> = fit.removed.iter().map(|o| o.row).collect();
    removed.sort_unstable();
    assert_eq!(removed, [17, 41]);
    assert_eq!(fit.equations, 58);
    let kept: Vec<Vec<f64>> =
        rows.iter().enumerate().filter(|(k, _)| *k != 17 && *k != 41).map(|(_, r)| r.clone()).collect();
    let clean = fitted(&program, &[table(&kept)]);
    close(&[fit.parameters[0].value], &[clean.parameters[0].value], 1e-10, "as if they had not been there");
    close(&[fit.parameters[0].sigma.unwrap()], &[clean.parameters[0].sigma.unwrap()], 1e-10, "with its sigma");
}
