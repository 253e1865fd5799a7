//! What a report shows of a fit beside the fit itself: its rows, the instrument, and the truth where that is known.

use std::path::{Path, PathBuf};

use super::{Bound, Choice, Session, Values};
use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::evaluate::point;
use crate::fit::{Document, JointUncertainty, Stated};
use crate::model::DataRole;
use crate::problem::{Options, Problem, Selection, Undefined, Weights};
use crate::survey::{Scene, Surveyed, scene, survey};

/// What a report shows beside the fit.
#[derive(Clone, Debug, Default)]
pub struct Looked {
    /// The rows, by measurement.
    pub rows: Vec<Surveyed>,
    /// Whether the rows took no part in the fit.
    pub checked: bool,
    /// The instrument.
    pub scene: Option<Scene>,
    /// What is true, by name in reported units; nothing where that is not known.
    pub truth: Vec<(String, f64)>,
    /// What is not there, and why.
    pub left_out: Vec<String>,
}

/// Which rows a report shows, from which files: measurement and file.
#[derive(Clone, Copy, Debug)]
pub enum Shown<'a> {
    /// Those of the fit, from these files where they are not where they were.
    Fitted(&'a [(String, String)]),
    /// Others, which took no part in the fit.
    Checked(&'a [(String, String)]),
}

/// A truth beside the data has this name, as `simulate` writes it.
const TRUTH: &str = "truth.json";

impl Looked {
    /// Looks at the rows of a fit at its point.
    pub fn at(problem: &Problem, point: &[f64], fit: &Document, known: Option<&JointUncertainty>) -> Looked {
        let mut looked = Looked::default();
        match survey(problem, point) {
            Ok(rows) => looked.rows = rows,
            Err(Undefined(why)) => looked.left_out.push(format!("Rows are not shown: {}.", why.message)),
        }
        looked.scene = Some(scene(problem, &fit.values(), known)).filter(|scene| !scene.is_empty());
        looked
    }

    /// The same with the truth of made-up data: that of a file, or else `truth.json` beside the data.
    ///
    /// # Errors
    /// Where the file that is given cannot be read.
    pub fn with_truth(
        mut self,
        given: Option<&str>,
        directory: &Path,
        fit: &Document,
    ) -> Result<Looked, Box<Diagnostic>> {
        if let Some(file) = given {
            self.truth = Values::read(file)?.values;
            return Ok(self);
        }
        let beside = |file: &str| -> Option<Vec<(String, f64)>> {
            let places = [directory.join(file), PathBuf::from(file)];
            let place = places.iter().find(|place| place.is_file())?.with_file_name(TRUTH);
            let values = Values::read(place.to_str().filter(|_| place.is_file())?).ok()?.values;
            // a truth of something else has other names
            let known = |name: &String| values.iter().any(|(other, _)| other == name);
            fit.parameters.iter().all(|p| known(&p.name)).then_some(values)
        };
        self.truth = fit.provenance.data.iter().find_map(|data| beside(&data.file)).unwrap_or_default();
        Ok(self)
    }
}

impl Session {
    /// Binds the rows that a fit was made from, or that it is to be checked by, at its values.
    ///
    /// # Errors
    /// Where they cannot be read.
    pub fn bind_again(&self, fit: &Document, shown: Shown) -> Result<Bound<'_>, Diagnostics> {
        let weights = Weights::ALL.into_iter().find(|weights| weights.name() == fit.weights);
        let options =
            |key: &str| fit.provenance.options.get(key).and_then(|value| value.as_array()).into_iter().flatten();
        let free = options("free").filter_map(|name| name.as_str()).map(str::to_owned).collect();
        let fix = options("fix").filter_map(|held| Some((held.get("name")?.as_str()?.to_owned(), None))).collect();
        let selection = Selection { free, fix, start: fit.values() };
        let (files, given_only) = match shown {
            Shown::Fitted([]) => (self.files_again(fit), false),
            Shown::Fitted(files) => (files.to_vec(), false),
            Shown::Checked(files) => (files.to_vec(), true),
        };
        let without = options("without").filter_map(|name| name.as_str()).map(str::to_owned).collect();
        let choice = Choice { files, without, role: DataRole::Calibrate, given_only, ..Choice::default() };
        let options = Options { weights, selection, unconstrained: true, ..Options::default() };
        let mut bound = self.bind(&choice, &options)?;
        if given_only {
            return Ok(bound);
        }
        let removed = |measurement: &str| -> Vec<usize> {
            let of = fit.removed.iter().filter(|row| row.measurement == measurement);
            of.filter_map(|row| row.row.checked_sub(1)).collect()
        };
        let removed: Vec<Vec<usize>> =
            bound.problem.blocks.iter().map(|block| removed(&block.measurement.name)).collect();
        bound.problem = bound.problem.without_rows(&removed);
        Ok(bound)
    }

    /// The files that a fit names and that are not the model's own.
    fn files_again(&self, fit: &Document) -> Vec<(String, String)> {
        let own = |data: &crate::fit::DataFile| {
            let measurement = self.program.measurements.iter().find(|of| of.name == data.measurement);
            measurement.is_some_and(|of| of.data.iter().any(|own| own.file.value == data.file))
        };
        let other = fit.provenance.data.iter().filter(|data| !own(data));
        other.map(|data| (data.measurement.clone(), data.file.clone())).collect()
    }
}

/// What a report of a fit file shows, as far as its model and its data are what they were.
///
/// # Errors
/// Where the file states uncertainties that cannot be.
pub fn look_again(values: &Values, fit: &Document, session: &Session, shown: Shown) -> Result<Looked, Box<Diagnostic>> {
    let left_out = |why: String| Looked { left_out: vec![why], ..Looked::default() };
    if session.fingerprint != fit.provenance.model_fingerprint {
        let model = session.path.display();
        return Ok(left_out(format!("Rows and the instrument are not shown: `{model}` has changed since the fit.")));
    }
    let known = match values.uncertainty(session)? {
        Stated::Known(known) => Some(known),
        Stated::Unknown(_) => None,
    };
    let bound = match session.bind_again(fit, shown) {
        Ok(bound) => bound,
        Err(mistakes) => {
            let first = mistakes.iter().find(|found| found.severity == Severity::Error);
            let why = first.map_or(String::new(), |found| found.message.clone());
            return Ok(left_out(format!("Rows and the instrument are not shown: {why}.")));
        }
    };
    let mut looked = Looked::at(&bound.problem, &point(&bound.problem, &fit.values()), fit, known.as_ref());
    let same = |(now, then): (&super::UsedFile, &crate::fit::DataFile)| now.fingerprint == then.fingerprint;
    if let Shown::Checked(files) = shown {
        looked.checked = true;
        let files: Vec<&str> = files.iter().map(|(_, file)| file.as_str()).collect();
        looked
            .left_out
            .push(format!("The rows shown took no part in the fit: they are those of {}.", files.join(", ")));
    } else if bound.files.len() != fit.provenance.data.len() || !bound.files.iter().zip(&fit.provenance.data).all(same)
    {
        looked
            .left_out
            .push("The rows are not those of the fit: their files have changed since, or others were given.".into());
    }
    Ok(looked)
}
