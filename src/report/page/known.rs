//! What the data see: correlations, singular values, how the search went, and which observations are suspect.

use maud::html;

use super::verdict::ticked;
use super::{Reported, Section, figure};
use crate::fit::Suspect;
use crate::report::chart::{Step, correlations, spectrum, trace};
use crate::report::number::{rounded, significant};
use crate::report::observations::read_in;

/// Suspects in the table.
const SUSPECTS: usize = 40;

/// Correlations, singular values, invisible directions.
pub(super) fn section(of: &Reported) -> Option<Section> {
    let map = of.fit.correlations.as_ref().and_then(|known| correlations("correlations", &known.names, &known.matrix));
    let values: Vec<f64> = of.fit.singular_values.iter().map(|value| value.unwrap_or(0.0)).collect();
    let spectrum = spectrum("singular-values", &values, of.fit.rank);
    let figures: Vec<_> = spectrum.into_iter().chain(map).collect();
    let directions = of.fit.directions();
    let body = html! {
        @if directions.is_empty() {
            p { "Every direction of the parameters is seen by the data, or held by what else is known." }
        } @else {
            p { "Invisible to these data:" }
            ul { @for direction in &directions { li { (ticked(direction)) } } }
        }
        div.grid.wide { @for drawn in &figures { (figure(drawn)) } }
    };
    (!figures.is_empty() || !directions.is_empty())
        .then(|| Section { figures, ..Section::new("known", "What the data see", body) })
}

/// How the search went.
pub(super) fn search(of: &Reported) -> Option<Section> {
    let steps: Vec<Step> = of
        .fit
        .trace
        .iter()
        .filter_map(|step| Some(Step { cost: step.cost?, trial: step.trial_cost, accepted: step.accepted }))
        .collect();
    let drawn = trace("convergence", &steps, of.fit.cost.unwrap_or(0.0))?;
    let body = html! {
        p { (of.fit.status) ", " (crate::report::count(of.fit.iterations, "iteration", "iterations")) "." }
        (figure(&drawn))
    };
    Some(Section { figures: vec![drawn], ..Section::new("search", "The search", body) })
}

/// Observations that are suspect, and those taken out.
pub(super) fn suspects(of: &Reported) -> Option<Section> {
    let tests = of.fit.observations.as_ref();
    let suspects = tests.map_or(&[][..], |tests| tests.suspects.as_slice());
    if tests.is_none() && of.fit.removed.is_empty() {
        return None;
    }
    let list = |all: &[Suspect]| {
        html! {
            div.scroll { table {
                tr {
                    th { "Measurement" } th { "row" } th.left { "read in" } th.left { "observation" } th { "test" } th { "observed" } th { "correction" }
                    th.left { "unit" } th { "would be found" } th.left { "not to be told from" }
                }
                @for s in all.iter().take(SUSPECTS) {
                    @let partners = s.inseparable.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
                    tr {
                        td { (s.measurement) } td { (s.row) } td.left { (s.file.as_deref().map_or(String::new(), |file| read_in(file, s.line))) } td.left { (s.name) }
                        td { (s.test.map_or(String::new(), |test| rounded(test, 3))) }
                        td { (s.observed.map_or(String::new(), |value| significant(value, 9))) }
                        td { (s.adjusted.zip(s.observed).map_or(String::new(), |(at, read)| significant(at - read, 3))) }
                        td.left { (s.unit) }
                        td { (s.smallest_detectable.map_or(String::new(), |size| significant(size, 3))) }
                        td.left { (partners) }
                    }
                }
            } }
        }
    };
    let body = html! {
        @if let Some(tests) = tests {
            p { (tests.suspected) " of " (tests.count) " observations are suspect: their corrections exceed " (significant(tests.critical, 3)) " of their standard deviations." }
        }
        @if !suspects.is_empty() { (list(suspects)) }
        @if suspects.len() > SUSPECTS { p.note { "The " (SUSPECTS) " worst are shown." } }
        @if !of.fit.removed.is_empty() { h3 { "Taken out" } (list(&of.fit.removed)) }
    };
    Some(Section::new("suspects", "Suspected errors", body))
}
