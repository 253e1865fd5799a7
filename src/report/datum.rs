//! A fit at another datum, as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::fit::unit;
use super::number::{significant, with_sigma};
use super::table::{Align, Grid};

/// A parameter after a change of datum.
#[derive(Clone, Debug, PartialEq)]
pub struct AtDatum {
    /// Its name.
    pub name: String,
    /// Its value before, in its unit.
    pub before: f64,
    /// Its value now.
    pub value: f64,
    /// Its standard uncertainty now; none where nothing tells it, or it still is not estimable.
    pub sigma: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// Whether it is held by the datum.
    pub held: bool,
}

/// The text of a change of datum.
pub fn datum_text(parameters: &[AtDatum], residual: f64, family: bool) -> String {
    let mut out = match family {
        true => "Moved to another datum: what the data see is as it was\n".to_owned(),
        false => "Not moved: the data see a difference, so these values explain them less well\n".to_owned(),
    };
    let _ =
        writeln!(out, "  residuals of inputs that were consistent: {} root mean square\n", significant(residual, 2));
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Left, Align::Right, Align::Left]);
    for p in parameters {
        let (value, sigma) = match p.sigma.filter(|sigma| *sigma > 0.0) {
            Some(sigma) => {
                let (value, sigma) = with_sigma(p.value, sigma);
                (value, format!("± {sigma}"))
            }
            None => (significant(p.value, 7), String::new()),
        };
        let before = format!("was {}", significant(p.before, 7));
        let note = if p.held { "datum" } else { "" };
        grid.row([p.name.as_str(), &value, &sigma, unit(&p.unit), &before, note]);
    }
    out.push_str(&grid.text("  "));
    out
}

/// The same as JSON, which can be started from.
pub fn datum_json(parameters: &[AtDatum], residual: f64, family: bool) -> Value {
    let all = parameters.iter().map(|p| {
        json!({"name": p.name, "value": p.value, "before": p.before, "sigma": p.sigma, "unit": p.unit, "datum": p.held})
    });
    json!({"family": family, "residual": residual, "parameters": all.collect::<Vec<_>>()})
}
