//! A fit as one HTML file: nothing is fetched, everything is in it, and every figure has its numbers behind it.
//!
//! Sections are files here; each gives its part of the page, and the figures that it draws, which can be files of their own as well.

mod instrument;
mod known;
mod parameters;
mod rows;
mod verdict;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::chart::{COLOURS, Figure, STYLE};
use crate::fit::Document;
use crate::survey::{Scene, Surveyed};

/// Everything that a report shows.
#[derive(Clone, Debug)]
pub struct Reported {
    /// The fit.
    pub fit: Document,
    /// Its rows, where they could be read, or others.
    pub rows: Vec<Surveyed>,
    /// Whether these took no part in the fit.
    pub checked: bool,
    /// The instrument, where there is anything to see.
    pub scene: Option<Scene>,
    /// What is known to be true, where the data are made up.
    pub truth: Vec<(String, f64)>,
    /// What is left out, and why.
    pub left_out: Vec<String>,
}

/// A part of the page.
struct Section {
    id: &'static str,
    title: &'static str,
    body: Markup,
    figures: Vec<Figure>,
}

impl Section {
    fn new(id: &'static str, title: &'static str, body: Markup) -> Section {
        Section { id, title, body, figures: Vec::new() }
    }
}

/// A report: the page, and its figures as files.
#[derive(Clone, Debug)]
pub struct Page {
    /// The HTML file.
    pub html: String,
    /// Names of SVG files, and what is in them.
    pub figures: Vec<(String, String)>,
}

/// The report of a fit.
pub fn page(of: &Reported) -> Page {
    let rows = rows::all(&of.rows, of.checked);
    let sections: Vec<Section> = [
        Some(parameters::section(of)),
        instrument::section(of),
        rows::residuals(&rows),
        rows::corrections(of),
        rows::dependence(&rows, of.checked),
        known::section(of),
        known::search(of),
        known::suspects(of),
        Some(verdict::provenance(of)),
    ]
    .into_iter()
    .flatten()
    .collect();
    let title = if of.fit.provenance.name.is_empty() { &of.fit.provenance.model } else { &of.fit.provenance.name };
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width,initial-scale=1";
                meta http-equiv="Content-Security-Policy" content="default-src 'none';style-src 'unsafe-inline';script-src 'unsafe-inline';img-src data:";
                title { (title) " – calibration" }
                style { (PreEscaped(COLOURS)) (PreEscaped(include_str!("page.css"))) (PreEscaped(STYLE)) }
            }
            body {
                header { h1 { (title) } (verdict::summary(of, rows::dependences(&rows))) }
                nav { @for section in &sections { a href=(format!("#{}", section.id)) { (section.title) } } }
                main {
                    @for section in &sections {
                        section id=(section.id) { h2 { (section.title) } (section.body) }
                    }
                }
                script { (PreEscaped(include_str!("turn.js"))) }
            }
        }
    };
    let figures = sections.iter().flat_map(|section| &section.figures);
    let figures = figures.map(|figure| (format!("{}.svg", figure.id), figure.file())).collect();
    Page { html: page.into_string(), figures }
}

/// A figure on the page, with its numbers to be opened.
fn figure(of: &Figure) -> Markup {
    html! {
        figure id=(of.id) {
            (of.svg)
            @if !of.caption.is_empty() { figcaption { (of.caption) } }
            details { summary { "Numbers" } pre { (of.numbers) } }
        }
    }
}

/// What a name becomes in that of a file, and of a place on the page.
fn identifier(parts: &[&str]) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_') { c } else { '_' };
    parts.join("-").chars().map(safe).collect()
}
