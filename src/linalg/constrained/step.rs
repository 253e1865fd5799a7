//! Step (2) and the multipliers of (3), from the QR of the working rows.

use super::Search;
use super::working::Factored;
use crate::linalg::matrix::add_scaled;
use crate::linalg::{
    LinalgError, Matrix, SquareRootInformation, dot, orthonormalise, reciprocal_condition, solve_upper, svd,
};

impl Search<'_> {
    /// The part of (2) that meets the working rows.
    pub(super) fn correction(&self, factored: &Factored) -> Result<Vec<f64>, LinalgError> {
        let rows = self.conditions.rows;
        let t: Vec<f64> =
            factored.rows.iter().map(|&i| rows[i].right - dot(&rows[i].coefficients, &self.delta)).collect();
        let mut step = vec![0.0; self.delta.len()];
        for (&j, s) in factored.free.iter().zip(factored.onto(&t)) {
            step[j] = s / self.lengths[j];
        }
        if step.iter().all(|s| s.is_finite()) { Ok(step) } else { Err(LinalgError::NotFinite) }
    }

    /// (2)
    pub(super) fn step(&self) -> Result<Vec<f64>, LinalgError> {
        let factored = self.working_rows();
        let mut step = self.correction(&factored)?;
        let null = factored.null();
        if null.is_empty() {
            return Ok(step);
        }
        // Z with its columns back in δ.
        let z: Vec<Vec<f64>> = null
            .iter()
            .map(|direction| {
                let mut full = vec![0.0; self.delta.len()];
                factored.free.iter().zip(direction).for_each(|(&j, entry)| full[j] = entry / self.lengths[j]);
                full
            })
            .collect();
        let mut columns: Vec<Vec<f64>> = z.iter().map(|direction| self.a.mul_vec(direction)).collect();
        let mut residual = self.residual();
        add_scaled(&mut residual, 1.0, &self.a.mul_vec(&step));
        columns.push(residual);
        let mut information = SquareRootInformation::new(z.len());
        information.absorb(&mut Matrix::from_columns(self.d.len(), &columns))?;
        let (y, mut unseen) = shortest(&information)?;
        for (direction, y) in z.iter().zip(&y) {
            add_scaled(&mut step, *y, direction);
        }
        if !unseen.is_empty() {
            // Shortest in C s; the part along what is unseen makes it longer than need be in s.
            for direction in &mut unseen {
                let mut full = vec![0.0; self.delta.len()];
                z.iter().zip(direction.iter()).for_each(|(z, share)| add_scaled(&mut full, *share, z));
                *direction = full;
            }
            orthonormalise(&mut unseen);
            for direction in &unseen {
                let along = dot(direction, &step);
                add_scaled(&mut step, -along, direction);
            }
        }
        Ok(step)
    }

    /// ν and μ of (3).
    pub(super) fn multipliers(&self) -> Result<(Vec<f64>, Vec<f64>), LinalgError> {
        let factored = self.working_rows();
        let mut nu = self.a.transpose_mul_vec(&self.residual());
        let negative: Vec<f64> = factored.free.iter().map(|&j| -nu[j] / self.lengths[j]).collect();
        let mut mu = vec![0.0; self.working.len()];
        for (&i, weight) in factored.rows.iter().zip(factored.combination(&negative)) {
            mu[i] = weight;
            add_scaled(&mut nu, weight, &self.conditions.rows[i].coefficients);
        }
        if mu.iter().all(|mu| mu.is_finite()) { Ok((nu, mu)) } else { Err(LinalgError::NotFinite) }
    }
}

/// The shortest y that minimises ‖R y + d‖, and an orthonormal basis of what R does not see. R is A Z with columns of A C⁻¹ and of Z
/// of length one, so that what is left of a column that cancels is rounding by itself, whatever the others are.
fn shortest(information: &SquareRootInformation) -> Result<(Vec<f64>, Vec<Vec<f64>>), LinalgError> {
    let p = information.dimension();
    // Singular values below this share of the largest are rounding of the columns.
    let negligible = 10.0 * p as f64 * f64::EPSILON;
    let negative: Vec<f64> = information.d().iter().map(|d| -d).collect();
    let all_seen = information.r().column_norms().iter().all(|&length| length > negligible);
    if all_seen && reciprocal_condition(information.r()) > negligible {
        return Ok((solve_upper(information.r(), &negative)?, Vec::new()));
    }
    let decomposition = svd(information.r())?;
    let (mut y, mut unseen) = (vec![0.0; p], Vec::new());
    for (k, &sigma) in decomposition.sigma.iter().enumerate() {
        let v = decomposition.v.column(k);
        if sigma > negligible * decomposition.sigma[0].max(1.0) {
            add_scaled(&mut y, dot(decomposition.u.column(k), &negative) / sigma, v);
        } else {
            unseen.push(v.to_vec());
        }
    }
    Ok((y, unseen))
}
