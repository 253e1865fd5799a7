//! The assertions that users have for their own models, on every shipped one.

use std::path::{Path, PathBuf};

use phical::data::Table;
use phical::fit::Fit;
use phical::identify::Probe;
use phical::problem::{Execution, Options, Problem, Quantities};
use phical::session::{Choice, Procedure, Search, Session, fit_by};
use phical::simd::InstructionSet;
use phical::simulate::{self, simulate};
use phical::solve::Norm;
use phical::testing::{
    Spread, assert_derivatives, assert_identifiable, assert_invisible, assert_rank, assert_recovers, assert_same_fit,
    data, parameters, readings,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;

use crate::shared::project;

/// Every model file of the project, by its path below `models`, with how many of how many free parameters its measurements see.
const SHIPPED: &[(&str, usize, usize)] = &[
    ("driels_cmm/hayati.ron", 12, 12),
    ("driels_cmm/model.ron", 12, 12),
    ("epipolar_pair/model.ron", 7, 7),
    ("everett_beam/model.ron", 45, 45),
    ("jarvis_line/model.ron", 47, 47),
    ("judd_two_theodolites/model.ron", 47, 47),
    ("known_distances/model.ron", 25, 25),
    ("legnani_scara/model.ron", 14, 14),
    ("mooring_cmm/model.ron", 32, 32),
    ("nakamura_tracker/model.ron", 60, 60),
    ("nist/Chwirut1/model.ron", 3, 3),
    ("nist/Chwirut2/model.ron", 3, 3),
    ("nist/DanWood/model.ron", 2, 2),
    ("nist/Gauss1/model.ron", 8, 8),
    ("nist/Gauss2/model.ron", 8, 8),
    ("nist/Gauss3/model.ron", 8, 8),
    ("nist/Kirby2/model.ron", 5, 5),
    ("nist/Lanczos1/model.ron", 6, 6),
    ("nist/Lanczos2/model.ron", 6, 6),
    ("nist/Misra1a/model.ron", 2, 2),
    ("nist/Misra1b/model.ron", 2, 2),
    ("nist/Misra1c/model.ron", 2, 2),
    ("nist/Misra1d/model.ron", 2, 2),
    ("nist/Nelson/model.ron", 3, 3),
    ("nist/Roszman1/model.ron", 4, 4),
    ("panda_sockets/model.ron", 37, 37),
    ("positioner_camera/model.ron", 14, 14),
    ("preising_camera/model.ron", 38, 38),
    ("published/levelling_net/model.ron", 3, 3),
    ("published/new_point_by_angles/model.ron", 2, 2),
    ("published/point_in_space/model.ron", 3, 3),
    ("published/trilateration/model.ron", 4, 4),
    ("published/york_line/model.ron", 2, 2),
    // the scale of the staffs is known by its prior alone
    ("shared_errors/model.ron", 8, 9),
    ("stone_ultrasound/model.ron", 36, 36),
    ("sultan_axes/axes.ron", 78, 78),
    // six lines and a chain: 24 where they are the axes of the chain, more where they are those of none
    ("sultan_axes/chain.ron", 30, 48),
    ("sultan_axes/model.ron", 33, 33),
    ("tang_line/model.ron", 26, 26),
    ("two_theodolite/model.ron", 20, 20),
    ("two_theodolite/plumb_line.ron", 20, 20),
    // everything is held: it is evaluated, not fitted
    ("ur5_pendant/model.ron", 0, 0),
    ("vincze_tracker/model.ron", 40, 40),
    ("whitney_bar/model.ron", 35, 35),
];

fn sessions() -> impl Iterator<Item = (&'static str, Session)> {
    SHIPPED.iter().map(|(name, ..)| {
        (*name, Session::open(&project("models").join(name), &[]).unwrap_or_else(|found| panic!("{name}: {found:?}")))
    })
}

/// The model's data, or else made-up ones; where there are neither, a loud line.
fn problem<'s>(name: &str, session: &'s Session, options: &Options) -> Option<Problem<'s>> {
    if let Ok(bound) = session.bind(&Choice::default(), options) {
        return Some(bound.problem);
    }
    let Some(scenario) = session.program.scenarios.first() else {
        eprintln!("SKIPPED: {name} has neither data here nor a scenario");
        return None;
    };
    let made = simulate(&session.program, scenario, &simulate::Options::default()).expect("it simulates");
    Some(Problem::bind(&session.program, made.tables, options).expect("it binds").0)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for path in std::fs::read_dir(folder).expect("readable").flatten().map(|entry| entry.path()) {
        match path.is_dir() {
            true => all.extend(files(&path)),
            false if path.extension().is_some_and(|ending| ending == "ron") => all.push(path),
            false => {}
        }
    }
    all
}

#[test]
fn every_shipped_model_is_listed() {
    let root = project("models");
    let mut found: Vec<String> = files(&root)
        .iter()
        .map(|path| path.strip_prefix(&root).expect("below").to_string_lossy().replace('\\', "/"))
        .collect();
    found.sort();
    assert_eq!(found, SHIPPED.iter().map(|(name, ..)| *name).collect::<Vec<_>>());
}

#[test]
fn derivatives_agree() {
    let (mut all, mut sharp) = (0, 0);
    for (name, session) in sessions() {
        eprintln!("{name}");
        let from_declared = assert_derivatives(&session, 3);
        all += from_declared.derivatives;
        sharp += from_declared.sharp;
        eprintln!("{from_declared:?}");
        if let Some(problem) = problem(name, &session, &Options::default()) {
            assert_derivatives(&problem, 1);
        }
    }
    assert!(sharp as f64 > 0.95 * all as f64, "{sharp} of {all}");
}

#[test]
fn ranks_are_as_stated() {
    let mut seen = 0;
    for ((name, session), (_, rank, free)) in sessions().zip(SHIPPED) {
        let Some(problem) = problem(name, &session, &Options::default()) else { continue };
        eprintln!("{name}");
        assert_eq!(problem.free.len(), *free, "{name}");
        assert_rank(&problem, *rank);
        if rank == free {
            assert_identifiable(&problem);
        }
        seen += 1;
    }
    assert!(seen >= SHIPPED.len() - 1, "{seen}");
}

#[test]
fn what_is_known_to_be_invisible_is() {
    let session = Session::open(&project("models/two_theodolite/model.ron"), &[]).expect("it is right");
    assert_invisible(Probe::from(&session).freeing(&["L1.b"]), &["R1.b", "L1.b"]);
    assert_invisible(&session, &[]);
    assert_identifiable(Probe::from(&session).freeing(&["L1.b"]).fixing(&["R1.b"]));
}

#[test]
fn exact_data_are_fitted_back_to_the_truth() {
    let mut recovered = Vec::new();
    for (name, session) in sessions().filter(|(_, session)| !session.program.scenarios.is_empty()) {
        eprintln!("{name}");
        assert_recovers(&session, 0..4);
        recovered.push(name);
    }
    eprintln!("recovered: {recovered:?}");
    assert!(recovered.len() >= 6, "{recovered:?}");
}

/// The rows of a problem in another order.
fn mixed(problem: &Problem) -> Vec<(usize, Table)> {
    let of = |block: &phical::problem::Block| {
        let (keys, rows) = (block.measurement.keys.len(), block.table.rows());
        let mut table = Table::new(keys, block.table.width());
        // a stride that shares no factor with the number of rows visits each once
        let stride = (rows / 2 + 1..).find(|stride| gcd(*stride, rows) == 1).expect("a prime");
        for at in (0..rows).map(|i| (i + 1) * stride % rows) {
            let names: Vec<&str> = (0..keys).map(|key| block.table.key(at, key)).collect();
            table.push(&names, &block.table.row(at), None).expect("a row of the table");
        }
        (block.index, table)
    };
    problem.blocks.iter().map(of).collect()
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn fit(problem: &Problem, search: Search) -> Fit {
    let fit = fit_by(problem, &Procedure { search, ..Procedure::default() })
        .unwrap_or_else(|found| panic!("{}", found.message));
    assert!(fit.status.converged(), "{}: {}", problem.program.name, fit.status);
    fit
}

#[test]
fn order_threads_and_solvers_leave_the_fit() {
    let threads =
        |number| Options { execution: Execution::new(InstructionSet::detect(), number), ..Options::default() };
    let mut fitted = 0;
    for (name, session) in sessions() {
        let Some(problem) = problem(name, &session, &threads(1)) else { continue };
        eprintln!("{name}");
        let one = fit(&problem, Search::Suited);
        let tables = || problem.blocks.iter().map(|block| (block.index, (*block.table).clone())).collect();
        let bound = |tables, options: &Options| Problem::bind(&session.program, tables, options).expect("it binds").0;
        // the same bits
        assert_same_fit(&one, &fit(&bound(tables(), &threads(3)), Search::Suited), 0.0);
        assert_same_fit(&one, &fit(&bound(mixed(&problem), &threads(2)), Search::Suited), 1e-5);
        assert_same_fit(&one, &fit(&problem, Search::Conic(Norm::LeastSquares)), 1e-5);
        fitted += 1;
    }
    assert!(fitted >= SHIPPED.len() - 1, "{fitted}");
}

/// Whatever is read and wherever the parameters are: a number, or a refusal, and never a panic or a silent NaN.
#[test]
fn readings_and_parameters_of_any_kind_are_evaluated_or_refused() {
    let (mut numbers, mut refused) = (0, 0);
    for (name, session) in sessions() {
        let mut runner = TestRunner::deterministic();
        let program = &session.program;
        for (index, measurement) in program.measurements.iter().enumerate().filter(|(_, m)| !m.residuals.is_empty()) {
            let rows = readings(program, index);
            for _ in 0..24 {
                let row = rows.new_tree(&mut runner).unwrap_or_else(|why| panic!("{name}: {why}")).current();
                let mut table = Table::new(measurement.keys.len(), measurement.inputs.len());
                table
                    .push(&row.keys.iter().map(String::as_str).collect::<Vec<_>>(), &row.readings, None)
                    .expect("a row of the table");
                let options = Options { unconstrained: true, ..Options::default() };
                let (problem, _) = Problem::bind(program, vec![(index, table)], &options).expect("it binds");
                let point =
                    parameters(&problem, Spread::Bounds(100.0)).new_tree(&mut runner).expect("a point").current();
                let mut found = Vec::new();
                let block = &problem.blocks[0];
                match block.values(Quantities::Residuals, &problem.layout, &point, |_, values| found = values.to_vec())
                {
                    Ok(()) => {
                        assert!(
                            found.len() == measurement.residuals.len() && found.iter().all(|value| value.is_finite())
                        );
                        numbers += 1;
                    }
                    Err(undefined) => {
                        assert!(undefined.0.message.contains(&measurement.name), "{undefined}");
                        refused += 1;
                    }
                }
            }
        }
    }
    eprintln!("{numbers} rows evaluated, {refused} refused");
    assert!(numbers > 10 * refused, "{numbers} {refused}");
}

/// Few rows of a scenario or many: the fit of exact data leaves nothing.
#[test]
fn exact_data_of_any_size_leave_nothing() {
    let session = Session::open(&project("models/two_theodolite/model.ron"), &[]).expect("it is right");
    let program = &session.program;
    let config = ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() };
    let made = data(program, &program.scenarios[0], 1..=40, true);
    let outcome = TestRunner::new(config).run(&made, |made| {
        let selection = phical::problem::Selection { free: vec!["L1.b".into()], ..Default::default() };
        let options = Options { selection, ..Options::default() };
        let (problem, _) = Problem::bind(program, made.simulated.tables, &options).expect("it binds");
        let fit = fit(&problem, Search::Suited);
        prop_assert!(fit.sum_of_squares < 1e-9 * fit.equations as f64, "{:e}", fit.sum_of_squares);
        prop_assert!(fit.rank <= 20);
        Ok(())
    });
    outcome.unwrap_or_else(|found| panic!("{found}"));
}
