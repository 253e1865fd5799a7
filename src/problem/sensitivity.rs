//! How derived quantities change with parameters and with readings, row by row.

use super::Problem;
use super::block::Block;
use super::pass::{Pass, pieces};
use super::solving::Undefined;
use crate::compile::Sigma;
use crate::diag::{Code, Diagnostic};
use crate::linalg::LinalgError;

/// The outputs of one row, differentiated; in internal units.
#[derive(Clone, Debug)]
pub struct Sensitivity<'a> {
    /// The row's number.
    pub row: usize,
    /// The coordinates that the row touches, by their place among those asked for.
    pub columns: &'a [usize],
    /// By output and then by column.
    pub by_coordinates: &'a [f64],
    /// By output and then by the inputs that have a sigma.
    pub by_inputs: &'a [f64],
    /// The standard deviation of each of these inputs.
    pub sigma: &'a [f64],
}

impl Block<'_> {
    /// The inputs that have a sigma, by their number.
    pub fn measured_inputs(&self) -> Vec<usize> {
        let inputs = self.measurement.inputs.iter().enumerate();
        inputs.filter(|(_, input)| input.sigma.is_some()).map(|(k, _)| k).collect()
    }
}

impl Problem<'_> {
    /// Visits every row of a block with the derivatives of its outputs by some coordinates (none of them twice; free or held is
    /// all the same) and by its measured inputs. A rotation's are by its right perturbation. Where an output has no derivative,
    /// the number is not finite.
    ///
    /// # Errors
    /// Where there is no such block or coordinate, the rows cannot be read, the sigma of a reading is not positive, or the point
    /// has not as many numbers as there are coordinates.
    pub fn sensitivities(
        &self,
        block: usize,
        point: &[f64],
        coordinates: &[usize],
        mut visit: impl FnMut(&Sensitivity),
    ) -> Result<(), Undefined> {
        let block = self.block(block)?;
        self.layout.fits(point)?;
        let (layout, set) = (&self.layout, self.execution.instructions());
        let mut place = vec![None; layout.coordinates.len()];
        for (at, &coordinate) in coordinates.iter().enumerate() {
            let known = place.len();
            let unknown = LinalgError::Shape { expected: known, found: coordinate };
            *place.get_mut(coordinate).ok_or(unknown)? = Some(at);
        }
        let at = |groups: &[usize], slot: usize, component: usize| place[layout.groups[groups[slot]].first + component];
        let wanted = |slot: usize, component: usize| {
            block.combinations.iter().any(|groups| at(groups, slot, component).is_some())
        };
        let order = |slot: usize, component: usize| {
            block.combinations.first().and_then(|groups| at(groups, slot, component)).unwrap_or(0)
        };
        let measured = block.measured_inputs();
        let columns = block.seen.columns(wanted, order);
        let (compiled, columns) = block.seen.sensitivities(columns, &measured, set);
        // the columns that each combination of members has, and their places
        let touched: Vec<(Vec<usize>, Vec<usize>)> = block
            .combinations
            .iter()
            .map(|groups| {
                let known = columns.iter().enumerate();
                known.filter_map(|(k, column)| Some((k, at(groups, column.slot, column.component)?))).unzip()
            })
            .collect();
        let sigmas: Vec<Sigma> = block.measurement.inputs.iter().filter_map(|input| input.sigma).collect();
        let own: Vec<_> = sigmas.iter().filter_map(|sigma| of_row(*sigma)).collect();
        let deviations = block.seen.sigmas(&own, set);
        let deviations = Pass::new(block, &deviations, layout, point);
        let mut state = deviations.begin();

        let (n, width) = (columns.len(), columns.len() + measured.len());
        let outputs = block.measurement.derived.len();
        let pass = Pass::new(block, &compiled, layout, point);
        let mut sigma = vec![0.0; measured.len()];
        let (mut by_coordinates, mut by_inputs) = (Vec::new(), Vec::new());
        for piece in pieces(block.table.rows()) {
            pass.piece(piece, |span, found| {
                if !own.is_empty() {
                    deviations.run(span.combination, span.readings, &mut state);
                }
                for i in 0..span.count {
                    let mut decided = 0;
                    for (k, (sigma, declared)) in sigma.iter_mut().zip(&sigmas).enumerate() {
                        *sigma = match *declared {
                            Sigma::Constant(sigma) => sigma,
                            Sigma::PerRow(_) => {
                                decided += 1;
                                state.output(decided - 1)[i]
                            }
                        };
                        if !(*sigma > 0.0 && sigma.is_finite()) {
                            return Err(bad_sigma(block, measured[k], span.first + i, *sigma));
                        }
                    }
                    let (known, places) = &touched[span.combination[i] as usize];
                    by_coordinates.clear();
                    by_inputs.clear();
                    for output in 0..outputs {
                        by_coordinates.extend(known.iter().map(|k| found.output(output * width + k)[i]));
                        by_inputs.extend((n..width).map(|k| found.output(output * width + k)[i]));
                    }
                    visit(&Sensitivity {
                        row: span.first + i,
                        columns: places,
                        by_coordinates: &by_coordinates,
                        by_inputs: &by_inputs,
                        sigma: &sigma,
                    });
                }
                Ok(())
            })?;
        }
        Ok(())
    }
}

fn of_row(sigma: Sigma) -> Option<crate::graph::Scalar> {
    match sigma {
        Sigma::Constant(_) => None,
        Sigma::PerRow(node) => Some(node),
    }
}

fn bad_sigma(block: &Block, input: usize, row: usize, sigma: f64) -> Undefined {
    let (measurement, name) = (&block.measurement.name, &block.measurement.inputs[input].name);
    let message = format!("measurement `{measurement}`, row {}: the sigma of `{name}` is {sigma}", row + 1);
    let found = Diagnostic::error(Code::BadSigma, message).at_data(block.table.place(row));
    Undefined(Box::new(found.hint("a standard deviation is positive: correct the row, or the expression")))
}
