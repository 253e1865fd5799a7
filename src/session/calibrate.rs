//! From a bound problem to a fit, with what a fit file says of its making.

use std::time::Instant;

use serde_json::{Map, Value, json};

use super::timed::Timed;
use super::{Bound, nanoseconds};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Fit, FitFile, analyse};
use crate::problem::Undefined;
use crate::solve::{Settings, StartError, minimise};

/// A fit and how it came about.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The fit; its warnings are those of all stages.
    pub fit: Fit,
    /// Provenance (without the options, which are the caller's to add) and times.
    pub file: FitFile,
}

/// Solves and analyses. `progress` is called with the number of linearisations and the latest cost.
///
/// # Errors
/// Where the search cannot start, or a derivative at the end is undefined.
pub fn calibrate(bound: &Bound, progress: &dyn Fn(usize, f64)) -> Result<Calibration, Diagnostics> {
    let problem = &bound.problem;
    let stop = |found: Diagnostic| {
        let mut all = bound.warnings.clone();
        all.push(found);
        all
    };
    let begun = Instant::now();
    let timed = Timed::new(problem, progress);
    let solution =
        minimise(&timed, problem.start.clone(), &Settings::default()).map_err(|error| stop(failed(error)))?;
    let solved = nanoseconds(begun);
    let spent = u64::try_from(timed.spent().as_nanos()).unwrap_or(u64::MAX);
    let linearised = timed.linearised();
    let mut fit = analyse(problem, solution).map_err(|Undefined(found)| stop(*found))?;
    let own = std::mem::take(&mut fit.warnings);
    fit.warnings.extend(bound.warnings.clone());
    fit.warnings.extend(own);

    let session = bound.session;
    let rows: usize = problem.blocks.iter().map(|block| block.table.rows()).sum();
    let timings = [
        ("read", session.read_ns + bound.read_ns),
        ("compile", session.compile_ns),
        ("evaluate", spent),
        ("linear_algebra", solved.saturating_sub(spent)),
        ("total", session.read_ns + bound.read_ns + session.compile_ns + nanoseconds(begun)),
    ];
    let mut timings: Map<String, Value> = timings.map(|(name, ns)| (name.to_owned(), json!(ns))).into_iter().collect();
    let per_row = spent as f64 / (rows.max(1) * linearised.max(1)) as f64;
    timings.insert("per_row_per_iteration".into(), json!(per_row));
    Ok(Calibration { fit, file: FitFile { provenance: provenance(bound), timings } })
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
    provenance.insert("model".into(), json!(session.path.display().to_string()));
    provenance.insert("model_fingerprint".into(), json!(session.fingerprint));
    provenance.insert("data".into(), json!(data));
    provenance
}

/// Why a search could not start, as a diagnostic.
pub fn failed(error: StartError<Undefined>) -> Diagnostic {
    match error {
        StartError::Undefined(Undefined(found)) => *found,
        other => Diagnostic::error(Code::UndefinedAtStart, other.to_string()).hint("start elsewhere"),
    }
}
