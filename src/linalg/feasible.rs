//! Whether linear conditions can be met together, and if not, which of them contradict each other.
//!
//! The point that breaks the conditions least, within the box, solves a least-squares problem in a box: with a slack
//! s ≥ 0 for each inequality and rows of length one,
//!
//! ```text
//! minimise Σ (aᵢᵀδ + sᵢ − bᵢ)²   subject to   lower ≤ δ ≤ upper,   sᵢ ≥ 0,   sᵢ = 0 for equations          (1)
//! ```
//!
//! If something remains, the multipliers of (1) are a certificate (Farkas): the conditions on which it rests contradict
//! each other already. Of these, each is left out in turn, and for good if the others still contradict each other (the
//! deletion filter of Chinneck & Dravnieks, ORSA Journal on Computing 3 (1991) 157). What is left is irreducible: without
//! any one of it the rest can be met.

use super::constrained::NEAR;
use super::{Bound, LinalgError, Matrix, Start, bounded_least_squares, dot, norm, same_size};

/// aᵀδ = b or aᵀδ ≤ b.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// a
    pub coefficients: Vec<f64>,
    /// b
    pub right: f64,
    /// Whether it is an equation.
    pub equal: bool,
}

impl Row {
    /// By how much δ breaks it: |aᵀδ − b| or max(aᵀδ − b, 0).
    #[must_use]
    pub fn violation(&self, delta: &[f64]) -> f64 {
        let over = dot(&self.coefficients, delta) - self.right;
        if self.equal { over.abs() } else { over.max(0.0) }
    }

    /// |b| + Σ|aⱼ||δⱼ|: what its terms could add up to.
    #[must_use]
    pub fn terms(&self, delta: &[f64]) -> f64 {
        self.right.abs() + self.coefficients.iter().zip(delta).map(|(a, x)| (a * x).abs()).sum::<f64>()
    }
}

/// A box and rows, all to be met.
#[derive(Debug, Clone, Copy)]
pub struct Conditions<'a> {
    /// Least δ, −∞ where there is none.
    pub lower: &'a [f64],
    /// Greatest δ, ∞ where there is none.
    pub upper: &'a [f64],
    /// Equations and inequalities.
    pub rows: &'a [Row],
}

/// One of the [`Conditions`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Condition {
    /// The lower bound of a coordinate.
    Lower(usize),
    /// The upper bound of a coordinate.
    Upper(usize),
    /// A row.
    Row(usize),
}

/// A row that is broken by more than this share of its terms is broken; less is what rounding leaves of (1).
pub(super) const BROKEN: f64 = 1e-9;

impl Conditions<'_> {
    /// `Ok` if everything fits n coordinates and is finite, and the box has an inside.
    pub(super) fn check(&self, n: usize) -> Result<(), LinalgError> {
        same_size(n, self.lower.len())?;
        same_size(n, self.upper.len())?;
        for row in self.rows {
            same_size(n, row.coefficients.len())?;
            if !row.right.is_finite() || row.coefficients.iter().any(|a| !a.is_finite()) {
                return Err(LinalgError::NotFinite);
            }
        }
        for (j, (&lower, &upper)) in self.lower.iter().zip(self.upper).enumerate() {
            // Written so that a NaN fails too.
            let sensible = lower <= upper && lower < f64::INFINITY && upper > f64::NEG_INFINITY;
            if !sensible {
                return Err(LinalgError::EmptyBox(j));
            }
        }
        Ok(())
    }

    /// Whether δ, within the box, meets every row but for `share` of the row's terms and for what is rounding in it.
    pub(super) fn met(&self, delta: &[f64], share: f64, rounding: impl Fn(usize) -> f64) -> bool {
        let near = |(i, row): (usize, &Row)| row.violation(delta) <= share * row.terms(delta) + rounding(i);
        self.rows.iter().enumerate().all(near)
    }

    /// Whether a δ that was found from `from` meets every row. Terms that cancel leave each coordinate uncertain by a
    /// share of all, in units in which the columns of the rows have length one.
    fn met_from(&self, delta: &[f64], from: &[f64]) -> bool {
        let mut columns = vec![0.0_f64; delta.len()];
        for row in self.rows {
            let length = norm(&row.coefficients);
            if length > 0.0 {
                columns.iter_mut().zip(&row.coefficients).for_each(|(c, a)| *c = c.hypot(a / length));
            }
        }
        let spread = |x: &[f64]| norm(&x.iter().zip(&columns).map(|(x, c)| x * c).collect::<Vec<_>>());
        let spread = spread(delta).max(spread(from));
        let scaled = |(a, c): (&f64, &f64)| if *c > 0.0 { a / c } else { 0.0 };
        let length = |i: usize| norm(&self.rows[i].coefficients.iter().zip(&columns).map(scaled).collect::<Vec<_>>());
        self.met(delta, BROKEN, |i| NEAR * length(i) * spread + f64::MIN_POSITIVE)
    }
}

/// A point near `from` that meets all conditions: inside the box, and on the rows but for rounding.
///
/// # Errors
/// [`LinalgError::Infeasible`] where there is none; where sizes differ, an entry is not finite or the box is empty.
pub fn feasible_point(conditions: &Conditions<'_>, from: &[f64]) -> Result<Vec<f64>, LinalgError> {
    conditions.check(from.len())?;
    let (first, _) = least_violation(conditions, from)?;
    if !conditions.met_from(&first, from) {
        return Err(LinalgError::Infeasible);
    }
    // again, so that nothing of a start far away is left in what is rounding
    let (second, _) = least_violation(conditions, &first)?;
    if conditions.met_from(&second, &first) { Ok(second) } else { Err(LinalgError::Infeasible) }
}

/// The solution of (1), and the conditions on which it rests.
fn least_violation(conditions: &Conditions<'_>, from: &[f64]) -> Result<(Vec<f64>, Vec<Condition>), LinalgError> {
    /// A part of the certificate that is rounding, as a share of its length.
    const NOTHING: f64 = 1e-9;
    let Conditions { lower, upper, rows } = *conditions;
    let (n, m) = (from.len(), rows.len());
    let mut a = Matrix::zeros(m, n + m);
    let mut d = vec![0.0; m];
    let (mut low, mut high) = (lower.to_vec(), upper.to_vec());
    let mut delta: Vec<f64> = (0..n).map(|j| from[j].clamp(lower[j], upper[j])).collect();
    let clamped = delta.clone();
    for (i, row) in rows.iter().enumerate() {
        let length = norm(&row.coefficients);
        let length = if length > 0.0 { length } else { 1.0 };
        for (j, entry) in row.coefficients.iter().enumerate() {
            a[(i, j)] = entry / length;
        }
        a[(i, n + i)] = 1.0;
        d[i] = -row.right / length;
        low.push(0.0);
        high.push(if row.equal { 0.0 } else { f64::INFINITY });
        let room = (row.right - dot(&row.coefficients, &clamped)) / length;
        delta.push(if row.equal { 0.0 } else { room.max(0.0) });
    }
    let start = Start { delta, active: vec![Bound::Free; n + m] };
    let mut found = bounded_least_squares(&a, &d, &low, &high, Some(&start))?;
    let mut left = a.mul_vec(&found.delta);
    left.iter_mut().zip(&d).for_each(|(left, d)| *left += d);
    let size = norm(&left);
    let mut rests_on: Vec<Condition> = (0..m).filter(|&i| left[i].abs() > NOTHING * size).map(Condition::Row).collect();
    for j in 0..n {
        if found.multipliers[j].abs() > NOTHING * size {
            rests_on.push(if found.multipliers[j] > 0.0 { Condition::Lower(j) } else { Condition::Upper(j) });
        }
    }
    found.delta.truncate(n);
    Ok((found.delta, rests_on))
}

/// An irreducible set of conditions that contradict each other; `None` if all can be met together.
///
/// # Errors
/// Where sizes differ or an entry is not finite. A lower bound above its upper bound is a conflict of the two.
pub fn conflict(conditions: &Conditions<'_>) -> Result<Option<Vec<Condition>>, LinalgError> {
    let n = conditions.lower.len();
    match conditions.check(n) {
        Err(LinalgError::EmptyBox(j)) => return Ok(Some(vec![Condition::Lower(j), Condition::Upper(j)])),
        other => other?,
    }
    let origin = vec![0.0; n];
    let (point, mut suspects) = least_violation(conditions, &origin)?;
    if conditions.met_from(&point, &origin) {
        return Ok(None);
    }
    if met_without(conditions, &suspects, None)? {
        // The certificate is rounding in part: begin with all.
        suspects = (0..conditions.rows.len()).map(Condition::Row).collect();
        suspects.extend((0..n).filter(|&j| conditions.lower[j].is_finite()).map(Condition::Lower));
        suspects.extend((0..n).filter(|&j| conditions.upper[j].is_finite()).map(Condition::Upper));
    }
    let mut k = 0;
    while k < suspects.len() {
        if met_without(conditions, &suspects, Some(k))? {
            k += 1;
        } else {
            suspects.remove(k);
        }
    }
    suspects.sort_unstable();
    Ok(Some(suspects))
}

/// Whether the conditions in `some` can be met together, the one at `left_out` set aside.
fn met_without(conditions: &Conditions<'_>, some: &[Condition], left_out: Option<usize>) -> Result<bool, LinalgError> {
    let n = conditions.lower.len();
    let (mut lower, mut upper) = (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
    let mut rows = Vec::new();
    for (k, condition) in some.iter().enumerate() {
        match *condition {
            _ if left_out == Some(k) => {}
            Condition::Lower(j) => lower[j] = conditions.lower[j],
            Condition::Upper(j) => upper[j] = conditions.upper[j],
            Condition::Row(i) => rows.push(conditions.rows[i].clone()),
        }
    }
    match feasible_point(&Conditions { lower: &lower, upper: &upper, rows: &rows }, &vec![0.0; n]) {
        Ok(_) => Ok(true),
        Err(LinalgError::Infeasible) => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests;
