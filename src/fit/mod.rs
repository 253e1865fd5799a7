//! What a solution says once it has names and units again: uncertainties, what cannot be estimated, and a verdict.
//!
//! - Covariance from the square-root factor, C = (RᵀR)⁻¹, scaled by σ₀² where weights are `unit` (a posteriori), as it stands
//!   where they are real (a priori).
//! - Along an invisible direction nothing is known: C is that of the minimum-norm datum, and a parameter whose squared share
//!   of the tolerance-scaled null space exceeds [`NOT_ESTIMABLE`] has no sigma.
//! - Under a robust loss of rows it is the sandwich of the M-estimator, (JᵀJ)⁻¹ Σ w² s/(equations − rank) / (Σ h/rows)² with
//!   h = w + 2 s w'/m (Huber 1981, §7.6), so that what a rejected row would have told does not count.
//! - On an active bound there is no sigma either, and the others are those of the problem with the bound as an equation.

#![allow(
    clippy::indexing_slicing,
    reason = "parameters are numbered by the problem that was fitted; what a saved fit says is checked for its size when read"
)]

mod covariance;
mod document;
mod estimate;
mod file;
mod norm;
mod observations;
mod restraint;
mod starts;
mod uncertainty;
mod verdict;
mod warnings;
mod words;

pub use covariance::{Covariance, Held};
pub use document::{
    Chi, Correlations, DataFile, Direction, Document, Level, Parameter, Partner, Provenance, Step, Suspect, Tests,
    Warning,
};
pub use estimate::{
    ChiSquared, Confidence, Estimate, Fit, HeldValue, LackOfFit, MOST_TESTED, NOT_ESTIMABLE, Tested, analyse,
    analyse_with,
};
pub use file::{FitFile, read_values};
pub use observations::{ALPHA, Component, Group, INSEPARABLE, Observation, Observations, POWER, observations};
pub use restraint::Restraint;
pub use starts::{Continuation, Minimum, Starts};
pub use uncertainty::{JointUncertainty, Stated};
pub use verdict::Verdict;
pub use words::{Term, movement, sentence};
