//! Values read from a file, and what it says of them.

use std::path::Path;

use super::Session;
use crate::diag::{Code, DataPlace, Diagnostic, Source};
use crate::fit::{self, JointUncertainty, Stated};
use crate::problem::Estimates;

/// A file of values: a fit, or an object of name and value.
#[derive(Clone, Debug)]
pub struct Values {
    /// The file, as given.
    pub file: String,
    /// Names and values in reported units.
    pub values: Vec<(String, f64)>,
    /// The whole of it.
    pub json: serde_json::Value,
}

impl Values {
    /// Reads one.
    ///
    /// # Errors
    /// Where the file cannot be read, or is neither.
    pub fn read(file: &str) -> Result<Values, Box<Diagnostic>> {
        let source = Source::read(Path::new(file))?;
        let values = fit::read_values(file, source.text())?;
        let json = serde_json::from_str(source.text()).unwrap_or_default();
        Ok(Values { file: file.to_owned(), values, json })
    }

    /// A member of the fit, where it is one.
    pub fn member(&self, name: &str) -> Option<&serde_json::Value> {
        self.json.get("parameters").filter(|p| p.is_array()).and(self.json.get(name))
    }

    /// Whether they are a fit of this very model; none where the file does not say.
    pub fn same_model(&self, session: &Session) -> Option<bool> {
        let made_from = self.member("provenance")?.get("model_fingerprint")?.as_str()?;
        Some(made_from == session.fingerprint)
    }

    /// How well they are known, as values of a session's model: a fit of another one does not say.
    ///
    /// # Errors
    /// Where the file says something that cannot be.
    pub fn uncertainty(&self, session: &Session) -> Result<Stated, Box<Diagnostic>> {
        let stated = Stated::read(&self.file, &self.json)?;
        Ok(match (stated, self.same_model(session)) {
            (Stated::Known(known), Some(true)) => Stated::Known(known),
            (Stated::Known(_), Some(false)) => Stated::Unknown("the fit is one of another model".into()),
            (Stated::Known(_), None) => Stated::Unknown("the fit does not say of which model it is".into()),
            (unknown, _) => unknown,
        })
    }

    /// What another calibration can start from as known: the estimates and their covariance. Parameters on a bound are left out, for
    /// nothing tells how well those are known.
    ///
    /// # Errors
    /// Where the file says nothing of the uncertainty, or something that cannot be.
    pub fn estimates(&self) -> Result<Estimates, Box<Diagnostic>> {
        let refused = |why: String| {
            let message = format!("`{}` does not say how well its values are known: {why}", self.file);
            let found = Diagnostic::error(Code::BadFitFile, message).at_data(DataPlace::file(&self.file));
            Box::new(found.hint("name a fit that `calibrate --out` wrote, or start from the values by `--start`"))
        };
        let stated = match Stated::read(&self.file, &self.json)? {
            Stated::Known(stated) => stated,
            Stated::Unknown(why) => return Err(refused(why)),
        };
        let JointUncertainty { names, covariance: Some(covariance), tolerances, on_bound, null_directions, .. } =
            stated
        else {
            return Err(refused("nothing tells the fit how large errors are".into()));
        };
        let inside = |entries: &[f64]| kept(entries, &on_bound);
        Ok(Estimates {
            file: self.file.clone(),
            values: self.values.clone(),
            names: kept(&names, &on_bound),
            covariance: kept(&covariance, &on_bound).iter().map(|row| inside(row)).collect(),
            tolerances: inside(&tolerances),
            null_directions: null_directions.iter().map(|direction| inside(direction)).collect(),
        })
    }
}

/// The entries that are not on a bound.
fn kept<T: Clone>(entries: &[T], on_bound: &[bool]) -> Vec<T> {
    entries.iter().zip(on_bound).filter(|(_, on)| !**on).map(|(entry, _)| entry.clone()).collect()
}
