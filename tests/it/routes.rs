//! Derivatives by several routes, and functions that people write for them.

use phical::audit::{Route, check_function, check_points, check_routes};
use phical::compile::Program;
use phical::problem::{Options, Problem, Selection, Weights};
use phical::session::Session;
use phical::testing::{assert_jacobian, check_jacobian, data, program};
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;
use serde_json::Value;

use crate::shared::project;

/// All model files of the project.
fn shipped() -> Vec<std::path::PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![project("models")];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").path()) {
            match path.extension().and_then(|ending| ending.to_str()) {
                Some("ron") => found.push(path),
                None if path.is_dir() => folders.push(path),
                _ => {}
            }
        }
    }
    found.sort();
    found
}

#[test]
fn the_routes_of_every_shipped_model_agree() {
    let all = shipped();
    assert!(all.len() >= 26, "{all:?}");
    for path in all {
        let session = Session::open(&path, &[]).expect("it is right");
        for seed in 0..3 {
            for one in check_routes(&session.program, &[], &[], seed).expect("it has residuals") {
                assert!(one.agree(), "{}: {one:#?}", path.display());
                for route in &one.routes {
                    assert_eq!(route.left_out.is_some(), route.compared < one.derivatives);
                    if route.route != Route::Differences {
                        assert!(route.digits > 12.0 && route.left_out.is_none(), "{}: {route:#?}", path.display());
                    }
                }
            }
        }
    }
}

/// Members of families, several of them in one row.
#[test]
fn rows_with_members_of_their_own_agree() {
    let session = Session::open(&project("models/panda_sockets/model.ron"), &[]).expect("it is right");
    let program = &session.program;
    let mut runner = TestRunner::deterministic();
    let rows = data(program, &program.scenarios[0], 5..=20, true);
    let made = rows.new_tree(&mut runner).expect("rows").current();
    let options = Options { weights: Some(Weights::Unit), unconstrained: true, ..Options::default() };
    let (problem, _) = Problem::bind(program, made.simulated.tables, &options).expect("it binds");
    let found = check_points(&problem, std::slice::from_ref(&problem.start)).expect("it is evaluated");
    assert_eq!(found.len(), problem.blocks.len());
    assert!(found.iter().all(|one| one.agree() && one.undefined == 0), "{found:#?}");
}

/// A residual of a parameter `a` near 0.4 and an input `x`.
fn function(text: &str) -> Program {
    program(&format!(
        r#"(name: "f", parameters: {{"a": Scalar(Free(nominal: 0.4, tolerance: 0.001))}},
        measurements: {{"m": (inputs: {{"x": ()}}, residuals: {{"r": "{text}"}})}})"#
    ))
}

#[test]
fn known_functions_have_known_derivatives() {
    type Known = (&'static str, fn(f64, f64) -> f64);
    let known: &[Known] = &[
        ("a^3 - x", |a, _| 3.0 * a * a),
        ("a^-2*x", |a, x| -2.0 * x / (a * a * a)),
        ("a^2.5 - x", |a, _| 2.5 * a.powf(1.5)),
        ("exp(a*x)", |a, x| x * (a * x).exp()),
        ("log(a) - x", |a, _| 1.0 / a),
        ("sqrt(a + x^2)", |a, x| 0.5 / (a + x * x).sqrt()),
        ("sin(a*x)", |a, x| x * (a * x).cos()),
        ("cos(a*x)", |a, x| -x * (a * x).sin()),
        ("tan(a) - x", |a, _| 1.0 / a.cos().powi(2)),
        ("asin(a)*x", |a, x| x / (1.0 - a * a).sqrt()),
        ("acos(a)*x", |a, x| -x / (1.0 - a * a).sqrt()),
        ("atan(a*x)", |a, x| x / (1.0 + a * a * x * x)),
        ("atan2(a, x)", |a, x| x / (a * a + x * x)),
        ("atan2(x, -a)", |a, x| x / (a * a + x * x)),
        ("wrap(9*a + x)", |_, _| 9.0),
        ("norm(vec(a, x, 1))", |a, x| a / (a * a + x * x + 1.0).sqrt()),
    ];
    for (text, derivative) in known {
        let program = function(text);
        let found = check_routes(&program, &[], &[], 1).expect("it has residuals");
        assert!(found[0].agree(), "{text}: {found:#?}");
        assert!(found[0].routes.iter().all(|route| route.compared > 0), "{text}: {found:#?}");
        assert_jacobian(&program, "m", 20, |q, x| vec![derivative(q[0], x[0])]);
        // what is not the derivative is not taken for it
        assert!(
            check_jacobian(&program, "m", 20, |q, x| vec![derivative(q[0], x[0]) * (1.0 + 1e-9)]).is_err(),
            "{text}"
        );
    }
}

#[test]
fn the_complex_step_says_what_is_not_analytic() {
    let found = check_routes(&function("abs(a + 3)*x"), &[], &[], 0).expect("it has residuals");
    let step = &found[0].routes[Route::ComplexStep as usize];
    assert_eq!((step.compared, step.left_out.as_deref()), (0, Some("`abs` is not analytic")));
    assert!(found[0].agree());
    let two = program(
        r#"(name: "two", parameters: {"a": Scalar(Free(2))},
        measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "abs(a)*x", "s": "a*x"})})"#,
    );
    let found = check_routes(&two, &[], &[], 0).expect("it has residuals");
    let step = &found[0].routes[Route::ComplexStep as usize];
    assert_eq!(step.left_out.as_deref(), Some("`abs` of `r` is not analytic"));
    assert_eq!(2 * step.compared, found[0].derivatives);
}

#[test]
fn where_nothing_is_defined_nothing_agrees() {
    let found = check_routes(&function("sqrt(-1 - a^2)*x"), &[], &[], 0).expect("it has residuals");
    assert_eq!((found[0].points, found[0].derivatives), (0, 0));
    assert!(found[0].undefined > 0 && !found[0].agree());
}

fn phical(arguments: &[&str]) -> (i32, String) {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_phical"));
    let output = command.args(arguments).output().expect("phical runs");
    (output.status.code().expect("a code"), String::from_utf8(output.stdout).expect("text"))
}

#[test]
fn jacobian_check_prints_routes_and_formulas() {
    let model = project("models/two_theodolite/model.ron").to_string_lossy().into_owned();
    let (code, text) = phical(&["jacobian", &model, "--check", "--seed", "7", "--format", "json"]);
    assert_eq!(code, 0, "{text}");
    let found: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(found["formulas"].as_array().map(Vec::len), Some(85));
    let routes = found["routes"].as_array().expect("a list");
    assert_eq!(
        routes.iter().map(|one| one["measurement"].as_str()).collect::<Vec<_>>(),
        [Some("vo_line"), Some("sighting")]
    );
    let names: Vec<_> =
        routes[0]["routes"].as_array().expect("a list").iter().map(|one| one["route"].clone()).collect();
    assert_eq!(names, ["engine", "symbolic", "differences", "complex_step"]);
    for one in routes[0]["routes"].as_array().expect("a list") {
        assert!(one["agrees"] == true && one["digits"].as_f64() > Some(6.0), "{one}");
        assert!(one["worst"]["by"].is_string() && one["worst"]["exact"].is_number(), "{one}");
    }
    // the same seed, the same bytes; and a table for people
    assert_eq!(text, phical(&["jacobian", &model, "--check", "--seed", "7", "--format", "json"]).1);
    let (code, text) = phical(&["jacobian", &model, "--check"]);
    assert!(code == 0 && text.contains("\n  complex step  agrees  "), "{text}");
}

#[test]
fn a_model_without_residuals_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("model.ron");
    let text = r#"(name: "m", parameters: {"a": Scalar(Free(1))}, measurements: {"m": (inputs: {"x": ()}, outputs: {"o": "a*x"})})"#;
    std::fs::write(&model, text).expect("written");
    let (code, text) = phical(&["jacobian", &model.to_string_lossy(), "--check", "--format", "json"]);
    let found: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((code, found["errors"][0]["code"].as_str()), (2, Some("E026")), "{text}");
}

/// Rows of data are looked at, at the values that are given.
#[test]
fn jacobian_check_takes_data_and_values() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path().join("at.json");
    std::fs::write(&at, r#"{"b1": 200.0, "b2": 0.001}"#).expect("written");
    let model = project("models/nist/Misra1a/model.ron").to_string_lossy().into_owned();
    let at = at.to_string_lossy().into_owned();
    let (code, text) = phical(&["jacobian", &model, "--check", "--at", &at, "--format", "json"]);
    assert_eq!(code, 0, "{text}");
    let found: Value = serde_json::from_str(&text).expect("JSON");
    // 13 that are made up, 4 rows of data: by two parameters and two inputs
    assert_eq!(
        (found["routes"][0]["points"].as_u64(), found["routes"][0]["derivatives"].as_u64()),
        (Some(17), Some(68))
    );
    assert_eq!(found["formulas"], Value::Array(Vec::new()));
}

/// Two links in a plane, angles in degrees.
fn arm() -> Program {
    program(
        r#"(name: "2R", units: (length: "mm", angle: "deg"),
        parameters: {"a": Scalar(Free("400 mm")), "b": Scalar(Free("300 mm")), "alpha": Scalar(Free("5 deg")),
            "beta": Scalar(Free("-10 deg")), "unused": Scalar(Held("1 mm"))},
        measurements: {"tip": (
            inputs: {"s": (unit: "deg"), "t": (unit: "deg"), "x": (unit: "mm"), "y": (unit: "mm")},
            define: {"u": "s + alpha", "v": "s + alpha + t + beta"},
            residuals: {"rx": "a*cos(u) + b*cos(v) - x", "ry": "a*sin(u) + b*sin(v) - y"},
        )})"#,
    )
}

/// By residual and then by a, b, alpha, beta: in millimetres and degrees.
fn by_hand(q: &[f64], x: &[f64]) -> Vec<f64> {
    let radian = std::f64::consts::PI / 180.0;
    let (u, v) = ((x[0] + q[2]) * radian, (x[0] + q[2] + x[1] + q[3]) * radian);
    let (a, b) = (q[0], q[1]);
    vec![
        u.cos(),
        v.cos(),
        -(a * u.sin() + b * v.sin()) * radian,
        -b * v.sin() * radian,
        u.sin(),
        v.sin(),
        (a * u.cos() + b * v.cos()) * radian,
        b * v.cos() * radian,
    ]
}

/// What is said of a function with a mistake.
fn said(mistake: impl Fn(&mut Vec<f64>, &[f64], &[f64])) -> String {
    let wrong = |q: &[f64], x: &[f64]| {
        let mut found = by_hand(q, x);
        mistake(&mut found, q, x);
        found
    };
    check_jacobian(&arm(), "tip", 20, wrong).expect_err("a mistake was made")
}

#[test]
fn a_right_function_passes() {
    for points in [0, 1, 50] {
        assert_jacobian(&arm(), "tip", points, by_hand);
    }
    let found = check_function(&arm(), 0, &Selection::default(), 50, 1, &by_hand).expect("it is compared");
    assert_eq!(found.parameters, ["a", "b", "alpha", "beta"]);
    assert!(found.points == 51 && found.blame.is_empty() && found.counter_example.is_none());
}

#[test]
fn mistakes_of_a_function_are_named() {
    let sign = said(|found, _, _| found[3] *= -1.0);
    assert!(
        sign.starts_with("the Jacobian of `tip` is wrong in 1 of 8 entries (2 residuals by 4 parameters)"),
        "{sign}"
    );
    assert!(sign.contains("\n  of rx by beta: it is the negative\n"), "{sign}");
    assert!(sign.contains("\n  wrong already at ") && sign.contains("of rx by beta is given as"), "{sign}");

    let factor = said(|found, _, _| found[0] *= 2.0);
    assert!(factor.contains("of rx by a: it is twice as large"), "{factor}");

    let degrees = said(|found, _, _| [2, 6].into_iter().for_each(|at| found[at] *= 180.0 / std::f64::consts::PI));
    assert!(degrees.contains("\n  by alpha: it is in degrees instead of radians\n"), "{degrees}");

    let swapped = said(|found, _, _| {
        found.swap(0, 1);
        found.swap(4, 5);
    });
    assert!(swapped.contains("\n  by a: it is the derivative by b\n  by b: it is the derivative by a\n"), "{swapped}");

    let row = said(|found, _, _| found[4..].iter_mut().for_each(|number| *number = -*number));
    assert!(row.contains("\n  of ry: it is the negative\n"), "{row}");

    let all = said(|found, _, _| found.iter_mut().for_each(|number| *number = -*number));
    assert!(all.contains("\n  all of it: it is the negative\n"), "{all}");

    // the term of the second link: nothing simple, but its place, and a point with few numbers
    let missing = said(|found, q, x| found[2] = -q[0] * (x[0] + q[2]).to_radians().sin() * 1f64.to_radians());
    assert!(missing.contains("\n  rx by alpha is given as ") && !missing.contains(": it is"), "{missing}");

    let undefined = said(|found, _, _| found[7] = f64::NAN);
    assert!(undefined.contains("of ry by beta: it is undefined where the derivative is not"), "{undefined}");
}

#[test]
fn a_function_that_cannot_be_compared_says_why() {
    let found = check_jacobian(&arm(), "tip", 5, |_, _| vec![0.0; 3]).unwrap_err();
    assert_eq!(found, "the function gives 3 numbers: 2 residuals by 4 parameters are 8");
    let found = check_jacobian(&arm(), "tpi", 5, by_hand).unwrap_err();
    assert!(found.starts_with("there is no measurement `tpi`: did you mean `tip`"), "{found}");
    let nowhere = check_jacobian(&function("sqrt(-1 - a^2)*x"), "m", 5, |_, _| vec![0.0]).unwrap_err();
    assert_eq!(nowhere, "no point was found at which the derivatives exist");
}

#[test]
fn what_is_freed_is_a_column_of_the_function() {
    let arm = arm();
    let probe = || phical::identify::Probe::from(&arm);
    let with_unused = |q: &[f64], x: &[f64]| {
        let found = by_hand(q, x);
        [&found[..4], &[0.0], &found[4..], &[0.0]].concat()
    };
    assert_eq!(check_jacobian(probe().freeing(&["unused"]), "tip", 5, with_unused), Ok(()));
    let without_a = |q: &[f64], x: &[f64]| {
        let found = by_hand(&[400.0, q[0], q[1], q[2]], x);
        [&found[1..4], &found[5..]].concat()
    };
    // what is held does not move
    assert_eq!(check_jacobian(probe().fixing(&["a"]), "tip", 20, without_a), Ok(()));
}
