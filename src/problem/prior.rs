//! Gaussian priors: (q ⊖ nominal)/σ for the free coordinates that have one, and what other fits know of several together.

use super::solving::{number, turn};
use super::{Problem, rotation};
use crate::linalg::Matrix;

pub(super) struct Prior;

impl Problem<'_> {
    /// `to` ⊖ `from` for all coordinates: differences, and for a rotation log(R(from)ᵀ·R(to)). Coordinates that a point has not
    /// are not numbers.
    pub fn difference(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let mut difference: Vec<f64> =
            (0..self.layout.coordinates.len()).map(|c| number(to, c) - number(from, c)).collect();
        for group in &self.layout.groups {
            if let Some(first) = group.shape.rotation() {
                let at = group.first + first;
                difference[at..at + 3].copy_from_slice(&rotation::difference(turn(from, at), turn(to, at)));
            }
        }
        difference
    }
}

impl Prior {
    /// q ⊖ nominal for all coordinates.
    pub(super) fn offsets(problem: &Problem, q: &[f64]) -> Vec<f64> {
        let nominal: Vec<f64> = problem.layout.coordinates.iter().map(|c| c.nominal).collect();
        problem.difference(&nominal, q)
    }

    pub(super) fn sum_of_squares(problem: &Problem, q: &[f64]) -> f64 {
        let offsets = Prior::offsets(problem, q);
        let term = |&c: &usize| problem.layout.coordinates[c].sigma.map_or(0.0, |sigma| (offsets[c] / sigma).powi(2));
        let known = problem.known.iter().flat_map(|known| known.residuals(problem, q)).map(|r| r * r);
        problem.free.iter().map(term).sum::<f64>() + known.sum::<f64>()
    }

    /// The rows [J r] of the priors.
    pub(super) fn rows(problem: &Problem, q: &[f64]) -> Matrix {
        let n = problem.free.len();
        let offsets = Prior::offsets(problem, q);
        let place = problem.places();
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for &c in &problem.free {
            let coordinate = &problem.layout.coordinates[c];
            let Some(sigma) = coordinate.sigma else { continue };
            let mut row = vec![0.0; n + 1];
            let group = &problem.layout.groups[coordinate.group];
            match group.shape.rotation() {
                Some(first) if c - group.first >= first => {
                    let at = group.first + first;
                    let jacobian = rotation::right_jacobian_inverse(turn(&offsets, at));
                    for k in 0..3 {
                        if let Some(column) = place[at + k] {
                            row[column] = jacobian[c - at][k] / sigma;
                        }
                    }
                }
                _ => {
                    if let Some(column) = place[c] {
                        row[column] = 1.0 / sigma;
                    }
                }
            }
            row[n] = offsets[c] / sigma;
            rows.push(row);
        }
        for known in problem.known.iter() {
            known.push_rows(problem, q, &mut rows);
        }
        Matrix::from_rows(n + 1, &rows)
    }
}
