//! A problem of some rows, and of what is left of others.

use super::rows::InRows;
use super::state::Absorbed;
use crate::linalg::SquareRootInformation;
use crate::solve::{Constraint, LeastSquares};

/// Rows that are kept, rows that are absorbed, and what is minimised beside them.
pub(super) struct Window<'a, L: InRows> {
    pub(super) problem: &'a L,
    pub(super) kept: &'a [L::Row],
    /// by which the rank is judged
    pub(super) judged: &'a [L::Row],
    pub(super) absorbed: &'a Absorbed<L::Point>,
}

impl<L: InRows> LeastSquares for Window<'_, L> {
    type Point = L::Point;
    type Error = L::Error;

    fn dimension(&self) -> usize {
        self.problem.dimension()
    }

    fn cost(&self, q: &L::Point) -> Result<f64, L::Error> {
        let mut cost = self.problem.cost_of(self.kept, q)? + self.problem.prior(q)?.0;
        if self.absorbed.information.rows() > 0 {
            let (delta, _) = self.problem.between(&self.absorbed.point, q);
            cost += self.absorbed.cost_at(&delta);
        }
        Ok(cost)
    }

    fn linearise(&self, q: &L::Point) -> Result<SquareRootInformation, L::Error> {
        Ok(self.evaluate(q)?.1)
    }

    fn evaluate(&self, q: &L::Point) -> Result<(f64, SquareRootInformation), L::Error> {
        let (mut cost, mut information) = self.problem.linearise_rows(self.kept, q)?;
        let (of_prior, prior) = self.problem.prior(q)?;
        information.merge(&prior)?;
        cost += of_prior;
        if self.absorbed.information.rows() > 0 {
            let (delta, turn) = self.problem.between(&self.absorbed.point, q);
            cost += self.absorbed.cost_at(&delta);
            information.merge(&self.absorbed.information.recentred(&delta, turn.as_ref())?)?;
        }
        Ok((cost, information))
    }

    fn stopped(&self) -> bool {
        self.problem.stopped()
    }

    fn retract(&self, q: &L::Point, delta: &[f64]) -> L::Point {
        self.problem.retract(q, delta)
    }

    fn offset(&self, q: &L::Point) -> Vec<f64> {
        self.problem.offset(q)
    }

    fn scale(&self) -> &[f64] {
        self.problem.scale()
    }

    fn magnitude(&self, q: &L::Point) -> Vec<f64> {
        self.problem.magnitude(q)
    }

    fn bounds(&self, q: &L::Point) -> (Vec<f64>, Vec<f64>) {
        self.problem.bounds(q)
    }

    fn constraints(&self, q: &L::Point) -> Result<Vec<Constraint>, L::Error> {
        self.problem.constraints(q)
    }

    fn invisible(&self, q: &L::Point, at: &SquareRootInformation) -> Result<Vec<Vec<f64>>, L::Error> {
        self.problem.invisible_to(self.judged, true, q, at)
    }
}
