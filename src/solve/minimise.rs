//! The search itself: Levenberg–Marquardt steps until the cost cannot fall, then steps along what is invisible.

use super::region::{Region, Step};
use super::solution::{Datum, Evaluations, Iteration, Kind, Solution, Status};
use super::state::State;
use super::{LeastSquares, Settings, SettingsError};
use crate::linalg::{SquareRootInformation, norm};

/// Why a search could not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartError<E> {
    /// A setting makes no sense.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The problem contradicts itself: sizes, scales or bounds.
    #[error("the problem's {0} do not fit its parameters")]
    Problem(&'static str),
    /// The residuals are undefined at the start.
    #[error("the residuals are undefined at the start")]
    Undefined(E),
    /// The cost at the start is infinite or not a number.
    #[error("the cost at the start is not finite")]
    NotFinite,
}

/// Minimises ½‖r(q)‖² from `start`. See the [module](super) for how, and for what "converged" means.
///
/// # Errors
/// Only where the search cannot start. Whatever happens later is told by [`Solution::status`].
pub fn minimise<L: LeastSquares>(
    problem: &L,
    start: L::Point,
    settings: &Settings,
) -> Result<Solution<L::Point>, StartError<L::Error>> {
    settings.validate()?;
    let mut search = Search::new(problem, settings)?;
    let (start, projected) = search.moved_into_bounds(start)?;
    let (cost, information) = problem.evaluate(&start).map_err(|error| match problem.cost(&start) {
        Ok(cost) if !cost.is_finite() => StartError::NotFinite,
        _ => StartError::Undefined(error),
    })?;
    if !cost.is_finite() {
        return Err(StartError::NotFinite);
    }
    if information.dimension() != problem.dimension() {
        return Err(StartError::Problem("linearisation"));
    }
    let invisible = problem.invisible(&start, &information).map_err(StartError::Undefined)?;
    search.evaluations = Evaluations { costs: 1, linearisations: 1, ranks: 1 };
    search.restricted = !invisible.is_empty();
    search.start_residual = (2.0 * information.cost()).sqrt();
    let state = search.state(start, cost, information, invisible);
    let (state, status, datum) = search.run(state);
    let active = (0..problem.dimension()).map(|j| state.on_bound(j)).collect();
    Ok(Solution {
        point: state.point,
        status,
        cost: state.cost,
        iterations: search.iteration,
        trace: search.trace,
        information: state.information,
        invisible: state.invisible,
        datum,
        active,
        projected,
        evaluations: search.evaluations,
    })
}

/// What a trial step led to.
enum Trial<P> {
    Undefined,
    Rejected { actual: f64 },
    Accepted(Box<State<P>>, f64),
}

pub(super) struct Search<'a, L: LeastSquares> {
    pub(super) problem: &'a L,
    pub(super) settings: &'a Settings,
    pub(super) trace: Vec<Iteration>,
    pub(super) evaluations: Evaluations,
    pub(super) iteration: usize,
    /// Whether invisible directions are being kept out of the steps.
    pub(super) restricted: bool,
    /// Largest ‖Jⱼ‖ so far; Moré 1978, §6: D must not decrease.
    pub(super) longest: Vec<f64>,
    pub(super) start_residual: f64,
    pub(super) kind: Kind,
}

impl<'a, L: LeastSquares> Search<'a, L> {
    fn new(problem: &'a L, settings: &'a Settings) -> Result<Self, StartError<L::Error>> {
        let n = problem.dimension();
        let scale = problem.scale();
        if scale.len() != n || scale.iter().any(|&scale| !(scale > 0.0 && scale.is_finite())) {
            return Err(StartError::Problem("tolerances"));
        }
        Ok(Self {
            problem,
            settings,
            trace: vec![],
            evaluations: Evaluations::default(),
            iteration: 0,
            restricted: false,
            longest: vec![0.0; n],
            start_residual: 0.0,
            kind: Kind::Step,
        })
    }

    /// The start, moved onto its bounds if it is outside.
    fn moved_into_bounds(&self, start: L::Point) -> Result<(L::Point, bool), StartError<L::Error>> {
        let n = self.problem.dimension();
        let (lower, upper) = self.problem.bounds(&start);
        let sensible = lower.len() == n
            && upper.len() == n
            && lower.iter().zip(&upper).all(|(&l, &u)| l <= u && l < f64::INFINITY && u > f64::NEG_INFINITY);
        if !sensible {
            return Err(StartError::Problem("bounds"));
        }
        let delta: Vec<f64> = lower.iter().zip(&upper).map(|(&lower, &upper)| 0.0_f64.clamp(lower, upper)).collect();
        if delta.iter().all(|&delta| delta == 0.0) {
            return Ok((start, false));
        }
        Ok((self.problem.retract(&start, &delta), true))
    }

    fn state(
        &self,
        point: L::Point,
        cost: f64,
        information: SquareRootInformation,
        invisible: Vec<Vec<f64>>,
    ) -> State<L::Point> {
        State::new(self.problem, point, cost, information, invisible)
    }

    /// Linearises at a point of known cost; `None` where something is undefined there.
    pub(super) fn linearise(&mut self, point: L::Point, cost: f64) -> Option<State<L::Point>> {
        self.evaluations.linearisations += 1;
        let information = self.problem.linearise(&point).ok()?;
        self.judged(point, cost, information)
    }

    /// A point with its linearisation, and with what is invisible there where that is kept out of the steps.
    fn judged(&mut self, point: L::Point, cost: f64, information: SquareRootInformation) -> Option<State<L::Point>> {
        let mut invisible = vec![];
        if self.restricted {
            self.evaluations.ranks += 1;
            invisible = self.problem.invisible(&point, &information).ok()?;
        }
        Some(self.state(point, cost, information, invisible))
    }

    /// The true cost, and with it the linearisation where the step is likely to be taken; `None` where it is undefined.
    fn look(&mut self, point: &L::Point, likely: bool) -> Option<(f64, Option<SquareRootInformation>)> {
        if !likely {
            return self.cost(point).map(|cost| (cost, None));
        }
        self.evaluations.costs += 1;
        self.evaluations.linearisations += 1;
        let (cost, information) = self.problem.evaluate(point).ok().filter(|(cost, _)| cost.is_finite())?;
        Some((cost, Some(information)))
    }

    /// The true cost; `None` where it is undefined.
    pub(super) fn cost(&mut self, point: &L::Point) -> Option<f64> {
        self.evaluations.costs += 1;
        self.problem.cost(point).ok().filter(|cost| cost.is_finite())
    }

    /// D at a linearisation: longest ‖Jⱼ‖ so far; 1/tolerance where the column has always been zero.
    pub(super) fn diagonal(&mut self, state: &State<L::Point>) -> Vec<f64> {
        for (longest, norm) in self.longest.iter_mut().zip(state.information.r().column_norms()) {
            *longest = longest.max(norm);
        }
        let pick = |(&longest, &scale): (&f64, &f64)| if longest > 0.0 { longest } else { 1.0 / scale };
        self.longest.iter().zip(self.problem.scale()).map(pick).collect()
    }

    fn run(&mut self, start: State<L::Point>) -> (State<L::Point>, Status, Datum) {
        let (mut state, mut status) = self.descend(start);
        if !self.restricted {
            self.evaluations.ranks += 1;
            let invisible = self.problem.invisible(&state.point, &state.information).unwrap_or_default();
            if invisible.is_empty() {
                return (state, status, Datum::NotNeeded);
            }
            self.restricted = true;
            state = self.state(state.point, state.cost, state.information, invisible);
        }
        if !status.converged() {
            return (state, status, Datum::Unsettled);
        }
        let datum = self.settle(&mut state, &mut status);
        if datum == Datum::Unsettled && status.converged() {
            status = Status::Stalled;
        }
        (state, status, datum)
    }

    /// Levenberg–Marquardt steps, across what is visible, until a test fires.
    pub(super) fn descend(&mut self, start: State<L::Point>) -> (State<L::Point>, Status) {
        let mut state = start;
        let mut radius = None;
        loop {
            let diagonal = self.diagonal(&state);
            let Ok(region) = Region::new(state.linear(), &diagonal) else {
                return (state, Status::Breakdown);
            };
            if let Some(status) = self.stationary(&state, &region) {
                return (state, status);
            }
            let first = radius.is_none();
            let mut delta = radius.unwrap_or_else(|| {
                let size: Vec<f64> = diagonal.iter().zip(&state.magnitude).map(|(d, m)| d * m).collect();
                let size = norm(&size) * self.settings.radius;
                if size > 0.0 && size.is_finite() { size } else { self.settings.radius }
            });
            self.iteration += 1;
            // Whether every trial that led elsewhere led to where something is undefined.
            let (mut any_undefined, mut only_undefined, mut likely) = (false, true, true);
            let next = loop {
                if self.trace.len() >= self.settings.max_trials {
                    return (state, Status::MaxTrials);
                }
                let Ok(step) = region.step(delta) else {
                    return (state, Status::Breakdown);
                };
                let trial = self.trial(&state, &region, &step, delta, likely);
                // after a step that was not taken, the next is not likely to be either
                likely = false;
                match trial {
                    Trial::Undefined => any_undefined = true,
                    Trial::Rejected { actual } => only_undefined &= actual == 0.0,
                    Trial::Accepted(..) => {}
                }
                match trial {
                    Trial::Accepted(next, gain) => {
                        if first {
                            delta = delta.min(step.norm);
                        }
                        // Moré 1978, §4.
                        if gain <= 0.25 {
                            delta *= 0.5;
                        } else if gain >= 0.75 || step.damping == 0.0 {
                            delta = 2.0 * step.norm;
                        }
                        let settled = step.damping == 0.0 && state.relative(&step.delta) <= self.settings.step;
                        if settled {
                            return (*next, Status::Step);
                        }
                        break *next;
                    }
                    Trial::Undefined => delta = 0.25 * delta.min(step.norm),
                    Trial::Rejected { actual } => {
                        if let Some(status) = self.at_rounding(&state, &region, &step) {
                            return (state, status);
                        }
                        // The parabola through cost, slope −2·predicted and trial cost; Moré 1978, §4.
                        let factor = 0.5 / (1.0 - actual / (2.0 * step.predicted).max(f64::MIN_POSITIVE));
                        delta = factor.clamp(0.1, 0.5) * delta.min(step.norm);
                    }
                }
                // Shorter steps cannot show in the cost.
                if step.predicted <= 0.1 * f64::EPSILON * state.cost || step.norm == 0.0 {
                    let status = if region.cosine <= NO_GRADIENT {
                        Status::Cost
                    } else if any_undefined && only_undefined {
                        Status::Undefined
                    } else {
                        Status::Stalled
                    };
                    return (state, status);
                }
            };
            state = next;
            radius = Some(delta);
        }
    }

    /// What a linearisation alone tells.
    fn stationary(&self, state: &State<L::Point>, region: &Region<'_>) -> Option<Status> {
        let vanished = region.residual <= self.settings.vanished * self.start_residual;
        if state.cost == 0.0 || vanished {
            Some(Status::NothingLeft)
        } else if region.share() <= self.settings.perpendicular(&state.information) || region.cosine <= f64::EPSILON {
            Some(Status::Gradient)
        } else {
            None
        }
    }

    /// What a rejected step tells.
    fn at_rounding(&self, state: &State<L::Point>, region: &Region<'_>, step: &Step) -> Option<Status> {
        if region.residual <= state.rounding() {
            return Some(Status::NothingLeft);
        }
        if step.damping == 0.0 && state.relative(&step.delta) <= self.settings.step {
            return Some(Status::Step);
        }
        (region.full.predicted <= NO_GRADIENT * NO_GRADIENT * state.cost).then_some(Status::Cost)
    }

    fn trial(
        &mut self,
        state: &State<L::Point>,
        region: &Region<'_>,
        step: &Step,
        radius: f64,
        likely: bool,
    ) -> Trial<L::Point> {
        let point = self.problem.retract(&state.point, &step.delta);
        let (cost, information) = self.look(&point, likely).map_or((None, None), |(cost, at)| (Some(cost), at));
        let gain = cost.filter(|_| step.predicted > 0.0).map(|cost| (state.cost - cost) / step.predicted);
        self.trace.push(Iteration {
            iteration: self.iteration,
            kind: self.kind,
            cost: state.cost,
            trial_cost: cost,
            predicted: step.predicted,
            gain,
            damping: step.damping,
            radius,
            step_norm: step.norm,
            gradient: region.cosine,
            accepted: false,
        });
        let Some(cost) = cost else {
            return Trial::Undefined;
        };
        let actual = state.cost - cost;
        let falls = gain.is_some_and(|gain| gain >= self.settings.gain) && actual > 0.0;
        let unresolved =
            step.damping == 0.0 && step.predicted <= UNRESOLVED * state.cost && actual >= -INVISIBLE_RISE * state.cost;
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
            let smaller = Region::new(next.linear(), &diagonal).is_ok_and(|at| at.share() <= 0.9 * region.share());
            if !smaller {
                return Trial::Rejected { actual };
            }
        }
        if let Some(last) = self.trace.last_mut() {
            last.accepted = true;
        }
        Trial::Accepted(Box::new(next), gain.unwrap_or(1.0))
    }
}

/// A cosine below which no fall of the cost can be seen: the steepest descent within the linear model lowers the cost by
/// its square, 1e-12, and a cost that is a sum of squares of differences of large numbers is not known much better.
const NO_GRADIENT: f64 = 1e-6;

/// A predicted fall below this share of the cost may drown in the rounding of the cost. A Gauss–Newton step is then
/// judged by the gradient instead.
const UNRESOLVED: f64 = 1e-8;

/// A rise of the cost, as a share, that counts as rounding when a step is judged by the gradient.
const INVISIBLE_RISE: f64 = 1e-11;
