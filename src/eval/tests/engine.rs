//! What is under test, as a function.

use crate::eval::{Compiled, ROWS};
use crate::graph::{Graph, Scalar};
use crate::simd::InstructionSet;

/// A program and the rows it runs over.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) set: InstructionSet,
    pub(super) graph: &'a Graph,
    pub(super) outputs: &'a [Scalar],
    pub(super) parameters: &'a [f64],
    pub(super) rows: &'a [Vec<f64>],
}

/// Outputs, row by row.
pub(super) type Engine<'e> = &'e dyn Fn(Run<'_>) -> Vec<Vec<f64>>;

/// The engine itself. A last block that is not full is filled with rows from its beginning.
pub(super) fn compiled(run: Run<'_>) -> Vec<Vec<f64>> {
    let compiled = Compiled::new(run.graph, run.outputs, run.set);
    let mut block = compiled.begin(run.parameters);
    let mut found = Vec::new();
    for rows in run.rows.chunks(ROWS) {
        for input in 0..compiled.inputs() {
            for (number, row) in block.input(input).iter_mut().zip(rows.iter().cycle()) {
                *number = row[input];
            }
        }
        compiled.run(&mut block);
        found.extend((0..rows.len()).map(|row| (0..compiled.outputs()).map(|i| block.output(i)[row]).collect()));
    }
    found
}
