//! How well parameters would be known, from the model and where it is measured alone.

use super::clusters::{clusters, multiple_correlations};
use super::collinear::Collinearity;
use super::cures::{Cure, cures};
use super::direction::{Direction, WEAK};
use super::indices::Observability;
use super::inputs::{At, Inputs, Probe, unit_options};
use super::next::{Candidate, next};
use super::walk::walk;
use crate::compile::Scenario;
use crate::diag::{Diagnostic, Diagnostics};
use crate::fit::{Covariance, Held, NOT_ESTIMABLE};
use crate::linalg::{LinalgError, Matrix, sparsest, svd};
use crate::problem::{Problem, Rows, Undefined, Weights};
use crate::solve::{LeastSquares, null_space};

/// Weak directions that are told.
const TOLD: usize = 3;

/// What is predicted of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value, where the prediction is made.
    pub value: f64,
    /// Its standard uncertainty; none where it is not estimable, or where weights do not tell how large errors are.
    pub sigma: Option<f64>,
    /// What counts as known well enough.
    pub tolerance: f64,
    /// Whether the data, with the priors, determine it.
    pub estimable: bool,
    /// R² of its column of the Jacobian by all others.
    pub collinearity: Option<f64>,
}

/// What a set of measurements would tell.
#[derive(Clone, Debug)]
pub struct Practice {
    /// How residuals are weighted.
    pub weights: Weights,
    /// Rows by measurement.
    pub rows: Vec<(String, usize)>,
    /// Rows without consistent inputs, which are not counted.
    pub left_out: usize,
    /// Equations of the data.
    pub equations: usize,
    /// Free coordinates with a prior.
    pub priors: usize,
    /// The rank of the data alone.
    pub rank: usize,
    /// Every free coordinate.
    pub parameters: Vec<Known>,
    /// What neither data nor priors see.
    pub invisible: Vec<Direction>,
    /// What the priors alone tell.
    pub prior_only: Vec<Direction>,
    /// What is known worst, where it is worse than the tolerance.
    pub weak: Vec<Direction>,
    /// Largest over smallest singular value of what is visible to the data, columns in tolerances.
    pub condition: f64,
    /// All singular values of the data, rows in standard deviations and columns in tolerances.
    pub singular_values: Vec<f64>,
    /// The observability indices of the data.
    pub indices: Observability,
    /// Groups that hang together by correlations: names, and the strongest.
    pub clusters: Vec<(Vec<String>, f64)>,
    /// Condition indices and variance-decomposition proportions, of data and priors together.
    pub collinearity: Collinearity,
    /// What to hold, by parts of the invisible space.
    pub cures: Vec<Vec<Cure>>,
    /// Which row would tell most of the worst direction; none where no row does, or there is nothing to ask.
    pub next: Option<Candidate>,
    /// Whether a scenario was asked.
    pub asked: bool,
}

impl Practice {
    /// Whether every free parameter can be determined.
    pub fn sound(&self) -> bool {
        self.parameters.iter().all(|known| known.estimable)
    }
}

fn stop(error: LinalgError) -> Diagnostics {
    Diagnostics::from(*Undefined::from(error).0)
}

/// Predicts what measurements tell at the start of a problem. `scenario` is asked for further rows.
///
/// # Errors
/// Mistakes of names and scenarios; no consistent inputs; a derivative that is undefined.
pub fn practice<'a>(probe: &Probe<'a>, scenario: Option<&'a Scenario>) -> Result<Practice, Diagnostics> {
    let undefined = |Undefined(found): Undefined| Diagnostics::from(*found);
    let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
    let (like, _) = probe.bound()?;
    let At { problem, left_out, .. } = probe.at(&like, &like.start, 0).map_err(refused)?;
    let problem = problem.without_loss();
    let (q, scale) = (problem.start.clone(), problem.scale().to_vec());
    let consistent = problem.at_consistent_inputs(&q, Rows::All).map_err(undefined)?;
    let alone = null_space(&consistent, &scale).map_err(stop)?;
    let with_all = |data| problem.with_equations(problem.with_priors(data, &q)?, &q);
    let both = null_space(&with_all(consistent).map_err(undefined)?, &scale).map_err(stop)?;
    let data = problem.linearised(&q).map_err(undefined)?.information;
    let information = problem.with_priors(data.clone(), &q).map_err(undefined)?;
    let n = problem.free.len();
    let held = Held::by_equations(&problem, &q).map_err(undefined)?;
    let covariance = Covariance::new(&information, &scale, &both.basis, &held).ok();
    let real = problem.weights.are_real();
    let stated = covariance.as_ref().filter(|_| real);

    let share = |j: usize| both.basis.iter().map(|z| z[j] * z[j]).sum::<f64>();
    let estimable: Vec<bool> = (0..n).map(|j| share(j) <= NOT_ESTIMABLE).collect();
    let collinear = covariance.as_ref().map(|c| multiple_correlations(&information, c, &estimable));
    let units = &problem.program.units;
    let known = |(j, &c): (usize, &usize)| {
        let coordinate = &problem.layout.coordinates[c];
        let reported = |value: f64| units.to_reported(value, coordinate.dimension);
        Known {
            name: coordinate.name.clone(),
            unit: units.symbol(coordinate.dimension),
            value: reported(q[c]),
            sigma: stated.filter(|_| estimable[j]).map(|covariance| reported(covariance.sigma(j))),
            tolerance: reported(coordinate.tolerance),
            estimable: estimable[j],
            collinearity: collinear.as_ref().and_then(|all| all[j]),
        }
    };
    let parameters: Vec<Known> = problem.free.iter().enumerate().map(known).collect();

    let seen = svd(&information.r().scale_columns(&scale)).map_err(stop)?;
    let largest = seen.sigma.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    let visible = both.rank.min(seen.sigma.len());
    let worst: Vec<usize> = (0..visible).rev().take(TOLD).collect();
    let is_weak = |k: &&usize| (real && seen.sigma[**k] < 1.0) || seen.sigma[**k] < WEAK * largest;
    let weak = worst.iter().filter(is_weak).map(|&k| {
        let sigma = real.then(|| 1.0 / seen.sigma[k]);
        Direction::weak(&problem, seen.v.column(k), seen.sigma[k] / largest, sigma)
    });
    let weak: Vec<Direction> = weak.collect();

    let of_data = svd(&data.r().scale_columns(&scale)).map_err(stop)?.sigma;
    let least = of_data.get(alone.rank.wrapping_sub(1)).copied().unwrap_or(0.0);
    let invisible = followed(probe, &problem, &both.basis);
    let directions = sparsest(&both.basis);
    let asked_for = directions.first().map(Vec::as_slice).or(worst.first().map(|&k| seen.v.column(k)));
    let further = scenario.zip(asked_for).filter(|_| !invisible.is_empty() || !weak.is_empty());
    let names = |members: Vec<usize>| members.into_iter().map(|j| parameters[j].name.clone()).collect();
    Ok(Practice {
        weights: problem.weights,
        rows: problem.blocks.iter().map(|b| (b.measurement.name.clone(), b.table.rows())).collect(),
        left_out,
        equations: problem.equations(),
        priors: problem.priors(),
        rank: alone.rank,
        invisible,
        prior_only: match alone.basis.len() > both.basis.len() {
            true => sparsest(&alone.basis).iter().map(|z| Direction::new(&problem, z)).collect(),
            false => Vec::new(),
        },
        weak,
        condition: of_data.first().copied().unwrap_or(0.0) / least,
        indices: Observability::new(&of_data, alone.rank, problem.equations()),
        singular_values: of_data,
        clusters: covariance.as_ref().map_or_else(Vec::new, |covariance| {
            let all = clusters(covariance, &estimable);
            all.into_iter().map(|cluster| (names(cluster.members), cluster.strongest)).collect()
        }),
        collinearity: {
            let telling: Vec<usize> = (0..n).filter(|&j| estimable[j]).collect();
            let names = telling.iter().map(|&j| parameters[j].name.clone()).collect();
            let columns: Vec<&[f64]> = telling.iter().map(|&j| information.r().column(j)).collect();
            Collinearity::new(names, &Matrix::from_columns(information.dimension(), &columns)).map_err(stop)?
        },
        cures: cures(&problem, &both.basis, stated),
        next: further.and_then(|(scenario, z)| next(probe, &like, scenario, z)),
        asked: further.is_some(),
        parameters,
    })
}

/// The invisible directions of a problem at its start, each followed where inputs of the same kind, weighted alike, let it.
fn followed(probe: &Probe, problem: &Problem, basis: &[Vec<f64>]) -> Vec<Direction> {
    let alike = {
        let probe = Probe { options: unit_options(&probe.options), inputs: Inputs::Rows(problem), ..probe.clone() };
        let mut like = problem.clone();
        like.weights = Weights::Unit;
        if basis.is_empty() { None } else { probe.at(&like, &problem.start, 0).ok().map(|at| at.problem) }
    };
    let direction = |z: &Vec<f64>| {
        let mut found = Direction::new(problem, z);
        found.walk = alike.as_ref().and_then(|alike| walk(alike, basis, z).ok());
        found
    };
    sparsest(basis).iter().map(direction).collect()
}
