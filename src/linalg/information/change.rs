//! What else is done with a square-root information matrix: rows taken out, another origin, other parameters.

use super::SquareRootInformation;
use crate::linalg::matrix::add_scaled;
use crate::linalg::{LinalgError, Matrix, dot, same_size, svd};

/// Numbers below this many units of rounding of their column are zero.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

impl SquareRootInformation {
    /// Takes out rows that were absorbed: RᵀR − R'ᵀR' by hyperbolic rotations, row by row, in the mixed form that is stable
    /// (Chambers, J. Amer. Statist. Assoc. 66, 1971, 744; Golub & Van Loan, §6.5.4): with s = xₖ/rₖₖ and c² = 1 − s²,
    ///
    /// rₖ ← (rₖ − s x)/c,  x ← c x − s rₖ.
    ///
    /// A direction that only these rows saw is left with nothing: what remains of its pivot is rounding, and is zero.
    ///
    /// ```
    /// use phical::linalg::{Matrix, SquareRootInformation};
    /// let of = |rows: &[[f64; 2]]| {
    ///     let mut information = SquareRootInformation::new(1);
    ///     information.absorb(&mut Matrix::from_rows(2, rows)).map(|()| information)
    /// };
    /// let mut all = of(&[[1.0, -1.0], [1.0, -3.0]])?;
    /// all.remove(&of(&[[1.0, -3.0]])?)?;
    /// assert!((all.r()[(0, 0)].abs() - 1.0).abs() < 1e-15 && all.rest() < 1e-14);
    /// assert!(all.remove(&of(&[[2.0, 0.0]])?).is_err());
    /// # Ok::<(), phical::linalg::LinalgError>(())
    /// ```
    ///
    /// # Errors
    /// Where the dimensions differ, or the rows are not among those absorbed; nothing is taken out then.
    pub fn remove(&mut self, other: &Self) -> Result<(), LinalgError> {
        same_size(self.dimension(), other.dimension())?;
        let rows = self.rows.checked_sub(other.rows).ok_or(LinalgError::NotAbsorbed)?;
        self.remove_by_rotations(other, rows).or_else(|_| self.remove_by_squares(other, rows))
    }

    /// The same by the eigenvalues of what is left, RᵀR − R'ᵀR' with columns of length one. It has all that rounding leaves where
    /// nearly nothing is left of a direction, where rotations break down; what few rows saw of a direction has fewer digits.
    fn remove_by_squares(&mut self, other: &Self, rows: usize) -> Result<(), LinalgError> {
        let n = self.dimension();
        let augmented = |of: &Self| {
            let mut all: Vec<Vec<f64>> =
                (0..n).map(|i| (0..n).map(|j| of.r[(i, j)]).chain([of.d[i]]).collect()).collect();
            all.push((0..n).map(|_| 0.0).chain([of.rest.sqrt()]).collect());
            Matrix::from_rows(n + 1, &all)
        };
        let all = augmented(self);
        let lengths: Vec<f64> =
            all.column_norms().into_iter().map(|length| if length > 0.0 { length } else { 1.0 }).collect();
        let inverse: Vec<f64> = lengths.iter().map(|length| 1.0 / length).collect();
        let (all, less) = (all.scale_columns(&inverse), augmented(other).scale_columns(&inverse));
        let entry = |i: usize, j: usize| dot(all.column(i), all.column(j)) - dot(less.column(i), less.column(j));
        let left: Vec<Vec<f64>> = (0..=n).map(|i| (0..=n).map(|j| entry(i, j)).collect()).collect();
        let found = svd(&Matrix::from_rows(n + 1, &left))?;
        let mut factor = Vec::new();
        for (k, &sigma) in found.sigma.iter().enumerate() {
            if sigma <= (n + 1) as f64 * ROUNDING {
                continue;
            }
            // of a symmetric matrix the sign of an eigenvalue is that of uᵀv
            if dot(found.u.column(k), found.v.column(k)) < 0.5 {
                return Err(LinalgError::NotAbsorbed);
            }
            let root = sigma.sqrt();
            factor
                .push(found.v.column(k).iter().zip(&lengths).map(|(v, length)| root * v * length).collect::<Vec<_>>());
        }
        let d: Vec<f64> = factor.iter().map(|row| row[n]).collect();
        let mut left = Self::from_rows(&Matrix::from_rows(n, &factor), &d)?;
        left.rows = rows;
        *self = left;
        Ok(())
    }

    fn remove_by_rotations(&mut self, other: &Self, rows: usize) -> Result<(), LinalgError> {
        let n = self.dimension();
        let size = dot(&self.d, &self.d) + self.rest;
        let mut left = self.clone();
        left.sink_empty_pivots();
        let lengths = self.r.column_norms();
        for i in 0..n {
            let mut x: Vec<f64> = (0..n).map(|j| other.r[(i, j)]).chain([other.d[i]]).collect();
            for k in 0..n {
                left.take_out(&mut x, k, &lengths)?;
            }
            left.rest -= x[n] * x[n];
        }
        left.rest -= other.rest;
        // where little is left of a pivot d has an error that the rest makes good; below zero it cannot
        if left.rest < -((n + 1) as f64 * ROUNDING * size) {
            return Err(LinalgError::NotAbsorbed);
        }
        left.rest = left.rest.max(0.0);
        left.rows = rows;
        *self = left;
        Ok(())
    }

    /// One hyperbolic rotation, which makes x\[k\] zero.
    fn take_out(&mut self, x: &mut [f64], k: usize, lengths: &[f64]) -> Result<(), LinalgError> {
        let n = self.dimension();
        let rounding = (n + 1) as f64 * ROUNDING * lengths[k];
        let pivot = self.r[(k, k)];
        if x[k].abs() <= rounding && pivot.abs() <= rounding {
            x[k] = 0.0;
            return Ok(());
        }
        let larger = pivot.abs().max(x[k].abs());
        let square = (pivot.abs() - x[k].abs()) * (pivot.abs() + x[k].abs());
        // squares are known to rounding of the square of the column
        if square < -16.0 * rounding * lengths[k] {
            return Err(LinalgError::NotAbsorbed);
        }
        if square <= rounding * larger {
            // nobody else saw this; what the row of R says of the others it says below, where the rest of x is taken out
            self.r[(k, k)] = 0.0;
            self.sink(k);
            x[k] = 0.0;
            return Ok(());
        }
        let (s, c) = (x[k] / pivot, square.sqrt() / pivot.abs());
        let turn = |r: &mut f64, x: &mut f64| {
            *r = (*r - s * *x) / c;
            *x = c * *x - s * *r;
        };
        for (j, x) in x.iter_mut().enumerate().take(n).skip(k) {
            turn(&mut self.r[(k, j)], x);
        }
        turn(&mut self.d[k], &mut x[n]);
        x[k] = 0.0;
        Ok(())
    }

    /// Rows of R whose pivot is zero are folded into those below, so that each pivot has all that its column has left.
    fn sink_empty_pivots(&mut self) {
        let rounding = (self.dimension() + 1) as f64 * ROUNDING;
        for (k, length) in self.r.column_norms().into_iter().enumerate() {
            if self.r[(k, k)].abs() <= rounding * length {
                self.sink(k);
            }
        }
    }

    /// Folds row k of R, without its pivot, into the rows below.
    fn sink(&mut self, k: usize) {
        let n = self.dimension();
        let mut x: Vec<f64> = (0..n).map(|j| if j > k { self.r[(k, j)] } else { 0.0 }).collect();
        let mut last = std::mem::take(&mut self.d[k]);
        for j in k..n {
            self.r[(k, j)] = 0.0;
        }
        for i in k + 1..n {
            let length = self.r[(i, i)].hypot(x[i]);
            if x[i] == 0.0 || length == 0.0 {
                continue;
            }
            let (c, s) = (self.r[(i, i)] / length, x[i] / length);
            let turn = |r: &mut f64, x: &mut f64| (*r, *x) = (c * *r + s * *x, c * *x - s * *r);
            for (j, x) in x.iter_mut().enumerate().skip(i) {
                turn(&mut self.r[(i, j)], x);
            }
            turn(&mut self.d[i], &mut last);
        }
        self.rest += last * last;
    }

    /// The same rows seen from δ on, d + R δ. On a manifold `turn` is the derivative of δ by what is added to it: R turn.
    ///
    /// # Errors
    /// Where sizes differ, or an entry is not finite.
    pub fn recentred(&self, delta: &[f64], turn: Option<&Matrix>) -> Result<Self, LinalgError> {
        same_size(self.dimension(), delta.len())?;
        let mut d = self.r.mul_vec(delta);
        add_scaled(&mut d, 1.0, &self.d);
        match turn {
            None => Self::from_parts(self.r.clone(), d, self.rest, self.rows),
            Some(turn) => self.refactored(&self.r.mul(turn), &d),
        }
    }

    /// The same rows without what they see of some directions: R M, where M projects these out.
    ///
    /// # Errors
    /// Where sizes differ, or an entry is not finite.
    pub fn mapped(&self, m: &Matrix) -> Result<Self, LinalgError> {
        same_size(self.dimension(), m.rows())?;
        self.refactored(&self.r.mul(m), &self.d)
    }

    /// The same rows among n parameters, of which these are the `columns`, in any order; the rows do not see the others.
    ///
    /// # Errors
    /// Where there are not as many columns as parameters, or one is beyond n or there twice.
    pub fn embedded(&self, n: usize, columns: &[usize]) -> Result<Self, LinalgError> {
        same_size(self.dimension(), columns.len())?;
        let mut to = Matrix::zeros(self.dimension(), n);
        let mut taken = vec![false; n];
        for (j, &column) in columns.iter().enumerate() {
            if column >= n || std::mem::replace(&mut taken[column], true) {
                return Err(LinalgError::Shape { expected: n, found: column });
            }
            to.column_mut(column).copy_from_slice(self.r.column(j));
        }
        self.refactored(&to, &self.d)
    }

    fn refactored(&self, a: &Matrix, d: &[f64]) -> Result<Self, LinalgError> {
        let mut all = Self::from_rows(a, d)?;
        all.rest += self.rest;
        all.rows = self.rows;
        Ok(all)
    }
}
