//! Trust it or not, in words, and what the fit was made from.

use maud::{Markup, html};

use super::Reported;
use super::rows::Depends;
use crate::fit::Document;
use crate::report::count;
use crate::report::number::significant;

/// Names that are told before "and more".
const NAMES: usize = 8;

/// The verdict and what it rests on.
pub(super) fn summary<'d>(of: &Reported, depends: impl Iterator<Item = &'d Depends> + Clone) -> Markup {
    let fit = &of.fit;
    html! {
        div class=(if fit.trustworthy { "verdict" } else { "verdict not" }) id="verdict" {
            p { strong { @if fit.trustworthy { "Trustworthy." } @else { "Not trustworthy." } } " " (ended(fit)) }
            @if !fit.verdict.is_empty() { ul { @for reason in &fit.verdict { li { (reason) } } } }
            @for direction in fit.directions() { p { (ticked(&direction)) } }
            p { (size(fit)) }
            @if let Some(weak) = weak(fit) { p { (ticked(&weak)) } }
            @if let Some(tests) = &fit.observations {
                @let expected = tests.count as f64 * 0.001;
                p { (tests.suspected) " of " (tests.count) " observations lie beyond " (significant(tests.critical, 3)) " standard deviations; chance alone makes " (significant(expected, 2)) "." }
            }
            @if !of.rows.is_empty() && !of.checked { p { (patterns(depends)) } }
            @for why in &of.left_out { p.note { (why) } }
        }
    }
}

/// How many of what, and whether the search ended.
fn ended(fit: &Document) -> String {
    let rows: usize = fit.provenance.data.iter().map(|file| file.rows).sum();
    format!(
        "{} from {} in {} with {} weights{}; the search ended after {} ({}).",
        count(fit.parameters.len(), "parameter", "parameters"),
        count(fit.equations, "equation", "equations"),
        count(rows, "row", "rows"),
        fit.weights,
        if fit.priors > 0 { format!(" and {}", count(fit.priors, "prior", "priors")) } else { String::new() },
        count(fit.iterations, "iteration", "iterations"),
        fit.status,
    )
}

/// Whether errors are as large as declared.
fn size(fit: &Document) -> String {
    match (&fit.chi_squared, fit.sigma0) {
        (Some(chi), _) => {
            let ratio = chi.value / chi.dof.max(1) as f64;
            let said = match chi.upper_tail {
                tail if tail <= 0.001 => "The residuals are larger than the declared errors make them",
                tail if tail >= 0.999 => {
                    "The residuals are smaller than the declared errors make them: those may be declared too large"
                }
                _ => "The residuals are as large as the declared errors make them",
            };
            format!(
                "{said}: chi-squared per degree of freedom {} at {} degrees of freedom, probability of more {}.",
                significant(ratio, 4),
                chi.dof,
                significant(chi.upper_tail, 2)
            )
        }
        (None, Some(sigma0)) => format!(
            "No test of the size of errors: uncertainties are from the scatter of the residuals, whose unit is {} at {} degrees of freedom.",
            significant(sigma0, 4),
            fit.dof
        ),
        (None, None) => "Nothing tells how large errors are: there are as many unknowns as equations.".into(),
    }
}

/// Which parameters are known less well than they should be.
fn weak(fit: &Document) -> Option<String> {
    let names: Vec<String> = fit
        .parameters
        .iter()
        .filter(|p| p.sigma.is_some_and(|sigma| sigma > p.tolerance))
        .map(|p| format!("`{}`", p.name))
        .collect();
    let more = names.len().saturating_sub(NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!names.is_empty()).then(|| {
        let some = names.iter().take(NAMES).cloned().collect::<Vec<_>>().join(", ");
        format!("Known less well than their tolerance, each by itself: {some}{more}.")
    })
}

fn patterns<'d>(depends: impl Iterator<Item = &'d Depends> + Clone) -> String {
    let beyond: Vec<String> =
        depends.clone().filter(|d| d.beyond_chance).map(|d| format!("{} on {}", d.residual, d.against)).collect();
    match (beyond.as_slice(), depends.count()) {
        (_, 0) => "There are too few rows to tell whether residuals depend on anything.".into(),
        ([], n) => format!(
            "No residual depends on the row, a reading or a prediction by more than chance ({n} pairs looked at)."
        ),
        (some, n) => format!(
            "By more than chance, residuals depend: {}{} (of {n} pairs looked at). Something is not in the model.",
            some.iter().take(NAMES).cloned().collect::<Vec<_>>().join(", "),
            if some.len() > NAMES { format!(" and {} more", some.len() - NAMES) } else { String::new() }
        ),
    }
}

/// Text with `names` set as code.
pub(super) fn ticked(text: &str) -> Markup {
    html! {
        @for (k, part) in text.split('`').enumerate() {
            @if k % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

/// Files, fingerprints, options, warnings.
pub(super) fn provenance(of: &Reported) -> super::Section {
    let made = &of.fit.provenance;
    let options = made.options.as_object().into_iter().flatten();
    let options =
        options.filter(|(_, value)| !matches!(value, serde_json::Value::Null | serde_json::Value::Bool(false)));
    let options = options.filter(|(_, value)| value.as_array().is_none_or(|all| !all.is_empty()));
    let body = html! {
        @if !of.fit.warnings.is_empty() {
            h3 { "Warnings" }
            ul { @for warning in &of.fit.warnings { li { code { (warning.code) } " " (ticked(&warning.message)) } } }
        }
        div.scroll { table {
            tr { th { "File" } th.left { "what" } th { "rows" } th.left { "SHA-256" } }
            tr { td { (made.model) } td.left { "model" } td {} td.left { code { (made.model_fingerprint) } } }
            @for file in &made.data {
                tr { td { (file.file) } td.left { (file.measurement) } td { (file.rows) } td.left { code { (file.fingerprint) } } }
            }
        } }
        p.note { "phical " (made.version) @for (name, value) in options { "; " (name.replace('_', " ")) " " (value.to_string().replace('"', "")) } }
    };
    super::Section::new("provenance", "How it was made", body)
}
