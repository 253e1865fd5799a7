//! `phical check MODEL`

use std::path::PathBuf;

use clap::Args;

use super::{Format, Outcome};
use crate::diag::Diagnostics;
use crate::identify::conventions;
use crate::report::{check_json, check_text};
use crate::session::Session;

#[derive(Debug, Args)]
pub(super) struct Check {
    /// The model file
    model: PathBuf,
}

impl Check {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let outcome = Outcome::new(format, || check_text(&session), || check_json(&session));
        let mut warnings = session.warnings;
        for found in conventions(&session.model, &session.program) {
            warnings.push(found.diagnostic(&session.program));
        }
        Ok(outcome.warned(warnings))
    }
}
