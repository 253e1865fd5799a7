//! Instructions per line of the inner loops, counted by valgrind: the same number on a busy machine. `cargo bench --bench
//! instructions` fails where one is above its limit.
//!
//! The program counts itself: it runs again under callgrind with one pass over the lines and with three, and the difference
//! is two passes, whatever starting took.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark prints what it measured")]
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::string_slice,
    clippy::unreachable,
    clippy::unwrap_used,
    reason = "a benchmark that cannot go on ends"
)]

use std::hint::black_box;
use std::process::{Command, ExitCode};

use phical::compile::compile;
use phical::data::Table;
use phical::diag::Source;
use phical::model::load;
use phical::problem::{Execution, Options, Problem, Weights};
use phical::simd::InstructionSet;
use phical::solve::LeastSquares;

const MODEL: &str = include_str!("../models/two_theodolite/model.ron");
const LINES: usize = 4_096;
const VARIABLE: &str = "PHICAL_COUNTED";

/// What is counted, and how many instructions a line may take on AVX2, which is what valgrind has: a tenth above what it took when
/// this was written.
const COUNTED: [(&str, f64); 3] = [("r", RESIDUAL), ("r + J", JACOBIAN), ("r + J, QR([J r])", FACTOR)];
const RESIDUAL: f64 = 580.0;
const JACOBIAN: f64 = 1_670.0;
const FACTOR: f64 = 3_490.0;

/// Passes over lines whose readings do not matter: no step depends on them.
fn work(what: &str, passes: usize) {
    let source = Source::new("model.ron", MODEL);
    let (model, _) = load(&source).expect("it reads");
    let program = compile(&model, &source, &[]).expect("it compiles").0;
    // nine readings, and tilts of zero
    let width = program.measurements[0].inputs.len();
    let mut table = Table::new(0, width);
    for line in 0..LINES {
        let reading = |k: usize| if k < 9 { 0.5 + 0.3 * ((line * 9 + k) as f64).sin() } else { 0.0 };
        table.push(&[], &(0..width).map(reading).collect::<Vec<f64>>(), None).expect("a row of the table");
    }
    let execution = Execution::new(InstructionSet::detect(), 1);
    let options = Options { weights: Some(Weights::Unit), execution, ..Options::default() };
    let problem = Problem::bind(&program, vec![(0, table)], &options).expect("it binds").0;
    let q = &problem.start;
    for _ in 0..passes {
        match what {
            "r" => _ = black_box(problem.cost(black_box(q)).ok()),
            "r + J" => _ = black_box(problem.derivatives(black_box(q), |_, found| _ = black_box(found)).ok()),
            _ => _ = black_box(problem.linearise(black_box(q)).ok()),
        }
    }
}

/// Instructions of a run of this program under callgrind.
fn instructions(what: &str, passes: usize) -> Result<f64, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(own)
        .env(VARIABLE, format!("{passes} {what}"))
        .env("PHICAL_INSTRUCTIONS", "avx2")
        .output()
        .map_err(|error| format!("valgrind cannot be run: {error}"))?;
    let said = String::from_utf8_lossy(&run.stderr);
    let collected = said.lines().find_map(|line| line.split("Collected :").nth(1)).map(str::trim);
    collected.and_then(|count| count.parse().ok()).ok_or_else(|| format!("valgrind says nothing of use: {said}"))
}

fn main() -> ExitCode {
    if let Ok(wanted) = std::env::var(VARIABLE)
        && let Some((passes, what)) = wanted.split_once(' ')
    {
        work(what, passes.parse().unwrap_or(0));
        return ExitCode::SUCCESS;
    }
    println!("| counted | instructions per line | limit |\n|---|---|---|");
    let mut above = false;
    for (what, limit) in COUNTED {
        match instructions(what, 1).and_then(|one| Ok((one, instructions(what, 3)?))) {
            Ok((one, three)) => {
                let per_line = (three - one) / 2.0 / LINES as f64;
                above |= per_line > limit;
                println!("| {what} | {per_line:.0} | {limit:.0} |");
            }
            Err(message) => {
                eprintln!("{message}");
                return ExitCode::FAILURE;
            }
        }
    }
    if above {
        eprintln!("more instructions than the limit: find out why, or raise it knowingly");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
