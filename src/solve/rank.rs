//! Numerical rank of a linearisation, and the directions that no residual sees.

use crate::linalg::{LinalgError, Matrix, SquareRootInformation, orthonormalise, svd};

/// Singular values of the column-normalised R below this share of the largest are zero.
///
/// A structural zero, at inputs consistent with the parameters, shows as 5e-17 to 1e-14: rounding of J, a few units times
/// √n. A direction that is merely weak, seen a million times worse than the best, shows as 1e-6 and must stay visible.
/// 1e-11 lies between, with three decades to the side where rounding grows with the problem and five to the other.
pub const RANK: f64 = 1e-11;

/// A column whose length, times the tolerance of its coordinate, is below this share of the longest is zero: what rounding
/// leaves of terms that cancel. Normalising it would turn rounding into a direction.
const ZERO_COLUMN: f64 = 1e-13;

/// The invisible directions of a linearisation.
#[derive(Debug, Clone, PartialEq)]
pub struct NullSpace {
    /// Orthonormal basis in tolerance-scaled coordinates z = δ/scale.
    pub basis: Vec<Vec<f64>>,
    /// Singular values of R with its columns normalised, largest first; a zero column counts as a zero.
    pub singular_values: Vec<f64>,
    /// Number of visible directions.
    pub rank: usize,
}

/// The directions that `information` does not see, by singular values of R with its columns normalised:
/// R C⁻¹ v ≈ 0 with C = diag‖Rⱼ‖ gives δ = C⁻¹ v and z = δ/scale. Columns that are zero are invisible by themselves.
///
/// # Errors
/// Where `scale` does not fit or is not positive.
pub fn null_space(information: &SquareRootInformation, scale: &[f64]) -> Result<NullSpace, LinalgError> {
    let n = information.dimension();
    if scale.len() != n {
        return Err(LinalgError::Shape { expected: n, found: scale.len() });
    }
    if scale.iter().any(|&scale| !(scale > 0.0 && scale.is_finite())) {
        return Err(LinalgError::NotFinite);
    }
    let norms = information.r().column_norms();
    let longest = norms.iter().zip(scale).fold(0.0_f64, |longest, (norm, scale)| longest.max(norm * scale));
    let (seen, zero): (Vec<usize>, Vec<usize>) =
        (0..n).partition(|&j| norms[j] > 0.0 && norms[j] * scale[j] > ZERO_COLUMN * longest);
    let columns: Vec<Vec<f64>> =
        seen.iter().map(|&j| information.r().column(j).iter().map(|entry| entry / norms[j]).collect()).collect();
    let decomposition = svd(&Matrix::from_columns(n, &columns))?;

    let mut singular_values = decomposition.sigma;
    let largest = singular_values.first().copied().unwrap_or(0.0);
    let rank = singular_values.iter().filter(|&&sigma| sigma > RANK * largest).count();
    let mut basis = Vec::with_capacity(n - rank);
    for k in rank..seen.len() {
        let mut z = vec![0.0; n];
        for (i, &j) in seen.iter().enumerate() {
            z[j] = decomposition.v[(i, k)] / (norms[j] / longest * scale[j]);
        }
        basis.push(z);
    }
    for j in zero {
        let mut z = vec![0.0; n];
        z[j] = 1.0;
        basis.push(z);
        singular_values.push(0.0);
    }
    orthonormalise(&mut basis);
    Ok(NullSpace { rank: n - basis.len(), basis, singular_values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(n: usize, rows: &[&[f64]]) -> SquareRootInformation {
        let mut information = SquareRootInformation::new(n);
        information.absorb(&mut Matrix::from_rows(n + 1, rows)).unwrap();
        information
    }

    #[test]
    fn fewer_rows_than_parameters() {
        // Only δ₁ + δ₂ is seen; tolerances 1 and 2, so z ∝ (1, −½).
        let null = null_space(&of(3, &[&[1.0, 1.0, 0.0]]), &[1.0, 2.0, 5.0]).unwrap();
        assert_eq!((null.rank, null.basis.len(), null.singular_values.len()), (1, 2, 3));
        let z = &null.basis[0];
        assert!((z[0] + 2.0 * z[1]).abs() < 1e-15 && (z[0].hypot(z[1]) - 1.0).abs() < 1e-15);
        assert_eq!(null.basis[1], [0.0, 0.0, 1.0]);
        assert_eq!(null_space(&SquareRootInformation::new(2), &[1.0, 1.0]).unwrap().rank, 0);
    }

    #[test]
    fn weak_is_visible_and_rounding_is_not() {
        for (weak, rank) in [(1e-6, 2), (1e-9, 2), (1e-14, 1), (5e-17, 1)] {
            let null = null_space(&of(2, &[&[1.0, 1.0], &[1.0, 1.0 + weak], &[1.0, 1.0 - weak]]), &[1.0, 1.0]);
            assert_eq!(null.unwrap().rank, rank, "{weak}");
        }
        // A column of rounding beside a column of ones.
        assert_eq!(null_space(&of(2, &[&[1.0, 1e-17], &[1.0, -1e-17]]), &[1.0, 1.0]).unwrap().basis, [[0.0, 1.0]]);
    }

    #[test]
    fn units_do_not_matter() {
        let rows = [[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 1.0, 1.0]];
        let plain = null_space(&of(3, &[&rows[0], &rows[1], &rows[2]]), &[1.0; 3]).unwrap();
        let units = [1e6, 1e-6, 1.0];
        let scaled = rows.map(|row| [row[0] * units[0], row[1] * units[1], row[2]]);
        let other = null_space(&of(3, &[&scaled[0], &scaled[1], &scaled[2]]), &units.map(|unit| 1.0 / unit)).unwrap();
        assert_eq!((plain.rank, other.rank), (2, 2));
        for (a, b) in plain.basis[0].iter().zip(&other.basis[0]) {
            assert!((a.abs() - b.abs()).abs() < 1e-14);
        }
    }

    #[test]
    fn bad_scales_are_refused() {
        let information = SquareRootInformation::new(2);
        assert!(null_space(&information, &[1.0]).is_err());
        assert!(null_space(&information, &[1.0, 0.0]).is_err());
        assert!(null_space(&information, &[1.0, f64::NAN]).is_err());
    }
}
