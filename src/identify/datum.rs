//! Another datum after the fit, without another fit.
//!
//! Where invisible directions N exist, which point of a family a fit gives is a choice. Going over to the choice in which the
//! coordinates P have given values is, for a straight family, the S-transformation (Baarda 1973): with S = I − N (N_P)⁻¹ E_P, where
//! E_P picks the coordinates P, values go q → q + N (N_P)⁻¹ (given − q_P) and covariances C → S C Sᵀ; those of P become zero, what the
//! data see stays as it is. A curved family is followed: the P go in steps, the others by Gauss–Newton so that the residuals of
//! fixed consistent inputs stay zero.

use super::walk::{Followers, allowance};
use crate::fit::Covariance;
use crate::linalg::LinalgError;
use crate::problem::{Problem, Undefined};
use crate::solve::LeastSquares;

/// The P go by no more than this many tolerances at a time.
const STEP: f64 = 50.0;
const MOST_STEPS: f64 = 200.0;

/// Where a change of datum leads.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// Every coordinate, in internal units.
    pub point: Vec<f64>,
    /// The root mean square of the residuals there, of inputs that were consistent before; zero but for rounding in a family.
    pub residual: f64,
    /// Whether it is.
    pub family: bool,
}

/// Moves from the start of a problem whose inputs are consistent with it, weights all alike, to where the coordinates of
/// `datum` (by their place among the free ones, as many as there are invisible directions) have the values of `wanted`.
///
/// # Errors
/// Where the residuals are undefined at the start.
pub fn change_datum(problem: &Problem, datum: &[usize], wanted: &[f64]) -> Result<Moved, Undefined> {
    let problem = problem.without_loss();
    let start = problem.start.clone();
    let allowed = allowance(&problem, &start)?;
    let mut target = start.clone();
    datum.iter().zip(wanted).for_each(|(&j, value)| target[problem.free[j]] = *value);
    let ways = problem.difference(&start, &target);
    let farthest = datum.iter().map(|&j| ways[problem.free[j]].abs() / problem.scale()[j]).fold(0.0, f64::max);
    let steps = (farthest / STEP).ceil().clamp(1.0, MOST_STEPS) as usize;
    let follow = Followers::new(&problem, datum);
    let (mut q, mut residual) = (start, 0.0);
    for step in 0..steps {
        let rest = problem.difference(&q, &target);
        let mut delta = vec![0.0; problem.free.len()];
        datum.iter().for_each(|&j| delta[j] = rest[problem.free[j]] / (steps - step) as f64);
        q = problem.retract(&q, &delta);
        if step + 1 == steps {
            // all the way, whatever rounding makes of the steps
            datum.iter().filter(|&&j| rest[problem.free[j]] != 0.0).for_each(|&j| {
                let c = problem.free[j];
                q[c] = target[c];
            });
        }
        match follow.correct(&q) {
            Some((corrected, left)) => (q, residual) = (corrected, left),
            None => return Ok(Moved { point: q, residual: f64::INFINITY, family: false }),
        }
    }
    Ok(Moved { point: q, residual, family: residual <= allowed })
}

/// S C Sᵀ: the covariance of a problem's free coordinates where those of `datum` are held. `basis` spans the invisible
/// directions in tolerances.
///
/// # Errors
/// Where the datum does not fix them.
pub fn held_datum(
    problem: &Problem,
    covariance: &Covariance,
    basis: &[Vec<f64>],
    datum: &[usize],
) -> Result<Covariance, LinalgError> {
    let scale = problem.scale();
    let in_units = |z: &Vec<f64>| z.iter().zip(scale).map(|(z, scale)| z * scale).collect::<Vec<f64>>();
    covariance.with_datum(&basis.iter().map(in_units).collect::<Vec<_>>(), datum)
}
