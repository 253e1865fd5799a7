//! Every observation tested: how well others control it, whether it agrees with them, and what an error in it would do.
//!
//! An error ∇ of observation j, in its standard deviations, moves the whitened equations of its row by e ∇. With Q = 1 − Ã C Ãᵀ
//! the cofactors of the whitened residuals w̃ after the fit:
//!
//! - the estimate of such an error is eᵀw̃ / eᵀQe, and w = eᵀw̃ / √(eᵀQe) is standard normal where there is none (Baarda 1968);
//! - its redundancy number is eᵀQe, summed over correlated errors; all of them and those of the priors sum to the degrees of
//!   freedom;
//! - the smallest error found with the stated power is δ₀/√(eᵀQe) (internal reliability), and −C Ãᵀ e of it in the
//!   parameters (external reliability);
//! - tests of two observations correlate by eᵢᵀQeⱼ / √(eᵢᵀQeᵢ eⱼᵀQeⱼ): beyond 0.9 they find the same error and cannot say whose
//!   it is.

use super::covariance::Covariance;
use crate::diag::DataPlace;
use crate::linalg::dot;
use crate::problem::{Factors, Inspected, Observed, Problem, Undefined, residual_group};
use crate::statistics::{Baarda, pope_tau};

/// The probability of suspecting an observation that has no gross error.
pub const ALPHA: f64 = 0.001;
/// The probability of finding the smallest detectable error.
pub const POWER: f64 = 0.80;
/// Tests that correlate by more find the same error.
pub const INSEPARABLE: f64 = 0.9;
/// A redundancy number below this share controls nothing.
const UNCONTROLLED: f64 = 1e-6;
/// Suspects that are kept; all are counted.
const MOST_SUSPECTS: usize = 50;

/// With more parameters than this, effects are those of suspects only.
const FEW: usize = 100;

/// What is known of one observation.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Its measurement.
    pub measurement: usize,
    /// The name of that.
    pub measurement_name: String,
    /// The number of its row, through all files of the measurement.
    pub row: usize,
    /// Where it was read, if it is suspect.
    pub place: Option<DataPlace>,
    /// What it is.
    pub of: Observed,
    /// Its name: that of an input, or of a residual.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value as read; zero of an equation.
    pub observed: f64,
    /// Its value after the fit.
    pub adjusted: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Its redundancy number.
    pub redundancy: f64,
    /// w; none where others do not control it.
    pub test: Option<f64>,
    /// The smallest error that would be found.
    pub smallest_detectable: Option<f64>,
    /// The parameter, by its place, that such an error would move most, and by how many of its standard uncertainties.
    pub effect: Option<(usize, f64)>,
    /// Observations of its row that its test cannot be told from, and the correlation.
    pub inseparable: Vec<(String, f64)>,
}

/// How well a group of errors agrees with its declared standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Its name: declared, or what its inputs measure.
    pub name: String,
    /// Observations.
    pub observations: usize,
    /// The sum of their redundancy numbers.
    pub redundancy: f64,
    /// The sum of what they add to χ².
    pub squares: f64,
}

impl Group {
    /// By what the declared variances have to be multiplied for the residuals to be as large as expected (Förstner 1979);
    /// none where the group is hardly controlled.
    pub fn variance_factor(&self) -> Option<f64> {
        (self.redundancy > 0.5).then(|| self.squares / self.redundancy)
    }
}

/// The size of a group of errors, as the data have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// The group.
    pub group: String,
    /// By what its declared standard deviations are to be multiplied.
    pub factor: f64,
    /// The standard uncertainty of the factor: √(1/(2 r)) of it, with r the group's redundancy; none of a group that too
    /// little controls, whose factor is that declared.
    pub sigma: Option<f64>,
}

impl Component {
    /// Those of all groups, by the factors found.
    pub fn all(factors: &Factors, groups: &[Group]) -> Vec<Component> {
        let component = |group: &Group| {
            let factor = factors.get(&group.name).copied().unwrap_or(1.0);
            let sigma = group.variance_factor().map(|_| factor / (2.0 * group.redundancy).sqrt());
            Component { group: group.name.clone(), factor, sigma }
        };
        groups.iter().map(component).collect()
    }
}

/// What the tests of all observations say.
#[derive(Clone, Debug, Default)]
pub struct Observations {
    /// Observations.
    pub count: usize,
    /// Beyond this |w| an observation is suspect.
    pub critical: f64,
    /// δ₀
    pub noncentrality: f64,
    /// The sum of all redundancy numbers.
    pub redundancy: f64,
    /// Suspects, the worst first.
    pub suspects: Vec<Observation>,
    /// How many there are.
    pub suspected: usize,
    /// Groups of errors.
    pub groups: Vec<Group>,
    /// Observations that nothing controls.
    pub uncontrolled: usize,
}

/// Tests all observations of a problem at its solution. `covariance` is that of the declared errors, which `scale` times are
/// the real ones: σ₀ where it is estimated from `dof` degrees of freedom. `visit` sees every observation.
///
/// # Errors
/// Where the rows cannot be read, or something is undefined.
pub fn observations(
    problem: &Problem,
    point: &[f64],
    covariance: &Covariance,
    estimated: Option<(f64, usize)>,
    mut visit: impl FnMut(&Observation),
) -> Result<Observations, Undefined> {
    let baarda = Baarda::new(ALPHA, POWER);
    let scale = estimated.map_or(1.0, |(sigma0, _)| sigma0);
    let critical = match estimated {
        Some((_, dof)) => pope_tau(ALPHA, dof as f64),
        None => baarda.map(|baarda| baarda.critical),
    };
    let mut all = Observations {
        critical: critical.unwrap_or(f64::INFINITY),
        noncentrality: baarda.map_or(f64::NAN, |baarda| baarda.noncentrality),
        ..Observations::default()
    };
    let blocks: Vec<Named> = (0..problem.blocks.len()).map(|block| Named::new(problem, block)).collect();
    problem.inspect(point, |inspected| {
        let named = &blocks[inspected.block];
        let row = Row::new(inspected, covariance);
        for (j, &of) in named.of.iter().enumerate() {
            let found = row.observation(problem, named, j, of, scale, (all.critical, all.noncentrality));
            all.count += 1;
            all.redundancy += found.redundancy;
            all.uncontrolled += usize::from(found.test.is_none());
            let group = named.groups[j].as_str();
            let at = all.groups.iter().position(|known| known.name == group).unwrap_or_else(|| {
                let (name, observations) = (group.to_owned(), 0);
                all.groups.push(Group { name, observations, redundancy: 0.0, squares: 0.0 });
                all.groups.len() - 1
            });
            all.groups[at].observations += 1;
            all.groups[at].redundancy += found.redundancy;
            all.groups[at].squares += row.square(named, j);
            if found.test.is_some_and(|test| test.abs() > all.critical) {
                all.suspected += 1;
                let size = |o: &Observation| o.test.unwrap_or(0.0).abs();
                let before = all.suspects.iter().position(|known| size(known) < size(&found));
                all.suspects.insert(before.unwrap_or(all.suspects.len()), found.clone());
                all.suspects.truncate(MOST_SUSPECTS);
            }
            visit(&found);
        }
    })?;
    Ok(all)
}

/// The observations of a block's rows, and what they are called.
struct Named {
    measurement: usize,
    of: Vec<Observed>,
    names: Vec<String>,
    units: Vec<String>,
    groups: Vec<String>,
    /// one standard deviation's unit in reported units
    factors: Vec<f64>,
    correlations: Option<crate::linalg::Matrix>,
}

impl Named {
    fn new(problem: &Problem, block: usize) -> Named {
        let of = problem.observations(block);
        let (measurement, units) = (problem.blocks[block].measurement, &problem.program.units);
        let weights = &problem.blocks[block].weights;
        let whitened = problem.whitened_by_factors(block);
        let mut named = Named {
            measurement: problem.blocks[block].index,
            names: Vec::new(),
            units: Vec::new(),
            groups: Vec::new(),
            factors: Vec::new(),
            correlations: problem.observation_correlations(block),
            of: of.clone(),
        };
        for of in of {
            let (name, dimension, group, factor) = match of {
                Observed::Input(i) => {
                    let input = &measurement.inputs[i];
                    (&input.name, input.unit.dimension, input.group.clone(), 1.0)
                }
                Observed::Residual(i) => {
                    let residual = &measurement.residuals[i];
                    // factors have made one of a standard deviation
                    let factor = if whitened { 1.0 / weights[i] } else { 1.0 };
                    (&residual.name, residual.dimension, residual_group(&residual.name), factor)
                }
            };
            named.names.push(name.clone());
            named.units.push(units.symbol(dimension));
            named.groups.push(group);
            named.factors.push(units.to_reported(factor, dimension));
        }
        named
    }
}

/// A row's cofactors.
struct Row<'a> {
    inspected: &'a Inspected<'a>,
    covariance: &'a Covariance,
    /// e·Q·e of each pair
    cofactors: Vec<Vec<f64>>,
    /// e·w̃
    shares: Vec<f64>,
    /// Rootᵀ Ãᵀ e
    seen: Vec<Vec<f64>>,
}

impl<'a> Row<'a> {
    fn new(inspected: &'a Inspected<'a>, covariance: &'a Covariance) -> Row<'a> {
        let n = inspected.columns.len();
        let equations = inspected.residuals.len();
        let at = |root: &[f64], i: usize| -> f64 {
            (0..n).map(|k| inspected.derivatives[i * n + k] * root[inspected.columns[k]]).sum()
        };
        let projected: Vec<Vec<f64>> =
            covariance.root().iter().map(|root| (0..equations).map(|i| at(root, i)).collect()).collect();
        let seen: Vec<Vec<f64>> =
            inspected.errors.iter().map(|e| projected.iter().map(|p| dot(p, e)).collect()).collect();
        let count = seen.len();
        let mut cofactors = vec![vec![0.0; count]; count];
        for j in 0..count {
            for l in 0..=j {
                let cofactor = dot(&inspected.errors[j], &inspected.errors[l]) - dot(&seen[j], &seen[l]);
                cofactors[j][l] = cofactor;
                cofactors[l][j] = cofactor;
            }
        }
        let shares = inspected.errors.iter().map(|e| dot(e, inspected.residuals)).collect();
        Row { inspected, covariance, cofactors, shares, seen }
    }

    /// ρ applied to what is said of each observation.
    fn correlated(named: &Named, j: usize, of: impl Fn(usize) -> f64) -> f64 {
        match &named.correlations {
            None => of(j),
            Some(rho) => (0..rho.rows()).map(|l| rho[(j, l)] * of(l)).sum(),
        }
    }

    /// vⱼ (Σ⁻¹v)ⱼ: what the observation adds to χ².
    fn square(&self, named: &Named, j: usize) -> f64 {
        Self::correlated(named, j, |l| self.shares[l]) * self.shares[j]
    }

    fn observation(
        &self,
        problem: &Problem,
        named: &Named,
        j: usize,
        of: Observed,
        scale: f64,
        (critical, noncentrality): (f64, f64),
    ) -> Observation {
        let inspected = self.inspected;
        let cofactor = self.cofactors[j][j];
        let alone = dot(&inspected.errors[j], &inspected.errors[j]);
        let controlled = cofactor > UNCONTROLLED * alone.max(f64::MIN_POSITIVE) && alone > 0.0;
        let factor = named.factors[j];
        let sigma = inspected.sigma[j] * factor * scale;
        let test = controlled.then(|| self.shares[j] / (cofactor.sqrt() * scale));
        let smallest = controlled.then(|| noncentrality / cofactor.sqrt());
        let suspect = test.is_some_and(|test| test.abs() > critical);
        let effect = smallest.filter(|_| suspect || problem.free.len() <= FEW).and_then(|smallest| {
            let size = |i: usize| {
                let moved = self.covariance.root().iter().zip(&self.seen[j]).map(|(root, s)| root[i] * s).sum::<f64>();
                let sigma = self.covariance.sigma(i);
                if sigma > 0.0 { smallest * moved.abs() / sigma } else { 0.0 }
            };
            let sizes = (0..problem.free.len()).map(|i| (i, size(i)));
            sizes.max_by(|a, b| a.1.total_cmp(&b.1))
        });
        let (observed, adjusted) = match of {
            Observed::Input(i) => (inspected.read[i], inspected.corrected[i]),
            Observed::Residual(_) => {
                let v = Self::correlated(named, j, |l| self.shares[l]);
                (0.0, -v * inspected.sigma[j])
            }
        };
        let partner = |l: usize| {
            let rho = self.cofactors[j][l] / (self.cofactors[l][l] * cofactor).sqrt();
            let inseparable = controlled && l != j && rho.abs() > INSEPARABLE && rho.is_finite();
            inseparable.then(|| (named.names[l].clone(), rho.clamp(-1.0, 1.0)))
        };
        let inseparable = (0..self.shares.len()).filter_map(partner).collect();
        let block = problem.blocks.iter().find(|block| block.index == named.measurement);
        let place = block.filter(|_| suspect).map(|block| block.table.place(inspected.row));
        Observation {
            measurement: named.measurement,
            measurement_name: problem.program.measurements[named.measurement].name.clone(),
            row: inspected.row,
            place,
            of,
            name: named.names[j].clone(),
            unit: named.units[j].clone(),
            observed: observed * factor,
            adjusted: adjusted * factor,
            sigma,
            redundancy: Self::correlated(named, j, |l| self.cofactors[j][l]),
            test,
            smallest_detectable: smallest.map(|smallest| smallest * sigma),
            effect,
            inseparable,
        }
    }
}
