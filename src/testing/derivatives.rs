//! Whether derivatives by all routes agree: dual numbers, the engine that fits run on, formulas, differences and the complex step.

use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::points::{Spread, parameters};
use super::{demand, said};
use crate::audit::{CheckedRoutes, Route, check_points};
use crate::data::Table;
use crate::identify::{Inputs, Probe, RANDOM_SPREAD};
use crate::problem::{Block, Options, Problem, Selection, Weights};

/// Rows of each measurement that are looked at.
const ROWS: usize = 12;
/// So many times as many are drawn, for some may be out of what the residuals are defined for.
const CHOICE: usize = 4;

/// What was compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compared {
    /// Points at which all was defined.
    pub points: usize,
    /// Points at which something was not.
    pub undefined: usize,
    /// Derivatives by the engine, by formulas and by dual numbers.
    pub derivatives: usize,
    /// Of these, those that differences confirm as well.
    pub sharp: usize,
    /// Of these, those that the complex step confirms.
    pub complex: usize,
}

/// Asserts that the derivatives of all residuals by all free parameters and by all inputs agree by every [`Route`], at the start and at
/// so many random points about it. Points where a residual is undefined are passed over.
///
/// # Panics
/// With the measurement, residual, parameter and point of the first derivative that is wrong, and what each route gives; where no
/// point is defined; where fewer than half of the derivatives can be confirmed by differences.
#[track_caller]
pub fn assert_derivatives<'a>(model: impl Into<Probe<'a>>, points: usize) -> Compared {
    demand(check_derivatives(model, points))
}

/// The same for a property.
///
/// # Errors
/// With the first derivative that is wrong.
pub fn check_derivatives<'a>(model: impl Into<Probe<'a>>, points: usize) -> Result<Compared, String> {
    let problem = rows_alike(&model.into())?;
    let mut compared = Compared::default();
    let mut runner = TestRunner::deterministic();
    let near = parameters(&problem, Spread::Tolerances(RANDOM_SPREAD.1));
    for number in 0..=points {
        let point = match number {
            0 => problem.start.clone(),
            _ => near.new_tree(&mut runner).map_err(|why| why.to_string())?.current(),
        };
        let all = check_points(&problem, &[point]).map_err(|undefined| undefined.to_string())?;
        compared.add(&all)?;
    }
    if compared.points == 0 {
        return Err(format!("the residuals are undefined at all of {} points", compared.undefined));
    }
    if 2 * compared.sharp < compared.derivatives {
        return Err(format!("differences show nothing of most of the derivatives: {compared:?}"));
    }
    Ok(compared)
}

impl Compared {
    /// What became of all rows at a point.
    fn add(&mut self, all: &[CheckedRoutes]) -> Result<(), String> {
        if all.iter().any(|one| one.undefined > 0) {
            self.undefined += 1;
            return Ok(());
        }
        self.points += 1;
        for one in all {
            self.derivatives += one.derivatives;
            for route in &one.routes {
                match route.route {
                    Route::Differences => self.sharp += route.compared,
                    Route::ComplexStep => self.complex += route.compared,
                    Route::Engine | Route::Symbolic => {}
                }
                if let Some(worst) = route.worst.as_ref().filter(|_| !route.agrees) {
                    let at: Vec<String> = worst.at.iter().map(|(name, value)| format!("{name} = {value}")).collect();
                    return Err(format!(
                        "measurement `{}`: the derivative of `{}` by `{}` is {:e} by dual numbers and {:e} by {}, at {}",
                        one.measurement,
                        worst.residual,
                        worst.by,
                        worst.exact,
                        worst.value,
                        route.route.title(),
                        at.join(", ")
                    ));
                }
            }
        }
        Ok(())
    }
}

/// Whether all residuals have values and derivatives at the start.
fn defined(problem: &Problem) -> bool {
    let places = problem.places();
    let one = |block: &Block| block.jacobians(&problem.layout, &problem.start, &places, |_| Ok(())).is_ok();
    problem.blocks.iter().all(one)
}

/// The first rows of a probe, each residual in its reported unit, without constraints.
fn rows_alike<'a>(probe: &Probe<'a>) -> Result<Problem<'a>, String> {
    let mut probe = probe.clone();
    let program = probe.program;
    if !matches!(probe.inputs, Inputs::Rows(_)) {
        // declared numbers, where fewer
        let few = |index: usize| match probe.inputs {
            Inputs::Scenario(scenario) => {
                scenario.measurements.iter().find(|s| s.measurement == index).map_or(ROWS, |s| s.rows.min(ROWS))
            }
            _ => CHOICE * ROWS,
        };
        probe.rows = (0..program.measurements.len()).map(|index| (index, few(index))).collect();
    }
    let (bound, _) = probe.bound().map_err(|found| said(&found))?;
    let options = Options { weights: Some(Weights::Unit), unconstrained: true, ..probe.options.clone() };
    let alike = |tables: Vec<(usize, Table)>| {
        // fewer rows may name fewer members of families
        let bare = Options { selection: Selection::default(), ..options.clone() };
        let (known, _) = Problem::bind(program, tables.clone(), &bare).map_err(|found| said(&found))?;
        let mut options = options.clone();
        let named = |name: &str| !known.layout.matching(program, name).is_empty();
        options.selection.free.retain(|name| named(name));
        options.selection.fix.retain(|(name, _)| named(name));
        let (problem, _) = Problem::bind(program, tables, &options).map_err(|found| said(&found))?;
        Ok::<_, String>(problem)
    };
    let all = alike(bound.blocks.iter().map(|block| (block.index, some(block, |_| true))).collect())?;
    if defined(&all) {
        return Ok(all);
    }
    // rows one by one, without those that are undefined at the start
    let sound = |block: &Block, row: usize| {
        let one = alike(vec![(block.index, some(block, |other| other == row))]);
        one.is_ok_and(|one| defined(&one))
    };
    let tables: Vec<_> = bound.blocks.iter().map(|block| (block.index, some(block, |row| sound(block, row)))).collect();
    match tables.iter().any(|(_, table)| table.rows() > 0) {
        true => alike(tables),
        false => Ok(all),
    }
}

/// The first rows of a block that are wanted.
fn some(block: &Block, wanted: impl Fn(usize) -> bool) -> Table {
    let keys = block.measurement.keys.len();
    let mut table = Table::new(keys, block.table.width());
    for row in (0..block.table.rows()).filter(|row| wanted(*row)).take(ROWS) {
        table.push_with(|key| block.table.key(row, key), &block.table.row(row), None);
    }
    table
}
