//! Figures as SVG: one considered design, numbers in and markup out.
//!
//! - What was before is vermilion, what is now is blue, what is declared or expected is a grey line: apart for every eye, and in grey on
//!   paper by their lightness. Colours are variables, so that one figure serves light and dark.
//! - Axes have names and units, ticks are round numbers, lines carry data. Very many points are counted in cells.

mod axis;
mod cloud;
mod forest;
mod histogram;
mod lines;
mod matrix;
mod picture;
mod plot;

pub(super) use cloud::{against_row, panels};
pub(super) use forest::{Row, forest};
pub(super) use histogram::{Curve, histogram};
pub(super) use lines::{Step, spectrum, trace};
pub(super) use matrix::correlations;
pub(super) use picture::{magnification, picture};

use maud::Markup;

/// Colours of all figures and pages.
pub(super) const COLOURS: &str = include_str!("colours.css");

/// How figures are drawn.
pub(super) const STYLE: &str = include_str!("chart.css");

/// A figure, and the numbers behind it.
#[derive(Clone, Debug)]
pub(super) struct Figure {
    /// what its file is called
    pub(super) id: String,
    /// what there is to see
    pub(super) caption: String,
    /// the drawing
    pub(super) svg: Markup,
    /// comma-separated values with a heading
    pub(super) numbers: String,
}

impl Figure {
    /// The figure as a file of its own.
    pub(super) fn file(&self) -> String {
        let svg = self.svg.0.as_str();
        let (open, rest) = svg.split_once('>').unwrap_or((svg, ""));
        let open = open.replacen("<svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"", 1);
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{open}><style>{COLOURS}{STYLE}svg{{background:var(--paper)}}</style>{rest}\n"
        )
    }
}

/// A coordinate of a drawing: a tenth of a pixel is enough.
fn short(value: f64) -> String {
    let text = format!("{value:.1}");
    match text.strip_suffix(".0") {
        Some("-0") => "0".to_owned(),
        Some(whole) => whole.to_owned(),
        None => text,
    }
}

/// A name with its unit, as an axis has it.
fn labelled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

/// Rows of numbers with a heading, comma separated.
fn table(heading: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    rows.into_iter().fold(format!("{heading}\n"), |text, row| text + &row.join(",") + "\n")
}
