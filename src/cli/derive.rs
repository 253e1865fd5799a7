//! `phical derive MODEL --to text|latex`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{Format, Outcome};
use crate::derive::{Asked, derive};
use crate::diag::Diagnostics;
use crate::report::{derivation_json, derivation_latex, derivation_text};
use crate::session::Session;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum To {
    /// Formulas in the language of models
    Text,
    /// A LaTeX document
    Latex,
}

#[derive(Debug, Args)]
pub(super) struct Derive {
    /// The model file
    model: PathBuf,
    /// As what
    #[arg(long, value_enum, default_value_t = To::Text)]
    to: To,
    /// A measurement [default: all that have residuals]
    #[arg(long, value_name = "M")]
    measurement: Option<String>,
    /// A residual, a vector as a whole [default: all]
    #[arg(long, value_name = "R")]
    residual: Vec<String>,
    /// A parameter or input by which to differentiate, everything written out [default: any parameter]
    #[arg(long, value_name = "P")]
    by: Vec<String>,
    /// Second derivatives by each pair of `--by` as well
    #[arg(long, requires = "by")]
    second: bool,
}

impl Derive {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let program = &session.program;
        let chosen: Vec<usize> = match &self.measurement {
            Some(name) => vec![session.measurement(name).map_err(|found| Diagnostics::from(*found))?],
            None => {
                (0..program.measurements.len()).filter(|&k| !program.measurements[k].residuals.is_empty()).collect()
            }
        };
        let asked = Asked { residuals: self.residual, by: self.by, second: self.second };
        let mut found = Vec::new();
        let mut mistakes = Diagnostics::new();
        for &measurement in &chosen {
            match derive(program, measurement, &asked) {
                Ok(one) => found.push(one),
                Err(why) => mistakes.extend(why),
            }
        }
        // a name has to mean something in one measurement, not in all
        if found.is_empty() {
            return Err(mistakes);
        }
        let text = || match self.to {
            To::Text => derivation_text(&found),
            To::Latex => derivation_latex(&found, &program.name),
        };
        Ok(Outcome::new(format, text, || derivation_json(&found)).warned(session.warnings.clone()))
    }
}
