//! The stages joined: a model file and its data, read, compiled, bound, fitted; each stage timed, each file fingerprinted.
//!
//! [`Session::open`] reads and compiles, [`Session::bind`] chooses and reads data, [`calibrate()`] solves and analyses. What the
//! command line does, a program can do with these three.
//!
//! ```no_run
//! use phical::problem::Options;
//! use phical::session::{Choice, Session, calibrate};
//!
//! # fn main() -> Result<(), phical::diag::Diagnostics> {
//! let session = Session::open("models/two_theodolite/model.ron".as_ref(), &[])?;
//! let bound = session.bind(&Choice::default(), &Options::default())?;
//! let calibration = calibrate(&bound)?;
//! for parameter in &calibration.fit.parameters {
//!     println!("{} = {} {}", parameter.name, parameter.value, parameter.unit);
//! }
//! # Ok(())
//! # }
//! ```

mod against;
mod calibrate;
mod choice;
mod continuation;
mod design;
mod far;
mod hold_out;
mod looked;
mod procedure;
mod saved;
mod search;
mod sequential;
mod starts;
mod timed;
mod values;

pub use against::{Against, Compared};
pub use calibrate::{Calibration, calibrate, calibrate_by, fit_by};
pub use choice::{Choice, UsedFile};
pub use continuation::{FOLLOWED, follow};
pub use far::Far;
pub use hold_out::{HeldOut, hold_out};
pub use looked::{Looked, Shown, look_again};
pub use procedure::{Procedure, fit_once};
pub use saved::State;
pub use search::{Search, failed};
pub use sequential::{Coming, Running, Sequence};
pub use starts::{Ended, MultiStart, compare_starts};
pub use timed::Timed;
pub use values::Values;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::compile::{Program, Scenario, compile};
use crate::data::fingerprint;
use crate::diag::{Code, Diagnostic, Diagnostics, Source, did_you_mean};
use crate::identify::Probe;
use crate::model::{Model, load};
use crate::problem::{Options, Problem};

/// A model, read and compiled.
#[derive(Clone, Debug)]
pub struct Session {
    /// Its file, as given.
    pub path: PathBuf,
    /// What the file says.
    pub model: Model,
    /// The mathematics of it.
    pub program: Program,
    /// Warnings of reading and compiling.
    pub warnings: Diagnostics,
    /// Of the file's text.
    pub fingerprint: String,
    /// Nanoseconds taken to read the model.
    pub read_ns: u64,
    /// Nanoseconds taken to compile it.
    pub compile_ns: u64,
}

impl<'s> From<&'s Session> for Probe<'s> {
    fn from(session: &'s Session) -> Self {
        Probe::from(&session.program)
    }
}

/// A session with data.
#[derive(Clone, Debug)]
pub struct Bound<'s> {
    /// Where the model is from.
    pub session: &'s Session,
    /// The model with its rows.
    pub problem: Problem<'s>,
    /// The files that the rows come from.
    pub files: Vec<UsedFile>,
    /// All warnings so far, the session's too.
    pub warnings: Diagnostics,
    /// Nanoseconds taken to read the data.
    pub read_ns: u64,
}

impl Session {
    /// Reads and compiles a model file. `extra` are expressions to be put out beside the model's own outputs.
    ///
    /// # Errors
    /// All mistakes of the file, with the warnings.
    pub fn open(path: &Path, extra: &[String]) -> Result<Session, Diagnostics> {
        let begun = Instant::now();
        let source = Source::read(path).map_err(|found| Diagnostics::from(*found))?;
        let (model, mut warnings) = load(&source)?;
        let read_ns = nanoseconds(begun);
        let begun = Instant::now();
        let program = match compile(&model, &source, extra) {
            Ok((program, more)) => {
                warnings.extend(more);
                program
            }
            Err(mistakes) => {
                warnings.extend(mistakes);
                return Err(warnings);
            }
        };
        let compile_ns = nanoseconds(begun);
        let fingerprint = fingerprint(source.text().as_bytes());
        Ok(Session { path: path.to_owned(), model, program, warnings, fingerprint, read_ns, compile_ns })
    }

    /// Reads the chosen data and binds them. Measurements without data take no part.
    ///
    /// # Errors
    /// All mistakes of names, data and options, with the warnings.
    pub fn bind(&self, choice: &Choice, options: &Options) -> Result<Bound<'_>, Diagnostics> {
        let begun = Instant::now();
        let mut warnings = self.warnings.clone();
        let chosen = choice.read(self, &mut warnings);
        let read_ns = nanoseconds(begun);
        let Some(chosen) = chosen else { return Err(warnings) };
        match Problem::bind(&self.program, chosen.tables, options) {
            Ok((problem, more)) => {
                warnings.extend(more);
                Ok(Bound { session: self, problem, files: chosen.files, warnings, read_ns })
            }
            Err(mistakes) => {
                warnings.extend(mistakes);
                Err(warnings)
            }
        }
    }

    /// The number of a measurement.
    ///
    /// # Errors
    /// Where the model has none of this name.
    pub fn measurement(&self, name: &str) -> Result<usize, Box<Diagnostic>> {
        let names: Vec<&str> = self.program.measurements.iter().map(|m| m.name.as_str()).collect();
        names.iter().position(|known| *known == name).ok_or_else(|| {
            let found = Diagnostic::error(Code::UnknownMeasurement, format!("there is no measurement `{name}`"));
            Box::new(found.maybe_hint(did_you_mean(name, "measurements", &names)))
        })
    }

    /// A scenario by its name, or else the first.
    ///
    /// # Errors
    /// Where the model has none of this name, or none at all.
    pub fn scenario(&self, name: Option<&str>) -> Result<&Scenario, Box<Diagnostic>> {
        let all = &self.program.scenarios;
        let names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
        let found = match name {
            Some(name) => all.iter().find(|s| s.name == name),
            None => all.first(),
        };
        found.ok_or_else(|| {
            let missing = match name {
                Some(name) if !all.is_empty() => {
                    let hint = did_you_mean(name, "scenarios", &names);
                    Diagnostic::error(Code::UnknownScenario, format!("there is no scenario `{name}`")).maybe_hint(hint)
                }
                _ => Diagnostic::error(Code::UnknownScenario, "the model declares no scenario")
                    .hint("add one under `scenarios`"),
            };
            Box::new(missing)
        })
    }

    /// The directory that paths of the model are relative to.
    pub fn directory(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }
}

fn nanoseconds(begun: Instant) -> u64 {
    u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX)
}
