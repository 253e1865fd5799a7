//! From a bound problem to a fit, with what a fit file says of its making.

use std::time::Instant;

use serde_json::{Map, Value, json};

use super::procedure::{Clock, Procedure};
use super::{Bound, nanoseconds};
use crate::diag::{Diagnostic, Diagnostics};
use crate::fit::{Fit, FitFile};
use crate::problem::Problem;

/// A fit and how it came about.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The fit; its warnings are those of all stages.
    pub fit: Fit,
    /// Provenance (without the options, which are the caller's to add) and times.
    pub file: FitFile,
}

/// Solves and analyses.
///
/// # Errors
/// Where the search cannot start, or a derivative at the end is undefined.
pub fn calibrate(bound: &Bound) -> Result<Calibration, Diagnostics> {
    calibrate_by(bound, &Procedure::default()).map(|(calibration, _)| calibration)
}

/// The same by a [`Procedure`], with the problem as it was fitted last: without rows that data snooping took out, with factors
/// of the declared errors as estimated.
///
/// # Errors
/// Where a search cannot start, or a derivative at an end is undefined.
pub fn calibrate_by<'s>(bound: &Bound<'s>, procedure: &Procedure) -> Result<(Calibration, Problem<'s>), Diagnostics> {
    let stop = |found: Diagnostic| {
        let mut all = bound.warnings.clone();
        all.push(found);
        all
    };
    let begun = Instant::now();
    let mut clock = Clock::new(procedure.search);
    let (mut fit, problem) = procedure.run(&bound.problem, &mut clock).map_err(|found| stop(*found))?;
    let own = std::mem::take(&mut fit.warnings);
    fit.warnings.extend(bound.warnings.clone());
    fit.warnings.extend(own);

    let session = bound.session;
    let rows: usize = problem.blocks.iter().map(|block| block.table.rows()).sum();
    let timings = [
        ("read", session.read_ns + bound.read_ns),
        ("compile", session.compile_ns),
        ("evaluate", clock.spent),
        ("linear_algebra", clock.solved.saturating_sub(clock.spent)),
        ("total", session.read_ns + bound.read_ns + session.compile_ns + nanoseconds(begun)),
    ];
    let mut timings: Map<String, Value> = timings.map(|(name, ns)| (name.to_owned(), json!(ns))).into_iter().collect();
    let per_row = clock.spent as f64 / (rows.max(1) * clock.linearised.max(1)) as f64;
    timings.insert("per_row_per_iteration".into(), json!(per_row));
    Ok((Calibration { fit, file: FitFile { provenance: provenance(bound), timings, ..FitFile::default() } }, problem))
}

/// The fit of a problem by a [`Procedure`].
///
/// # Errors
/// Where a search cannot start, or a derivative at an end is undefined.
pub fn fit_by(problem: &Problem, procedure: &Procedure) -> Result<Fit, Box<Diagnostic>> {
    let mut clock = Clock::new(procedure.search);
    procedure.run(problem, &mut clock).map(|(fit, _)| fit)
}

/// Version, model and data.
fn provenance(bound: &Bound) -> Map<String, Value> {
    let session = bound.session;
    let data: Vec<Value> = bound
        .files
        .iter()
        .map(|used| {
            json!({
                "measurement": used.measurement, "file": used.file, "fingerprint": used.fingerprint, "rows": used.rows,
            })
        })
        .collect();
    let mut provenance = Map::new();
    provenance.insert("version".into(), json!(env!("CARGO_PKG_VERSION")));
    provenance.insert("name".into(), json!(session.program.name));
    provenance.insert("model".into(), json!(session.path.display().to_string()));
    provenance.insert("model_fingerprint".into(), json!(session.fingerprint));
    provenance.insert("data".into(), json!(data));
    provenance
}
