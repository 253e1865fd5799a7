//! `phical identify MODEL`

use std::path::PathBuf;

use clap::Args;

use super::arguments::{Chosen, Weighting, collect, data, fix, rows, scenario_rows};
use super::datum::change;
use super::progress::shown;
use super::{Format, Outcome};
use crate::diag::{Code, Diagnostic, Diagnostics, Severity};
use crate::identify::{Inputs, Probe, conventions, practice, structure};
use crate::model::DataFile;
use crate::problem::{Execution, Options};
use crate::report::{practice_json, practice_text, structure_json, structure_text};
use crate::session::{Choice, Session, Values};
use crate::simd::InstructionSet;

#[derive(Debug, Args)]
pub(super) struct Identify {
    /// The model file
    pub(super) model: PathBuf,
    /// A file of a measurement, instead of those that the model names
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    pub(super) data: Vec<(String, String)>,
    /// Leave a measurement out
    #[arg(long, value_name = "M")]
    pub(super) without: Vec<String>,
    /// What no data of this kind can see, at random values of the parameters
    #[arg(long)]
    structural: bool,
    /// Take the inputs from a scenario, without any data [default: the first, where there are no data]
    #[arg(long, value_name = "NAME", conflicts_with = "data")]
    scenario: Option<String>,
    /// How many rows a measurement of the scenario gets
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
    /// Judge at the values of a fit, a truth.json, or a JSON object of name and value [default: the nominal ones]
    #[arg(long, value_name = "FILE", conflicts_with = "fit")]
    start: Option<String>,
    /// A fit that is to be moved to another datum
    #[arg(long, value_name = "FIT.json", requires = "datum", conflicts_with_all = ["structural", "scenario"])]
    pub(super) fit: Option<String>,
    /// A parameter of the new datum, at a value with its unit, or else at its nominal one
    #[arg(long, value_name = "P[=V]", value_parser = fix, requires = "fit")]
    pub(super) datum: Vec<(String, Option<String>)>,
}

impl Identify {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        if let Some(fit) = &self.fit {
            return change(&self, &session, fit, format);
        }
        let mut warnings = session.warnings.clone();
        let start = self.start.as_deref().map(Values::read).transpose().map_err(|found| Diagnostics::from(*found))?;
        let options = Options {
            weights: self.weights.map(Weighting::weights),
            selection: self.chosen.selection(start.as_ref()),
            execution: Execution::new(InstructionSet::detect(), 0).told_to(&shown()),
            ..Options::default()
        };
        let has_data = !self.data.is_empty()
            || session.program.measurements.iter().any(|m| {
                m.data.iter().any(to_be_fitted) || (m.inputs.is_empty() && m.keys.is_empty() && !m.residuals.is_empty())
            });
        let from_scenario = self.scenario.is_some() || (!has_data && !session.program.scenarios.is_empty());
        let asked = match from_scenario || !session.program.scenarios.is_empty() {
            true => scenario_rows(&session, self.scenario.as_deref(), &self.rows, &mut warnings),
            false => None,
        };
        if warnings.has_errors() {
            return Err(warnings);
        }
        let mut numbers = asked.as_ref().map(|(_, rows)| rows.clone()).unwrap_or_default();
        if asked.is_none() {
            for (name, number) in &self.rows {
                numbers.extend(collect(session.measurement(name), &mut warnings).map(|index| (index, *number)));
            }
        }
        let scenario = asked.map(|(scenario, _)| scenario);
        let bound = match from_scenario || !has_data {
            true => None,
            false => match session.bind(
                &Choice {
                    files: self.data.clone(),
                    without: self.without.clone(),
                    watch: shown(),
                    ..Choice::default()
                },
                &options,
            ) {
                Ok(bound) => Some(bound),
                // files that may be absent are: then it is as before measuring
                Err(found) if self.data.is_empty() && only_without_rows(&found) => None,
                // nor is anything measured yet where not one of the files is there
                Err(found) if self.data.is_empty() && files(&session) == missing(&found) => {
                    let message = "the model's data are not there yet: what is said is of data to come";
                    warnings.push(Diagnostic::warning(Code::OptionalAbsent, message));
                    None
                }
                Err(found) => return Err(found),
            },
        };
        if bound.is_none() && scenario.is_none() && !self.structural {
            let found = Diagnostic::error(Code::NoRows, "there are neither data nor a scenario");
            warnings.push(
                found.hint("name a file by `--data MEASUREMENT=FILE`, declare a scenario, or ask `--structural`"),
            );
            return Err(warnings);
        }
        let (inputs, said) = match (&bound, scenario) {
            (Some(bound), _) => {
                let files: Vec<String> = bound.files.iter().map(|used| used.file.clone()).collect();
                warnings = bound.warnings.clone();
                (Inputs::Rows(&bound.problem), format!("rows of {}", files.join(", ")))
            }
            (None, Some(scenario)) => (Inputs::Scenario(scenario), format!("scenario `{}`", scenario.name)),
            (None, None) => (Inputs::Drawn, "drawn at random".to_owned()),
        };
        let seed = self.seed.or(scenario.map(|scenario| scenario.seed)).unwrap_or(0);
        let probe = Probe { program: &session.program, options, inputs, rows: numbers, seed };
        for found in conventions(&session.model, &session.program) {
            warnings.push(found.diagnostic(&session.program));
        }
        if warnings.has_errors() {
            return Err(warnings);
        }
        let failed = |found: Diagnostics| {
            let mut all = warnings.clone();
            all.extend(found);
            all
        };
        if self.structural {
            let found = structure(&probe).map_err(failed)?;
            let text = || structure_text(&found, &session, &said);
            let outcome = Outcome::new(format, text, || structure_json(&found, &said));
            return Ok(outcome.trusted(found.sound()).warned(warnings));
        }
        let found = practice(&probe, scenario).map_err(failed)?;
        let text = || practice_text(&found, &session, &said);
        let outcome = Outcome::new(format, text, || practice_json(&found, &said));
        Ok(outcome.trusted(found.sound()).warned(warnings))
    }
}

fn to_be_fitted(file: &DataFile) -> bool {
    file.role == crate::model::DataRole::Calibrate
}

/// How many files the model wants for a fit.
fn files(session: &Session) -> usize {
    session
        .program
        .measurements
        .iter()
        .flat_map(|of| &of.data)
        .filter(|file| to_be_fitted(file) && !file.optional)
        .count()
}

/// How many of them are missing, where nothing else is wrong.
fn missing(found: &Diagnostics) -> usize {
    let errors = || found.iter().filter(|found| found.severity == Severity::Error);
    let absent = |found: &Diagnostic| found.code == Code::DataFileMissing;
    if errors().all(absent) { errors().count() } else { 0 }
}

/// Whether nothing is wrong but that there are no rows.
fn only_without_rows(found: &Diagnostics) -> bool {
    let mut errors = found.iter().filter(|one| one.severity == Severity::Error).peekable();
    errors.peek().is_some() && errors.all(|one| one.code == Code::NoRows)
}
