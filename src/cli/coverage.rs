//! `phical coverage MODEL`

use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};

use super::arguments::{Chosen, Robustness, Weighting, collect, rows, scenario_rows, threads};
use super::interrupt::Interrupt;
use super::progress::shown;
use super::{Format, Outcome};
use crate::coverage::{Options, coverage};
use crate::data::Watch;
use crate::diag::Diagnostics;
use crate::problem::{self, Execution};
use crate::report::{coverage_json, coverage_text};
use crate::session::Session;
use crate::simd::InstructionSet;

#[derive(Debug, Args)]
pub(super) struct Coverage {
    /// The model file
    model: PathBuf,
    /// Which scenario [default: the first]
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// How many rows a measurement gets
    #[arg(long, value_name = "M=N", value_parser = rows)]
    rows: Vec<(String, usize)>,
    /// How many times the scenario is simulated and fitted
    #[arg(long, value_name = "K", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// The seed of the first run; the others follow [default: the scenario's]
    #[arg(long, value_name = "FIRST")]
    seed: Option<u64>,
    /// In how many rows, beside those fitted, each run predicts the outputs of each measurement
    #[arg(long, value_name = "N", default_value_t = 5)]
    check_rows: usize,
    /// An expression to be predicted, beside the model's outputs
    #[arg(long, value_name = "E")]
    expr: Vec<String>,
    /// How residuals are weighted [default: propagated where inputs carry sigmas, sigma where residuals do, else unit]
    #[arg(long, value_enum)]
    weights: Option<Weighting>,
    #[command(flatten)]
    chosen: Chosen,
    #[command(flatten)]
    loss: Robustness,
    /// Threads; 0 is as many as there are cores. The result is the same for any number
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads)]
    threads: usize,
}

impl Coverage {
    pub(super) fn run(self, format: Format, interrupt: &Interrupt) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &self.expr)?;
        let mut mistakes = session.warnings.clone();
        let robust = collect(self.loss.robust(), &mut mistakes).flatten();
        let asked = scenario_rows(&session, self.scenario.as_deref(), &self.rows, &mut mistakes);
        let (scenario, rows) = match asked {
            Some(asked) if !mistakes.has_errors() => asked,
            _ => return Err(mistakes),
        };
        // one run is worth keeping
        let (heeded, line) = (interrupt.clone(), shown());
        let watch = Watch::new(move |stage| {
            heeded.heed();
            line.tell(stage);
        });
        let problem = problem::Options {
            weights: self.weights.map(Weighting::weights),
            robust,
            selection: self.chosen.selection(None),
            execution: Execution::new(InstructionSet::detect(), 1).until(&interrupt.stop()).told_to(&watch),
            ..problem::Options::default()
        };
        let (seeds, first, check_rows, threads) = (self.seeds, self.seed, self.check_rows, self.threads);
        let options = Options { seeds, first, rows, check_rows, problem, threads };
        let found = coverage(&session, scenario, &options)?;
        let text = || coverage_text(&found, &session, scenario);
        let json = || coverage_json(&found, &session, scenario, self.options());
        Ok(Outcome::new(format, text, json).trusted(found.honest() && found.whole).warned(found.warnings.clone()))
    }

    /// What was asked for.
    fn options(&self) -> Map<String, Value> {
        let fix = self.chosen.fix.iter().map(|(name, value)| json!({"name": name, "value": value}));
        let mut options = Map::new();
        options.insert("fix".into(), fix.collect());
        options.insert("free".into(), json!(self.chosen.free));
        options.insert("loss".into(), json!(self.loss.loss));
        options.insert("expr".into(), json!(self.expr));
        options
    }
}
