//! Solvers against published minima, and against what they must never do.

mod behaviour;
mod conic;
mod datum;
mod functions;
mod laws;
mod published;

use super::{
    Conic, Constraint, LeastSquares, Norm, Relation, Settings, Solution, Solver, Stacked, StartError, minimise,
};
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
    /// Conditions: what is asked, and g.
    pub(super) conditions: Vec<(Relation, Condition)>,
    /// How many of the last residuals are priors.
    pub(super) priors: usize,
}

type Condition = Box<dyn Fn(&[Dual]) -> Dual>;

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
            conditions: vec![],
            priors: 0,
        }
    }

    pub(super) fn solve(&self, start: &[f64]) -> Solution<Vec<f64>> {
        minimise(self, start.to_vec(), &Settings::default()).expect("a start that is defined")
    }

    /// By the conic solver.
    pub(super) fn conic(&self, start: &[f64]) -> Solution<Vec<f64>> {
        self.try_conic(start, Norm::LeastSquares).expect("a start that is defined and conditions that can be met")
    }

    pub(super) fn try_conic(&self, start: &[f64], norm: Norm) -> Result<Solution<Vec<f64>>, StartError<Refused>> {
        Conic { norm, ..Conic::default() }.solve(self, start.to_vec())
    }

    /// Asks that g(q) = 0, or ≤ 0.
    pub(super) fn ask(&mut self, relation: Relation, g: impl Fn(&[Dual]) -> Dual + 'static) {
        self.conditions.push((relation, Box::new(g)));
    }

    fn evaluate(&self, q: &[f64], derivatives: bool) -> Result<Vec<Dual>, Refused> {
        (self.residuals)(&variables(q, derivatives)).ok_or(Refused::Domain)
    }

    /// J and r.
    fn jacobian(&self, q: &[f64]) -> Result<(Matrix, Vec<f64>), Refused> {
        let residuals = self.evaluate(q, true)?;
        let mut jacobian = Matrix::zeros(residuals.len(), q.len());
        for (i, residual) in residuals.iter().enumerate() {
            for (j, entry) in gradient(residual, q.len()).into_iter().enumerate() {
                jacobian[(i, j)] = entry * self.mistake;
            }
        }
        Ok((jacobian, residuals.iter().map(|r| r.re).collect()))
    }
}

fn variables(q: &[f64], derivatives: bool) -> Vec<Dual> {
    let n = q.len();
    let variable = |j: usize| {
        let variable = Dual::from_re(q[j]);
        if derivatives { variable.with_derivative(j, n) } else { variable }
    };
    (0..n).map(variable).collect()
}

fn gradient(value: &Dual, n: usize) -> Vec<f64> {
    value.eps.clone().unwrap_generic(nalgebra::Dyn(n), nalgebra::Const::<1>).iter().copied().collect()
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
        let (jacobian, residuals) = self.jacobian(q)?;
        Ok(SquareRootInformation::from_rows(&jacobian, &residuals)?)
    }

    fn stacked(&self, q: &Vec<f64>) -> Result<Option<Stacked>, Refused> {
        let (jacobian, residual) = self.jacobian(q)?;
        Ok(Some(Stacked { jacobian, residual, priors: self.priors }))
    }

    fn constraints(&self, q: &Vec<f64>) -> Result<Vec<Constraint>, Refused> {
        let at = variables(q, true);
        let told = |(relation, g): &(Relation, Condition)| {
            let g = g(&at);
            Constraint { relation: *relation, value: g.re, gradient: gradient(&g, q.len()), magnitude: 1.0 }
        };
        Ok(self.conditions.iter().map(told).collect())
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
