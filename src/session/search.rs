//! The solver that a fit is made with.

use crate::diag::{Code, Diagnostic};
use crate::problem::{Problem, Undefined};
use crate::solve::{
    Conic, LeastSquares, LevenbergMarquardt, Norm, Restriction, Settings, Solution, Solver, StartError, Suited,
};

/// Which solver searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Search {
    /// Levenberg–Marquardt, or conic steps where the model has constraints.
    #[default]
    Suited,
    /// Levenberg–Marquardt.
    LevenbergMarquardt,
    /// Conic steps, and what they minimise.
    Conic(Norm),
}

impl Search {
    /// Searches from `start`; `problem` knows the names behind `solved`, which is what is minimised.
    pub(super) fn solve<L>(
        self,
        problem: &Problem,
        solved: &L,
        start: Vec<f64>,
    ) -> Result<Solution<Vec<f64>>, Box<Diagnostic>>
    where
        L: LeastSquares<Point = Vec<f64>, Error = Undefined>,
    {
        let settings = Settings::default();
        let found = match self {
            Search::Suited => Suited { settings }.solve(solved, start),
            Search::LevenbergMarquardt => LevenbergMarquardt { settings }.solve(solved, start),
            Search::Conic(norm) => Conic { settings, norm }.solve(solved, start),
        };
        found.map_err(|error| Box::new(failed(problem, error)))
    }
}

/// Why a search could not start, as a diagnostic.
pub fn failed(problem: &Problem, error: StartError<Undefined>) -> Diagnostic {
    match error {
        StartError::Undefined(Undefined(found)) => *found,
        StartError::Infeasible { conflict } => infeasible(problem, &conflict),
        StartError::Constraints => {
            let message = "Levenberg-Marquardt knows bounds, but no constraints, and the model declares some";
            Diagnostic::error(Code::NotAvailable, message).hint("use `--solver clarabel`, or leave `--solver` out")
        }
        other => Diagnostic::error(Code::UndefinedAtStart, other.to_string()).hint("start elsewhere"),
    }
}

/// Names what contradicts itself.
fn infeasible(problem: &Problem, conflict: &[Restriction]) -> Diagnostic {
    let constraints: Vec<_> = problem.constrained().collect();
    let units = &problem.program.units;
    let bound = |j: usize, sign: &str, of: fn(&crate::problem::Coordinate) -> f64| {
        let shown = |coordinate: &crate::problem::Coordinate| {
            format!("`{} {sign} {}`", coordinate.name, units.shown(of(coordinate), coordinate.dimension))
        };
        problem.free_coordinates().nth(j).map_or_else(|| format!("a bound of parameter {}", j + 1), shown)
    };
    let name = |restriction: &Restriction| match *restriction {
        Restriction::Lower(j) => bound(j, ">=", |c| c.min),
        Restriction::Upper(j) => bound(j, "<=", |c| c.max),
        Restriction::Constraint(i) => constraints
            .get(i)
            .map_or_else(|| format!("constraint {}", i + 1), |c| format!("`{}`: `{}`", c.name, c.text)),
    };
    let names: Vec<String> = conflict.iter().map(name).collect();
    let message = format!("no values of the parameters meet all of {}", names.join(", "));
    let mut found = Diagnostic::error(Code::Infeasible, message);
    let place = conflict.iter().find_map(|restriction| match restriction {
        Restriction::Constraint(i) => constraints.get(*i).map(|constraint| constraint.span),
        _ => None,
    });
    if let Some(span) = place {
        found = found.at(&problem.program.source, span);
    }
    found.hint(
        "without any one of these the others can be met, as far as their linearisation tells: correct or remove one",
    )
}
