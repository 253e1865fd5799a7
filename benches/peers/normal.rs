//! Normal equations of the hand-derived rows, and a small Levenberg–Marquardt on them: (25) and (27).

use nalgebra::{SMatrix, SVector};

use super::hand::{Line, PARAMETERS, Pair, RESIDUAL, Rows, WIDTH, fma};

/// Lines whose rows are folded at a time.
const BATCH: usize = 8;
/// Side of a tile of sums that stay in registers.
const TILE: usize = 8;

/// The upper triangle of [J r]ᵀ[J r], in tiles: JᵀJ, Jᵀr and twice the cost.
pub(crate) struct Normal([[f64; WIDTH]; WIDTH]);

impl Normal {
    fn matrix(&self) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
        SMatrix::from_fn(|i, k| self.0[i.min(k)][i.max(k)])
    }

    fn gradient(&self) -> SVector<f64, PARAMETERS> {
        SVector::from_fn(|i, _| self.0[i][RESIDUAL])
    }

    /// ½ Σ r²
    pub(crate) fn cost(&self) -> f64 {
        0.5 * self.0[RESIDUAL][RESIDUAL]
    }

    /// Adds the products of the rows' columns from `I` on with those from `K` on.
    #[inline(always)]
    fn add_tile<const I: usize, const K: usize>(&mut self, batch: &[Rows]) {
        let mut sums = [[0.0; TILE]; TILE];
        for row in batch.iter().flatten() {
            for i in 0..TILE {
                for k in 0..TILE {
                    sums[i][k] = fma(row[I + i], row[K + k], sums[i][k]);
                }
            }
        }
        for (i, sums) in sums.iter().enumerate() {
            for (k, sum) in sums.iter().enumerate() {
                self.0[I + i][K + k] += sum;
            }
        }
    }

    fn add(&mut self, batch: &[Rows]) {
        self.add_tile::<0, 0>(batch);
        self.add_tile::<0, 8>(batch);
        self.add_tile::<0, 16>(batch);
        self.add_tile::<8, 8>(batch);
        self.add_tile::<8, 16>(batch);
        self.add_tile::<16, 16>(batch);
    }

    /// The normal equations of all lines, with unit weights.
    pub(crate) fn new(q: &[f64], lines: &[Line]) -> Self {
        let pair = Pair::new(q);
        let mut normal = Normal([[0.0; WIDTH]; WIDTH]);
        let mut batch = [[[0.0; WIDTH]; 5]; BATCH];
        for lines in lines.chunks(BATCH) {
            for (line, rows) in lines.iter().zip(&mut batch) {
                pair.linearise(line, rows);
            }
            normal.add(&batch[..lines.len()]);
        }
        normal
    }
}

/// ½ Σ r²
pub(crate) fn cost(q: &[f64], lines: &[Line]) -> f64 {
    let pair = Pair::new(q);
    0.5 * lines.iter().flat_map(|line| pair.residuals(line)).fold(0.0, |sum, r| fma(r, r, sum))
}

/// A minimum, and the trial steps that it took.
pub(crate) struct Fitted {
    pub(crate) cost: f64,
    pub(crate) trials: usize,
}

/// Minimises until an accepted step lowers the cost by less than this share of it, or no step lowers it.
const ENOUGH: f64 = 1e-10;

/// Levenberg–Marquardt (27), damped in proportion to the diagonal of JᵀJ.
pub(crate) fn fit(start: &[f64], lines: &[Line]) -> Fitted {
    let mut q = SVector::<f64, PARAMETERS>::from_column_slice(start);
    let mut normal = Normal::new(q.as_slice(), lines);
    let (mut trials, mut lambda) = (0, 1e-4);
    loop {
        let mut damped = normal.matrix();
        for i in 0..PARAMETERS {
            damped[(i, i)] *= 1.0 + lambda;
        }
        let old = normal.cost();
        if let Some(factor) = damped.cholesky() {
            let trial = q - factor.solve(&normal.gradient());
            trials += 1;
            let new = cost(trial.as_slice(), lines);
            if new < old {
                q = trial;
                lambda *= 0.1;
                if old - new < ENOUGH * old {
                    return Fitted { cost: new, trials };
                }
                normal = Normal::new(q.as_slice(), lines);
                continue;
            }
        }
        lambda *= 10.0;
        if lambda > 1e10 {
            return Fitted { cost: old, trials };
        }
    }
}
