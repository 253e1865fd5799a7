//! Where inputs come from, and how they come to be consistent with any point of the parameters.

use std::collections::HashMap;

use super::drawn::drawn;
use crate::compile::{Distribution, Program, Scenario};
use crate::data::Table;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::problem::{Options, Problem, Selection, Undefined, Weights};
use crate::simulate::{self, simulate};

/// Where inputs come from.
#[derive(Clone, Copy, Debug)]
pub enum Inputs<'a> {
    /// Rows of data, moved as little as possible to where they are consistent.
    Rows(&'a Problem<'a>),
    /// A scenario, simulated without errors.
    Scenario(&'a Scenario),
    /// Drawn at random, and then moved like rows of data.
    Drawn,
}

/// A model with a source of inputs, which can be looked at anywhere.
#[derive(Clone, Debug)]
pub struct Probe<'a> {
    /// The model.
    pub program: &'a Program,
    /// How rows are bound.
    pub options: Options,
    /// Where they come from.
    pub inputs: Inputs<'a>,
    /// How many a measurement (by its number) has, instead of what is declared.
    pub rows: Vec<(usize, usize)>,
    /// The seed of all that is random.
    pub seed: u64,
}

/// Rows whose inputs are consistent with the start of their problem.
#[derive(Clone, Debug)]
pub struct At<'a> {
    /// The rows.
    pub problem: Problem<'a>,
    /// How many rows have no such inputs.
    pub left_out: usize,
    /// By block of the problem, the number that each row had among those that there were.
    pub kept: Vec<Vec<usize>>,
}

/// With the first scenario and its seed, where there is one, else with drawn inputs; all else as declared.
impl<'a> From<&'a Program> for Probe<'a> {
    fn from(program: &'a Program) -> Self {
        let scenario = program.scenarios.first();
        let inputs = scenario.map_or(Inputs::Drawn, Inputs::Scenario);
        let seed = scenario.map_or(0, |scenario| scenario.seed);
        Probe { program, options: Options::default(), inputs, rows: Vec::new(), seed }
    }
}

/// With the rows of the problem, and what is free in it.
impl<'a> From<&'a Problem<'a>> for Probe<'a> {
    fn from(problem: &'a Problem<'a>) -> Self {
        let (mut free, mut fix) = (Vec::new(), Vec::new());
        for (c, coordinate) in problem.layout.coordinates.iter().enumerate() {
            match problem.free.contains(&c) {
                true => free.push(coordinate.name.clone()),
                false => fix.push((coordinate.name.clone(), None)),
            }
        }
        let selection = Selection { free, fix, ..Selection::default() };
        let options = Options { weights: Some(problem.weights), selection, ..Options::default() };
        Probe { program: problem.program, options, inputs: Inputs::Rows(problem), rows: Vec::new(), seed: 0 }
    }
}

impl<'a> Probe<'a> {
    /// The same with parameters released that the model holds.
    #[must_use]
    pub fn freeing(mut self, names: &[&str]) -> Self {
        self.options.selection.free.extend(names.iter().map(|name| (*name).to_owned()));
        self
    }

    /// The same with parameters held where they start.
    #[must_use]
    pub fn fixing(mut self, names: &[&str]) -> Self {
        self.options.selection.fix.extend(names.iter().map(|name| ((*name).to_owned(), None)));
        self
    }

    /// The problem as it is bound, at the point to start from; inputs are as they come.
    ///
    /// # Errors
    /// What is wrong with names, options or the scenario.
    pub fn bound(&self) -> Result<(Problem<'a>, Diagnostics), Diagnostics> {
        match self.inputs {
            Inputs::Rows(problem) => Ok((problem.clone(), Diagnostics::new())),
            _ => {
                let tables = self.made(None, 0).map_err(|found| Diagnostics::from(*found))?;
                Problem::bind(self.program, tables, &self.options)
            }
        }
    }

    /// Rows with inputs that are consistent with a point of `like`, whose layout they share. `salt` changes what is drawn.
    ///
    /// # Errors
    /// Where there are no such inputs.
    pub fn at(&self, like: &Problem<'a>, point: &[f64], salt: u64) -> Result<At<'a>, Box<Diagnostic>> {
        let undefined = |Undefined(found): Undefined| found;
        let rough = match self.inputs {
            Inputs::Rows(problem) => problem.clone(),
            _ => self.bind_like(like, self.made(Some((like, point)), salt)?)?,
        };
        let consistent = rough.consistent(point).map_err(undefined)?;
        if consistent.tables.iter().any(|(_, table)| table.rows() == 0) {
            let message =
                format!("no row has inputs that are consistent with the parameters ({} tried)", consistent.left_out);
            let hint =
                "declare a scenario, whose inputs are solved for, or give sigmas to the inputs that may be moved";
            return Err(Box::new(Diagnostic::error(Code::NoConsistentInputs, message).hint(hint)));
        }
        let mut problem = self.bind_like(like, consistent.tables)?;
        problem.start = point.to_vec();
        Ok(At { problem, left_out: consistent.left_out, kept: consistent.kept })
    }

    /// Rows with inputs that are consistent with a point of `like`, weighted in a given way, to be started from there.
    ///
    /// # Errors
    /// Where there are no such inputs.
    pub fn consistent(
        &self,
        like: &Problem<'a>,
        point: &[f64],
        weights: Weights,
    ) -> Result<Problem<'a>, Box<Diagnostic>> {
        let mut like = like.clone();
        like.weights = weights;
        self.at(&like, point, 0).map(|at| at.problem)
    }

    /// Tables of a scenario whose truth is a point, or of drawn inputs.
    fn made(&self, at: Option<(&Problem, &[f64])>, salt: u64) -> Result<Vec<(usize, Table)>, Box<Diagnostic>> {
        match self.inputs {
            Inputs::Rows(_) => Ok(Vec::new()),
            Inputs::Drawn => drawn(self.program, &self.rows, self.seed.wrapping_add(salt)),
            Inputs::Scenario(scenario) => {
                let mut scenario = scenario.clone();
                if let Some((like, point)) = at {
                    let named = like.layout.coordinates.iter().zip(point);
                    scenario.truth = named.map(|(c, value)| (c.name.clone(), Distribution::Constant(*value))).collect();
                }
                let seed = Some(self.seed.wrapping_add(salt));
                let options = simulate::Options { rows: self.rows.clone(), seed, exact: true };
                let mut tables = simulate(self.program, &scenario, &options)?.tables;
                tables.retain(|(_, table)| table.rows() > 0);
                if tables.is_empty() {
                    let message = format!("the scenario `{}` has no rows", scenario.name);
                    let hint = "give its measurements `rows`, or `--rows MEASUREMENT=NUMBER`";
                    return Err(Box::new(Diagnostic::error(Code::EmptyScenario, message).hint(hint)));
                }
                Ok(tables)
            }
        }
    }

    /// Binds rows so that their coordinates are those of another problem.
    fn bind_like(&self, like: &Problem<'a>, tables: Vec<(usize, Table)>) -> Result<Problem<'a>, Box<Diagnostic>> {
        let first = |found: Diagnostics| {
            let all = found.iter().find(|d| d.severity == crate::diag::Severity::Error).cloned();
            Box::new(all.unwrap_or_else(|| Diagnostic::error(Code::NoRows, "there are no rows of data")))
        };
        let options = Options { weights: Some(like.weights), ..self.options.clone() };
        let (problem, _) = Problem::bind(self.program, tables, &options).map_err(first)?;
        let names =
            |problem: &Problem| -> Vec<String> { problem.layout.coordinates.iter().map(|c| c.name.clone()).collect() };
        if names(&problem) != names(like) {
            let message = "no row of some family member has consistent inputs";
            return Err(Box::new(Diagnostic::error(Code::NoConsistentInputs, message)));
        }
        Ok(problem)
    }
}

/// The values of a problem's start, by coordinate.
pub(super) fn places(problem: &Problem) -> HashMap<String, usize> {
    problem.free.iter().enumerate().map(|(j, &c)| (problem.layout.coordinates[c].name.clone(), j)).collect()
}

/// The same rows with their residuals as they are, in reported units.
pub(super) fn unit_options(options: &Options) -> Options {
    Options { weights: Some(Weights::Unit), robust: None, ..options.clone() }
}
