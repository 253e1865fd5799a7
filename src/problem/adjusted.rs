//! Inputs that are consistent with the parameters: the observed ones, moved as little as possible to where the residuals
//! vanish. What a model cannot see is exact there, and only there.

use super::Problem;
use super::block::Block;
use super::pass::Pass;
use crate::compile::Sigma;
use crate::eval;
use crate::linalg::{Matrix, dot, svd};
use crate::unit::{Base, Dimension};

/// Corrections are solved for again until the residuals are this small a share of what they were.
const CONSISTENT: f64 = 1e-13;
const ITERATIONS: usize = 12;
/// Residuals that are this small a share of what they were have vanished.
const MET: f64 = 1e-6;
/// What is left of residuals that have vanished, as a share of their terms.
const VANISHED: f64 = 1e-11;

/// Moves the inputs of rows to where their residuals vanish.
pub(super) struct Adjuster<'a> {
    pass: Pass<'a>,
    state: eval::Block,
    residuals: usize,
    /// the size of a value of which rounding is a share, for each input
    least: Vec<f64>,
    /// how far each input goes for one unit of correction
    scale: Vec<f64>,
}

/// Where one row is on its way.
#[derive(Clone, Debug)]
struct Search {
    first: Option<f64>,
    least: f64,
    best: Vec<f64>,
    ended: bool,
}

impl<'a> Adjuster<'a> {
    pub(super) fn new(problem: &'a Problem, block: &'a Block, point: &[f64]) -> Self {
        let measurement = block.measurement;
        let set = problem.execution.instructions();
        let pass = Pass::new(block, block.seen.by_inputs(&block.programs, &block.weights, set), &problem.layout, point);
        // Measured inputs are moved by their sigmas; where none is measured, all by what is small for their kind.
        // How large a sigma is changes the way, not what can be seen where it ends.
        let any_sigma = measurement.inputs.iter().any(|input| input.sigma.is_some());
        let small = |dimension: Dimension| {
            if dimension == Dimension::of(Base::Angle) { 5e-5 } else { 0.1 }
        };
        let scale = measurement
            .inputs
            .iter()
            .map(|input| match input.sigma {
                Some(Sigma::Constant(sigma)) => sigma,
                None if any_sigma => 0.0,
                Some(Sigma::PerRow(_)) | None => small(input.unit.dimension),
            })
            .collect();
        let least = |input: &crate::compile::Input| {
            if input.unit.dimension == Dimension::of(Base::Angle) { 1.0 } else { small(input.unit.dimension) }
        };
        let least = measurement.inputs.iter().map(least).collect();
        let state = pass.begin();
        Adjuster { pass, state, residuals: measurement.residuals.len(), least, scale }
    }

    /// Whether the residuals of each row have vanished, but for rounding: beside what its inputs contribute by their own size.
    pub(super) fn holds(&mut self, combination: &[u32], readings: &[f64]) -> Vec<bool> {
        let (m, width) = (self.residuals, self.scale.len());
        if width == 0 {
            return vec![true; combination.len()];
        }
        self.pass.run(combination, readings, &mut self.state);
        let judge = |(row, inputs): (usize, &[f64])| {
            let number = |at: usize| self.state.output(at)[row];
            let left = (0..m).map(|i| number(i).powi(2)).sum::<f64>().sqrt();
            let size = |at: usize| number(m + at).abs() * inputs[at % width].abs().max(self.least[at % width]);
            let terms: f64 = (0..m * width).map(size).sum();
            left <= VANISHED * terms
        };
        readings.chunks_exact(width).enumerate().map(judge).collect()
    }

    /// Moves the readings of a span of rows; for each row, whether its residuals vanish there.
    pub(super) fn adjust(&mut self, combination: &[u32], readings: &mut [f64]) -> Vec<bool> {
        let (m, width) = (self.residuals, self.scale.len());
        if width == 0 {
            return vec![false; combination.len()];
        }
        let start = |row: &[f64]| Search { first: None, least: f64::INFINITY, best: row.to_vec(), ended: false };
        let mut searches: Vec<Search> = readings.chunks_exact(width).map(start).collect();
        let (mut f, mut b) = (vec![0.0; m], vec![0.0; m * width]);
        for _ in 0..ITERATIONS {
            self.pass.run(combination, readings, &mut self.state);
            for (row, search) in searches.iter_mut().enumerate().filter(|(_, search)| !search.ended) {
                let inputs = &mut readings[row * width..(row + 1) * width];
                f.iter_mut().enumerate().for_each(|(i, f)| *f = self.state.output(i)[row]);
                search.ended = !search.improved(&f, inputs);
                if search.ended {
                    continue;
                }
                for (at, b) in b.iter_mut().enumerate() {
                    *b = self.state.output(m + at)[row] * self.scale[at % width];
                }
                let Some(step) = correction(&f, &b, width) else {
                    search.ended = true;
                    continue;
                };
                for ((input, step), scale) in inputs.iter_mut().zip(step).zip(&self.scale) {
                    *input += step * scale;
                }
            }
            if searches.iter().all(|search| search.ended) {
                break;
            }
        }
        for (inputs, search) in readings.chunks_exact_mut(width).zip(&searches) {
            inputs.copy_from_slice(&search.best);
        }
        searches.iter().map(Search::met).collect()
    }
}

impl Search {
    /// Keeps the inputs where the residuals are smaller than before; whether they can be smaller still.
    fn improved(&mut self, residuals: &[f64], inputs: &[f64]) -> bool {
        let size = residuals.iter().map(|f| f * f).sum::<f64>().sqrt();
        if !size.is_finite() {
            return false;
        }
        let first = *self.first.get_or_insert(size);
        if size >= self.least {
            return false;
        }
        self.least = size;
        self.best.copy_from_slice(inputs);
        size > CONSISTENT * first
    }

    fn met(&self) -> bool {
        self.first.is_some_and(|first| self.least <= MET * first)
    }
}

/// The shortest v with f + B v = 0, v = −Bᵀ (B Bᵀ)⁻¹ f by Cholesky; where the rows of B depend on each other, the shortest that
/// leaves as little as possible, by singular values. `b` is B row by row, each of length `used`.
fn correction(f: &[f64], b: &[f64], used: usize) -> Option<Vec<f64>> {
    let Some(multipliers) = by_cholesky(b, used, f) else { return by_singular_values(b, used, f) };
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
        let b = [1.0, 1.0, 1.0, 0.0, 0.0, 1.0, -4.0, 6.0];
        let f = [0.3, -1.4];
        let cholesky = correction(&f, &b, 4).unwrap();
        let singular = by_singular_values(&b, 4, &f).unwrap();
        for (a, b) in cholesky.iter().zip(&singular) {
            assert!((a - b).abs() < 1e-14, "{cholesky:?} {singular:?}");
        }
        // it makes the equations vanish
        for (row, f) in b.chunks(4).zip(f) {
            assert!((dot(row, &cholesky) + f).abs() < 1e-14);
        }
    }

    #[test]
    fn dependent_rows_are_met_as_well_as_they_can_be() {
        let step = correction(&[1.0, 1.0], &[1.0, 1.0, 2.0, 2.0], 2).unwrap();
        // least squares of 1 + s and 1 + 2s: s = −3/5, shared evenly
        assert!(step.iter().all(|v| (v + 0.3).abs() < 1e-14), "{step:?}");
        let more = correction(&[1.0, 1.0], &[1.0, 2.0], 1).unwrap();
        assert!((more[0] + 0.6).abs() < 1e-14, "{more:?}");
    }
}
