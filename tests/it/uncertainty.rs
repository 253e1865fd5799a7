//! Predicted uncertainties by second routes: closed forms, random draws, differences, and another datum.

use std::path::Path;

use phical::compile::Program;
use phical::evaluate::{Estimated, Uncertainties, Why, uncertainties};
use phical::fit::{Fit, JointUncertainty};
use phical::problem::{Options, Problem, Quantities, Selection, Weights};
use phical::session::{Choice, Session, calibrate};
use phical::solve::LeastSquares;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

use crate::close::close;
use crate::fitting::{bound, table};
use crate::flagship::compiled;
use crate::shared::project;

/// A covariance of parameters by their names.
fn joint(names: &[&str], covariance: &[&[f64]], dof: f64) -> JointUncertainty {
    JointUncertainty {
        names: names.iter().map(|&name| name.into()).collect(),
        covariance: Some(covariance.iter().map(|row| row.to_vec()).collect()),
        tolerances: vec![1e-3; names.len()],
        on_bound: vec![false; names.len()],
        null_directions: Vec::new(),
        dof,
    }
}

fn of(problem: &Problem, point: &[f64], known: &JointUncertainty) -> Uncertainties {
    let calibration = Estimated::new(problem, "calibration", known);
    uncertainties(problem, point, &[calibration]).expect("defined").remove(0)
}

/// Outputs of the only row at a point, in internal units.
fn outputs(problem: &Problem, point: &[f64]) -> Vec<f64> {
    let mut all = Vec::new();
    let visit = |_: usize, values: &[f64]| all = values.to_vec();
    problem.blocks[0].values(Quantities::Outputs, &problem.layout, point, visit).expect("defined");
    all
}

/// A point on a turntable: its distance along an arm, and the angle of the table; errors of both go together.
const TURNTABLE: &str = r#"(
    name: "turntable", units: (length: "mm", angle: "rad"),
    parameters: { "arm": Scalar(Free("200 mm")), "zero": Scalar(Free("0.1 rad")) },
    measurements: { "point": (
        inputs: {
            "r": (unit: "mm", sigma: "0.05 mm + 1e-3*r", group: "rail"), "t": (unit: "rad", sigma: "1 mrad"),
            "h": (unit: "mm", sigma: "0.2 mm"),
        },
        correlations: { "r, t": 0.6 },
        residuals: { "one": "r - arm", "other": "t - zero" },
        outputs: { "x": "(arm + r)*cos(t + zero)", "y": "(arm + r)*sin(t + zero)", "z": "h + 0.5*arm" },
    ) },
)"#;

#[test]
fn random_draws_scatter_as_predicted() {
    const DRAWS: usize = 60_000;
    let program = compiled(TURNTABLE);
    let read = [150.0, 0.7, 30.0];
    let problem = bound(&program, &[table(&[read.to_vec()])], Selection::default(), None);
    let (sa, sz, rho) = (0.3, 8e-4, -0.7);
    let known = joint(&["arm", "zero"], &[&[sa * sa, rho * sa * sz], &[rho * sa * sz, sz * sz]], 12.0);
    let found = of(&problem, &problem.start, &known);
    let covariance = &found.covariance.as_ref().unwrap()[0];
    let sigma: Vec<f64> = found.outputs.iter().map(|output| output.sigma[0].unwrap()).collect();
    for seed in [1, 2, 3] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut pair = |rho: f64| {
            let (a, b): (f64, f64) = (random.sample(StandardNormal), random.sample(StandardNormal));
            (a, rho * a + (1.0 - rho * rho).sqrt() * b)
        };
        let mut sums = [[0.0; 3]; 3];
        for _ in 0..DRAWS {
            let ((a, z), (r, t), (h, _)) = (pair(rho), pair(0.6), pair(0.0));
            let (arm, zero) = (200.0 + sa * a, 0.1 + sz * z);
            let (r, t, h) = (read[0] + 0.2 * r, read[1] + 1e-3 * t, read[2] + 0.2 * h);
            let p = [(arm + r) * (t + zero).cos(), (arm + r) * (t + zero).sin(), h + 0.5 * arm];
            let at = [350.0 * 0.8f64.cos(), 350.0 * 0.8f64.sin(), 130.0];
            for i in 0..3 {
                for j in 0..3 {
                    sums[i][j] += (p[i] - at[i]) * (p[j] - at[j]) / DRAWS as f64;
                }
            }
        }
        for i in 0..3 {
            assert!(
                (sums[i][i].sqrt() / sigma[i] - 1.0).abs() < 0.03,
                "seed {seed}, {i}: {} {}",
                sums[i][i].sqrt(),
                sigma[i]
            );
            for j in 0..3 {
                let off = (sums[i][j] - covariance[i][j].unwrap()) / (sigma[i] * sigma[j]);
                assert!(off.abs() < 0.03, "seed {seed}, {i} {j}: {off}");
            }
        }
    }
    // the budget of z by hand: no correlated errors in it
    let z = &found.outputs[2];
    let names: Vec<&str> = z.budget.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["rail", "angle", "length", "calibration"]);
    let (reading, arm) = (0.2f64.powi(2), (0.5 * sa).powi(2));
    close(&[z.budget[2].1, z.budget[3].1], &[reading / (reading + arm), arm / (reading + arm)], 1e-12, "budget");
    assert!((z.effective_dof.unwrap() / (12.0 * ((reading + arm) / arm).powi(2)) - 1.0).abs() < 1e-12);
    for output in &found.outputs {
        assert!((output.budget.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
    }
}

/// A hinge with a rotation and targets of its own: members are told apart, and a rotation turns by its right perturbation.
const HINGE: &str = r#"(
    name: "hinge", units: (length: "mm", angle: "deg"),
    parameters: {
        "mount": Rotation(Free(("10 deg", "-20 deg", "30 deg"))),
        "target": Vec3(value: Free(("100 mm", "50 mm", "-20 mm")), family: true),
    },
    measurements: { "look": (
        keys: ["at"], inputs: { "t": (unit: "deg", sigma: "0.01 deg") },
        residuals: { "one": "rotate(mount, target[at])", "other": "t" }, outputs: { "p": "rotate(mount, target[at]) * cos(t)" },
    ) },
)"#;

#[test]
fn rotations_and_members_agree_with_differences() {
    let program = compiled(HINGE);
    let mut rows = phical::data::Table::new(1, 1);
    for (at, t) in [("a", 0.2), ("b", 0.5), ("a", -0.4)] {
        rows.push(&[at], &[t], None).expect("a row of the table");
    }
    let problem = bound(&program, &[rows], Selection::default(), None);
    let names: Vec<String> = problem.layout.coordinates.iter().map(|c| c.name.clone()).collect();
    assert_eq!(names.len(), 9);
    // a covariance with all correlations, internal units: A Aᵀ
    let a = |i: usize, j: usize| ((3 * i + 5 * j) as f64).sin() * if i < 3 { 1e-3 } else { 0.1 };
    let internal: Vec<Vec<f64>> =
        (0..9).map(|i| (0..9).map(|j| (0..9).map(|k| a(i, k) * a(j, k)).sum()).collect()).collect();
    let unit: Vec<f64> = (0..9).map(|i| if i < 3 { 1f64.to_degrees() } else { 1.0 }).collect();
    let reported: Vec<Vec<f64>> =
        (0..9).map(|i| (0..9).map(|j| internal[i][j] * unit[i] * unit[j]).collect()).collect();
    let rows: Vec<&[f64]> = reported.iter().map(Vec::as_slice).collect();
    let known = joint(&names.iter().map(String::as_str).collect::<Vec<_>>(), &rows, f64::INFINITY);
    let found = of(&problem, &problem.start, &known);

    let at_row = |point: &[f64], row: usize| {
        let mut all = Vec::new();
        let visit = |at: usize, values: &[f64]| {
            if at == row {
                all = values.to_vec()
            }
        };
        problem.blocks[0].values(Quantities::Outputs, &problem.layout, point, visit).expect("defined");
        all
    };
    for row in 0..3 {
        let gradient: Vec<Vec<f64>> = (0..9)
            .map(|j| {
                let h = 1e-5;
                let moved = |h: f64| {
                    let mut delta = vec![0.0; 9];
                    delta[j] = h;
                    at_row(&problem.retract(&problem.start, &delta), row)
                };
                moved(h).iter().zip(moved(-h)).map(|(plus, minus)| (plus - minus) / (2.0 * h)).collect()
            })
            .collect();
        let t: f64 = [0.2, 0.5, -0.4][row];
        let p = at_row(&problem.start, row);
        for i in 0..3 {
            let mut variance = (p[i] * t.tan() * 0.01f64.to_radians()).powi(2);
            for k in 0..9 {
                for l in 0..9 {
                    variance += gradient[k][i] * internal[k][l] * gradient[l][i];
                }
            }
            let sigma = found.outputs[i].sigma[row].unwrap();
            assert!((sigma / variance.sqrt() - 1.0).abs() < 1e-7, "{row} {i}: {sigma} {}", variance.sqrt());
        }
    }
}

/// The flagship's fit, and its session with more outputs.
fn flagship(extra: &[&str], free: &[&str], weights: Weights) -> (Session, Fit) {
    let extra: Vec<String> = extra.iter().map(|&text| text.into()).collect();
    let path = project("models/two_theodolite/model.ron");
    let session = Session::open(Path::new(&path), &extra).expect("it opens");
    let selection = Selection { free: free.iter().map(|&name| name.into()).collect(), ..Selection::default() };
    let options = Options { weights: Some(weights), selection, ..Options::default() };
    let fit = calibrate(&session.bind(&Choice::default(), &options).expect("it binds")).expect("it fits").fit;
    (session, fit)
}

/// The program's measurement with one row of readings, at the values of a fit.
fn at_fit<'p>(program: &'p Program, index: usize, row: &[f64], fit: &Fit) -> Problem<'p> {
    let start = fit.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
    let options = Options { selection: Selection { start, ..Selection::default() }, ..Options::default() };
    // readings that are not there, as tilts, are zero
    let mut row = row.to_vec();
    row.resize(program.measurements[index].inputs.len(), 0.0);
    Problem::bind(program, vec![(index, table(&[row]))], &options).expect("it binds").0
}

const SIGHTS: [f64; 4] = [-0.516545, 0.287061, 0.600733, 0.258925];

#[test]
fn a_sighting_agrees_with_differences() {
    let (session, fit) = flagship(&[], &[], Weights::Unit);
    let problem = at_fit(&session.program, 1, &SIGHTS, &fit);
    let found = of(&problem, &problem.start, &JointUncertainty::of(&fit));
    let covariance = fit.covariance.as_ref().unwrap();
    let n = fit.parameters.len();
    let central = |f: &dyn Fn(f64) -> Vec<f64>, h: f64| -> Vec<f64> {
        f(h).iter().zip(f(-h)).map(|(plus, minus)| (plus - minus) / (2.0 * h)).collect()
    };
    let by_parameters: Vec<Vec<f64>> = (0..n)
        .map(|j| {
            let moved = |h: f64| {
                let mut delta = vec![0.0; n];
                delta[j] = h;
                outputs(&problem, &problem.retract(&problem.start, &delta))
            };
            central(&moved, if fit.parameters[j].unit == "mm" { 1e-2 } else { 1e-6 })
        })
        .collect();
    let by_inputs: Vec<Vec<f64>> = (0..4)
        .map(|k| {
            let moved = |h: f64| {
                let mut row = SIGHTS;
                row[k] += h;
                let other = at_fit(&session.program, 1, &row, &fit);
                outputs(&other, &other.start)
            };
            central(&moved, 1e-6)
        })
        .collect();
    let reading = 17.59f64 / 3600.0 * std::f64::consts::PI / 180.0;
    let mut expected = [[0.0; 3]; 3];
    for (i, line) in expected.iter_mut().enumerate() {
        for (j, entry) in line.iter_mut().enumerate() {
            for k in 0..n {
                for l in 0..n {
                    *entry += by_parameters[k][i] * covariance.entries[k][l] * by_parameters[l][j];
                }
            }
            *entry += by_inputs.iter().map(|by| by[i] * by[j] * reading * reading).sum::<f64>();
        }
    }
    let together = &found.covariance.as_ref().unwrap()[0];
    for i in 0..3 {
        let sigma = found.outputs[i].sigma[0].unwrap();
        assert!((sigma / expected[i][i].sqrt() - 1.0).abs() < 1e-5, "{i}: {sigma} {}", expected[i][i].sqrt());
        for j in 0..3 {
            let scale = (expected[i][i] * expected[j][j]).sqrt();
            assert!((together[i][j].unwrap() - expected[i][j]).abs() < 1e-5 * scale, "{i} {j}");
        }
    }
}

#[test]
fn what_moves_with_the_datum_has_no_uncertainty_and_what_does_not_has_the_same() {
    let extra = ["norm(p1 - p2)", "L1.b", "L1.alpha"];
    let bar = [
        -0.5165453627337245,
        0.2870606229256191,
        0.6007331883771985,
        0.258925459541821,
        -0.5174061543019277,
        0.14067702123379147,
        0.5950286487075682,
        0.11989245851816863,
        341.1746092173281,
    ];
    let of_fit = |session: &Session, fit: &Fit| {
        let problem = at_fit(&session.program, 0, &bar, fit);
        let found = of(&problem, &problem.start, &JointUncertainty::of(fit));
        let names: Vec<String> = problem.blocks[0].measurement.outputs.iter().map(|o| o.name.clone()).collect();
        (names, found.outputs)
    };
    let (session, held) = flagship(&extra, &[], Weights::Unit);
    let (names, all) = of_fit(&session, &held);
    let place = |name: &str| names.iter().position(|known| known == name).unwrap();
    let (session, free) = flagship(&extra, &["L1.b"], Weights::Unit);
    assert_eq!(free.null_directions.len(), 1);
    let (_, loose) = of_fit(&session, &free);
    // points are told in the base frame, which slides along the left standing axis with the datum
    for name in ["p1.x", "p1.y", "p1.z", "p2.z", "L1.b"] {
        let output = &loose[place(name)];
        assert_eq!((output.sigma[0], output.rms, output.coverage_factor), (None, None, None), "{name}");
        assert_eq!(output.gaps[0].why, Why::NotEstimable, "{name}");
        assert_eq!(output.gaps[0].parameters, ["L1.b", "R1.b"], "{name}");
    }
    assert!(all[place("p1.x")].sigma[0].is_some());
    // held, it is exact
    assert_eq!(all[place("L1.b")].gaps[0].why, Why::Nothing);
    // a length does not move with the base, whatever the datum
    let (one, other) = (all[place("norm(p1 - p2)")].sigma[0].unwrap(), loose[place("norm(p1 - p2)")].sigma[0].unwrap());
    assert!((one / other - 1.0).abs() < 1e-6, "{one} {other}");
}

#[test]
fn what_depends_on_a_bound_has_no_uncertainty() {
    let text = r#"(
        name: "line",
        parameters: { "a": Scalar(Free(0)), "b": Scalar(Free(nominal: 0, max: 1)) },
        measurements: { "m": (
            inputs: { "x": (), "y": () }, residuals: { "r": (value: "y - a - b*x", sigma: 0.1) },
            outputs: { "at": "a + b*x", "a": "a", "root": "sqrt(x) * a", "exact": "2*x" },
        ) },
    )"#;
    let program = compiled(text);
    let rows = [vec![0.0, 0.1], vec![1.0, 2.1], vec![2.0, 3.9]];
    let problem = bound(&program, &[table(&rows)], Selection::default(), None);
    let fit = crate::fitting::fit(&problem);
    assert!(fit.parameters[1].at_bound);
    let found = of(&problem, &fit.point, &JointUncertainty::of(&fit));
    let why = |output: usize| found.outputs[output].gaps.iter().map(|gap| (gap.why, gap.rows)).collect::<Vec<_>>();
    // at x = 0 the line is its intercept
    assert_eq!(why(0), [(Why::OnBound, 2)]);
    assert_eq!(found.outputs[0].gaps[0].parameters, ["b"]);
    assert_eq!(why(1), []);
    close(&[found.outputs[1].sigma[2].unwrap()], &[0.1 / 3f64.sqrt()], 1e-12, "the mean of three");
    assert_eq!(why(3), [(Why::Nothing, 3)]);
    // values of which nothing is known
    let unstated = Estimated::unstated(&problem, "calibration", problem.free.clone());
    let found = uncertainties(&problem, &fit.point, &[unstated]).expect("defined").remove(0);
    assert_eq!(found.outputs[0].gaps[0].why, Why::Unstated);
    assert_eq!(found.outputs[1].gaps[0].rows, 3);
}

#[test]
fn an_output_without_a_derivative_has_a_value_and_no_uncertainty() {
    let text = r#"(
        name: "corner", parameters: { "a": Scalar(Free(1)) },
        measurements: { "m": (
            inputs: { "x": (sigma: 0.1) }, residuals: { "r": "a - x" }, outputs: { "s": "sqrt(x)", "a": "x" },
        ) },
    )"#;
    let program = compiled(text);
    let problem = bound(&program, &[table(&[vec![0.0], vec![4.0]])], Selection::default(), Some(Weights::Unit));
    let found = uncertainties(&problem, &problem.start, &[]).expect("defined").remove(0);
    assert_eq!(found.outputs[0].sigma[0], None);
    assert!((found.outputs[0].sigma[1].unwrap() - 0.1 / 4.0).abs() < 1e-15);
    assert_eq!((found.outputs[0].gaps[0].why, found.outputs[0].gaps[0].rows), (Why::NoDerivative, 1));
    assert_eq!(found.covariance.unwrap()[0][0], [None, None]);
}

#[test]
fn a_sigma_that_is_none_is_refused_with_its_row() {
    let text = r#"(
        name: "s", parameters: { "a": Scalar(Free(1)) },
        measurements: { "m": ( inputs: { "x": (sigma: "0.1*x") }, residuals: { "r": "a - x" }, outputs: { "x2": "2*x" } ) },
    )"#;
    let program = compiled(text);
    let problem = bound(&program, &[table(&[vec![1.0], vec![-1.0]])], Selection::default(), Some(Weights::Unit));
    let refused = uncertainties(&problem, &problem.start, &[]).expect_err("−0.1 is no standard deviation");
    assert!(refused.0.message.contains("row 2: the sigma of `x` is -0.1"), "{}", refused.0.message);
}
