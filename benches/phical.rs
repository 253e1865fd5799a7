//! The road from text to fit, stage by stage: `cargo bench`. Compare ratios within one run, not times between runs.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::string_slice,
    clippy::unreachable,
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on ends"
)]

use divan::{Bencher, counter::ItemsCount};
use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::Source;
use phical::model::load;
use phical::problem::{Execution, Options, Problem, Weights, operations};
use phical::simd::InstructionSet;
use phical::simulate::simulate;
use phical::solve::{LeastSquares, Settings, minimise};

/// Weights of the paper, by which stages are timed.
fn unit() -> Options {
    Options { weights: Some(Weights::Unit), ..Options::default() }
}

fn main() {
    divan::main();
}

const MODEL: &str = include_str!("../models/two_theodolite/model.ron");
const ROWS: [usize; 3] = [1_000, 100_000, 1_000_000];

fn program() -> Program {
    let source = Source::new("model.ron", MODEL);
    let (model, _) = load(&source).expect("it reads");
    compile(&model, &source, &[]).expect("it compiles").0
}

/// Simulated lines; beyond a thousand they repeat.
fn table(program: &Program, rows: usize) -> Table {
    let options = phical::simulate::Options { rows: vec![(0, 1_000)], ..Default::default() };
    let simulated = simulate(program, &program.scenarios[0], &options).expect("it simulates");
    let thousand = &simulated.tables[0].1;
    let mut table = Table::new(0, thousand.row(0).len());
    for row in 0..rows {
        table.push(&[], &thousand.row(row % 1_000), None).expect("a row of the table");
    }
    table
}

fn bound(program: &Program, rows: usize) -> Problem<'_> {
    Problem::bind(program, vec![(0, table(program, rows))], &unit()).expect("it binds").0
}

#[divan::bench]
fn read_and_compile(bencher: Bencher) {
    bencher.bench(program);
}

#[divan::bench(args = ROWS, sample_count = 5, sample_size = 1)]
fn residual(bencher: Bencher, rows: usize) {
    let program = program();
    let problem = bound(&program, rows);
    bencher.counter(ItemsCount::new(rows)).bench(|| problem.cost(&problem.start));
}

/// Residual, Jacobian and triangular factor: what one iteration costs, but for a matrix of twenty columns.
#[divan::bench(args = ROWS, sample_count = 5, sample_size = 1)]
fn iteration(bencher: Bencher, rows: usize) {
    let program = program();
    let problem = bound(&program, rows);
    bencher.counter(ItemsCount::new(rows)).bench(|| problem.linearise(&problem.start));
}

#[divan::bench(args = [1, 2], sample_count = 10, sample_size = 1)]
fn iteration_by_threads(bencher: Bencher, threads: usize) {
    const ROWS: usize = 100_000;
    let program = program();
    let execution = Execution::new(InstructionSet::detect(), threads);
    let options = Options { execution, ..unit() };
    let problem = Problem::bind(&program, vec![(0, table(&program, ROWS))], &options).expect("it binds").0;
    bencher.counter(ItemsCount::new(ROWS)).bench(|| problem.linearise(&problem.start));
}

/// By dual numbers, one row at a time: what faster evaluation is measured against.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn jacobian_by_duals(bencher: Bencher) {
    let program = program();
    let problem = bound(&program, 1_000);
    let places = problem.places();
    bencher.counter(ItemsCount::new(1_000usize)).bench(|| {
        let mut sum = 0.0;
        let visited = problem.blocks[0].jacobians(&problem.layout, &problem.start, &places, |row| {
            sum += row.derivatives[0];
            Ok(())
        });
        (sum, visited.is_ok())
    });
}

#[divan::bench(args = ROWS, sample_count = 3, sample_size = 1)]
fn whole_fit(bencher: Bencher, rows: usize) {
    let program = program();
    let problem = bound(&program, rows);
    bencher
        .counter(ItemsCount::new(rows))
        .bench(|| minimise(&problem, problem.start.clone(), &Settings::default()).map(|solution| solution.cost).ok());
}

/// A chain of revolute joints, each with four free parameters, and where its end is.
fn chain(joints: usize) -> Program {
    let joint =
        |k: usize| format!("Revolute(name: \"J{k}\", a: Free(0.1), b: Free(0.2), alpha: Free(0.3), beta: Free(0.4))");
    let inputs: Vec<String> = (0..joints).map(|k| format!("\"q{k}\": (unit: \"rad\")")).collect();
    let text = format!(
        "(name: \"chain\", chains: {{ \"arm\": [{}] }}, measurements: {{ \"end\": (inputs: {{ {} }}, define: {{ \"end\": \"arm({})\" }}, residuals: {{ \"o\": \"end.o\", \"z\": \"end.z\" }}) }})",
        (0..joints).map(joint).collect::<Vec<_>>().join(", "),
        inputs.join(", "),
        (0..joints).map(|k| format!("q{k}")).collect::<Vec<_>>().join(", "),
    );
    let source = Source::new("chain.ron", text);
    let (model, _) = load(&source).expect("it reads");
    compile(&model, &source, &[]).expect("it compiles").0
}

/// Residual and Jacobian of longer and longer chains, counted in operations: as many in a second for all of them.
#[divan::bench(args = [2, 5, 10, 20, 40], sample_count = 10, sample_size = 1)]
fn operations_by_joints(bencher: Bencher, joints: usize) {
    const ROWS: usize = 2_048;
    let program = chain(joints);
    let mut table = Table::new(0, joints);
    for row in 0..ROWS {
        let readings: Vec<f64> = (0..joints).map(|k| ((row * 31 + k * 17) as f64).sin()).collect();
        table.push(&[], &readings, None).expect("a row of the table");
    }
    let execution = Execution::new(InstructionSet::detect(), 1);
    let options = Options { execution, ..unit() };
    let problem = Problem::bind(&program, vec![(0, table)], &options).expect("it binds").0;
    let counts = operations(&program, &program.measurements[0]);
    bencher.counter(ItemsCount::new(ROWS * counts.per_row)).bench(|| {
        let mut sum = 0.0;
        problem.derivatives(&problem.start, |_, found| sum += found[0]).map(|()| sum).ok()
    });
}
