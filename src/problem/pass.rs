//! One pass over the rows of a measurement: pieces of rows, blocks of each piece, one program for all.
//!
//! A piece is what one thread does at a time. Pieces are cut by the number of the row alone, and what they give is put together
//! in their order, so that the result does not depend on the number of threads.

use std::ops::Range;

use super::block::Block;
use super::layout::Layout;
use super::solving::Undefined;
use crate::data::{Buffer, Table};
use crate::eval::{self, Compiled, ROWS};

/// Rows of a piece.
pub(super) const PIECE: usize = 64 * ROWS;

/// A program at a point.
pub(super) struct Pass<'a> {
    block: &'a Block<'a>,
    compiled: &'a Compiled,
    /// of parameters that all rows share
    leaves: Vec<f64>,
    /// by combination: what its rows have of their own
    gathered: Vec<Vec<f64>>,
}

/// Rows that are in a block.
pub(super) struct Span<'a> {
    /// The number of the first row.
    pub(super) first: usize,
    /// How many rows there are, [`ROWS`] or less.
    pub(super) count: usize,
    /// The combination of each.
    pub(super) combination: &'a [u32],
    /// The readings of each, perhaps adjusted.
    pub(super) readings: &'a [f64],
}

impl<'a> Pass<'a> {
    pub(super) fn new(block: &'a Block<'a>, compiled: &'a Compiled, layout: &Layout, point: &[f64]) -> Self {
        let gathered = block.seen.gathered();
        let slots = &block.measurement.slots;
        let value = |groups: &[usize], s: usize, component: usize| point[layout.groups[groups[s]].first + component];
        let mut leaves = vec![0.0; block.measurement.leaves];
        if let Some(groups) = block.combinations.first() {
            for (s, slot) in slots.iter().enumerate() {
                for component in 0..layout.groups[groups[s]].shape.dimension() {
                    leaves[slot.first_leaf + component] = value(groups, s, component);
                }
            }
        }
        let own = |groups: &Vec<usize>| gathered.iter().map(|&(s, component)| value(groups, s, component)).collect();
        Pass { block, compiled, leaves, gathered: block.combinations.iter().map(own).collect() }
    }

    /// A block at this pass's point.
    pub(super) fn begin(&self) -> eval::Block {
        self.compiled.begin(&self.leaves)
    }

    /// The program.
    pub(super) fn compiled(&self) -> &'a Compiled {
        self.compiled
    }

    /// Runs the program on rows whose readings and combinations are given.
    pub(super) fn run(&self, combination: &[u32], readings: &[f64], into: &mut eval::Block) {
        self.fill(combination, readings, into);
        self.compiled.run(into);
    }

    /// Gives a block the readings of rows, and the numbers of the members that they name; where they do not fill it, it is
    /// filled up with the last row.
    pub(super) fn fill(&self, combination: &[u32], readings: &[f64], into: &mut eval::Block) {
        let width = self.block.measurement.inputs.len();
        let count = combination.len();
        let gathered = self.gathered.first().map_or(0, Vec::len);
        for input in 0..self.compiled.inputs().min(width + gathered) {
            let numbers = into.input(input);
            if input < width {
                for (number, row) in numbers.iter_mut().zip(readings.chunks_exact(width)) {
                    *number = row[input];
                }
            } else {
                for (number, &combination) in numbers.iter_mut().zip(combination) {
                    *number = self.gathered[combination as usize][input - width];
                }
            }
            let last = numbers[count - 1];
            numbers[count..].fill(last);
        }
    }

    /// Runs the program on all rows of a piece and visits each block.
    pub(super) fn piece(
        &self,
        rows: Range<usize>,
        mut visit: impl FnMut(&Span, &mut eval::Block) -> Result<(), Undefined>,
    ) -> Result<(), Undefined> {
        let mut into = self.begin();
        spans(self.block, rows, |span| {
            self.run(span.combination, span.readings, &mut into);
            visit(span, &mut into)
        })
    }
}

/// Reads the rows of a piece and visits them, [`ROWS`] at a time.
pub(super) fn spans(
    block: &Block,
    rows: Range<usize>,
    mut visit: impl FnMut(&Span) -> Result<(), Undefined>,
) -> Result<(), Undefined> {
    let width = block.table.width();
    let mut buffer = Buffer::default();
    let rows = block.table.read(rows, &mut buffer).map_err(|error| Undefined(Box::new(Table::unreadable(&error))))?;
    let mut combination = Vec::with_capacity(ROWS);
    for first in (0..rows.len()).step_by(ROWS) {
        let count = ROWS.min(rows.len() - first);
        combination.clear();
        combination.extend((first..first + count).map(|row| block.combination(rows.keys(row))));
        let readings = &rows.readings()[first * width..(first + count) * width];
        visit(&Span { first: rows.first() + first, count, combination: &combination, readings })?;
    }
    Ok(())
}

/// The pieces of so many rows.
pub(super) fn pieces(rows: usize) -> Vec<Range<usize>> {
    (0..rows).step_by(PIECE).map(|first| first..rows.min(first + PIECE)).collect()
}
