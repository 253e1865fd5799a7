//! What a solver knows of a problem.

use super::constraint::Constraint;
use super::rank::null_space;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation};

/// All whitened equations of a linearisation, r(q ⊕ δ) ≈ J δ + r; priors come last.
#[derive(Debug, Clone, PartialEq)]
pub struct Stacked {
    /// J
    pub jacobian: Matrix,
    /// r
    pub residual: Vec<f64>,
    /// How many of the last rows are priors: they stay squares whatever the norm of the others.
    pub priors: usize,
}

/// A nonlinear least-squares problem as a solver sees it: minimise ½‖r(q)‖², where q lives on a manifold with n tangent
/// coordinates. `r` contains everything that is minimised, priors included.
///
/// Where a robust loss or an inner estimation makes [`cost`](Self::cost) something else than a plain sum of squares,
/// [`linearise`](Self::linearise) gives rows whose gradient Jᵀr is that of the cost; the two values need not agree.
pub trait LeastSquares {
    /// A value of all the parameters.
    type Point: Clone;
    /// Why the residuals are undefined at a point: the logarithm of a negative number, parallel lines of sight, …
    type Error: From<LinalgError>;

    /// n, the number of tangent coordinates that are free.
    fn dimension(&self) -> usize;

    /// The true cost at q.
    ///
    /// # Errors
    /// Where a residual is undefined at q.
    fn cost(&self, q: &Self::Point) -> Result<f64, Self::Error>;

    /// QR(\[J r\]) at q.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined at q.
    fn linearise(&self, q: &Self::Point) -> Result<SquareRootInformation, Self::Error>;

    /// Both at once, where that is cheaper than one after the other. By default it is one after the other.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined at q.
    fn evaluate(&self, q: &Self::Point) -> Result<(f64, SquareRootInformation), Self::Error> {
        Ok((self.cost(q)?, self.linearise(q)?))
    }

    /// q ⊕ δ. It must not leave the bounds by rounding: q + (upper − q) may exceed upper by a unit in the last place.
    fn retract(&self, q: &Self::Point, delta: &[f64]) -> Self::Point;

    /// q ⊖ nominal, in tangent coordinates.
    fn offset(&self, q: &Self::Point) -> Vec<f64>;

    /// The tolerance of each coordinate, what counts as known well enough; > 0.
    fn scale(&self) -> &[f64];

    /// The size of each coordinate's value at q, of which rounding is a share. By default |offset| + scale, which is right
    /// where the nominal value is zero or not large.
    fn magnitude(&self, q: &Self::Point) -> Vec<f64> {
        self.offset(q).iter().zip(self.scale()).map(|(offset, scale)| offset.abs() + scale).collect()
    }

    /// Lower and upper bounds of δ at q, infinite where there are none. By default there are none.
    fn bounds(&self, q: &Self::Point) -> (Vec<f64>, Vec<f64>) {
        let _ = q;
        (vec![f64::NEG_INFINITY; self.dimension()], vec![f64::INFINITY; self.dimension()])
    }

    /// Whether the search shall end where it is; asked at every iteration. By default it never shall.
    fn stopped(&self) -> bool {
        false
    }

    /// Conditions beside the bounds, linearised at q; always the same ones in the same order. By default there are none.
    ///
    /// # Errors
    /// Where one is undefined at q.
    fn constraints(&self, q: &Self::Point) -> Result<Vec<Constraint>, Self::Error> {
        let _ = q;
        Ok(Vec::new())
    }

    /// The equations one by one, for solvers that minimise something else than squares. By default they are not told.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined at q.
    fn stacked(&self, q: &Self::Point) -> Result<Option<Stacked>, Self::Error> {
        let _ = q;
        Ok(None)
    }

    /// An orthonormal basis, in tolerance-scaled coordinates z = δ/scale, of the directions that no residual sees at q,
    /// where `at` is the linearisation. By default from the numerical rank of `at`; a problem with noisy inputs judges it
    /// at inputs that are consistent with q.
    ///
    /// # Errors
    /// Where the rank cannot be judged at q.
    fn invisible(&self, q: &Self::Point, at: &SquareRootInformation) -> Result<Vec<Vec<f64>>, Self::Error> {
        let _ = q;
        Ok(null_space(at, self.scale())?.basis)
    }
}
