//! A point of the search with all that is known there.

use super::conic::{restore_rows, rounding_of};
use super::region::{Linear, visible};
use super::{Constraint, LeastSquares};
use crate::linalg::{Bound, LinalgError, Matrix, Row, SquareRootInformation, norm, svd};

/// A point with all that is known there.
#[derive(Clone)]
pub(super) struct State<P> {
    pub(super) point: P,
    pub(super) cost: f64,
    pub(super) information: SquareRootInformation,
    pub(super) invisible: Vec<Vec<f64>>,
    pub(super) visible: Matrix,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    pub(super) magnitude: Vec<f64>,
    pub(super) constraints: Vec<Constraint>,
    /// The constraints as conditions on δ.
    pub(super) rows: Vec<Row>,
}

impl<P> State<P> {
    pub(super) fn new<L: LeastSquares<Point = P>>(
        problem: &L,
        point: P,
        cost: f64,
        information: SquareRootInformation,
        invisible: Vec<Vec<f64>>,
        constraints: Vec<Constraint>,
    ) -> Self {
        /// Nearer to a bound than this share of the coordinate's magnitude is on it.
        const ON_BOUND: f64 = 4.0 * f64::EPSILON;
        let (mut lower, mut upper) = problem.bounds(&point);
        let magnitude = problem.magnitude(&point);
        for j in 0..magnitude.len() {
            let near = ON_BOUND * magnitude[j];
            lower[j] = if lower[j] > -near { 0.0 } else { lower[j] };
            upper[j] = if upper[j] < near { 0.0 } else { upper[j] };
        }
        let visible = visible(&information, &invisible, problem.scale());
        let rows = restore_rows(&constraints, &magnitude);
        Self { point, cost, information, invisible, visible, lower, upper, magnitude, constraints, rows }
    }

    pub(super) fn linear(&self) -> Linear<'_> {
        Linear {
            visible: &self.visible,
            information: &self.information,
            invisible: self.invisible.len(),
            lower: &self.lower,
            upper: &self.upper,
            rows: &self.rows,
        }
    }

    pub(super) fn on_bound(&self, j: usize) -> Bound {
        match (self.lower[j] == 0.0, self.upper[j] == 0.0) {
            (true, _) => Bound::Lower,
            (_, true) => Bound::Upper,
            _ => Bound::Free,
        }
    }

    /// What rounding of the parameters alone leaves of ‖r‖: ε Σ ‖Jⱼ‖ mⱼ, with some room for what the residuals add.
    pub(super) fn rounding(&self) -> f64 {
        const ROOM: f64 = 100.0;
        let sum =
            self.information.r().column_norms().iter().zip(&self.magnitude).map(|(norm, m)| norm * m).sum::<f64>();
        ROOM * f64::EPSILON * sum
    }

    /// How well the cost ½‖r‖² is known where residuals are differences of what is as large as the parameters:
    /// ‖r‖ ε √Σ (‖Jⱼ‖ mⱼ)². Readings of a few micrometres over some metres leave more than a share of the cost tells.
    pub(super) fn noise(&self) -> f64 {
        let terms = self.information.r().column_norms();
        let square: f64 = terms.iter().zip(&self.magnitude).map(|(norm, m)| (norm * m).powi(2)).sum();
        (2.0 * self.cost.max(0.0)).sqrt() * f64::EPSILON * square.sqrt()
    }

    /// A rise of the cost that counts as rounding when a step is judged by the gradient.
    pub(super) fn cost_rounding(&self) -> f64 {
        /// As a share of the cost, of a sum of squares of differences of large numbers.
        const INVISIBLE_RISE: f64 = 1e-11;
        (INVISIBLE_RISE * self.cost).max(self.noise())
    }

    /// The largest |δⱼ|/mⱼ.
    pub(super) fn relative(&self, delta: &[f64]) -> f64 {
        delta
            .iter()
            .zip(&self.magnitude)
            .fold(0.0_f64, |largest, (delta, m)| if *delta == 0.0 { largest } else { largest.max(delta.abs() / m) })
    }

    /// Whether each constraint holds the point: an equation, or an inequality that is met by rounding.
    pub(super) fn held(&self) -> Vec<bool> {
        /// Nearer to zero than this many units of its rounding is at zero.
        const NEAR: f64 = 1000.0;
        let at_zero = |(constraint, row): (&Constraint, &Row)| {
            row.equal || constraint.value >= -NEAR * rounding_of(constraint, &self.magnitude)
        };
        self.constraints.iter().zip(&self.rows).map(at_zero).collect()
    }
}

/// The combinations of invisible directions along which no equation changes, in the same coordinates z = δ/scale.
pub(super) fn tangent(
    invisible: Vec<Vec<f64>>,
    constraints: &[Constraint],
    scale: &[f64],
) -> Result<Vec<Vec<f64>>, LinalgError> {
    /// A share of an equation's gradient that is rounding.
    const UNSEEN: f64 = 1e-9;
    let equations: Vec<Vec<f64>> = constraints
        .iter()
        .filter(|constraint| constraint.relation == super::Relation::Equal)
        .filter_map(|constraint| {
            let row: Vec<f64> = constraint.gradient.iter().zip(scale).map(|(a, scale)| a * scale).collect();
            let length = norm(&row);
            (length > 0.0).then(|| row.iter().map(|entry| entry / length).collect())
        })
        .collect();
    if invisible.is_empty() || equations.is_empty() {
        return Ok(invisible);
    }
    let changes = Matrix::from_rows(scale.len(), &equations);
    let columns: Vec<Vec<f64>> = invisible.iter().map(|z| changes.mul_vec(z)).collect();
    let found = svd(&Matrix::from_columns(equations.len(), &columns))?;
    let combine = |k: usize| {
        let mut z = vec![0.0; scale.len()];
        for (share, direction) in found.v.column(k).iter().zip(&invisible) {
            z.iter_mut().zip(direction).for_each(|(z, entry)| *z += share * entry);
        }
        z
    };
    Ok((0..invisible.len()).filter(|&k| found.sigma[k] <= UNSEEN).map(combine).collect())
}
