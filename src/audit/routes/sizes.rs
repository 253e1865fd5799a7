//! By how much to move something for a difference, and what that may do to a residual.

use crate::problem::Problem;
use crate::unit::Dimension;

/// What is large and what is small.
pub(super) struct Sizes {
    /// The largest length among the parameters.
    length: f64,
}

impl Sizes {
    pub(super) fn of(problem: &Problem, point: &[f64]) -> Sizes {
        let coordinates = problem.layout.coordinates.iter().zip(point);
        let lengths = coordinates.filter(|(known, _)| known.dimension == Dimension::LENGTH);
        Sizes { length: lengths.fold(0.0, |most, (_, value)| most.max(value.abs())) }
    }

    /// Of a parameter or an input, with its tolerance where it has one.
    pub(super) fn number(&self, dimension: Dimension, value: f64, tolerance: Option<f64>) -> f64 {
        let size = match dimension {
            Dimension::ANGLE => 1.0,
            Dimension::LENGTH => self.length.max(value.abs()).max(tolerance.unwrap_or(0.0)),
            _ => value.abs().max(tolerance.unwrap_or(0.0)),
        };
        if size > 0.0 { size } else { 1.0 }
    }

    /// Of a residual.
    pub(super) fn residual(&self, dimension: Dimension, value: f64) -> f64 {
        let natural = if dimension == Dimension::LENGTH { self.length } else { 1.0 };
        natural.max(value.abs())
    }
}
