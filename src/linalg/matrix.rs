//! A dense matrix stored column by column, and the few vector operations that go with it.

use std::ops::{Index, IndexMut};

/// A dense matrix of `f64`, stored column by column; `matrix[(i, j)]` is row i, column j.
///
/// ```
/// use phical::linalg::Matrix;
/// let a = Matrix::from_rows(2, &[[1.0, 2.0], [3.0, 4.0]]);
/// assert_eq!(a.column(1), [2.0, 4.0]);
/// assert_eq!(a.mul_vec(&[1.0, 1.0]), [3.0, 7.0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    rows: usize,
    columns: usize,
    data: Vec<f64>,
}

impl Matrix {
    /// All zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, data: vec![0.0; rows * columns] }
    }

    /// The identity.
    #[must_use]
    pub fn identity(n: usize) -> Self {
        let mut identity = Self::zeros(n, n);
        for i in 0..n {
            identity[(i, i)] = 1.0;
        }
        identity
    }

    /// From rows of equal length; entries that a short row lacks are zero, those beyond `columns` are left out.
    #[must_use]
    pub fn from_rows<Row: AsRef<[f64]>>(columns: usize, rows: &[Row]) -> Self {
        let mut matrix = Self::zeros(rows.len(), columns);
        for (i, row) in rows.iter().enumerate() {
            for (j, &entry) in row.as_ref().iter().take(columns).enumerate() {
                matrix[(i, j)] = entry;
            }
        }
        matrix
    }

    /// From columns of equal length; entries that a short column lacks are zero, those beyond `rows` are left out.
    #[must_use]
    pub fn from_columns<Column: AsRef<[f64]>>(rows: usize, columns: &[Column]) -> Self {
        let mut matrix = Self::zeros(rows, columns.len());
        for (j, column) in columns.iter().enumerate() {
            for (i, &entry) in column.as_ref().iter().take(rows).enumerate() {
                matrix[(i, j)] = entry;
            }
        }
        matrix
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Column j.
    #[must_use]
    pub fn column(&self, j: usize) -> &[f64] {
        &self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Column j, to be changed.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.rows..(j + 1) * self.rows]
    }

    /// Columns k < j, both to be changed.
    pub(super) fn both_mut(&mut self, k: usize, j: usize) -> (&mut [f64], &mut [f64]) {
        let (head, tail) = self.data.split_at_mut(j * self.rows);
        (&mut head[k * self.rows..(k + 1) * self.rows], &mut tail[..self.rows])
    }

    /// All entries, column by column.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.data
    }

    /// All entries, column by column, to be changed.
    pub(super) fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Whether every entry is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|entry| entry.is_finite())
    }

    /// The transpose.
    #[must_use]
    pub fn transpose(&self) -> Self {
        let mut transpose = Self::zeros(self.columns, self.rows);
        for j in 0..self.columns {
            for (i, &entry) in self.column(j).iter().enumerate() {
                transpose[(j, i)] = entry;
            }
        }
        transpose
    }

    /// A B.
    #[must_use]
    pub fn mul(&self, other: &Self) -> Self {
        let mut product = Self::zeros(self.rows, other.columns);
        for j in 0..other.columns {
            product.column_mut(j).copy_from_slice(&self.mul_vec(other.column(j)));
        }
        product
    }

    /// A x.
    #[must_use]
    pub fn mul_vec(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.rows];
        for (j, &x_j) in x.iter().enumerate().take(self.columns) {
            if x_j != 0.0 {
                add_scaled(&mut product, x_j, self.column(j));
            }
        }
        product
    }

    /// Aᵀ y.
    #[must_use]
    pub fn transpose_mul_vec(&self, y: &[f64]) -> Vec<f64> {
        (0..self.columns).map(|j| dot(self.column(j), y)).collect()
    }

    /// Column j times `factors[j]`: A diag(factors).
    #[must_use]
    pub fn scale_columns(&self, factors: &[f64]) -> Self {
        let mut scaled = self.clone();
        for (j, factor) in factors.iter().enumerate().take(self.columns) {
            for entry in scaled.column_mut(j) {
                *entry *= factor;
            }
        }
        scaled
    }

    /// Euclidean length of every column.
    #[must_use]
    pub fn column_norms(&self) -> Vec<f64> {
        (0..self.columns).map(|j| norm(self.column(j))).collect()
    }

    /// Frobenius norm.
    #[must_use]
    pub fn norm(&self) -> f64 {
        norm(&self.data)
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.data[i + j * self.rows]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.data[i + j * self.rows]
    }
}

/// Σ xᵢ yᵢ over the shorter of the two. Summed in eight lanes, always in the same order.
#[must_use]
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let (x, x_rest) = x[..x.len().min(y.len())].as_chunks::<8>();
    let (y, y_rest) = y.as_chunks::<8>();
    let mut lanes = [0.0; 8];
    for (a, b) in x.iter().zip(y) {
        for lane in 0..8 {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    // Where y is longer than x, what x has left over stands against y's next chunk.
    let y_rest = if let Some(next) = y.get(x.len()) { next.as_slice() } else { y_rest };
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(a, b)| a * b).sum();
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7])) + rest
}

/// y += a x.
pub(super) fn add_scaled(y: &mut [f64], a: f64, x: &[f64]) {
    for (y_i, x_i) in y.iter_mut().zip(x) {
        *y_i += a * x_i;
    }
}

/// Euclidean length, without overflow or underflow on the way.
#[must_use]
pub fn norm(x: &[f64]) -> f64 {
    /// Between these a sum of squares keeps all its digits.
    const SAFE: std::ops::Range<f64> = 1e-270..1e290;
    let squares = dot(x, x);
    if SAFE.contains(&squares) {
        return squares.sqrt();
    }
    let largest = x.iter().fold(0.0_f64, |largest, x_i| largest.max(x_i.abs()));
    if largest == 0.0 || !largest.is_finite() {
        // `max` drops a NaN; the sum of squares keeps it.
        return if squares.is_nan() { f64::NAN } else { largest };
    }
    let squares: f64 = x.iter().map(|x_i| (x_i / largest).powi(2)).sum();
    largest * squares.sqrt()
}

/// Makes vectors orthonormal in place (Gram–Schmidt, twice for orthogonality to rounding) and drops those that depend on
/// the ones before.
pub fn orthonormalise(vectors: &mut Vec<Vec<f64>>) {
    /// A vector that loses all but this share of its length depends on the others.
    const DEPENDENT: f64 = 1e-10;
    let mut done: Vec<Vec<f64>> = Vec::with_capacity(vectors.len());
    for mut vector in std::mem::take(vectors) {
        let length = norm(&vector);
        if length == 0.0 || !length.is_finite() {
            continue;
        }
        vector.iter_mut().for_each(|entry| *entry /= length);
        for _ in 0..2 {
            for other in &done {
                let along = dot(other, &vector);
                add_scaled(&mut vector, -along, other);
            }
        }
        let left = norm(&vector);
        if left > DEPENDENT {
            vector.iter_mut().for_each(|entry| *entry /= left);
            done.push(vector);
        }
    }
    *vectors = done;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_agree_with_the_definition() {
        let a = Matrix::from_rows(3, &[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        assert_eq!(a.mul(&a.transpose()), Matrix::from_rows(2, &[[14.0, 32.0], [32.0, 77.0]]));
        assert_eq!(a.mul(&Matrix::identity(3)), a);
        assert_eq!(a.transpose_mul_vec(&[1.0, -1.0]), [-3.0; 3]);
        assert_eq!(Matrix::from_columns(2, &[[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]), a);
        assert_eq!(a.scale_columns(&[1.0, 0.0, 2.0]).column(2), [6.0, 12.0]);
    }

    #[test]
    fn dot_takes_the_shorter_length() {
        let x: Vec<f64> = (1..=21).map(f64::from).collect();
        for n in 0..=21 {
            let expected: f64 = (1..=n).map(|i| f64::from(i * i)).sum();
            let n = usize::try_from(n).unwrap();
            assert_eq!(dot(&x[..n], &x[..n]), expected);
            assert_eq!(dot(&x[..n], &x), expected);
            assert_eq!(dot(&x, &x[..n]), expected);
        }
    }

    #[test]
    fn norm_neither_overflows_nor_underflows() {
        assert!((norm(&[3e200, 4e200]) / 5e200 - 1.0).abs() < 1e-15);
        assert!((norm(&[3e-200, 4e-200]) / 5e-200 - 1.0).abs() < 1e-15);
        assert_eq!(norm(&[]), 0.0);
        assert!(norm(&[f64::NAN, 1.0]).is_nan());
        assert_eq!(norm(&[f64::INFINITY, 1.0]), f64::INFINITY);
    }

    #[test]
    fn orthonormalise_drops_what_depends() {
        let mut vectors = vec![vec![1.0, 1.0, 0.0], vec![2.0, 2.0, 1e-14], vec![0.0, 0.0, 0.0], vec![0.0, 1.0, 1.0]];
        orthonormalise(&mut vectors);
        assert_eq!(vectors.len(), 2);
        assert!(dot(&vectors[0], &vectors[1]).abs() < 1e-16);
        assert!((norm(&vectors[1]) - 1.0).abs() < 1e-15);
    }
}
