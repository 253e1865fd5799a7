//! Along an invisible direction, as far as the residuals stay zero.
//!
//! A direction that no residual sees to first order may be the tangent of a curve along which nothing changes (a family: the
//! set-up cannot know where on it the truth is), or the residuals may change to second order (x² at zero: a stationary point). The
//! difference is what Gauss–Newton leaves: the coordinates of a datum go along the direction, all others follow so that the
//! residuals of fixed consistent inputs vanish again, and either they do, to rounding, or something remains that no
//! correction removes.

use super::cures::best_datum;
use crate::linalg::{LinalgError, SquareRootInformation, norm, solve_upper};
use crate::problem::{Problem, Undefined};
use crate::solve::{LeastSquares, Relation};

/// Where the walk stops, in tolerances along the unit vector.
const STOPS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];
/// Corrections at each stop.
const CORRECTIONS: usize = 20;
/// What rounding leaves, as a share of what the parameters' own sizes contribute.
const ROUNDING: f64 = 1e-12;
/// Beside what was left at the beginning.
const AS_BEFORE: f64 = 1e3;

/// Where a direction led.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// Whether the residuals stayed zero.
    pub family: bool,
    /// How far it went, in tolerances.
    pub length: f64,
    /// The largest root mean square of the residuals at the stops, each in its reported unit.
    pub residual: f64,
    /// The same where nothing is corrected: along the straight line.
    pub straight: f64,
    /// Where it ended: every coordinate, in internal units.
    pub end: Vec<f64>,
}

/// Follows a direction (a unit vector in tolerances, in the span of `basis`) from the start of a problem whose inputs are
/// consistent with it, with weights that are all alike.
///
/// # Errors
/// Where the residuals are undefined at the start.
pub fn walk(problem: &Problem, basis: &[Vec<f64>], direction: &[f64]) -> Result<Walk, Undefined> {
    let mut problem = problem.without_loss();
    // bounds say where the truth is, not what can be seen
    for coordinate in &mut problem.layout.coordinates {
        (coordinate.min, coordinate.max) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    let start = problem.start.clone();
    let scale = problem.scale().to_vec();
    let allowed = allowance(&problem, &start)?;
    let datum = best_datum(basis);
    let follow = Followers::new(&problem, &datum);
    let (mut q, mut at) = (start.clone(), 0.0);
    let (mut residual, mut straight): (f64, f64) = (0.0, 0.0);
    for stop in STOPS {
        let step = |by: f64| -> Vec<f64> { direction.iter().zip(&scale).map(|(z, scale)| by * z * scale).collect() };
        straight = straight.max(rms(&problem, &problem.retract(&start, &step(stop))).unwrap_or(f64::INFINITY));
        q = problem.retract(&q, &step(stop - at));
        at = stop;
        match follow.correct(&q) {
            Some((corrected, left)) => {
                q = corrected;
                residual = residual.max(left);
            }
            None => residual = f64::INFINITY,
        }
        if residual > allowed {
            break;
        }
    }
    Ok(Walk { family: residual <= allowed, length: at, residual, straight, end: q })
}

/// The root mean square of residuals, and of equations between parameters, that are zero but for rounding.
pub(super) fn allowance(problem: &Problem, q: &Vec<f64>) -> Result<f64, Undefined> {
    let before = rms(problem, q)?;
    let lengths = problem.linearised(q)?.information.r().column_norms();
    let own: f64 = lengths.iter().zip(problem.magnitude(q)).map(|(length, size)| length * size).sum();
    Ok(AS_BEFORE * before + ROUNDING * own / (problem.equations().max(1) as f64).sqrt())
}

pub(super) fn rms(problem: &Problem, q: &[f64]) -> Result<f64, Undefined> {
    let units = &problem.program.units;
    let equations = problem.linearised_constraints(q)?.into_iter().zip(problem.constrained());
    let broken = equations.filter(|(found, _)| found.relation == Relation::Equal);
    let broken = broken.map(|(found, declared)| units.to_reported(found.value, declared.dimension).powi(2));
    let squares = problem.sums(q)?.squares + broken.sum::<f64>();
    Ok((squares / problem.equations().max(1) as f64).sqrt())
}

/// The coordinates beside a datum, which follow it.
pub(super) struct Followers<'p> {
    problem: Problem<'p>,
}

impl<'p> Followers<'p> {
    pub(super) fn new(problem: &Problem<'p>, datum: &[usize]) -> Self {
        let free = problem.free.iter().enumerate().filter(|(j, _)| !datum.contains(j)).map(|(_, &c)| c).collect();
        Followers { problem: problem.with_free(free) }
    }

    /// Gauss–Newton until the residuals fall no more: the point, and what is left of them.
    pub(super) fn correct(&self, from: &[f64]) -> Option<(Vec<f64>, f64)> {
        let problem = &self.problem;
        let mut q = from.to_vec();
        let mut left = rms(problem, &q).ok()?;
        for _ in 0..CORRECTIONS {
            if left == 0.0 {
                break;
            }
            let information = problem.with_equations(problem.linearised(&q).ok()?.information, &q).ok()?;
            let delta = least_squares(&information).ok()?;
            let next = problem.retract(&q, &delta);
            match rms(problem, &next) {
                Ok(less) if less < left => (q, left) = (next, less),
                _ => break,
            }
        }
        left.is_finite().then_some((q, left))
    }
}

/// The δ that minimises ‖R δ + d‖, of columns brought to one length.
fn least_squares(information: &SquareRootInformation) -> Result<Vec<f64>, LinalgError> {
    let r = information.r();
    let inverse: Vec<f64> =
        r.column_norms().iter().map(|length| if *length > 0.0 { 1.0 / length } else { 1.0 }).collect();
    let negative: Vec<f64> = information.d().iter().map(|d| -d).collect();
    let scaled = solve_upper(&r.scale_columns(&inverse), &negative)?;
    let delta: Vec<f64> = scaled.iter().zip(&inverse).map(|(x, inverse)| x * inverse).collect();
    if norm(&delta).is_finite() { Ok(delta) } else { Err(LinalgError::NotFinite) }
}
