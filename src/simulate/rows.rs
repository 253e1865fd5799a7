//! The rows of a scenario's measurements.

#![allow(
    clippy::indexing_slicing,
    reason = "variables and inputs are numbered by the scenario that was compiled for this measurement"
)]

use super::draw::Stream;
use super::noise::Noise;
use super::root::{Root, Unsolved};
use super::truth::Truth;
use crate::compile::{Measurement, Program, Scenario, Simulation, Step};
use crate::data::{Column, Stage, Table, Watch};
use crate::diag::{Code, Diagnostic};
use crate::eval::Evaluator;
use crate::graph::Undefined;

/// Rows times columns that one simulated measurement may have.
pub const MOST_READINGS: usize = 1 << 28;

/// Rows after which it is told how far it is.
const TOLD: usize = 256;

/// What a simulation can be told beyond its scenario.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// how many rows a measurement (by its number) shall have, instead of those declared
    pub rows: Vec<(usize, usize)>,
    /// the seed instead of the scenario's
    pub seed: Option<u64>,
    /// without the errors of the sensors
    pub exact: bool,
}

/// Made-up data.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// every coordinate of every parameter, and of every family member that occurs, in reported units
    pub truth: Vec<(String, f64)>,
    /// a table for each measurement of the scenario, by the measurement's number
    pub tables: Vec<(usize, Table)>,
}

/// Makes up the data of a scenario.
///
/// # Errors
///
/// The first row whose inputs cannot be computed or solved for, a key column that nothing draws, too many rows.
///
/// ```
/// use phical::{compile::compile, diag::Source, model::load, simulate::{Options, simulate}};
/// let source = Source::new("line.ron", r#"(
///     name: "line",
///     parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(0)) },
///     measurements: { "point": (inputs: {"x": (), "y": (sigma: 0.1)}, residuals: {"r": "y - (a + b*x)"}) },
///     scenarios: { "s": (truth: {"b": 2}, measurements: { "point": (rows: 3, draw: {"x": Cycle([1, 2, 3])}, set: {"y": "a + b*x"}) }) },
/// )"#);
/// let (model, _) = load(&source).unwrap();
/// let (program, _) = compile(&model, &source, &[]).unwrap();
/// let made = simulate(&program, &program.scenarios[0], &Options { exact: true, ..Options::default() }).unwrap();
/// assert_eq!(made.truth, [("a".to_owned(), 1.0), ("b".to_owned(), 2.0)]);
/// assert_eq!(made.tables[0].1.row(2), [3.0, 7.0]);
/// ```
pub fn simulate(program: &Program, scenario: &Scenario, options: &Options) -> Result<Simulated, Box<Diagnostic>> {
    simulate_watched(program, scenario, options, &Watch::default())
}

/// The same, while `watch` is told how many rows of a measurement are made.
///
/// # Errors
///
/// As [`simulate`].
pub fn simulate_watched(
    program: &Program,
    scenario: &Scenario,
    options: &Options,
    watch: &Watch,
) -> Result<Simulated, Box<Diagnostic>> {
    let seed = options.seed.unwrap_or(scenario.seed);
    let mut truth = Truth::new(program, scenario, seed);
    let mut tables = Vec::new();
    for simulation in &scenario.measurements {
        let given = options.rows.iter().rev().find(|(measurement, _)| *measurement == simulation.measurement);
        let maker = Maker {
            program,
            scenario,
            simulation,
            measurement: program.measurement(simulation.measurement)?,
            rows: given.map_or(simulation.rows, |(_, rows)| *rows),
            kept: None,
            seed,
            errors: seed,
            exact: options.exact,
            watch,
        };
        tables.push((simulation.measurement, maker.table(&mut truth)?));
    }
    Ok(Simulated { truth: truth.reported(), tables })
}

/// Some rows of a simulation measured again: what is drawn for a row is that of `options`, while the truth and the errors of the
/// sensors come from another seed. `kept` has row numbers in increasing order by measurement; others are not made.
///
/// # Errors
///
/// As [`simulate`].
pub fn simulate_again(
    program: &Program,
    scenario: &Scenario,
    options: &Options,
    kept: &[(usize, Vec<usize>)],
    errors: u64,
) -> Result<Simulated, Box<Diagnostic>> {
    let mut truth = Truth::new(program, scenario, errors);
    let mut tables = Vec::new();
    for (measurement, kept) in kept {
        let Some(simulation) = scenario.measurements.iter().find(|s| s.measurement == *measurement) else { continue };
        let maker = Maker {
            program,
            scenario,
            simulation,
            measurement: program.measurement(*measurement)?,
            rows: kept.last().map_or(0, |last| last.saturating_add(1)),
            kept: Some(kept),
            seed: options.seed.unwrap_or(scenario.seed),
            errors,
            exact: options.exact,
            watch: &Watch::default(),
        };
        tables.push((*measurement, maker.table(&mut truth)?));
    }
    Ok(Simulated { truth: truth.reported(), tables })
}

/// A table of true readings with the declared errors of the sensors, by a seed. Inputs without a sigma are read as they are.
///
/// # Errors
///
/// Where the program has no such measurement, or the table has not its columns.
pub fn with_declared_errors(
    program: &Program,
    measurement: usize,
    exact: &Table,
    seed: u64,
) -> Result<Table, Box<Diagnostic>> {
    let declared = program.measurement(measurement)?;
    exact
        .fits(declared.keys.len(), declared.inputs.len())
        .map_err(|error| Box::new(Diagnostic::error(Code::FieldCount, format!("`{}`: {error}", declared.name))))?;
    let of: Vec<_> = declared.inputs.iter().map(|input| (0.0, input.sigma)).collect();
    let stream = |input: &crate::compile::Input| Stream::new(seed, &format!("noise {} {}", declared.name, input.name));
    let mut noise = Noise::new(declared, &of, declared.inputs.iter().map(stream).collect());
    let mut errors = vec![0.0; of.len()];
    let mut table = Table::new(declared.keys.len(), of.len());
    for row in 0..exact.rows() {
        let truth = exact.row(row);
        noise.draw(&truth, &mut errors);
        let readings: Vec<f64> = truth.iter().zip(&errors).map(|(truth, error)| truth + error).collect();
        table.push_with(|key| exact.key(row, key), &readings, None);
    }
    Ok(table)
}

/// What makes the rows of one measurement.
struct Maker<'p> {
    program: &'p Program,
    scenario: &'p Scenario,
    simulation: &'p Simulation,
    measurement: &'p Measurement,
    rows: usize,
    /// the only rows that are made, in order
    kept: Option<&'p [usize]>,
    /// of what is drawn for the rows
    seed: u64,
    /// of the errors
    errors: u64,
    exact: bool,
    watch: &'p Watch,
}

/// A step ready to run.
enum Runner<'p> {
    Set(usize, Evaluator<'p>),
    Solve(&'p [usize], Box<Root<'p>>, Option<Evaluator<'p>>),
}

impl Maker<'_> {
    /// The number of a variable among those that the scenario gives values. Inputs that stay at their defaults do not count, so
    /// that a model that gains one makes the same data.
    fn number(&self, variable: usize) -> usize {
        let simulation = self.simulation;
        let given = |input: &usize| {
            simulation.draws.iter().any(|(drawn, _)| drawn == input)
                || simulation.steps.iter().any(|step| match step {
                    Step::Set { variable, .. } => variable == input,
                    Step::Solve { unknowns, .. } => unknowns.contains(input),
                })
        };
        let inputs = self.measurement.inputs.len();
        (0..variable.min(inputs)).filter(given).count() + variable.saturating_sub(inputs)
    }

    fn table(&self, truth: &mut Truth) -> Result<Table, Box<Diagnostic>> {
        let (simulation, inputs) = (self.simulation, &self.measurement.inputs);
        let cells = (inputs.len() + self.measurement.keys.len()).max(1);
        if self.rows.checked_mul(cells).is_none_or(|cells| cells > MOST_READINGS) {
            let message = format!("{} rows of `{}` are too many", self.rows, self.measurement.name);
            return Err(Box::new(self.says(Code::TooLarge, message)));
        }
        let mut names_from = Vec::new();
        for (key, name) in self.measurement.keys.iter().enumerate() {
            let Some((_, drawn)) = simulation.keys.iter().find(|(drawn, _)| *drawn == key) else {
                let message = format!("the key `{name}` is not drawn");
                let hint = format!("add `\"{name}\": Cycle([\"…\", \"…\"])` to `draw`");
                return Err(Box::new(self.says(Code::InputWithoutValue, message).hint(hint)));
            };
            names_from.push((self.stream("key", name), drawn));
        }
        let mut draws: Vec<_> = simulation
            .draws
            .iter()
            .map(|(variable, drawn)| (*variable, self.stream("draw", &self.number(*variable).to_string()), drawn))
            .collect();
        let streams = inputs.iter().map(|input| self.stream_of(self.errors, "noise", &input.name)).collect();
        let mut noise = Noise::new(self.measurement, &simulation.noise, streams);
        let mut errors = vec![0.0; inputs.len()];
        let columns: Vec<Column> = inputs.iter().map(|input| Column::new(&self.program.units, input)).collect();
        let mut runners: Vec<Runner> = simulation.steps.iter().map(Runner::new).collect();

        let mut table = Table::new(self.measurement.keys.len(), inputs.len());
        table.begin(&format!("scenario `{}`", self.scenario.name));
        let (mut leaves, mut begun) = (vec![0.0; simulation.leaves], Vec::new());
        let mut unused = vec![0.0; self.measurement.leaves];
        let mut variables = vec![0.0; simulation.variables.max(inputs.len())];
        let mut names: Vec<&str> = Vec::new();
        let mut before: Option<Vec<&str>> = None;
        let mut readings = vec![0.0; inputs.len()];
        for row in 0..self.rows {
            if row.is_multiple_of(TOLD) {
                self.watch.tell(Stage::Of { what: "rows simulated", done: row as u64, all: self.rows as u64 });
            }
            names.clear();
            names.extend(names_from.iter_mut().map(|(stream, drawn)| stream.name(drawn, row)));
            if before.as_ref() != Some(&names) {
                truth.fill(&simulation.slots, &names, &mut leaves);
                // members that only the residuals use occur as well
                truth.fill(&self.measurement.slots, &names, &mut unused);
                if row == 0 || leaves != begun {
                    runners.iter_mut().for_each(|runner| runner.begin(&leaves));
                    begun.clone_from(&leaves);
                }
                before = Some(names.clone());
            }
            for (variable, input) in variables.iter_mut().zip(inputs) {
                *variable = input.default.unwrap_or(0.0);
            }
            for (variable, stream, drawn) in &mut draws {
                variables[*variable] = stream.draw(drawn, row);
            }
            if self.kept.is_some_and(|kept| kept.binary_search(&row).is_err()) {
                continue;
            }
            for runner in &mut runners {
                runner.run(&mut variables).map_err(|why| Box::new(self.failed(row, why)))?;
            }
            noise.draw(&variables, &mut errors);
            for (i, reading) in readings.iter_mut().enumerate() {
                *reading = columns[i].rounded(variables[i] + if self.exact { 0.0 } else { errors[i] });
                if !reading.is_finite() {
                    let message = format!("{}: `{}` is not a finite number", self.at(row), inputs[i].name);
                    return Err(Box::new(self.says(Code::CannotSolve, message)));
                }
            }
            table.put(names.iter().copied(), &readings, None);
        }
        Ok(table)
    }

    fn stream(&self, purpose: &str, name: &str) -> Stream {
        self.stream_of(self.seed, purpose, name)
    }

    fn stream_of(&self, seed: u64, purpose: &str, name: &str) -> Stream {
        Stream::new(seed, &format!("{purpose} {} {name}", self.measurement.name))
    }

    fn at(&self, row: usize) -> String {
        format!("scenario `{}`, measurement `{}`, row {}", self.scenario.name, self.measurement.name, row + 1)
    }

    fn says(&self, code: Code, message: String) -> Diagnostic {
        Diagnostic::error(code, message).at(&self.program.source, self.simulation.span)
    }

    fn failed(&self, row: usize, why: Failure) -> Diagnostic {
        let name = |variable: usize| self.measurement.inputs.get(variable).map_or("", |input| input.name.as_str());
        let domain = |undefined: &Undefined| {
            let of = undefined.operation.row();
            format!("`{}` is defined {}", of.name, of.domain)
        };
        match why {
            Failure::Set(variable, undefined) => {
                let message = format!("{}: `{}` has no value", self.at(row), name(variable));
                self.says(Code::CannotSolve, message).maybe_hint(undefined.as_ref().map(domain))
            }
            Failure::Solve(unknowns, why) => {
                let names: Vec<String> = unknowns.iter().map(|&unknown| format!("`{}`", name(unknown))).collect();
                let message = format!("{}: no {} make the equations vanish", self.at(row), names.join(", "));
                let there: Vec<String> = unknowns
                    .iter()
                    .zip(&why.reached)
                    .map(|(&unknown, &value)| {
                        let dimension = self.measurement.inputs[unknown].unit.dimension;
                        let (value, unit) =
                            (self.program.units.to_reported(value, dimension), self.program.units.symbol(dimension));
                        match unit.as_str() {
                            "1" => format!("{} = {value:.6}", name(unknown)),
                            _ => format!("{} = {value:.6} {unit}", name(unknown)),
                        }
                    })
                    .collect();
                let left = match &why.undefined {
                    Some(undefined) => domain(undefined),
                    None => format!("{:.3e} is left of them", why.left),
                };
                self.says(Code::CannotSolve, message)
                    .hint(format!("the nearest reached is {}, where {left}", there.join(", ")))
            }
        }
    }
}

/// Why a step has no result.
enum Failure<'p> {
    Set(usize, Option<Undefined>),
    Solve(&'p [usize], Unsolved),
}

impl<'p> Runner<'p> {
    fn new(step: &'p Step) -> Self {
        match step {
            Step::Set { variable, tape } => Runner::Set(*variable, Evaluator::new(tape, Vec::new())),
            Step::Solve { unknowns, start, from, angles, tape } => {
                let from = from.as_ref().map(|from| Evaluator::new(from, Vec::new()));
                Runner::Solve(unknowns, Box::new(Root::new(tape, unknowns, start, angles)), from)
            }
        }
    }

    fn begin(&mut self, leaves: &[f64]) {
        match self {
            Runner::Set(_, evaluator) => evaluator.begin(leaves),
            Runner::Solve(_, root, from) => {
                root.begin(leaves);
                from.iter_mut().for_each(|from| from.begin(leaves));
            }
        }
    }

    fn run(&mut self, variables: &mut [f64]) -> Result<(), Failure<'p>> {
        match self {
            Runner::Set(variable, evaluator) => {
                let mut value = [0.0];
                evaluator.values(variables, &mut value);
                let undefined = evaluator.undefined(variables, false);
                if !value[0].is_finite() || undefined.is_some() {
                    return Err(Failure::Set(*variable, undefined));
                }
                variables[*variable] = value[0];
                Ok(())
            }
            Runner::Solve(unknowns, root, from) => {
                if let Some(from) = from {
                    from.values(variables, root.start());
                    let undefined = from.undefined(variables, false);
                    if undefined.is_some() || root.start().iter().any(|value| !value.is_finite()) {
                        return Err(Failure::Set(unknowns.first().copied().unwrap_or(0), undefined));
                    }
                }
                root.solve(variables).map_err(|why| Failure::Solve(unknowns, why))
            }
        }
    }
}
