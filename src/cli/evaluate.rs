//! `phical evaluate MODEL`

use std::path::PathBuf;

use clap::Args;

use super::arguments::data;
use super::progress::shown;
use super::{Format, Outcome};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::evaluate::{Estimated, Members, evaluate, point, uncertainties, unseen};
use crate::fit::{Fit, JointUncertainty, Stated};
use crate::model::DataRole;
use crate::problem::{Options, Problem, Selection, Undefined, Weights};
use crate::report::{Predicted, evaluation_json, evaluation_text};
use crate::session::{Choice, Session, Values, failed};

#[derive(Debug, Args)]
pub(super) struct Evaluate {
    /// The model file
    model: PathBuf,
    /// The values: a fit, or a JSON object of name and value [default: the nominal values]
    #[arg(long, value_name = "FIT.json")]
    fit: Option<String>,
    /// A file of data, `-` is standard input; only measurements named so are evaluated [default: the model's own]
    #[arg(long, value_name = "M=FILE", value_parser = data)]
    data: Vec<(String, String)>,
    /// Use the files that the model keeps out of the fit
    #[arg(long)]
    check: bool,
    /// An expression to be put out for every row, beside the model's outputs
    #[arg(long, value_name = "E")]
    expr: Vec<String>,
}

impl Evaluate {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &self.expr)?;
        let values = self.fit.as_deref().map(Values::read).transpose().map_err(|found| Diagnostics::from(*found))?;
        let given = values.as_ref().map(|values| values.values.clone()).unwrap_or_default();
        let stated = values.as_ref().map(|values| values.uncertainty(&session)).transpose();
        let stated = stated.map_err(|found| Diagnostics::from(*found))?;
        let weights = match values.as_ref().and_then(|v| v.member("weights")).and_then(|name| name.as_str()) {
            Some(name) => Weights::ALL.into_iter().find(|weights| weights.name() == name),
            None => None,
        };
        let selection = Selection { start: given.clone(), ..Selection::default() };
        let options = Options { weights, selection, unconstrained: true, ..Options::default() };
        let role = if self.check { DataRole::Check } else { DataRole::Calibrate };
        let mut bound = session.bind(
            &Choice { files: self.data, role, given_only: true, watch: shown(), ..Choice::default() },
            &options,
        )?;
        let mut stop = |found: Diagnostic| {
            let mut all = std::mem::take(&mut bound.warnings);
            all.push(found);
            all
        };
        let problem = &bound.problem;
        // without a fit everything is nominal; with one, what it does not know is found from these data
        let coordinates = if values.is_some() { unseen(problem, &given) } else { Vec::new() };
        let point = point(problem, &given);
        let members = if coordinates.is_empty() {
            Members::known(point)
        } else {
            Members::estimate(problem, point, coordinates).map_err(|error| stop(failed(problem, error)))?
        };
        let evaluation = evaluate(problem, &members.point).map_err(|Undefined(found)| stop(*found))?;
        let estimated = estimated(problem, stated.as_ref(), members.fit.as_ref());
        let measurements =
            uncertainties(problem, &members.point, &estimated).map_err(|Undefined(found)| stop(*found))?;
        let predicted = Predicted { stated, measurements };

        let fit = members.fit.as_ref();
        let mut warnings = std::mem::take(&mut bound.warnings);
        // values are taken as they are, whatever the bounds of a fit
        warnings.0.retain(|warning| !matches!(warning.code, Code::StartProjected | Code::HeldOutside));
        if fit.is_none() {
            // nothing was weighted
            warnings.0.retain(|warning| warning.code != Code::UnitWeights);
        }
        let trustworthy = fit.is_none_or(|fit| fit.status.converged() && fit.parameters.iter().all(|p| p.estimable));
        let outcome = Outcome::new(
            format,
            || evaluation_text(&evaluation, &predicted, fit, &bound, values.as_ref()),
            || evaluation_json(&evaluation, &predicted, fit, &bound, values.as_ref(), &warnings),
        );
        Ok(outcome.trusted(trustworthy).warned(warnings))
    }
}

/// How well the values are known: those of the file, and those of family members estimated for these data.
fn estimated(problem: &Problem, stated: Option<&Stated>, members: Option<&Fit>) -> Vec<Estimated> {
    let anew: Vec<&str> = members.iter().flat_map(|fit| &fit.parameters).map(|p| p.name.as_str()).collect();
    let free = || problem.free.iter().zip(problem.free_coordinates());
    let given = || free().filter(|(_, c)| !anew.contains(&c.name.as_str())).map(|(&c, _)| c).collect();
    let calibration = stated.map(|stated| match stated {
        Stated::Known(known) => Estimated::new(problem, "calibration", known),
        Stated::Unknown(_) => Estimated::unstated(problem, "calibration", given()),
    });
    let members = members.map(|fit| match fit.status.converged() {
        true => Estimated::new(problem, "members", &JointUncertainty::of(fit)),
        false => Estimated::unstated(
            problem,
            "members",
            fit.parameters.iter().filter_map(|p| problem.layout.find(&p.name)).collect(),
        ),
    });
    calibration.into_iter().chain(members).collect()
}
