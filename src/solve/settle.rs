//! Steps along what is invisible, each judged together with its corrections.

use super::LeastSquares;
use super::datum::{along, datum_step};
use super::minimise::Search;
use super::solution::{Datum, Iteration, Kind, Status};
use super::state::State;
use crate::linalg::{dot, norm, svd};

/// A rise of the cost, as a share, that one datum step may bring.
const LEVEL: f64 = 0.01;

/// A way along what is invisible, in tolerances, that is short enough where no step shortens it.
const SHORT: f64 = 1e-6;

enum DatumTrial<P> {
    /// The invisible directions are visible beside the point.
    Isolated,
    /// Not taken; try one shorter by this factor.
    Failed {
        factor: f64,
    },
    OutOfTrials,
    Taken(Box<State<P>>, Status),
}

impl<L: LeastSquares> Search<'_, L> {
    /// Datum steps until the point nearest to the nominal values is reached.
    pub(super) fn settle(&mut self, state: &mut State<L::Point>, status: &mut Status) -> Datum {
        if state.invisible.is_empty() {
            return Datum::NotNeeded;
        }
        let scale = self.problem.scale();
        // β, and the longest step allowed.
        let (mut beta, mut longest) = (1.0, f64::INFINITY);
        loop {
            let z = self.offset(&state.point);
            let h = along(&state.invisible, &z);
            let enough = self.settings.datum + 4.0 * f64::EPSILON * norm(&z);
            let way = beta * norm(&h);
            if norm(&h) <= enough {
                return Datum::Nearest;
            }
            if longest <= 0.05 * enough * beta.min(1.0) {
                // what no step makes shorter is rounding, where it is short
                let rounding = norm(&h) <= (self.uncertainty(state) * norm(&z)).max(SHORT);
                return if rounding { Datum::Nearest } else { Datum::Unsettled };
            }
            let factor = -beta * (longest / way).min(1.0);
            let target: Vec<f64> = h.iter().map(|h| factor * h).collect();
            let diagonal = self.diagonal(state);
            let Ok(delta) = datum_step(&state.linear(), &state.invisible, scale, &diagonal, &target) else {
                *status = Status::Breakdown;
                return Datum::Unsettled;
            };
            let length = norm(&self.scaled(&delta));
            // Bounds leave no way worth going: this step puts the point onto them.
            let last = length <= 0.1 * enough * beta.min(1.0) && longest > length;
            if length == 0.0 {
                return Datum::Nearest;
            }
            if self.problem.stopped() {
                *status = Status::Interrupted;
                return Datum::Unsettled;
            }
            if self.trace.len() >= self.settings.max_trials {
                *status = Status::MaxTrials;
                return Datum::Unsettled;
            }
            match self.datum_trial(state, &delta, longest, last) {
                DatumTrial::Isolated => return Datum::Isolated,
                DatumTrial::Failed { .. } if last => return Datum::Nearest,
                DatumTrial::Failed { factor } => longest = factor * length.min(longest),
                DatumTrial::OutOfTrials => {
                    *status = Status::MaxTrials;
                    return Datum::Unsettled;
                }
                DatumTrial::Taken(next, next_status) => {
                    // Barzilai–Borwein: β = sᵀs / sᵀy, the secant in one dimension, for the gradient h of ½‖z‖².
                    let next_z = self.offset(&next.point);
                    let next_h = along(&next.invisible, &next_z);
                    let s: Vec<f64> = next_z.iter().zip(&z).map(|(a, b)| a - b).collect();
                    let y: Vec<f64> = next_h.iter().zip(&h).map(|(a, b)| a - b).collect();
                    let curvature = dot(&s, &y) / dot(&s, &s);
                    beta = if curvature > 0.0 { (1.0 / curvature).clamp(1e-8, 10.0) } else { (2.0 * beta).min(10.0) };
                    longest *= 4.0;
                    *state = *next;
                    *status = next_status;
                    if last {
                        return Datum::Nearest;
                    }
                }
            }
        }
    }

    /// To which share rounding leaves the directions N uncertain: ε κ, with κ the condition of what is visible, in tolerances.
    /// A way along N that is shorter than this share of z is rounding.
    fn uncertainty(&self, state: &State<L::Point>) -> f64 {
        const ROOM: f64 = 10.0;
        let Ok(found) = svd(&state.visible.scale_columns(self.problem.scale())) else { return 0.0 };
        let kept = found.sigma.len() - state.invisible.len();
        match (found.sigma.first(), found.sigma[..kept].last()) {
            (Some(largest), Some(least)) if *least > 0.0 => ROOM * f64::EPSILON * largest / least,
            _ => 0.0,
        }
    }

    /// z = (q ⊖ nominal)/scale.
    fn offset(&self, point: &L::Point) -> Vec<f64> {
        self.scaled(&self.problem.offset(point))
    }

    /// S⁻¹ δ: tangent coordinates in tolerances.
    fn scaled(&self, delta: &[f64]) -> Vec<f64> {
        delta.iter().zip(self.problem.scale()).map(|(delta, scale)| delta / scale).collect()
    }

    /// One datum step and the corrections after it, judged together.
    fn datum_trial(&mut self, state: &State<L::Point>, delta: &[f64], radius: f64, last: bool) -> DatumTrial<L::Point> {
        let point = self.admitted(state, delta, None);
        let cost = point.as_ref().and_then(|point| self.cost(point));
        let predicted = state.information.cost() - state.information.cost_at(delta);
        let record = self.trace.len();
        self.iteration += 1;
        self.trace.push(Iteration {
            iteration: self.iteration,
            kind: Kind::Datum,
            cost: state.cost,
            trial_cost: cost,
            rounding: state.cost_rounding(),
            predicted,
            gain: None,
            damping: 0.0,
            radius,
            step_norm: norm(&self.scaled(delta)),
            gradient: 0.0,
            accepted: true,
            conic: None,
        });
        let outcome = 'judged: {
            let Some(next) = cost.zip(point).and_then(|(cost, point)| self.linearise(point, cost)) else {
                break 'judged DatumTrial::Failed { factor: 0.25 };
            };
            if next.invisible.len() < state.invisible.len() {
                break 'judged DatumTrial::Isolated;
            }
            // The way back to the family grows with the square of the datum step; it must stay the shorter of the two.
            let diagonal = self.diagonal(&next);
            let Ok(local) = self.local(&next, &diagonal) else {
                break 'judged DatumTrial::Failed { factor: 0.25 };
            };
            let back = norm(&self.scaled(&local.full().delta));
            let out = norm(&self.scaled(delta));
            if back > 0.5 * out && local.residual() > next.rounding() {
                break 'judged DatumTrial::Failed { factor: (0.4 * out / back).clamp(0.02, 0.5) };
            }
            self.kind = Kind::Correction;
            let (next, status) = self.descend(next);
            self.kind = Kind::Step;
            if status == Status::MaxTrials {
                break 'judged DatumTrial::OutOfTrials;
            }
            let next_z = self.offset(&next.point);
            let next_h = along(&next.invisible, &next_z);
            let z = self.offset(&state.point);
            let h = along(&state.invisible, &z);
            let (before, after) = (norm(&z), norm(&next_z));
            let nearer = after < before * (1.0 - 1e-12)
                || (after <= before * (1.0 + 1e-12) && (last || norm(&next_h) <= 0.9 * norm(&h)));
            // Noise in the inputs lets a true family slope: by what R shows of it, to first order, is allowed for.
            let rounding = next.rounding().max(state.rounding());
            let allowed = state.cost * (1.0 + LEVEL) + 2.0 * (-predicted).max(0.0) + 0.5 * rounding * rounding;
            if status.converged() && nearer && next.cost <= allowed {
                DatumTrial::Taken(Box::new(next), status)
            } else {
                DatumTrial::Failed { factor: 0.25 }
            }
        };
        if !matches!(outcome, DatumTrial::Taken(..)) {
            for iteration in &mut self.trace[record..] {
                iteration.accepted = false;
            }
        }
        outcome
    }
}
