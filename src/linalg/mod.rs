//! Small dense linear algebra: what a least-squares fit of a few dozen parameters needs, and no more.
//!
//! The unit of exchange is the [`SquareRootInformation`]: the triangular factor R, the vector d and the remaining sum of
//! squares of QR(\[J r\]), so that for every δ
//!
//! ```text
//! ‖J δ + r‖² = ‖R δ + d‖² + rest          (1)
//! ```
//!
//! Rows stream into it in blocks of any size; two of them merge into one. Everything else works on R, which has as many
//! rows as there are parameters: [`svd()`], [`solve_upper`], [`bounded_least_squares`], the exact solution of (1) within
//! a box, and [`constrained_least_squares`], that under linear equations and inequalities besides.
//!
//! No type of another crate appears in a signature here, and nothing that is not finite gets in.

#![allow(
    clippy::indexing_slicing,
    reason = "rows and columns run over the dimensions of the matrices at hand, which every constructor has checked against its parts"
)]

mod bounded;
mod cholesky;
mod constrained;
mod feasible;
mod information;
mod matrix;
mod reflect;
mod sparse;
mod svd;
mod triangular;

pub use bounded::{Bound, BoundedSolution, Start, bounded_least_squares};
pub use cholesky::cholesky;
pub use constrained::{ConstrainedSolution, ConstrainedStart, constrained_least_squares};
pub use feasible::{Condition, Conditions, Row, conflict, feasible_point};
pub use information::SquareRootInformation;
pub use matrix::{Matrix, dot, norm, orthonormalise};
pub use sparse::{choices, each_choice, separate, sparsest};
pub use svd::{Svd, svd};
pub use triangular::{reciprocal_condition, solve_upper, solve_upper_transposed};

/// Why a matrix was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LinalgError {
    /// An entry is NaN, infinite, or so large that its square is.
    #[error("a matrix or vector has an entry that is not finite, or too large to be squared")]
    NotFinite,
    /// Sizes do not fit together.
    #[error("expected a size of {expected}, found {found}")]
    Shape {
        /// The size that would have fitted.
        expected: usize,
        /// The size that came.
        found: usize,
    },
    /// A diagonal entry of a triangular matrix is zero.
    #[error("the triangular matrix is singular: diagonal entry {0} is zero")]
    Singular(usize),
    /// The singular values did not settle.
    #[error("the singular value decomposition did not converge")]
    NoConvergence,
    /// A lower bound exceeds its upper bound, or one of them is NaN.
    #[error("bounds of coordinate {0} leave nothing between them")]
    EmptyBox(usize),
    /// No point meets all conditions.
    #[error("the conditions contradict each other")]
    Infeasible,
    /// Rows to be taken out were not absorbed.
    #[error("rows that were never absorbed cannot be taken out")]
    NotAbsorbed,
}

/// `Ok` if `found` is `expected`.
pub(crate) fn same_size(expected: usize, found: usize) -> Result<(), LinalgError> {
    if expected == found { Ok(()) } else { Err(LinalgError::Shape { expected, found }) }
}
