//! What a solution says once it has names and units again: uncertainties, what cannot be estimated, and a verdict.
//!
//! - Covariance from the square-root factor, C = (RᵀR)⁻¹, scaled by σ₀² where weights are `unit` (a posteriori), as it stands
//!   where they are real (a priori).
//! - Along an invisible direction nothing is known: C is that of the minimum-norm datum, and a parameter whose squared share
//!   of the tolerance-scaled null space exceeds [`NOT_ESTIMABLE`] has no sigma.
//! - On an active bound there is no sigma either, and the others are those of the problem with the bound as an equation.

mod covariance;
mod estimate;
mod file;
mod verdict;

pub use covariance::Covariance;
pub use estimate::{ChiSquared, Estimate, Fit, HeldValue, NOT_ESTIMABLE, analyse};
pub use file::{FitFile, read_values};
pub use verdict::Verdict;
