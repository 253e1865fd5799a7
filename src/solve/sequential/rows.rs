//! What the sequential solver knows of a problem beside what all solvers know.

use crate::linalg::{Matrix, SquareRootInformation};
use crate::solve::{LeastSquares, null_space};

/// A problem whose residuals come in rows, each of which can be looked at alone.
pub trait InRows: LeastSquares {
    /// The name of a row.
    type Row: Copy + Ord + std::fmt::Debug;

    /// All rows that take part, in the order of their arrival.
    fn rows(&self) -> Vec<Self::Row>;

    /// What some rows add to the cost.
    ///
    /// # Errors
    /// Where a residual is undefined at q.
    fn cost_of(&self, rows: &[Self::Row], q: &Self::Point) -> Result<f64, Self::Error>;

    /// What some rows add to the cost, and QR(\[J r\]) of them, without priors.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined at q.
    fn linearise_rows(&self, rows: &[Self::Row], q: &Self::Point) -> Result<(f64, SquareRootInformation), Self::Error>;

    /// What is minimised beside the rows: its cost, and QR(\[J r\]) of it. By default nothing is.
    ///
    /// # Errors
    /// Where it is undefined at q.
    fn prior(&self, q: &Self::Point) -> Result<(f64, SquareRootInformation), Self::Error> {
        let _ = q;
        Ok((0.0, SquareRootInformation::new(self.dimension())))
    }

    /// `to` ⊖ `from` in tangent coordinates at `from`, and its derivative by ε in (`to` ⊕ ε) ⊖ `from`, where that is not one.
    fn between(&self, from: &Self::Point, to: &Self::Point) -> (Vec<f64>, Option<Matrix>);

    /// As [`invisible`](LeastSquares::invisible), judged by some rows, with what is minimised beside them or without. By default
    /// from the numerical rank of `at`.
    ///
    /// # Errors
    /// Where the rank cannot be judged at q.
    fn invisible_to(
        &self,
        rows: &[Self::Row],
        priors: bool,
        q: &Self::Point,
        at: &SquareRootInformation,
    ) -> Result<Vec<Vec<f64>>, Self::Error> {
        let _ = (rows, priors, q);
        Ok(null_space(at, self.scale())?.basis)
    }

    /// Lets a row count so many times; zero times is not at all.
    fn set_weight(&mut self, row: Self::Row, weight: f64);
}
