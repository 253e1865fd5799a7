//! The search itself: Levenberg–Marquardt steps until the cost cannot fall, then steps along what is invisible.

use super::local::{Local, Method};
use super::region::Step;
use super::solution::{Datum, Evaluations, Iteration, Kind, Solution, Status};
use super::state::{State, tangent};
use super::trial::Trial;
use super::{LeastSquares, Restriction, Settings, SettingsError};
use crate::linalg::{LinalgError, SquareRootInformation, norm};

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
    /// The solver keeps bounds, but no other constraints.
    #[error("the problem has constraints, which need the conic solver")]
    Constraints,
    /// Bounds and constraints contradict each other. Where Newton's method merely came to a stand, these are the
    /// constraints that it could not meet.
    #[error("bounds and constraints contradict each other")]
    Infeasible {
        /// As few as possible: without any one of them the others can be met, as far as a linearisation tells.
        conflict: Vec<Restriction>,
    },
    /// The norm needs the equations one by one, and the problem does not tell them.
    #[error("the problem does not tell its equations one by one, which this norm needs")]
    Rows,
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
    search(problem, start, settings, Method::Damped)
}

/// The search with either method.
pub(super) fn search<L: LeastSquares>(
    problem: &L,
    start: L::Point,
    settings: &Settings,
    method: Method,
) -> Result<Solution<L::Point>, StartError<L::Error>> {
    let mut search = Search::new(problem, settings, method)?;
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
    let constraints = problem.constraints(&start).map_err(StartError::Undefined)?;
    if method == Method::Damped && !constraints.is_empty() {
        return Err(StartError::Constraints);
    }
    let invisible = problem.invisible(&start, &information).map_err(StartError::Undefined)?;
    let invisible =
        tangent(invisible, &constraints, problem.scale()).map_err(|error| StartError::Undefined(error.into()))?;
    search.evaluations = Evaluations { costs: 1, linearisations: 1, ranks: 1 };
    search.restricted = !invisible.is_empty();
    search.start_residual = (2.0 * information.cost()).sqrt();
    let state = State::new(problem, start, cost, information, invisible, constraints);
    let (state, status, datum) = search.run(state);
    Ok(search.conclude(state, status, datum, projected))
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
    pub(super) method: Method,
    /// What the constraints bend the cost by, per ‖D δ‖², at the last trial.
    pub(super) curvature: f64,
}

impl<'a, L: LeastSquares> Search<'a, L> {
    fn new(problem: &'a L, settings: &'a Settings, method: Method) -> Result<Self, StartError<L::Error>> {
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
            method,
            curvature: 0.0,
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

    /// Linearises at a point of known cost; `None` where something is undefined there.
    pub(super) fn linearise(&mut self, point: L::Point, cost: f64) -> Option<State<L::Point>> {
        self.evaluations.linearisations += 1;
        let information = self.problem.linearise(&point).ok()?;
        self.judged(point, cost, information)
    }

    /// A point with its linearisation, and with what is invisible there where that is kept out of the steps.
    pub(super) fn judged(
        &mut self,
        point: L::Point,
        cost: f64,
        information: SquareRootInformation,
    ) -> Option<State<L::Point>> {
        let constraints = self.problem.constraints(&point).ok()?;
        let mut invisible = vec![];
        if self.restricted {
            self.evaluations.ranks += 1;
            invisible = self.problem.invisible(&point, &information).ok()?;
            invisible = tangent(invisible, &constraints, self.problem.scale()).ok()?;
        }
        Some(State::new(self.problem, point, cost, information, invisible, constraints))
    }

    /// The problem of one step at a state.
    pub(super) fn local<'s>(&self, state: &'s State<L::Point>, diagonal: &'s [f64]) -> Result<Local<'s>, LinalgError> {
        Local::new(self.method, state.linear(), diagonal, self.curvature)
    }

    /// The true cost, and with it the linearisation where the step is likely to be taken; `None` where it is undefined.
    pub(super) fn look(&mut self, point: &L::Point, likely: bool) -> Option<(f64, Option<SquareRootInformation>)> {
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
            let invisible = tangent(invisible, &state.constraints, self.problem.scale()).unwrap_or_default();
            if invisible.is_empty() {
                return (state, status, Datum::NotNeeded);
            }
            self.restricted = true;
            state = State::new(self.problem, state.point, state.cost, state.information, invisible, state.constraints);
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

    /// Steps across what is visible, until a test fires.
    pub(super) fn descend(&mut self, start: State<L::Point>) -> (State<L::Point>, Status) {
        let mut state = start;
        let mut radius = None;
        loop {
            let diagonal = self.diagonal(&state);
            let Ok(mut local) = self.local(&state, &diagonal) else {
                return (state, Status::Breakdown);
            };
            if let Some(status) = self.stationary(&state, &local) {
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
            let mut curvature = self.curvature;
            let next = loop {
                if self.problem.stopped() {
                    return (state, Status::Interrupted);
                }
                if self.trace.len() >= self.settings.max_trials {
                    return (state, Status::MaxTrials);
                }
                let Ok(step) = local.step(delta) else {
                    return (state, Status::Breakdown);
                };
                let trial = self.trial(&state, &local, &step, delta, likely);
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
                        } else if gain >= 0.75 || step.full {
                            delta = 2.0 * step.norm;
                        }
                        let settled = step.full && state.relative(&step.delta) <= self.settings.step;
                        if settled {
                            return (*next, Status::Step);
                        }
                        break *next;
                    }
                    Trial::Undefined => delta = 0.25 * delta.min(step.norm),
                    Trial::Rejected { actual } => {
                        if let Some(status) = self.at_rounding(&state, &local, &step) {
                            return (state, status);
                        }
                        // The parabola through cost, slope −2·predicted and trial cost; Moré 1978, §4.
                        let factor = 0.5 / (1.0 - actual / (2.0 * step.predicted).max(f64::MIN_POSITIVE));
                        delta = factor.clamp(0.1, 0.5) * delta.min(step.norm);
                    }
                }
                // what the trial showed of the constraints' curvature makes another program
                if self.curvature != curvature {
                    curvature = self.curvature;
                    let Ok(bent) = self.local(&state, &diagonal) else {
                        return (state, Status::Breakdown);
                    };
                    local = bent;
                }
                // Shorter steps cannot show in the cost.
                if step.predicted <= 0.1 * f64::EPSILON * state.cost || step.norm == 0.0 {
                    let status = if local.cosine() <= NO_GRADIENT {
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
    fn stationary(&self, state: &State<L::Point>, local: &Local<'_>) -> Option<Status> {
        let vanished = local.residual() <= self.settings.vanished * self.start_residual;
        if state.cost == 0.0 || vanished {
            Some(Status::NothingLeft)
        } else if local.share() <= self.settings.perpendicular(&state.information) || local.cosine() <= f64::EPSILON {
            Some(Status::Gradient)
        } else {
            None
        }
    }

    /// What a rejected step tells.
    fn at_rounding(&self, state: &State<L::Point>, local: &Local<'_>, step: &Step) -> Option<Status> {
        if local.residual() <= state.rounding() {
            return Some(Status::NothingLeft);
        }
        if step.full && state.relative(&step.delta) <= self.settings.step {
            return Some(Status::Step);
        }
        let least = if self.method == Method::Conic { CONIC_NO_GRADIENT } else { NO_GRADIENT };
        let unseen = (least * least * state.cost).max(UNSEEN * state.noise());
        (local.fall() <= unseen).then_some(Status::Cost)
    }
}

/// A cosine below which no fall of the cost can be seen: the steepest descent within the linear model lowers the cost by
/// its square, 1e-12, and a cost that is a sum of squares of differences of large numbers is not known much better.
const NO_GRADIENT: f64 = 1e-6;

/// As a share of what rounding makes of the cost, the same.
const UNSEEN: f64 = 0.1;

/// Likewise, where damped steps are judged by the gradient as well when the cost no longer tells.
const CONIC_NO_GRADIENT: f64 = 1e-9;
