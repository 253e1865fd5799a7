//! Inputs that are consistent with the parameters: the observed ones, moved as little as possible to where the residuals
//! vanish. What a model cannot see is exact there, and only there.

use super::Problem;
use super::block::Block;
use crate::linalg::{Matrix, dot, svd};
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

/// The shortest v with f + B v = 0, v = −Bᵀ (B Bᵀ)⁻¹ f by Cholesky; where the rows of B depend on each other, the shortest that
/// leaves as little as possible, by singular values.
fn correction(f: &[f64], derivatives: &[f64], weights: &[f64], scale: &[f64]) -> Option<Vec<f64>> {
    let (m, used) = (f.len(), scale.len());
    let mut b = vec![0.0; m * used];
    for i in 0..m {
        for j in 0..used {
            b[i * used + j] = derivatives[i * used + j] * weights[i] * scale[j];
        }
    }
    let weighted: Vec<f64> = f.iter().zip(weights).map(|(f, w)| f * w).collect();
    let Some(multipliers) = by_cholesky(&b, used, &weighted) else { return by_singular_values(&b, used, &weighted) };
    let mut step = vec![0.0; used];
    for (row, multiplier) in b.chunks(used.max(1)).zip(multipliers) {
        for (step, b) in step.iter_mut().zip(row) {
            *step -= multiplier * b;
        }
    }
    Some(step)
}

/// (B Bᵀ)⁻¹ f; none where a pivot is so small that the rows of B are as good as dependent.
fn by_cholesky(b: &[f64], used: usize, f: &[f64]) -> Option<Vec<f64>> {
    const DEPENDENT: f64 = 1e-8;
    let m = f.len();
    if used < m {
        return None;
    }
    let row = |i: usize| &b[i * used..(i + 1) * used];
    let mut l = vec![0.0; m * m];
    let mut x = f.to_vec();
    for i in 0..m {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| l[i * m + k] * l[j * m + k]).sum();
            let product = dot(row(i), row(j));
            let rest = product - known;
            if i > j {
                l[i * m + j] = rest / l[j * m + j];
            } else if rest > DEPENDENT * product && rest.is_finite() {
                l[i * m + i] = rest.sqrt();
            } else {
                return None;
            }
        }
        let known: f64 = (0..i).map(|k| l[i * m + k] * x[k]).sum();
        x[i] = (x[i] - known) / l[i * m + i];
    }
    for i in (0..m).rev() {
        let known: f64 = (i + 1..m).map(|k| l[k * m + i] * x[k]).sum();
        x[i] = (x[i] - known) / l[i * m + i];
    }
    Some(x)
}

fn by_singular_values(b: &[f64], used: usize, weighted: &[f64]) -> Option<Vec<f64>> {
    let rows: Vec<&[f64]> = b.chunks(used.max(1)).collect();
    let (m, b) = (weighted.len(), Matrix::from_rows(used, &rows));
    let transposed = m < used;
    let found = svd(&if transposed { b.transpose() } else { b }).ok()?;
    let (left, right) = if transposed { (&found.v, &found.u) } else { (&found.u, &found.v) };
    let largest = *found.sigma.first()?;
    let mut step = vec![0.0; used];
    for (k, &sigma) in found.sigma.iter().enumerate() {
        if sigma <= 1e-10 * largest {
            continue;
        }
        let share: f64 = left.column(k).iter().zip(weighted).map(|(u, f)| u * f).sum();
        for (step, v) in step.iter_mut().zip(right.column(k)) {
            *step -= share / sigma * v;
        }
    }
    Some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_give_the_shortest_correction() {
        let b = [1.0, 2.0, 0.5, 0.0, 0.0, 1.0, -1.0, 3.0];
        let f = [0.3, -0.7];
        let cholesky = correction(&f, &b, &[1.0, 2.0], &[1.0, 0.5, 2.0, 1.0]).unwrap();
        let scaled: Vec<f64> = (0..8).map(|k| b[k] * [1.0, 2.0][k / 4] * [1.0, 0.5, 2.0, 1.0][k % 4]).collect();
        let singular = by_singular_values(&scaled, 4, &[0.3, -1.4]).unwrap();
        for (a, b) in cholesky.iter().zip(&singular) {
            assert!((a - b).abs() < 1e-14, "{cholesky:?} {singular:?}");
        }
        // it makes the equations vanish
        for (row, f) in scaled.chunks(4).zip([0.3, -1.4]) {
            assert!((dot(row, &cholesky) + f).abs() < 1e-14);
        }
    }

    #[test]
    fn dependent_rows_are_met_as_well_as_they_can_be() {
        let step = correction(&[1.0, 1.0], &[1.0, 1.0, 2.0, 2.0], &[1.0; 2], &[1.0; 2]).unwrap();
        // least squares of 1 + s and 1 + 2s: s = −3/5, shared evenly
        assert!(step.iter().all(|v| (v + 0.3).abs() < 1e-14), "{step:?}");
        let more = correction(&[1.0, 1.0], &[1.0, 2.0], &[1.0; 2], &[1.0]).unwrap();
        assert!((more[0] + 0.6).abs() < 1e-14, "{more:?}");
    }
}
