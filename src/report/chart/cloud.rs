//! Residuals against something: dots where there are few, counts in cells where there are many.

use maud::{Markup, html};

use super::axis::Axis;
use super::plot::{Plot, drawing};
use super::{Figure, labelled, short, table};
use crate::report::number::significant;
use crate::survey::{Compared, Density, Dependence, Series, Span, dependence};

/// Points beyond which they are counted in cells.
const MOST_DOTS: usize = 1500;

/// Shades of cells.
const SHADES: [&str; 4] = ["0.18", "0.4", "0.65", "0.95"];

/// Points, as dots or as cells.
fn cloud(plot: &Plot, x: &[f64], y: &[f64], (across, up): (Span, Span), class: &str) -> Markup {
    let points = || x.iter().copied().zip(y.iter().copied());
    if x.len() <= MOST_DOTS {
        let dot = |(x, y)| format!("M{} {}h0", short(x), short(y));
        let path: String = points().filter_map(|point| plot.at(point)).map(dot).collect();
        return html! { path class=(format!("dots {class}")) d=(path) {} };
    }
    let (columns, rows) = ((plot.field_width() / 6.0) as usize, (plot.field_height() / 6.0) as usize);
    let density = Density::of(points(), across, up, columns.max(1), rows.max(1));
    let most = density.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let mut shades = vec![String::new(); SHADES.len()];
    for (cell, &count) in density.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (i, j) = (cell % density.across, cell / density.across);
        let corner = |i: usize, j: usize| {
            let part = |span: Span, k: usize, of: usize| span.low + (span.high - span.low) * k as f64 / of as f64;
            (part(across, i, columns.max(1)), part(up, j, rows.max(1)))
        };
        // by the square root, so that thin parts are seen
        let shade = (((count as f64 / most).sqrt() * SHADES.len() as f64) as usize).min(SHADES.len() - 1);
        if let (Some(path), Some(rectangle)) =
            (shades.get_mut(shade), plot.rectangle(corner(i, j), corner(i + 1, j + 1)))
        {
            path.push_str(&rectangle);
        }
    }
    html! {
        @for (path, opacity) in shades.iter().zip(SHADES) {
            @if !path.is_empty() { path class=(class) d=(path) opacity=(opacity) {} }
        }
    }
}

/// A residual against the row, before and after: what the calibration does.
pub(in crate::report) fn against_row(id: &str, rows: &[usize], of: &Compared) -> Option<Figure> {
    let x: Vec<f64> = rows.iter().map(|row| (row + 1) as f64).collect();
    let after = Span::of(&of.after.values)?;
    let before = of.before.as_ref().and_then(Span::of);
    let up = before.map_or(after, |before| before.with(after));
    let across = Span { low: 1.0, high: x.last().copied().unwrap_or(1.0) }.widened();
    let plot = Plot {
        x: Axis::linear(across, "row"),
        y: Axis::linear(up, labelled(&of.after.name, &of.after.unit)).roomy(),
        width: 420.0,
        height: 190.0,
    };
    let inside = html! {
        @if let Some(before) = &of.before { (cloud(&plot, &x, before, (across, up), "was")) }
        (cloud(&plot, &x, &of.after.values, (across, up), "now"))
        @if of.before.is_some() {
            text x=(short(plot.width - 14.0)) y="13" text-anchor="end" {
                tspan.was { "● nominal" } " " tspan.now { "● calibrated" }
            }
        }
    };
    let size = |values: &[f64]| {
        let n = values.len().max(1) as f64;
        let mean = values.iter().map(|value| value.abs()).sum::<f64>() / n;
        format!("{} {}", significant(mean, 3), of.after.unit).trim_end().to_owned()
    };
    let caption = match &of.before {
        Some(before) => {
            format!("Mean size {} with the nominal values, {} calibrated.", size(before), size(&of.after.values))
        }
        None => format!("Mean size {}. With the nominal values it is undefined.", size(&of.after.values)),
    };
    let thinned = rows.len().div_ceil(MOST_DOTS).max(1);
    let numbers = (0..rows.len()).step_by(thinned).filter_map(|k| {
        let before = of.before.as_ref().and_then(|before| before.get(k)).map_or(String::new(), f64::to_string);
        Some(vec![(rows.get(k)? + 1).to_string(), before, of.after.values.get(k)?.to_string()])
    });
    Some(Figure {
        id: id.to_owned(),
        caption,
        svg: plot.svg(&of.after.name, &inside),
        numbers: table("row,nominal,calibrated", numbers),
    })
}

/// One panel of a residual against something.
struct Panel<'a> {
    against: &'a Series,
    depends: Option<Dependence>,
}

/// All panels of a residual.
pub(in crate::report) struct Panels {
    pub(in crate::report) figure: Figure,
    /// what it was tested against, and whether it depends on that by more than chance
    pub(in crate::report) tested: Vec<(String, bool)>,
}

/// Panels beside one another, at most.
const ACROSS: usize = 4;

/// A residual against everything: a panel each, with the means of neighbours. A frame marks those that depend by more than chance, at
/// this probability.
pub(in crate::report) fn panels<'s>(id: &str, of: &Series, against: &[&'s Series], chance: f64) -> Option<Panels> {
    let up = Span::of(&of.values)?;
    let panel = |against: &&'s Series| Panel { against, depends: dependence(&against.values, &of.values) };
    let all: Vec<Panel> = against.iter().map(panel).collect();
    let (width, height) = (232.0, 150.0);
    let flagged =
        |panel: &Panel| panel.depends.as_ref().and_then(|d| d.test).is_some_and(|test| test.upper_tail < chance);
    let drawn = all.iter().enumerate().filter_map(|(k, panel)| {
        let across = Span::of(&panel.against.values)?;
        let plot = Plot {
            x: Axis::linear(across, labelled(&panel.against.name, &panel.against.unit)),
            y: Axis::linear(up, "").roomy(),
            width,
            height,
        };
        let means = panel.depends.iter().flat_map(|d| &d.groups);
        let means = means.filter_map(|group| Some((0.5 * (group.from + group.to), group.moments.mean()?)));
        let inside = html! {
            (cloud(&plot, &panel.against.values, &of.values, (across, up), "now"))
            path.mean d=(plot.path(means)) {}
            @if flagged(panel) { rect.flag x="1" y="1" width=(short(width - 3.0)) height=(short(height - 3.0)) rx="4" {} }
        };
        let place = format!("translate({} {})", short((k % ACROSS) as f64 * width), short((k / ACROSS) as f64 * height + 18.0));
        let title = format!("{}{}", panel.against.name, if flagged(panel) { ": depends" } else { "" });
        Some(html! { g transform=(place) { (plot.drawn(&title, &inside)) } })
    });
    let drawn: Vec<Markup> = drawn.collect();
    let columns = all.len().min(ACROSS) as f64;
    let rows = all.len().div_ceil(ACROSS) as f64;
    let inside = html! {
        text.title x="4" y="12" { (labelled(&of.name, &of.unit)) }
        @for panel in &drawn { (panel) }
    };
    let names: Vec<&str> = all.iter().filter(|panel| flagged(panel)).map(|panel| panel.against.name.as_str()).collect();
    let caption = match names.as_slice() {
        [] => "Lines are means of neighbours; none differ by more than chance.".to_owned(),
        names => format!("Depends on {} by more than chance: something is not in the model.", names.join(", ")),
    };
    let numbers = all.iter().flat_map(|panel| {
        let name = panel.against.name.clone();
        panel.depends.iter().flat_map(|d| &d.groups).map(move |group| {
            vec![
                name.clone(),
                group.from.to_string(),
                group.to.to_string(),
                group.moments.count().to_string(),
                group.moments.mean().unwrap_or(f64::NAN).to_string(),
                group.moments.deviation().map_or(String::new(), |d| d.to_string()),
            ]
        })
    });
    let figure = Figure {
        id: id.to_owned(),
        caption,
        numbers: table("against,from,to,rows,mean,sd", numbers),
        svg: drawing(columns * width, rows * height + 20.0, &of.name, &inside),
    };
    let told = all.iter().filter(|panel| panel.depends.as_ref().is_some_and(|d| d.test.is_some()));
    let tested = told.map(|panel| (panel.against.name.clone(), flagged(panel))).collect();
    Some(Panels { figure, tested })
}
