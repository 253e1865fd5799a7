//! Published adjustments, shipped as models without code, against the digits that were printed. Standard deviations are
//! printed a posteriori: phical's own under propagated weights are a priori, and σ₀ is the factor between them.

use std::process::Command;

use serde_json::Value;

use crate::shared::project;

/// A fit as `calibrate` prints it, with the exit code.
fn calibrated(model: &str, more: &[&str]) -> (i32, Value) {
    let path = project("models/published").join(model).join("model.ron");
    let output = Command::new(env!("CARGO_BIN_EXE_phical"))
        .args(["calibrate", path.to_str().expect("a path"), "--format", "json"])
        .args(more)
        .current_dir(project("models/published"))
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let fit = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{model}: {said}"));
    (output.status.code().expect("an exit code"), fit)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Whether a number is a printed one, to half a unit of its last digit.
fn rounds_to(found: f64, printed: &str) -> bool {
    let decimals = printed.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let expected: f64 = printed.parse().expect("a number");
    // the last bit of a printed number is not its own
    (found - expected).abs() <= 0.5 * 10f64.powi(-(decimals as i32)) + 1e-12 * expected.abs()
}

#[track_caller]
fn prints(found: f64, printed: &str, what: &str) {
    assert!(rounds_to(found, printed), "{what} is {found}, and {printed} is published");
}

/// The parameters of a fit: name, value, and standard deviation a posteriori.
#[track_caller]
fn parameters(fit: &Value, published: &[(&str, &str, &str)], unit: f64) {
    assert_eq!(fit["weights"], "propagated");
    let found = fit["parameters"].as_array().expect("a list");
    assert_eq!(found.len(), published.len());
    for (name, value, sigma) in published {
        let of = found.iter().find(|p| p["name"] == *name).unwrap_or_else(|| panic!("no `{name}`"));
        prints(number(&of["value"]), value, name);
        prints(number(&of["sigma"]) * number(&fit["sigma0"]) * unit, sigma, &format!("σ of {name}"));
    }
}

#[track_caller]
fn goodness(fit: &Value, dof: u64, sigma0: &str) {
    assert_eq!(fit["converged"], true);
    assert_eq!(fit["dof"], dof);
    prints(number(&fit["sigma0"]), sigma0, "σ₀");
}

#[test]
fn the_line_of_pearson_and_york() {
    let (code, fit) = calibrated("york_line", &[]);
    assert_eq!((code, &fit["dof"]), (0, &Value::from(8)));
    let value = |k: usize| number(&fit["parameters"][k]["value"]);
    prints(value(0), "5.479910224", "intercept");
    prints(value(1), "-0.480533407", "slope");
    prints(number(&fit["sum_of_squares"]), "11.866353", "χ²");
}

/// χ²(slope) of the line has a second minimum, and a fit that ends there says that it fits badly.
#[test]
fn the_other_line_is_not_trusted() {
    let folder = tempfile::tempdir().expect("a folder");
    let start = folder.path().join("start.json");
    std::fs::write(&start, r#"{"intercept": 1.5, "slope": 0.3}"#).expect("written");
    let (code, fit) = calibrated("york_line", &["--start", start.to_str().expect("a path")]);
    assert_eq!((code, &fit["converged"]), (1, &Value::from(true)));
    // the minimum by a search over slopes with York's weights, written apart from this
    prints(number(&fit["sum_of_squares"]), "231.0999", "χ²");
    prints(number(&fit["parameters"][1]["value"]), "0.2488", "slope");
}

#[test]
fn the_levelling_net() {
    let (code, fit) = calibrated("levelling_net", &[]);
    assert_eq!(code, 0);
    goodness(&fit, 3, "0.6512");
    let published =
        [("height[B]", "448.1087", "2.30"), ("height[C]", "453.4685", "2.64"), ("height[D]", "444.9436", "1.76")];
    parameters(&fit, &published, 1e3);
}

#[test]
fn the_trilateration() {
    // the published distances do not fit: that is what they are published for
    let (code, fit) = calibrated("trilateration", &[]);
    assert_eq!((code, &fit["trustworthy"]), (1, &Value::from(false)));
    goodness(&fit, 1, "13.590536");
    let published = [
        ("x[Wisconsin]", "2415776.9044", "0.14879"),
        ("y[Wisconsin]", "391043.2945", "0.22061"),
        ("x[Campus]", "2416892.6955", "0.10378"),
        ("y[Campus]", "387603.2551", "0.27054"),
    ];
    parameters(&fit, &published, 1.0);
}

/// With one distance a third of a metre longer all five agree, so one of the published ones has a gross error.
#[test]
fn a_gross_error_is_not_trusted_and_without_it_all_agree() {
    let (code, without) = calibrated("trilateration", &["--data", "distance=trilateration/without_error.csv"]);
    assert_eq!((code, &without["dof"]), (0, &Value::from(1)));
    let chi = |fit: &Value| number(&fit["chi_squared"]["value"]);
    assert!(chi(&without) < 1e-3, "{}", without["chi_squared"]);
    let (code, with) = calibrated("trilateration", &[]);
    assert_eq!(code, 1);
    assert!(chi(&with) > 180.0, "{}", with["chi_squared"]);
    assert!(
        with["verdict"][0].as_str().expect("text").contains("larger than the declared sigmas"),
        "{}",
        with["verdict"]
    );
}

#[test]
fn the_new_point_by_angles() {
    // χ² is 14.3 at two degrees of freedom: the angles are worse than declared
    let (code, fit) = calibrated("new_point_by_angles", &[]);
    assert_eq!((code, &fit["trustworthy"]), (1, &Value::from(false)));
    goodness(&fit, 2, "2.6773258");
    parameters(&fit, &[("x[U]", "6860.7260", "0.37817"), ("y[U]", "3727.4751", "0.17809")], 1.0);
}

#[test]
fn the_point_in_space() {
    let (code, fit) = calibrated("point_in_space", &[]);
    assert_eq!(code, 0);
    goodness(&fit, 5, "0.46507");
    let published = [("P.x", "900.0164", "0.00543"), ("P.y", "899.9836", "0.00543"), ("P.z", "1300.0062", "0.00290")];
    parameters(&fit, &published, 1.0);
}

#[test]
fn another_digit_is_noticed() {
    assert!(rounds_to(448.1087117, "448.1087") && rounds_to(-0.480533407, "-0.480533407"));
    assert!(!rounds_to(448.10876, "448.1087") && !rounds_to(448.10864, "448.1087"));
    assert!(!rounds_to(0.0023, "2.30") && !rounds_to(f64::NAN, "1.0"));
}
