//! `phical calibrate MODEL`

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::arguments::{Chosen, Robustness, Weighting, collect, data, threads};
use super::far::FromAfar;
use super::interrupt::Interrupt;
use super::observations::write_observations;
use super::progress::shown;
use super::report::Paper;
use super::sequential::OneByOne;
use super::solving::Solving;
use super::{Format, Outcome, pretty};
use crate::data::{Output, Written};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Document, JointUncertainty};
use crate::problem::{Execution, Options};
use crate::report::{fit_text, hold_out_json, hold_out_text};
use crate::session::{Choice, Looked, Procedure, Search, Session, Values, calibrate_by, hold_out};
use crate::simd::InstructionSet;
use crate::solve::Status;

#[derive(Debug, Args)]
pub(super) struct Calibrate {
    /// The model file
    model: PathBuf,
    /// A file of data instead of the model's own; `-` is standard input
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    data: Vec<(String, String)>,
    /// Leave a measurement out
    #[arg(long, value_name = "M")]
    without: Vec<String>,
    #[command(flatten)]
    solving: Solving,
    /// How residuals are weighted [default: propagated where inputs carry sigmas, sigma where residuals do, else unit]
    #[arg(long, value_enum)]
    weights: Option<Weighting>,
    #[command(flatten)]
    chosen: Chosen,
    /// Start from a fit, or from a JSON object of name and value
    #[arg(long, value_name = "FILE")]
    start: Option<String>,
    /// What another fit has found out, with its covariance, instead of the priors of those parameters; start there
    #[arg(long, value_name = "FIT.json")]
    known: Vec<String>,
    #[command(flatten)]
    far: FromAfar,
    /// Threads; 0 is as many as there are cores. The result is the same for any number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads)]
    threads: usize,
    #[command(flatten)]
    loss: Robustness,
    /// Take out the row with the worst suspect and fit again, until there is none
    #[arg(long)]
    snoop: bool,
    /// Estimate how large the errors of each group of inputs are
    #[arg(long)]
    variance_components: bool,
    /// Fit K times without every K-th row, and say how well those are predicted
    #[arg(long, value_name = "K")]
    folds: Option<usize>,
    /// Write every observation, adjusted and tested, as DIR/M.csv
    #[arg(long, value_name = "DIR")]
    observations: Option<PathBuf>,
    #[command(flatten)]
    one_by_one: OneByOne,
    /// Write the fit as JSON
    #[arg(long, value_name = "FIT.json")]
    out: Option<PathBuf>,
    #[command(flatten)]
    paper: Paper,
}

impl Calibrate {
    pub(super) fn run(self, format: Format, interrupt: &Interrupt) -> Result<Outcome, Diagnostics> {
        let mut mistakes = Diagnostics::new();
        let search = collect(self.solving.search(), &mut mistakes).unwrap_or_default();
        collect(self.one_by_one.fit(&self.solving), &mut mistakes);
        let weights = self.weights.map(Weighting::weights);
        let robust = collect(self.loss.robust(), &mut mistakes).flatten();
        let start = self.start.as_deref().and_then(|file| collect(Values::read(file), &mut mistakes));
        let estimates =
            |file: &String| collect(Values::read(file).and_then(|values| values.estimates()), &mut mistakes);
        let known = self.known.iter().filter_map(estimates).collect();
        let session = match Session::open(&self.model, &[]) {
            Ok(session) if !mistakes.has_errors() => session,
            Ok(_) => return Err(mistakes),
            Err(more) => {
                mistakes.extend(more);
                return Err(mistakes);
            }
        };
        let watch = shown();
        let execution = Execution::new(InstructionSet::detect(), self.threads).until(&interrupt.stop()).told_to(&watch);
        let selection = self.chosen.selection(start.as_ref());
        let options = Options { weights, selection, robust, known, execution, ..Options::default() };
        let choice = Choice { files: self.data.clone(), without: self.without.clone(), watch, ..Choice::default() };
        let bound = match self.solving.is_sequential() {
            true => self.one_by_one.run(&session, &choice, options, format, interrupt)?,
            false => session.bind(&choice, &options)?,
        };
        let out = self.out.as_deref().map(Output::open).transpose().map_err(|found| Diagnostics::from(*found))?;

        let paper = self.paper.open()?;

        interrupt.heed();
        let procedure = self.procedure(search);
        let (mut calibration, problem) = calibrate_by(&bound, &procedure)?;
        let mut written = match &self.observations {
            Some(directory) => write_observations(directory, &problem, &calibration.fit)?,
            None => Vec::new(),
        };
        let held_out = self.folds.map(|folds| hold_out(&bound.problem, &procedure, folds, &calibration.fit.point));
        let held_out = held_out.transpose().map_err(|found| Diagnostics::from(*found))?;
        let whole = held_out.as_ref().is_none_or(Option::is_some);
        if !whole && calibration.fit.status != Status::Interrupted {
            let message = "interrupted: the fit is done, and how well rows are predicted is not";
            calibration.fit.warnings.push(Diagnostic::warning(Code::Interrupted, message));
        }
        let held_out = held_out.flatten();
        calibration.file.hold_out = held_out.as_ref().map_or(Value::Null, hold_out_json);
        let solver = if problem.constrained().len() > 0 { "clarabel" } else { "lm" };
        let options = self.options(calibration.fit.weights.name(), solver);
        calibration.file.provenance.insert("options".into(), options);
        let fit = &calibration.fit;
        let json = || calibration.file.json(fit);
        if let Some(out) = out {
            let fit = out.write(|out| out.write_all(pretty(&json()).as_bytes()));
            written.push(fit.map_err(|found| Diagnostics::from(*found))?);
        }
        if let Some(paper) = paper {
            let document = Document::of("the fit", &json()).map_err(|found| Diagnostics::from(*found))?;
            let looked = Looked::at(&problem, &fit.point, &document, Some(&JointUncertainty::of(fit)));
            written.extend(paper.write(document, looked, session.directory())?.files);
        }
        written.into_iter().try_for_each(Written::put).map_err(|found| Diagnostics::from(*found))?;
        let mut outcome = Outcome::new(
            format,
            || fit_text(fit, &bound) + &held_out.as_ref().map_or(String::new(), hold_out_text),
            json,
        );
        if format == Format::Json && self.one_by_one.in_lines() {
            outcome.output = format!("{}\n", json());
        }
        Ok(outcome.trusted(whole && fit.verdict().trustworthy()).warned(fit.warnings.clone()))
    }

    fn procedure(&self, search: Search) -> Procedure {
        let (snoop, variance_components) = (self.snoop, self.variance_components);
        let test_all = self.observations.is_some();
        Procedure { snoop, variance_components, test_all, far: self.far.far(), search }
    }

    /// What was asked for, as the fit file keeps it.
    fn options(&self, weights: &str, solver: &str) -> Value {
        json!({
            "weights": weights,
            "solver": self.solving.name().unwrap_or(solver),
            "keep": self.one_by_one.kept(&self.solving),
            "fix": self.chosen.fix.iter().map(|(name, value)| json!({"name": name, "value": value})).collect::<Vec<_>>(),
            "free": self.chosen.free,
            "without": self.without,
            "start": self.start,
            "known": self.known,
            "starts": self.far.starts(),
            "seed": self.far.seed(),
            "continuation": self.far.continuation(),
            "loss": self.loss.loss,
            "snoop": self.snoop,
            "variance_components": self.variance_components,
        })
    }
}
