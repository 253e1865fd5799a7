//! Are the stated uncertainties true? A scenario is simulated many times and every data set is fitted: how far estimates and
//! predictions are from the truth, against what was said of them, and how often their 95 % intervals held it.
//!
//! For each seed the scenario's data are made up (its truth too, where that is drawn), bound, and fitted from the nominal values
//! by the procedure of a calibration. What is asked of a fit is asked of its parameters, and of the model's outputs in rows
//! that it has not seen: further rows of the same scenario, with errors of their own, so that a prediction carries the
//! uncertainty of the parameters and that of the new readings. Its truth is the output of the true parameters at the
//! readings without noise. (An error that a scenario draws itself and builds into its readings is part of them: outputs that
//! depend on such readings are held against a truth that has it too.)
//!
//! Runs are done side by side, each by one thread, and added up in the order of their seeds: the result is the same bits for
//! any number of threads. A run that fails is a miss of all that it should have told.

mod predict;
mod run;
mod tally;

pub use predict::{Predicted, predicted};
pub use tally::{CERTAIN, Consistency, HONEST, LEAST_DOUBT, Quantity, SMALL};

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::compile::Scenario;
use crate::data::Stage;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::problem::{self, Weights};
use crate::session::Session;
use crate::statistics::{clopper_pearson, median};
use run::{Failure, Run, Stop};
use tally::Tallies;

/// Runs whose results are kept before they are added up.
const AT_A_TIME: u64 = 512;

/// What is done.
#[derive(Clone, Debug)]
pub struct Options {
    /// How many runs.
    pub seeds: u64,
    /// The seed of the first; the others follow. By default the scenario's.
    pub first: Option<u64>,
    /// How many rows a measurement (by its number) shall have, instead of those declared.
    pub rows: Vec<(usize, usize)>,
    /// Rows of each measurement with outputs in which these are predicted, beside those fitted.
    pub check_rows: usize,
    /// How every run is bound. Of its execution the threads do not count: a run has one.
    pub problem: problem::Options,
    /// How many runs at once; 0 is as many as there are cores.
    pub threads: usize,
}

impl Default for Options {
    /// 200 runs with five rows to be predicted.
    fn default() -> Self {
        let problem = problem::Options::default();
        Options { seeds: 200, first: None, rows: Vec::new(), check_rows: 5, problem, threads: 0 }
    }
}

/// A coordinate that was not estimated although its truth is elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Misheld {
    /// Its name.
    pub name: String,
    /// Where it was held, in reported units.
    pub value: f64,
    /// The truth that was farthest from there.
    pub truth: f64,
    /// Its unit.
    pub unit: String,
}

/// What all runs say.
#[derive(Clone, Debug)]
pub struct Coverage {
    /// Runs with data; none of the others are counted anywhere.
    pub runs: u64,
    /// The seed of the first.
    pub first: u64,
    /// Whether all that were asked for were made.
    pub whole: bool,
    /// Seeds of which the scenario could not make data.
    pub not_simulated: u64,
    /// How many runs failed, by reason, the most frequent first.
    pub failures: Vec<(String, u64)>,
    /// Each parameter that any run could estimate.
    pub parameters: Vec<Quantity>,
    /// Parameters that no run could estimate.
    pub blind: Vec<String>,
    /// Each output of the rows to be predicted.
    pub predictions: Vec<Quantity>,
    /// Lowest, median and highest χ² per degree of freedom, where weights are real and no loss has changed it.
    pub chi_squared_per_dof: Option<[f64; 3]>,
    /// The share of runs whose fit calls itself trustworthy.
    pub trustworthy_share: f64,
    /// Held, and not at the truth.
    pub misheld: Vec<Misheld>,
    /// How the runs were weighted.
    pub weights: Weights,
    /// Rows fitted and rows predicted, by measurement.
    pub rows: Vec<(String, usize, usize)>,
    /// Warnings of reading, compiling and binding.
    pub warnings: Diagnostics,
}

impl Coverage {
    /// How many runs failed.
    pub fn failed(&self) -> u64 {
        self.failures.iter().map(|(_, runs)| runs).sum()
    }

    /// All that is judged.
    pub fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        self.parameters.iter().chain(&self.predictions)
    }

    /// Whether every interval held the truth as often as it says, as far as the number of runs can tell.
    pub fn honest(&self) -> bool {
        self.quantities().next().is_some() && self.quantities().all(|q| q.consistency == Consistency::Honest)
    }

    /// A coverage of a parameter below this share of the runs is called too low; none where none would be.
    pub fn noticed_below(&self) -> Option<f64> {
        let low = |k: u64| clopper_pearson(k, self.runs, LEAST_DOUBT).is_some_and(|i| i.high < *HONEST.start());
        // the first count that is not too low
        let (mut known_low, mut known_fine) = (0, self.runs);
        if !low(0) {
            return None;
        }
        while known_fine - known_low > 1 {
            let middle = known_low + (known_fine - known_low) / 2;
            *(if low(middle) { &mut known_low } else { &mut known_fine }) = middle;
        }
        Some(known_fine as f64 / self.runs as f64)
    }

    /// Whether there are enough runs to call a parameter's coverage too high.
    pub fn notices_too_often(&self) -> bool {
        clopper_pearson(self.runs, self.runs, LEAST_DOUBT).is_some_and(|interval| interval.low > *HONEST.end())
    }
}

/// Runs a scenario many times, telling of every run.
///
/// # Errors
/// Mistakes of names and options, a scenario without rows, or one of which no seed gives data.
pub fn coverage(session: &Session, scenario: &Scenario, options: &Options) -> Result<Coverage, Diagnostics> {
    let first = options.first.unwrap_or(scenario.seed);
    let mut bind = options.problem.clone();
    bind.execution = bind.execution.alone();
    let plan = run::Plan::new(session, scenario, options, bind);
    let done = AtomicU64::new(0);
    let execution = &options.problem.execution;
    // runs that were cut short say nothing
    let one = |seed: u64| {
        let result = (!execution.stopped()).then(|| plan.run(first.wrapping_add(seed))).flatten();
        if result.is_some() {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            execution.tell(Stage::Of { what: "runs", done, all: options.seeds });
        }
        result
    };
    let pool = ThreadPoolBuilder::new().num_threads(options.threads).build().map_err(|error| {
        Diagnostics::from(Diagnostic::error(Code::NotAvailable, format!("threads cannot be made: {error}")))
    })?;
    let mut sum = Sum::default();
    let mut begun = 0;
    while begun < options.seeds && !execution.stopped() {
        let until = options.seeds.min(begun.saturating_add(AT_A_TIME));
        let results: Vec<Option<Result<Run, Stop>>> =
            pool.install(|| (begun..until).into_par_iter().map(one).collect());
        for result in results.into_iter().flatten() {
            sum.add(result).map_err(|found| with_warnings(session, found))?;
        }
        begun = until;
    }
    if sum.runs == 0 {
        let none = || Diagnostic::error(Code::NoRows, "there are no runs").hint("ask for at least one seed");
        let found = sum.unsimulated.take().map_or_else(none, |found| *found);
        return Err(with_warnings(session, found.into()));
    }
    let all = sum.runs + sum.not_simulated;
    let mut found = sum.finish(session, first, plan.rows);
    if all < options.seeds {
        let message = format!("interrupted after {all} of {} runs", options.seeds);
        found.whole = false;
        found.warnings.push(Diagnostic::warning(Code::Interrupted, message));
    }
    Ok(found)
}

fn with_warnings(session: &Session, found: Diagnostics) -> Diagnostics {
    let mut all = session.warnings.clone();
    all.extend(found);
    all
}

/// Runs being added up.
#[derive(Default)]
struct Sum {
    runs: u64,
    not_simulated: u64,
    unsimulated: Option<Box<Diagnostic>>,
    failures: Vec<(String, u64)>,
    parameters: Tallies,
    predictions: Tallies,
    chi_squared: Vec<f64>,
    trustworthy: u64,
    misheld: Vec<Misheld>,
    weights: Option<Weights>,
    warnings: Diagnostics,
}

impl Sum {
    fn add(&mut self, result: Result<Run, Stop>) -> Result<(), Diagnostics> {
        let run = match result {
            Ok(run) => run,
            Err(Stop::Bind(mistakes)) => return Err(mistakes),
            Err(Stop::Simulate(found)) => {
                self.not_simulated += 1;
                self.unsimulated.get_or_insert(found);
                return Ok(());
            }
        };
        if self.runs == 0 {
            self.warnings = run.warnings;
            self.weights = Some(run.weights);
        }
        self.runs += 1;
        if let Some(Failure(reason)) = run.failure {
            match self.failures.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, runs)) => *runs += 1,
                None => self.failures.push((reason, 1)),
            }
        }
        self.parameters.add(run.parameters);
        self.predictions.add(run.predictions);
        self.chi_squared.extend(run.chi_squared_per_dof);
        self.trustworthy += u64::from(run.trustworthy);
        for held in run.misheld {
            match self.misheld.iter_mut().find(|known| known.name == held.name) {
                Some(known) if (known.truth - known.value).abs() >= (held.truth - held.value).abs() => {}
                Some(known) => *known = held,
                None => self.misheld.push(held),
            }
        }
        Ok(())
    }

    fn finish(mut self, session: &Session, first: u64, rows: Vec<(String, usize, usize)>) -> Coverage {
        self.failures.sort_by_key(|(_, runs)| std::cmp::Reverse(*runs));
        let chi_squared_per_dof = median(&mut self.chi_squared).map(|median| {
            let low = self.chi_squared.iter().copied().fold(f64::INFINITY, f64::min);
            let high = self.chi_squared.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            [low, median, high]
        });
        let mut warnings = session.warnings.clone();
        warnings.extend(self.warnings);
        let (parameters, blind) = self.parameters.finish();
        let (predictions, _) = self.predictions.finish();
        Coverage {
            runs: self.runs,
            first,
            whole: true,
            not_simulated: self.not_simulated,
            failures: self.failures,
            parameters,
            blind,
            predictions,
            chi_squared_per_dof,
            trustworthy_share: self.trustworthy as f64 / self.runs as f64,
            misheld: self.misheld,
            weights: self.weights.unwrap_or(Weights::Unit),
            rows,
            warnings,
        }
    }
}
