//! The conic solver: where nothing holds it must agree with Levenberg–Marquardt, and what holds it must hold.

mod agreement;
mod bounded;
mod constrained;
mod norms;

use super::super::{Restriction, Solution};

/// Every trial of a conic search has its program in the trace.
pub(super) fn told(solution: &Solution<Vec<f64>>) -> bool {
    let mut trials = solution.trace.iter().filter(|trial| trial.kind != super::super::Kind::Datum);
    trials.all(|trial| trial.conic.is_some())
}

/// The multiplier of one of the conditions that held the last accepted step.
pub(super) fn last_multiplier(solution: &Solution<Vec<f64>>, what: Restriction) -> Option<f64> {
    let mut accepted = solution.trace.iter().filter(|trial| trial.accepted);
    let conic = accepted.next_back()?.conic.as_ref()?;
    conic.active.iter().find(|(other, _)| *other == what).map(|(_, multiplier)| *multiplier)
}
