//! One seed: data made up, bound, fitted, and held against the truth.

use std::collections::HashMap;

use super::predict::{Predicted, at, predicted};
use super::tally::{Told, Trial};
use super::{Misheld, Options};
use crate::compile::{Measurement, Scenario};
use crate::data::Table;
use crate::diag::{Diagnostic, Diagnostics};
use crate::fit::{Fit, Tested};
use crate::problem::{self, Problem, Weights};
use crate::session::{Session, fit_once};
use crate::simulate::{self, Simulated, simulate};
use crate::solve::Status;
use crate::unit::Dimension;

/// A held coordinate is at its truth where it is no farther from it than this share of its tolerance.
const AT_TRUTH: f64 = 1e-6;
/// What nothing makes uncertain is right to rounding.
const ROUNDING: f64 = 1e-9;

/// Why a run failed.
pub(super) struct Failure(pub(super) String);

/// Why there is no run.
pub(super) enum Stop {
    /// the scenario cannot make its data
    Simulate(Box<Diagnostic>),
    /// names or options are wrong
    Bind(Diagnostics),
}

/// What one run says.
pub(super) struct Run {
    pub(super) failure: Option<Failure>,
    pub(super) parameters: Vec<Told>,
    pub(super) predictions: Vec<Told>,
    pub(super) chi_squared_per_dof: Option<f64>,
    pub(super) trustworthy: bool,
    pub(super) misheld: Vec<Misheld>,
    pub(super) weights: Weights,
    pub(super) warnings: Diagnostics,
}

/// What is the same for all seeds.
pub(super) struct Plan<'s> {
    session: &'s Session,
    scenario: &'s Scenario,
    bind: problem::Options,
    /// of each simulated measurement: its number, rows to be fitted, rows to be predicted
    parts: Vec<(usize, usize, usize)>,
    /// the same by name
    pub(super) rows: Vec<(String, usize, usize)>,
    /// whether more than one measurement has outputs, so that these need its name
    several: bool,
}

impl<'s> Plan<'s> {
    pub(super) fn new(
        session: &'s Session,
        scenario: &'s Scenario,
        options: &Options,
        bind: problem::Options,
    ) -> Plan<'s> {
        let part = |simulation: &crate::compile::Simulation| {
            let index = simulation.measurement;
            let given = options.rows.iter().rev().find(|(measurement, _)| *measurement == index);
            let outputs = session.program.measurements.get(index).is_some_and(|known| !known.outputs.is_empty());
            (index, given.map_or(simulation.rows, |(_, rows)| *rows), if outputs { options.check_rows } else { 0 })
        };
        let parts: Vec<(usize, usize, usize)> = scenario.measurements.iter().map(part).collect();
        let name =
            |index: usize| session.program.measurements.get(index).map_or_else(String::new, |known| known.name.clone());
        let rows = parts.iter().map(|&(index, rows, check)| (name(index), rows, check)).collect();
        let several = parts.iter().filter(|(.., check)| *check > 0).count() > 1;
        Plan { session, scenario, bind, parts, rows, several }
    }

    /// Rows that are predicted follow those that are fitted: their draws and errors are independent of them, and the truth is
    /// the same.
    fn simulate(&self, seed: u64, exact: bool) -> Result<Simulated, Stop> {
        let rows = self.parts.iter().map(|&(index, rows, check)| (index, rows.saturating_add(check))).collect();
        let options = simulate::Options { rows, seed: Some(seed), exact };
        simulate(&self.session.program, self.scenario, &options).map_err(Stop::Simulate)
    }

    /// A run, unless it was cut short.
    pub(super) fn run(&self, seed: u64) -> Option<Result<Run, Stop>> {
        self.made(seed).transpose()
    }

    fn made(&self, seed: u64) -> Result<Option<Run>, Stop> {
        let program = &self.session.program;
        let checked = self.parts.iter().any(|(.., check)| *check > 0);
        let made = self.simulate(seed, false)?;
        let exact = if checked { self.simulate(seed, true)?.tables } else { Vec::new() };
        let (mut tables, mut further) = (Vec::new(), Vec::new());
        for ((index, table), &(_, rows, check)) in made.tables.into_iter().zip(&self.parts) {
            if check > 0 {
                tables.push((index, first_rows(&table, rows)));
                further.push((index, rows..table.rows(), table));
            } else {
                tables.push((index, table));
            }
        }
        tables.retain(|(_, table)| table.rows() > 0);
        let (problem, warnings) = Problem::bind(program, tables, &self.bind).map_err(Stop::Bind)?;
        let truth = truth(&problem, &made.truth);
        let (fit, failure) = match fit_once(&problem, Tested::None) {
            Err(found) => (None, Some(Failure(found.code.title().to_owned()))),
            Ok(fit) if fit.status == Status::Interrupted => return Ok(None),
            Ok(fit) if !fit.status.converged() => (None, Some(Failure(fit.status.to_string()))),
            Ok(fit) => (Some(fit), None),
        };
        let mut predictions = Vec::new();
        for (index, rows, table) in further {
            let Some((_, exact)) = exact.iter().find(|(of, _)| *of == index) else { continue };
            let Some(measurement) = program.measurements.get(index) else { continue };
            self.predict(&problem, fit.as_ref(), &truth, (measurement, rows, &table, exact), &mut predictions);
        }
        Ok(Some(Run {
            parameters: parameters(&problem, fit.as_ref(), &truth),
            predictions,
            chi_squared_per_dof: fit.as_ref().and_then(|fit| fit.chi_squared).map(|chi| chi.value / chi.dof as f64),
            trustworthy: fit.as_ref().is_some_and(|fit| fit.verdict().trustworthy()),
            misheld: misheld(&problem, &truth),
            weights: problem.weights,
            failure,
            warnings,
        }))
    }

    /// Every output of the rows that were not fitted.
    fn predict(
        &self,
        problem: &Problem,
        fit: Option<&Fit>,
        truth: &[f64],
        (measurement, rows, table, exact): (&Measurement, std::ops::Range<usize>, &Table, &Table),
        predictions: &mut Vec<Told>,
    ) {
        let units = &problem.program.units;
        let named = |name: &str| if self.several { format!("{}.{name}", measurement.name) } else { name.to_owned() };
        let all = measurement.outputs.iter().map(|output| Told {
            name: named(&output.name),
            unit: units.symbol(output.dimension),
            trials: Vec::new(),
            estimable: fit.map(|_| true),
        });
        let mut told: Vec<Told> = all.collect();
        for row in rows {
            let names: Vec<&str> = (0..measurement.keys.len()).map(|key| table.key(row, key)).collect();
            let right = at(&problem.layout, measurement, truth, &names, &exact.row(row));
            // rows of members without data, and quantities that have no true value, ask nothing of the fit
            let Some(right) = right else { continue };
            let found = fit.and_then(|fit| predicted(problem, fit, measurement, &names, &table.row(row)));
            let found: Vec<Option<Predicted>> = match found {
                Some(found) => found.into_iter().map(Some).collect(),
                None => vec![None; right.len()],
            };
            let outputs = measurement.outputs.iter().zip(&mut told);
            for ((of, told), (right, found)) in outputs.zip(right.into_iter().zip(found)) {
                if !right.is_finite() {
                    continue;
                }
                let trial = match (fit, found) {
                    (Some(fit), Some(found)) if found.value.is_finite() => {
                        let error = found.value - right;
                        let error = if of.dimension == Dimension::ANGLE { wrapped(error) } else { error };
                        if found.sigma == Some(0.0) && error.abs() <= ROUNDING * right.abs() {
                            continue;
                        }
                        Some(Trial {
                            error: units.to_reported(error, of.dimension),
                            sigma: found.sigma.map(|sigma| units.to_reported(sigma, of.dimension)),
                            factor: fit.confidence.factor,
                        })
                    }
                    _ => None,
                };
                told.trials.push(trial);
            }
        }
        predictions.extend(told);
    }
}

/// Into (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(std::f64::consts::TAU);
    if turned > std::f64::consts::PI { turned - std::f64::consts::TAU } else { turned }
}

/// So many rows of a table, as a table.
fn first_rows(table: &Table, rows: usize) -> Table {
    let mut first = Table::new(table.keys(), table.width());
    first.begin(&table.place(0).file);
    for row in 0..rows {
        first.push_with(|column| table.key(row, column), &table.row(row), None);
    }
    first
}

/// The true value of every coordinate, in internal units.
fn truth(problem: &Problem, told: &[(String, f64)]) -> Vec<f64> {
    let told: HashMap<&str, f64> = told.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let units = &problem.program.units;
    let of = |coordinate: &problem::Coordinate| match told.get(coordinate.name.as_str()) {
        Some(value) => units.to_internal(*value, units.unit(coordinate.dimension)),
        None => coordinate.nominal,
    };
    problem.layout.coordinates.iter().map(of).collect()
}

/// Every free coordinate against its truth; where there is no fit, as a miss.
fn parameters(problem: &Problem, fit: Option<&Fit>, truth: &[f64]) -> Vec<Told> {
    let units = &problem.program.units;
    let difference = fit.map(|fit| problem.of_free(&problem.difference(truth, &fit.point)));
    let told = |(j, coordinate): (usize, &problem::Coordinate)| {
        let estimate = fit.and_then(|fit| fit.parameters.get(j));
        let difference = difference.as_ref().and_then(|all| all.get(j).copied());
        let estimable = estimate.map(|estimate| estimate.estimable);
        let trial = match (fit, estimate, difference) {
            (Some(fit), Some(estimate), Some(difference)) if estimate.estimable => Some(Trial {
                error: units.to_reported(difference, coordinate.dimension),
                sigma: estimate.sigma,
                factor: fit.confidence.factor,
            }),
            _ => None,
        };
        Told { name: coordinate.name.clone(), unit: units.symbol(coordinate.dimension), trials: vec![trial], estimable }
    };
    problem.free_coordinates().enumerate().map(told).collect()
}

/// What is held elsewhere than at its truth.
fn misheld(problem: &Problem, truth: &[f64]) -> Vec<Misheld> {
    let units = &problem.program.units;
    let difference = problem.difference(truth, &problem.start);
    let values = problem.start.iter().zip(truth).zip(difference);
    let all = problem.layout.coordinates.iter().zip(problem.places()).zip(values);
    let held = all.filter(|((coordinate, place), (_, difference))| {
        place.is_none() && difference.abs() > AT_TRUTH * coordinate.tolerance
    });
    held.map(|((coordinate, _), ((&start, &truth), _))| Misheld {
        name: coordinate.name.clone(),
        value: units.to_reported(start, coordinate.dimension),
        truth: units.to_reported(truth, coordinate.dimension),
        unit: units.symbol(coordinate.dimension),
    })
    .collect()
}
