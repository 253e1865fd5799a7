//! Gauss–Newton whose step is a conic program.
//!
//! At each linearisation, with w = D δ and M = R D⁻¹,
//!
//! ```text
//! minimise ½‖M w + d‖²   subject to   min ≤ q ⊕ δ ≤ max,   gᵢ + ∇gᵢᵀδ = 0 or ≤ 0,   ‖w‖ ≤ Δ               (1)
//! ```
//!
//! is solved by Clarabel, whose point tells which conditions are active and how hard the trust region holds. An interior
//! point is never *on* a bound and knows w only as far as the cost does; the exact active-set solution of (1)
//! ([`constrained_least_squares`](crate::linalg::constrained_least_squares)) begins where Clarabel ended, and is the step.
//! A trial point is brought back onto the constraints by Newton's method before its true cost is looked at, so that a point
//! that is accepted meets nonlinear equations to rounding.
//!
//! Costs other than the sum of squares are [`Norm`]s; the steps for them are Clarabel's own.

mod answer;
mod norms;
pub(super) mod program;
mod restore;
mod sequential;
mod start;

pub use answer::{ConicStatus, ConicStep};
pub(super) use restore::{Restored, restore, rounding as rounding_of, rows as restore_rows};

use super::local::Method;
use super::minimise::search;
use super::{LeastSquares, Settings, Solution, Solver, StartError};

/// What is minimised over the whitened equations rᵢ. Priors (see [`Stacked`](super::Stacked)) stay ½p² beside it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Norm {
    /// ½ Σ rᵢ², or what [`LeastSquares::cost`] says.
    #[default]
    LeastSquares,
    /// Σ ½rᵢ² where |rᵢ| ≤ k, k|rᵢ| − ½k² beyond.
    Huber(f64),
    /// Σ |rᵢ|
    L1,
    /// max |rᵢ|
    Minimax,
}

impl Norm {
    /// In words.
    #[must_use]
    pub fn sentence(self) -> String {
        match self {
            Norm::LeastSquares => "half the sum of squares".into(),
            Norm::Huber(k) => format!("Huber's loss of each whitened equation, with k = {k}"),
            Norm::L1 => "the sum of absolute values of the whitened equations".into(),
            Norm::Minimax => "the largest absolute value among the whitened equations".into(),
        }
    }
}

/// The solver whose steps are conic programs. It is the only one that meets [constraints](LeastSquares::constraints).
///
/// With a [`Norm`] other than least squares it needs the [rows](LeastSquares::stacked). Clarabel's tolerance of 1e-10 is that
/// of the steps then, so expect eight to nine digits; [`Solution::cost`] is the norm; the search ends with
/// [`Status::Cost`](super::Status::Cost) when what a step could still gain is below 1e-10 of it. Directions that no equation
/// sees are left where they are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conic {
    /// When it ends.
    pub settings: Settings,
    /// What is minimised.
    pub norm: Norm,
}

impl<L: LeastSquares> Solver<L> for Conic {
    fn name(&self) -> &'static str {
        "clarabel"
    }

    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>> {
        self.settings.validate()?;
        let (start, projected) = start::admissible(problem, start)?;
        let mut solution = match self.norm {
            Norm::LeastSquares => search(problem, start, &self.settings, Method::Conic)?,
            norm => sequential::search(problem, start, &self.settings, norm)?,
        };
        solution.projected |= projected;
        Ok(solution)
    }
}
