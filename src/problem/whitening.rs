//! The whitening of one row's equations, whatever their covariance.
//!
//! The covariance W = M Mᵀ + E of a row's equations is taken apart by the singular values of N⁻¹[M E^½], N its standard
//! deviations. What has no variance (a singular value below 1e-8 of the largest) is a condition that no error can violate.
//! If it holds by itself, whatever the parameters, the equations said something twice, and it is left out. If parameters
//! change it, it would determine them without error, which no measurement does.

use super::propagated::DEPENDENT;
use crate::linalg::{LinalgError, Matrix, dot, norm, svd};

/// What has less than this share of the largest standard deviation has none.
const NONE: f64 = 1e-8;

/// T with T M Mᵀ Tᵀ = 1, and what is left out of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Whitening {
    /// T, row by row.
    pub(super) rows: Vec<Vec<f64>>,
    /// The conditions that have no variance.
    pub(super) without: Vec<Vec<f64>>,
}

/// Whitens. Where every condition has a variance, T is the inverse of the triangular factor, as for a block of rows.
pub(super) fn whitening(mixed: &[Vec<f64>]) -> Result<Whitening, LinalgError> {
    let (m, width) = (mixed.len(), mixed.first().map_or(0, Vec::len));
    if let Some(l) = triangular(mixed) {
        return Ok(Whitening { rows: inverse(&l), without: Vec::new() });
    }
    let size = |row: &Vec<f64>| Some(norm(row)).filter(|size| *size > 0.0).unwrap_or(1.0);
    let sizes: Vec<f64> = mixed.iter().map(size).collect();
    let scaled: Vec<Vec<f64>> =
        mixed.iter().zip(&sizes).map(|(row, size)| row.iter().map(|x| x / size).collect()).collect();
    // columns are equations, so that U has what errors do to them and V which equations these are
    let found = svd(&Matrix::from_columns(width, &scaled))?;
    let largest = found.sigma.first().copied().unwrap_or(0.0);
    let (mut rows, mut without) = (Vec::with_capacity(m), Vec::new());
    for (at, &size) in found.sigma.iter().enumerate() {
        let of =
            |factor: f64| -> Vec<f64> { found.v.column(at).iter().zip(&sizes).map(|(v, n)| factor * v / n).collect() };
        if size > NONE * largest {
            rows.push(of(1.0 / size));
        } else {
            without.push(of(1.0));
        }
    }
    Ok(Whitening { rows, without })
}

/// L with L Lᵀ = M Mᵀ; none where a pivot is so small that blocks of rows leave the row alone.
fn triangular(mixed: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut l: Vec<Vec<f64>> = Vec::with_capacity(mixed.len());
    for (i, row) in mixed.iter().enumerate() {
        let mut own: Vec<f64> = Vec::with_capacity(i + 1);
        for (j, other) in mixed[..=i].iter().enumerate() {
            let known: f64 = (0..j).map(|k| own[k] * if i == j { own[k] } else { l[j][k] }).sum();
            let product = dot(row, other);
            let rest = product - known;
            if i > j {
                own.push(rest / l[j][j]);
            } else if rest > DEPENDENT * product {
                own.push(rest.sqrt());
            } else {
                return None;
            }
        }
        l.push(own);
    }
    Some(l)
}

/// L⁻¹, row by row.
fn inverse(l: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = l.len();
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(m);
    for i in 0..m {
        let mut row = vec![0.0; m];
        row[i] = 1.0 / l[i][i];
        for j in 0..i {
            row[j] = -(j..i).map(|k| l[i][k] * rows[k][j]).sum::<f64>() / l[i][i];
        }
        rows.push(row);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// T M Mᵀ Tᵀ
    fn covariance(whitening: &[Vec<f64>], mixed: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let width = mixed[0].len();
        let rows: Vec<Vec<f64>> = whitening
            .iter()
            .map(|t| (0..width).map(|j| t.iter().zip(mixed).map(|(t, row)| t * row[j]).sum()).collect())
            .collect();
        rows.iter().map(|a| rows.iter().map(|b| dot(a, b)).collect()).collect()
    }

    fn is_identity(matrix: &[Vec<f64>]) -> bool {
        let entry = |i: usize, j: usize, x: f64| (x - f64::from(u8::from(i == j))).abs() < 1e-12;
        matrix.iter().enumerate().all(|(i, row)| row.iter().enumerate().all(|(j, &x)| entry(i, j, x)))
    }

    #[test]
    fn whitened_equations_have_the_identity_as_covariance() {
        let mixed = vec![vec![2.0, 1.0, 0.0, -0.5], vec![0.3, -1.0, 4.0, 0.0], vec![1.0, 1.0, 1.0, 1.0]];
        let Whitening { rows: t, without } = whitening(&mixed).unwrap();
        assert!(is_identity(&covariance(&t, &mixed)) && t.len() == 3 && without.is_empty());
    }

    #[test]
    fn what_is_said_twice_or_without_error_is_left_out() {
        // the third is the sum of the others, the fourth has no error
        let mixed = vec![vec![1.0, 2.0], vec![-1.0, 0.5], vec![0.0, 2.5], vec![0.0, 0.0]];
        let Whitening { rows: t, without } = whitening(&mixed).unwrap();
        assert!(is_identity(&covariance(&t, &mixed)));
        assert_eq!((t.len(), without.len()), (2, 2));
        for condition in without {
            let moved = (0..2).map(|j| condition.iter().zip(&mixed).map(|(c, row)| c * row[j]).sum::<f64>());
            assert!(moved.into_iter().all(|x| x.abs() < 1e-12));
        }
    }
}
