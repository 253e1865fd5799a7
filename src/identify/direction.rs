//! Directions with names and units.

use super::walk::Walk;
use crate::fit::{Term, movement, sentence};
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, norm, svd};
use crate::problem::Problem;

/// A direction whose singular value, columns normalised, is below this share of the largest is weak: visible to exact data, lost
/// in ordinary ones. Structural zeros lie at 1e-14 and below, ordinary calibrations above 1e-4.
pub const WEAK: f64 = 1e-5;

/// How far random points lie from the nominal values, to either side: in sizes of the value, and in tolerances.
pub const RANDOM_SPREAD: (f64, f64) = (0.05, 300.0);

/// A direction of the parameters.
#[derive(Clone, Debug)]
pub struct Direction {
    /// Its parameters with their weights, of a unit vector in tolerances.
    pub terms: Vec<Term>,
    /// What it means.
    pub sentence: String,
    /// Where it led, if it was followed.
    pub walk: Option<Walk>,
    /// Its singular value as a share of the largest, for one that is weak.
    pub seen: Option<f64>,
    /// The standard uncertainty along it, in tolerances.
    pub sigma: Option<f64>,
}

impl Direction {
    /// A direction of the free coordinates of a problem, a unit vector in tolerances.
    pub fn new(problem: &Problem, z: &[f64]) -> Direction {
        let terms = terms(problem, z);
        Direction { sentence: sentence(&terms), terms, walk: None, seen: None, sigma: None }
    }

    /// The same for one that is seen, but badly.
    pub(super) fn weak(problem: &Problem, z: &[f64], seen: f64, sigma: Option<f64>) -> Direction {
        let terms = terms(problem, &readable(z));
        let words = match sigma {
            Some(sigma) => format!("moving {} is known to {sigma:.2} tolerances only", movement(&terms)),
            None => format!("moving {} is seen {seen:.1e} times as well as what is seen best", movement(&terms)),
        };
        Direction { sentence: words, terms, walk: None, seen: Some(seen), sigma }
    }
}

/// The parameters of a direction, with their tolerances and units.
fn terms(problem: &Problem, z: &[f64]) -> Vec<Term> {
    let units = &problem.program.units;
    let named = problem.free.iter().zip(z).filter(|(_, weight)| weight.abs() > 1e-9);
    named
        .map(|(&c, weight)| {
            let coordinate = &problem.layout.coordinates[c];
            Term {
                name: coordinate.name.clone(),
                weight: *weight,
                tolerance: units.to_reported(coordinate.tolerance, coordinate.dimension),
                unit: units.symbol(coordinate.dimension),
                value: units.to_reported(problem.start[c], coordinate.dimension),
            }
        })
        .collect()
}

/// The largest components, as many as hold 99 % of the square, the largest positive.
fn readable(z: &[f64]) -> Vec<f64> {
    const TOLD: f64 = 0.99;
    let mut order: Vec<usize> = (0..z.len()).collect();
    order.sort_by(|&a, &b| z[b].abs().total_cmp(&z[a].abs()));
    let mut kept = vec![0.0; z.len()];
    let sign = order.first().map_or(1.0, |&j| z[j].signum());
    let mut square = 0.0;
    for j in order {
        if square >= TOLD {
            break;
        }
        square += z[j] * z[j];
        kept[j] = sign * z[j];
    }
    kept
}

/// Singular values of R with its columns normalised, as shares of the largest, each with its direction as a unit vector in
/// tolerances, best seen first; columns that are zero are left out.
///
/// # Errors
/// Where an entry is not finite.
pub fn spectrum(information: &SquareRootInformation, scale: &[f64]) -> Result<Vec<(f64, Vec<f64>)>, LinalgError> {
    let n = information.dimension();
    let norms = information.r().column_norms();
    let seen: Vec<usize> = (0..n).filter(|&j| norms[j] > 0.0).collect();
    let column = |&j: &usize| information.r().column(j).iter().map(|x| x / norms[j]).collect();
    let columns: Vec<Vec<f64>> = seen.iter().map(column).collect();
    let found = svd(&Matrix::from_columns(n, &columns))?;
    let largest = found.sigma.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let all = found.sigma.iter().enumerate().map(|(k, sigma)| {
        let mut z = vec![0.0; n];
        for (i, &j) in seen.iter().enumerate() {
            z[j] = found.v[(i, k)] / (norms[j] * scale[j]);
        }
        let length = norm(&z).max(f64::MIN_POSITIVE);
        z.iter_mut().for_each(|x| *x /= length);
        (sigma / largest, z)
    });
    Ok(all.collect())
}
