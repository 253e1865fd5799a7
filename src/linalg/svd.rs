//! The singular value decomposition of a small matrix.
//!
//! One-sided Jacobi (Hestenes 1958; Golub & Van Loan, Matrix Computations, 4th ed., §8.6.3): plane rotations of pairs of
//! columns from the right until all columns are orthogonal, A V = U diag(σ). Small singular values keep their digits even
//! where columns differ by many decades (Demmel & Veselić, SIAM J. Matrix Anal. Appl. 13 (1992) 1204), which a
//! decomposition by bidiagonalisation does not promise: rank is judged on them.

use super::{LinalgError, Matrix, dot, norm};

/// A = U diag(σ) Vᵀ with as many σ as A has columns, in descending order.
#[derive(Debug, Clone, PartialEq)]
pub struct Svd {
    /// rows × columns. Where σ is zero the column of `u` is zero.
    pub u: Matrix,
    /// Singular values, largest first; one per column of A.
    pub sigma: Vec<f64>,
    /// columns × columns, orthogonal: its last columns span the null space even of a wide A.
    pub v: Matrix,
}

/// The singular value decomposition. Meant for triangular factors; a tall matrix should be reduced by
/// [`SquareRootInformation`](super::SquareRootInformation) first, which is faster and loses nothing.
///
/// # Errors
/// An entry that is not finite is refused.
pub fn svd(matrix: &Matrix) -> Result<Svd, LinalgError> {
    /// Sweeps over all pairs; about eight are used.
    const SWEEPS: usize = 60;

    if !matrix.is_finite() {
        return Err(LinalgError::NotFinite);
    }
    let n = matrix.columns();
    let largest = matrix.as_slice().iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    // A power of two as unit, so that no square overflows and no digit is lost.
    let exponent = if largest > 0.0 { largest.log2().floor().clamp(-1000.0, 1000.0) } else { 0.0 };
    let unit = exponent.exp2();
    let mut u = matrix.scale_columns(&vec![1.0 / unit; n]);
    let mut v = Matrix::identity(n);
    let mut settled = false;
    for _ in 0..SWEEPS {
        if settled {
            break;
        }
        settled = true;
        for j in 1..n {
            for i in 0..j {
                settled &= !rotate(&mut u, &mut v, i, j);
            }
        }
    }
    if !settled {
        return Err(LinalgError::NoConvergence);
    }
    let norms = u.column_norms();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| norms[b].total_cmp(&norms[a]));
    let pick =
        |from: &Matrix| Matrix::from_columns(from.rows(), &order.iter().map(|&k| from.column(k)).collect::<Vec<_>>());
    let inverse: Vec<f64> = order.iter().map(|&k| if norms[k] > 0.0 { 1.0 / norms[k] } else { 0.0 }).collect();
    Ok(Svd {
        u: pick(&u).scale_columns(&inverse),
        sigma: order.iter().map(|&k| norms[k] * unit).collect(),
        v: pick(&v),
    })
}

/// Makes columns i < j of `u` orthogonal by the rotation with tan 2θ = 2 uᵢᵀuⱼ / (‖uᵢ‖² − ‖uⱼ‖²)
/// and rotates `v` alike. False if they were orthogonal already.
fn rotate(u: &mut Matrix, v: &mut Matrix, i: usize, j: usize) -> bool {
    /// The cosine of two columns that count as orthogonal.
    const ORTHOGONAL: f64 = 1e-15;
    /// Columns whose squares multiply to less than this (entries are at most 2) are zero: rounding of rounding.
    const ZERO: f64 = 1e-90;

    let (a, b) = (dot(u.column(i), u.column(i)), dot(u.column(j), u.column(j)));
    let c = dot(u.column(i), u.column(j));
    if a * b < ZERO || b < ZERO || a < ZERO {
        return false;
    }
    if c.abs() <= ORTHOGONAL * norm(u.column(i)) * norm(u.column(j)) {
        return false;
    }
    // Rutishauser's stable form: t = tan θ is the smaller root of t² + 2ζt − 1 = 0.
    let zeta = (b - a) / (2.0 * c);
    let t = if zeta.is_finite() { 1.0_f64.copysign(zeta) / (zeta.abs() + 1.0_f64.hypot(zeta)) } else { 0.0 };
    let cosine = 1.0 / 1.0_f64.hypot(t);
    let sine = cosine * t;
    for matrix in [u, v] {
        let (x, y) = matrix.both_mut(i, j);
        for (x, y) in x.iter_mut().zip(y) {
            (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
        }
    }
    t != 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(matrix: &Matrix) -> Result<(), TestCaseError> {
        let Svd { u, sigma, v } = svd(matrix).expect("finite");
        let scale = sigma[0].max(f64::MIN_POSITIVE);
        prop_assert!(sigma.windows(2).all(|pair| pair[0] >= pair[1]) && sigma.iter().all(|&s| s >= 0.0));
        let again = u.scale_columns(&sigma).mul(&v.transpose());
        for (a, b) in again.as_slice().iter().zip(matrix.as_slice()) {
            prop_assert!((a - b).abs() <= 1e-13 * scale, "{a} {b}");
        }
        let seen = sigma.iter().filter(|&&s| s > 1e-14 * scale).count();
        let left: Vec<&[f64]> = (0..seen).map(|k| u.column(k)).collect();
        for (i, a) in left.iter().enumerate() {
            prop_assert!(left[..i].iter().all(|b| dot(a, b).abs() <= 1e-14));
        }
        let gram = v.transpose().mul(&v);
        for (a, b) in gram.as_slice().iter().zip(Matrix::identity(v.rows()).as_slice()) {
            prop_assert!((a - b).abs() <= 1e-13);
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn reproduces_the_matrix(
            rows in 1_usize..8, columns in 1_usize..8, entries in prop::collection::vec(-1.0..1.0_f64, 64),
            decades in prop::collection::vec(-12..3_i32, 8), twin in any::<bool>(),
        ) {
            let mut matrix = Matrix::zeros(rows, columns);
            for j in 0..columns {
                for i in 0..rows {
                    matrix[(i, j)] = entries[i + 8 * j] * 10_f64.powi(decades[j]);
                }
            }
            if twin && columns > 1 {
                let first = matrix.column(0).to_vec();
                matrix.column_mut(columns - 1).copy_from_slice(&first);
            }
            check(&matrix)?;
        }
    }

    #[test]
    fn extremes() {
        check(&Matrix::from_rows(2, &[[3e200, 0.0], [4e200, 1e200]])).unwrap();
        check(&Matrix::from_rows(2, &[[3e-200, 0.0], [4e-200, 1e-200]])).unwrap();
        check(&Matrix::zeros(3, 2)).unwrap();
        assert_eq!(svd(&Matrix::zeros(0, 2)).unwrap().sigma, [0.0, 0.0]);
        assert!(svd(&Matrix::zeros(0, 0)).unwrap().sigma.is_empty());
        assert_eq!(svd(&Matrix::from_rows(1, &[[f64::NAN]])), Err(LinalgError::NotFinite));
        assert_eq!(svd(&Matrix::from_rows(1, &[[f64::INFINITY]])), Err(LinalgError::NotFinite));
    }

    #[test]
    fn a_wide_matrix_has_its_whole_null_space() {
        let decomposition = svd(&Matrix::from_rows(3, &[[1.0, 2.0, 2.0]])).unwrap();
        assert!((decomposition.sigma[0] - 3.0).abs() < 1e-15);
        assert!(decomposition.sigma[1] < 1e-15 && decomposition.sigma[2] < 1e-15);
        for k in 1..3 {
            let v = decomposition.v.column(k);
            assert!((v[0] + 2.0 * v[1] + 2.0 * v[2]).abs() < 1e-15);
        }
    }
}
