//! `phical design MODEL`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::arguments::{Chosen, Weighting, data, rows, scenario_rows, threads};
use super::interrupt::Interrupt;
use super::progress::shown;
use super::simulate::file_name;
use super::{Format, Outcome};
use crate::compile::Scenario;
use crate::data::{self, Table, Written, make_directory};
use crate::design::{Aim, Asked, Confirmation, Design as Found, Request, confirm, design, puts_out};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::identify::{Inputs, Probe};
use crate::problem::{Execution, Options, Problem};
use crate::report::{Told, design_json, design_text};
use crate::session::{Bound, Choice, Session};
use crate::simd::InstructionSet;
use crate::simulate;

/// Rows of a volume have random numbers of their own.
const VOLUME: u64 = 0x766f_6c75_6d65;

#[derive(Debug, Args)]
pub(super) struct Design {
    /// The model file
    model: PathBuf,
    /// A file of candidates for a measurement, instead of a scenario
    #[arg(long, value_name = "M=FILE", value_parser = data, conflicts_with_all = ["scenario", "rows"])]
    candidates: Vec<(String, String)>,
    /// The scenario that candidates are drawn from [default: the first]
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// How many candidates a measurement of the scenario gets
    #[arg(long, value_name = "M=N", value_parser = rows)]
    rows: Vec<(String, usize)>,
    /// The seed of all that is random [default: the scenario's]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// How residuals are weighted [default: propagated where inputs carry sigmas, sigma where residuals do, else unit]
    #[arg(long, value_enum)]
    weights: Option<Weighting>,
    #[command(flatten)]
    chosen: Chosen,
    /// How many rows are chosen
    #[arg(long, value_name = "N", required_unless_present = "require", conflicts_with = "require")]
    pick: Option<usize>,
    /// An output or expression, and the standard uncertainty (root mean square over the volume) that the fewest rows shall reach
    #[arg(long, value_name = "EXPR=U", value_parser = require)]
    require: Vec<(String, String)>,
    /// For which parameters [default: d, where there is no target]
    #[arg(long, value_enum, conflicts_with_all = ["target", "require"])]
    criterion: Option<Criterion>,
    /// An output or expression whose uncertainty is to be small
    #[arg(long, value_name = "EXPR", conflicts_with = "require")]
    target: Vec<String>,
    /// The rows in which targets are wanted: a scenario, or a file for a measurement [default: the candidates]
    #[arg(long, value_name = "NAME|M=FILE")]
    over: Option<String>,
    /// How many rows of that scenario
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..1_000_000))]
    points: u64,
    /// Simulate and fit the chosen rows so many times
    #[arg(long, value_name = "SEEDS", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    confirm: Option<u64>,
    /// A directory for the chosen rows, one file for each measurement; made if need be
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads; 0 is as many as there are cores. The result is the same for any number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads)]
    threads: usize,
}

/// What is made small of the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Criterion {
    /// the volume of their ellipsoid of uncertainty
    D,
    /// their mean variance, in tolerances
    A,
    /// the variance of what is known worst, in tolerances
    E,
}

/// A requirement: `EXPR=U`.
fn require(text: &str) -> Result<(String, String), String> {
    match text.rsplit_once('=') {
        Some((expression, uncertainty)) if !expression.trim().is_empty() && !uncertainty.trim().is_empty() => {
            Ok((expression.trim().to_owned(), uncertainty.trim().to_owned()))
        }
        _ => Err("write EXPRESSION=UNCERTAINTY, such as \"p1=0.5 mm\"".into()),
    }
}

/// Where the candidates come from.
struct Origin<'s> {
    bound: Option<Bound<'s>>,
    scenario: Option<&'s Scenario>,
    rows: Vec<(usize, usize)>,
    said: String,
}

impl Design {
    pub(super) fn run(self, format: Format, interrupt: &Interrupt) -> Result<Outcome, Diagnostics> {
        let asked: Vec<Asked> = match self.require.is_empty() {
            true => {
                self.target.iter().map(|text| Asked { expression: text.trim().to_owned(), required: None }).collect()
            }
            false => {
                let asked =
                    |(text, u): &(String, String)| Asked { expression: text.clone(), required: Some(u.clone()) };
                self.require.iter().map(asked).collect()
            }
        };
        let session = open(&self.model, &asked)?;
        let options = Options {
            weights: self.weights.map(Weighting::weights),
            selection: self.chosen.selection(None),
            execution: Execution::new(InstructionSet::detect(), self.threads)
                .until(&interrupt.stop())
                .told_to(&shown()),
            ..Options::default()
        };
        let mut warnings = session.warnings.clone();
        let origin = self.origin(&session, &options, &mut warnings)?;
        let seed = self.seed.or(origin.scenario.map(|scenario| scenario.seed)).unwrap_or(0);
        let inputs = match (&origin.bound, origin.scenario) {
            (Some(bound), _) => Inputs::Rows(&bound.problem),
            (None, Some(scenario)) => Inputs::Scenario(scenario),
            (None, None) => return Err(warnings),
        };
        let candidates =
            Probe { program: &session.program, options: options.clone(), inputs, rows: origin.rows.clone(), seed };
        let volume_bound;
        let (volume, volume_said) = match self.over.as_deref() {
            _ if asked.is_empty() => (None, String::new()),
            None => (None, "the candidates".to_owned()),
            Some(text) => match data(text) {
                Ok(file) => {
                    let choice = Choice { files: vec![file.clone()], given_only: true, ..Choice::default() };
                    volume_bound = session.bind(&choice, &options)?;
                    (Some(volume_bound.problem.clone()), file.1)
                }
                Err(_) => (Some(self.drawn(&session, text, &candidates, &asked)?), format!("scenario `{text}`")),
            },
        };
        let aim = match self.criterion {
            _ if !asked.is_empty() => Aim::Targets,
            Some(Criterion::A) => Aim::A,
            Some(Criterion::E) => Aim::E,
            Some(Criterion::D) | None => Aim::D,
        };
        let request = Request { candidates, aim, targets: asked, volume, rows: self.pick };
        let failed = |found: Diagnostics| {
            let mut all = warnings.clone();
            all.extend(found);
            all
        };
        let found = design(&request).map_err(failed)?;
        let confirmed = match self.confirm.filter(|_| found.met()) {
            Some(runs) => {
                interrupt.heed();
                Some(self.confirmed(&found, &origin, &options, (runs, seed)).map_err(failed)?)
            }
            None => None,
        };
        let runs = confirmed.as_ref().map(|confirmed| confirmed.runs);
        let whole = runs.is_none_or(|runs| Some(runs) == self.confirm);
        if let Some(runs) = runs.filter(|_| !whole) {
            let message = format!("interrupted after {runs} of the runs that were to confirm the design");
            warnings.push(Diagnostic::warning(Code::Interrupted, message));
        }
        let files = match &self.out {
            Some(directory) if found.met() => write(&found, directory).map_err(|found| Diagnostics::from(*found))?,
            _ => Vec::new(),
        };
        let told =
            Told { candidates: &origin.said, volume: &volume_said, confirmed: confirmed.as_ref(), files: &files };
        let text = || design_text(&found, &session, &told);
        let outcome = Outcome::new(format, text, || design_json(&found, &told));
        let trusted = found.met() && whole && confirmed.as_ref().is_none_or(Confirmation::agrees);
        Ok(outcome.trusted(trusted).warned(warnings))
    }

    fn origin<'s>(
        &self,
        session: &'s Session,
        options: &Options,
        warnings: &mut Diagnostics,
    ) -> Result<Origin<'s>, Diagnostics> {
        if !self.candidates.is_empty() {
            let choice = Choice { files: self.candidates.clone(), given_only: true, ..Choice::default() };
            let bound = session.bind(&choice, options)?;
            *warnings = bound.warnings.clone();
            let files: Vec<String> = bound.files.iter().map(|used| used.file.clone()).collect();
            let said = format!("rows of {}", files.join(", "));
            return Ok(Origin { bound: Some(bound), scenario: None, rows: Vec::new(), said });
        }
        let asked = scenario_rows(session, self.scenario.as_deref(), &self.rows, warnings);
        match asked {
            Some((scenario, rows)) if !warnings.has_errors() => {
                let said = format!("scenario `{}`", scenario.name);
                Ok(Origin { bound: None, scenario: Some(scenario), rows, said })
            }
            _ => Err(warnings.clone()),
        }
    }

    /// The rows of a scenario that put out a target, at nominal values.
    fn drawn<'s>(
        &self,
        session: &'s Session,
        name: &str,
        candidates: &Probe<'s>,
        asked: &[Asked],
    ) -> Result<Problem<'s>, Diagnostics> {
        let single = |found: Box<Diagnostic>| Diagnostics::from(*found);
        let scenario = session.scenario(Some(name)).map_err(single)?;
        let points = usize::try_from(self.points).unwrap_or(usize::MAX);
        let measurements = scenario.measurements.iter().map(|simulation| simulation.measurement);
        let tells = |&index: &usize| {
            let measurement = session.program.measurements.get(index);
            measurement.is_some_and(|known| asked.iter().any(|asked| puts_out(known, &asked.expression)))
        };
        let some = measurements.clone().any(|index| tells(&index));
        let rows = measurements.map(|index| (index, if !some || tells(&index) { points } else { 0 })).collect();
        let seed = candidates.seed.wrapping_add(VOLUME);
        let probe = Probe { inputs: Inputs::Scenario(scenario), rows, seed, ..candidates.clone() };
        let (like, _) = probe.bound()?;
        Ok(probe.at(&like, &like.start, 0).map_err(single)?.problem)
    }

    fn confirmed(
        &self,
        found: &Found,
        origin: &Origin,
        options: &Options,
        (runs, seed): (u64, u64),
    ) -> Result<Confirmation, Diagnostics> {
        let drawn = simulate::Options { rows: origin.rows.clone(), seed: Some(seed), exact: false };
        confirm(found, origin.scenario.map(|scenario| (scenario, &drawn)), options, runs, seed)
    }
}

/// The model, with those of the targets compiled that are no outputs of its own.
fn open(model: &Path, asked: &[Asked]) -> Result<Session, Diagnostics> {
    let session = Session::open(model, &[])?;
    let known = |text: &str| session.program.measurements.iter().any(|measurement| puts_out(measurement, text));
    let mut extra: Vec<String> = Vec::new();
    for asked in asked.iter().filter(|asked| !known(&asked.expression)) {
        if !extra.contains(&asked.expression) {
            extra.push(asked.expression.clone());
        }
    }
    if extra.is_empty() { Ok(session) } else { Session::open(model, &extra) }
}

/// Writes the chosen rows, and says where.
fn write(found: &Found, directory: &Path) -> Result<Vec<(String, String)>, Box<Diagnostic>> {
    make_directory(directory)?;
    let (mut files, mut written) = (Vec::new(), Vec::new());
    for (block, rows, _) in found.chosen().into_iter().filter(|(_, rows, _)| !rows.is_empty()) {
        let Some(block) = found.problem.blocks.get(block) else { continue };
        let mut table = Table::new(block.measurement.keys.len(), block.table.width());
        for row in rows {
            table.push_with(|key| block.table.key(row, key), &block.table.row(row), None);
        }
        let path = directory.join(file_name(&block.measurement.name)?);
        written.push(data::write(found.problem.program, block.index, &table, &path)?);
        files.push((block.measurement.name.clone(), path.display().to_string()));
    }
    written.into_iter().try_for_each(Written::put)?;
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::require;

    #[test]
    fn requirements_end_with_their_uncertainty() {
        assert_eq!(require("norm(p1 - p2) = 0.05 mm"), Ok(("norm(p1 - p2)".into(), "0.05 mm".into())));
        assert!(require("p1").is_err() && require("=1 mm").is_err() && require("p1=").is_err());
    }
}
