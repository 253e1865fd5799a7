//! The step along invisible directions: −β N Nᵀ z, towards the nominal values, as far as bounds let it.

use super::region::Linear;
use crate::linalg::{
    Bound, Conditions, ConstrainedStart, LinalgError, Matrix, Row, Start, bounded_least_squares,
    constrained_least_squares, dot, norm,
};

/// N Nᵀ z: what the offset z has along the orthonormal N.
pub(super) fn along(basis: &[Vec<f64>], z: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; z.len()];
    for direction in basis {
        let share = dot(direction, z);
        for (sum, direction) in sum.iter_mut().zip(direction) {
            *sum += share * direction;
        }
    }
    sum
}

/// The δ that goes by `target` (in z, within the span of `basis`) without changing a residual, within bounds.
///
/// Without bounds in the way it is S·target. Otherwise the target is pursued with a small weight κ beside the visible
/// residuals, min ‖R' δ‖² + κ²‖Nᵀ(S⁻¹δ − target)‖², which finds the bounds that stop it; then, from there, ‖R' δ‖ alone
/// is minimised, by shortest steps, so that the weight leaves no trace in what the residuals see.
pub(super) fn datum_step(
    linear: &Linear<'_>,
    basis: &[Vec<f64>],
    scale: &[f64],
    diagonal: &[f64],
    target: &[f64],
) -> Result<Vec<f64>, LinalgError> {
    /// κ as a share of ‖R' D⁻¹‖: small beside what is seen, large beside rounding.
    const WEIGHT: f64 = 1e-4;
    let n = scale.len();
    let straight: Vec<f64> = target.iter().zip(scale).map(|(z, scale)| z * scale).collect();
    let kept = |row: &Row| row.equal || dot(&row.coefficients, &straight) <= row.right;
    if (0..n).all(|j| linear.lower[j] <= straight[j] && straight[j] <= linear.upper[j]) && linear.rows.iter().all(kept)
    {
        return Ok(straight);
    }
    let inverse: Vec<f64> = diagonal.iter().map(|d| 1.0 / d).collect();
    let m = linear.visible.scale_columns(&inverse);
    let mut rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| m[(i, j)]).collect()).collect();
    let mut d = vec![0.0; n];
    for direction in basis {
        let row: Vec<f64> = (0..n).map(|j| direction[j] / scale[j] / diagonal[j]).collect();
        let weight = WEIGHT * m.norm().max(f64::MIN_POSITIVE) / norm(&row);
        d.push(-weight * dot(direction, target));
        rows.push(row.iter().map(|entry| entry * weight).collect());
    }
    let in_w = |bounds: &[f64]| bounds.iter().zip(diagonal).map(|(bound, d)| bound * d).collect::<Vec<_>>();
    let (lower, upper) = (in_w(linear.lower), in_w(linear.upper));
    let a = Matrix::from_rows(n, &rows);
    if !linear.rows.is_empty() {
        let scaled = |row: &Row| Row {
            coefficients: row.coefficients.iter().zip(diagonal).map(|(a, d)| a / d).collect(),
            right: row.right,
            equal: row.equal,
        };
        let rows: Vec<Row> = linear.rows.iter().map(scaled).collect();
        let conditions = Conditions { lower: &lower, upper: &upper, rows: &rows };
        let pursued = constrained_least_squares(&a, &d, &conditions, None)?;
        let start = ConstrainedStart { delta: pursued.delta, active: pursued.active, rows: pursued.rows };
        let unseen = constrained_least_squares(&m, &vec![0.0; n], &conditions, Some(&start))?;
        return Ok(in_delta(linear, diagonal, &unseen.delta, &unseen.active));
    }
    let pursued = bounded_least_squares(&a, &d, &lower, &upper, None)?;
    let start = Start { delta: pursued.delta, active: pursued.active };
    let unseen = bounded_least_squares(&m, &vec![0.0; n], &lower, &upper, Some(&start))?;
    Ok(in_delta(linear, diagonal, &unseen.delta, &unseen.active))
}

/// D⁻¹w, exactly on the bounds that are active.
fn in_delta(linear: &Linear<'_>, diagonal: &[f64], w: &[f64], active: &[Bound]) -> Vec<f64> {
    (0..w.len())
        .map(|j| match active[j] {
            Bound::Lower => linear.lower[j],
            Bound::Upper => linear.upper[j],
            Bound::Free => (w[j] / diagonal[j]).clamp(linear.lower[j], linear.upper[j]),
        })
        .collect()
}
