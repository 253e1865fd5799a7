//! The square-root information matrix: QR(\[J r\]) of any number of rows, kept in the space of n parameters.

use super::matrix::add_scaled;
use super::reflect::{Fold, GROUP, LARGEST, Scan};
use super::{LinalgError, Matrix, dot, same_size};
use crate::simd::InstructionSet;

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
        let rows = block.rows();
        self.absorb_block(InstructionSet::detect(), block.as_mut_slice(), rows, rows)
    }

    /// Folds a block of rows \[J r\] into the factor: n + 1 columns, each `rows` long, in a slice where one begins `ld`
    /// entries after the other. All of the slice is overwritten. Nothing is copied or allocated where `ld` is a multiple of
    /// eight and few columns are zero; it is fastest where, besides, the slice begins on a cache line.
    ///
    /// # Errors
    /// Where the slice is not (n + 1) `ld` long, `rows` is more than `ld`, or an entry is not finite or beyond 1e150; nothing
    /// is absorbed then.
    pub fn absorb_block(
        &mut self,
        set: InstructionSet,
        block: &mut [f64],
        rows: usize,
        ld: usize,
    ) -> Result<(), LinalgError> {
        let n = self.dimension();
        let zeros = check(set, block, rows, ld, n + 1)?;
        if rows == 0 {
            return Ok(());
        }
        let l = n - zeros.min(n);
        // Reflections fill zero columns. Where they are many, the rows are first reduced to as many as there are others;
        // folding those costs at most l rows of n columns, twice for the overhead.
        if rows * (n * n - l * l) > 2 * l.next_multiple_of(GROUP) * n * n {
            let zero = |j: usize| block[j * ld..][..rows].iter().all(|&entry| entry == 0.0);
            let columns: Vec<usize> = (0..n).filter(|&j| !zero(j)).collect();
            for (to, &from) in columns.iter().chain([&n]).enumerate() {
                block.copy_within(from * ld..from * ld + rows, to * ld);
            }
            self.fold_columns(set, &columns, &mut block[..(columns.len() + 1) * ld], rows, ld);
        } else {
            self.fold(set, block, rows, ld);
        }
        self.rows += rows;
        Ok(())
    }

    /// Folds a block of rows \[J r\] whose columns are those of some parameters only, `columns`, in increasing order, and the
    /// residual; the others are zero. Otherwise as [`absorb_block`](Self::absorb_block).
    ///
    /// # Errors
    /// As [`absorb_block`](Self::absorb_block), and where `columns` do not increase or go beyond n.
    pub fn absorb_columns(
        &mut self,
        set: InstructionSet,
        columns: &[usize],
        block: &mut [f64],
        rows: usize,
        ld: usize,
    ) -> Result<(), LinalgError> {
        let n = self.dimension();
        if let Some(pair) = columns.windows(2).find(|pair| pair[0] >= pair[1]) {
            return Err(LinalgError::Shape { expected: pair[0] + 1, found: pair[1] });
        }
        if let Some(&last) = columns.last().filter(|&&last| last >= n) {
            return Err(LinalgError::Shape { expected: n, found: last + 1 });
        }
        check(set, block, rows, ld, columns.len() + 1)?;
        if columns.len() == n {
            self.fold(set, block, rows, ld);
        } else {
            self.fold_columns(set, columns, block, rows, ld);
        }
        self.rows += rows;
        Ok(())
    }

    /// Takes in the rows that another one has absorbed: QR of the stack (R, d) over (R', d').
    ///
    /// # Errors
    /// Where the dimensions differ.
    pub fn merge(&mut self, other: &Self) -> Result<(), LinalgError> {
        same_size(self.dimension(), other.dimension())?;
        let all: Vec<usize> = (0..self.dimension()).collect();
        self.fold_triangle(InstructionSet::detect(), &all, other);
        self.rows += other.rows;
        Ok(())
    }

    /// Folds a block with all columns.
    fn fold(&mut self, set: InstructionSet, block: &mut [f64], rows: usize, ld: usize) {
        let padded = rows.next_multiple_of(GROUP);
        let columns = self.dimension() + 1;
        if ld.is_multiple_of(GROUP) {
            if padded > rows {
                for column in block.chunks_exact_mut(ld) {
                    column[rows..padded].fill(0.0);
                }
            }
            let fold = Fold { r: &mut self.r, d: &mut self.d, block, ld, rows: padded, starts: None };
            self.rest += set.run(fold);
            return;
        }
        let mut copy = vec![0.0; padded * columns];
        for (from, to) in block.chunks_exact(ld).zip(copy.chunks_exact_mut(padded)) {
            to[..rows].copy_from_slice(&from[..rows]);
        }
        let block = &mut copy;
        self.rest += set.run(Fold { r: &mut self.r, d: &mut self.d, block, ld: padded, rows: padded, starts: None });
    }

    /// Folds a block with some columns: their own factor first, then its few rows.
    fn fold_columns(&mut self, set: InstructionSet, columns: &[usize], block: &mut [f64], rows: usize, ld: usize) {
        let mut local = Self::new(columns.len());
        local.fold(set, block, rows, ld);
        self.fold_triangle(set, columns, &local);
    }

    /// Folds the rows (R', d') of a factor whose parameters are `columns` of this one's.
    fn fold_triangle(&mut self, set: InstructionSet, columns: &[usize], other: &Self) {
        let n = self.dimension();
        let (rows, ld) = (columns.len(), columns.len().next_multiple_of(GROUP));
        let mut block = vec![0.0; ld * (n + 1)];
        for (local, &column) in columns.iter().enumerate() {
            block[column * ld..][..rows].copy_from_slice(other.r.column(local));
        }
        block[n * ld..][..rows].copy_from_slice(&other.d);
        let (r, d, block) = (&mut self.r, &mut self.d, &mut block);
        self.rest += set.run(Fold { r, d, block, ld, rows: ld, starts: Some(columns) });
        self.rest += other.rest;
    }
}

/// The number of columns that are zero, where sizes fit and all entries are usable.
fn check(set: InstructionSet, block: &[f64], rows: usize, ld: usize, columns: usize) -> Result<usize, LinalgError> {
    same_size(ld * columns, block.len())?;
    if rows > ld {
        return Err(LinalgError::Shape { expected: ld, found: rows });
    }
    set.run(Scan { block, ld, rows }).ok_or(LinalgError::NotFinite)
}

/// Finite, and small enough to be squared and summed.
fn all_usable(entries: &[f64]) -> bool {
    entries.iter().all(|entry| entry.abs() <= LARGEST)
}

mod change;
#[cfg(test)]
mod tests;
