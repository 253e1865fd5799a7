//! Parameters before and after, and beside the truth where that is known.

use maud::{Markup, html};

use super::{Reported, Section, figure};
use crate::fit::Parameter;
use crate::report::chart::{Row, forest};
use crate::report::number::{significant, with_sigma};

/// Parameters in the table, at most.
const MOST: usize = 1000;

/// The table, and how far estimates are from what is true, where that is known.
pub(super) fn section(of: &Reported) -> Section {
    let truth = |name: &str| of.truth.iter().find(|(known, _)| known == name).map(|(_, value)| *value);
    let any_truth = of.fit.parameters.iter().any(|p| truth(&p.name).is_some());
    let off = |p: &Parameter| {
        let sigma = p.sigma.filter(|sigma| *sigma > 0.0)?;
        Some(Row { name: p.name.clone(), off: (p.value - truth(&p.name)?) / sigma })
    };
    let rows: Vec<Row> = of.fit.parameters.iter().filter_map(off).collect();
    let forest = forest("deviations", rows, of.fit.confidence.factor.unwrap_or(f64::NAN));
    let away: Vec<&str> = of
        .fit
        .held
        .iter()
        .filter(|held| truth(&held.name).is_some_and(|truth| (truth - held.value).abs() > 1e-9 * truth.abs().max(1e-9)))
        .map(|held| held.name.as_str())
        .collect();
    let body = html! {
        p.note { "Estimates with standard uncertainties; intervals hold the truth with a probability of " (significant(100.0 * of.fit.confidence.level, 3)) " %. What is known less well than its tolerance is weak." }
        div.scroll { table {
            tr {
                th { "Parameter" } th { "nominal" } th { "prior ±" }
                @if any_truth { th { "truth" } }
                th { "calibrated" } th { "±" } th.left { "unit" } th { "change" }
                @if any_truth { th { "error" } }
                th.left { "interval" } th { "tolerance" } th.left {}
            }
            @for p in of.fit.parameters.iter().take(MOST) { (line(p, truth(&p.name), any_truth)) }
            @for held in of.fit.held.iter().take(MOST) {
                tr.note {
                    td { (held.name) } td { (significant(held.value, 9)) } td { "held" }
                    @if any_truth { td { (truth(&held.name).map_or(String::new(), |truth| significant(truth, 9))) } }
                    td { (significant(held.value, 9)) } td {} td.left { (unit(&held.unit)) } td {}
                    @if any_truth { td {} }
                    td {} td {} td.left { "held" }
                }
            }
        } }
        @if of.fit.parameters.len().max(of.fit.held.len()) > MOST { p.note { "The first " (MOST) " are shown; the fit file has all." } }
        @if any_truth && !away.is_empty() {
            p.note { "Held away from the truth: " (away.join(", ")) ". Others take that up, so their errors are larger than their uncertainties say." }
        }
        @if let Some(forest) = &forest { (figure(forest)) }
    };
    Section { figures: forest.into_iter().collect(), ..Section::new("parameters", "Parameters", body) }
}

/// One parameter.
fn line(p: &Parameter, truth: Option<f64>, any_truth: bool) -> Markup {
    let (value, sigma) = match p.sigma {
        Some(sigma) => with_sigma(p.value, sigma),
        None => (significant(p.value, 7), "–".into()),
    };
    let difference = |other: Option<f64>| {
        other.map_or(String::new(), |other| {
            p.sigma.map_or(significant(p.value - other, 3), |s| with_sigma(p.value - other, s).0)
        })
    };
    let interval = p.interval.zip(p.sigma).map_or(String::new(), |((low, high), sigma)| {
        format!("{} … {}", with_sigma(low, sigma).0, with_sigma(high, sigma).0)
    });
    let beyond = truth.zip(p.interval).is_some_and(|(truth, (low, high))| truth < low || truth > high);
    let note = match (p.estimable, p.at_bound, p.sigma) {
        (false, ..) => "not estimable",
        (true, true, _) => "on its bound",
        (true, false, None) => "no uncertainty",
        (true, false, Some(sigma)) if sigma > p.tolerance => "weak",
        _ => "",
    };
    html! {
        tr {
            td { (p.name) }
            td { (p.nominal.map_or(String::new(), |nominal| significant(nominal, 9))) }
            td { (p.prior.map_or("–".into(), |prior| significant(prior, 3))) }
            @if any_truth { td { (truth.map_or(String::new(), |truth| significant(truth, 9))) } }
            td { strong { (value) } } td { (sigma) } td.left { (unit(&p.unit)) }
            td { (difference(p.nominal)) }
            @if any_truth { td class=(if beyond { "off" } else { "" }) { (difference(truth)) } }
            td.left { (interval) } td { (significant(p.tolerance, 3)) } td.left.note { (note) }
        }
    }
}

/// A plain number has none.
fn unit(symbol: &str) -> &str {
    if symbol == "1" { "" } else { symbol }
}
