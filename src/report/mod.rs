//! Results as text and pages for people and JSON for programs. Nothing here computes, and nothing writes: each function gives a whole
//! text or value, and the caller decides where it goes.

mod abbreviate;
mod audit;
mod chart;
mod check;
mod comparison;
mod coverage;
mod datum;
mod derive;
mod design;
mod emit;
mod evaluation;
mod fit;
mod hold_out;
mod identify;
mod jacobian;
mod matrix;
mod number;
mod observations;
mod overview;
mod page;
mod restraints;
mod routes;
mod starts;
mod table;
mod uncertainty;

pub use audit::{formulas_json, formulas_text};
pub use check::{check_json, check_text};
pub use comparison::{comparison_json, comparison_text};
pub use coverage::{coverage_json, coverage_text, coverage_verdict};
pub use datum::{AtDatum, datum_json, datum_text};
pub use derive::{derivation_json, derivation_latex, derivation_text};
pub use design::{Told, design_json, design_text};
pub use emit::emitted_json;
pub use evaluation::{evaluation_json, evaluation_text};
pub use fit::{direction, fit_text, verdict};
pub use hold_out::{hold_out_json, hold_out_text};
pub use identify::{practice_json, practice_text, structure_json, structure_text};
pub use jacobian::{jacobian_json, jacobian_text};
pub use matrix::{matrix_json, matrix_text};
pub use number::{rounded, significant, with_sigma};
pub use overview::{Overview, overview_json, overview_text};
pub use page::{Page, Reported, page};
pub use routes::{routes_json, routes_text};
pub use table::{Align, Grid};
pub use uncertainty::Predicted;

/// `one row`, `300 rows`.
fn count(number: usize, one: &str, many: &str) -> String {
    match number {
        1 => format!("1 {one}"),
        _ => format!("{number} {many}"),
    }
}
