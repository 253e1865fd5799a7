//! How well parameters come to be known: with data, before them, and at another datum.

use std::process::ExitCode;

use phical::identify::{Inputs, Practice, practice};
use phical::problem::{Options, Problem, Weights};
use phical::simulate::{self, simulate};
use serde_json::Value;

use super::{freed, probe};
use crate::flagship::flagship;
use crate::shared::project;

fn blind(found: &Practice) -> Vec<&str> {
    found.parameters.iter().filter(|known| !known.estimable).map(|known| known.name.as_str()).collect()
}

#[test]
fn the_flagship_is_one_short_in_every_weight_mode_on_clean_and_noisy_data() {
    let flagship = flagship();
    for (exact, weights) in
        [(true, Weights::Unit), (true, Weights::Propagated), (false, Weights::Unit), (false, Weights::Propagated)]
    {
        let options = simulate::Options { rows: vec![(0, 80)], seed: Some(3), exact };
        let tables = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates").tables;
        let options = Options { weights: Some(weights), ..freed(&["L1.b"]) };
        let (bound, _) = Problem::bind(&flagship.0, tables, &options).expect("it binds");
        let found = practice(&probe(&flagship.0, Inputs::Rows(&bound), options), None).expect("it runs");
        assert_eq!((found.rank, found.parameters.len(), found.left_out), (20, 21, 0), "{exact} {weights:?}");
        assert_eq!(blind(&found), ["L1.b", "R1.b"]);
        assert!(found.parameters.iter().all(|known| known.sigma.is_some() == (known.estimable && weights.are_real())));
        assert!(found.invisible.len() == 1 && found.invisible[0].walk.as_ref().expect("walked").family);
        assert_eq!((found.indices.o2, found.indices.o5), (0.0, 0.0));
        let choices: Vec<&[String]> = found.cures[0].iter().map(|cure| cure.fix.as_slice()).collect();
        assert_eq!(choices, [["L1.b"], ["R1.b"]]);
    }
}

/// The command's exit code and JSON.
fn run(arguments: &[&str]) -> (ExitCode, Value) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let all = ["phical"].iter().chain(arguments).chain(&["--format", "json"]);
    let code = phical::cli::run(all, &mut out, &mut err);
    (code, serde_json::from_slice(&out).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&err))))
}

#[test]
fn a_change_of_datum_is_a_refit() {
    let model = project("models/two_theodolite/model.ron").display().to_string();
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("fit.json").display().to_string();
    run(&["calibrate", &model, "--free", "L1.b", "--out", &file]);
    for (datum, arguments) in [("L1.b=0.3 mm", ["--fix", "L1.b=0.3 mm"]), ("R1.b=-0.2 mm", ["--fix", "R1.b=-0.2 mm"])] {
        let refit = run(&["calibrate", &model, "--free", "L1.b", arguments[0], arguments[1]]).1;
        let (code, moved) = run(&["identify", &model, "--fit", &file, "--datum", datum]);
        assert_eq!(code, ExitCode::SUCCESS);
        assert_eq!(moved["family"], true);
        assert!(moved["residual"].as_f64().expect("a number") < 1e-9);
        let by_name = |all: &Value, name: &str| {
            all["parameters"].as_array().expect("parameters").iter().find(|p| p["name"] == name).cloned()
        };
        let mut compared = 0;
        for p in moved["parameters"].as_array().expect("parameters") {
            let Some(other) = by_name(&refit, p["name"].as_str().expect("a name")) else { continue };
            let number = |value: &Value| value.as_f64().expect("a number");
            let (sigma, expected) = (number(&p["sigma"]), number(&other["sigma"]));
            assert!((sigma / expected - 1.0).abs() < 1e-2, "{}: {sigma} {expected}", p["name"]);
            assert!((number(&p["value"]) - number(&other["value"])).abs() < 1e-4 * sigma, "{}: {p} {other}", p["name"]);
            compared += 1;
        }
        assert_eq!(compared, 20);
    }
}

#[test]
fn exit_codes_and_json() {
    let model = project("models/two_theodolite/model.ron").display().to_string();
    let (code, found) = run(&["identify", &model, "--scenario", "paper", "--rows", "vo_line=40"]);
    assert_eq!(code, ExitCode::SUCCESS);
    for key in [
        "rank",
        "free",
        "parameters",
        "null_directions",
        "weak",
        "indices",
        "clusters",
        "collinearity",
        "cures",
        "condition",
    ] {
        assert!(!found[key].is_null(), "{key}");
    }
    assert_eq!((found["rank"].as_u64(), found["rows"]["vo_line"].as_u64()), (Some(20), Some(40)));
    assert_eq!(found["next"]["measurement"], "vo_line");
    let (code, found) = run(&["identify", &model, "--free", "L1.b"]);
    assert_eq!(code, ExitCode::from(1));
    assert_eq!(found["null_directions"][0]["family"], true);
    // named as in `calibrate --format json`, in both kinds
    let known = run(&["calibrate", &model, "--free", "L1.b"]).1;
    let names = |found: &Value| found["null_directions"][0]["combination"]["R1.b"].as_f64().expect("a weight");
    assert!((names(&found) - names(&known)).abs() < 0.01);
    let (_, structural) = run(&["identify", &model, "--free", "L1.b", "--structural"]);
    assert!((names(&structural) - 0.707).abs() < 1e-3);
    let dependency = &found["collinearity"]["dependencies"][0];
    assert!(dependency["condition_index"].as_f64().expect("a number") > 30.0);
    assert!(dependency["proportions"]["R2.a"].as_f64().expect("a share") > 0.5, "{dependency}");
    let (indices, proportions) = (&found["collinearity"]["condition_indices"], &found["collinearity"]["proportions"]);
    // of the 19 that are estimable
    assert_eq!((indices.as_array().map(Vec::len), proportions.as_array().map(Vec::len)), (Some(19), Some(19)));
    let sigma = found["cures"][0][0]["then"][0]["sigma"].as_f64().expect("a number");
    assert!((0.3..2.0).contains(&sigma), "{sigma}");
    assert_eq!(run(&["identify", &model, "--free", "L1.q"]).0, ExitCode::from(2));
}

/// Predicted without data, and what a calibration of simulated data then states.
#[test]
fn the_prediction_is_what_a_fit_states() {
    let flagship = flagship();
    let scenario = &flagship.0.scenarios[0];
    let predicted =
        practice(&probe(&flagship.0, Inputs::Scenario(scenario), Options::default()), None).expect("it runs");
    let simulated = simulate(&flagship.0, scenario, &simulate::Options::default()).expect("it simulates");
    let (bound, _) = Problem::bind(&flagship.0, simulated.tables, &Options::default()).expect("it binds");
    let solution = phical::solve::minimise(&bound, bound.start.clone(), &Default::default()).expect("it starts");
    let fit = phical::fit::analyse(&bound, solution).expect("defined");
    for (known, stated) in predicted.parameters.iter().zip(&fit.parameters) {
        let ratio = known.sigma.expect("known") / stated.sigma.expect("known");
        assert!((0.85..1.15).contains(&ratio), "{}: {ratio}", known.name);
    }
}
