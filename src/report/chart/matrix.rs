//! Correlations as a map.

use maud::html;

use super::plot::drawing;
use super::{Figure, short, table};

/// A map has no more lines; beyond it has those that correlate most.
const MOST: usize = 48;

/// Pairs that are told in words.
const PAIRS: usize = 3;

/// A matrix of correlations; none where a parameter has no uncertainty.
pub(in crate::report) fn correlations(id: &str, names: &[String], matrix: &[Vec<Option<f64>>]) -> Option<Figure> {
    let entry = |i: usize, j: usize| matrix.get(i).and_then(|row| row.get(j)).copied().flatten();
    let strongest =
        |i: usize| (0..names.len()).filter(|j| *j != i).filter_map(|j| entry(i, j)).map(f64::abs).fold(0.0, f64::max);
    let mut chosen: Vec<usize> = (0..names.len()).filter(|&i| entry(i, i).is_some()).collect();
    if chosen.len() < 2 {
        return None;
    }
    chosen.sort_by(|one, other| strongest(*other).total_cmp(&strongest(*one)));
    let left_out = chosen.len().saturating_sub(MOST);
    chosen.truncate(MOST);
    chosen.sort_unstable();
    let cell = if chosen.len() > 24 { 12.0 } else { 17.0 };
    let longest = chosen.iter().filter_map(|&i| names.get(i)).map(|name| name.chars().count()).max().unwrap_or(0);
    let margin = 10.0 + 6.4 * longest.min(30) as f64;
    let side = cell * chosen.len() as f64;
    let at = |k: usize| margin + cell * k as f64;
    let inside = html! {
        @for (k, &i) in chosen.iter().enumerate() {
            @let name = names.get(i).map_or("", String::as_str);
            text.tick x=(short(margin - 5.0)) y=(short(at(k) + 0.5 * cell)) dy="0.32em" text-anchor="end" { (name) }
            text.tick transform=(format!("translate({} {}) rotate(-90)", short(at(k) + 0.5 * cell), short(margin - 5.0))) dy="0.32em" { (name) }
            @for (l, &j) in chosen.iter().enumerate() {
                @if let Some(rho) = entry(i, j) {
                    rect class=(if rho < 0.0 { "was" } else { "now" }) x=(short(at(l))) y=(short(at(k))) width=(short(cell - 1.0)) height=(short(cell - 1.0)) fill-opacity=(format!("{:.2}", rho.abs().min(1.0))) {
                        title { (name) ", " (names.get(j).map_or("", String::as_str)) ": " (format!("{rho:.3}")) }
                    }
                }
            }
        }
        rect.rule x=(short(margin - 1.0)) y=(short(margin - 1.0)) width=(short(side + 1.0)) height=(short(side + 1.0)) {}
        rect.now x=(short(margin)) y=(short(margin + side + 10.0)) width="14" height="10" {}
        text.tick x=(short(margin + 19.0)) y=(short(margin + side + 19.0)) { "+1" }
        rect.was x=(short(margin + 50.0)) y=(short(margin + side + 10.0)) width="14" height="10" {}
        text.tick x=(short(margin + 69.0)) y=(short(margin + side + 19.0)) { "−1; paler is less" }
    };
    // those that correlate most are in the map
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (k, &i) in chosen.iter().enumerate() {
        pairs.extend(chosen.iter().take(k).filter_map(|&j| entry(i, j).map(|rho| (rho, j, i))));
    }
    pairs.sort_by(|one, other| other.0.abs().total_cmp(&one.0.abs()));
    let name = |i: usize| names.get(i).map_or("", String::as_str);
    let told = pairs.iter().take(PAIRS).map(|(rho, i, j)| format!("{} and {} {rho:.3}", name(*i), name(*j)));
    let told = told.collect::<Vec<_>>().join("; ");
    let rest = match left_out {
        0 => String::new(),
        n => format!(" {n} parameters that correlate least are not in the map."),
    };
    let numbers = pairs.iter().map(|(rho, i, j)| vec![name(*i).to_owned(), name(*j).to_owned(), rho.to_string()]);
    Some(Figure {
        id: id.to_owned(),
        caption: format!("The strongest: {told}.{rest}"),
        svg: drawing(margin + side + 8.0, margin + side + 26.0, "Correlations", &inside),
        numbers: table("parameter,parameter,correlation", numbers),
    })
}
