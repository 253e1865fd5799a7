//! What large residuals of a measurement's rows count.

use crate::compile::{LossOf, Measurement, Robust};
use crate::statistics::{Kernel, Loss};

/// The least weight of a corrected input: a gross error among many equations needs no less, and a row whose errors are all
/// loosened still has a covariance.
const LEAST: f64 = 1e-8;

/// A loss with its scale, as a function of squares of whitened numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RowLoss {
    loss: Loss,
    of: LossOf,
    scale: f64,
    estimated: bool,
}

impl RowLoss {
    /// A row's length is that of as many numbers as it has residuals, so the tuning constant is that of the same efficiency in
    /// so many dimensions.
    pub(super) fn new(robust: &Robust, measurement: &Measurement, propagated: bool, scale: f64) -> RowLoss {
        // only propagated weights correct inputs
        let of = if propagated { robust.of } else { LossOf::Row };
        let loss = match of {
            LossOf::Row => robust.loss.for_dimension(measurement.residuals.len().max(1)).unwrap_or(robust.loss),
            LossOf::Input => robust.loss,
        };
        RowLoss { loss, of, scale, estimated: robust.estimated }
    }

    pub(super) fn of_inputs(&self) -> bool {
        self.of == LossOf::Input
    }

    /// ρ of a square, in units of the square.
    pub(super) fn rho(&self, square: f64) -> f64 {
        let unit = self.scale * self.scale;
        unit * self.loss.rho(square / unit)
    }

    /// dρ/d(square).
    pub(super) fn weight(&self, square: f64) -> f64 {
        self.loss.weight(square / (self.scale * self.scale))
    }

    /// h = w + 2 s w'/m of a row of m equations, with w' by differences: how fast its pull grows.
    pub(super) fn bend(&self, square: f64, m: usize) -> f64 {
        const STEP: f64 = 1e-5;
        let slope = (self.weight(square * (1.0 + STEP)) - self.weight(square * (1.0 - STEP))) / (2.0 * STEP);
        self.weight(square) + 2.0 * slope / m.max(1) as f64
    }

    /// The same with another scale.
    pub(super) fn with_scale(self, scale: f64) -> RowLoss {
        RowLoss { scale, ..self }
    }

    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    pub(super) fn scale_is_estimated(&self) -> bool {
        self.estimated
    }

    /// `tukey 7.55 of rows`
    pub(super) fn name(&self) -> String {
        let of = if self.of_inputs() { "inputs" } else { "rows" };
        let scale = if self.estimated { format!(", scale {:.4}", self.scale) } else { String::new() };
        format!("{} {:.4} of {of}{scale}", self.loss.kernel().name(), self.loss.tuning())
    }

    pub(super) fn loss(&self) -> Loss {
        self.loss
    }

    /// The same scale, and a loss that never gives up a row, to come near.
    pub(super) fn convex(self, m: usize) -> RowLoss {
        let huber = Loss::new(Kernel::Huber, None).unwrap_or(self.loss);
        let loss = if self.of_inputs() { huber } else { huber.for_dimension(m.max(1)).unwrap_or(huber) };
        RowLoss { loss, ..self }
    }

    /// The weight of a corrected input, which is never zero.
    pub(super) fn weight_of_input(&self, square: f64) -> f64 {
        self.weight(square).max(LEAST)
    }
}
