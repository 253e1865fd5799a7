//! The road from text to fit, stage by stage: `cargo bench`. Compare ratios within one run, not times between runs.

use divan::{Bencher, counter::ItemsCount};
use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::Source;
use phical::model::load;
use phical::problem::{Options, Problem};
use phical::simulate::simulate;
use phical::solve::{LeastSquares, Settings, minimise};

fn main() {
    divan::main();
}

const MODEL: &str = include_str!("../models/two_theodolite/model.ron");
const ROWS: [usize; 2] = [1_000, 100_000];

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
    let mut table = Table::new(0, 9);
    for row in 0..rows {
        table.push(&[], thousand.row(row % 1_000), None);
    }
    table
}

fn bound(program: &Program, rows: usize) -> Problem<'_> {
    Problem::bind(program, vec![(0, table(program, rows))], &Options::default()).expect("it binds").0
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

#[divan::bench(args = ROWS, sample_count = 5, sample_size = 1)]
fn jacobian(bencher: Bencher, rows: usize) {
    let program = program();
    let problem = bound(&program, rows);
    let places = problem.places();
    bencher.counter(ItemsCount::new(rows)).bench(|| {
        let mut sum = 0.0;
        let visited = problem.blocks[0].jacobians(&problem.layout, &problem.start, &places, None, |row| {
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
