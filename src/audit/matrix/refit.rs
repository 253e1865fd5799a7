//! What a wrong Jacobian costs a calibration.
//!
//! The problem is fitted twice from the same point: with exact derivatives, and with those that the matrix makes of them, which are
//! its multiples and columns applied to the exact ones at every point, and what is left of its entries, kept as it is.

use super::stack::Stack;
use super::verdict::MatrixAudit;
use crate::diag::Diagnostic;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, dot, norm, solve_upper};
use crate::problem::{Problem, Undefined};
use crate::solve::{Constraint, LeastSquares, Settings, StartError, Status, minimise};

/// Damping of the steps that are compared, as a share of the largest curvature: invisible directions take no part.
const DAMPING: f64 = 1e-9;

/// A fit with the exact and one with the audited derivatives.
#[derive(Clone, Debug)]
pub struct Refit {
    /// With exact derivatives.
    pub exact: Ended,
    /// With the audited ones.
    pub audited: Ended,
    /// The angle between the first steps, in radians, where parameters count in their tolerances.
    pub angle: f64,
    /// The length of the audited first step over that of the exact one.
    pub length: f64,
    /// The parameter that ends farthest from where it should, and how far, in its tolerances.
    pub farthest: Option<(String, f64)>,
}

/// Where a fit ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ended {
    /// How.
    pub status: Status,
    /// After how many steps.
    pub iterations: usize,
    /// The cost.
    pub cost: f64,
    /// The largest cosine between the residual and an exact derivative: zero at a minimum.
    pub gradient: f64,
}

/// How far a parameter may end from the other fit's, in tolerances, to be at the same place.
const SAME: f64 = 1e-3;

impl Refit {
    /// Whether both end at the same place.
    pub fn same(&self) -> bool {
        self.audited.status.converged() && self.farthest.as_ref().is_none_or(|(_, far)| *far < SAME)
    }

    /// What the mistake would have cost, in words.
    pub fn sentence(&self) -> String {
        let steps = |n: usize| format!("{n} step{}", if n == 1 { "" } else { "s" });
        let (now, then) = (steps(self.audited.iterations), steps(self.exact.iterations));
        let far = match &self.farthest {
            Some((name, far)) => format!(": `{name}` ends {far:.3} tolerances away"),
            None => String::new(),
        };
        match (self.audited.status.converged(), self.same()) {
            (true, true) if self.audited.iterations <= self.exact.iterations => {
                format!("the fit converges to the same place in {now}, as it should in {then}")
            }
            (true, true) => format!("the fit converges to the same place, but in {now} instead of {then}"),
            (true, false) => format!("the fit says after {now} that it has converged, but elsewhere{far}"),
            (false, _) => format!("the fit does not converge: {} after {now}{far}", self.audited.status.name()),
        }
    }
}

/// Fits with and without the mistakes of an audited matrix.
///
/// # Errors
/// Where a search cannot start.
pub fn refit(problem: &Problem, point: &[f64], exact: &Stack, audit: &MatrixAudit) -> Result<Refit, Box<Diagnostic>> {
    let audited = Audited { problem, exact, audit };
    let start = point.to_vec();
    let failed = |error: StartError<Undefined>| match error {
        StartError::Undefined(Undefined(found)) => found,
        other => Box::new(Diagnostic::error(crate::diag::Code::UndefinedAtStart, other.to_string())),
    };
    let settings = Settings::default();
    let right = minimise(problem, start.clone(), &settings).map_err(failed)?;
    let wrong = minimise(&audited, start.clone(), &settings).map_err(failed)?;
    let undefined = |Undefined(found): Undefined| found;
    let scaled = |step: &[f64]| step.iter().zip(problem.scale()).map(|(x, scale)| x / scale).collect::<Vec<f64>>();
    let first = scaled(&step(problem, &start).map_err(undefined)?);
    let second = scaled(&step(&audited, &start).map_err(undefined)?);
    let cosine = dot(&first, &second) / (norm(&first) * norm(&second));
    let (ours, theirs) = (problem.offset(&right.point), problem.offset(&wrong.point));
    let shifts = ours.iter().zip(&theirs).zip(problem.scale()).map(|((a, b), scale)| (a - b).abs() / scale);
    let farthest = shifts.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let ended = |status: Status, iterations: usize, cost: f64, at: &Vec<f64>| {
        let gradient = steepest(problem, at).unwrap_or(f64::NAN);
        Ended { status, iterations, cost, gradient }
    };
    Ok(Refit {
        exact: ended(right.status, right.iterations, right.cost, &right.point),
        audited: ended(wrong.status, wrong.iterations, wrong.cost, &wrong.point),
        angle: cosine.clamp(-1.0, 1.0).acos(),
        length: norm(&second) / norm(&first),
        farthest: farthest.map(|(j, far)| (problem.layout.coordinates[problem.free[j]].name.clone(), far)),
    })
}

/// The Levenberg–Marquardt step at the start, hardly damped.
fn step<L: LeastSquares<Point = Vec<f64>, Error = Undefined>>(
    problem: &L,
    at: &Vec<f64>,
) -> Result<Vec<f64>, Undefined> {
    let mut information = problem.linearise(at)?;
    let n = problem.dimension();
    let scaled = information.r().scale_columns(problem.scale());
    let most = scaled.column_norms().into_iter().fold(0.0, f64::max);
    let damping = most * DAMPING.sqrt();
    let row = |j: usize| (0..=n).map(|k| if k == j { damping / problem.scale()[j] } else { 0.0 }).collect::<Vec<f64>>();
    let mut rows = Matrix::from_rows(n + 1, &(0..n).map(row).collect::<Vec<_>>());
    information.absorb(&mut rows)?;
    Ok(solve_upper(information.r(), information.d())?.into_iter().map(|x| -x).collect())
}

/// The largest cosine between the residual and a derivative.
fn steepest(problem: &Problem, at: &[f64]) -> Result<f64, Undefined> {
    let all = problem.all_equations(at)?;
    let size = norm(&all.residual);
    let cosine = |j: usize| {
        let column = all.jacobian.column(j);
        (dot(column, &all.residual) / (norm(column) * size)).abs()
    };
    Ok((0..all.jacobian.columns()).map(cosine).filter(|cosine| cosine.is_finite()).fold(0.0, f64::max))
}

/// A problem with the derivatives of an audited matrix.
struct Audited<'a, 'p> {
    problem: &'a Problem<'p>,
    exact: &'a Stack,
    audit: &'a MatrixAudit,
}

impl Audited<'_, '_> {
    /// By equation what a whitened row is in reported units, and by parameter the same of its column.
    fn units(&self) -> (Vec<f64>, Vec<f64>) {
        let units = &self.problem.program.units;
        let of_block = |block: &crate::problem::Block| {
            let residuals = block.measurement.residuals.iter().zip(&block.weights);
            let one: Vec<f64> = residuals.map(|(r, weight)| units.to_reported(1.0, r.dimension) / weight).collect();
            (0..block.table.rows()).flat_map(|_| one.clone()).collect::<Vec<f64>>()
        };
        let columns = self.problem.free.iter().map(|&c| self.problem.layout.coordinates[c].dimension);
        (self.problem.blocks.iter().flat_map(of_block).collect(), columns.map(|d| units.to_reported(1.0, d)).collect())
    }
}

impl LeastSquares for Audited<'_, '_> {
    type Point = Vec<f64>;
    type Error = Undefined;

    fn dimension(&self) -> usize {
        self.problem.dimension()
    }

    fn cost(&self, q: &Vec<f64>) -> Result<f64, Undefined> {
        self.problem.cost(q)
    }

    fn linearise(&self, q: &Vec<f64>) -> Result<SquareRootInformation, Undefined> {
        let all = self.problem.all_equations(q)?;
        let (row, column) = self.units();
        let (m, n) = (self.exact.equations.len(), self.dimension());
        let (multiples, laid) = (&self.audit.multiples, &self.audit.laid);
        // as it is here, in reported units
        let mut here = self.exact.clone();
        for (i, entries) in here.entries.iter_mut().enumerate() {
            (0..n).for_each(|j| entries[j] = all.jacobian[(i, j)] * row[i] / column[j]);
        }
        let mut jacobian = all.jacobian.clone();
        for i in 0..m {
            for (k, &j) in laid.columns.iter().enumerate().filter(|(_, j)| **j < n) {
                jacobian[(i, j)] = (multiples.entry(&here, i, k) + self.audit.left[i][k]) * column[j] / row[i];
            }
        }
        SquareRootInformation::from_rows(&jacobian, &all.residual).map_err(|error: LinalgError| error.into())
    }

    fn retract(&self, q: &Vec<f64>, delta: &[f64]) -> Vec<f64> {
        self.problem.retract(q, delta)
    }

    fn offset(&self, q: &Vec<f64>) -> Vec<f64> {
        self.problem.offset(q)
    }

    fn scale(&self) -> &[f64] {
        self.problem.scale()
    }

    fn magnitude(&self, q: &Vec<f64>) -> Vec<f64> {
        self.problem.magnitude(q)
    }

    fn bounds(&self, q: &Vec<f64>) -> (Vec<f64>, Vec<f64>) {
        self.problem.bounds(q)
    }

    fn constraints(&self, q: &Vec<f64>) -> Result<Vec<Constraint>, Undefined> {
        self.problem.constraints(q)
    }
}
