//! Results as text for people and JSON for programs. Nothing here computes, and nothing writes: each function gives a whole
//! text or value, and the caller decides where it goes.

mod check;
mod evaluation;
mod fit;
mod jacobian;
mod number;
mod table;

pub use check::{check_json, check_text};
pub use evaluation::{evaluation_json, evaluation_text};
pub use fit::{direction, fit_text, verdict};
pub use jacobian::{jacobian_json, jacobian_text};
pub use number::{rounded, significant, with_sigma};
pub use table::{Align, Grid};

/// `one row`, `300 rows`.
fn count(number: usize, one: &str, many: &str) -> String {
    match number {
        1 => format!("1 {one}"),
        _ => format!("{number} {many}"),
    }
}
