//! Back onto the constraints: Newton's method by shortest steps.
//!
//! At each point the step is the shortest one in D that meets the linearised constraints within the bounds.

use crate::linalg::{Conditions, LinalgError, Matrix, Row, constrained_least_squares};
use crate::solve::{Constraint, LeastSquares, Relation};

/// A violation up to this many units of rounding of g is none.
const NONE: f64 = 4.0;

/// Where Newton's method stands still, a violation up to this many units of rounding is met.
const STANDS: f64 = 1000.0;

/// A point on the constraints, or why there is none.
pub(in crate::solve) enum Restored<P> {
    /// A point that meets them, and the values of the constraints where it began.
    Met(P, Vec<Constraint>),
    /// The linearised constraints contradict each other there.
    Contradictory(P),
    /// Newton's method came to a stand at a point that breaks these.
    Stuck(Vec<usize>),
}

/// The unit of rounding of each constraint at a point: of its terms, and of the coordinates it is made of.
pub(in crate::solve) fn rounding(constraint: &Constraint, magnitude: &[f64]) -> f64 {
    let coordinates: f64 = constraint.gradient.iter().zip(magnitude).map(|(a, m)| (a * m).abs()).sum();
    f64::EPSILON * (constraint.magnitude.abs() + coordinates)
}

/// The conditions on δ at a point; what is broken or free by rounding only is met exactly by δ = 0.
pub(in crate::solve) fn rows(constraints: &[Constraint], magnitude: &[f64]) -> Vec<Row> {
    let row = |constraint: &Constraint| {
        let equal = constraint.relation == Relation::Equal;
        let near = STANDS * rounding(constraint, magnitude);
        let at_zero = if equal { constraint.value.abs() <= near } else { constraint.value >= -near / STANDS * NONE };
        let right = if at_zero { 0.0 } else { -constraint.value };
        Row { coefficients: constraint.gradient.clone(), right, equal }
    };
    constraints.iter().map(row).collect()
}

/// The largest violation in units of rounding.
fn worst(constraints: &[Constraint], magnitude: &[f64]) -> f64 {
    let share =
        |constraint: &Constraint| constraint.violation() / rounding(constraint, magnitude).max(f64::MIN_POSITIVE);
    constraints
        .iter()
        .map(share)
        .fold(0.0, |worst, share| if share.is_nan() { f64::INFINITY } else { share.max(worst) })
}

/// A point on the constraints near `point`. `patient` allows halved steps, for a start that is far from them.
pub(in crate::solve) fn restore<L: LeastSquares>(
    problem: &L,
    point: L::Point,
    diagonal: &[f64],
    patient: bool,
) -> Result<Restored<L::Point>, L::Error> {
    let first = problem.constraints(&point)?;
    let (mut point, mut here) = (point, first.clone());
    let mut before = worst(&here, &problem.magnitude(&point));
    for _ in 0..if patient { 100 } else { 12 } {
        if before <= NONE {
            return Ok(Restored::Met(point, first));
        }
        let delta = match shortest(problem, &point, &here, diagonal) {
            Ok(delta) => delta,
            Err(LinalgError::Infeasible) if before <= STANDS => return Ok(Restored::Met(point, first)),
            Err(LinalgError::Infeasible) => return Ok(Restored::Contradictory(point)),
            Err(error) => return Err(error.into()),
        };
        let mut part = 1.0;
        let better = loop {
            let shorter: Vec<f64> = delta.iter().map(|delta| delta * part).collect();
            let next = problem.retract(&point, &shorter);
            if let Ok(there) = problem.constraints(&next) {
                let after = worst(&there, &problem.magnitude(&next));
                if after < (1.0 - 0.1 * part) * before {
                    break Some((next, there, after));
                }
            }
            part *= 0.5;
            if !patient || part < 1e-3 {
                break None;
            }
        };
        let Some((next, there, after)) = better else { break };
        (point, here, before) = (next, there, after);
    }
    if before <= STANDS {
        return Ok(Restored::Met(point, first));
    }
    let magnitude = problem.magnitude(&point);
    let broken = |&i: &usize| here[i].violation() > STANDS * rounding(&here[i], &magnitude);
    Ok(Restored::Stuck((0..here.len()).filter(broken).collect()))
}

/// min ‖D δ‖ under the linearised constraints, within bounds.
fn shortest<L: LeastSquares>(
    problem: &L,
    point: &L::Point,
    constraints: &[Constraint],
    diagonal: &[f64],
) -> Result<Vec<f64>, LinalgError> {
    let (lower, upper) = problem.bounds(point);
    let n = lower.len();
    let in_w = |bounds: &[f64], edge: fn(f64, f64) -> f64| -> Vec<f64> {
        bounds.iter().zip(diagonal).map(|(&bound, d)| edge(bound, 0.0) * d).collect()
    };
    let rows: Vec<Row> = constraints
        .iter()
        .map(|constraint| Row {
            coefficients: constraint.gradient.iter().zip(diagonal).map(|(a, d)| a / d).collect(),
            right: -constraint.value,
            equal: constraint.relation == Relation::Equal,
        })
        .collect();
    let (low, high) = (in_w(&lower, f64::min), in_w(&upper, f64::max));
    let conditions = Conditions { lower: &low, upper: &high, rows: &rows };
    let found = constrained_least_squares(&Matrix::identity(n), &vec![0.0; n], &conditions, None)?;
    Ok(found.delta.iter().zip(diagonal).map(|(w, d)| w / d).collect())
}
