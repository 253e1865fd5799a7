//! Solvers against published minima, and against what they must never do.

mod behaviour;
mod datum;
mod functions;
mod laws;
mod published;

use super::{LeastSquares, Settings, Solution, minimise};
use crate::linalg::{LinalgError, Matrix, SquareRootInformation};
use num_dual::DualDVec64;

/// Why a test function is undefined.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Refused {
    Domain,
    Linalg(LinalgError),
}

impl From<LinalgError> for Refused {
    fn from(error: LinalgError) -> Self {
        Self::Linalg(error)
    }
}

type Dual = DualDVec64;

/// Residuals over dual numbers, in ℝⁿ, with derivatives by dual numbers.
pub(super) struct Closure<F> {
    pub(super) residuals: F,
    pub(super) nominal: Vec<f64>,
    pub(super) scale: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    /// Invisible directions, where they are not to be judged from R.
    pub(super) invisible: Option<Vec<Vec<f64>>>,
    /// What the derivatives are multiplied by: not 1 for a wrong Jacobian.
    pub(super) mistake: f64,
}

impl<F: Fn(&[Dual]) -> Option<Vec<Dual>>> Closure<F> {
    pub(super) fn new(n: usize, residuals: F) -> Self {
        Self {
            residuals,
            nominal: vec![0.0; n],
            scale: vec![1.0; n],
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
            invisible: None,
            mistake: 1.0,
        }
    }

    pub(super) fn solve(&self, start: &[f64]) -> Solution<Vec<f64>> {
        minimise(self, start.to_vec(), &Settings::default()).expect("a start that is defined")
    }

    fn evaluate(&self, q: &[f64], derivatives: bool) -> Result<Vec<Dual>, Refused> {
        let n = q.len();
        let variables: Vec<Dual> = (0..n)
            .map(|j| {
                let variable = Dual::from_re(q[j]);
                if derivatives { variable.with_derivative(j, n) } else { variable }
            })
            .collect();
        (self.residuals)(&variables).ok_or(Refused::Domain)
    }
}

trait WithDerivative {
    fn with_derivative(self, j: usize, n: usize) -> Self;
}

impl WithDerivative for Dual {
    fn with_derivative(self, j: usize, n: usize) -> Self {
        let unit = nalgebra::DVector::from_fn(n, |i, _| if i == j { 1.0 } else { 0.0 });
        Dual::new(self.re, num_dual::Derivative::some(unit))
    }
}

impl<F: Fn(&[Dual]) -> Option<Vec<Dual>>> LeastSquares for Closure<F> {
    type Point = Vec<f64>;
    type Error = Refused;

    fn dimension(&self) -> usize {
        self.nominal.len()
    }

    fn cost(&self, q: &Vec<f64>) -> Result<f64, Refused> {
        Ok(0.5 * self.evaluate(q, false)?.iter().map(|r| r.re * r.re).sum::<f64>())
    }

    fn linearise(&self, q: &Vec<f64>) -> Result<SquareRootInformation, Refused> {
        let n = q.len();
        let residuals = self.evaluate(q, true)?;
        let mut block = Matrix::zeros(residuals.len(), n + 1);
        for (i, residual) in residuals.iter().enumerate() {
            let derivative = residual.eps.clone().unwrap_generic(nalgebra::Dyn(n), nalgebra::Const::<1>);
            for j in 0..n {
                block[(i, j)] = derivative[j] * self.mistake;
            }
            block[(i, n)] = residual.re;
        }
        let mut information = SquareRootInformation::new(n);
        information.absorb(&mut block)?;
        Ok(information)
    }

    fn retract(&self, q: &Vec<f64>, delta: &[f64]) -> Vec<f64> {
        (0..q.len()).map(|j| (q[j] + delta[j]).clamp(self.lower[j], self.upper[j])).collect()
    }

    fn offset(&self, q: &Vec<f64>) -> Vec<f64> {
        q.iter().zip(&self.nominal).map(|(q, nominal)| q - nominal).collect()
    }

    fn scale(&self) -> &[f64] {
        &self.scale
    }

    fn invisible(&self, _: &Vec<f64>, at: &SquareRootInformation) -> Result<Vec<Vec<f64>>, Refused> {
        match &self.invisible {
            Some(invisible) => Ok(invisible.clone()),
            None => Ok(super::null_space(at, &self.scale)?.basis),
        }
    }

    fn bounds(&self, q: &Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        let room = |bounds: &[f64]| bounds.iter().zip(q).map(|(bound, q)| bound - q).collect();
        (room(&self.lower), room(&self.upper))
    }
}
