//! What bounds and constraints do to an estimate.

use serde_json::{Value, json};

use super::covariance::Held;
use crate::linalg::Bound;
use crate::problem::{Problem, Undefined};
use crate::solve::{Relation, Solution};

/// A bound that holds a parameter, or a declared constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct Restraint {
    /// The parameter's name, or the constraint's.
    pub name: String,
    /// `>= 0.5 mm`, or the constraint as declared.
    pub text: String,
    /// Left side minus right side, in its unit; what is left of a bound is nothing.
    pub value: f64,
    /// The unit.
    pub unit: String,
    /// Whether it holds the estimate: an equation always does.
    pub active: bool,
    /// How fast the cost falls where it is loosened, by its unit; with the sign of the gradient for an equation.
    pub multiplier: f64,
    /// Whether it is an equation.
    pub equation: bool,
    /// Whether it is a bound, and no constraint.
    pub bound: bool,
}

impl Restraint {
    pub(super) fn json(&self) -> Value {
        json!({
            "name": self.name, "text": self.text, "value": self.value, "unit": self.unit, "active": self.active,
            "equation": self.equation, "bound": self.bound, "multiplier": self.multiplier,
        })
    }
}

/// The active bounds, then all constraints.
pub(super) fn restraints(problem: &Problem, solution: &Solution<Vec<f64>>) -> Vec<Restraint> {
    let units = &problem.program.units;
    let mut all = Vec::new();
    for (j, (&c, bound)) in problem.free.iter().zip(&solution.active).enumerate() {
        let coordinate = &problem.layout.coordinates[c];
        let (sign, at) = match bound {
            Bound::Free => continue,
            Bound::Lower => (">=", coordinate.min),
            Bound::Upper => ("<=", coordinate.max),
        };
        let multiplier = solution.multipliers.get(j).map_or(0.0, |multiplier| multiplier.abs());
        all.push(Restraint {
            name: coordinate.name.clone(),
            text: format!("{} {sign} {}", coordinate.name, units.shown(at, coordinate.dimension)),
            value: 0.0,
            unit: units.symbol(coordinate.dimension),
            active: true,
            multiplier: multiplier / units.to_reported(1.0, coordinate.dimension),
            equation: false,
            bound: true,
        });
    }
    for (declared, found) in problem.constrained().zip(&solution.constraints) {
        all.push(Restraint {
            name: declared.name.clone(),
            text: declared.text.clone(),
            value: units.to_reported(found.value, declared.dimension),
            unit: units.symbol(declared.dimension),
            active: found.active,
            multiplier: found.multiplier / units.to_reported(1.0, declared.dimension),
            equation: found.relation == Relation::Equal,
            bound: false,
        });
    }
    all
}

/// What does not move to first order.
pub(super) fn held(solution: &Solution<Vec<f64>>) -> Held {
    let active = solution.constraints.iter().filter(|constraint| constraint.active);
    Held {
        on_bound: solution.active.iter().map(|bound| *bound != Bound::Free).collect(),
        gradients: active.map(|constraint| constraint.gradient.clone()).collect(),
    }
}

impl Held {
    /// By the constraints of a problem that are equations.
    ///
    /// # Errors
    /// Where one of them is undefined at the point.
    pub fn by_equations(problem: &Problem, point: &[f64]) -> Result<Held, Undefined> {
        let all = problem.linearised_constraints(point)?.into_iter();
        let equations = all.filter(|constraint| constraint.relation == Relation::Equal);
        Ok(Held {
            on_bound: vec![false; problem.free.len()],
            gradients: equations.map(|constraint| constraint.gradient).collect(),
        })
    }
}

/// How many independent equations the constraints are.
pub(super) fn equations(solution: &Solution<Vec<f64>>, scale: &[f64]) -> usize {
    let equations = solution.constraints.iter().filter(|constraint| constraint.relation == Relation::Equal);
    let scaled = |gradient: &[f64]| gradient.iter().zip(scale).map(|(a, s)| a * s).collect();
    let mut gradients: Vec<Vec<f64>> = equations.map(|constraint| scaled(&constraint.gradient)).collect();
    crate::linalg::orthonormalise(&mut gradients);
    gradients.len()
}
