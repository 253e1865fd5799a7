//! A start that meets bounds and constraints, or what makes it impossible.

use super::restore::{Restored, restore};
use crate::linalg::{Condition, Conditions, Row, conflict};
use crate::solve::{LeastSquares, Relation, Restriction, StartError};

/// The start moved onto bounds and constraints, and whether it was moved.
pub(super) fn admissible<L: LeastSquares>(
    problem: &L,
    start: L::Point,
) -> Result<(L::Point, bool), StartError<L::Error>> {
    let n = problem.dimension();
    let (lower, upper) = problem.bounds(&start);
    if lower.len() != n || upper.len() != n || lower.iter().chain(&upper).any(|bound| bound.is_nan()) {
        return Err(StartError::Problem("bounds"));
    }
    if let Some(j) = (0..n).find(|&j| lower[j] > upper[j]) {
        return Err(StartError::Infeasible { conflict: vec![Restriction::Lower(j), Restriction::Upper(j)] });
    }
    if lower.contains(&f64::INFINITY) || upper.contains(&f64::NEG_INFINITY) {
        return Err(StartError::Problem("bounds"));
    }
    let scale = problem.scale();
    if scale.len() != n || scale.iter().any(|&scale| !(scale > 0.0 && scale.is_finite())) {
        return Err(StartError::Problem("tolerances"));
    }
    let delta: Vec<f64> = lower.iter().zip(&upper).map(|(&lower, &upper)| 0.0_f64.clamp(lower, upper)).collect();
    let moved = delta.iter().any(|&delta| delta != 0.0);
    let inside = if moved { problem.retract(&start, &delta) } else { start };
    let constraints = problem.constraints(&inside).map_err(StartError::Undefined)?;
    if constraints.iter().any(|constraint| constraint.gradient.len() != n) {
        return Err(StartError::Problem("constraints"));
    }
    if constraints.is_empty() {
        return Ok((inside, moved));
    }
    let diagonal: Vec<f64> = scale.iter().map(|scale| 1.0 / scale).collect();
    let begun = problem.offset(&inside);
    match restore(problem, inside, &diagonal, true).map_err(StartError::Undefined)? {
        Restored::Met(point, _) => {
            let moved = moved || problem.offset(&point) != begun;
            Ok((point, moved))
        }
        Restored::Contradictory(point) => Err(contradiction(problem, &point, &diagonal)),
        Restored::Stuck(broken) => {
            Err(StartError::Infeasible { conflict: broken.into_iter().map(Restriction::Constraint).collect() })
        }
    }
}

/// The smallest conflict among the constraints linearised at a point, and its bounds.
fn contradiction<L: LeastSquares>(problem: &L, point: &L::Point, diagonal: &[f64]) -> StartError<L::Error> {
    let constraints = match problem.constraints(point) {
        Ok(constraints) => constraints,
        Err(error) => return StartError::Undefined(error),
    };
    let (lower, upper) = problem.bounds(point);
    let in_w = |bounds: &[f64]| bounds.iter().zip(diagonal).map(|(bound, d)| bound * d).collect::<Vec<_>>();
    let rows: Vec<Row> = constraints
        .iter()
        .map(|constraint| Row {
            coefficients: constraint.gradient.iter().zip(diagonal).map(|(a, d)| a / d).collect(),
            right: -constraint.value,
            equal: constraint.relation == Relation::Equal,
        })
        .collect();
    let found = conflict(&Conditions { lower: &in_w(&lower), upper: &in_w(&upper), rows: &rows });
    let named = |condition| match condition {
        Condition::Lower(j) => Restriction::Lower(j),
        Condition::Upper(j) => Restriction::Upper(j),
        Condition::Row(i) => Restriction::Constraint(i),
    };
    match found {
        Ok(Some(found)) => StartError::Infeasible { conflict: found.into_iter().map(named).collect() },
        Ok(None) => StartError::Infeasible { conflict: (0..rows.len()).map(Restriction::Constraint).collect() },
        Err(error) => StartError::Undefined(error.into()),
    }
}
