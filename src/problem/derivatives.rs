//! Derivatives of residuals as the engine finds them, neither weighted nor scaled, and where the numbers of a row are on its tape.

use super::Problem;
use super::block::Block;
use super::layout::Layout;
use super::pass::{Pass, pieces, spans};
use super::solving::Undefined;

/// A row's residuals, differentiated by the compiled program that fits run on; in internal units. What is undefined is not finite.
#[derive(Clone, Debug)]
pub struct EngineRow<'a> {
    /// The row's number.
    pub row: usize,
    /// The free coordinate (its number among all) of each column.
    pub columns: &'a [usize],
    /// By residual and then by column. A coordinate may have several columns, which add.
    pub by_coordinates: &'a [f64],
    /// By residual and then by input.
    pub by_inputs: &'a [f64],
}

impl Block<'_> {
    /// The first coordinate of the parameter, or of the member, that a row has in each slot of its measurement.
    pub(crate) fn touched_by(&self, layout: &Layout, row: usize) -> Vec<usize> {
        self.combinations[self.combination_of(row)].iter().map(|&group| layout.groups[group].first).collect()
    }

    /// The numbers of a row's leaves at a point; perturbations of rotations are zero.
    ///
    /// # Errors
    /// Where there is no such row, or the point has not as many numbers as there are coordinates.
    pub fn leaves_of(&self, layout: &Layout, point: &[f64], row: usize) -> Result<Vec<f64>, Undefined> {
        layout.fits(point)?;
        self.has_row(row)?;
        Ok(self.leaves(self.combination_of(row), layout, point))
    }
}

impl Problem<'_> {
    /// Visits every row of a block with the derivatives by the free coordinates and by the inputs, as fits and the propagation of
    /// errors have them.
    ///
    /// # Errors
    /// Where there is no such block, the rows cannot be read, or the point has not as many numbers as there are coordinates.
    pub fn engine_rows(&self, block: usize, point: &[f64], mut visit: impl FnMut(&EngineRow)) -> Result<(), Undefined> {
        let block = self.block(block)?;
        self.layout.fits(point)?;
        let (layout, place, set) = (&self.layout, self.places(), self.execution.instructions());
        let (programs, weights) = (&block.programs, &block.weights);
        let jacobian = block.seen.free(programs, &block.combinations, layout, &place, weights, set);
        let by_parameters = Pass::new(block, &jacobian.compiled, layout, point);
        let by_readings = Pass::new(block, block.seen.by_inputs(programs, weights, set), layout, point);
        let (mut parameters, mut readings) = (by_parameters.begin(), by_readings.begin());
        let (m, width) = (weights.len(), block.measurement.inputs.len());
        let (mut known, mut columns) = (Vec::new(), Vec::new());
        let (mut by_coordinates, mut by_inputs) = (Vec::new(), Vec::new());
        for piece in pieces(block.table.rows()) {
            spans(block, piece, |span| {
                by_parameters.run(span.combination, span.readings, &mut parameters);
                by_readings.run(span.combination, span.readings, &mut readings);
                for row in 0..span.count {
                    let members = &block.combinations[span.combination[row] as usize];
                    known.clear();
                    columns.clear();
                    for (k, column) in jacobian.columns.iter().enumerate() {
                        let coordinate = layout.groups[members[column.slot]].first + column.component;
                        if place[coordinate].is_some() {
                            known.push(k);
                            columns.push(coordinate);
                        }
                    }
                    by_coordinates.clear();
                    by_inputs.clear();
                    for (i, weight) in weights.iter().enumerate() {
                        by_coordinates.extend(known.iter().map(|k| parameters.output(k * m + i)[row] / weight));
                        let input = |k: usize| readings.output(m + i * width + k)[row] / weight;
                        by_inputs.extend((0..width).map(input));
                    }
                    visit(&EngineRow {
                        row: span.first + row,
                        columns: &columns,
                        by_coordinates: &by_coordinates,
                        by_inputs: &by_inputs,
                    });
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}
