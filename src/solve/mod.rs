//! Nonlinear least squares: minimise ½‖r(q)‖² for q on a manifold, and end where the tolerances say.
//!
//! A solver knows a problem by the trait [`LeastSquares`]: its true cost, its linearisation as a
//! [`SquareRootInformation`](crate::linalg::SquareRootInformation), and the geometry of its points. [`minimise()`] is
//! Levenberg–Marquardt in trust-region form (Moré 1978):
//!
//! 1. Linearise: r(q ⊕ δ) ≈ R δ + d.
//! 2. Choose δ to minimise ‖R δ + d‖ with ‖D δ‖ ≤ Δ and within bounds; D holds the longest column norms so far.
//! 3. Evaluate the **true** cost at q ⊕ δ. It must fall by a share of what was predicted; otherwise, or where it is
//!    undefined, shrink Δ and go to 2. Every trial is in the trace.
//! 4. Take the step, adapt Δ, go to 1.
//!
//! # When it ends
//!
//! [`Status`] names the test. A search that stands still has not converged by that alone: a rejected step ends it well
//! only where the gradient is at the level of rounding, where a full Gauss–Newton step is shorter than rounding of the
//! parameters, or where ‖r‖ is what rounding of the parameters leaves of it. Near the minimum the cost can no longer tell a
//! good step from a bad one (it is flat to the second order, so it knows q to half its digits); a full Gauss–Newton step
//! whose predicted fall is below 1e-8 of the cost is therefore also taken where it halves the gradient and the cost does
//! not rise by more than rounding. These are the last steps, and they give the other half of the digits.
//!
//! # Constraints
//!
//! Levenberg–Marquardt keeps bounds. Equations and inequalities between parameters need [`Conic`], whose steps are conic
//! programs and which shares all else with it.
//!
//! # Invisible directions
//!
//! Where no residual sees some direction, the minimum is a family of equally good points. Of these the solution is the one
//! nearest to the nominal values, in units of the tolerances, so that different solvers and different starts agree. With N
//! an orthonormal basis of the invisible directions and z = (q ⊖ nominal)/scale:
//!
//! - What R sees of N, which is noise, is projected out; steps are those of the complement, until they converge.
//! - A *datum step* −β N Nᵀ z goes towards the nominal values. The family may be curved, so the step leaves it a little,
//!   and the cost rises; steps in the complement (*corrections*) lead back. The datum step and its corrections are judged
//!   together: the distance to the nominal values must have fallen, and the cost must be what it was, but for rounding and
//!   for what noise in the inputs tilts the family by. N is judged anew at each linearisation.
//! - This is repeated, with β from the curvature that the last step showed, until Nᵀ z is zero or bounds are in the way.
//!
//! A Jacobian that is singular at one point only (x² at 0) has invisible directions there and none beside it. It has no
//! family, and no datum step is made ([`Datum::Isolated`]).

#![allow(
    clippy::indexing_slicing,
    reason = "vectors are as long as the information matrix has columns, which each entry has made sure of"
)]

mod conic;
mod constraint;
mod datum;
mod finish;
mod local;
mod minimise;
mod multipliers;
mod problem;
mod rank;
mod region;
mod sequential;
mod settings;
mod settle;
mod solution;
mod solver;
mod state;
mod trial;

pub use conic::{Conic, ConicStatus, ConicStep, Norm};
pub use constraint::{Constraint, Relation, Restriction};
pub use minimise::{StartError, minimise};
pub use problem::{LeastSquares, Stacked};
pub use rank::{NullSpace, RANK, null_space};
pub use sequential::{Absorbed, InRows, Keep, Sequential, SequentialError, State as SequentialState};
pub use settings::{Settings, SettingsError};
pub use solution::{ConstraintState, Datum, Evaluations, Iteration, Kind, Solution, Status};
pub use solver::{LevenbergMarquardt, Solver, Suited};

#[cfg(test)]
mod tests;
