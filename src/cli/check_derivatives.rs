//! `phical jacobian MODEL --check`

use serde_json::json;

use super::progress::shown;
use super::{Format, Outcome};
use crate::audit::{CheckedRoutes, check_formulas, check_routes};
use crate::compile::formulas;
use crate::data::Table;
use crate::diag::Diagnostics;
use crate::problem::{Options, Weights};
use crate::report::{formulas_json, formulas_text, routes_json, routes_text};
use crate::session::{Choice, Session};

/// The derivatives by several routes, and those written by hand in the model, at points of a seed; also at the rows of `files`, or else
/// of the model's own data, with `given` values.
pub(super) fn check(
    session: &Session,
    files: Vec<(String, String)>,
    given: &[(String, f64)],
    seed: u64,
    format: Format,
) -> Result<Outcome, Diagnostics> {
    let source = &session.program.source;
    let all = formulas(&session.model, source)?;
    let data = data(session, files)?;
    let routes = check_routes(&session.program, &data, given, seed)?;
    let found = check_formulas(&session.model, source, &session.program, &all, seed, true);
    let agree = found.iter().all(|one| one.agrees) && routes.iter().all(CheckedRoutes::agree);
    let text = || match found.is_empty() {
        true => routes_text(&routes),
        false => format!("{}\n{}", formulas_text(&found), routes_text(&routes)),
    };
    let json = || json!({"routes": routes_json(&routes), "formulas": formulas_json(&found)});
    Ok(Outcome::new(format, text, json).trusted(agree).warned(session.warnings.clone()))
}

/// Rows to look at, by measurement number. Those of the model are not needed: where there are none, others are made up.
fn data(session: &Session, files: Vec<(String, String)>) -> Result<Vec<(usize, Table)>, Diagnostics> {
    let asked = !files.is_empty();
    let options = Options { weights: Some(Weights::Unit), unconstrained: true, ..Options::default() };
    match session.bind(&Choice { files, given_only: true, watch: shown(), ..Choice::default() }, &options) {
        Ok(bound) => Ok(bound.problem.blocks.iter().map(|block| (block.index, (*block.table).clone())).collect()),
        Err(found) if asked => Err(found),
        Err(_) => Ok(Vec::new()),
    }
}
