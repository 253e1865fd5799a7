//! Parameters that were estimated together, as a quantity sees them.

use crate::fit::JointUncertainty;
use crate::linalg::{dot, norm};
use crate::problem::Problem;

/// A quantity whose tolerance-scaled gradient has a larger share than this along what is not known depends on it. Rounding
/// and the convergence of a fit make less.
const DEPENDS: f64 = 1e-6;

/// Parameters that were estimated together, and how well they are known; in internal units.
#[derive(Clone, Debug)]
pub struct Estimated {
    /// What they are called in a budget: `calibration`, `members`.
    pub name: String,
    /// Their numbers among the coordinates of the problem.
    pub coordinates: Vec<usize>,
    /// Their covariance; none where nothing tells how well they are known.
    covariance: Option<Vec<Vec<f64>>>,
    scale: Vec<f64>,
    on_bound: Vec<bool>,
    /// tolerance-scaled
    invisible: Vec<Vec<f64>>,
    /// The degrees of freedom of the covariance's scale.
    pub dof: f64,
}

/// Why a quantity has no uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// it changes along a direction that the data of the fit cannot see
    NotEstimable,
    /// it depends on a parameter that a bound holds: what is known of the others is conditional on that
    OnBound,
    /// nothing says how well a parameter that it depends on is known
    Unstated,
    /// it has no derivative there
    NoDerivative,
    /// nothing that it depends on has an uncertainty, to first order
    Nothing,
    /// its variance is less than what rounding makes of larger ones
    Rounding,
}

impl Why {
    /// `not_estimable`, `on_bound`, …
    pub fn name(self) -> &'static str {
        match self {
            Why::NotEstimable => "not_estimable",
            Why::OnBound => "on_bound",
            Why::Unstated => "unstated",
            Why::NoDerivative => "no_derivative",
            Why::Nothing => "nothing",
            Why::Rounding => "rounding",
        }
    }
}

impl Estimated {
    /// The parameters of a fit, as far as the rows of the problem know them; family members that no row names are left out. What
    /// has not as many numbers as names states nothing of them.
    pub fn new(problem: &Problem, name: &str, known: &JointUncertainty) -> Estimated {
        let layout = &problem.layout;
        if !known.is_complete() {
            return Estimated::unstated(
                problem,
                name,
                known.names.iter().filter_map(|name| layout.find(name)).collect(),
            );
        }
        let (at, coordinates): (Vec<usize>, Vec<usize>) =
            known.names.iter().enumerate().filter_map(|(i, name)| Some((i, layout.find(name)?))).unzip();
        // one internal unit of each, in reported units
        let units = &problem.program.units;
        let factor: Vec<f64> =
            coordinates.iter().map(|&c| units.to_reported(1.0, layout.coordinates[c].dimension)).collect();
        let covariance = known.covariance.as_ref().map(|all| {
            let row = |(&i, f): (&usize, &f64)| at.iter().zip(&factor).map(|(&j, g)| all[i][j] / (f * g)).collect();
            at.iter().zip(&factor).map(row).collect()
        });
        Estimated {
            name: name.to_owned(),
            covariance,
            scale: at.iter().zip(&factor).map(|(&i, f)| known.tolerances[i] / f).collect(),
            on_bound: at.iter().map(|&i| known.on_bound[i]).collect(),
            invisible: known.null_directions.iter().map(|all| at.iter().map(|&i| all[i]).collect()).collect(),
            dof: known.dof,
            coordinates,
        }
    }

    /// Parameters of which nothing is known but their values. Numbers of coordinates that there are not are left out.
    pub fn unstated(problem: &Problem, name: &str, mut coordinates: Vec<usize>) -> Estimated {
        coordinates.retain(|&c| c < problem.layout.coordinates.len());
        let n = coordinates.len();
        Estimated {
            name: name.to_owned(),
            covariance: None,
            scale: coordinates.iter().map(|&c| problem.layout.coordinates[c].tolerance).collect(),
            on_bound: vec![false; n],
            invisible: Vec::new(),
            dof: f64::INFINITY,
            coordinates,
        }
    }

    /// What keeps a quantity with this gradient by some of the parameters from having an uncertainty, and the parameters that
    /// do.
    pub(super) fn refuses(&self, columns: &[usize], gradient: &[f64]) -> Option<(Why, Vec<usize>)> {
        let seen: Vec<f64> = columns.iter().zip(gradient).map(|(&j, g)| g * self.scale[j]).collect();
        let least = DEPENDS * norm(&seen);
        if least == 0.0 {
            return None;
        }
        if self.covariance.is_none() {
            return Some((Why::Unstated, Vec::new()));
        }
        let restricted = |direction: &Vec<f64>| columns.iter().map(|&j| direction[j]).collect::<Vec<f64>>();
        let along: Vec<f64> = self.invisible.iter().map(|direction| dot(&restricted(direction), &seen)).collect();
        if norm(&along) > least {
            let telling = |j: &usize| {
                let share = |(direction, along): (&Vec<f64>, &f64)| (along.abs() > least) && told(direction[*j]);
                self.invisible.iter().zip(&along).any(share)
            };
            return Some((Why::NotEstimable, (0..self.coordinates.len()).filter(telling).collect()));
        }
        let held = columns.iter().zip(&seen).filter(|(j, g)| self.on_bound[**j] && g.abs() > least);
        let held: Vec<usize> = held.map(|(&j, _)| j).collect();
        (!held.is_empty()).then_some((Why::OnBound, held))
    }

    /// C gᵀ of a gradient by some of the parameters, at these; and that of all numbers without their signs, for rounding.
    pub(super) fn times(&self, columns: &[usize], gradient: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let Some(covariance) = &self.covariance else { return (vec![0.0; columns.len()], vec![0.0; columns.len()]) };
        let product = |f: fn(f64) -> f64| {
            let row = |&i: &usize| columns.iter().zip(gradient).map(|(&j, g)| f(covariance[i][j] * g)).sum();
            columns.iter().map(row).collect()
        };
        (product(|x| x), product(f64::abs))
    }
}

/// Whether a component of a null direction is worth a name.
fn told(weight: f64) -> bool {
    weight * weight > crate::fit::NOT_ESTIMABLE
}
