//! One trial step, judged by the true cost.

use super::LeastSquares;
use super::conic::{Restored, restore, rounding_of};
use super::local::{Local, Method};
use super::minimise::Search;
use super::region::Step;
use super::solution::Iteration;
use super::state::State;

/// What a trial step led to.
pub(super) enum Trial<P> {
    Undefined,
    Rejected { actual: f64 },
    Accepted(Box<State<P>>, f64),
}

impl<L: LeastSquares> Search<'_, L> {
    pub(super) fn trial(
        &mut self,
        state: &State<L::Point>,
        local: &Local<'_>,
        step: &Step,
        radius: f64,
        likely: bool,
    ) -> Trial<L::Point> {
        let point = self.admitted(state, &step.delta, Some(step));
        let seen = point.as_ref().and_then(|point| self.look(point, likely));
        let (cost, information) = seen.map_or((None, None), |(cost, at)| (Some(cost), at));
        let gain = cost.filter(|_| step.predicted > 0.0).map(|cost| (state.cost - cost) / step.predicted);
        self.trace.push(Iteration {
            iteration: self.iteration,
            kind: self.kind,
            cost: state.cost,
            trial_cost: cost,
            rounding: state.cost_rounding(),
            predicted: step.predicted,
            gain,
            damping: step.damping,
            radius,
            step_norm: step.norm,
            gradient: local.cosine(),
            accepted: false,
            conic: step.conic.clone(),
        });
        let (Some(cost), Some(point)) = (cost, point) else {
            return Trial::Undefined;
        };
        let actual = state.cost - cost;
        let falls = gain.is_some_and(|gain| gain >= self.settings.gain) && actual > 0.0;
        // the conic search goes on by the gradient where Gauss–Newton steps overshoot, too
        let by_gradient = step.full || self.method == Method::Conic;
        let unresolved = by_gradient
            && step.predicted <= (UNRESOLVED * state.cost).max(state.noise())
            && actual >= -state.cost_rounding();
        if !falls && !unresolved {
            return Trial::Rejected { actual };
        }
        let next = match information {
            Some(information) => self.judged(point, cost, information),
            None => self.linearise(point, cost),
        };
        let Some(next) = next else {
            return Trial::Undefined;
        };
        if !falls {
            let diagonal = self.diagonal(&next);
            let smaller = self.local(&next, &diagonal).is_ok_and(|at| at.share() <= 0.9 * local.share());
            if !smaller {
                return Trial::Rejected { actual };
            }
        }
        if let Some(last) = self.trace.last_mut() {
            last.accepted = true;
        }
        // a gain that is rounding says nothing of the radius
        let gain = if falls || step.full { gain.unwrap_or(1.0) } else { 0.5 };
        Trial::Accepted(Box::new(next), gain)
    }

    /// q ⊕ δ, brought back onto the constraints; `None` where that fails. A step tells how much the constraints bend.
    pub(super) fn admitted(&mut self, state: &State<L::Point>, delta: &[f64], step: Option<&Step>) -> Option<L::Point> {
        let point = self.problem.retract(&state.point, delta);
        if self.method == Method::Damped || state.constraints.is_empty() {
            return Some(point);
        }
        let diagonal = self.diagonal(state);
        let Ok(Restored::Met(point, beside)) = restore(self.problem, point, &diagonal, false) else { return None };
        if let Some(step) = step {
            self.measure_curvature(state, step, &beside);
        }
        Some(point)
    }

    /// κ = 2 Σ μᵢ gᵢ / ‖w‖², from what the constraints that hold the step are beside it, where that is not rounding.
    fn measure_curvature(&mut self, state: &State<L::Point>, step: &Step, beside: &[super::Constraint]) {
        /// In units of rounding.
        const SHOWS: f64 = 1e3;
        let Some(conic) = &step.conic else { return };
        let (mut bend, mut shows) = (0.0, false);
        for &(what, mu) in &conic.active {
            if let super::Restriction::Constraint(i) = what {
                bend += 2.0 * mu * beside[i].value;
                shows |= beside[i].value.abs() > SHOWS * rounding_of(&beside[i], &state.magnitude);
            }
        }
        if shows && step.norm > 0.0 {
            self.curvature = (bend / (step.norm * step.norm)).max(0.0);
        }
    }
}

/// A predicted fall below this share of the cost may drown in the rounding of the cost. A Gauss–Newton step is then
/// judged by the gradient instead.
const UNRESOLVED: f64 = 1e-8;
