//! `phical jacobian MODEL`

use std::path::{Path, PathBuf};

use clap::Args;

use super::arguments::{Chosen, data};
use super::check_derivatives::check;
use super::progress::shown;
use super::{Format, Outcome};
use crate::diag::{Code, Diagnostics};
use crate::evaluate::{jacobians, point};
use crate::problem::{Options, Undefined, Weights};
use crate::report::{jacobian_json, jacobian_text, matrix_json, matrix_text};
use crate::session::{Against, Choice, Session, Values};

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
    /// Compare the derivatives by several routes, and those written in the model, with dual numbers
    #[arg(long, conflicts_with_all = ["fix", "free"])]
    check: bool,
    /// The seed of the points
    #[arg(long, value_name = "S", default_value_t = 0, requires = "check")]
    seed: u64,
    /// A matrix that another program made, to be compared with the exact one: CSV or JSON
    #[arg(long, value_name = "FILE", conflicts_with = "check")]
    against: Option<String>,
    /// Fit with the matrix's mistakes and without: what would they have cost?
    #[arg(long, requires = "against")]
    refit: bool,
    #[command(flatten)]
    chosen: Chosen,
}

impl Jacobian {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let at = self.at.as_deref().map(Values::read).transpose().map_err(|found| Diagnostics::from(*found))?;
        if self.check {
            let given = at.as_ref().map(|values| values.values.as_slice()).unwrap_or_default();
            return check(&session, self.data, given, self.seed, format);
        }
        let selection = self.chosen.selection(at.as_ref());
        if let Some(file) = self.against {
            return against(&session, Against { file, at, data: self.data, selection, refit: self.refit }, format);
        }
        let weights = Some(Weights::Unit);
        let options = Options { weights, selection, unconstrained: true, ..Options::default() };
        let mut bound = session
            .bind(&Choice { files: self.data, given_only: true, watch: shown(), ..Choice::default() }, &options)?;
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

/// Another program's matrix beside the exact one.
fn against(session: &Session, asked: Against, format: Format) -> Result<Outcome, Diagnostics> {
    let (found, warnings) = asked.run(session)?;
    let agrees = found.iter().all(|one| one.audit.agrees);
    let outcome = Outcome::new(format, || matrix_text(&asked.file, &found), || matrix_json(&asked.file, &found));
    Ok(outcome.trusted(agrees).warned(warnings))
}
