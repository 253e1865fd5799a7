//! Least squares within a box and under linear equations and inequalities, solved exactly by an active-set loop.
//!
//! ```text
//! minimise ½‖A δ + d‖²   subject to   lower ≤ δ ≤ upper,   aᵢᵀδ = bᵢ,   aᵢᵀδ ≤ bᵢ                          (1)
//! ```
//!
//! The loop is the primal one of Gill & Murray (Nocedal & Wright, Numerical Optimization, 2nd ed., §16.5), with steps from
//! the null space of the working rows. A held coordinate leaves the problem with its column; what the working rows leave
//! to the others is spanned by Z, so that a step is
//!
//! ```text
//! s = C⁻¹(Q₁ R⁻ᵀ t + Z y),    [Q₁ Z] from QR of the working rows,    t = b − Wδ,    y minimises ‖A s + (A δ + d)‖   (2)
//! ```
//!
//! with C the lengths of the columns of A, by QR of A C⁻¹Z: no normal equations. Q₁ part and t keep the working rows met to
//! rounding whatever the point they began at. A step that leaves the conditions stops at the first, which joins the
//! working set; otherwise the member whose multiplier has the wrong sign and weighs most leaves it; when there is none, the
//! Karush–Kuhn–Tucker conditions hold,
//!
//! ```text
//! Aᵀ(A δ + d) + Σ μᵢ aᵢ = ν,    ν ≥ 0 on a lower, ≤ 0 on an upper bound, 0 elsewhere,    μ ≥ 0 for inequalities    (3)
//! ```
//!
//! and for a convex problem they are sufficient. A member that had to be taken back before anything moved is not let go
//! again until something has. At a corner where many conditions meet that may leave none, or lead round in circles: then
//! lots are drawn for who goes, and for who joins of those that stop a step at once, by a fixed sequence of numbers.

use super::feasible::{BROKEN, Conditions, feasible_point};
use super::matrix::add_scaled;
use super::{Bound, LinalgError, Matrix, dot, norm, same_size};

mod step;
mod working;

/// Where the loop starts, when something is known.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstrainedStart {
    /// A point; it may break conditions a little, or even not a little.
    pub delta: Vec<f64>,
    /// Coordinates that start on a bound.
    pub active: Vec<Bound>,
    /// Rows that start as equations.
    pub rows: Vec<bool>,
}

/// What [`constrained_least_squares`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstrainedSolution {
    /// The minimiser; an active coordinate is exactly its bound.
    pub delta: Vec<f64>,
    /// Which coordinates are held on a bound.
    pub active: Vec<Bound>,
    /// Which rows are met as equations.
    pub rows: Vec<bool>,
    /// ν of (3), 0 where free.
    pub bound_multipliers: Vec<f64>,
    /// μ of (3), 0 for rows that are not active.
    pub row_multipliers: Vec<f64>,
    /// By how much (3) fails at worst, in units of columns of length one, as a share of ‖d‖ + Σₖ‖Aₖ‖|δₖ|.
    pub violation: f64,
    /// Whether (3) and the conditions hold to rounding. False says that the loop ended without it.
    pub settled: bool,
    /// Least-squares problems solved.
    pub iterations: usize,
}

/// A violation of (3) up to this is rounding; a QR solution is good for a few n ε.
const SETTLED: f64 = 1e-12;

/// Beyond this share of what made it a row is not on the right side by rounding.
pub(super) const NEAR: f64 = 1e-13;

/// Solves (1) to rounding. Where A does not determine what the conditions leave free, every step is the shortest one.
///
/// # Errors
/// [`LinalgError::Infeasible`] where no δ meets all conditions; where sizes differ, an entry is not finite, or the box is
/// empty. A bound may be infinite.
///
/// ```
/// use phical::linalg::{Conditions, Matrix, Row, constrained_least_squares};
/// // The point of x + y = 1 with x ≥ 0.8 that is nearest to the origin.
/// let row = Row { coefficients: vec![1.0, 1.0], right: 1.0, equal: true };
/// let conditions = Conditions { lower: &[0.8, -9.0], upper: &[9.0, 9.0], rows: &[row] };
/// let nearest = constrained_least_squares(&Matrix::identity(2), &[0.0, 0.0], &conditions, None)?;
/// assert_eq!(nearest.delta[0], 0.8);
/// assert!((nearest.delta[1] - 0.2).abs() < 1e-15 && nearest.settled);
/// assert!((nearest.row_multipliers[0] + 0.2).abs() < 1e-15 && (nearest.bound_multipliers[0] - 0.6).abs() < 1e-15);
/// # Ok::<(), phical::linalg::LinalgError>(())
/// ```
pub fn constrained_least_squares(
    a: &Matrix,
    d: &[f64],
    conditions: &Conditions<'_>,
    start: Option<&ConstrainedStart>,
) -> Result<ConstrainedSolution, LinalgError> {
    same_size(a.rows(), d.len())?;
    conditions.check(a.columns())?;
    if !a.is_finite() || d.iter().any(|entry| !entry.is_finite()) {
        return Err(LinalgError::NotFinite);
    }
    let mut search = Search::new(a, d, *conditions);
    search.begin(start)?;
    search.run()
}

/// One member of a working set.
#[derive(Clone, Copy, PartialEq)]
enum Member {
    Coordinate(usize, Bound),
    Row(usize),
}

struct Search<'a> {
    a: &'a Matrix,
    d: &'a [f64],
    conditions: Conditions<'a>,
    /// C
    lengths: Vec<f64>,
    /// aᵢ C⁻¹
    scaled: Vec<Vec<f64>>,
    delta: Vec<f64>,
    /// The largest |δⱼ| before and after the last step: what rounding of δⱼ is a share of.
    size: Vec<f64>,
    active: Vec<Bound>,
    working: Vec<bool>,
    /// The last number drawn.
    lot: u64,
}

impl<'a> Search<'a> {
    fn new(a: &'a Matrix, d: &'a [f64], conditions: Conditions<'a>) -> Self {
        let n = a.columns();
        let mut lengths = a.column_norms();
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let instead = if longest > 0.0 { longest } else { 1.0 };
        lengths.iter_mut().filter(|length| **length == 0.0).for_each(|length| *length = instead);
        let scale = |row: &super::Row| row.coefficients.iter().zip(&lengths).map(|(a, c)| a / c).collect();
        let scaled: Vec<Vec<f64>> = conditions.rows.iter().map(scale).collect();
        let working = vec![false; scaled.len()];
        let active = vec![Bound::Free; n];
        Self { a, d, conditions, lengths, scaled, delta: vec![0.0; n], size: vec![0.0; n], active, working, lot: 0 }
    }

    fn begin(&mut self, start: Option<&ConstrainedStart>) -> Result<(), LinalgError> {
        let n = self.delta.len();
        if let Some(start) = start {
            same_size(n, start.delta.len())?;
            same_size(n, start.active.len())?;
            same_size(self.working.len(), start.rows.len())?;
            if start.delta.iter().any(|entry| !entry.is_finite()) {
                return Err(LinalgError::NotFinite);
            }
            self.delta.copy_from_slice(&start.delta);
        }
        self.clamp();
        self.choose(start);
        for _ in 0..2 {
            let before = self.delta.clone();
            let correction = self.correction(&self.working_rows())?;
            add_scaled(&mut self.delta, 1.0, &correction);
            self.clamp();
            self.measure(&before);
        }
        if !self.met(NEAR) {
            self.delta = feasible_point(&self.conditions, &self.delta)?;
            self.measure(&vec![0.0; n]);
            self.choose(None);
        }
        Ok(())
    }

    /// Remembers where a step began.
    fn measure(&mut self, before: &[f64]) {
        let larger = |(now, before): (&f64, &f64)| now.abs().max(before.abs());
        self.size = self.delta.iter().zip(before).map(larger).collect();
    }

    /// Whether every row is met but for `share` of its terms and for rounding: reflections leave each Cⱼδⱼ uncertain by a
    /// share of ‖C δ‖.
    fn met(&self, share: f64) -> bool {
        let spread = norm(&self.size.iter().zip(&self.lengths).map(|(x, length)| x * length).collect::<Vec<_>>());
        let rounding = |i: usize| NEAR * norm(&self.scaled[i]) * spread + f64::MIN_POSITIVE;
        self.conditions.met(&self.delta, share, rounding)
    }

    /// Everything inside the box, and what is held on its bound.
    fn clamp(&mut self) {
        for j in 0..self.delta.len() {
            let (lower, upper) = (self.conditions.lower[j], self.conditions.upper[j]);
            self.delta[j] = match self.active[j] {
                Bound::Lower => lower,
                Bound::Upper => upper,
                Bound::Free => self.delta[j].clamp(lower, upper),
            };
        }
    }

    fn run(mut self) -> Result<ConstrainedSolution, LinalgError> {
        let (n, m) = (self.delta.len(), self.working.len());
        let cap = 50 * (n + m + 1);
        // Let go, or taken back after being let go, since something last moved.
        let (mut freed, mut barred) = (vec![false; n + m], vec![false; n + m]);
        let (mut iterations, mut in_vain, mut drawn) = (0, 0, false);
        while iterations < cap {
            iterations += 1;
            let step = self.step()?;
            // a step that is rounding may point anywhere: it must not collect members
            let (alpha, blocking) = if self.is_rounding(&step) { (1.0, None) } else { self.first_block(&step, drawn) };
            let before = self.delta.clone();
            for (j, step_j) in step.iter().enumerate() {
                if self.active[j] == Bound::Free {
                    self.delta[j] += alpha * step_j;
                }
            }
            self.clamp();
            self.measure(&before);
            if self.has_moved(&before) {
                freed.fill(false);
                barred.fill(false);
                (in_vain, drawn) = (0, false);
            } else {
                in_vain += 1;
                if in_vain % (n + m + 1) == n + m {
                    self.lift()?;
                    drawn = true;
                    continue;
                }
            }
            if let Some(member) = blocking {
                let place = self.take(member);
                barred[place] = freed[place];
                continue;
            }
            // A minimiser over the working set: which member should go?
            let (nu, mu) = self.multipliers()?;
            let wrong = self.wrong(&nu, &mu);
            let goes = |k: usize, above: f64| wrong[k] > above && (k >= n || self.active[k] != Bound::Free);
            let heaviest = (0..n + m)
                .filter(|&k| !drawn && !barred[k] && goes(k, f64::EPSILON * (8 + n) as f64))
                .max_by(|&i, &k| wrong[i].total_cmp(&wrong[k]));
            let some: Vec<usize> = (0..n + m).filter(|&k| goes(k, SETTLED)).collect();
            let Some(place) = heaviest.or_else(|| self.any(&some)) else { break };
            drawn |= heaviest.is_none();
            freed[place] = true;
            if place < n {
                self.active[place] = Bound::Free;
            } else {
                self.working[place - n] = false;
            }
        }
        let (nu, mu) = self.multipliers()?;
        let violation = self.wrong(&nu, &mu).into_iter().fold(0.0, f64::max);
        let held = |j: usize| if self.active[j] == Bound::Free { 0.0 } else { nu[j] };
        Ok(ConstrainedSolution {
            bound_multipliers: (0..n).map(held).collect(),
            settled: violation <= SETTLED && self.met(BROKEN),
            delta: self.delta,
            active: self.active,
            rows: self.working,
            row_multipliers: mu,
            violation,
            iterations,
        })
    }

    /// Adds a member to the working set; its place among all.
    fn take(&mut self, member: Member) -> usize {
        match member {
            Member::Coordinate(j, bound) => {
                self.active[j] = bound;
                self.clamp();
                j
            }
            Member::Row(i) => {
                self.working[i] = true;
                self.delta.len() + i
            }
        }
    }

    /// Whether δ differs from `before` by more than rounding of A δ + d.
    fn has_moved(&self, before: &[f64]) -> bool {
        let rounding = f64::EPSILON * self.terms();
        (0..before.len()).any(|j| (self.delta[j] - before[j]).abs() * self.lengths[j] > rounding)
    }

    /// Whether a step changes neither A δ + d nor the working rows by more than rounding.
    fn is_rounding(&self, step: &[f64]) -> bool {
        let least = (8 + step.len()) as f64 * f64::EPSILON;
        let spread = norm(&self.delta.iter().zip(&self.lengths).map(|(x, length)| x * length).collect::<Vec<_>>());
        let unmet = |i: usize| {
            let row = &self.conditions.rows[i];
            let off = (row.right - dot(&row.coefficients, &self.delta)).abs();
            self.working[i] && off > least * (row.terms(&self.delta) + norm(&self.scaled[i]) * spread)
        };
        norm(&self.a.mul_vec(step)) <= least * self.terms() && !(0..self.working.len()).any(unmet)
    }

    /// ‖d‖ + Σₖ‖Aₖ‖|δₖ|: what A δ + d could add up to, before or after the last step.
    fn terms(&self) -> f64 {
        norm(self.d) + self.size.iter().zip(&self.lengths).map(|(x, length)| x * length).sum::<f64>()
    }

    /// A δ + d.
    fn residual(&self) -> Vec<f64> {
        let mut residual = self.a.mul_vec(&self.delta);
        add_scaled(&mut residual, 1.0, self.d);
        residual
    }

    /// How much each coordinate and each row breaks (3), as a share of what the terms could add up to.
    fn wrong(&self, nu: &[f64], mu: &[f64]) -> Vec<f64> {
        let terms = self.terms().max(f64::MIN_POSITIVE);
        let Conditions { lower, upper, rows } = self.conditions;
        let of_bound = |j: usize| match self.active[j] {
            Bound::Free => nu[j].abs(),
            _ if lower[j] == upper[j] => 0.0,
            Bound::Lower => (-nu[j]).max(0.0),
            Bound::Upper => nu[j].max(0.0),
        };
        let bounds = (0..nu.len()).map(|j| of_bound(j) / self.lengths[j] / terms);
        let of_row = |i: usize| if rows[i].equal { 0.0 } else { (-mu[i]).max(0.0) * norm(&self.scaled[i]) / terms };
        bounds.chain((0..mu.len()).map(of_row)).collect()
    }

    /// How far along `step` the conditions let us go, at most 1, and which one stops us: the nearest, or where `drawn` any of
    /// those that are as near but for rounding.
    fn first_block(&mut self, step: &[f64], drawn: bool) -> (f64, Option<Member>) {
        /// A part of a step that is rounding of its other parts.
        const ROUNDING: f64 = 1e-14;
        let Conditions { lower, upper, rows } = self.conditions;
        let length = norm(&step.iter().zip(&self.lengths).map(|(s, c)| s * c).collect::<Vec<_>>());
        let mut blocks = Vec::new();
        for (j, &step_j) in step.iter().enumerate() {
            if self.active[j] != Bound::Free || step_j.abs() * self.lengths[j] <= ROUNDING * length {
                continue;
            }
            let (bound, room) = match step_j < 0.0 {
                true => (Bound::Lower, lower[j] - self.delta[j]),
                false => (Bound::Upper, upper[j] - self.delta[j]),
            };
            blocks.push(((room / step_j).max(0.0), Member::Coordinate(j, bound)));
        }
        for (i, row) in rows.iter().enumerate() {
            let slope = dot(&row.coefficients, step);
            if !self.working[i] && slope > ROUNDING * norm(&self.scaled[i]) * length {
                let room = (row.right - dot(&row.coefficients, &self.delta)).max(0.0);
                blocks.push((room / slope, Member::Row(i)));
            }
        }
        blocks.retain(|(reach, _)| *reach < 1.0);
        let alpha = blocks.iter().fold(1.0, |least: f64, (reach, _)| least.min(*reach));
        let tie = if drawn { f64::EPSILON * self.terms() / length } else { 0.0 };
        blocks.retain(|(reach, _)| *reach <= alpha + tie);
        let members: Vec<Member> = blocks.into_iter().map(|(_, member)| member).collect();
        (alpha, if drawn { self.any(&members) } else { members.first().copied() })
    }

    /// One of several, by lot.
    fn any<T: Copy>(&mut self, several: &[T]) -> Option<T> {
        // Knuth's MMIX
        self.lot = self.lot.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let high = usize::try_from(self.lot >> 33).unwrap_or(0);
        several.get(high % several.len().max(1)).copied()
    }
}

#[cfg(test)]
mod tests;
