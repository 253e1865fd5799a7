//! Gaussian priors: (q ⊖ nominal)/σ for the free coordinates that have one.

use super::{Problem, rotation};
use crate::linalg::Matrix;

pub(super) struct Prior;

impl Prior {
    /// q ⊖ nominal for all coordinates: differences, and for a rotation log(R(nominal)ᵀ·R(q)).
    pub(super) fn offsets(problem: &Problem, q: &[f64]) -> Vec<f64> {
        let coordinates = &problem.layout.coordinates;
        let mut offsets: Vec<f64> = q.iter().zip(coordinates).map(|(value, c)| value - c.nominal).collect();
        for group in &problem.layout.groups {
            if let Some(first) = group.shape.rotation() {
                let at = group.first + first;
                let nominal = [0, 1, 2].map(|k| coordinates[at + k].nominal);
                let turned = rotation::difference(nominal, [q[at], q[at + 1], q[at + 2]]);
                offsets[at..at + 3].copy_from_slice(&turned);
            }
        }
        offsets
    }

    pub(super) fn sum_of_squares(problem: &Problem, q: &[f64]) -> f64 {
        let offsets = Prior::offsets(problem, q);
        let term = |&c: &usize| problem.layout.coordinates[c].sigma.map_or(0.0, |sigma| (offsets[c] / sigma).powi(2));
        problem.free.iter().map(term).sum()
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
                    let jacobian = rotation::right_jacobian_inverse([offsets[at], offsets[at + 1], offsets[at + 2]]);
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
        Matrix::from_rows(n + 1, &rows)
    }
}
