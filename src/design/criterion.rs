//! What a design is good for, as a convex function of its information.
//!
//! With M = M₀ + Σ wᵢ Mᵢ and rows T of what is wanted, V = T M⁻¹ Tᵀ is the covariance of T q. Criteria are (Fedorov, Theory of Optimal
//! Experiments, 1972; Pukelsheim, Optimal Design of Experiments, 1993, ch. 6; all are minimised):
//!
//! | criterion | φ(M) |
//! |---|---|
//! | D | −log det M |
//! | A, mean variance of targets | tr V |
//! | E | the largest eigenvalue of V |
//! | several requirements | the largest of the tr V of parts |
//!
//! The last two are not smooth, so the search goes by a norm with a finite power p instead of the largest, of eigenvalues λ or parts v,
//!
//! > φₚ = (Σ vₑᵖ)^(1/p),  ∂φₚ/∂wᵢ = −‖Aᵢ M⁻¹ T_Zᵀ‖²,  T_Z = Z^½ T with Z = (V/φₚ)^(p−1) for E, and (vₑ/φₚ)^(p−1) in part e.
//!
//! With Z = 1 this is the gradient of tr V. For D it is −tr M⁻¹Mᵢ = −‖Aᵢ L⁻ᵀ‖², M = L Lᵀ: the rows of L⁻¹ stand where T_Z M⁻¹ does.

use super::experiment::{Experiment, Inverse, products};
use crate::linalg::{LinalgError, Matrix, dot, svd};

/// What is to be small. Rows are in the coordinates of the [`Experiment`]; scaled so that one is what counts as known well enough.
#[derive(Clone, Debug, PartialEq)]
pub enum Criterion {
    /// The volume of the ellipsoid of uncertainty, (det M)^(−1/2).
    Determinant,
    /// The mean variance of quantities with these gradients: the trace of T M⁻¹ Tᵀ, T given row by row.
    Trace(Vec<f64>),
    /// The largest variance of any combination (of length one) of such quantities.
    Eigenvalue(Vec<f64>),
    /// The largest of several traces.
    Largest(Vec<Vec<f64>>),
}

impl Criterion {
    /// D: all coordinates, whatever their scale.
    #[must_use]
    pub fn d() -> Criterion {
        Criterion::Determinant
    }

    /// A: the sum of the variances of n coordinates.
    #[must_use]
    pub fn a(n: usize) -> Criterion {
        Criterion::Trace(identity(n))
    }

    /// E: the variance of what is known worst of n coordinates.
    #[must_use]
    pub fn e(n: usize) -> Criterion {
        Criterion::Eigenvalue(identity(n))
    }
}

fn identity(n: usize) -> Vec<f64> {
    (0..n * n).map(|at| if at % (n + 1) == 0 { 1.0 } else { 0.0 }).collect()
}

/// A criterion in the coordinates that an experiment is kept in.
#[derive(Clone, Debug)]
pub(super) enum Goal {
    /// with what the given coordinates add to −log det M
    Determinant(f64),
    /// rows by part
    Parts {
        rows: Vec<f64>,
        ends: Vec<usize>,
        power: f64,
    },
    Eigenvalues {
        rows: Vec<f64>,
        power: f64,
    },
}

/// A goal at one M.
#[derive(Clone, Debug)]
pub(super) struct Pull {
    /// φₚ
    pub(super) smooth: f64,
    /// φ
    pub(super) value: f64,
    /// T_Z
    pub(super) wanted: Vec<f64>,
    /// T_Z M⁻¹, so that ∂φₚ/∂wᵢ = −‖Aᵢ directionsᵀ‖²
    pub(super) directions: Vec<f64>,
    /// Σ of Z: φ ≥ tr(Z V)/size for any M
    pub(super) size: f64,
    /// For each feature of a row of `directions` (unweighted T M⁻¹ in the eigenbasis, or by part): λ/φₚ.
    pub(super) shares: Vec<f64>,
    /// T M⁻¹ without Z, in the eigenbasis of V for eigenvalues.
    pub(super) plain: Vec<f64>,
}

impl Goal {
    pub(super) fn new(experiment: &Experiment, criterion: &Criterion) -> Result<Goal, LinalgError> {
        let reduced =
            |rows: &[f64]| Ok::<_, LinalgError>(reduced(experiment.coordinates(), experiment.transformed(rows)?));
        Ok(match criterion {
            Criterion::Determinant => Goal::Determinant(experiment.shift()),
            Criterion::Trace(rows) => {
                let rows = reduced(rows)?;
                Goal::Parts { ends: vec![rows.len()], rows, power: 1.0 }
            }
            Criterion::Eigenvalue(rows) => Goal::Eigenvalues { rows: experiment.transformed(rows)?, power: 1.0 },
            Criterion::Largest(parts) => {
                let (mut rows, mut ends) = (Vec::new(), Vec::new());
                for part in parts {
                    rows.extend(reduced(part)?);
                    ends.push(rows.len());
                }
                Goal::Parts { rows, ends, power: 1.0 }
            }
        })
    }

    /// Whether φ is smooth, so that no power is needed.
    pub(super) fn is_smooth(&self) -> bool {
        match self {
            Goal::Determinant(_) => true,
            Goal::Parts { ends, .. } => ends.len() == 1,
            Goal::Eigenvalues { .. } => false,
        }
    }

    pub(super) fn with_power(&self, power: f64) -> Goal {
        let mut goal = self.clone();
        if let Goal::Parts { power: own, .. } | Goal::Eigenvalues { power: own, .. } = &mut goal {
            *own = power;
        }
        goal
    }

    /// φₚ alone.
    pub(super) fn smooth(&self, inverse: &Inverse) -> f64 {
        match self {
            Goal::Determinant(shift) => shift - inverse.log_determinant,
            Goal::Parts { rows, ends, power } => norm_of(&variances(inverse, rows, ends), *power),
            Goal::Eigenvalues { .. } => self.at(inverse).map_or(f64::INFINITY, |pull| pull.smooth),
        }
    }

    /// None where a decomposition fails, which finite numbers do not do.
    pub(super) fn at(&self, inverse: &Inverse) -> Option<Pull> {
        let n = inverse.n;
        Some(match self {
            Goal::Determinant(shift) => Pull {
                smooth: shift - inverse.log_determinant,
                value: shift - inverse.log_determinant,
                wanted: Vec::new(),
                directions: inverse.root.clone(),
                size: 1.0,
                shares: Vec::new(),
                plain: Vec::new(),
            },
            Goal::Parts { rows, ends, power } => {
                let parts = variances(inverse, rows, ends);
                let smooth = norm_of(&parts, *power);
                let shares: Vec<f64> = parts.iter().map(|v| v / smooth).collect();
                let plain = inverse.times(rows);
                let (mut wanted, mut directions) = (rows.clone(), plain.clone());
                let mut begin = 0;
                for (&end, share) in ends.iter().zip(&shares) {
                    let root = share.powf((power - 1.0) / 2.0);
                    wanted[begin..end].iter_mut().for_each(|x| *x *= root);
                    directions[begin..end].iter_mut().for_each(|x| *x *= root);
                    begin = end;
                }
                let size = if ends.len() == 1 { 1.0 } else { shares.iter().map(|s| s.powf(power - 1.0)).sum() };
                let value = parts.iter().copied().fold(0.0, f64::max);
                Pull { smooth, value, wanted, directions, size, shares, plain }
            }
            Goal::Eigenvalues { rows, power } => {
                // V = (T L⁻ᵀ)(T L⁻ᵀ)ᵀ, so that its eigenvectors are left singular vectors
                let half = products(n, rows, &inverse.root);
                let count = rows.len() / n;
                let half: Vec<&[f64]> = half.chunks_exact(n).collect();
                let found = svd(&Matrix::from_columns(n, &half)).ok()?;
                let lambda: Vec<f64> = found.sigma.iter().map(|s| s * s).collect();
                let smooth = norm_of(&lambda, *power);
                let shares: Vec<f64> = lambda.iter().map(|l| l / smooth).collect();
                let mut turned = vec![0.0; rows.len()];
                for (a, line) in turned.chunks_exact_mut(n).enumerate().take(count) {
                    for (weight, row) in found.v.column(a).iter().zip(rows.chunks_exact(n)) {
                        line.iter_mut().zip(row).for_each(|(x, y)| *x += weight * y);
                    }
                }
                let plain = inverse.times(&turned);
                let (mut wanted, mut directions) = (turned, plain.clone());
                let lines = wanted.chunks_exact_mut(n).zip(directions.chunks_exact_mut(n));
                for ((wanted, directions), share) in lines.zip(&shares) {
                    let root = share.powf((power - 1.0) / 2.0);
                    wanted.iter_mut().chain(directions).for_each(|x| *x *= root);
                }
                let size = shares.iter().map(|s| s.powf(power - 1.0)).sum();
                let value = lambda.first().copied().unwrap_or(0.0);
                Pull { smooth, value, wanted, directions, size, shares, plain }
            }
        })
    }
}

/// tr(T M⁻¹ Tᵀ) of each part.
fn variances(inverse: &Inverse, rows: &[f64], ends: &[usize]) -> Vec<f64> {
    let of = |row: &[f64]| inverse.root.chunks_exact(inverse.n).map(|l| dot(l, row).powi(2)).sum::<f64>();
    let mut begin = 0;
    let part = |&end: &usize| {
        let sum = rows[begin..end].chunks_exact(inverse.n).map(of).sum();
        begin = end;
        sum
    };
    ends.iter().map(part).collect()
}

/// (Σ vᵖ)^(1/p) of numbers that are not negative.
fn norm_of(values: &[f64], power: f64) -> f64 {
    let largest = values.iter().copied().fold(0.0, f64::max);
    if power == 1.0 || largest == 0.0 {
        return values.iter().sum();
    }
    largest * values.iter().map(|v| (v / largest).powf(power)).sum::<f64>().powf(1.0 / power)
}

/// Rows with the same TᵀT, n at most.
fn reduced(n: usize, rows: Vec<f64>) -> Vec<f64> {
    if rows.len() <= n * n {
        return rows;
    }
    let mut all = crate::linalg::SquareRootInformation::new(n);
    for some in rows.chunks(256 * n) {
        let some: Vec<Vec<f64>> = some.chunks(n).map(|row| row.iter().copied().chain([0.0]).collect()).collect();
        if all.absorb(&mut Matrix::from_rows(n + 1, &some)).is_err() {
            return rows;
        }
    }
    (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|at| if at.1 >= at.0 { all.r()[at] } else { 0.0 }).collect()
}
