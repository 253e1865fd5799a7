//! A wish to stop, at every stage that is told: what comes back says that it is no minimum, or is the whole answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use phical::compile::{LossOf, Program, Robust};
use phical::data::{Stage, Watch};
use phical::design::{Aim, Request, confirm, design};
use phical::diag::Code;
use phical::fit::Fit;
use phical::identify::{Inputs, Probe};
use phical::problem::{Execution, Options, Problem, Stop};
use phical::session::{Far, MultiStart, Procedure, Search, fit_by, hold_out};
use phical::solve::{Norm, Status};
use phical::statistics::{Kernel, Loss};

use crate::fitting::table;
use crate::flagship::compiled;

/// A point seen from a rail, by distances and directions.
const RAIL: &str = r#"(
    name: "rail",
    parameters: {
        "x": Scalar(Free(nominal: 40, min: -200, max: 200)), "y": Scalar(Free(nominal: 30, min: -200, max: 200)),
        "c": Scalar(Free(nominal: 0, min: -9, max: 9)),
    },
    measurements: { "sight": (
        inputs: { "at": (), "d": (sigma: 0.1, group: "d"), "b": (unit: "rad", sigma: 0.001, group: "b") },
        residuals: { "far": "sqrt((x - at)^2 + y^2) + c - d", "way": "atan2(y, x - at) - b" },
    ) },
)"#;

/// Errors of the distances larger than declared, of the directions smaller, and two that are gross.
fn sights() -> Vec<Vec<f64>> {
    let row = |k: usize| {
        let (at, phase) = (3.0 * k as f64, k as f64);
        let (x, y) = (55.0 - at, 42.0_f64);
        let gross = if k == 7 || k == 23 { 3.0 } else { 0.0 };
        let (noise, turn) = (0.2 * (phase * phase * 0.7 + phase).sin(), 4e-4 * (phase * phase * 1.3).cos());
        vec![at, x.hypot(y) + 1.5 + noise + gross, y.atan2(x) + turn]
    };
    (0..40).map(row).collect()
}

/// The problem while `told` hears of it, until it says that it is enough.
fn rail<'p>(program: &'p Program, loss: Option<Loss>, enough: u64, told: &Arc<AtomicU64>) -> Problem<'p> {
    let (stop, heard) = (Stop::default(), Arc::clone(told));
    let watch = {
        let stop = stop.clone();
        Watch::new(move |_| {
            if heard.fetch_add(1, Ordering::Relaxed) + 1 >= enough {
                stop.now();
            }
        })
    };
    let robust = loss.map(|loss| Robust { loss, of: LossOf::Row, estimated: true });
    let execution = Execution::default().until(&stop).told_to(&watch);
    let options = Options { robust, execution, ..Options::default() };
    Problem::bind(program, vec![(0, table(&sights()))], &options).expect("a problem").0
}

fn procedures() -> Vec<(&'static str, Procedure, Option<Loss>)> {
    let plain = Procedure::default;
    let far = |starts: usize, continuation| Far {
        starts: (starts > 0).then_some(MultiStart { starts, seed: 5 }),
        continuation,
    };
    let cauchy = Loss::new(Kernel::Cauchy, None).expect("a loss");
    let tukey = Loss::new(Kernel::Tukey, None).expect("a loss");
    vec![
        ("a fit", plain(), None),
        ("snooping", Procedure { snoop: true, ..plain() }, None),
        ("components", Procedure { variance_components: true, ..plain() }, None),
        ("both", Procedure { snoop: true, variance_components: true, ..plain() }, None),
        ("a loss", plain(), Some(cauchy)),
        ("a loss that rejects, with components", Procedure { variance_components: true, ..plain() }, Some(tukey)),
        ("starts", Procedure { far: far(6, false), ..plain() }, None),
        ("continuation", Procedure { far: far(0, true), ..plain() }, None),
        ("starts and continuation", Procedure { far: far(4, true), ..plain() }, None),
        ("conic steps", Procedure { search: Search::Conic(Norm::LeastSquares), ..plain() }, None),
    ]
}

fn values(fit: &Fit) -> Vec<(f64, Option<f64>)> {
    fit.parameters.iter().map(|p| (p.value, p.sigma)).collect()
}

#[test]
fn stopped_anywhere_a_fit_is_whole_or_says_that_it_is_not() {
    let program = compiled(RAIL);
    for (name, procedure, loss) in procedures() {
        let told = Arc::new(AtomicU64::new(0));
        let whole = fit_by(&rail(&program, loss, u64::MAX, &told), &procedure).expect("a fit");
        assert!(whole.status.converged(), "{name}");
        let all = told.load(Ordering::Relaxed);
        assert!(all >= 3, "{name} tells of {all} stages");
        let mut cut = 0;
        for enough in 1..=all + 1 {
            let told = Arc::new(AtomicU64::new(0));
            let fit = fit_by(&rail(&program, loss, enough, &told), &procedure).expect("the best so far");
            let warned = fit.warnings.iter().any(|warning| warning.code == Code::Interrupted);
            assert!(values(&fit).iter().all(|(value, _)| value.is_finite()) && fit.cost.is_finite(), "{name} {enough}");
            if fit.status == Status::Interrupted {
                assert!(warned && !fit.verdict().trustworthy(), "{name}, stopped at {enough} of {all}");
                cut += 1;
            } else {
                assert!(!warned && values(&fit) == values(&whole), "{name}, stopped at {enough} of {all}");
                assert_eq!(fit.removed, whole.removed);
            }
        }
        // nothing is stopped by what comes after the end
        assert!(cut > 0 && cut <= all, "{name}: {cut} of {all}");
    }
}

#[test]
fn stopped_anywhere_folds_are_all_made_or_not_told_of() {
    let program = compiled(RAIL);
    let procedure = Procedure::default();
    let told = Arc::new(AtomicU64::new(0));
    let problem = rail(&program, None, u64::MAX, &told);
    let point = fit_by(&problem, &procedure).expect("a fit").point;
    told.store(0, Ordering::Relaxed);
    let whole = hold_out(&problem, &procedure, 5, &point).expect("folds").expect("all");
    let all = told.load(Ordering::Relaxed);
    assert_eq!(all, 5);
    for enough in 1..=all + 1 {
        let told = Arc::new(AtomicU64::new(0));
        let found = hold_out(&rail(&program, None, enough, &told), &procedure, 5, &point).expect("folds");
        assert!(found.as_ref().is_none_or(|found| *found == whole), "stopped at {enough}");
        assert_eq!(found.is_some(), enough > all);
    }
}

#[test]
fn what_is_counted_is_told_up_to_its_end() {
    let program = compiled(RAIL);
    let heard = Arc::new(std::sync::Mutex::new(Vec::new()));
    let here = Arc::clone(&heard);
    let watch = Watch::new(move |stage| here.lock().expect("nobody panics").push(stage));
    let options = Options { execution: Execution::default().told_to(&watch), ..Options::default() };
    let problem = Problem::bind(&program, vec![(0, table(&sights()))], &options).expect("a problem").0;
    let far = Far { starts: Some(MultiStart { starts: 6, seed: 5 }), continuation: false };
    fit_by(&problem, &Procedure { far, ..Procedure::default() }).expect("a fit");
    let heard = heard.lock().expect("nobody panics");
    let mut starts: Vec<u64> = Vec::new();
    let mut linearised: Vec<u64> = Vec::new();
    for stage in heard.iter() {
        match *stage {
            Stage::Of { what, done, all } => {
                assert_eq!((what, all), ("starts", 6));
                assert!(linearised.is_empty(), "searches of starts are told one by one");
                starts.push(done);
            }
            Stage::Search { linearised: so_far, cost } => {
                assert!(cost.is_nan() == linearised.is_empty(), "{cost} at {so_far}");
                linearised.push(so_far);
            }
            Stage::Bytes { .. } => panic!("nothing is read"),
        }
    }
    starts.sort_unstable();
    assert_eq!(starts, (1..=6).collect::<Vec<u64>>());
    assert_eq!(linearised, (1..=linearised.len() as u64).collect::<Vec<u64>>());
}

#[test]
fn stopped_anywhere_the_runs_that_confirm_a_design_are_those_that_were_made() {
    const RUNS: u64 = 24;
    let program = compiled(RAIL);
    let confirmation = |enough: u64| {
        let (stop, runs) = (Stop::default(), Arc::new(AtomicU64::new(0)));
        let (stopped, counted) = (stop.clone(), Arc::clone(&runs));
        let watch = Watch::new(move |stage| {
            if matches!(stage, Stage::Of { what: "runs", .. }) && counted.fetch_add(1, Ordering::Relaxed) + 1 >= enough
            {
                stopped.now();
            }
        });
        let options = Options { execution: Execution::default().until(&stop).told_to(&watch), ..Options::default() };
        let rows = Problem::bind(&program, vec![(0, table(&sights()))], &options).expect("a problem").0;
        let candidates =
            Probe { program: &program, options: options.clone(), inputs: Inputs::Rows(&rows), rows: vec![], seed: 1 };
        let request = Request { candidates, aim: Aim::D, targets: vec![], volume: None, rows: Some(12) };
        confirm(&design(&request).expect("a design"), None, &options, RUNS, 3).expect("it simulates")
    };
    let whole = confirmation(u64::MAX);
    assert_eq!((whole.runs, whole.failed), (RUNS, 0));
    for enough in [1, 2, 7, RUNS] {
        let found = confirmation(enough);
        // one that was being made by another thread may have come to its end
        assert!((enough..=RUNS).contains(&found.runs) && found.failed == 0, "{enough}: {found:?}");
        assert_eq!(found.runs == RUNS, found == whole, "{enough}: {found:?}");
    }
}
