//! The square-root information matrix: QR(\[J r\]) of any number of rows, kept in the space of n parameters.

use super::matrix::add_scaled;
use super::{LinalgError, Matrix, dot, norm, same_size};

/// The triangular factor R, the vector d and the remaining sum of squares of QR(\[J r\]):
/// ‖J δ + r‖² = ‖R δ + d‖² + rest for every δ.
///
/// ```
/// use phical::linalg::{Matrix, SquareRootInformation};
/// // r = (δ₁ − 1, 2 δ₂ + 4, 3), at δ = 0.
/// let mut rows = Matrix::from_rows(3, &[[1.0, 0.0, -1.0], [0.0, 2.0, 4.0], [0.0, 0.0, 3.0]]);
/// let mut information = SquareRootInformation::new(2);
/// information.absorb(&mut rows)?;
/// assert_eq!(information.cost(), 0.5 * (1.0 + 16.0 + 9.0));
/// assert_eq!(information.cost_at(&[1.0, -2.0]), 4.5);
/// # Ok::<(), phical::linalg::LinalgError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SquareRootInformation {
    r: Matrix,
    d: Vec<f64>,
    rest: f64,
    rows: usize,
}

/// Entries beyond this are refused: the sum of their squares would overflow.
const LARGEST: f64 = 1e150;

impl SquareRootInformation {
    /// No rows yet, for n parameters.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { r: Matrix::zeros(n, n), d: vec![0.0; n], rest: 0.0, rows: 0 }
    }

    /// QR(\[A d\]) of a whole matrix.
    ///
    /// # Errors
    /// As [`absorb`](Self::absorb).
    pub fn from_rows(a: &Matrix, d: &[f64]) -> Result<Self, LinalgError> {
        same_size(a.rows(), d.len())?;
        let mut columns: Vec<&[f64]> = (0..a.columns()).map(|j| a.column(j)).collect();
        columns.push(d);
        let mut information = Self::new(a.columns());
        information.absorb(&mut Matrix::from_columns(a.rows(), &columns))?;
        Ok(information)
    }

    /// From its parts, such as a file holds. Entries of `r` below the diagonal are set to zero.
    ///
    /// # Errors
    /// Where sizes differ, an entry is not finite or beyond 1e150, or `rest` is negative.
    pub fn from_parts(r: Matrix, d: Vec<f64>, rest: f64, rows: usize) -> Result<Self, LinalgError> {
        same_size(r.columns(), r.rows())?;
        same_size(r.columns(), d.len())?;
        let mut r = r;
        for j in 0..r.columns() {
            r.column_mut(j)[j + 1..].fill(0.0);
        }
        if !all_usable(r.as_slice()) || !all_usable(&d) || !(0.0..=f64::MAX).contains(&rest) {
            return Err(LinalgError::NotFinite);
        }
        Ok(Self { r, d, rest, rows })
    }

    /// Number of parameters n.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.d.len()
    }

    /// The triangular factor R, n × n, upper.
    #[must_use]
    pub fn r(&self) -> &Matrix {
        &self.r
    }

    /// The vector d: the residual at δ is R δ + d.
    #[must_use]
    pub fn d(&self) -> &[f64] {
        &self.d
    }

    /// The sum of squares that no δ can reduce.
    #[must_use]
    pub fn rest(&self) -> f64 {
        self.rest
    }

    /// How many rows were absorbed.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// ½‖r‖² = ½(‖d‖² + rest).
    #[must_use]
    pub fn cost(&self) -> f64 {
        0.5 * (dot(&self.d, &self.d) + self.rest)
    }

    /// ½‖J δ + r‖² = ½(‖R δ + d‖² + rest).
    #[must_use]
    pub fn cost_at(&self, delta: &[f64]) -> f64 {
        let mut at = self.r.mul_vec(delta);
        add_scaled(&mut at, 1.0, &self.d);
        0.5 * (dot(&at, &at) + self.rest)
    }

    /// Jᵀ r = Rᵀ d.
    #[must_use]
    pub fn gradient(&self) -> Vec<f64> {
        self.r.transpose_mul_vec(&self.d)
    }

    /// Folds a block of rows \[J r\], m × (n + 1), into the factor. The block is overwritten.
    ///
    /// # Errors
    /// Where the block has not n + 1 columns, or an entry is not finite or beyond 1e150; nothing is absorbed then.
    pub fn absorb(&mut self, block: &mut Matrix) -> Result<(), LinalgError> {
        same_size(self.dimension() + 1, block.columns())?;
        if !all_usable(block.as_slice()) {
            return Err(LinalgError::NotFinite);
        }
        let rows = block.rows();
        self.fold(block, |_| rows);
        self.rows += rows;
        Ok(())
    }

    /// Takes in the rows that another one has absorbed: QR of the stack (R, d) over (R', d').
    ///
    /// # Errors
    /// Where the dimensions differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), LinalgError> {
        let n = self.dimension();
        same_size(n, other.dimension())?;
        let mut block = Matrix::zeros(n, n + 1);
        for j in 0..n {
            block.column_mut(j).copy_from_slice(other.r.column(j));
        }
        block.column_mut(n).copy_from_slice(&other.d);
        self.fold(&mut block, |k| (k + 1).min(n));
        self.rest += other.rest;
        self.rows += other.rows;
        Ok(())
    }

    /// One Householder reflection per column k on row k of R and the first `height(k)` rows of the block, which are the
    /// only ones that can differ from zero in columns up to k. Golub & Van Loan, Matrix Computations (4th ed.), §5.1.2:
    /// with x = (α; b), β = −sign(α)‖x‖, v = (1; b/(α − β)), τ = (β − α)/β, the reflection 1 − τ v vᵀ takes x to (β; 0).
    fn fold(&mut self, block: &mut Matrix, height: impl Fn(usize) -> usize) {
        let n = self.dimension();
        for k in 0..n {
            let height_k = height(k);
            let sigma = norm(&block.column(k)[..height_k]);
            if sigma == 0.0 {
                continue;
            }
            let alpha = self.r[(k, k)];
            let beta = -alpha.hypot(sigma).copysign(alpha);
            let tau = (beta - alpha) / beta;
            let pivot = alpha - beta;
            for entry in &mut block.column_mut(k)[..height_k] {
                *entry /= pivot;
            }
            self.r[(k, k)] = beta;
            for j in k + 1..=n {
                let (v, column) = block.pair_mut(k, j);
                let (v, column) = (&v[..height_k], &mut column[..height_k]);
                let top = if j < n { &mut self.r[(k, j)] } else { &mut self.d[k] };
                let s = tau * (*top + dot(v, column));
                *top -= s;
                add_scaled(column, -s, v);
            }
        }
        self.rest += dot(block.column(n), block.column(n));
    }
}

/// Finite, and small enough to be squared and summed.
fn all_usable(entries: &[f64]) -> bool {
    entries.iter().all(|entry| entry.abs() <= LARGEST)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A block of `rows` × (n + 1) filled from a list.
    fn block(rows: usize, n: usize, entries: &[f64]) -> Matrix {
        Matrix::from_columns(rows, &(0..=n).map(|j| &entries[j * rows..(j + 1) * rows]).collect::<Vec<_>>())
    }

    fn close(a: f64, b: f64, scale: f64) -> bool {
        (a - b).abs() <= 1e-13 * scale
    }

    proptest! {
        /// ‖J δ + r‖² is the same by rows and by factor, however the rows are cut, and RᵀR = JᵀJ.
        #[test]
        fn keeps_every_sum_of_squares(
            rows in 1_usize..20, n in 1_usize..6, cut in 0_usize..20,
            entries in prop::collection::vec(-1.0..1.0_f64, 20 * 6), delta in prop::collection::vec(-2.0..2.0_f64, 6),
        ) {
            let whole = block(rows, n, &entries);
            let cut = cut.min(rows);
            let part = |range: std::ops::Range<usize>| {
                Matrix::from_columns(range.len(), &(0..=n).map(|j| &whole.column(j)[range.clone()]).collect::<Vec<_>>())
            };
            let (mut once, mut twice) = (SquareRootInformation::new(n), SquareRootInformation::new(n));
            let (mut head, mut tail) = (SquareRootInformation::new(n), SquareRootInformation::new(n));
            once.absorb(&mut whole.clone()).unwrap();
            twice.absorb(&mut part(0..cut)).unwrap();
            twice.absorb(&mut part(cut..rows)).unwrap();
            head.absorb(&mut part(0..cut)).unwrap();
            tail.absorb(&mut part(cut..rows)).unwrap();
            head.merge(&tail).unwrap();

            let mut at = delta[..n].to_vec();
            at.push(1.0);
            let residual = whole.mul_vec(&at);
            let expected = 0.5 * dot(&residual, &residual);
            let j = Matrix::from_columns(rows, &(0..n).map(|j| whole.column(j)).collect::<Vec<_>>());
            let gradient = j.transpose_mul_vec(whole.column(n));
            for information in [&once, &twice, &head] {
                prop_assert!(close(information.cost_at(&delta[..n]), expected, 1.0 + expected));
                prop_assert!(close(information.cost(), information.cost_at(&vec![0.0; n]), 1.0 + expected));
                prop_assert_eq!(information.rows(), rows);
                let gram = information.r().transpose().mul(information.r());
                let wanted = j.transpose().mul(&j);
                for (a, b) in gram.as_slice().iter().zip(wanted.as_slice()) {
                    prop_assert!(close(*a, *b, 20.0));
                }
                for (a, b) in information.gradient().iter().zip(&gradient) {
                    prop_assert!(close(*a, *b, 20.0));
                }
                for k in 0..n {
                    prop_assert!(information.r().column(k)[k + 1..].iter().all(|&entry| entry == 0.0));
                }
            }
        }
    }

    #[test]
    fn refuses_what_is_not_finite_and_stays_as_it_was() {
        let mut information = SquareRootInformation::new(1);
        information.absorb(&mut Matrix::from_rows(2, &[[2.0, 1.0]])).unwrap();
        let before = information.clone();
        for bad in [f64::NAN, f64::INFINITY, 1e200] {
            assert_eq!(information.absorb(&mut Matrix::from_rows(2, &[[bad, 1.0]])), Err(LinalgError::NotFinite));
            assert_eq!(information.absorb(&mut Matrix::from_rows(2, &[[1.0, bad]])), Err(LinalgError::NotFinite));
        }
        assert!(information.absorb(&mut Matrix::zeros(1, 3)).is_err());
        assert!(information.merge(&SquareRootInformation::new(2)).is_err());
        assert_eq!(information, before);
    }

    #[test]
    fn large_and_small_entries_keep_their_digits() {
        for unit in [1e149, 1e-149, 1e-200] {
            let mut information = SquareRootInformation::new(2);
            let mut rows = Matrix::from_rows(3, &[[3.0 * unit, 0.0, 1.0], [4.0 * unit, 5.0 * unit, 2.0]]);
            information.absorb(&mut rows).unwrap();
            assert!((information.r()[(0, 0)].abs() / (5.0 * unit) - 1.0).abs() < 1e-15);
            assert!((information.r()[(1, 1)].abs() / (3.0 * unit) - 1.0).abs() < 1e-15);
            assert!(information.rest() < 1e-28);
        }
    }

    #[test]
    fn parts_round_trip() {
        let mut information = SquareRootInformation::new(2);
        information.absorb(&mut Matrix::from_rows(3, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 9.0, 9.0]])).unwrap();
        let again = SquareRootInformation::from_parts(
            information.r().clone(),
            information.d().to_vec(),
            information.rest(),
            information.rows(),
        );
        assert_eq!(again.as_ref(), Ok(&information));
        assert!(SquareRootInformation::from_parts(Matrix::zeros(2, 2), vec![0.0; 2], -1.0, 0).is_err());
        assert!(SquareRootInformation::from_parts(Matrix::zeros(2, 2), vec![f64::NAN; 2], 0.0, 0).is_err());
    }
}
