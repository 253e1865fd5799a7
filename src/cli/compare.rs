//! `phical compare MODEL FIT FIT`

use std::path::PathBuf;

use clap::Args;

use super::arguments::data;
use super::progress::shown;
use super::{Format, Outcome};
use crate::compare::{agreement, nested};
use crate::diag::Diagnostics;
use crate::evaluate::point;
use crate::problem::{Options, Selection, Undefined};
use crate::report::{comparison_json, comparison_text};
use crate::session::{Choice, Session, Values};

#[derive(Debug, Args)]
pub(super) struct Compare {
    /// The model file
    model: PathBuf,
    /// One fit
    first: String,
    /// Another
    second: String,
    /// A file of data by which to judge what can be seen [default: the model's own]
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    data: Vec<(String, String)>,
}

impl Compare {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let read = |file: &str| Values::read(file).map_err(|found| Diagnostics::from(*found));
        let values = [read(&self.first)?, read(&self.second)?];
        let known = |values: &Values| values.uncertainty(&session).map_err(|found| Diagnostics::from(*found));
        let stated = [known(&values[0])?, known(&values[1])?];
        // all that either has freed, and nothing else
        let estimated = |values: &Values| -> Vec<String> {
            let all = values.json.get("parameters").and_then(|p| p.as_array()).cloned().unwrap_or_default();
            all.iter().filter_map(|p| p.get("name")?.as_str().map(str::to_owned)).collect()
        };
        let mut free = estimated(&values[0]);
        free.extend(estimated(&values[1]));
        free.sort();
        free.dedup();
        let selection = Selection { free: free.clone(), start: values[0].values.clone(), ..Selection::default() };
        let choice = Choice { files: self.data.clone(), watch: shown(), ..Choice::default() };
        let mut bound = session.bind(&choice, &Options { selection, ..Options::default() })?;
        let all = bound.problem.free.iter().zip(bound.problem.free_coordinates());
        let estimated = all.filter(|(_, c)| free.binary_search(&c.name).is_ok()).map(|(&c, _)| c).collect();
        bound.problem = bound.problem.with_free(estimated);
        let points = [point(&bound.problem, &values[0].values), point(&bound.problem, &values[1].values)];
        let stop = |Undefined(found): Undefined| -> Diagnostics { (*found).into() };
        let agreement = agreement(&bound.problem, [&points[0], &points[1]], [&stated[0], &stated[1]]).map_err(stop)?;
        let nested = nested(&values[0], &values[1]);
        let files = [self.first.as_str(), self.second.as_str()];
        let outcome = Outcome::new(
            format,
            || comparison_text(files, &agreement, &nested),
            || comparison_json(files, &agreement, &nested),
        );
        Ok(outcome)
    }
}
