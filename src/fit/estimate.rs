//! From a solution to estimates with names and units.

use statrs::distribution::{ChiSquared as Distribution, ContinuousCDF};

use super::covariance::Covariance;
use super::verdict::Verdict;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::linalg::Bound;
use crate::problem::{At, Problem, Quantities, Rows, Undefined, Weights};
use crate::solve::{Iteration, Solution, Status};

/// A parameter is not estimable where its squared share of the tolerance-scaled null space exceeds this.
pub const NOT_ESTIMABLE: f64 = 0.01;

/// Beyond this share a parameter moves with the datum.
const AT_DATUM: f64 = 1e-9;

/// One estimated coordinate, in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// `L1.alpha`
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Its standard uncertainty; none where it is not estimable, on a bound, or where nothing tells the scale.
    pub sigma: Option<f64>,
    /// Whether the data determine it.
    pub estimable: bool,
    /// Whether its value and sigma are those of the minimum-norm datum: another datum would move it a little.
    pub at_datum: bool,
    /// Whether it is on one of its bounds.
    pub at_bound: bool,
    /// Where it started from.
    pub nominal: f64,
    /// What counts as known well enough.
    pub tolerance: f64,
}

/// A coordinate that was not estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldValue {
    /// Its name.
    pub name: String,
    /// Where it was held, in reported units.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// The global test: under real weights, the weighted sum of squares is χ² distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChiSquared {
    /// Σ of all that is minimised.
    pub value: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// The probability of a larger one.
    pub upper_tail: f64,
}

/// A finished calibration.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Which test ended the search.
    pub status: Status,
    /// ½ of all that is minimised, priors in.
    pub cost: f64,
    /// Σ of the squares of the data's weighted residuals.
    pub sum_of_squares: f64,
    /// Equations of the data.
    pub equations: usize,
    /// Free coordinates with a prior.
    pub priors: usize,
    /// Equations + priors − rank of both.
    pub dof: usize,
    /// √(2 cost/dof); none without degrees of freedom.
    pub sigma0: Option<f64>,
    /// Linearisations of the search.
    pub iterations: usize,
    /// The rank of the data alone.
    pub rank: usize,
    /// Every trial step.
    pub trace: Vec<Iteration>,
    /// The free coordinates in declared order.
    pub parameters: Vec<Estimate>,
    /// The others.
    pub held: Vec<HeldValue>,
    /// What nothing determines: tolerance-scaled unit vectors, largest weight first in sign.
    pub null_directions: Vec<Vec<(String, f64)>>,
    /// The covariance of the free coordinates in internal units, already scaled.
    pub covariance: Option<Covariance>,
    /// Root mean square of each residual, unweighted, in reported units with the unit.
    pub residual_rms: Vec<(String, f64, String)>,
    /// The global test, where weights are real.
    pub chi_squared: Option<ChiSquared>,
    /// How residuals were weighted.
    pub weights: Weights,
    /// Singular values of the column-normalised Jacobian, largest first.
    pub singular_values: Vec<f64>,
    /// The final value of every coordinate, in internal units.
    pub point: Vec<f64>,
    /// What to be careful about.
    pub warnings: Diagnostics,
}

impl Fit {
    /// Whether to trust it, and why not.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(self)
    }
}

/// Analyses a solution of a problem.
///
/// # Errors
/// Where the derivatives at the solution are undefined.
pub fn analyse(problem: &Problem, solution: Solution<Vec<f64>>) -> Result<Fit, Undefined> {
    let n = problem.free.len();
    let q = &solution.point;
    let scale: Vec<f64> = problem.free.iter().map(|&c| problem.layout.coordinates[c].tolerance).collect();
    let data = match problem.priors() {
        0 => problem.visible(q, false, &solution.information)?,
        _ => problem.visible(q, false, &problem.information(q, At::Observed, Rows::All)?)?,
    };
    let invisible = &solution.invisible;
    let active: Vec<bool> = solution.active.iter().map(|bound| *bound != Bound::Free).collect();

    let sum_of_squares = problem.sum_of_squares(q)?;
    let (equations, priors) = (problem.equations(), problem.priors());
    let rank_of_both = n - invisible.len();
    let dof = (equations + priors).saturating_sub(rank_of_both);
    let sigma0 = (dof > 0).then(|| (2.0 * solution.cost / dof as f64).sqrt());
    let factor = match problem.weights {
        Weights::Unit => sigma0,
        Weights::Sigma => Some(1.0),
    };
    let covariance = factor.and_then(|factor| {
        let mut covariance = Covariance::new(&solution.information, &scale, invisible, &active).ok()?;
        covariance.entries.iter_mut().flatten().for_each(|entry| *entry *= factor * factor);
        Some(covariance)
    });
    let share = |j: usize| invisible.iter().map(|basis| basis[j] * basis[j]).sum::<f64>();
    let units = &problem.program.units;
    let parameters = problem
        .free
        .iter()
        .enumerate()
        .map(|(j, &c)| {
            let coordinate = &problem.layout.coordinates[c];
            let reported = |value: f64| units.to_reported(value, coordinate.dimension);
            let estimable = share(j) <= NOT_ESTIMABLE;
            let sigma = covariance.as_ref().filter(|_| estimable && !active[j]).map(|c| reported(c.sigma(j)));
            Estimate {
                name: coordinate.name.clone(),
                value: reported(q[c]),
                unit: units.symbol(coordinate.dimension),
                sigma,
                estimable,
                at_datum: estimable && share(j) > AT_DATUM,
                at_bound: active[j],
                nominal: reported(coordinate.nominal),
                tolerance: reported(coordinate.tolerance),
            }
        })
        .collect();
    let held = problem.layout.coordinates.iter().enumerate().filter(|(c, _)| !problem.free.contains(c));
    let held = held.map(|(c, coordinate)| HeldValue {
        name: coordinate.name.clone(),
        value: units.to_reported(q[c], coordinate.dimension),
        unit: units.symbol(coordinate.dimension),
    });
    let held = held.collect();
    let chi_squared = match problem.weights {
        Weights::Sigma if dof > 0 => chi_squared(2.0 * solution.cost, dof),
        _ => None,
    };
    let mut fit = Fit {
        status: solution.status,
        cost: solution.cost,
        sum_of_squares,
        equations,
        priors,
        dof,
        sigma0,
        iterations: solution.iterations,
        rank: data.rank,
        trace: solution.trace,
        parameters,
        held,
        null_directions: invisible.iter().map(|basis| direction(problem, basis)).collect(),
        covariance,
        residual_rms: residual_rms(problem, q)?,
        chi_squared,
        weights: problem.weights,
        singular_values: data.singular_values,
        point: solution.point.clone(),
        warnings: Diagnostics::new(),
    };
    fit.warnings = warnings(&fit, n, solution.projected);
    Ok(fit)
}

fn chi_squared(value: f64, dof: usize) -> Option<ChiSquared> {
    let distribution = Distribution::new(dof as f64).ok()?;
    Some(ChiSquared { value, dof, upper_tail: distribution.sf(value) })
}

/// A null direction by names; the largest weight is positive, weights that round to nothing are left out.
fn direction(problem: &Problem, basis: &[f64]) -> Vec<(String, f64)> {
    // of several that are as large, but for rounding, the first decides
    const AS_LARGE: f64 = 1.0 - 1e-6;
    let most = basis.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
    let largest = basis.iter().copied().find(|w| w.abs() >= AS_LARGE * most).unwrap_or(0.0);
    let sign = if largest < 0.0 { -1.0 } else { 1.0 };
    let named = problem.free.iter().zip(basis).filter(|(_, w)| w.abs() > 1e-9);
    named.map(|(&c, w)| (problem.layout.coordinates[c].name.clone(), sign * w)).collect()
}

fn residual_rms(problem: &Problem, q: &[f64]) -> Result<Vec<(String, f64, String)>, Undefined> {
    let units = &problem.program.units;
    let mut all = Vec::new();
    for block in &problem.blocks {
        let residuals = &block.measurement.residuals;
        let mut sums = vec![0.0; residuals.len()];
        block.values(Quantities::Residuals, &problem.layout, q, |_, values| {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += value * value;
            }
        })?;
        for (residual, sum) in residuals.iter().zip(sums) {
            let rms = units.to_reported((sum / block.table.rows().max(1) as f64).sqrt(), residual.dimension);
            let name = if problem.blocks.len() == 1 {
                residual.name.clone()
            } else {
                format!("{}.{}", block.measurement.name, residual.name)
            };
            all.push((name, rms, units.symbol(residual.dimension)));
        }
    }
    Ok(all)
}

fn warnings(fit: &Fit, n: usize, projected: bool) -> Diagnostics {
    let mut warnings = Diagnostics::new();
    if projected {
        warnings.push(Diagnostic::warning(Code::StartProjected, "the start was moved into its bounds"));
    }
    if fit.equations + fit.priors < n {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let (equations, priors) = (count(fit.equations, "equation"), count(fit.priors, "prior"));
        let message = format!("{equations} and {priors} cannot determine {}", count(n, "parameter"));
        warnings.push(
            Diagnostic::warning(Code::Underdetermined, message)
                .hint("measure more rows, or hold parameters with `--fix`"),
        );
    }
    let blind: Vec<&str> = fit.parameters.iter().filter(|p| !p.estimable).map(|p| p.name.as_str()).collect();
    if !blind.is_empty() {
        let message = format!("not estimable: {}", list(&blind));
        let hint = match fit.null_directions.len() {
            1 => "the data see only a combination of these: hold one of them with `--fix`, or measure more".to_owned(),
            n => format!("{n} combinations of these are not seen: hold one of each with `--fix`, or measure more"),
        };
        warnings.push(Diagnostic::warning(Code::NotEstimable, message).hint(hint));
    }
    let weak: Vec<&str> = fit
        .parameters
        .iter()
        .filter(|p| p.sigma.is_some_and(|sigma| sigma > p.tolerance))
        .map(|p| p.name.as_str())
        .collect();
    if !weak.is_empty() {
        let message = format!("known less well than the declared tolerance: {}", list(&weak));
        warnings.push(Diagnostic::warning(Code::PracticallyWeak, message).hint("measure more, or elsewhere"));
    }
    warnings
}

fn list(names: &[&str]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    match names.len().checked_sub(MOST) {
        Some(more) if more > 0 => format!("{} and {more} more", shown.join(", ")),
        _ => shown.join(", "),
    }
}
