//! The search for norms that are not squares: conic programs within a trust region, one after the other.

use super::norms::{Around, NormStep};
use super::restore::{Restored, restore};
use super::{ConicStep, Norm};
use crate::linalg::norm as length;
use crate::solve::finish::lengths;
use crate::solve::solution::{ConstraintState, Datum, Evaluations, Iteration, Kind, Solution, Status};
use crate::solve::state::State;
use crate::solve::{LeastSquares, Restriction, Settings, Stacked, StartError};

/// A predicted fall below this share of the cost is none; Clarabel's gap.
const NEGLIGIBLE: f64 = 1e-10;

/// What a search has done.
#[derive(Default)]
struct Record {
    trace: Vec<Iteration>,
    evaluations: Evaluations,
    iterations: usize,
    last: Option<ConicStep>,
}

/// Minimises a norm from a start that meets bounds and constraints.
pub(super) fn search<L: LeastSquares>(
    problem: &L,
    start: L::Point,
    settings: &Settings,
    goal: Norm,
) -> Result<Solution<L::Point>, StartError<L::Error>> {
    let told = problem.stacked(&start).map_err(StartError::Undefined)?.ok_or(StartError::Rows)?;
    let cost = goal.cost(&told.residual, told.priors);
    if !cost.is_finite() || !told.jacobian.is_finite() {
        return Err(StartError::NotFinite);
    }
    if told.jacobian.columns() != problem.dimension() || told.jacobian.rows() != told.residual.len() {
        return Err(StartError::Problem("equations"));
    }
    let mut record = Record::default();
    let (point, cost, status) = descend(problem, (start, told, cost), settings, goal, &mut record)?;
    conclude(problem, point, cost, status, record)
}

type Place<P> = (P, Stacked, f64);

fn descend<L: LeastSquares>(
    problem: &L,
    start: Place<L::Point>,
    settings: &Settings,
    goal: Norm,
    record: &mut Record,
) -> Result<(L::Point, f64, Status), StartError<L::Error>> {
    /// A fall per length of step, in costs per way to zero, that is still a slope.
    const SLOPE: f64 = 1e-4;
    let (mut point, mut told, mut cost) = start;
    let mut longest = vec![0.0_f64; problem.dimension()];
    let mut radius = None;
    loop {
        for (longest, norm) in longest.iter_mut().zip(told.jacobian.column_norms()) {
            *longest = longest.max(norm);
        }
        let diagonal = lengths(&longest, problem.scale());
        let magnitude = problem.magnitude(&point);
        let way = length(&diagonal.iter().zip(&magnitude).map(|(d, m)| d * m).collect::<Vec<_>>());
        let mut delta = radius.unwrap_or(if way > 0.0 { settings.radius * way } else { settings.radius });
        let constraints = problem.constraints(&point).map_err(StartError::Undefined)?;
        let rows = super::restore_rows(&constraints, &magnitude);
        let (lower, upper) = problem.bounds(&point);
        let (lower, upper): (Vec<f64>, Vec<f64>) =
            lower.iter().zip(&upper).map(|(lower, upper)| (lower.min(0.0), upper.max(0.0))).unzip();
        let around = Around { stacked: &told, diagonal: &diagonal, lower: &lower, upper: &upper, rows: &rows };
        record.iterations += 1;
        let next = loop {
            if cost == 0.0 {
                return Ok((point, cost, Status::NothingLeft));
            }
            if problem.stopped() {
                return Ok((point, cost, Status::Interrupted));
            }
            if record.trace.len() >= settings.max_trials {
                return Ok((point, cost, Status::MaxTrials));
            }
            let NormStep { delta: step, length: long, conic } = around.step(goal, delta);
            let predicted = cost - goal.cost(&around.linear(&step), told.priors);
            record.last = conic.status.solved().then(|| conic.clone());
            let mut iteration = Iteration {
                iteration: record.iterations,
                kind: Kind::Step,
                cost,
                trial_cost: None,
                // no step is taken here that the cost does not show
                rounding: 0.0,
                predicted,
                gain: None,
                damping: 0.0,
                radius: delta,
                step_norm: long,
                gradient: 0.0,
                accepted: false,
                conic: Some(conic.clone()),
            };
            if !conic.status.solved() {
                record.trace.push(iteration);
                if delta <= f64::EPSILON * way {
                    return Ok((point, cost, Status::Breakdown));
                }
                delta *= 0.1;
                continue;
            }
            if predicted <= NEGLIGIBLE * cost {
                let level = long < 0.99 * delta || predicted * way <= SLOPE * cost * delta;
                record.trace.push(iteration);
                return Ok((point, cost, if level { Status::Cost } else { Status::Stalled }));
            }
            let trial = looked_at(problem, &point, &step, &diagonal, goal, record);
            iteration.trial_cost = trial.as_ref().map(|(_, _, cost)| *cost);
            iteration.gain = iteration.trial_cost.map(|trial| (cost - trial) / predicted);
            let gain = iteration.gain.unwrap_or(-1.0);
            iteration.accepted = gain >= settings.gain;
            record.trace.push(iteration);
            match trial {
                Some(trial) if gain >= settings.gain => {
                    if gain <= 0.25 {
                        delta *= 0.5;
                    } else if gain >= 0.75 {
                        delta = delta.max(2.0 * long);
                    }
                    break trial;
                }
                _ => delta = 0.25 * delta.min(long),
            }
        };
        (point, told, cost) = next;
        radius = Some(delta);
    }
}

/// A trial point on the constraints, with its equations and true cost; `None` where something is undefined.
fn looked_at<L: LeastSquares>(
    problem: &L,
    point: &L::Point,
    step: &[f64],
    diagonal: &[f64],
    goal: Norm,
    record: &mut Record,
) -> Option<Place<L::Point>> {
    record.evaluations.costs += 1;
    record.evaluations.linearisations += 1;
    let beside = problem.retract(point, step);
    let Ok(Restored::Met(next, _)) = restore(problem, beside, diagonal, false) else { return None };
    let told = problem.stacked(&next).ok().flatten()?;
    let cost = goal.cost(&told.residual, told.priors);
    (cost.is_finite() && told.jacobian.is_finite()).then_some((next, told, cost))
}

fn conclude<L: LeastSquares>(
    problem: &L,
    point: L::Point,
    cost: f64,
    status: Status,
    record: Record,
) -> Result<Solution<L::Point>, StartError<L::Error>> {
    let information = problem.linearise(&point).map_err(StartError::Undefined)?;
    let constraints = problem.constraints(&point).map_err(StartError::Undefined)?;
    let invisible = problem.invisible(&point, &information).map_err(StartError::Undefined)?;
    let invisible = crate::solve::state::tangent(invisible, &constraints, problem.scale())
        .map_err(|error| StartError::Undefined(error.into()))?;
    let state = State::new(problem, point, cost, information, invisible, constraints);
    let n = problem.dimension();
    let pressed = |what: Restriction| {
        let active = record.last.iter().flat_map(|last| &last.active);
        active.filter(|(other, _)| *other == what).map(|(_, multiplier)| multiplier).sum::<f64>()
    };
    let held = state.held();
    let told = |(i, constraint): (usize, &crate::solve::Constraint)| ConstraintState {
        relation: constraint.relation,
        value: constraint.value,
        gradient: constraint.gradient.clone(),
        multiplier: if held[i] { pressed(Restriction::Constraint(i)) } else { 0.0 },
        active: held[i],
    };
    Ok(Solution {
        constraints: state.constraints.iter().enumerate().map(told).collect(),
        multipliers: (0..n).map(|j| pressed(Restriction::Lower(j)) + pressed(Restriction::Upper(j))).collect(),
        active: (0..n).map(|j| state.on_bound(j)).collect(),
        datum: if state.invisible.is_empty() { Datum::NotNeeded } else { Datum::Unsettled },
        kkt: f64::NAN,
        point: state.point,
        status,
        cost,
        iterations: record.iterations,
        trace: record.trace,
        information: state.information,
        invisible: state.invisible,
        projected: false,
        evaluations: record.evaluations,
    })
}
