//! Jacobians as a table and as JSON in the layout that is read back.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::fit::unit;
use super::number::significant;
use super::table::{Align, Grid};
use crate::evaluate::Jacobian;

/// Digits of a derivative in the text.
const DIGITS: usize = 6;

/// The matrices as JSON: of one measurement as they are, of several by its name under `measurements`. `point` names the
/// point in `at`.
pub fn jacobian_json(jacobians: &[Jacobian], point: &str) -> Value {
    match jacobians {
        [one] => of_one(one, point),
        several => {
            let all: Map<String, Value> = several.iter().map(|j| (j.measurement.clone(), of_one(j, point))).collect();
            json!({ "measurements": all })
        }
    }
}

fn of_one(jacobian: &Jacobian, point: &str) -> Value {
    let names = |all: &[(String, String)]| all.iter().map(|(name, _)| json!(name)).collect::<Vec<_>>();
    let units: Map<String, Value> = [&jacobian.parameters, &jacobian.inputs, &jacobian.residuals]
        .into_iter()
        .flatten()
        .map(|(name, unit)| (name.clone(), json!(unit)))
        .collect();
    let mut at = Map::new();
    at.insert(
        point.to_owned(),
        json!({ "q": jacobian.q, "r": jacobian.r, "dr_dq": jacobian.dr_dq, "dr_dx": jacobian.dr_dx }),
    );
    json!({
        "parameters": names(&jacobian.parameters),
        "inputs": names(&jacobian.inputs),
        "residuals": names(&jacobian.residuals),
        "units": units,
        "rows": jacobian.rows,
        "at": at,
    })
}

/// The matrices as text: a table for each row, a line for each parameter and input, a column for each residual.
pub fn jacobian_text(jacobians: &[Jacobian], point: &str) -> String {
    let mut out = String::new();
    for jacobian in jacobians {
        let _ = writeln!(
            out,
            "{} at {point}: derivatives of {} residuals by {} parameters and {} inputs, {} rows, not weighted",
            jacobian.measurement,
            jacobian.residuals.len(),
            jacobian.parameters.len(),
            jacobian.inputs.len(),
            jacobian.rows.len()
        );
        let derivatives = jacobian.dr_dq.iter().zip(&jacobian.dr_dx);
        for (row, ((readings, r), of)) in jacobian.rows.iter().zip(&jacobian.r).zip(derivatives).enumerate() {
            let _ = writeln!(out, "\n{}, row {}", jacobian.measurement, row + 1);
            out.push_str(&row_text(jacobian, readings, r, of));
        }
        out.push('\n');
    }
    out.pop();
    out
}

fn row_text(
    jacobian: &Jacobian,
    readings: &[f64],
    residuals: &[f64],
    (by_parameters, by_inputs): (&Vec<Vec<f64>>, &Vec<Vec<f64>>),
) -> String {
    let mut align = vec![Align::Left, Align::Right, Align::Left];
    align.extend(jacobian.residuals.iter().map(|_| Align::Right));
    let mut grid = Grid::new(&align);
    let heads = jacobian.residuals.iter().map(|(name, symbol)| match unit(symbol) {
        "" => name.clone(),
        symbol => format!("{name} [{symbol}]"),
    });
    grid.row([String::new(), "value".into(), String::new()].into_iter().chain(heads));
    let residuals = residuals.iter().map(|&r| significant(r, DIGITS));
    grid.row(["residual".to_owned(), String::new(), String::new()].into_iter().chain(residuals));
    let mut lines = |names: &[(String, String)], values: &[f64], derivatives: &[Vec<f64>]| {
        for (k, ((name, symbol), &value)) in names.iter().zip(values).enumerate() {
            let of = derivatives.iter().filter_map(|by| by.get(k)).map(|&by| significant(by, DIGITS));
            let head = [format!("d/d {name}"), significant(value, 9), unit(symbol).to_owned()];
            grid.row(head.into_iter().chain(of));
        }
    };
    lines(&jacobian.parameters, &jacobian.q, by_parameters);
    lines(&jacobian.inputs, readings, by_inputs);
    grid.text("  ")
}
