//! Starting far away: how often a search ends in the true minimum, alone, by a continuation, and from several starts.

use phical::compile::{Program, compile};
use phical::data::read;
use phical::diag::{Diagnostics, Source, text};
use phical::model::load;
use phical::problem::{Execution, Options, Problem, Selection};
use phical::session::{Far, MultiStart, Procedure, fit_by, follow};
use phical::simd::InstructionSet;
use phical::simulate::{self, simulate};
use phical::unit::Dimension;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::fitting::{estimate, table};
use crate::shared::project;

pub fn program(text_of_model: &str) -> Program {
    let source = Source::new("model.ron", text_of_model);
    let (model, _) = load(&source).unwrap_or_else(|found| panic!("{}", text(&found, false)));
    compile(&model, &source, &[]).unwrap_or_else(|found| panic!("{}", text(&found, false))).0
}

fn shipped(name: &str) -> String {
    std::fs::read_to_string(project("models").join(name).join("model.ron")).expect("a shipped model")
}

/// A random arm with six axes, seen by a tracker: its own geometry, its base and its tool are to be found.
pub fn random_arm(seed: u64) -> String {
    use std::fmt::Write;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut number = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let (mut joints, mut draws, mut inputs) = (String::new(), String::new(), String::new());
    for i in 1..=6 {
        let alpha = ["pi/2", "0", "-pi/2", "pi/2", "-pi/2", "0"][i - 1];
        let (a, d) = (number(-300.0, 300.0), number(-200.0, 400.0));
        let _ = write!(
            joints,
            "Dh(name: \"J{i}\", a: Free({a:.1}), alpha: Free(\"{alpha}\"), d: Free({d:.1}), theta: Free(0)), "
        );
        let _ = write!(draws, "\"q{i}\": Uniform(-1.5, 1.5), ");
        let _ = write!(inputs, "\"q{i}\": (unit: \"rad\", sigma: \"0.1 mrad\"), ");
    }
    format!(
        r#"Model(
            name: "random arm", units: (length: "mm", angle: "rad"),
            parameters: {{ "base": Pose(Free((500, -200, 100, 0.3, -0.2, 1))), "tool": Vec3(Free((40, 20, 120))) }},
            chains: {{ "arm": [Rigid(name: "foot", pose: "base"), {joints}] }},
            measurements: {{ "seen": (
                inputs: {{ {inputs} "x": (unit: "mm", sigma: "0.05 mm"), "y": (unit: "mm", sigma: "0.05 mm"), "z": (unit: "mm", sigma: "0.05 mm") }},
                define: {{ "p": "arm(q1, q2, q3, q4, q5, q6) * tool" }},
                residuals: {{ "miss": "p - vec(x, y, z)" }},
            ) }},
            scenarios: {{ "s": (seed: 1, truth: {{}}, measurements: {{ "seen": (
                rows: 60, draw: {{ {draws} }}, set: {{ "x": "p.x", "y": "p.y", "z": "p.z" }},
                noise: {{ "x": (sigma: "0.05 mm"), "y": (sigma: "0.05 mm"), "z": (sigma: "0.05 mm") }},
            ) }}) }},
        )"#
    )
}

/// A problem with data of a seed, started at the truth; `free` and `fix` as on the command line.
pub fn simulated<'p>(program: &'p Program, seed: u64, free: &[&str], rows: usize) -> Problem<'p> {
    let scenario = &program.scenarios[0];
    let rows = scenario.measurements.iter().map(|m| (m.measurement, m.rows.min(rows))).collect();
    let made = simulate(program, scenario, &simulate::Options { rows, seed: Some(seed), exact: false }).expect("data");
    let selection =
        Selection { free: free.iter().map(|f| (*f).to_owned()).collect(), start: made.truth, ..Selection::default() };
    let bound = Problem::bind(program, made.tables, &Options { selection, ..Options::default() });
    bound.unwrap_or_else(|found| panic!("{}", text(&found, false))).0
}

/// The start moved: angles evenly within ± `angle`, lengths within ± `length`.
pub fn disturbed<'p>(problem: &Problem<'p>, seed: u64, angle: f64, length: f64) -> Problem<'p> {
    use phical::solve::LeastSquares;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let way: Vec<f64> = problem
        .free
        .iter()
        .map(|&c| {
            let size = if problem.layout.coordinates[c].dimension == Dimension::ANGLE { angle } else { length };
            size * (2.0 * random.random::<f64>() - 1.0)
        })
        .collect();
    let mut moved = problem.clone();
    moved.start = problem.retract(&problem.start, &way);
    moved
}

/// Whether a procedure ends at the cost of the true minimum.
fn arrives(problem: &Problem, procedure: &Procedure, cost: f64) -> bool {
    fit_by(problem, procedure).is_ok_and(|fit| fit.status.converged() && fit.cost <= cost * (1.0 + 1e-6) + 1e-12)
}

/// A path that was followed to its end leads where a search from nearby does. As a campaign, for every model (`PHICAL_MODEL=_`):
/// `PHICAL_MODEL=panda PHICAL_SEEDS=50 cargo test --release --test it far::ways -- --nocapture`
#[test]
fn ways_to_the_minimum_are_counted() {
    let seeds = std::env::var("PHICAL_SEEDS").ok().and_then(|n| n.parse().ok()).unwrap_or(2);
    let only = std::env::var("PHICAL_MODEL").unwrap_or_else(|_| "positioner".into());
    let arm: Vec<String> = (2..=6).flat_map(|i| ["theta", "a", "d"].map(|s| format!("J{i}.{s}"))).collect();
    let arm: Vec<&str> = arm.iter().map(String::as_str).collect();
    let cases: [(&str, Option<String>, &[&str], usize); 5] = [
        ("two_theodolite", Some(shipped("two_theodolite")), &[], 40),
        ("panda_sockets", Some(shipped("panda_sockets")), &[], 60),
        ("ur5_pendant", Some(shipped("ur5_pendant")), &arm, 18),
        ("positioner_camera", Some(shipped("positioner_camera")), &[], 30),
        ("random arm", None, &[], 60),
    ];
    for (name, model, free, rows) in cases.into_iter().filter(|(name, ..)| name.contains(&only)) {
        for (angle, length) in [(0.3, 0.1), (0.6, 0.3), (1.0, 0.3)] {
            let (mut counts, mut runs) = ([0usize; 4], 0);
            let begun = std::time::Instant::now();
            let mut times = [0.0; 3];
            for seed in 0..seeds {
                let text = model.clone().unwrap_or_else(|| random_arm(seed));
                let program = program(&text);
                let truth = simulated(&program, seed + 1, free, rows);
                let Ok(fit) = fit_by(&truth, &Procedure::default()) else { continue };
                runs += 1;
                let far = disturbed(&truth, seed, angle, length);
                let clock = std::time::Instant::now();
                counts[0] += usize::from(arrives(&far, &Procedure::default(), fit.cost));
                times[0] += clock.elapsed().as_secs_f64();
                let clock = std::time::Instant::now();
                if let Ok((point, told)) = follow(&far) {
                    counts[2] += usize::from(told.reached >= 1.0);
                    let mut led = far.clone();
                    led.start = point;
                    counts[1] += usize::from(told.reached >= 1.0 && arrives(&led, &Procedure::default(), fit.cost));
                }
                times[1] += clock.elapsed().as_secs_f64();
                let clock = std::time::Instant::now();
                // other starts disturbed likewise: what bounds as wide as the disturbance would give
                let several = (0..9).any(|k| {
                    arrives(&disturbed(&truth, 1000 * (seed + 1) + k, angle, length), &Procedure::default(), fit.cost)
                });
                counts[3] += usize::from(several);
                times[2] += clock.elapsed().as_secs_f64();
            }
            eprintln!(
                "{name} ±{angle} rad ±{length} m: of {runs}: plain {}, path {} (followed {}), 9 other starts {}; {:.0?}; {times:.1?}",
                counts[0],
                counts[1],
                counts[2],
                counts[3],
                begun.elapsed()
            );
            assert!(runs > 0 && counts[1] >= counts[2], "a path was followed to another minimum");
        }
    }
}

/// A point in a plane by its distances from three points of a line: it may be on either side.
const MIRRORED: &str = r#"Model(
    name: "mirrored", units: (length: "mm"),
    parameters: {
        "x": Scalar(Free(nominal: "40 mm", min: "-100 mm", max: "100 mm")),
        "y": Scalar(Free(nominal: "10 mm", min: "-100 mm", max: "100 mm")),
    },
    measurements: { "distance": (
        inputs: { "at": (unit: "mm"), "d": (unit: "mm", sigma: "0.1 mm") },
        residuals: { "miss": "sqrt((x - at)^2 + y^2) - d" },
    ) },
)"#;

fn mirrored(program: &Program, threads: usize) -> Problem<'_> {
    // three errors that no point explains, so that costs are no rounding
    let rows = [[0.0, 50.1], [60.0, 49.95], [120.0, 98.5]].map(|row| row.to_vec());
    let execution = Execution::new(InstructionSet::detect(), threads);
    let options = Options { execution, ..Options::default() };
    Problem::bind(program, vec![(0, table(&rows))], &options).expect("a problem").0
}

fn from(starts: usize, seed: u64) -> Procedure {
    Procedure { far: Far { starts: Some(MultiStart { starts, seed }), continuation: false }, ..Procedure::default() }
}

#[test]
fn mirrored_minima_are_two_and_the_declared_one_counts() {
    let program = program(MIRRORED);
    let mut fits = Vec::new();
    for (seed, threads) in [(1, 1), (1, 2), (1, 3), (2, 1)] {
        let fit = fit_by(&mirrored(&program, threads), &from(20, seed)).expect("a fit");
        let starts = fit.starts.clone().expect("starts");
        assert_eq!((starts.total, starts.converged + starts.undefined), (20, 20));
        assert_eq!(starts.minima.len(), 2, "{starts:?}");
        assert_eq!(starts.minima.iter().map(|m| m.count).sum::<usize>(), starts.converged);
        assert_eq!(starts.agreed, starts.minima[0].count);
        assert!(starts.minima.iter().all(|m| m.count >= 4 && m.as_good), "{starts:?}");
        assert!(starts.minima[0].declared && estimate(&fit, "y").0 > 0.0);
        // only y tells them apart
        let at: Vec<_> = starts.minima.iter().map(|m| (m.at.len(), m.at[0].0.as_str(), m.at[0].1)).collect();
        assert!(at[0].0 == 1 && at[0].1 == "y" && (at[0].2 + at[1].2).abs() < 1e-6, "{at:?}");
        let codes: Vec<_> = fit.warnings.iter().map(|w| w.code.id()).collect();
        assert!(codes.contains(&"W031") && !codes.contains(&"W030"), "{codes:?}");
        fits.push((starts, fit.point));
    }
    // threads do not matter, seeds do
    assert!(fits[0] == fits[1] && fits[0] == fits[2] && fits[0].0 != fits[3].0);
    // and where the declared start leads to the best minimum, the fit is that of this start alone
    let alone = fit_by(&mirrored(&program, 1), &Procedure::default()).expect("a fit");
    assert_eq!(alone.point, fits[0].1);
}

#[test]
fn one_start_is_the_declared_one() {
    let program = program(MIRRORED);
    let fit = fit_by(&mirrored(&program, 1), &from(1, 1)).expect("a fit");
    let starts = fit.starts.expect("starts");
    assert_eq!((starts.total, starts.agreed, starts.minima.len()), (1, 1, 1));
}

#[test]
fn yorks_line_has_a_second_minimum_that_costs_more() {
    let bounds = shipped("published/york_line")
        .replace("Free(6)", "Free(nominal: 1.5, min: -10, max: 10)")
        .replace("Free(-0.5)", "Free(nominal: 0.3, min: -2, max: 2)");
    let program = program(&bounds);
    let mut found = Diagnostics::new();
    let folder = project("models/published/york_line");
    let table = read(&program, 0, &program.measurements[0].data, &folder, &mut found).expect("data");
    let problem = Problem::bind(&program, vec![(0, table)], &Options::default()).expect("a problem").0;
    let fit = fit_by(&problem, &from(30, 1)).expect("a fit");
    let starts = fit.starts.as_ref().expect("starts");
    assert!((2.0 * fit.cost - 11.866_353_2).abs() < 1e-6, "{}", fit.cost);
    // the declared values are those that lead to the other one
    let other = starts.minima.iter().find(|m| m.declared).expect("the declared one");
    assert!((2.0 * other.cost - 231.10).abs() < 0.05 && !other.as_good, "{starts:?}");
    assert!(starts.agreed > 1 && !starts.minima[0].declared);
    let codes: Vec<_> = fit.warnings.iter().map(|w| w.code.id()).collect();
    assert!(codes.contains(&"W030") && !codes.contains(&"W031"), "{codes:?}");
}

#[test]
fn without_bounds_and_priors_nothing_can_be_varied() {
    let program = program(&random_arm(1));
    let found = fit_by(&simulated(&program, 1, &[], 60), &from(3, 1)).expect_err("nothing to vary");
    assert_eq!(found.code.id(), "E070");
}

#[test]
fn what_no_residual_sees_is_no_difference() {
    // only the sum is seen, and of all points with this sum every start comes to the one nearest to the nominal values
    let program = program(
        r#"(
            name: "sum", parameters: { "a": Scalar(Free(nominal: 1, min: -50, max: 50)), "b": Scalar(Free(nominal: 2, min: -50, max: 50)), "c": Scalar(Free(0)) },
            measurements: { "m": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - (a + b + c*x)"}) },
        )"#,
    );
    let rows: Vec<Vec<f64>> = [[0.0, 10.1], [1.0, 10.9], [2.0, 12.2], [3.0, 12.8]].map(|row| row.to_vec()).to_vec();
    let problem = Problem::bind(&program, vec![(0, table(&rows))], &Options::default()).expect("a problem").0;
    let fit = fit_by(&problem, &from(12, 1)).expect("a fit");
    let starts = fit.starts.expect("starts");
    assert_eq!((starts.agreed, starts.minima.len()), (12, 1), "{starts:?}");
    assert_eq!(starts.not_varied, ["c"]);
}

#[test]
fn a_path_is_followed_to_the_same_minimum() {
    let program = program(&shipped("positioner_camera"));
    for seed in 1..=3 {
        let truth = simulated(&program, seed, &[], 20);
        let cost = fit_by(&truth, &Procedure::default()).expect("a fit").cost;
        let far = disturbed(&truth, seed, 1.0, 0.3);
        let by_path = Procedure { far: Far { starts: None, continuation: true }, ..Procedure::default() };
        let fit = fit_by(&far, &by_path).expect("a fit");
        let told = fit.continuation.expect("a path");
        assert!(told.reached == 1.0 && told.steps > 1, "{told:?}");
        assert!((fit.cost - cost).abs() <= 1e-6 * cost);
        // what the path leads to does as a start, without the search from the declared one
        let mut led = far.clone();
        led.start = follow(&far).expect("a path").0;
        assert!(arrives(&led, &Procedure::default(), cost));
    }
}
