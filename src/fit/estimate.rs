//! From a solution to estimates with names and units.

use super::covariance::Covariance;
use super::observations::{Component, Observation, Observations, observations};
use super::restraint::{self, Restraint};
use super::starts::{Continuation, Starts};
use super::verdict::Verdict;
use super::warnings::{constant, warnings};
use crate::diag::Diagnostics;
use crate::linalg::sparsest;
use crate::problem::{Problem, PureError, Quantities, Undefined, Weights};
use crate::solve::{Iteration, Solution, Status};
use crate::statistics::{Criteria, Noise, Summary, Test, chi_squared_upper_tail, coverage_factor, lack_of_fit};

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
    /// The bounds of its interval of confidence, at [`Fit::confidence`]; none where there is no sigma.
    pub interval: Option<(f64, f64)>,
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
    /// The standard deviation of its prior around that, where it has one.
    pub prior: Option<f64>,
    /// What counts as known well enough.
    pub tolerance: f64,
    /// One internal unit in its unit.
    pub reported: f64,
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
    /// Equations + priors + independent equations among the constraints − rank of all.
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
    /// What nothing determines: tolerance-scaled unit vectors of as few parameters as may be, the largest weight positive.
    pub null_directions: Vec<Vec<(String, f64)>>,
    /// The covariance of the free coordinates in internal units, already scaled.
    pub covariance: Option<Covariance>,
    /// The covariance that errors as declared would give, by which observations are tested.
    pub cofactors: Option<Covariance>,
    /// Root mean square of each residual, unweighted, in reported units with the unit.
    pub residual_rms: Vec<(String, f64, String)>,
    /// The global test, where weights are real and no loss has changed them.
    pub chi_squared: Option<ChiSquared>,
    /// The level and factor of the intervals.
    pub confidence: Confidence,
    /// What large residuals count, where not their squares.
    pub robust: Option<String>,
    /// Rows that a loss gives no weight.
    pub rejected: usize,
    /// Equations that said what others of their row say already.
    pub redundant: usize,
    /// Rows whose corrections did not stand still.
    pub unsettled: usize,
    /// The tests of all observations, unless there are very many.
    pub observations: Option<Observations>,
    /// What made rows suspect that data snooping has taken out.
    pub removed: Vec<Observation>,
    /// The size of errors, where it was estimated.
    pub components: Vec<Component>,
    /// Whether the model leaves more than repeated rows scatter, where rows are repeated.
    pub lack_of_fit: Option<LackOfFit>,
    /// What the search from several starts found, where asked for.
    pub starts: Option<Starts>,
    /// How far a continuation was followed, where asked for.
    pub continuation: Option<Continuation>,
    /// For the comparison with other models of the same data.
    pub criteria: Option<Criteria>,
    /// How residuals were weighted.
    pub weights: Weights,
    /// Bounds that hold a parameter, and all constraints.
    pub restraints: Vec<Restraint>,
    /// ‖gradient of the Lagrangian‖ / ‖r‖ in normalised columns; not a number where it could not be computed.
    pub kkt: f64,
    /// What was minimised, where not the sum of squares: nothing is known of uncertainties then.
    pub norm: Option<String>,
    /// Singular values of the column-normalised Jacobian, largest first.
    pub singular_values: Vec<f64>,
    /// The final value of every coordinate, in internal units.
    pub point: Vec<f64>,
    /// What to be careful about.
    pub warnings: Diagnostics,
}

/// The test of a model against repeated rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LackOfFit {
    /// How much these scatter.
    pub pure: PureError,
    /// F, and the probability of a larger one where the model is right.
    pub test: Test,
}

/// How wide intervals are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// The probability that they hold the truth.
    pub level: f64,
    /// Standard uncertainties to either side: Student's t where the scale is estimated, else that of the normal distribution.
    pub factor: f64,
    /// The degrees of freedom of the scale; none where it is declared.
    pub dof: Option<usize>,
}

/// The level of intervals.
const LEVEL: f64 = 0.95;

/// Rows beyond which observations are tested only when asked for.
pub const MOST_TESTED: usize = 20_000;

impl Fit {
    /// σ₀ and its degrees of freedom, where nothing else tells the size of errors.
    pub fn estimated_scale(&self) -> Option<(f64, usize)> {
        self.sigma0.filter(|_| !self.weights.are_real()).map(|sigma0| (sigma0, self.dof))
    }

    /// Whether to trust it, and why not.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(self)
    }
}

/// Which observations are tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tested {
    /// All, unless there are more rows than [`MOST_TESTED`].
    #[default]
    Few,
    /// All.
    All,
    /// None.
    None,
}

/// Analyses a solution of a problem, and tests its observations unless there are very many.
///
/// # Errors
/// Where the derivatives at the solution are undefined.
pub fn analyse(problem: &Problem, solution: Solution<Vec<f64>>) -> Result<Fit, Undefined> {
    analyse_with(problem, solution, Tested::Few)
}

/// Analyses a solution of a problem.
///
/// # Errors
/// Where the derivatives at the solution are undefined.
pub fn analyse_with(problem: &Problem, solution: Solution<Vec<f64>>, tested: Tested) -> Result<Fit, Undefined> {
    let n = problem.free.len();
    let q = &solution.point;
    let scale: Vec<f64> = problem.free.iter().map(|&c| problem.layout.coordinates[c].tolerance).collect();
    let data = match problem.priors() {
        0 => problem.visible(q, false, &solution.information)?,
        _ => problem.visible(q, false, &problem.linearised(q)?.information)?,
    };
    let invisible = &solution.invisible;
    let restrained = restraint::held(&solution);

    let sums = problem.sums(q)?;
    let (equations, priors) = (sums.equations, problem.priors());
    let rank_of_both = n - invisible.len();
    let conditions = restraint::equations(&solution, &scale);
    let dof = (equations + priors + conditions).saturating_sub(rank_of_both);
    let real = problem.weights.are_real();
    let sigma0 = match problem.robust_rows() {
        true => sums.robust_sigma0(rank_of_both),
        false => (dof > 0).then(|| (2.0 * solution.cost / dof as f64).sqrt()),
    };
    let (declared, factor) = match problem.robust_rows() {
        // the cofactors of all rows as they are, times what the loss makes of them
        true => {
            let plain = problem.without_loss();
            let information = plain.with_priors(plain.linearised(q)?.information, q)?;
            (Covariance::new(&information, &scale, invisible, &restrained).ok(), sums.robust_factor(rank_of_both))
        }
        false => {
            let declared = Covariance::new(&solution.information, &scale, invisible, &restrained).ok();
            (declared, if real { Some(1.0) } else { sigma0 })
        }
    };
    let covariance = declared.as_ref().zip(factor).map(|(declared, factor)| declared.scaled(factor));
    let estimated = if real { None } else { sigma0.map(|sigma0| (sigma0, dof)) };
    let wanted = tested == Tested::All || (tested == Tested::Few && sums.rows <= MOST_TESTED);
    let tested = match (&declared, wanted) {
        (Some(declared), true) if real || estimated.is_some() => {
            Some(observations(problem, q, declared, estimated, |_| ())?)
        }
        _ => None,
    };
    let lack_of_fit = match sums.rows <= MOST_TESTED && !problem.is_robust() {
        true => replicated(problem, q, sums.squares, equations, data.rank)?,
        false => None,
    };
    let confidence = Confidence {
        level: LEVEL,
        factor: coverage_factor(LEVEL, if real { f64::INFINITY } else { dof as f64 }).unwrap_or(f64::NAN),
        dof: (!real).then_some(dof),
    };
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
            let sigma =
                covariance.as_ref().filter(|_| estimable && !restrained.on_bound[j]).map(|c| reported(c.sigma(j)));
            let value = reported(q[c]);
            let half = sigma.map(|sigma| confidence.factor * sigma).filter(|half| half.is_finite());
            Estimate {
                name: coordinate.name.clone(),
                value,
                interval: half.map(|half| (value - half, value + half)),
                unit: units.symbol(coordinate.dimension),
                sigma,
                estimable,
                at_datum: estimable && share(j) > AT_DATUM,
                at_bound: restrained.on_bound[j],
                nominal: reported(coordinate.nominal),
                prior: coordinate.sigma.map(reported),
                tolerance: reported(coordinate.tolerance),
                reported: reported(1.0),
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
    let chi_squared = match real && dof > 0 && !problem.is_robust() {
        true => chi_squared(2.0 * solution.cost, dof),
        false => None,
    };
    let all = Summary {
        sum_of_squares: 2.0 * solution.cost,
        equations: equations + priors + conditions,
        parameters: rank_of_both,
    };
    let noise = if real { Noise::Known } else { Noise::Unknown };
    let mut fit = Fit {
        status: solution.status,
        cost: solution.cost,
        sum_of_squares: sums.squares,
        equations,
        priors,
        dof,
        sigma0,
        iterations: solution.iterations,
        rank: data.rank,
        trace: solution.trace.clone(),
        parameters,
        held,
        null_directions: sparsest(invisible).iter().map(|basis| direction(problem, basis)).collect(),
        covariance,
        cofactors: declared,
        residual_rms: residual_rms(problem, q)?,
        chi_squared,
        confidence,
        robust: problem.robust_name(),
        rejected: sums.rejected,
        redundant: sums.redundant,
        unsettled: sums.unsettled,
        observations: tested,
        lack_of_fit,
        removed: Vec::new(),
        components: Vec::new(),
        starts: None,
        continuation: None,
        restraints: restraint::restraints(problem, &solution),
        kkt: solution.kkt,
        norm: None,
        criteria: if problem.is_robust() { None } else { Criteria::new(&all, noise) },
        weights: problem.weights,
        singular_values: data.singular_values,
        point: solution.point.clone(),
        warnings: Diagnostics::new(),
    };
    fit.warnings = warnings(&fit, n, solution.projected);
    fit.warnings.extend(constant(problem));
    Ok(fit)
}

fn replicated(
    problem: &Problem,
    q: &[f64],
    squares: f64,
    equations: usize,
    rank: usize,
) -> Result<Option<LackOfFit>, Undefined> {
    let pure = problem.pure_error(q)?;
    if pure.dof == 0 {
        return Ok(None);
    }
    let data = Summary { sum_of_squares: squares, equations, parameters: rank };
    Ok(lack_of_fit(&data, pure.squares, pure.dof).map(|test| LackOfFit { pure, test }))
}

fn chi_squared(value: f64, dof: usize) -> Option<ChiSquared> {
    Some(ChiSquared { value, dof, upper_tail: chi_squared_upper_tail(value, dof as f64)? })
}

/// A null direction by names; weights that round to nothing are left out.
fn direction(problem: &Problem, basis: &[f64]) -> Vec<(String, f64)> {
    let named = problem.free.iter().zip(basis).filter(|(_, w)| w.abs() > 1e-9);
    named.map(|(&c, w)| (problem.layout.coordinates[c].name.clone(), *w)).collect()
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
