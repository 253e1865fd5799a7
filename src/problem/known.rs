//! What another fit has found out, as a joint Gaussian prior: the second step of a cascade of calibrations.
//!
//! Estimates q̂ with covariance C add ½‖R (q ⊖ q̂)‖² with RᵀR = C⁻¹ to what is minimised. Where these rows are all that the first
//! fit saw, linear in between, the second one ends where a common fit of all data would (Gelb, Applied Optimal Estimation (1974),
//! §4.2: information adds). Directions that the first fit could not see say nothing: R is that of the others, the pseudo-inverse of
//! C in units of the tolerances. Parameters that this problem has not are eliminated: what R says of the rest, whatever these are,
//! is the part of R that is orthogonal to their columns.

use super::layout::Layout;
use super::{Problem, rotation, solving::turn};
use crate::compile::Program;
use crate::diag::{Code, DataPlace, Diagnostic};
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, dot, svd};

/// The estimates of a fit and how well they are known, in reported units.
#[derive(Clone, Debug, Default)]
pub struct Estimates {
    /// The file, for messages.
    pub file: String,
    /// Names and values of all parameters, free and held.
    pub values: Vec<(String, f64)>,
    /// Those that were free.
    pub names: Vec<String>,
    /// Their covariance, by these names; of a rotation, of the turn about its own axes.
    pub covariance: Vec<Vec<f64>>,
    /// What counts as known well enough of each.
    pub tolerances: Vec<f64>,
    /// What nothing determined: unit vectors in units of the tolerances.
    pub null_directions: Vec<Vec<f64>>,
}

/// R and q̂ of the coordinates of a problem.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// The coordinates, by number.
    coordinates: Vec<usize>,
    /// q̂, with the declared values of coordinates that the fit has not.
    point: Vec<f64>,
    /// R, square.
    factor: Matrix,
    /// How many equations it gives.
    rank: usize,
}

impl Estimates {
    /// As knowledge of a problem's coordinates.
    ///
    /// # Errors
    /// Where none of its free parameters is one of the layout's, or something of them is known exactly.
    pub(super) fn read(&self, program: &Program, layout: &Layout) -> Result<Known, Box<Diagnostic>> {
        let wrong = |message: String, hint: &str| {
            let found = Diagnostic::error(Code::BadFitFile, message);
            Box::new(found.at_data(DataPlace::file(&self.file)).hint(hint))
        };
        let places: Vec<Option<usize>> = self.names.iter().map(|name| layout.find(name)).collect();
        if places.iter().all(Option::is_none) {
            let message = format!("`{}` estimated none of this model's parameters", self.file);
            return Err(wrong(message, "name a fit whose parameters have the names that they have here"));
        }
        let n = self.names.len();
        let of_all = |row: &Vec<f64>| row.len() == n;
        let sizes = [self.tolerances.len(), self.covariance.len()].iter().all(|size| *size == n);
        if !sizes || !self.covariance.iter().chain(&self.null_directions).all(of_all) {
            let message = format!("`{}` names {n} parameters and has numbers of others", self.file);
            return Err(wrong(message, "write the fit anew with `calibrate --out`"));
        }
        let singular = || {
            let message = format!("`{}` knows some of its parameters exactly, one by one or together", self.file);
            wrong(message, "hold what is known exactly by `--fix`, and fit the other parameters anew")
        };
        let unusable = |error: LinalgError| {
            let message = format!("what `{}` says of its parameters cannot be used: {error}", self.file);
            wrong(message, "write the fit anew with `calibrate --out`")
        };
        let (factor, rank) = self.factor(&places).map_err(unusable)?.ok_or_else(singular)?;
        let coordinates: Vec<usize> = places.iter().flatten().copied().collect();
        let unit = |c: usize| {
            let unit = program.units.unit(layout.coordinates[c].dimension);
            move |value: f64| program.units.to_internal(value, unit)
        };
        let per_unit: Vec<f64> = coordinates.iter().map(|&c| 1.0 / unit(c)(1.0)).collect();
        let mut point: Vec<f64> = layout.coordinates.iter().map(|c| c.nominal).collect();
        for (name, value) in &self.values {
            if let Some(c) = layout.find(name) {
                point[c] = unit(c)(*value);
            }
        }
        Ok(Known { coordinates, point, rank, factor: factor.scale_columns(&per_unit) })
    }

    /// R by those of the names that have a place, in reported units, and its rank; none where C is singular beyond what is invisible.
    fn factor(&self, places: &[Option<usize>]) -> Result<Option<(Matrix, usize)>, LinalgError> {
        let (n, hidden) = (self.names.len(), self.null_directions.len());
        // standard deviations balance best, and where something is invisible the tolerances say what is orthogonal to it
        let scale: Vec<f64> = match hidden {
            0 => (0..n).map(|i| self.covariance[i][i].max(0.0).sqrt()).collect(),
            _ => self.tolerances.clone(),
        };
        if scale.iter().any(|scale| scale.is_nan() || *scale <= 0.0) {
            return Ok(None);
        }
        let row = |i: usize| -> Vec<f64> { (0..n).map(|j| self.covariance[i][j] / (scale[i] * scale[j])).collect() };
        let covariance = svd(&Matrix::from_rows(n, &(0..n).map(row).collect::<Vec<_>>()))?;
        let seen = n.saturating_sub(hidden);
        let least = covariance.sigma.first().copied().unwrap_or(0.0) * n as f64 * 8.0 * f64::EPSILON;
        if covariance.sigma.iter().take(seen).any(|variance| *variance <= least) {
            return Ok(None);
        }
        // the rows vᵢᵀ/√λᵢ of the eigenvectors that were seen, by the scaled coordinates
        let column =
            |j: usize| -> Vec<f64> { (0..seen).map(|i| covariance.v[(j, i)] / covariance.sigma[i].sqrt()).collect() };
        let of = |wanted: bool| (0..n).filter(move |&j| places[j].is_some() == wanted);
        let others = svd(&Matrix::from_columns(seen, &of(false).map(column).collect::<Vec<_>>()))?;
        let largest = others.sigma.first().copied().unwrap_or(0.0);
        let eliminated = others.sigma.iter().take_while(|sigma| **sigma > largest * 1e-12).count();
        let remaining = |j: usize| {
            let mut column = column(j);
            for k in 0..eliminated {
                let along = dot(others.u.column(k), &column);
                column.iter_mut().zip(others.u.column(k)).for_each(|(entry, u)| *entry -= along * u);
            }
            column
        };
        let columns: Vec<Vec<f64>> = of(true).map(remaining).collect();
        let all = SquareRootInformation::from_rows(&Matrix::from_columns(seen, &columns), &vec![0.0; seen])?;
        let unscaled: Vec<f64> = of(true).map(|j| 1.0 / scale[j]).collect();
        // where something is invisible, what is known stands in any of the rows
        Ok(Some((all.r().scale_columns(&unscaled), (seen - eliminated).min(columns.len()))))
    }
}

impl Known {
    /// Which coordinates it is about, and its estimate of them.
    pub(super) fn values(&self) -> impl Iterator<Item = (usize, f64)> {
        self.coordinates.iter().map(|&c| (c, self.point[c]))
    }

    /// How many equations it gives.
    pub(super) fn rank(&self) -> usize {
        self.rank
    }

    /// R (q ⊖ q̂)
    pub(super) fn residuals(&self, problem: &Problem, q: &[f64]) -> Vec<f64> {
        let offsets = problem.difference(&self.point, q);
        self.factor.mul_vec(&self.coordinates.iter().map(|&c| offsets[c]).collect::<Vec<_>>())
    }

    /// Adds the rows \[J r\] by the free coordinates.
    pub(super) fn push_rows(&self, problem: &Problem, q: &[f64], rows: &mut Vec<Vec<f64>>) {
        let (n, place) = (problem.free.len(), problem.places());
        let offsets = problem.difference(&self.point, q);
        let residuals = self.residuals(problem, q);
        for (i, residual) in residuals.into_iter().enumerate() {
            let mut row = vec![0.0; n + 1];
            row[n] = residual;
            for (k, &c) in self.coordinates.iter().enumerate() {
                let group = &problem.layout.groups[problem.layout.coordinates[c].group];
                match group.shape.rotation().map(|first| group.first + first) {
                    Some(at) if c >= at => {
                        let jacobian = rotation::right_jacobian_inverse(turn(&offsets, at));
                        for j in 0..3 {
                            if let Some(column) = place[at + j] {
                                row[column] += self.factor[(i, k)] * jacobian[c - at][j];
                            }
                        }
                    }
                    _ => {
                        if let Some(column) = place[c] {
                            row[column] += self.factor[(i, k)];
                        }
                    }
                }
            }
            rows.push(row);
        }
    }
}
