//! A prediction confirmed: the chosen rows are measured in simulation, fitted, and held against the truth.
//!
//! For every run the chosen rows are made again: with their own geometry (what the scenario draws for them, or the planned readings moved
//! as little as possible), at a truth that is the scenario's or else nominal, with errors of the sensors by the scenario or else as declared.
//! What a prior states is drawn from it, for it says where the truth may be. Each is fitted from the nominal values, and
//! targets over the volume, or the parameters where there are no targets, are compared with their true values.
//!
//! The mean square of a target over S runs by the predicted variance is about χ² with S ν degrees of freedom by S ν, where ν is what the
//! covariance over the volume leaves (Satterthwaite): the prediction stands where it lies within the range that holds it with 99 %,
//! for all targets together (Bonferroni).

use std::collections::HashMap;

use super::outcome::Design;
use crate::compile::{Distribution, Scenario};
use crate::data::Table;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Fit, Tested};
use crate::problem::{Options, Problem, Quantities, Undefined};
use crate::session::fit_once;
use crate::simulate::{self, Stream, simulate_again, with_declared_errors};
use crate::solve::LeastSquares;
use crate::statistics::{Tail, chi_squared_quantile};
use crate::unit::Dimension;

/// The probability that a right prediction is doubted.
const DOUBT: f64 = 0.01;
/// Runs have seeds of their own.
const SALT: u64 = 0x636f_6e66_6972_6d00;

/// What was found of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its predicted standard uncertainty, root mean square over the volume.
    pub predicted: f64,
    /// Its error, root mean square over runs and volume.
    pub actual: f64,
    /// The ratio of the two lies in this range if the prediction is right.
    pub range: [f64; 2],
}

impl Compared {
    /// Actual by predicted.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.actual / self.predicted
    }

    /// Whether the prediction stands.
    #[must_use]
    pub fn agrees(&self) -> bool {
        (self.range[0]..=self.range[1]).contains(&self.ratio())
    }
}

/// What all runs say.
#[derive(Clone, Debug, PartialEq)]
pub struct Confirmation {
    /// How many there were.
    pub runs: u64,
    /// Those without a converged fit, which are not compared.
    pub failed: u64,
    /// The targets, or else the parameters.
    pub compared: Vec<Compared>,
}

impl Confirmation {
    /// Whether all predictions stand and all fits converged.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.failed == 0 && self.compared.iter().all(Compared::agrees)
    }
}

/// The rows of a run by measurement, and its truth by name in internal units.
type Made = (Vec<(usize, Table)>, HashMap<String, f64>);

/// One run: the mean squares of errors by quantity, in internal units.
type Squares = Option<Vec<f64>>;

/// Simulates and fits a design so many times, or less often where it is stopped. `scenario` is that which its candidates came from, with its seed and rows.
///
/// # Errors
/// What keeps rows from being made or bound; weights that nothing can be simulated from.
pub fn confirm(
    design: &Design,
    scenario: Option<(&Scenario, &simulate::Options)>,
    bind: &Options,
    runs: u64,
    seed: u64,
) -> Result<Confirmation, Diagnostics> {
    let noisy = design.problem.blocks.iter().all(|block| !block.measured_inputs().is_empty());
    if scenario.is_none() && !noisy {
        let message = "readings without sigmas cannot be simulated from a file of candidates";
        let hint = "draw the candidates from a scenario that states the noise, or give sigmas to the inputs";
        return Err(Diagnostic::error(Code::NotAvailable, message).hint(hint).into());
    }
    let bind = Options { execution: bind.execution.alone(), ..bind.clone() };
    let plan = Plan { design, scenario, bind };
    let seeds: Vec<u64> = (0..runs).map(|k| (seed ^ SALT).wrapping_add(k)).collect();
    // runs that were cut short say nothing
    let stop = &plan.bind.execution;
    let all = design.problem.execution.each_of("runs", &seeds, |&seed| {
        let found = (!stop.stopped()).then(|| plan.run(seed));
        found.filter(|found| !(matches!(found, Ok(None)) && stop.stopped()))
    });
    let made: Vec<_> = all.into_iter().flatten().collect();
    let runs = made.len() as u64;
    let mut sums = vec![0.0; plan.quantities()];
    let mut done = 0;
    for result in made {
        let Some(squares) = result? else { continue };
        done += 1;
        sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
    }
    let compared = if done == 0 { Vec::new() } else { plan.compared(&sums, done) };
    Ok(Confirmation { runs, failed: runs - done, compared })
}

struct Plan<'d, 'a> {
    design: &'d Design<'a>,
    scenario: Option<(&'d Scenario, &'d simulate::Options)>,
    bind: Options,
}

impl Plan<'_, '_> {
    fn quantities(&self) -> usize {
        match self.design.targets.len() {
            0 => self.design.parameters.len(),
            targets => targets,
        }
    }

    /// The truth of a run where priors decide it, in internal units by coordinate; nominal elsewhere.
    fn by_priors(&self, seed: u64) -> Vec<f64> {
        let problem = &self.design.problem;
        let offset = |&c: &usize| {
            let coordinate = &problem.layout.coordinates[c];
            let draw = || Stream::new(seed, &format!("prior {}", coordinate.name)).normal();
            coordinate.sigma.map_or(0.0, |sigma| sigma * draw())
        };
        let offsets: Vec<f64> = problem.free.iter().map(offset).collect();
        // priors are centred on the nominal values
        let mut from = problem.start.clone();
        for &c in &problem.free {
            if problem.layout.coordinates[c].sigma.is_some() {
                from[c] = problem.layout.coordinates[c].nominal;
            }
        }
        problem.retract(&from, &offsets)
    }

    /// What a run is made of.
    fn made(&self, seed: u64) -> Result<Made, Box<Diagnostic>> {
        let problem = &self.design.problem;
        let program = problem.program;
        let truth = self.by_priors(seed);
        let chosen = self.design.chosen().into_iter().filter(|(_, rows, _)| !rows.is_empty());
        match self.scenario {
            Some((scenario, options)) => {
                let mut scenario = scenario.clone();
                for &c in problem.free.iter().filter(|&&c| problem.layout.coordinates[c].sigma.is_some()) {
                    let name = problem.layout.coordinates[c].name.clone();
                    scenario.truth.push((name, Distribution::Constant(truth[c])));
                }
                let kept: Vec<_> = chosen.map(|(block, _, made)| (problem.blocks[block].index, made)).collect();
                let made = simulate_again(program, &scenario, options, &kept, seed)?;
                let units = &program.units;
                let internal = |(name, value): &(String, f64)| {
                    let dimension = problem.layout.find(name).map(|c| problem.layout.coordinates[c].dimension)?;
                    Some((name.clone(), units.to_internal(*value, units.unit(dimension))))
                };
                Ok((made.tables, made.truth.iter().filter_map(internal).collect()))
            }
            None => {
                let mut tables = Vec::new();
                for (block, rows, _) in chosen {
                    let block = &problem.blocks[block];
                    tables.push((block.index, some_rows(block.measurement.keys.len(), &block.table, &rows)));
                }
                let first = |found: Diagnostics| {
                    Box::new(found.0.into_iter().next().unwrap_or_else(|| Diagnostic::error(Code::NoRows, "no rows")))
                };
                let (planned, _) = Problem::bind(program, tables, &self.bind).map_err(first)?;
                let named: HashMap<String, f64> =
                    problem.layout.coordinates.iter().map(|c| c.name.clone()).zip(truth).collect();
                let at: Vec<f64> = planned
                    .layout
                    .coordinates
                    .iter()
                    .zip(&planned.start)
                    .map(|(c, start)| named.get(&c.name).copied().unwrap_or(*start))
                    .collect();
                let consistent = planned.consistent(&at).map_err(|Undefined(found)| found)?;
                let tables = consistent.tables.into_iter();
                let read = |(index, exact)| Ok((index, with_declared_errors(program, index, &exact, seed)?));
                Ok((tables.map(read).collect::<Result<_, Box<Diagnostic>>>()?, named))
            }
        }
    }

    fn run(&self, seed: u64) -> Result<Squares, Diagnostics> {
        let (tables, truth) = self.made(seed).map_err(|found| Diagnostics::from(*found))?;
        let (problem, _) = Problem::bind(self.design.problem.program, tables, &self.bind)?;
        let fit = match fit_once(&problem, Tested::None) {
            Ok(fit) if fit.status.converged() => fit,
            _ => return Ok(None),
        };
        if self.design.targets.is_empty() {
            return Ok(Some(self.of_parameters(&problem, &fit, &truth)));
        }
        let volume = &self.design.volume;
        let named: HashMap<&str, f64> =
            problem.layout.coordinates.iter().map(|c| c.name.as_str()).zip(fit.point.iter().copied()).collect();
        let point = |of: &dyn Fn(&str) -> Option<f64>| -> Vec<f64> {
            let all = volume.layout.coordinates.iter().zip(&volume.start);
            all.map(|(c, start)| of(&c.name).unwrap_or(*start)).collect()
        };
        let right = point(&|name| truth.get(name).copied());
        let found = point(&|name| named.get(name).copied().or_else(|| truth.get(name).copied()));
        let seen = self.seen_at(volume, &right)?;
        let values = |at: &[f64]| outputs(&seen, at).map_err(|Undefined(found)| Diagnostics::from(*found));
        let (right, found) = (values(&right)?, values(&found)?);
        let of_target = |target: &super::target::Target| {
            let (mut sum, mut count) = (0.0, 0usize);
            for &(block, output) in &target.places {
                let of = seen.blocks.iter().position(|of| of.index == volume.blocks[block].index);
                for (a, b) in of.iter().flat_map(|&of| right[of].iter().zip(&found[of])) {
                    let error = b[output] - a[output];
                    let error = if target.dimension == Dimension::ANGLE { wrapped(error) } else { error };
                    sum += error * error;
                    count += 1;
                }
            }
            sum / count.max(1) as f64
        };
        Ok(Some(self.design.targets.iter().map(of_target).collect()))
    }

    /// The volume as it is seen where the truth is: readings moved as little as possible, so that the same lines of sight meet. As it
    /// is where they cannot be.
    fn seen_at<'v>(&self, volume: &'v Problem<'v>, truth: &[f64]) -> Result<Problem<'v>, Diagnostics> {
        let moved = volume.consistent(truth).map_err(|Undefined(found)| Diagnostics::from(*found))?;
        if moved.left_out > 0 {
            return Ok(volume.clone());
        }
        let (seen, _) = Problem::bind(volume.program, moved.tables, &self.bind)?;
        let same = seen.layout.coordinates.len() == volume.layout.coordinates.len();
        Ok(if same { seen } else { volume.clone() })
    }

    fn of_parameters(&self, problem: &Problem, fit: &Fit, truth: &HashMap<String, f64>) -> Vec<f64> {
        let layout = &problem.layout;
        let right: Vec<f64> = layout
            .coordinates
            .iter()
            .zip(&fit.point)
            .map(|(c, found)| truth.get(&c.name).copied().unwrap_or(*found))
            .collect();
        let difference = problem.difference(&right, &fit.point);
        let of = |known: &super::outcome::Foretold| layout.find(&known.name).map_or(0.0, |c| difference[c].powi(2));
        self.design.parameters.iter().map(of).collect()
    }

    fn compared(&self, sums: &[f64], runs: u64) -> Vec<Compared> {
        let design = self.design;
        let units = &design.problem.program.units;
        let mut all = Vec::new();
        if design.targets.is_empty() {
            for ((known, sum), &c) in design.parameters.iter().zip(sums).zip(&design.problem.free) {
                let Some(predicted) = known.sigma else { continue };
                let dimension = design.problem.layout.coordinates[c].dimension;
                let actual = units.to_reported((sum / runs as f64).sqrt(), dimension);
                all.push((known.name.clone(), known.unit.clone(), predicted, actual, 1.0));
            }
        } else {
            for (((target, expected), sum), dof) in
                design.targets.iter().zip(&design.expected).zip(sums).zip(&design.spread)
            {
                let actual = (sum / runs as f64).sqrt() * target.reported;
                all.push((target.name.clone(), target.unit.clone(), expected.rms, actual, *dof));
            }
        }
        let doubt = DOUBT / all.len().max(1) as f64 / 2.0;
        let compared = all.into_iter().map(|(name, unit, predicted, actual, dof)| {
            let dof = dof * runs as f64;
            let at = |tail| chi_squared_quantile(tail, dof).map_or(f64::NAN, |q| (q / dof).sqrt());
            let range = [at(Tail::Lower(doubt)), at(Tail::Upper(doubt))];
            Compared { name, unit, predicted, actual, range }
        });
        compared.collect()
    }
}

/// By block and row: all outputs, in internal units.
fn outputs(problem: &Problem, point: &[f64]) -> Result<Vec<Vec<Vec<f64>>>, Undefined> {
    let of = |block: &crate::problem::Block| {
        let mut rows = Vec::with_capacity(block.table.rows());
        if !block.measurement.outputs.is_empty() {
            block.values(Quantities::Outputs, &problem.layout, point, |_, values| rows.push(values.to_vec()))?;
        }
        Ok(rows)
    };
    problem.blocks.iter().map(of).collect()
}

/// Some rows of a table, as a table.
fn some_rows(keys: usize, table: &Table, rows: &[usize]) -> Table {
    let mut some = Table::new(keys, table.width());
    some.begin(&table.place(0).file);
    for &row in rows {
        some.push_with(|column| table.key(row, column), &table.row(row), None);
    }
    some
}

/// Into (−π, π].
fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(std::f64::consts::TAU);
    if turned > std::f64::consts::PI { turned - std::f64::consts::TAU } else { turned }
}
