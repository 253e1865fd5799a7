//! The working set: which members it begins with, and the QR of its rows over the coordinates that are not held.

use super::{ConstrainedStart, Member, NEAR, Search};
use crate::linalg::{
    Bound, Conditions, LinalgError, Matrix, SquareRootInformation, Start, bounded_least_squares, dot, norm,
    solve_upper_transposed,
};

/// What is left of a vector after projection, as a share, that makes it independent of the others.
const INDEPENDENT: f64 = 1e-10;

/// Rows w₁, w₂, … = Q₁ R over p coordinates, by Householder reflections.
pub(super) struct Factored {
    /// The coordinates that are free.
    pub(super) free: Vec<usize>,
    /// The rows that are independent, by their index among all.
    pub(super) rows: Vec<usize>,
    /// Columns of R: the head of each transformed row.
    heads: Vec<Vec<f64>>,
    /// Q₁, then Z: p orthonormal vectors.
    pub(super) basis: Vec<Vec<f64>>,
}

impl Factored {
    fn new(free: Vec<usize>, rows: impl Iterator<Item = (usize, Vec<f64>)>) -> Self {
        let p = free.len();
        let mut reflectors: Vec<Vec<f64>> = Vec::new();
        let (mut kept, mut heads) = (Vec::new(), Vec::new());
        for (index, mut row) in rows {
            let k = reflectors.len();
            let length = norm(&row);
            reflectors.iter().for_each(|u| reflect(u, &mut row));
            let tail = norm(&row[k.min(p)..]);
            if k == p || tail <= INDEPENDENT * length {
                continue;
            }
            let mut u = row.clone();
            u[..k].fill(0.0);
            let head = -tail.copysign(row[k]);
            u[k] -= head;
            let length = norm(&u);
            u.iter_mut().for_each(|entry| *entry /= length);
            row.truncate(k);
            row.push(head);
            reflectors.push(u);
            heads.push(row);
            kept.push(index);
        }
        let unit = |i: usize| {
            let mut vector = vec![0.0; p];
            vector[i] = 1.0;
            reflectors.iter().rev().for_each(|u| reflect(u, &mut vector));
            vector
        };
        Self { free, rows: kept, heads, basis: (0..p).map(unit).collect() }
    }

    /// Q₁ R⁻ᵀ t: the shortest s with wᵢᵀs = tᵢ.
    pub(super) fn onto(&self, t: &[f64]) -> Vec<f64> {
        let mut s = vec![0.0; self.free.len()];
        let mut u: Vec<f64> = Vec::with_capacity(t.len());
        for (k, head) in self.heads.iter().enumerate() {
            let known: f64 = dot(&head[..k], &u);
            u.push((t[k] - known) / head[k]);
            s.iter_mut().zip(&self.basis[k]).for_each(|(s, q)| *s += u[k] * q);
        }
        s
    }

    /// R⁻¹ Q₁ᵀ v: the μ with which Σ μᵢ wᵢ is nearest to v.
    pub(super) fn combination(&self, v: &[f64]) -> Vec<f64> {
        let count = self.heads.len();
        let mut mu: Vec<f64> = self.basis[..count].iter().map(|q| dot(q, v)).collect();
        for k in (0..count).rev() {
            mu[k] /= self.heads[k][k];
            for i in 0..k {
                mu[i] -= self.heads[k][i] * mu[k];
            }
        }
        mu
    }

    /// Z.
    pub(super) fn null(&self) -> &[Vec<f64>] {
        &self.basis[self.rows.len()..]
    }
}

/// v − 2 u uᵀv.
fn reflect(u: &[f64], v: &mut [f64]) {
    let twice = 2.0 * dot(u, v);
    v.iter_mut().zip(u).for_each(|(v, u)| *v -= twice * u);
}

impl Search<'_> {
    /// QR of the working rows.
    pub(super) fn working_rows(&self) -> Factored {
        let free: Vec<usize> = (0..self.delta.len()).filter(|&j| self.active[j] == Bound::Free).collect();
        let rows = (0..self.working.len()).filter(|&i| self.working[i]);
        let part = |i: usize| (i, free.iter().map(|&j| self.scaled[i][j]).collect());
        let rows: Vec<(usize, Vec<f64>)> = rows.map(part).collect();
        Factored::new(free, rows.into_iter())
    }

    /// The working set at a corner, from its dual: of all that δ meets as equations, the λ of the right signs that leave
    /// least of R⁻ᵀ(∇ + Σ λᵢ aᵢ), a problem in a box. What has λ = 0 lets go.
    pub(super) fn lift(&mut self) -> Result<(), LinalgError> {
        /// Keeps R regular; it changes which set is tried, not what is a minimum.
        const BLUR: f64 = 1e-8;
        let n = self.delta.len();
        let inverse: Vec<f64> = self.lengths.iter().map(|c| 1.0 / c).collect();
        let mut metric = SquareRootInformation::from_rows(&self.a.scale_columns(&inverse), self.d)?;
        let blur = Matrix::identity(n).scale_columns(&vec![BLUR; n]);
        metric.merge(&SquareRootInformation::from_rows(&blur, &vec![0.0; n])?)?;
        let gradient = self.a.transpose_mul_vec(&self.residual());
        let gradient: Vec<f64> = gradient.iter().zip(&inverse).map(|(g, c)| g * c).collect();
        let d = solve_upper_transposed(metric.r(), &gradient)?;
        let Conditions { lower, upper, rows } = self.conditions;
        let mut members = Vec::new();
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            if lower[j] == upper[j] || self.delta[j] == lower[j] {
                members.push((Member::Coordinate(j, Bound::Lower), unit.clone(), lower[j] == upper[j], -1.0));
            }
            if lower[j] < upper[j] && self.delta[j] == upper[j] {
                members.push((Member::Coordinate(j, Bound::Upper), unit, false, 1.0));
            }
        }
        let spread = norm(&self.size.iter().zip(&self.lengths).map(|(x, c)| x * c).collect::<Vec<_>>());
        for (i, row) in rows.iter().enumerate() {
            let off = row.right - dot(&row.coefficients, &self.delta);
            if self.working[i] || row.equal || off <= NEAR * (row.terms(&self.delta) + norm(&self.scaled[i]) * spread) {
                members.push((Member::Row(i), self.scaled[i].clone(), row.equal, 1.0));
            }
        }
        let mut columns: Vec<Vec<f64>> = Vec::new();
        for (_, vector, _, sign) in &members {
            let column = solve_upper_transposed(metric.r(), vector)?;
            let length = norm(&column).max(f64::MIN_POSITIVE);
            columns.push(column.iter().map(|entry| sign * entry / length).collect());
        }
        let low: Vec<f64> = members.iter().map(|(_, _, free, _)| if *free { f64::NEG_INFINITY } else { 0.0 }).collect();
        let high = vec![f64::INFINITY; members.len()];
        let start = Start { delta: vec![0.0; members.len()], active: vec![Bound::Lower; members.len()] };
        let start = Start {
            active: low.iter().zip(start.active).map(|(l, b)| if *l < 0.0 { Bound::Free } else { b }).collect(),
            ..start
        };
        let found = bounded_least_squares(&Matrix::from_columns(n, &columns), &d, &low, &high, Some(&start))?;
        self.active.fill(Bound::Free);
        self.working.fill(false);
        for ((member, _, held, _), on) in members.into_iter().zip(found.active) {
            match member {
                _ if on != Bound::Free && !held => {}
                Member::Coordinate(j, bound) => self.active[j] = bound,
                Member::Row(i) => self.working[i] = true,
            }
        }
        Ok(())
    }

    /// The working set to begin with: what is always held, and what the start suggests as far as it is independent.
    pub(super) fn choose(&mut self, start: Option<&ConstrainedStart>) {
        let n = self.delta.len();
        let (lower, upper) = (self.conditions.lower, self.conditions.upper);
        let mut spanned: Vec<Vec<f64>> = Vec::new();
        let mut independent = |vector: &[f64]| {
            let mut left = vector.to_vec();
            for _ in 0..2 {
                for q in &spanned {
                    let along = dot(q, &left);
                    left.iter_mut().zip(q).for_each(|(left, q)| *left -= along * q);
                }
            }
            let length = norm(&left);
            let new = length > INDEPENDENT * norm(vector);
            if new {
                spanned.push(left.iter().map(|entry| entry / length).collect());
            }
            new
        };
        let unit = |j: usize| (0..n).map(|k| if k == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        for j in 0..n {
            self.active[j] = Bound::Free;
            if lower[j] == upper[j] && independent(&unit(j)) {
                self.active[j] = Bound::Lower;
            }
        }
        for (i, row) in self.conditions.rows.iter().enumerate() {
            self.working[i] = row.equal && independent(&self.scaled[i]);
        }
        let Some(start) = start else { return self.clamp() };
        for j in 0..n {
            let there = match start.active[j] {
                Bound::Lower => lower[j].is_finite(),
                Bound::Upper => upper[j].is_finite(),
                Bound::Free => false,
            };
            if there && lower[j] < upper[j] && independent(&unit(j)) {
                self.active[j] = start.active[j];
            }
        }
        for i in 0..self.working.len() {
            if start.rows[i] && !self.conditions.rows[i].equal {
                self.working[i] = independent(&self.scaled[i]);
            }
        }
        self.clamp();
    }
}
