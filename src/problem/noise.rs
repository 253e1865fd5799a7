//! The errors that the rows of a measurement carry, as far as the weights count them.

use std::collections::HashMap;

use super::Weights;
use crate::compile::{LossOf, Measurement, Robust, Sigma};
use crate::graph::Scalar;
use crate::linalg::{Matrix, cholesky};

/// A standard deviation in a row's program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spread {
    /// the same for all rows
    Constant(f64),
    /// a number that rows have of their own
    PerRow(usize),
}

/// A standard deviation that rows have of their own: a factor, and what the inputs as read give, where they decide it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Own {
    pub(super) factor: f64,
    pub(super) of: Option<Scalar>,
}

/// Errors of inputs, which are corrected, and of residuals, which remain.
#[derive(Clone, Debug, Default)]
pub(super) struct Noise {
    /// The inputs that are corrected, and their standard deviations.
    pub(super) inputs: Vec<(usize, Spread)>,
    /// The standard deviation of each residual, where it has one.
    pub(super) residuals: Vec<Option<Spread>>,
    /// C with C·Cᵀ the correlations of the inputs' errors, where there are any.
    pub(super) mixing: Option<Matrix>,
    /// The standard deviations that rows have of their own.
    pub(super) own: Vec<Own>,
}

/// Factors of the declared standard deviations by groups of errors (an input's `group`), as variance components change them.
pub type Factors = HashMap<String, f64>;

impl Noise {
    /// What the weights make of the declared errors; `None` where factors of the residuals, the same for all rows, say it
    /// all.
    pub(super) fn new(
        measurement: &Measurement,
        weights: Weights,
        robust: Option<Robust>,
        factors: &Factors,
    ) -> Option<Noise> {
        if weights == Weights::Unit {
            return None;
        }
        let mut noise = Noise::default();
        let per_input = robust.is_some_and(|robust| robust.of == LossOf::Input);
        let used = used_inputs(measurement);
        let mut measured = Vec::new();
        if weights == Weights::Propagated {
            let with = measurement.inputs.iter().enumerate().filter_map(|(i, input)| Some((i, input, input.sigma?)));
            for (at, (i, input, sigma)) in with.enumerate().filter(|(_, (i, ..))| used[*i]) {
                let factor = factors.get(&input.group).copied().unwrap_or(1.0);
                let sigma = match sigma {
                    // a loss of each input changes it by row
                    Sigma::Constant(sigma) if per_input => noise.own(Own { factor: factor * sigma, of: None }),
                    Sigma::Constant(sigma) => Spread::Constant(factor * sigma),
                    Sigma::PerRow(node) => noise.own(Own { factor, of: Some(node) }),
                };
                noise.inputs.push((i, sigma));
                measured.push(at);
            }
        }
        noise.residuals = measurement
            .residuals
            .iter()
            .map(|residual| {
                let factor = factors.get(&residual_group(&residual.name)).copied().unwrap_or(1.0);
                Some(match residual.sigma? {
                    Sigma::Constant(sigma) => Spread::Constant(factor * sigma),
                    Sigma::PerRow(node) => noise.own(Own { factor, of: Some(node) }),
                })
            })
            .collect();
        if let Some(all) = &measurement.correlations {
            let rows: Vec<Vec<f64>> = measured.iter().map(|&i| measured.iter().map(|&j| all[i][j]).collect()).collect();
            noise.mixing = cholesky(&Matrix::from_rows(rows.len(), &rows));
        }
        let fixed = noise.inputs.is_empty() && noise.own.is_empty();
        (!fixed).then_some(noise)
    }

    fn own(&mut self, own: Own) -> Spread {
        self.own.push(own);
        Spread::PerRow(self.own.len() - 1)
    }
}

/// The group of a residual's own errors: a vector's components are one.
pub fn residual_group(residual: &str) -> String {
    let whole = residual.rsplit_once('.').filter(|(_, last)| ["x", "y", "z"].contains(last));
    format!("residual {}", whole.map_or(residual, |(whole, _)| whole))
}

/// Which inputs any residual depends on.
pub(super) fn used_inputs(measurement: &Measurement) -> Vec<bool> {
    let mut used = vec![false; measurement.inputs.len()];
    for output in 0..measurement.tape.outputs() {
        for (used, depends) in used.iter_mut().zip(measurement.tape.dependencies(output).1) {
            *used |= depends;
        }
    }
    used
}
