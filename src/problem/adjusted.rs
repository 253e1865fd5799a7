//! Inputs that are consistent with the parameters: the observed ones, moved as little as possible to where the residuals
//! vanish. What a model cannot see is exact there, and only there.

use super::Problem;
use super::block::Block;
use crate::linalg::{Matrix, svd};
use crate::unit::{Base, Dimension};

/// Corrections are solved for again until the residuals are this small a share of what they were.
const CONSISTENT: f64 = 1e-13;
const ITERATIONS: usize = 12;

impl Problem<'_> {
    /// For each block, the inputs of its rows moved to where the residuals vanish at `point`.
    pub fn consistent_inputs(&self, point: &[f64]) -> Vec<Vec<f64>> {
        self.blocks.iter().map(|block| self.consistent_block(block, point)).collect()
    }

    fn consistent_block(&self, block: &Block, point: &[f64]) -> Vec<f64> {
        let measurement = block.measurement;
        let width = measurement.inputs.len();
        let mut all: Vec<f64> = (0..block.table.rows()).flat_map(|row| block.table.row(row).iter().copied()).collect();
        let (m, used) = (measurement.tape.outputs(), measurement.tape.inputs());
        // Measured inputs are moved by their sigmas; where none is measured, all by what is small for their kind.
        let any_sigma = measurement.inputs.iter().any(|input| input.sigma.is_some());
        let small = |dimension: Dimension| {
            if dimension == Dimension::of(Base::Angle) { 5e-5 } else { 0.1 }
        };
        let scale: Vec<f64> = measurement.inputs[..used]
            .iter()
            .map(|input| if any_sigma { input.sigma.unwrap_or(0.0) } else { small(input.unit.dimension) })
            .collect();
        let (mut f, mut derivatives) = (vec![0.0; m], vec![0.0; m * used]);
        block.input_jacobians(&self.layout, point, |row, evaluate| {
            let inputs = &mut all[row * width..(row + 1) * width];
            let observed = inputs.to_vec();
            let (mut first, mut least) = (None, f64::INFINITY);
            let mut best = observed.clone();
            for _ in 0..ITERATIONS {
                evaluate(inputs, &mut f, &mut derivatives);
                let size = f.iter().zip(&block.weights).map(|(f, w)| (f * w).powi(2)).sum::<f64>().sqrt();
                if !size.is_finite() {
                    break;
                }
                let first = *first.get_or_insert(size);
                if size < least {
                    least = size;
                    best.copy_from_slice(inputs);
                } else {
                    break;
                }
                if size <= CONSISTENT * first || size == 0.0 {
                    break;
                }
                let Some(step) = correction(&f, &derivatives, &block.weights, &scale) else { break };
                for ((input, step), scale) in inputs.iter_mut().zip(step).zip(&scale) {
                    *input += step * scale;
                }
            }
            inputs.copy_from_slice(&best);
        });
        all
    }
}

/// The shortest v with f + B·S·v as small as possible: v = −(B S)⁺ f, by the singular values of B S.
fn correction(f: &[f64], derivatives: &[f64], weights: &[f64], scale: &[f64]) -> Option<Vec<f64>> {
    let (m, used) = (f.len(), scale.len());
    let mut b = Matrix::zeros(m, used);
    for i in 0..m {
        for j in 0..used {
            b[(i, j)] = derivatives[i * used + j] * weights[i] * scale[j];
        }
    }
    let transposed = m < used;
    let found = svd(&if transposed { b.transpose() } else { b }).ok()?;
    let (left, right) = if transposed { (&found.v, &found.u) } else { (&found.u, &found.v) };
    let largest = *found.sigma.first()?;
    let weighted: Vec<f64> = f.iter().zip(weights).map(|(f, w)| f * w).collect();
    let mut step = vec![0.0; used];
    for (k, &sigma) in found.sigma.iter().enumerate() {
        if sigma <= 1e-10 * largest {
            continue;
        }
        let share: f64 = left.column(k).iter().zip(&weighted).map(|(u, f)| u * f).sum();
        for (step, v) in step.iter_mut().zip(right.column(k)) {
            *step -= share / sigma * v;
        }
    }
    Some(step)
}
