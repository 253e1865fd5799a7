//! Whether stated uncertainties are true, where it is known beforehand: honest models, models that say too little or too much,
//! fits that fail, and the flagship. `PHICAL_SEEDS=1000 cargo test --release coverage` runs a campaign.

use std::path::Path;
use std::process::{Command, Output};

use phical::coverage::{Consistency, Coverage, Options, coverage};
use phical::problem::{self, Execution};
use phical::session::Session;
use phical::simd::InstructionSet;
use serde_json::Value;
use tempfile::TempDir;

use crate::shared::project;

/// Seeds of the quick test of the flagship, or of a campaign.
fn seeds() -> u64 {
    std::env::var("PHICAL_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(20).min(1000)
}

/// A straight line with errors of 0.1 mm, with more of its scenario.
fn line(y: &str, parameters: &str, scenario: &str) -> String {
    format!(
        r#"(
        name: "line",
        parameters: {{ {parameters} }},
        measurements: {{ "point": (
            inputs: {{ "x": (), "y": (unit: "mm", sigma: "0.1 mm") }},
            residuals: {{ "r": "y - ({y})" }},
            outputs: {{ "line": "{y}", "measured": "y", "known": "2*x" }},
        ) }},
        scenarios: {{ "s": (seed: 1, {scenario}measurements: {{ "point": (
            rows: 12, draw: {{ "x": Uniform(-1, 2) }}, set: {{ "y": "{y}" }}, NOISE
        ) }}) }},
    )"#
    )
}

const PLAIN: &str = r#""a": Scalar(Free("0 mm")), "b": Scalar(Free("0 mm"))"#;

fn straight(noise: &str) -> String {
    line("a + b*x", PLAIN, r#"truth: {"b": "2 mm"}, "#).replace("NOISE", noise)
}

fn file(text: &str) -> TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join("model.ron"), text).expect("writable");
    directory
}

fn run(directory: &Path, arguments: &[&str]) -> Output {
    let model = directory.join("model.ron").display().to_string();
    let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
    command.args(["coverage", &model]).args(arguments).output().expect("phical runs")
}

/// The JSON of a run that ends with `code`.
fn json(code: i32, directory: &Path, arguments: &[&str]) -> Value {
    let output = run(directory, &[arguments, &["--format", "json"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let value: Value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{said}"));
    assert_eq!(output.status.code(), Some(code), "{value:#}\n{said}");
    value
}

fn of<'v>(value: &'v Value, kind: &str, name: &str) -> &'v Value {
    let all = value[kind].as_array().expect("an array");
    all.iter().find(|q| q["name"] == name).unwrap_or_else(|| panic!("{name} in {all:?}"))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} of {value}"))
}

/// All of a shipped model, by as many runs.
fn shipped(model: &str, options: Options) -> Coverage {
    let session = Session::open(&project(&format!("models/{model}/model.ron")), &[]).expect("it is sound");
    let scenario = session.scenario(None).expect("it has one");
    coverage(&session, scenario, &options).expect("it runs")
}

#[test]
fn a_straight_line_is_honest() {
    let directory = file(&straight(""));
    let found = json(0, directory.path(), &[]);
    assert_eq!((&found["runs"], &found["failed"], &found["honest"]), (&200.into(), &0.into(), &true.into()));
    for name in ["a", "b"] {
        let q = of(&found, "parameters", name);
        assert!((0.92..=0.98).contains(&number(q, "coverage")), "{q}");
        assert!((0.9..1.1).contains(&number(q, "ratio")), "{q}");
        assert!(number(q, "bias").abs() < 3.5 * number(q, "bias_error"), "{q}");
        assert!(number(q, "low") < number(q, "coverage") && number(q, "coverage") < number(q, "high"), "{q}");
        assert_eq!((&q["runs"], &q["intervals"], &q["unit"]), (&200.into(), &200.into(), &"mm".into()));
    }
    // a reading's own uncertainty is declared, the line's is that of the fit, and what is exact is not judged
    let measured = of(&found, "predictions", "measured");
    assert!((number(measured, "predicted") - 0.1).abs() < 1e-12 && measured["intervals"] == 1000, "{measured}");
    assert!(number(of(&found, "predictions", "line"), "predicted") < 0.06);
    assert_eq!(found["predictions"].as_array().map(Vec::len), Some(2));
    assert!((0.85..1.15).contains(&number(&found["chi_squared_per_dof"], "median")), "{found:#}");
    assert!(number(&found, "trustworthy_share") > 0.98);
    assert!(number(&found, "noticed_below") < 0.9);
    assert_eq!(found["provenance"]["rows"]["point"]["rows"], 12);
}

#[test]
fn errors_twice_as_large_as_declared_are_noticed() {
    let directory = file(&straight(r#"noise: { "y": (mean: 0, sigma: "0.2 mm") }"#));
    let found = json(1, directory.path(), &["--seeds", "100"]);
    assert!(found["verdict"].as_str().is_some_and(|text| text.starts_with("Not honest: ") && text.contains("seldom")));
    for (kind, name) in [("parameters", "a"), ("parameters", "b"), ("predictions", "line"), ("predictions", "measured")]
    {
        let q = of(&found, kind, name);
        assert_eq!(q["consistency"], "too_seldom", "{q}");
        assert!((1.7..2.3).contains(&number(q, "ratio")), "{q}");
    }
    // weights that do not believe the declared sizes find the parameters' own
    let unit = json(0, directory.path(), &["--weights", "unit", "--check-rows", "0"]);
    assert!(unit["chi_squared_per_dof"].is_null() && unit["predictions"] == Value::Array(Vec::new()));
    let large = file(&straight(r#"noise: { "y": (mean: 0, sigma: "0.03 mm") }"#));
    let many = ["--seeds", "400"];
    let found = json(1, large.path(), &many);
    assert_eq!(of(&found, "parameters", "b")["consistency"], "too_often");
    // few runs cannot tell that
    assert!(json(0, large.path(), &["--seeds", "100"])["notes"].to_string().contains("none as too high"));
    let text = String::from_utf8(run(large.path(), &many).stdout).expect("text");
    assert!(text.starts_with("Not honest: the 95 % intervals hold the truth too often: "), "{text}");
}

#[test]
fn a_truth_that_is_drawn_is_compared_with_what_was_drawn() {
    let parameters = r#""a": Scalar(Free("0 mm")), "b": Scalar(Free(nominal: "2 mm", sigma: "0.05 mm"))"#;
    let model =
        line("a + b*x", parameters, r#"truth: {"a": Uniform("-1 mm", "1 mm"), "b": Normal("2 mm", "0.05 mm")}, "#);
    let directory = file(&model.replace("NOISE", ""));
    let found = json(0, directory.path(), &[]);
    // the prior tells about as much as the data, and so the error is less than the prior's
    let b = of(&found, "parameters", "b");
    assert!(number(b, "actual") < 0.045 && (0.9..1.1).contains(&number(b, "ratio")), "{b}");
}

#[test]
fn what_is_held_elsewhere_is_said() {
    let directory = file(&straight(""));
    let found = json(1, directory.path(), &["--fix", "b=1 mm", "--seeds", "50"]);
    assert_eq!(found["held_off_truth"][0]["name"], "b");
    assert_eq!(
        (number(&found["held_off_truth"][0], "value"), number(&found["held_off_truth"][0], "truth")),
        (1.0, 2.0)
    );
    assert_eq!(of(&found, "parameters", "a")["consistency"], "too_seldom");
    let text = String::from_utf8(run(directory.path(), &["--fix", "b=1 mm", "--seeds", "50"]).stdout).expect("text");
    assert!(
        text.contains("note: held, but not at the truth: `b` at 1 mm (truth 2)") && text.contains("biased by"),
        "{text}"
    );
    let held = json(0, directory.path(), &["--fix", "b=2 mm", "--seeds", "50"]);
    assert_eq!(held["held_off_truth"], Value::Array(Vec::new()));
}

#[test]
fn what_no_run_can_estimate_is_not_judged() {
    let parameters = r#""a": Scalar(Free("0 mm")), "c": Scalar(Free("0 mm")), "b": Scalar(Free("0 mm"))"#;
    let directory = file(&line("a + c + b*x", parameters, "").replace("NOISE", ""));
    let found = json(0, directory.path(), &[]);
    assert_eq!(found["not_estimable"], serde_json::json!(["a", "c"]));
    // and yet the line itself is known
    assert!((0.9..1.1).contains(&number(of(&found, "predictions", "line"), "ratio")));
    assert_eq!(number(&found, "trustworthy_share"), 0.0);
    let none = json(1, directory.path(), &["--fix", "b", "--check-rows", "0", "--seeds", "3"]);
    assert!(none["verdict"].as_str().is_some_and(|text| text.starts_with("Nothing was judged")));
}

#[test]
fn a_fit_that_cannot_start_is_a_miss() {
    // undefined where a drawn x is below the nominal 0.5
    let model = r#"(
        name: "root",
        parameters: { "q": Scalar(Free(0.5)) },
        measurements: { "point": (
            inputs: { "x": (), "y": (sigma: 0.01) },
            residuals: { "r": "y - sqrt(x - q)" },
            outputs: { "s": "q + x" },
        ) },
        scenarios: { "s": (truth: {"q": 0}, measurements: { "point": (
            rows: 5, draw: { "x": Uniform(0.4, 3) }, set: { "y": "sqrt(x - q)" },
        ) }) },
    )"#;
    let directory = file(model);
    let found = json(1, directory.path(), &[]);
    let failed = number(&found, "failed");
    assert!((10.0..80.0).contains(&failed), "{failed}");
    assert_eq!(found["failures"][0]["reason"], "a residual is undefined at the start");
    let (q, s) = (of(&found, "parameters", "q"), of(&found, "predictions", "s"));
    assert_eq!((number(q, "missing"), number(s, "missing")), (failed, 5.0 * failed));
    assert!(number(q, "coverage") <= 1.0 - failed / 200.0);
    assert_eq!(q["consistency"], "too_seldom");
    let text = String::from_utf8(run(directory.path(), &[]).stdout).expect("text");
    assert!(text.contains("runs failed and count as misses: a residual is undefined at the start"), "{text}");
}

#[test]
fn correlated_readings_make_what_they_should_of_a_difference() {
    let model = r#"(
        name: "pair",
        parameters: { "a": Scalar(Free("0 mm")) },
        measurements: { "pair": (
            inputs: { "t": (), "u": (unit: "mm", sigma: "0.1 mm"), "v": (unit: "mm", sigma: "0.2 mm") },
            correlations: { "u, v": 0.9 },
            residuals: { "r": "v - u - a" },
            outputs: { "sum": "u + v" },
        ) },
        scenarios: { "s": (measurements: { "pair": (
            rows: 10, draw: { "t": Uniform(0, 1) }, set: { "u": "t * 1 mm", "v": "a + u" },
        ) }) },
    )"#;
    let found = json(0, file(&model.replace("t * 1 mm", "0 * a")).path(), &[]);
    // σ² = 0.01 + 0.04 + 2·0.9·0.1·0.2
    let sum = of(&found, "predictions", "sum");
    assert!((number(sum, "predicted") - 0.086f64.sqrt()).abs() < 1e-12, "{sum}");
    assert!((0.9..1.1).contains(&number(of(&found, "parameters", "a"), "ratio")));
}

#[test]
fn threads_change_no_bit() {
    let of = |threads: usize| {
        let rows = vec![(0, 40)];
        let execution = Execution::new(InstructionSet::detect(), threads);
        let problem = problem::Options { execution, ..problem::Options::default() };
        shipped("two_theodolite", Options { seeds: 9, first: Some(7), rows, threads, problem, ..Options::default() })
    };
    let (one, many) = (of(1), of(3));
    assert_eq!((&one.parameters, &one.predictions), (&many.parameters, &many.predictions));
    assert_eq!(one.chi_squared_per_dof, many.chi_squared_per_dof);
    assert!(one.parameters.iter().all(|q| q.runs == 9 && q.missing == 0));
}

#[test]
fn the_flagship_is_honest() {
    let found = shipped("two_theodolite", Options { seeds: seeds(), rows: vec![(0, 300)], ..Options::default() });
    assert_eq!((found.parameters.len(), found.predictions.len(), found.failed()), (20, 6, 0));
    assert!(found.honest(), "{}", phical::report::coverage_verdict(&found));
    let held: Vec<&str> = found.misheld.iter().map(|held| held.name.as_str()).collect();
    assert_eq!(held, ["L1.b"]);
    let [_, median, _] = found.chi_squared_per_dof.expect("weights are real");
    assert!((0.97..1.03).contains(&median), "{median}");
    if found.runs >= 1000 {
        for q in found.quantities() {
            assert!((0.925..=0.975).contains(&q.coverage), "{} {}", q.name, q.coverage);
        }
    }
}

#[test]
fn the_other_scenarios_are_honest() {
    let many = seeds().max(60);
    for (model, free, parameters) in
        [("positioner_camera", &[][..], 14), ("panda_sockets", &[], 37), ("ur5_pendant", &["J2.a", "J3.a", "J4.d"], 3)]
    {
        let selection =
            problem::Selection { free: free.iter().map(|&name| name.into()).collect(), ..Default::default() };
        let problem = problem::Options { selection, ..problem::Options::default() };
        let found = shipped(model, Options { seeds: many, problem, ..Options::default() });
        assert_eq!((found.parameters.len(), found.failed(), found.not_simulated), (parameters, 0, 0), "{model}");
        assert!(found.honest(), "{model}: {}", phical::report::coverage_verdict(&found));
        assert!(found.parameters.iter().all(|q| q.consistency == Consistency::Honest));
        assert!(found.parameters.iter().all(|q| q.notable_bias().is_none_or(|share| share.abs() < 0.5)), "{model}");
        assert!(found.misheld.is_empty(), "{model}: {:?}", found.misheld);
    }
}

#[test]
fn wrong_input_is_refused() {
    let directory = file(&straight(""));
    for (arguments, word) in [
        (&["--scenario", "t"][..], "E025"),
        (&["--rows", "line=3"], "E024"),
        (&["--rows", "point=0"], "E035"),
        (&["--free", "z"], "E022"),
        (&["--loss", "hubber"], "E006"),
        (&["--seeds", "0"], "seeds"),
        (&["--expr", "q + 1"], "q"),
    ] {
        let output = run(directory.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{said}");
        assert!(said.contains(word) && output.stdout.is_empty(), "{arguments:?}\n{said}");
    }
    let impossible = straight("").replace(r#"set: { "y": "a + b*x" }"#, r#"set: { "y": "sqrt(-1 - x^2) * a" }"#);
    assert_eq!(run(file(&impossible).path(), &["--seeds", "4"]).status.code(), Some(2));
}
