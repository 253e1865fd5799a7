//! Systems with an upper triangular matrix.

use super::matrix::add_scaled;
use super::{LinalgError, Matrix, dot, same_size};

/// Solves R x = b by back substitution, R upper triangular (what stands below its diagonal is not read).
///
/// # Errors
/// Where sizes differ, or a diagonal entry is zero, or x overflows.
pub fn solve_upper(r: &Matrix, b: &[f64]) -> Result<Vec<f64>, LinalgError> {
    let n = r.columns();
    same_size(n, r.rows())?;
    same_size(n, b.len())?;
    let mut x = b.to_vec();
    for k in (0..n).rev() {
        if r[(k, k)] == 0.0 {
            return Err(LinalgError::Singular(k));
        }
        x[k] /= r[(k, k)];
        let (head, tail) = x.split_at_mut(k);
        add_scaled(head, -tail[0], r.column(k));
    }
    finite(x)
}

/// Solves Rᵀ x = b by forward substitution, R upper triangular (what stands below its diagonal is not read).
///
/// # Errors
/// Where sizes differ, or a diagonal entry is zero, or x overflows.
pub fn solve_upper_transposed(r: &Matrix, b: &[f64]) -> Result<Vec<f64>, LinalgError> {
    let n = r.columns();
    same_size(n, r.rows())?;
    same_size(n, b.len())?;
    let mut x = b.to_vec();
    for k in 0..n {
        if r[(k, k)] == 0.0 {
            return Err(LinalgError::Singular(k));
        }
        x[k] = (x[k] - dot(&x[..k], r.column(k))) / r[(k, k)];
    }
    finite(x)
}

/// 1 / (‖R C⁻¹‖ ‖C R⁻¹‖) in Frobenius norms, where C makes the columns of R unit vectors: a lower bound of the smallest
/// over the largest singular value. Zero for a singular matrix.
#[must_use]
pub fn reciprocal_condition(r: &Matrix) -> f64 {
    let n = r.columns();
    let norms = r.column_norms();
    let mut squares = 0.0;
    let mut unit = vec![0.0; n];
    for k in 0..n {
        unit[k] = 1.0;
        let Ok(column) = solve_upper(r, &unit) else {
            return 0.0;
        };
        unit[k] = 0.0;
        squares += column.iter().zip(&norms).map(|(x, norm)| (x * norm).powi(2)).sum::<f64>();
    }
    let reciprocal = 1.0 / (squares * n as f64).sqrt();
    if reciprocal.is_finite() { reciprocal } else { 0.0 }
}

fn finite(x: Vec<f64>) -> Result<Vec<f64>, LinalgError> {
    if x.iter().all(|x_i| x_i.is_finite()) { Ok(x) } else { Err(LinalgError::NotFinite) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn r() -> Matrix {
        Matrix::from_rows(3, &[[2.0, 1.0, -1.0], [9.0, 4.0, 3.0], [9.0, 9.0, 0.5]])
    }

    #[test]
    fn both_substitutions_solve() {
        // The nines below the diagonal must not be read.
        assert_eq!(solve_upper(&r(), &[2.0, 11.0, 0.5]).unwrap(), [0.5, 2.0, 1.0]);
        assert_eq!(solve_upper_transposed(&r(), &[2.0, 9.0, 5.5]).unwrap(), [1.0, 2.0, 1.0]);
    }

    #[test]
    fn a_zero_on_the_diagonal_is_named() {
        let mut singular = r();
        singular[(1, 1)] = 0.0;
        assert_eq!(solve_upper(&singular, &[1.0; 3]), Err(LinalgError::Singular(1)));
        assert_eq!(solve_upper_transposed(&singular, &[1.0; 3]), Err(LinalgError::Singular(1)));
        assert_eq!(reciprocal_condition(&singular), 0.0);
        assert!(solve_upper(&r(), &[1.0; 2]).is_err());
    }

    #[test]
    fn condition_ignores_units() {
        let upper = Matrix::from_rows(2, &[[1.0, 1.0], [0.0, 1e-3]]);
        let condition = reciprocal_condition(&upper);
        assert!((3e-4..1e-3).contains(&condition));
        let scaled = reciprocal_condition(&upper.scale_columns(&[1e-8, 1e8]));
        assert!((scaled / condition - 1.0).abs() < 1e-12);
    }
}
