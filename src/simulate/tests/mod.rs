//! Scenarios run: the flagship against its paper, families, streams, and what cannot be solved.

mod flagship;
mod small;

use super::*;
use crate::compile::{Program, compile};
use crate::data::Table;
use crate::diag::Source;
use crate::model::load;

pub(super) fn program(text: &str) -> Program {
    let source = Source::new("m.ron", text);
    let (model, _) = load(&source).unwrap_or_else(|found| panic!("{}", crate::diag::text(&found, false)));
    let compiled = compile(&model, &source, &[]);
    compiled.unwrap_or_else(|found| panic!("{}", crate::diag::text(&found, false))).0
}

pub(super) fn made(program: &Program, options: &Options) -> Simulated {
    let made = simulate(program, &program.scenarios[0], options);
    made.unwrap_or_else(|found| panic!("{}", crate::diag::text(&[*found], false)))
}

/// Mean and standard deviation.
pub(super) fn moments(all: &[f64]) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    (mean, (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
}

pub(super) fn same(one: &Table, other: &Table, rows: usize) -> bool {
    (0..rows).all(|row| one.row(row).iter().zip(other.row(row).iter()).all(|(a, b)| a.to_bits() == b.to_bits()))
}
