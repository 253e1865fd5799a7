//! What the tests of the observations say, as text.

use std::fmt::Write;
use std::path::Path;

use super::count;
use super::fit::unit;
use super::number::{rounded, significant};
use super::table::{Align, Grid};
use crate::fit::{Fit, Observation, Observations};

/// Suspects that are shown.
const MOST_SUSPECTS: usize = 10;

/// Everything about observations.
pub(super) fn text(fit: &Fit) -> String {
    let mut out = String::new();
    if !fit.removed.is_empty() {
        let rows = count(fit.removed.len(), "row", "rows");
        let _ = writeln!(out, "\nTaken out by data snooping: {rows}");
        out.push_str(&suspects(&fit.removed));
    }
    if !fit.components.is_empty() {
        out.push_str("\nErrors as the data have them, in declared sigmas\n");
        let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left]);
        for component in &fit.components {
            match component.sigma {
                Some(sigma) => {
                    let (factor, sigma) = super::number::with_sigma(component.factor, sigma);
                    grid.row([component.group.clone(), factor, format!("± {sigma}")]);
                }
                None => grid.row([component.group.clone(), "-".into(), "too little controls them".into()]),
            }
        }
        out.push_str(&grid.text("  "));
    }
    if let Some(all) = &fit.observations {
        out.push_str(&tests(all));
    }
    out
}

fn tests(all: &Observations) -> String {
    let mut out = String::new();
    let observations = count(all.count, "observation", "observations");
    let _ = writeln!(
        out,
        "\nObservations: {observations} tested, redundancy {}, {} beyond {} sigma",
        significant(all.redundancy, 6),
        count(all.suspected, "suspect", "suspects"),
        significant(all.critical, 3)
    );
    if all.uncontrolled > 0 {
        let _ = writeln!(out, "  {} controlled by no other", all.uncontrolled);
    }
    out.push_str(&suspects(&all.suspects));
    if all.suspected > MOST_SUSPECTS {
        let _ = writeln!(out, "  and {} more", all.suspected - MOST_SUSPECTS);
    }
    out
}

/// The line of a file, by the file's own name.
pub(super) fn read_in(file: &str, line: Option<usize>) -> String {
    let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy());
    line.map_or(String::new(), |line| format!("{name}:{line}"))
}

fn suspects(all: &[Observation]) -> String {
    let mut grid = Grid::new(&[
        Align::Left,
        Align::Right,
        Align::Left,
        Align::Left,
        Align::Right,
        Align::Right,
        Align::Left,
        Align::Right,
        Align::Left,
    ]);
    if all.is_empty() {
        return String::new();
    }
    grid.row([
        "measurement",
        "row",
        "read in",
        "suspect",
        "test",
        "correction",
        "unit",
        "detectable",
        "not to be told from",
    ]);
    for o in all.iter().take(MOST_SUSPECTS) {
        let partners: Vec<String> = o.inseparable.iter().map(|(name, rho)| format!("{name} ({rho:.2})")).collect();
        grid.row([
            o.measurement_name.clone(),
            (o.row + 1).to_string(),
            o.place.as_ref().map_or(String::new(), |place| read_in(&place.file, place.line)),
            o.name.clone(),
            o.test.map_or(String::new(), |test| rounded(test, 3)),
            significant(o.adjusted - o.observed, 3),
            unit(&o.unit).to_owned(),
            o.smallest_detectable.map_or(String::new(), |size| significant(size, 3)),
            partners.join(", "),
        ]);
    }
    grid.text("  ")
}
