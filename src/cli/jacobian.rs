//! `phical jacobian MODEL`

use std::path::{Path, PathBuf};

use clap::Args;

use super::arguments::{Chosen, data};
use super::{Format, Outcome};
use crate::diag::{Code, Diagnostics};
use crate::evaluate::{jacobians, point};
use crate::problem::{Options, Undefined, Weights};
use crate::report::{jacobian_json, jacobian_text};
use crate::session::{Choice, Session, Values};

#[derive(Debug, Args)]
pub(super) struct Jacobian {
    /// The model file
    model: PathBuf,
    /// A file of data instead of the model's own; `-` is standard input
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    data: Vec<(String, String)>,
    /// Where: a fit, or a JSON object of name and value [default: the nominal values]
    #[arg(long, value_name = "FILE")]
    at: Option<String>,
    #[command(flatten)]
    chosen: Chosen,
}

impl Jacobian {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let at = self.at.as_deref().map(Values::read).transpose().map_err(|found| Diagnostics::from(*found))?;
        let selection = self.chosen.selection(at.as_ref());
        let weights = Some(Weights::Unit);
        let options = Options { weights, selection, unconstrained: true, ..Options::default() };
        let mut bound = session.bind(&Choice { files: self.data, given_only: true, ..Choice::default() }, &options)?;
        // values are taken as they are, whatever the bounds of a fit
        bound.warnings.0.retain(|warning| !matches!(warning.code, Code::StartProjected | Code::HeldOutside));
        let given = at.as_ref().map(|values| values.values.as_slice()).unwrap_or_default();
        let found = jacobians(&bound.problem, &point(&bound.problem, given)).map_err(|Undefined(found)| {
            let mut all = bound.warnings.clone();
            all.push(*found);
            all
        })?;
        let stem = self.at.as_deref().and_then(|file| Path::new(file).file_stem());
        let point = stem.map_or("nominal".into(), |stem| stem.to_string_lossy());
        let outcome = Outcome::new(format, || jacobian_text(&found, &point), || jacobian_json(&found, &point));
        Ok(outcome.warned(bound.warnings))
    }
}
