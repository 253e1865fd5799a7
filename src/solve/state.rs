//! A point of the search with all that is known there.

use super::LeastSquares;
use super::region::{Linear, visible};
use crate::linalg::{Bound, Matrix, SquareRootInformation};

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
}

impl<P> State<P> {
    pub(super) fn new<L: LeastSquares<Point = P>>(
        problem: &L,
        point: P,
        cost: f64,
        information: SquareRootInformation,
        invisible: Vec<Vec<f64>>,
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
        Self { point, cost, information, invisible, visible, lower, upper, magnitude }
    }

    pub(super) fn linear(&self) -> Linear<'_> {
        Linear {
            visible: &self.visible,
            information: &self.information,
            invisible: self.invisible.len(),
            lower: &self.lower,
            upper: &self.upper,
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

    /// The largest |δⱼ|/mⱼ.
    pub(super) fn relative(&self, delta: &[f64]) -> f64 {
        delta
            .iter()
            .zip(&self.magnitude)
            .fold(0.0_f64, |largest, (delta, m)| if *delta == 0.0 { largest } else { largest.max(delta.abs() / m) })
    }
}
