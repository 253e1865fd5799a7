//! The compiled engine against dual numbers, on every shipped model, and what it promises: the same bits for any number of
//! threads, memory that does not grow, operations that are counted.

use std::process::Command;

use phical::data::Table;
use phical::linalg::{Matrix, SquareRootInformation};
use phical::problem::{Execution, Options, Problem, Rows, Selection, Weights};
use phical::session::{Choice, Session};
use phical::simd::InstructionSet;
use phical::simulate::simulate;
use phical::solve::LeastSquares;

use crate::close::{close, relative_error};
use crate::flagship::{Flagship, compiled, flagship};
use crate::shared::project;

/// RᵀR, Jᵀr and rᵀr, each entry by the length of its columns.
pub fn normal(information: &SquareRootInformation) -> Vec<f64> {
    let gram = information.r().transpose().mul(information.r());
    let lengths: Vec<f64> = (0..gram.rows()).map(|j| gram[(j, j)].sqrt().max(f64::MIN_POSITIVE)).collect();
    let residual = (2.0 * information.cost()).sqrt().max(f64::MIN_POSITIVE);
    let mut all: Vec<f64> = Vec::new();
    for j in 0..gram.rows() {
        all.extend((0..gram.rows()).map(|i| gram[(i, j)] / lengths[i] / lengths[j]));
        all.push(information.gradient()[j] / lengths[j] / residual);
    }
    all.push(residual);
    all
}

/// The same by dual numbers, row by row.
fn by_duals(problem: &Problem, point: &[f64]) -> SquareRootInformation {
    let n = problem.free.len();
    let mut information = SquareRootInformation::new(n);
    for block in &problem.blocks {
        let visited = block.jacobians(&problem.layout, point, &problem.places(), |row| {
            let width = row.columns.len();
            let mut rows = Matrix::zeros(row.residuals.len(), n + 1);
            for (i, &residual) in row.residuals.iter().enumerate() {
                for (k, &column) in row.columns.iter().enumerate() {
                    rows[(i, column)] += row.derivatives[i * width + k];
                }
                rows[(i, n)] = residual;
            }
            information.absorb(&mut rows).expect("finite");
            Ok(())
        });
        visited.expect("defined");
    }
    information
}

/// A point beside the start, so that nothing is zero by chance.
fn beside(problem: &Problem) -> Vec<f64> {
    let step = |k: usize| 0.01 * problem.scale()[k] * (1.0 + (k as f64 * 1.3).sin());
    problem.retract(&problem.start, &(0..problem.free.len()).map(step).collect::<Vec<_>>())
}

pub fn models() -> Vec<&'static str> {
    vec![
        "two_theodolite",
        "ur5_pendant",
        "positioner_camera",
        "panda_sockets",
        "shared_errors",
        "published/york_line",
        "published/levelling_net",
        "published/trilateration",
        "published/new_point_by_angles",
        "published/point_in_space",
        "nist/Misra1a",
        "nist/Gauss3",
        "nist/Roszman1",
        "nist/Kirby2",
        "nist/Lanczos1",
        "nist/Nelson",
    ]
}

#[test]
fn every_shipped_model_is_the_same_by_dual_numbers() {
    let mut compared = 0;
    for name in models() {
        let session = Session::open(&project(&format!("models/{name}/model.ron")), &[]).expect("it compiles");
        for set in InstructionSet::available() {
            // what readings carry into residuals has tests of its own
            let (weights, execution) = (Some(Weights::Unit), Execution::new(set, 1));
            let options = Options { weights, execution, ..Options::default() };
            let Ok(bound) = session.bind(&Choice::default(), &options) else {
                eprintln!("SKIPPED: the data of {name} are not present");
                break;
            };
            let problem = &bound.problem;
            let point = beside(problem);
            let found = problem.linearised(&point).expect("defined").information;
            let what = format!("{name}, {}", set.name());
            close(&normal(&found), &normal(&by_duals(problem, &point)), 1e-11, &what);
            let cost = 2.0 * found.cost();
            close(&[problem.sums(&point).expect("defined").squares], &[cost], 1e-12, &what);
            compared += 1;
        }
    }
    assert!(compared > 0);
}

/// Simulated lines, again and again.
fn lines(flagship: &Flagship, rows: usize) -> Table {
    let options = phical::simulate::Options { rows: vec![(0, 500)], ..Default::default() };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let mut table = Table::new(0, flagship.width());
    (0..rows).for_each(|row| table.push(&[], &simulated.tables[0].1.row(row % 500), None).expect("a row of the table"));
    table
}

fn bind<'p>(flagship: &'p Flagship, table: Table, threads: usize, free: &[&str]) -> Problem<'p> {
    let selection = Selection { free: free.iter().map(|name| (*name).into()).collect(), ..Selection::default() };
    let execution = Execution::new(InstructionSet::detect(), threads);
    let options = Options { selection, execution, ..Options::default() };
    Problem::bind(&flagship.0, vec![(0, table)], &options).expect("it binds").0
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let flagship = flagship();
    let table = lines(&flagship, 10_001);
    let problems: Vec<Problem> = [1, 2, 3, 0].map(|threads| bind(&flagship, table.clone(), threads, &["L1.b"])).into();
    let point = beside(&problems[0]);
    let all = |problem: &Problem| {
        let observed = problem.linearised(&point).expect("defined").information;
        let consistent = problem.at_consistent_inputs(&point, Rows::All).expect("defined");
        (observed, consistent, problem.sums(&point).expect("defined").squares)
    };
    let one = all(&problems[0]);
    for problem in &problems[1..] {
        assert!(all(problem) == one, "other bits");
    }
}

#[test]
fn rows_that_do_not_fit_in_memory_count_as_others_do() {
    // 120,000 rows of eleven readings are more than a table keeps
    let flagship = flagship();
    let few = bind(&flagship, lines(&flagship, 500), 1, &[]);
    let many = bind(&flagship, lines(&flagship, 120_000), 0, &[]);
    let point = beside(&few);
    let [one, all] = [&few, &many].map(|problem| problem.linearised(&point).expect("defined").information);
    let mut expected = normal(&one);
    if let Some(residual) = expected.last_mut() {
        *residual *= 240f64.sqrt();
    }
    close(&normal(&all), &expected, 1e-11, "240 times the same lines");
    assert_eq!(all.rows(), 240 * one.rows());
}

#[test]
fn a_sample_does_not_hide_what_all_rows_see_or_do_not_see() {
    let flagship = flagship();
    // the invisible direction of the flagship, in many rows
    for (free, rank) in [(&["L1.b"][..], 20), (&[][..], 20)] {
        let problem = bind(&flagship, lines(&flagship, 6_000), 0, free);
        let observed = problem.linearise(&problem.start).expect("defined");
        let seen = problem.visible(&problem.start, true, &observed).expect("defined");
        assert_eq!(seen.rank, rank, "{free:?}");
        assert_eq!(seen.basis.len(), problem.free.len() - rank);
    }
    // a member that one row names, far from any sample
    let text = r#"(name: "m", parameters: { "h": Scalar(value: Free("0 m"), family: true) },
        measurements: { "l": (keys: ["k"], inputs: { "y": (unit: "m") }, residuals: { "r": "y - h[k]" }) })"#;
    let program = compiled(text);
    let mut table = Table::new(1, 1);
    for row in 0..9_000 {
        table.push(&[if row == 4_321 { "rare" } else { "usual" }], &[1.0], None).expect("a row of the table");
    }
    let (problem, _) = Problem::bind(&program, vec![(0, table)], &Options::default()).expect("it binds");
    let observed = problem.linearise(&problem.start).expect("defined");
    assert_eq!(problem.visible(&problem.start, true, &observed).expect("defined").rank, 2);
}

#[test]
fn the_flagship_takes_at_most_1300_operations_a_line() {
    let checked = |path: &std::path::Path| -> serde_json::Value {
        let arguments = ["check", path.to_str().expect("a path"), "--format", "json"];
        let output = Command::new(env!("CARGO_BIN_EXE_phical")).args(arguments).output().expect("it runs");
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let path = project("models/two_theodolite/model.ron");
    let counts = &checked(&path)["operations"];
    assert!(counts["per_row"].as_u64().expect("a number") <= 1_300, "{counts}");
    assert!(counts["per_iteration"].as_u64().expect("a number") < 200, "{counts}");
    // the paper's 21 parameters
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(&path).expect("readable").replace("b: Held(0)", "b: Free(0)");
    let released = folder.path().join("model.ron");
    std::fs::write(&released, text).expect("written");
    let released = &checked(&released)["operations"];
    assert!(released["per_row"].as_u64().expect("a number") <= 1_300, "{released}");
    assert!(released["per_row"].as_u64() > counts["per_row"].as_u64());
}

#[test]
fn the_comparison_notices_one_wrong_entry() {
    let flagship = flagship();
    let problem = bind(&flagship, lines(&flagship, 100), 1, &[]);
    let right = normal(&by_duals(&problem, &beside(&problem)));
    for at in (0..right.len()).step_by(17) {
        let mut wrong = right.clone();
        wrong[at] += 1e-9 * right.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        assert!(relative_error(&wrong, &right) > 1e-11);
    }
}
