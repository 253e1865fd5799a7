//! Estimates beside the truth: one line each, on a common scale.

use maud::html;

use super::plot::drawing;
use super::{Figure, short, table};
use crate::report::number::significant;

/// An estimate minus what is true, in standard uncertainties.
pub(in crate::report) struct Row {
    pub(in crate::report) name: String,
    /// (estimate − truth)/σ
    pub(in crate::report) off: f64,
}

/// Estimates that are drawn: the farthest off.
const MOST: usize = 60;

/// Height of a line.
const LINE: f64 = 15.0;

/// Where each estimate is, with the interval that should hold zero; `factor` is its half width in standard uncertainties.
pub(in crate::report) fn forest(id: &str, mut rows: Vec<Row>, factor: f64) -> Option<Figure> {
    let largest = rows.iter().map(|row| row.off.abs()).filter(|off| off.is_finite()).fold(0.0, f64::max);
    if rows.is_empty() || !factor.is_finite() {
        return None;
    }
    let most = (largest + factor).clamp(4.0, 1e6);
    let (all, held) = (rows.len(), rows.iter().filter(|row| row.off.abs() <= factor).count());
    if all > MOST {
        rows.sort_by(|one, other| other.off.abs().total_cmp(&one.off.abs()));
        rows.truncate(MOST);
    }
    let names = rows.iter().map(|row| row.name.chars().count()).max().unwrap_or(0).min(34) as f64;
    let (left, width) = (12.0 + 6.6 * names, 460.0 + 6.6 * names);
    let height = LINE * rows.len() as f64 + 46.0;
    let across = |off: f64| left + (off + most) / (2.0 * most) * (width - left - 14.0);
    let step =
        [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0].into_iter().find(|step| most / step <= 6.0).unwrap_or(most / 4.0);
    let ticks = (1..=6).map(|k| f64::from(k) * step).filter(|at| *at <= most).flat_map(|at| [-at, at]).chain([0.0]);
    let inside = html! {
        @for at in ticks {
            path.rule d=(format!("M{} 8V{}", short(across(at)), short(height - 34.0))) {}
            text.tick x=(short(across(at))) y=(short(height - 20.0)) text-anchor="middle" { (significant(at, 3)) }
        }
        path.zero d=(format!("M{} 8V{}", short(across(0.0)), short(height - 34.0))) {}
        @for (k, row) in rows.iter().enumerate().filter(|(_, row)| row.off.is_finite()) {
            @let y = 16.0 + LINE * k as f64;
            @let class = if row.off.abs() <= factor { "now" } else { "was" };
            text x=(short(left - 8.0)) y=(short(y)) dy="0.32em" text-anchor="end" { (row.name) }
            path class=(format!("{class} line")) d=(format!("M{} {}H{}", short(across((row.off - factor).max(-most))), short(y), short(across((row.off + factor).min(most))))) {}
            circle class=(class) cx=(short(across(row.off))) cy=(short(y)) r="3" {}
        }
        text x=(short(across(0.0))) y=(short(height - 4.0)) text-anchor="middle" { "(estimate − truth) / standard uncertainty" }
    };
    Some(Figure {
        id: id.to_owned(),
        caption: format!(
            "Lines are 95 % intervals; {held} of {all} hold the truth.{}",
            if all > MOST { format!(" The {MOST} farthest off are shown.") } else { String::new() }
        ),
        svg: drawing(width, height, "Estimates minus truth", &inside),
        numbers: table(
            "parameter,deviation in sigma",
            rows.iter().map(|row| vec![row.name.clone(), row.off.to_string()]),
        ),
    })
}
