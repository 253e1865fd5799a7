//! Candidates as pieces of information, in coordinates where all of them together are the identity.

use crate::data::Stage;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, cholesky, dot, solve_upper_transposed};
use crate::problem::Execution;

/// Candidates that are looked at by one thread at a time.
const PIECE: usize = 64;

/// What each of some candidates would tell, and what is known without them.
///
/// Candidate i tells Mᵢ = AᵢᵀAᵢ of n coordinates, where the rows of Aᵢ are its whitened equations. With R the triangular factor of all
/// rows, priors among them, everything is kept as A R⁻¹: all candidates together are then the identity, so that sums Σ wᵢ Mᵢ are about
/// as well conditioned as designs are good, and a Cholesky factor of them loses few digits. Where it fails, the sum sees too little.
#[derive(Clone, Debug)]
pub struct Experiment {
    n: usize,
    /// whitened rows, one after the other
    rows: Vec<f64>,
    /// the first row of each candidate, and the end
    begin: Vec<usize>,
    /// rows of what is known beforehand
    prior: Vec<f64>,
    /// R
    factor: Matrix,
    execution: Execution,
}

impl Experiment {
    /// Tells how many of something are done.
    pub(super) fn tell(&self, what: &'static str, done: usize, all: usize) {
        self.execution.tell(Stage::Of { what, done: done as u64, all: all as u64 });
    }

    /// From the rows of each candidate (m × n numbers, row by row; m may differ) and those of what is known beforehand.
    ///
    /// # Errors
    /// Where sizes do not fit, a number is not finite, or all rows together do not see all n coordinates.
    pub fn new(
        n: usize,
        candidates: &[Vec<f64>],
        prior: &[f64],
        execution: &Execution,
    ) -> Result<Experiment, LinalgError> {
        let lengths = candidates.iter().map(Vec::len).chain([prior.len()]);
        if let Some(found) = lengths.into_iter().find(|length| n == 0 || length % n != 0) {
            return Err(LinalgError::Shape { expected: n, found });
        }
        let mut all = SquareRootInformation::new(n);
        for block in candidates.iter().map(Vec::as_slice).chain([prior]).filter(|block| !block.is_empty()) {
            let rows: Vec<Vec<f64>> = block.chunks(n).map(|row| row.iter().copied().chain([0.0]).collect()).collect();
            all.absorb(&mut Matrix::from_rows(n + 1, &rows))?;
        }
        let factor = all.r().clone();
        let mut whole = Experiment {
            n,
            rows: Vec::with_capacity(candidates.iter().map(Vec::len).sum()),
            begin: vec![0],
            prior: Vec::new(),
            factor,
            execution: execution.clone(),
        };
        for block in candidates {
            let rows = whole.transformed(block)?;
            whole.rows.extend(rows);
            whole.begin.push(whole.rows.len() / n);
        }
        whole.prior = whole.transformed(prior)?;
        Ok(whole)
    }

    /// How many candidates there are.
    #[must_use]
    pub fn candidates(&self) -> usize {
        self.begin.len() - 1
    }

    /// How many coordinates there are.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.n
    }

    /// −log det RᵀR: what to add to −log det of an information in these coordinates to have that in the given ones.
    pub(super) fn shift(&self) -> f64 {
        -2.0 * (0..self.n).map(|i| self.factor[(i, i)].abs().ln()).sum::<f64>()
    }

    /// Rows G as G R⁻¹.
    pub(super) fn transformed(&self, rows: &[f64]) -> Result<Vec<f64>, LinalgError> {
        let mut all = Vec::with_capacity(rows.len());
        for row in rows.chunks(self.n) {
            all.extend(solve_upper_transposed(&self.factor, row)?);
        }
        Ok(all)
    }

    /// The rows of a candidate.
    pub(super) fn rows(&self, candidate: usize) -> &[f64] {
        &self.rows[self.begin[candidate] * self.n..self.begin[candidate + 1] * self.n]
    }

    /// What is known beforehand.
    pub(super) fn beforehand(&self) -> Information {
        let mut all = Information { n: self.n, entries: vec![0.0; self.n * self.n] };
        all.add(&self.prior, 1.0);
        all
    }

    /// M₀ + Σ wᵢ Mᵢ.
    pub(super) fn weighted(&self, weights: &[f64]) -> Information {
        let mut all = self.beforehand();
        for (candidate, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
            all.add(self.rows(candidate), *weight);
        }
        all
    }

    /// The same of some candidates, each once.
    pub(super) fn of(&self, chosen: &[usize]) -> Information {
        let mut all = self.beforehand();
        chosen.iter().for_each(|&candidate| all.add(self.rows(candidate), 1.0));
        all
    }

    /// ‖Aᵢ Gᵀ‖² of every candidate; `directions` are the rows of G.
    pub(super) fn seen(&self, directions: &[f64]) -> Vec<f64> {
        let pieces: Vec<usize> = (0..self.candidates().div_ceil(PIECE)).collect();
        let of = |&piece: &usize| {
            let until = self.candidates().min((piece + 1) * PIECE);
            (piece * PIECE..until).map(|i| squares(self.n, self.rows(i), directions)).collect::<Vec<f64>>()
        };
        self.execution.each(&pieces, of).into_iter().flatten().collect()
    }

    /// The same of what is known beforehand.
    pub(super) fn seen_beforehand(&self, directions: &[f64]) -> f64 {
        squares(self.n, &self.prior, directions)
    }
}

/// Σ (a·g)² over rows a and g.
fn squares(n: usize, rows: &[f64], directions: &[f64]) -> f64 {
    let of = |row: &[f64]| directions.chunks_exact(n).map(|g| dot(row, g).powi(2)).sum::<f64>();
    rows.chunks_exact(n).map(of).sum()
}

/// A Bᵀ of rows a and b of length n: by a and then by b.
pub(super) fn products(n: usize, a: &[f64], b: &[f64]) -> Vec<f64> {
    a.chunks_exact(n).flat_map(|a| b.chunks_exact(n).map(move |b| dot(a, b))).collect()
}

/// A symmetric matrix, row by row.
#[derive(Clone, Debug)]
pub(super) struct Information {
    pub(super) n: usize,
    entries: Vec<f64>,
}

impl Information {
    /// + weight Σ aᵀa over rows a.
    pub(super) fn add(&mut self, rows: &[f64], weight: f64) {
        for row in rows.chunks_exact(self.n) {
            for (line, a) in self.entries.chunks_exact_mut(self.n).zip(row) {
                let factor = weight * a;
                line.iter_mut().zip(row).for_each(|(entry, b)| *entry += factor * b);
            }
        }
    }

    /// + ε 1.
    pub(super) fn shifted(mut self, by: f64) -> Self {
        (0..self.n).for_each(|i| self.entries[i * self.n + i] += by);
        self
    }

    /// None where it is singular but for rounding.
    pub(super) fn inverse(&self) -> Option<Inverse> {
        let n = self.n;
        // symmetric, so rows are columns
        let columns: Vec<&[f64]> = self.entries.chunks_exact(n).collect();
        let l = cholesky(&Matrix::from_columns(n, &columns))?;
        let mut root = vec![0.0; n * n];
        for i in 0..n {
            let (above, row) = root.split_at_mut(i * n);
            row[i] = 1.0;
            for (k, line) in above.chunks_exact(n).enumerate() {
                let factor = l[(i, k)];
                row[..=k].iter_mut().zip(line).for_each(|(x, y)| *x -= factor * y);
            }
            row[..=i].iter_mut().for_each(|x| *x /= l[(i, i)]);
        }
        let log_determinant = 2.0 * (0..n).map(|i| l[(i, i)].ln()).sum::<f64>();
        let mut entries = Information { n, entries: vec![0.0; n * n] };
        entries.add(&root, 1.0);
        let finite = entries.entries.iter().all(|x| x.is_finite());
        finite.then_some(Inverse { n, root, entries: entries.entries, log_determinant })
    }
}

/// M⁻¹ = L⁻ᵀ L⁻¹.
#[derive(Clone, Debug)]
pub(super) struct Inverse {
    pub(super) n: usize,
    /// L⁻¹, row by row
    pub(super) root: Vec<f64>,
    /// M⁻¹, row by row
    pub(super) entries: Vec<f64>,
    /// log det M
    pub(super) log_determinant: f64,
}

impl Inverse {
    /// T M⁻¹ of rows T.
    pub(super) fn times(&self, rows: &[f64]) -> Vec<f64> {
        products(self.n, rows, &self.entries)
    }
}
