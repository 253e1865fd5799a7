//! Residuals: how large, how distributed, and whether they depend on anything.

use maud::html;

use super::{Reported, Section, figure, identifier};
use crate::report::chart::{self, Curve, Figure, against_row, histogram};
use crate::survey::{Histogram, Series, Surveyed};

/// Residuals of a measurement that are drawn.
const RESIDUALS: usize = 12;

/// What a residual is drawn against.
const AGAINST: usize = 23;

/// A pattern is called one where chance alone would make any in a report as seldom as this.
const CHANCE: f64 = 0.01;

/// The figures of a measurement.
pub(super) struct Drawn {
    name: String,
    rows: usize,
    kept: usize,
    against_row: Vec<Figure>,
    histograms: Vec<Figure>,
    panels: Vec<Figure>,
    depends: Vec<Depends>,
    not_shown: usize,
}

/// Whether a residual depends on something.
pub(super) struct Depends {
    pub(super) residual: String,
    pub(super) against: String,
    pub(super) beyond_chance: bool,
}

/// What residuals are drawn against: the row, readings that vary, predictions.
fn against(of: &Surveyed) -> Vec<Series> {
    let row = Series {
        name: "row".into(),
        unit: String::new(),
        values: of.kept.iter().map(|row| (row + 1) as f64).collect(),
    };
    let varies =
        |series: &&Series| series.values.iter().zip(series.values.iter().skip(1)).any(|(one, next)| one != next);
    [row].into_iter().chain(of.inputs.iter().chain(&of.outputs).filter(varies).take(AGAINST).cloned()).collect()
}

/// How improbable a pattern must be, so that all together are as seldom as [`CHANCE`].
fn level(rows: &[Surveyed]) -> f64 {
    let pairs: usize = rows.iter().map(|of| of.residuals.len().min(RESIDUALS) * against(of).len()).sum();
    CHANCE / pairs.max(1) as f64
}

/// The figures of all measurements. Rows that took no part in the fit depend on everything by what the fit does not know, which is no
/// sign of a wrong model, so that nothing is framed in these.
pub(super) fn all(rows: &[Surveyed], checked: bool) -> Vec<Drawn> {
    let level = if checked { 0.0 } else { level(rows) };
    let of = |of: &Surveyed| {
        let against = against(of);
        let against: Vec<&Series> = against.iter().collect();
        let shown = || of.residuals.iter().take(RESIDUALS);
        let id = |what: &str, name: &str| identifier(&[what, &of.name, name]);
        let fitted = |series: &Series| {
            let all = Histogram::of(&series.values)?.moments;
            Some(Curve { mean: all.mean()?, deviation: all.deviation()? })
        };
        let (mut panels, mut depends) = (Vec::new(), Vec::new());
        for residual in shown().map(|residual| &residual.after) {
            let Some(drawn) = chart::panels(&id("dependence", &residual.name), residual, &against, level) else {
                continue;
            };
            let found = drawn.tested.into_iter().map(|(against, beyond_chance)| Depends {
                residual: residual.name.clone(),
                against,
                beyond_chance,
            });
            depends.extend(found);
            panels.push(drawn.figure);
        }
        Drawn {
            name: of.name.clone(),
            rows: of.rows,
            kept: of.kept.len(),
            against_row: shown().filter_map(|r| against_row(&id("residual", &r.after.name), &of.kept, r)).collect(),
            histograms: shown()
                .filter_map(|r| histogram(&id("histogram", &r.after.name), &r.after, fitted(&r.after)))
                .collect(),
            panels,
            depends,
            not_shown: of.residuals.len().saturating_sub(RESIDUALS),
        }
    };
    rows.iter().map(of).collect()
}

/// All pairs of a residual and what it might depend on.
pub(super) fn dependences(all: &[Drawn]) -> impl Iterator<Item = &Depends> + Clone {
    all.iter().flat_map(|of| &of.depends)
}

/// Residuals before and after, and their histograms.
pub(super) fn residuals(all: &[Drawn]) -> Option<Section> {
    let body = html! {
        p.note { "With the nominal values, and calibrated. Lines over histograms are normal distributions of the same mean and deviation." }
        @for of in all {
            h3 { (of.name) ", " (crate::report::count(of.rows, "row", "rows")) }
            @if of.kept < of.rows { p.note { "Figures show every " (of.rows.div_ceil(of.kept.max(1))) "th row." } }
            div.grid.wide {
                @for (one, other) in of.against_row.iter().zip(&of.histograms) { (figure(one)) (figure(other)) }
            }
            @if of.not_shown > 0 { p.note { (of.not_shown) " more residuals are not drawn." } }
        }
    };
    let figures: Vec<Figure> = all.iter().flat_map(|of| of.against_row.iter().chain(&of.histograms)).cloned().collect();
    (!figures.is_empty()).then(|| Section { figures, ..Section::new("residuals", "Residuals, before and after", body) })
}

/// Residuals against the row, readings and predictions.
pub(super) fn dependence(all: &[Drawn], checked: bool) -> Option<Section> {
    let body = html! {
        p.note {
            "Each residual against the row, every reading and every prediction, with means of neighbours. "
            @if checked { "In rows that took no part in the fit they depend on everything by what the fit does not know." }
            @else { "A frame marks what chance makes in no more than one report of a hundred." }
        }
        @for of in all { h3 { (of.name) } @for panel in &of.panels { (figure(panel)) } }
    };
    let figures: Vec<Figure> = all.iter().flat_map(|of| of.panels.iter()).cloned().collect();
    (!figures.is_empty())
        .then(|| Section { figures, ..Section::new("dependence", "Do residuals depend on anything?", body) })
}

/// What readings are corrected by.
pub(super) fn corrections(of: &Reported) -> Option<Section> {
    let groups = of.fit.observations.iter().flat_map(|tests| &tests.groups);
    let share = |group: &str| {
        let found = groups.clone().find(|known| known.name == group)?;
        Some((found.redundancy / found.observations.max(1) as f64).clamp(0.0, 1.0))
    };
    let mut figures = Vec::new();
    for rows in &of.rows {
        for correction in &rows.corrections {
            let redundancy = share(&correction.group);
            let deviation = correction.sigma.zip(redundancy).map(|(sigma, share)| sigma * share.sqrt());
            let expected = deviation.filter(|_| !of.checked).map(|deviation| Curve { mean: 0.0, deviation });
            let id = identifier(&["correction", &rows.name, &correction.corrections.name]);
            figures.extend(histogram(&id, &correction.corrections, expected));
        }
    }
    let body = html! {
        p.note {
            "By how much each reading is corrected so that the equations hold: that part of its error which other observations control."
            @if !of.checked { " Lines are what the declared sigmas make of that part." }
        }
        div.grid { @for drawn in &figures { (figure(drawn)) } }
    };
    (!figures.is_empty())
        .then(|| Section { figures, ..Section::new("corrections", "Corrections of the readings", body) })
}
