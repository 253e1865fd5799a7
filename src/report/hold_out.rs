//! How well rows were predicted that took no part in the fit.

use std::fmt::Write;

use serde_json::{Value, json};

use super::fit::unit;
use super::number::{rounded, significant};
use super::table::{Align, Grid};
use crate::session::HeldOut;

/// As text.
pub fn hold_out_text(found: &HeldOut) -> String {
    let mut out = String::new();
    let failed = if found.failed > 0 { format!(", {} of them failed", found.failed) } else { String::new() };
    let _ = writeln!(
        out,
        "\nRows held out, {} fits{failed}: weighted squares per equation {}, within the fit {}",
        found.folds,
        significant(found.per_equation, 4),
        significant(found.within, 4)
    );
    let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Right, Align::Left]);
    for (measurement, residual, rms, symbol) in &found.rms {
        grid.row([measurement.as_str(), residual, &rounded(*rms, 4), unit(symbol)]);
    }
    out + &grid.text("  ")
}

/// As JSON.
pub fn hold_out_json(found: &HeldOut) -> Value {
    let rms = found.rms.iter().map(|(measurement, residual, rms, unit)| {
        json!({"measurement": measurement, "residual": residual, "rms": rms, "unit": unit})
    });
    json!({
        "folds": found.folds, "failed": found.failed, "per_equation": found.per_equation, "within": found.within,
        "rms": rms.collect::<Vec<_>>(),
    })
}
