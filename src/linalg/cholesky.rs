//! The triangular factor of a small symmetric matrix.

use super::Matrix;

/// L, lower triangular, with L·Lᵀ = A; `None` where A is not positive definite beyond rounding. Only the lower half of A is
/// read.
///
/// ```
/// use phical::linalg::{Matrix, cholesky};
/// let l = cholesky(&Matrix::from_rows(2, &[[4.0, 2.0], [2.0, 10.0]])).unwrap();
/// assert_eq!((l[(0, 0)], l[(1, 0)], l[(1, 1)]), (2.0, 1.0, 3.0));
/// assert!(cholesky(&Matrix::from_rows(2, &[[1.0, 2.0], [2.0, 1.0]])).is_none());
/// ```
pub fn cholesky(a: &Matrix) -> Option<Matrix> {
    let n = a.rows();
    if a.columns() != n {
        return None;
    }
    let least = 4.0 * n as f64 * f64::EPSILON;
    let mut l = Matrix::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let known: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum();
            let rest = a[(i, j)] - known;
            if i > j {
                l[(i, j)] = rest / l[(j, j)];
            } else if rest > least * a[(j, j)] && rest.is_finite() {
                l[(j, j)] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(l)
}
