//! The derivatives of all residuals by every route there is: they must agree with those of dual numbers.

mod batch;
mod compare;
mod looked;
mod sizes;
#[cfg(test)]
mod tests;

use crate::compile::Program;
use crate::data::Table;
use crate::diag::Diagnostics;
use crate::problem::{Problem, Undefined};
use batch::Batch;
use looked::Looked;

/// A way to derivatives that is not dual numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Route {
    /// The compiled program that fits run on.
    Engine,
    /// The derivative as a formula, such as `derive` writes it.
    Symbolic,
    /// Central differences, extrapolated to a step of zero.
    Differences,
    /// Im f(x + ih)/h.
    ComplexStep,
}

impl Route {
    /// Every route.
    pub const ALL: [Route; 4] = [Route::Engine, Route::Symbolic, Route::Differences, Route::ComplexStep];

    /// As programs call it: `complex_step`.
    pub fn name(self) -> &'static str {
        match self {
            Route::Engine => "engine",
            Route::Symbolic => "symbolic",
            Route::Differences => "differences",
            Route::ComplexStep => "complex_step",
        }
    }

    /// In words: `the complex step`.
    pub fn title(self) -> &'static str {
        match self {
            Route::Engine => "the engine",
            Route::Symbolic => "the formula",
            Route::Differences => "differences",
            Route::ComplexStep => "the complex step",
        }
    }
}

/// The derivatives of a measurement, by several routes.
#[derive(Clone, Debug)]
pub struct CheckedRoutes {
    /// The measurement.
    pub measurement: String,
    /// Points of parameters and inputs that were looked at.
    pub points: usize,
    /// Points at which something is undefined, which were passed over.
    pub undefined: usize,
    /// Derivatives by parameters and inputs, at all points.
    pub derivatives: usize,
    /// What became of each route, in the order of [`Route::ALL`].
    pub routes: Vec<CheckedRoute>,
}

/// A route beside dual numbers.
#[derive(Clone, Debug)]
pub struct CheckedRoute {
    /// The route.
    pub route: Route,
    /// Whether it agrees everywhere: but for rounding, or for as much as differences say of themselves.
    pub agrees: bool,
    /// How many of the derivatives it can show.
    pub compared: usize,
    /// The fewest digits to which one agrees, of the largest derivative of its residual by anything of its kind at the same point.
    pub digits: f64,
    /// The derivative that is farthest off for what is allowed.
    pub worst: Option<WorstDerivative>,
    /// Why it shows some of the derivatives, or all, not.
    pub left_out: Option<String>,
}

/// One derivative, in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstDerivative {
    /// Of what: `vo.x`.
    pub residual: String,
    /// By what: `L1.alpha`.
    pub by: String,
    /// By the route.
    pub value: f64,
    /// By dual numbers.
    pub exact: f64,
    /// The point: the coordinates that the row touches and its inputs, by name.
    pub at: Vec<(String, f64)>,
}

impl CheckedRoutes {
    /// Whether all routes agree, at one point at least.
    pub fn agree(&self) -> bool {
        self.points > 0 && self.routes.iter().all(|one| one.agrees)
    }
}

/// Compares the derivatives of all residuals by all parameters and inputs, at points of a seed. `data` are rows to look at as well,
/// by measurement number, and `given` values of parameters in reported units, to be used instead of the nominal ones.
///
/// # Errors
/// What is wrong with names or numbers.
///
/// ```
/// use phical::audit::check_routes;
/// use phical::session::Session;
/// # fn main() -> Result<(), phical::diag::Diagnostics> {
/// let session = Session::open("models/ur5_pendant/model.ron".as_ref(), &[])?;
/// let found = check_routes(&session.program, &[], &[], 0)?;
/// assert!(found.iter().all(|one| one.agree()));
/// # Ok(())
/// # }
/// ```
pub fn check_routes(
    program: &Program,
    data: &[(usize, Table)],
    given: &[(String, f64)],
    seed: u64,
) -> Result<Vec<CheckedRoutes>, Diagnostics> {
    let mut all = Vec::new();
    for (index, measurement) in program.measurements.iter().enumerate() {
        if measurement.residuals.is_empty() {
            continue;
        }
        let rows = data.iter().find(|(of, _)| *of == index).map(|(_, table)| table);
        let batch = Batch::of(program, index, rows, given, seed)?;
        all.extend(check_batch(&batch, seed).map_err(|Undefined(found)| Diagnostics::from(*found))?);
    }
    Ok(all)
}

/// Compares the derivatives of all rows of a problem by its free coordinates and by the inputs, at each of some points. Its weights
/// are factors of the residuals alone.
///
/// # Errors
/// Where the rows cannot be read, or a point has not as many numbers as there are coordinates.
pub fn check_points(problem: &Problem, points: &[Vec<f64>]) -> Result<Vec<CheckedRoutes>, Undefined> {
    points.iter().try_for_each(|point| problem.fits(point))?;
    check_batch(&Batch::at(problem, points), 0)
}

/// Compares all samples, block by block.
fn check_batch(batch: &Batch, seed: u64) -> Result<Vec<CheckedRoutes>, Undefined> {
    let looked = Looked::at(batch, seed)?;
    Ok((0..batch.problem.blocks.len()).map(|block| looked.verdict(batch, block)).collect())
}
