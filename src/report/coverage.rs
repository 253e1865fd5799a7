//! Coverage as text and JSON.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::count;
use super::fit::unit;
use super::number::{rounded, significant, with_sigma};
use super::table::{Align, Grid};
use crate::compile::Scenario;
use crate::coverage::{Consistency, Coverage, Misheld, Quantity};
use crate::diag;
use crate::session::Session;

/// Names in the verdict.
const MOST_NAMED: usize = 8;
/// Held parameters that a note names.
const MOST_HELD: usize = 4;

/// One sentence: whether the intervals held the truth as often as they say, or which did not.
pub fn coverage_verdict(found: &Coverage) -> String {
    let what = match (found.parameters.len(), found.predictions.len()) {
        (0, 0) => return "Nothing was judged: no parameter can be estimated, and nothing is predicted".into(),
        (n, 0) => format!("of {}", count(n, "parameter", "parameters")),
        (0, n) => format!("of {}", count(n, "predicted quantity", "predicted quantities")),
        (n, m) => format!(
            "of {} and {}",
            count(n, "parameter", "parameters"),
            count(m, "predicted quantity", "predicted quantities")
        ),
    };
    let of = |wanted: Consistency| {
        let mut wrong: Vec<&Quantity> = found.quantities().filter(|q| q.consistency == wanted).collect();
        wrong.sort_by(|a, b| (b.coverage - 0.95).abs().total_cmp(&(a.coverage - 0.95).abs()));
        let named = wrong.iter().take(MOST_NAMED).map(|q| format!("{} ({} %)", q.name, percent(q.coverage)));
        let mut names: Vec<String> = named.collect();
        if wrong.len() > names.len() {
            names.push(format!("{} more", wrong.len() - names.len()));
        }
        names.join(", ")
    };
    let (seldom, often) = (of(Consistency::TooSeldom), of(Consistency::TooOften));
    match (seldom.is_empty(), often.is_empty()) {
        (true, true) => format!("Honest: the 95 % intervals {what} hold the truth as often as they should"),
        (false, true) => format!("Not honest: the 95 % intervals hold the truth too seldom: {seldom}"),
        (true, false) => format!("Not honest: the 95 % intervals hold the truth too often: {often}"),
        (false, false) => {
            format!("Not honest: the 95 % intervals hold the truth too seldom: {seldom}; and too often: {often}")
        }
    }
}

/// The report of many runs.
pub fn coverage_text(found: &Coverage, session: &Session, scenario: &Scenario) -> String {
    let mut out = format!("{}\n\n", coverage_verdict(found));
    let _ = writeln!(out, "{} ({})", session.program.name, session.path.display());
    let runs = count(usize::try_from(found.runs).unwrap_or(usize::MAX), "run", "runs");
    let _ = writeln!(out, "  scenario `{}`, {runs} from seed {}", scenario.name, found.first);
    for (name, rows, check) in &found.rows {
        let predicted = match check {
            0 => String::new(),
            n => format!(", and {n} more to be predicted"),
        };
        let _ = writeln!(out, "  {name}: {} in each{predicted}", count(*rows, "row", "rows"));
    }
    let weights = found.weights.name();
    let trustworthy = percent(found.trustworthy_share);
    let _ = writeln!(out, "  weights {weights}, each fit from the nominal values; {trustworthy} % trustworthy");
    if let Some([low, median, high]) = found.chi_squared_per_dof {
        let [low, median, high] = [low, median, high].map(|value| rounded(value, 4));
        let _ = writeln!(out, "  chi-squared per degree of freedom: median {median}, from {low} to {high}");
    }
    for note in notes(found) {
        let _ = writeln!(out, "  note: {note}");
    }
    if !found.parameters.is_empty() {
        out.push_str("\nParameters, estimate minus truth\n");
        out.push_str(&table(&found.parameters));
    }
    if !found.predictions.is_empty() {
        out.push_str("\nPredictions from noisy readings, minus truth\n");
        out.push_str(&table(&found.predictions));
    }
    out
}

/// What is to be known beside the numbers.
fn notes(found: &Coverage) -> Vec<String> {
    let mut notes = Vec::new();
    for (reason, runs) in &found.failures {
        notes.push(format!("{runs} of {} runs failed and count as misses: {reason}", found.runs));
    }
    if found.not_simulated > 0 {
        let seeds = found.not_simulated;
        notes.push(format!("the scenario has no data for {seeds} further seeds, which are left out"));
    }
    if !found.misheld.is_empty() {
        let of = |held: &Misheld| {
            let number = |value: f64| significant(value, 6);
            let unit = if unit(&held.unit).is_empty() { String::new() } else { format!(" {}", held.unit) };
            format!("`{}` at {}{unit} (truth {})", held.name, number(held.value), number(held.truth))
        };
        let mut names: Vec<String> = found.misheld.iter().take(MOST_HELD).map(of).collect();
        if found.misheld.len() > MOST_HELD {
            names.push(format!("{} more", found.misheld.len() - MOST_HELD));
        }
        notes.push(format!("held, but not at the truth: {}; others take that up as bias", names.join(", ")));
    }
    if !found.blind.is_empty() {
        notes.push(format!("not estimable in any run, and not judged: {}", found.blind.join(", ")));
    }
    let few = format!("{} runs are too few to call any coverage too low", found.runs);
    let high = if found.notices_too_often() { "" } else { ", and none as too high" };
    notes.push(found.noticed_below().map_or(few, |least| {
        let least = percent(least);
        format!(
            "{} runs: a parameter's coverage below {least} % counts as too low{high}; more runs see finer",
            found.runs
        )
    }));
    notes
}

fn table(quantities: &[Quantity]) -> String {
    let mut grid = Grid::new(&[
        Align::Left,
        Align::Right,
        Align::Left,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Left,
        Align::Left,
        Align::Left,
    ]);
    grid.row(["", "bias", "", "actual", "predicted", "ratio", "held %", "", "unit"]);
    for q in quantities {
        let number = |value: Option<f64>, digits| value.map_or("-".into(), |value| rounded(value, digits));
        let (bias, error) = match (q.bias, q.bias_error) {
            (Some(bias), Some(error)) => {
                let (bias, error) = with_sigma(bias, error);
                (bias, format!("± {error}"))
            }
            (bias, _) => (number(bias, 2), String::new()),
        };
        let mut notes = Vec::new();
        match q.consistency {
            Consistency::Honest => {}
            Consistency::TooSeldom => notes.push("too seldom".to_owned()),
            Consistency::TooOften => notes.push("too often".to_owned()),
        }
        if let Some(share) = q.notable_bias() {
            notes.push(format!("biased by {share:.2} of its spread"));
        }
        if q.missing > 0 {
            notes.push(format!("{} of {} missed without an interval", q.missing, q.intervals));
        }
        grid.row([
            q.name.clone(),
            bias,
            error,
            number(q.actual, 3),
            number(q.predicted, 3),
            number(q.ratio(), 3),
            percent(q.coverage),
            format!("{} to {}", percent(q.interval.low), percent(q.interval.high)),
            unit(&q.unit).to_owned(),
            notes.join(", "),
        ]);
    }
    grid.text("  ")
}

/// Percent with one decimal.
fn percent(share: f64) -> String {
    format!("{:.1}", 100.0 * share)
}

/// The same for programs; `options` are the caller's.
pub fn coverage_json(found: &Coverage, session: &Session, scenario: &Scenario, options: Map<String, Value>) -> Value {
    let quantity = |q: &Quantity| {
        json!({
            "name": q.name, "unit": q.unit, "bias": q.bias, "bias_error": q.bias_error, "actual": q.actual,
            "predicted": q.predicted, "ratio": q.ratio(), "coverage": q.coverage, "low": q.interval.low,
            "high": q.interval.high, "consistency": q.consistency.name(), "runs": q.runs, "intervals": q.intervals,
            "missing": q.missing,
        })
    };
    let failures = found.failures.iter().map(|(reason, runs)| json!({"reason": reason, "runs": runs}));
    let held = found
        .misheld
        .iter()
        .map(|held| json!({"name": held.name, "value": held.value, "truth": held.truth, "unit": held.unit}));
    let rows = found.rows.iter().map(|(name, rows, check)| (name.clone(), json!({"rows": rows, "check_rows": check})));
    let chi = found.chi_squared_per_dof;
    json!({
        "runs": found.runs,
        "failed": found.failed(),
        "failures": failures.collect::<Vec<_>>(),
        "not_simulated": found.not_simulated,
        "honest": found.honest(),
        "verdict": coverage_verdict(found),
        "parameters": found.parameters.iter().map(quantity).collect::<Vec<_>>(),
        "not_estimable": found.blind,
        "predictions": found.predictions.iter().map(quantity).collect::<Vec<_>>(),
        "chi_squared_per_dof": chi.map(|[low, median, high]| json!({"median": median, "low": low, "high": high})),
        "trustworthy_share": found.trustworthy_share,
        "noticed_below": found.noticed_below(),
        "held_off_truth": held.collect::<Vec<_>>(),
        "notes": notes(found),
        "warnings": diag::json(&found.warnings),
        "provenance": {
            "version": env!("CARGO_PKG_VERSION"),
            "model": session.path.display().to_string(),
            "model_fingerprint": session.fingerprint,
            "scenario": scenario.name,
            "seed": found.first,
            "seeds": found.runs + found.not_simulated,
            "weights": found.weights.name(),
            "rows": rows.collect::<Map<_, _>>(),
            "options": options,
        },
    })
}
