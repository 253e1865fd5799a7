//! What bounds and constraints hold, as text.

use std::fmt::Write;

use super::fit::unit;
use super::number::significant;
use super::table::{Align, Grid};
use crate::fit::Fit;

/// Active bounds and all constraints; nothing where there are none.
pub(super) fn text(fit: &Fit) -> String {
    let mut out = String::new();
    if fit.restraints.is_empty() {
        return out;
    }
    let kkt = match fit.kkt.is_finite() {
        true => format!(" (KKT residual {} of the residuals)", significant(fit.kkt, 2)),
        false => String::new(),
    };
    let _ = writeln!(out, "\nBounds and constraints{kkt}");
    let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Left]);
    for r in &fit.restraints {
        let symbol = unit(&r.unit);
        let rate = format!("the cost changes by {} for each {}", significant(r.multiplier, 3), or_one(symbol));
        let state = match (r.equation, r.active) {
            (true, _) => format!("met; {rate}"),
            (false, true) => format!("active; {rate}"),
            (false, false) => format!("not active: {} {symbol} left", significant(-r.value, 3)).replace("  ", " "),
        };
        let name = if r.bound { "" } else { &r.name };
        grid.row([name, &r.text, &state]);
    }
    out.push_str(&grid.text("  "));
    out
}

fn or_one(symbol: &str) -> &str {
    if symbol.is_empty() { "unit" } else { symbol }
}
