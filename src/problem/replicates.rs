//! Rows that repeat a measurement: alike in all but what was read of the response.
//!
//! A response is an input that enters every residual linearly, whatever parameters and other inputs are, as y does in
//! y − f(x): repetitions of a row differ in nothing else, so that their scatter owes nothing to the model.

use std::collections::HashMap;

use super::Problem;
use super::block::Block;
use super::equations::Equations;
use super::noise::used_inputs;
use super::pass::{pieces, spans};
use super::solving::Undefined;
use crate::eval::ROWS;
use crate::graph::{Scalar, View, differentiate};

/// How much repeated rows scatter around the means of their groups.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PureError {
    /// Groups of two rows and more.
    pub groups: usize,
    /// Σ over groups of the squares of whitened residuals around their mean.
    pub squares: f64,
    /// Σ over groups of (rows − 1), times the equations of a row.
    pub dof: usize,
}

/// Rows alike.
#[derive(Clone, Debug, Default)]
struct Group {
    rows: usize,
    /// of each whitened residual
    sums: Vec<f64>,
    squares: f64,
}

impl Problem<'_> {
    /// The scatter of repeated rows at a point, without losses.
    ///
    /// # Errors
    /// Where the rows cannot be read, or a residual is undefined.
    pub fn pure_error(&self, point: &[f64]) -> Result<PureError, Undefined> {
        self.layout.fits(point)?;
        let plain = self.without_loss();
        let mut all = PureError::default();
        for block in &plain.blocks {
            let responses = responses(block);
            if !responses.contains(&true) {
                continue;
            }
            let m = block.measurement.residuals.len();
            let mut groups: HashMap<(u32, Vec<u64>), Group> = HashMap::new();
            let mut equations = Equations::residuals(&plain, block, point);
            for piece in pieces(block.table.rows()) {
                spans(block, piece, |span| {
                    let width = responses.len();
                    let found = equations.run(span)?;
                    for row in (0..span.count).filter(|&row| !block.excludes(span.first + row)) {
                        let readings = &span.readings[row * width..(row + 1) * width];
                        let fixed = readings.iter().zip(&responses).filter(|(_, response)| !**response);
                        let key = (span.combination[row], fixed.map(|(reading, _)| reading.to_bits()).collect());
                        let group = groups.entry(key).or_default();
                        group.rows += 1;
                        group.sums.resize(m, 0.0);
                        for (sum, column) in group.sums.iter_mut().zip(found.chunks_exact(ROWS)) {
                            *sum += column[row];
                            group.squares += column[row] * column[row];
                        }
                    }
                    Ok(())
                })?;
            }
            // in an order that does not depend on how the map was made
            let mut repeated: Vec<_> = groups.into_iter().filter(|(_, group)| group.rows > 1).collect();
            repeated.sort_by(|(one, _), (other, _)| one.cmp(other));
            for (_, group) in repeated {
                let mean: f64 = group.sums.iter().map(|sum| sum * sum).sum::<f64>() / group.rows as f64;
                all.groups += 1;
                all.squares += (group.squares - mean).max(0.0);
                all.dof += (group.rows - 1) * m;
            }
        }
        Ok(all)
    }
}

/// Which inputs are responses.
fn responses(block: &Block) -> Vec<bool> {
    let measurement = block.measurement;
    let used = used_inputs(measurement);
    let graph = &measurement.graph;
    let leaves: Vec<Option<Scalar>> =
        (0..used.len()).map(|k| used[k].then(|| graph.known_input(k as u32)).flatten()).collect();
    let all: Vec<Scalar> = leaves.iter().flatten().copied().collect();
    if all.is_empty() {
        return vec![false; used.len()];
    }
    let derived = differentiate(graph, &measurement.equations, &all, &View::default());
    let mut column = 0;
    leaves
        .iter()
        .map(|leaf| {
            if leaf.is_none() {
                return false;
            }
            let of = derived.derivatives.iter().skip(column).step_by(all.len());
            column += 1;
            let constants: Vec<Option<f64>> = of.map(|&d| derived.graph.value(d)).collect();
            constants.iter().all(Option::is_some) && constants.iter().flatten().any(|value| *value != 0.0)
        })
        .collect()
}
