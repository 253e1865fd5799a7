//! The cost of equations in each norm, and the conic program of a step that lowers it.
//!
//! With w = D δ and r(w) = J D⁻¹ w + r, and u for rows that stay squares,
//!
//! ```text
//! L1        minimise Σ (p + m) + ½‖u‖²      subject to   r(w) = p − m,   p, m ≥ 0
//! minimax   minimise τ + ½‖u‖²              subject to   −τ ≤ r(w) ≤ τ
//! Huber     minimise ½‖u‖² + k Σ (p + m)    subject to   r(w) = u + p − m,   p, m ≥ 0
//! ```
//!
//! each within bounds, constraints and ‖w‖ ≤ Δ. The last is Huber's function by Mangasarian & Musicant, IEEE Trans. Pattern
//! Analysis 22 (2000) 950. Residuals are in units of the largest, so that Clarabel's tolerances mean what they say.

use super::Norm;
use super::answer::{Answer, Cone, ConicProgram, ConicStep};
use crate::linalg::{Bound, Row, norm};
use crate::solve::{Restriction, Stacked};

/// Clarabel's gap.
const TOLERANCE: f64 = 1e-10;

impl Norm {
    /// What is minimised.
    pub(super) fn cost(self, residual: &[f64], priors: usize) -> f64 {
        let (rows, priors) = residual.split_at(residual.len() - priors.min(residual.len()));
        let squares = |r: &[f64]| 0.5 * r.iter().map(|r| r * r).sum::<f64>();
        let huber = |k: f64, r: f64| if r.abs() <= k { 0.5 * r * r } else { k * r.abs() - 0.5 * k * k };
        squares(priors)
            + match self {
                Self::LeastSquares => squares(rows),
                Self::Huber(k) => rows.iter().map(|&r| huber(k, r)).sum(),
                Self::L1 => rows.iter().map(|r| r.abs()).sum(),
                Self::Minimax => rows.iter().fold(0.0, |largest: f64, r| largest.max(r.abs())),
            }
    }
}

/// What a program is made of.
pub(super) struct Around<'a> {
    pub(super) stacked: &'a Stacked,
    pub(super) diagonal: &'a [f64],
    pub(super) lower: &'a [f64],
    pub(super) upper: &'a [f64],
    pub(super) rows: &'a [Row],
}

/// A step that lowers the norm.
pub(super) struct NormStep {
    pub(super) delta: Vec<f64>,
    /// ‖D δ‖
    pub(super) length: f64,
    pub(super) conic: ConicStep,
}

impl Around<'_> {
    /// r + J δ.
    pub(super) fn linear(&self, delta: &[f64]) -> Vec<f64> {
        let moved = self.stacked.jacobian.mul_vec(delta);
        moved.iter().zip(&self.stacked.residual).map(|(moved, r)| moved + r).collect()
    }

    /// The step within ‖D δ‖ ≤ Δ.
    pub(super) fn step(&self, goal: Norm, radius: f64) -> NormStep {
        let n = self.diagonal.len();
        let Stacked { jacobian, residual, priors } = self.stacked;
        let unit = residual.iter().fold(0.0_f64, |largest, r| largest.max(r.abs()));
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let first_prior = residual.len() - priors.min(&residual.len());
        // Costs are in units of the largest residual, or of its square.
        let scale = if matches!(goal, Norm::Huber(_) | Norm::LeastSquares) { unit * unit } else { unit };
        let (mut p, mut q) = (vec![0.0; n], vec![0.0; n]);
        let mut variable = |square: f64, linear: f64| {
            p.push(square);
            q.push(linear);
            p.len() - 1
        };
        // Which variables make up r(w), with their signs.
        let mut made_of: Vec<Vec<(usize, f64)>> = Vec::new();
        let largest = (goal == Norm::Minimax).then(|| variable(0.0, 1.0));
        for i in 0..residual.len() {
            made_of.push(match goal {
                _ if i >= first_prior => vec![(variable(unit * unit / scale, 0.0), 1.0)],
                Norm::LeastSquares => vec![(variable(1.0, 0.0), 1.0)],
                Norm::Minimax => vec![],
                Norm::L1 => vec![(variable(0.0, 1.0), 1.0), (variable(0.0, 1.0), -1.0)],
                Norm::Huber(k) => {
                    vec![(variable(0.0, k / unit), 1.0), (variable(0.0, k / unit), -1.0), (variable(1.0, 0.0), 1.0)]
                }
            });
        }
        let mut program = ConicProgram::new(p, q);
        let over_w = |i: usize, sign: f64| -> Vec<(usize, f64)> {
            (0..n).map(|j| (j, sign * jacobian[(i, j)] / self.diagonal[j])).collect()
        };
        // s = r(w) − what it is made of = 0
        for (i, parts) in made_of.iter().enumerate().filter(|(_, parts)| !parts.is_empty()) {
            let entries = over_w(i, -1.0).into_iter().chain(parts.iter().copied());
            program.row(Cone::Zero, entries, residual[i] / unit);
        }
        let mut places = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let cone = if row.equal { Cone::Zero } else { Cone::NonNegative };
            let entries = row.coefficients.iter().zip(self.diagonal).map(|(a, d)| a / d).enumerate();
            places.push((program.row(cone, entries, row.right / unit), Restriction::Constraint(i)));
        }
        for (i, parts) in made_of.iter().enumerate() {
            if let (Some(largest), true) = (largest, parts.is_empty()) {
                for sign in [1.0, -1.0] {
                    let entries = over_w(i, sign).into_iter().chain([(largest, -1.0)]);
                    program.row(Cone::NonNegative, entries, -sign * residual[i] / unit);
                }
            }
            for &(k, _) in parts.iter().take(if parts.len() > 1 { 2 } else { 0 }) {
                program.row(Cone::NonNegative, [(k, -1.0)], 0.0);
            }
        }
        for (j, d) in self.diagonal.iter().enumerate() {
            if self.upper[j].is_finite() {
                let place = program.row(Cone::NonNegative, [(j, 1.0)], self.upper[j] * d / unit);
                places.push((place, Restriction::Upper(j)));
            }
            if self.lower[j].is_finite() {
                let place = program.row(Cone::NonNegative, [(j, -1.0)], -self.lower[j] * d / unit);
                places.push((place, Restriction::Lower(j)));
            }
        }
        let mut ball = vec![(vec![], radius / unit)];
        ball.extend((0..n).map(|j| (vec![(j, -1.0)], 0.0)));
        program.second_order(ball);
        let Answer { status, iterations, x, s, z } = program.solve(TOLERANCE);
        let mut delta: Vec<f64> = x.iter().take(n).zip(self.diagonal).map(|(w, d)| w * unit / d).collect();
        let mut held = vec![Bound::Free; n];
        let mut active = Vec::new();
        for (place, what) in places.into_iter().filter(|_| status.solved()) {
            let multiplier = z[place] * scale / unit;
            let on = z[place] > s[place];
            match what {
                Restriction::Lower(j) if on => {
                    held[j] = Bound::Lower;
                    active.push((what, multiplier * self.diagonal[j]));
                }
                Restriction::Upper(j) if on => {
                    held[j] = Bound::Upper;
                    active.push((what, -multiplier * self.diagonal[j]));
                }
                Restriction::Constraint(i) if on || self.rows[i].equal => active.push((what, multiplier)),
                _ => {}
            }
        }
        for j in 0..n {
            delta[j] = match held[j] {
                Bound::Lower => self.lower[j],
                Bound::Upper => self.upper[j],
                Bound::Free => delta[j].clamp(self.lower[j], self.upper[j]),
            };
        }
        let length = norm(&delta.iter().zip(self.diagonal).map(|(delta, d)| delta * d).collect::<Vec<_>>());
        NormStep { delta, length, conic: ConicStep { status, iterations, active } }
    }
}
