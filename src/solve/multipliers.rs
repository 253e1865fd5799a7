//! What holds a point: the multipliers of bounds and constraints, and how well the Karush–Kuhn–Tucker conditions hold.

use super::solution::ConstraintState;
use super::{Constraint, Relation};
use crate::linalg::{Bound, LinalgError, Matrix, bounded_least_squares, norm};

/// The multipliers at a point.
pub(super) struct Multipliers {
    /// ν, for each coordinate.
    pub(super) bounds: Vec<f64>,
    pub(super) constraints: Vec<ConstraintState>,
    /// ‖C⁻¹(∇cost + Σ μᵢ∇gᵢ − ν)‖ / ‖r‖.
    pub(super) kkt: f64,
}

/// The μ and ν of the right signs that leave least of ∇cost + Σ μᵢ∇gᵢ − ν, in units of columns of length one; they rest
/// on the gradient at the point, not on a step. `lengths` is C, the lengths of the columns of J.
pub(super) fn multipliers(
    gradient: &[f64],
    lengths: &[f64],
    residual: f64,
    bounds: &[Bound],
    constraints: Vec<(Constraint, bool)>,
) -> Result<Multipliers, LinalgError> {
    let n = gradient.len();
    let scaled = |vector: &[f64]| vector.iter().zip(lengths).map(|(v, c)| v / c).collect::<Vec<f64>>();
    let (mut columns, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
    for (constraint, _) in constraints.iter().filter(|(_, active)| *active) {
        columns.push(scaled(&constraint.gradient));
        lower.push(if constraint.relation == Relation::Equal { f64::NEG_INFINITY } else { 0.0 });
        upper.push(f64::INFINITY);
    }
    let rows = columns.len();
    let held: Vec<usize> = (0..n).filter(|&j| bounds[j] != Bound::Free).collect();
    for &j in &held {
        let mut column = vec![0.0; n];
        column[j] = -1.0;
        columns.push(column);
        lower.push(if bounds[j] == Bound::Lower { 0.0 } else { f64::NEG_INFINITY });
        upper.push(if bounds[j] == Bound::Lower { f64::INFINITY } else { 0.0 });
    }
    let a = Matrix::from_columns(n, &columns);
    let d = scaled(gradient);
    let found = bounded_least_squares(&a, &d, &lower, &upper, None)?.delta;
    let mut left = a.mul_vec(&found);
    left.iter_mut().zip(&d).for_each(|(left, d)| *left += d);
    let mut nu = vec![0.0; n];
    for (&j, nu_j) in held.iter().zip(&found[rows..]) {
        nu[j] = nu_j * lengths[j];
    }
    let mut mu = found[..rows].iter();
    let constraints = constraints
        .into_iter()
        .map(|(constraint, active)| ConstraintState {
            relation: constraint.relation,
            value: constraint.value,
            gradient: constraint.gradient,
            multiplier: if active { mu.next().copied().unwrap_or(0.0) } else { 0.0 },
            active,
        })
        .collect();
    let kkt = if residual > 0.0 { norm(&left) / residual } else { 0.0 };
    Ok(Multipliers { bounds: nu, constraints, kkt })
}
