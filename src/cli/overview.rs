//! `phical overview MODEL…`

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::interrupt::Interrupt;
use super::progress::shown;
use super::{Format, Outcome};
use crate::data::Stage;
use crate::diag::Diagnostics;
use crate::problem::{Execution, Options};
use crate::report::{Overview, overview_json, overview_text};
use crate::session::{Choice, Session, calibrate};
use crate::simd::InstructionSet;

/// Each model is read and fitted so many times, and the fastest counts: the others had the machine to share.
const TIMES: usize = 3;

#[derive(Debug, Args)]
pub(super) struct OverviewOf {
    /// The model files, each with data of its own
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
}

impl OverviewOf {
    pub(super) fn run(self, format: Format, interrupt: &Interrupt) -> Result<Outcome, Diagnostics> {
        let mut mistakes = Diagnostics::new();
        let mut all = Vec::new();
        interrupt.heed();
        let watch = shown();
        for (model, done) in self.models.iter().zip(0..) {
            watch.tell(Stage::Of { what: "models", done, all: self.models.len() as u64 });
            match fitted(model, interrupt) {
                Ok(found) => all.push(found),
                Err(more) => mistakes.extend(more),
            }
        }
        if mistakes.has_errors() {
            return Err(mistakes);
        }
        let trusted = all.iter().all(|of| of.fit.verdict().trustworthy());
        Ok(Outcome::new(format, || overview_text(&all), || overview_json(&all)).trusted(trusted))
    }
}

fn fitted(model: &Path, interrupt: &Interrupt) -> Result<Overview, Diagnostics> {
    let mut best: Option<Overview> = None;
    for _ in 0..TIMES {
        let begun = Instant::now();
        let session = Session::open(model, &[])?;
        let execution = Execution::new(InstructionSet::detect(), 0).until(&interrupt.stop());
        let bound = session.bind(&Choice::default(), &Options { execution, ..Options::default() })?;
        let calibration = calibrate(&bound)?;
        let ns = u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX);
        if best.as_ref().is_none_or(|best| ns < best.ns) {
            let (file, name) = (model.display().to_string(), session.program.name.clone());
            let rows = bound.problem.blocks.iter().map(|block| block.table.rows()).sum();
            best = Some(Overview { file, name, rows, fit: calibration.fit, ns });
        }
    }
    best.ok_or_else(Diagnostics::new)
}
