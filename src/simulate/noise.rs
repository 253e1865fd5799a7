//! The errors of the readings of a row: normal, as large as declared, and correlated as declared.

#![allow(clippy::indexing_slicing, reason = "inputs are numbered by the measurement that the errors are of")]

use super::draw::Stream;
use crate::compile::{Measurement, Sigma};
use crate::linalg::{Matrix, cholesky};

/// What draws the errors of a measurement's inputs.
pub(super) struct Noise<'p> {
    measurement: &'p Measurement,
    /// mean and standard deviation of each input's errors
    of: &'p [(f64, Option<Sigma>)],
    streams: Vec<Stream>,
    /// the inputs whose errors are correlated, and C with C·Cᵀ their correlations
    mixing: Option<(Vec<usize>, Matrix)>,
}

impl<'p> Noise<'p> {
    pub(super) fn new(measurement: &'p Measurement, of: &'p [(f64, Option<Sigma>)], streams: Vec<Stream>) -> Noise<'p> {
        let mixing = measurement.correlations.as_ref().and_then(|rows| {
            let measured = measurement.inputs.iter().enumerate().filter(|(_, input)| input.sigma.is_some());
            Some((measured.map(|(i, _)| i).collect(), cholesky(&Matrix::from_rows(rows.len(), rows))?))
        });
        Noise { measurement, of, streams, mixing }
    }

    /// The errors of one row, whose true inputs are given; a sigma that depends on inputs is that of the true ones.
    pub(super) fn draw(&mut self, truth: &[f64], errors: &mut [f64]) {
        for (error, stream) in errors.iter_mut().zip(&mut self.streams) {
            *error = stream.normal();
        }
        if let Some((measured, c)) = &self.mixing {
            let independent: Vec<f64> = measured.iter().map(|&i| errors[i]).collect();
            for (&i, mixed) in measured.iter().zip(c.mul_vec(&independent)) {
                errors[i] = mixed;
            }
        }
        let tape = &self.measurement.sigma_tape;
        let varying = if tape.outputs() > 0 { tape.evaluate(&[], truth) } else { Vec::new() };
        let mut varying = varying.into_iter();
        let declared = self.measurement.inputs.iter().map(|input| match input.sigma {
            Some(Sigma::PerRow(_)) => varying.next(),
            _ => None,
        });
        for ((error, (mean, sigma)), own) in errors.iter_mut().zip(self.of).zip(declared) {
            let sigma = match sigma {
                Some(Sigma::Constant(sigma)) => *sigma,
                Some(Sigma::PerRow(_)) => own.unwrap_or(f64::NAN),
                None => 0.0,
            };
            *error = mean + sigma * *error;
        }
    }
}
