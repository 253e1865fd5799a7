//! A fit as its file has it, read back.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::Value;

use super::file::wrong;
use super::words::{Term, sentence};
use crate::diag::Diagnostic;

/// What a fit file says, as far as a report shows it. Numbers that JSON cannot hold are absent.
#[derive(Clone, Debug, Deserialize)]
pub struct Document {
    /// Which test ended the search.
    pub status: String,
    /// Whether nothing speaks against it.
    pub trustworthy: bool,
    /// What speaks against it.
    pub verdict: Vec<String>,
    /// ½ of all that is minimised.
    pub cost: Option<f64>,
    /// Weighted squares of the data.
    pub sum_of_squares: Option<f64>,
    /// Of the data.
    pub equations: usize,
    /// Free coordinates with one.
    pub priors: usize,
    /// Degrees of freedom.
    pub dof: usize,
    /// None without degrees of freedom.
    pub sigma0: Option<f64>,
    /// The global test.
    pub chi_squared: Option<Chi>,
    /// Of the intervals.
    pub confidence: Level,
    /// How residuals were weighted.
    pub weights: String,
    /// The loss, where there is one.
    pub robust: Option<String>,
    /// What was minimised, where not squares.
    #[serde(default)]
    pub norm: Option<String>,
    /// Linearisations.
    pub iterations: usize,
    /// Of the data.
    pub rank: usize,
    /// The free ones.
    pub parameters: Vec<Parameter>,
    /// The others.
    #[serde(default)]
    pub held: Vec<Held>,
    /// What nothing determines.
    pub null_directions: Vec<Direction>,
    /// Between the parameters.
    #[serde(default)]
    pub correlations: Option<Correlations>,
    /// Largest first.
    pub singular_values: Vec<Option<f64>>,
    /// Tests of observations.
    #[serde(default)]
    pub observations: Option<Tests>,
    /// By residual.
    pub residual_rms: BTreeMap<String, Option<f64>>,
    /// Trial steps.
    pub trace: Vec<Step>,
    /// What data snooping took out.
    #[serde(default)]
    pub removed: Vec<Suspect>,
    /// What to be careful about.
    pub warnings: Vec<Warning>,
    /// How it came about.
    pub provenance: Provenance,
}

/// χ²
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Chi {
    /// Its value.
    pub value: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// The probability of more.
    pub upper_tail: f64,
}

/// How wide intervals are.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Level {
    /// The probability that they hold the truth.
    pub level: f64,
    /// Standard uncertainties to either side.
    pub factor: Option<f64>,
}

/// An estimate.
#[derive(Clone, Debug, Deserialize)]
pub struct Parameter {
    /// `L1.alpha`
    pub name: String,
    /// The estimate.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// None where it is not known.
    pub sigma: Option<f64>,
    /// Where there is a sigma.
    pub interval: Option<(f64, f64)>,
    /// Whether the data determine it.
    pub estimable: bool,
    /// Whether it is on a bound.
    pub at_bound: bool,
    /// The declared value.
    pub nominal: Option<f64>,
    /// The standard deviation of its prior.
    #[serde(default)]
    pub prior: Option<f64>,
    /// What counts as known well enough.
    pub tolerance: f64,
}

/// What was not estimated.
#[derive(Clone, Debug, Deserialize)]
pub struct Held {
    /// Its name.
    pub name: String,
    /// Where it was held.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// A direction that no residual sees.
#[derive(Clone, Debug, Deserialize)]
pub struct Direction {
    /// Weights by parameter, in tolerances.
    pub combination: serde_json::Map<String, Value>,
}

/// Names, and a matrix.
#[derive(Clone, Debug, Deserialize)]
pub struct Correlations {
    /// Of the parameters.
    pub names: Vec<String>,
    /// Row by row; none where there is none.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// A trial step.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Step {
    /// Where it began.
    pub cost: Option<f64>,
    /// Where it led.
    pub trial_cost: Option<f64>,
    /// Whether it was taken.
    pub accepted: bool,
}

/// What the tests of observations say.
#[derive(Clone, Debug, Deserialize)]
pub struct Tests {
    /// How many were tested.
    pub count: usize,
    /// Beyond it an observation is suspect.
    pub critical: f64,
    /// How many are.
    pub suspected: usize,
    /// The worst.
    pub suspects: Vec<Suspect>,
    /// By what they have in common.
    pub groups: Vec<Group>,
}

/// An observation that is suspect.
#[derive(Clone, Debug, Deserialize)]
pub struct Suspect {
    /// Of which measurement.
    pub measurement: String,
    /// From one, through all files of the measurement.
    pub row: usize,
    /// The file that it was read from.
    #[serde(default)]
    pub file: Option<String>,
    /// The line of that file, from one.
    #[serde(default)]
    pub line: Option<usize>,
    /// The reading or residual.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// As read.
    pub observed: Option<f64>,
    /// As the fit has it.
    pub adjusted: Option<f64>,
    /// In standard deviations of its correction.
    pub test: Option<f64>,
    /// The smallest error that would be found.
    pub smallest_detectable: Option<f64>,
    /// Others that cannot be told from it.
    #[serde(default)]
    pub inseparable: Vec<Partner>,
}

/// An observation that cannot be told from another.
#[derive(Clone, Debug, Deserialize)]
pub struct Partner {
    /// Its name.
    pub name: String,
    /// How much the two go together.
    pub correlation: Option<f64>,
}

/// Observations that have their errors in common.
#[derive(Clone, Debug, Deserialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// How many there are.
    pub observations: usize,
    /// The sum of their redundancy numbers.
    pub redundancy: f64,
}

/// A warning.
#[derive(Clone, Debug, Deserialize)]
pub struct Warning {
    /// `W007`
    pub code: String,
    /// What it says.
    pub message: String,
}

/// How a fit came about.
#[derive(Clone, Debug, Deserialize)]
pub struct Provenance {
    /// Of the program.
    pub version: String,
    /// What the model is called.
    #[serde(default)]
    pub name: String,
    /// The model file.
    pub model: String,
    /// Of its text.
    pub model_fingerprint: String,
    /// The files that rows came from.
    pub data: Vec<DataFile>,
    /// What was asked for.
    #[serde(default)]
    pub options: Value,
}

/// A file that rows came from.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct DataFile {
    /// For which measurement.
    pub measurement: String,
    /// Its name, relative to the model where it is the model's own.
    pub file: String,
    /// Of its bytes.
    pub fingerprint: String,
    /// How many rows it has.
    pub rows: usize,
}

impl Document {
    /// What a fit says, from its JSON.
    ///
    /// # Errors
    /// Where it is no fit.
    pub fn of(file: &str, json: &Value) -> Result<Document, Box<Diagnostic>> {
        // by reference: the value may be large
        Document::deserialize(json).map_err(|error| wrong(file, format!("`{file}` is not a fit: {error}")))
    }

    /// Values by name, in reported units, of free and held parameters.
    pub fn values(&self) -> Vec<(String, f64)> {
        let free = self.parameters.iter().map(|p| (p.name.clone(), p.value));
        free.chain(self.held.iter().map(|p| (p.name.clone(), p.value))).collect()
    }

    /// What nothing determines, in words.
    pub fn directions(&self) -> Vec<String> {
        let term = |(name, weight): (&String, &Value)| {
            let known = self.parameters.iter().find(|p| p.name == *name)?;
            let weight = weight.as_f64()?;
            Some(Term {
                name: name.clone(),
                weight,
                tolerance: known.tolerance,
                unit: known.unit.clone(),
                value: known.value,
            })
        };
        let words =
            |direction: &Direction| sentence(&direction.combination.iter().filter_map(term).collect::<Vec<_>>());
        self.null_directions.iter().map(words).collect()
    }
}
