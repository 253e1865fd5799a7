//! Whether two fits agree, whatever their datum.
//!
//! With S the tolerances, N an orthonormal basis (in z = δ/S) of what no data see when all that either fit frees is free, and
//! P = 1 − N Nᵀ: the difference d = S P S⁻¹(q₁ ⊖ q₀) and the covariances of both, projected alike, do not depend on which
//! parameter was held as datum, to first order (the S-transformation; Baarda 1973). For fits of independent data
//!
//! T = dᵀ (C₀ + C₁)⁺ d
//!
//! is χ² distributed with the rank of what is inverted, where they agree.

use crate::fit::{JointUncertainty, Stated};
use crate::linalg::{Matrix, dot, svd};
use crate::problem::{Problem, Undefined};
use crate::statistics::{Test, chi_squared_upper_tail};

/// Singular values of the sum of covariances, in tolerances, below this share are none.
const NONE: f64 = 1e-10;

/// How two fits differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Each parameter that either has estimated.
    pub differences: Vec<Difference>,
    /// How many directions are not seen and were left out.
    pub invisible: usize,
    /// T and the probability of a larger one, for fits of independent data.
    pub test: Option<Test>,
    /// Its degrees of freedom.
    pub dof: usize,
}

/// How one parameter differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The second less the first, without what another datum would change.
    pub value: f64,
    /// Its standard uncertainty, where the data are independent.
    pub sigma: Option<f64>,
}

/// Compares two fits by a problem in which all is free that either has freed, and by the values of both as points of it.
///
/// # Errors
/// Where derivatives are undefined at the first fit.
pub fn agreement(problem: &Problem, points: [&[f64]; 2], known: [&Stated; 2]) -> Result<Agreement, Undefined> {
    use crate::solve::LeastSquares;
    let [first, second] = points;
    let scale = problem.scale();
    let information = problem.linearised(first)?.information;
    let basis = problem.visible(first, false, &information)?.basis;
    let offset = |point: &[f64]| problem.offset(&point.to_vec());
    let mut z: Vec<f64> =
        offset(second).iter().zip(offset(first)).zip(scale).map(|((b, a), scale)| (b - a) / scale).collect();
    project(&mut z, &basis);

    let n = problem.free.len();
    let units = &problem.program.units;
    let coordinates = || problem.free_coordinates();
    let factors: Vec<f64> = coordinates().zip(scale).map(|(c, scale)| units.to_reported(*scale, c.dimension)).collect();
    let covariance = match known {
        [Stated::Known(a), Stated::Known(b)] => {
            let names: Vec<&str> = coordinates().map(|c| c.name.as_str()).collect();
            let sum = in_tolerances(a, &names, &factors).zip(in_tolerances(b, &names, &factors));
            sum.map(|(a, b)| projected(&a, &b, &basis, n))
        }
        _ => None,
    };
    let (mut test, mut dof) = (None, 0);
    if let Some(c) = &covariance {
        let found = svd(c)?;
        let largest = found.sigma.first().copied().unwrap_or(0.0);
        let mut statistic = 0.0;
        for (k, &size) in found.sigma.iter().enumerate().filter(|(_, size)| **size > NONE * largest) {
            statistic += dot(found.v.column(k), &z).powi(2) / size;
            dof += 1;
        }
        test = chi_squared_upper_tail(statistic, dof as f64).map(|upper_tail| Test { statistic, upper_tail });
    }
    let difference =
        |(i, (coordinate, (z, factor))): (usize, (&crate::problem::Coordinate, (&f64, &f64)))| Difference {
            name: coordinate.name.clone(),
            unit: units.symbol(coordinate.dimension),
            value: z * factor,
            sigma: covariance.as_ref().map(|c| c[(i, i)].max(0.0).sqrt() * factor),
        };
    Ok(Agreement {
        differences: coordinates().zip(z.iter().zip(&factors)).enumerate().map(difference).collect(),
        invisible: basis.len(),
        test,
        dof,
    })
}

/// P z
fn project(z: &mut [f64], basis: &[Vec<f64>]) {
    for direction in basis {
        let share = dot(direction, z);
        z.iter_mut().zip(direction).for_each(|(z, direction)| *z -= share * direction);
    }
}

/// The covariance of a fit in tolerances, with zeros for what it held; none of what has not as many numbers as names.
fn in_tolerances(of: &JointUncertainty, names: &[&str], factors: &[f64]) -> Option<Matrix> {
    let covariance = of.covariance.as_ref().filter(|_| of.is_complete())?;
    let place = |name: &&str| of.names.iter().position(|known| known == name);
    let column = |(name, by): (&&str, &f64)| -> Vec<f64> {
        let at = place(name);
        let entry = |(other, factor): (&&str, &f64)| {
            let entry = covariance.get(place(other)?)?.get(at?)?;
            Some(entry / factor / by)
        };
        names.iter().zip(factors).map(|row| entry(row).unwrap_or(0.0)).collect()
    };
    Some(Matrix::from_columns(names.len(), &names.iter().zip(factors).map(column).collect::<Vec<_>>()))
}

/// P (A + B) P
fn projected(a: &Matrix, b: &Matrix, basis: &[Vec<f64>], n: usize) -> Matrix {
    let column = |j: usize| {
        let mut column: Vec<f64> = a.column(j).iter().zip(b.column(j)).map(|(a, b)| a + b).collect();
        project(&mut column, basis);
        column
    };
    let once = Matrix::from_columns(n, &(0..n).map(column).collect::<Vec<_>>()).transpose();
    let again = |j: usize| {
        let mut column = once.column(j).to_vec();
        project(&mut column, basis);
        column
    };
    Matrix::from_columns(n, &(0..n).map(again).collect::<Vec<_>>())
}
