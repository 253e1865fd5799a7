//! The whole road in one call: bind, minimise, analyse.

use phical::compile::Program;
use phical::data::Table;
use phical::fit::{Fit, analyse};
use phical::problem::{Options, Problem, Selection, Weights};
use phical::solve::{LevenbergMarquardt, Solver};

/// Binds tables, one for each measurement in order.
pub fn bound<'p>(
    program: &'p Program,
    tables: &[Table],
    selection: Selection,
    weights: Option<Weights>,
) -> Problem<'p> {
    let tables = tables.iter().cloned().enumerate().collect();
    let bound = Problem::bind(program, tables, &Options { weights, selection, ..Options::default() });
    bound.unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false))).0
}

/// Minimises from the problem's start.
pub fn fit(problem: &Problem) -> Fit {
    fit_by(problem, &LevenbergMarquardt::default())
}

/// The same by a solver.
pub fn fit_by<'p>(problem: &Problem<'p>, solver: &dyn Solver<Problem<'p>>) -> Fit {
    let solution = solver.solve(problem, problem.start.clone());
    let solution = solution.unwrap_or_else(|error| panic!("{error}: {error:?}"));
    analyse(problem, solution).unwrap_or_else(|error| panic!("{error}"))
}

/// Binds and minimises with the model's own settings.
pub fn fitted(program: &Program, tables: &[Table]) -> Fit {
    fit(&bound(program, tables, Selection::default(), None))
}

/// Rows of readings without keys.
pub fn table(rows: &[Vec<f64>]) -> Table {
    let mut table = Table::new(0, rows.first().map_or(0, Vec::len));
    rows.iter().for_each(|row| table.push(&[], row, None).expect("a row of the table"));
    table
}

/// An estimate by its name: value and standard deviation.
#[track_caller]
pub fn estimate(fit: &Fit, name: &str) -> (f64, Option<f64>) {
    let found = fit.parameters.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("no estimate of `{name}`"));
    (found.value, found.sigma)
}
