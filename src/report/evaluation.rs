//! An evaluation as text and JSON.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::count;
use super::fit::{direction, estimates, rows, unit};
use super::number::{rounded, significant, with_sigma};
use super::table::{Align, Grid};
use super::uncertainty::{self, Predicted};
use crate::diag;
use crate::evaluate::{Column, Evaluated, Evaluation, Statistics, Uncertainties, Uncertainty};
use crate::fit::Fit;
use crate::session::{Bound, Values};

/// Rows of outputs that the text shows.
const MOST_ROWS: usize = 50;

/// Where the values come from, in words, and what is to be said of it.
fn origin(bound: &Bound, values: Option<&Values>, predicted: &Predicted) -> (String, Vec<String>) {
    let mut notes: Vec<String> = predicted.note().into_iter().collect();
    let Some(values) = values else { return ("the nominal values".into(), notes) };
    if values.member("trustworthy").and_then(Value::as_bool) == Some(false) {
        let reasons = values.member("verdict").and_then(Value::as_array).into_iter().flatten();
        let reasons: Vec<&str> = reasons.filter_map(Value::as_str).collect();
        notes.push(format!("the fit is not trustworthy: {}", reasons.join("; ")));
    }
    if values.same_model(bound.session) == Some(false) {
        notes.push("the fit was made from another model file, or this one has changed since".into());
    }
    (format!("the values of {}", values.file), notes)
}

/// The first sentence: whether what had to be estimated for it can be trusted.
fn verdict(members: Option<&Fit>) -> String {
    match members {
        None => "Done: evaluated at given values, nothing was estimated".into(),
        Some(fit) if fit.status.converged() && fit.parameters.iter().all(|p| p.estimable) => {
            let n = count(fit.parameters.len(), "coordinate", "coordinates");
            format!("Trustworthy: {n} of family members estimated for these data, all estimable")
        }
        Some(fit) => {
            format!("Not trustworthy: family members estimated for these data: {}", fit.verdict().reasons.join("; "))
        }
    }
}

/// An evaluation as text. `predicted` are the uncertainties of its outputs, `members` is the fit of those family members that were estimated for it.
pub fn evaluation_text(
    evaluation: &Evaluation,
    predicted: &Predicted,
    members: Option<&Fit>,
    bound: &Bound,
    values: Option<&Values>,
) -> String {
    let mut out = format!("{}\n\n", verdict(members));
    let (origin, notes) = origin(bound, values, predicted);
    let _ = writeln!(out, "{} ({}) at {origin}", bound.session.program.name, bound.session.path.display());
    for used in &bound.files {
        let _ = writeln!(out, "  {}", rows(used));
    }
    for note in notes {
        let _ = writeln!(out, "  note: {note}");
    }
    if let Some(fit) = members {
        out.push_str("\nEstimated for these data alone, all else as given\n");
        out.push_str(&estimates(&fit.parameters, false));
        for found in &fit.null_directions {
            let _ = writeln!(out, "  {}", direction(found, &fit.parameters));
        }
    }
    for (measured, uncertainties) in evaluation.measurements.iter().zip(&predicted.measurements) {
        let _ = writeln!(out, "\n{}: {}", measured.name, count(measured.rows, "row", "rows"));
        out.push_str(&statistics(measured));
        if !measured.outputs.is_empty() {
            out.push('\n');
            out.push_str(&outputs(measured, uncertainties));
            out.push('\n');
            out.push_str(&uncertainty::text(measured, uncertainties));
        }
    }
    out
}

fn statistics(measured: &Evaluated) -> String {
    let mut grid = Grid::new(&[
        Align::Left,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Right,
        Align::Left,
    ]);
    grid.row(["residual", "rms", "mean", "sd", "mean |r|", "sd |r|", "max |r|", "in row", "unit"]);
    let mut add = |name: &str, symbol: &str, s: &Statistics| {
        let number = |value: f64| rounded(value, 4);
        let maybe = |value: Option<f64>| value.map_or("-".into(), number);
        grid.row([
            name.to_owned(),
            number(s.rms),
            number(s.mean),
            maybe(s.sd),
            number(s.mean_abs),
            maybe(s.sd_abs),
            number(s.max_abs),
            s.worst_row.to_string(),
            unit(symbol).to_owned(),
        ]);
    };
    for (name, symbol, s) in &measured.residuals {
        add(name, symbol, s);
    }
    for (name, symbol, s) in &measured.vectors {
        add(&format!("|{name}|"), symbol, s);
    }
    grid.text("  ")
}

/// The values of each row, with their standard uncertainties where any row has one.
fn outputs(measured: &Evaluated, uncertainties: &Uncertainties) -> String {
    let columns: Vec<(&Column, Option<&Uncertainty>)> = measured
        .outputs
        .iter()
        .zip(&uncertainties.outputs)
        .map(|(column, uncertainty)| (column, Some(uncertainty).filter(|u| u.rms.is_some())))
        .collect();
    let mut align = vec![Align::Right];
    align.extend(measured.keys.iter().map(|_| Align::Left));
    for (_, uncertainty) in &columns {
        align.push(Align::Right);
        align.extend(uncertainty.map(|_| Align::Left));
    }
    let mut grid = Grid::new(&align);
    // a value, and beside it what stands behind it
    let mut line = |first: String, keys: Vec<String>, cells: &dyn Fn(&Column, Option<&Uncertainty>) -> [String; 2]| {
        let cells = columns.iter().flat_map(|(column, uncertainty)| {
            let [value, sigma] = cells(column, *uncertainty);
            [Some(value), uncertainty.map(|_| sigma)]
        });
        grid.row([first].into_iter().chain(keys).chain(cells.flatten()));
    };
    let keys = measured.keys.iter().map(|(name, _)| name.clone()).collect();
    line("row".into(), keys, &|column, _| match unit(&column.unit) {
        "" => [column.name.clone(), String::new()],
        symbol => [format!("{} [{symbol}]", column.name), String::new()],
    });
    for row in 0..measured.rows.min(MOST_ROWS) {
        let keys = measured.keys.iter().map(|(_, names)| names.get(row).cloned().unwrap_or_default()).collect();
        line((row + 1).to_string(), keys, &|column, uncertainty| {
            let sigma = uncertainty.and_then(|uncertainty| uncertainty.sigma.get(row).copied().flatten());
            match (column.values.get(row), sigma) {
                (Some(&value), Some(sigma)) => {
                    let (value, sigma) = with_sigma(value, sigma);
                    [value, format!("± {sigma}")]
                }
                (Some(&value), None) => [significant(value, 9), String::new()],
                (None, _) => Default::default(),
            }
        });
    }
    let blank = || measured.keys.iter().map(|_| String::new()).collect();
    line("mean".into(), blank(), &|column, _| [significant(column.statistics.mean, 9), String::new()]);
    line("sd".into(), blank(), &|column, _| {
        [column.statistics.sd.map_or("-".into(), |sd| rounded(sd, 4)), String::new()]
    });
    let mut out = grid.text("  ");
    if measured.rows > MOST_ROWS {
        let _ = writeln!(out, "  rows after {MOST_ROWS} are not shown; `--format json` has all");
    }
    out
}

/// An evaluation as JSON.
pub fn evaluation_json(
    evaluation: &Evaluation,
    predicted: &Predicted,
    members: Option<&Fit>,
    bound: &Bound,
    values: Option<&Values>,
    warnings: &diag::Diagnostics,
) -> Value {
    let statistics = |s: &Statistics| {
        json!({
            "mean": s.mean, "sd": s.sd, "mean_abs": s.mean_abs, "sd_abs": s.sd_abs, "rms": s.rms, "max_abs": s.max_abs,
            "worst_row": s.worst_row,
        })
    };
    let named = |(name, unit, s): &(String, String, Statistics)| {
        let mut object = json!({ "name": name, "unit": unit });
        if let (Value::Object(object), Value::Object(more)) = (&mut object, statistics(s)) {
            object.extend(more);
        }
        object
    };
    let mut measurements = Map::new();
    for (m, uncertainties) in evaluation.measurements.iter().zip(&predicted.measurements) {
        let outputs = m.outputs.iter().zip(&uncertainties.outputs).map(|(c, uncertainty)| {
            json!({
                "name": c.name, "unit": c.unit, "mean": c.statistics.mean, "sd": c.statistics.sd, "values": c.values,
                "uncertainty": uncertainty::json(uncertainty),
            })
        });
        let residuals = m.residuals.iter().zip(&m.residual_values).map(|(residual, values)| {
            let mut object = named(residual);
            if let Value::Object(object) = &mut object {
                object.insert("values".into(), json!(values));
            }
            object
        });
        let keys: Map<String, Value> = m.keys.iter().map(|(name, names)| (name.clone(), json!(names))).collect();
        let value = json!({
            "rows": m.rows,
            "residuals": residuals.collect::<Vec<_>>(),
            "vectors": m.vectors.iter().map(named).collect::<Vec<_>>(),
            "keys": keys,
            "outputs": outputs.collect::<Vec<_>>(),
            "covariance": uncertainties.covariance.as_ref().filter(|_| !m.outputs.is_empty()),
        });
        measurements.insert(m.name.clone(), value);
    }
    let estimated = members.map(|fit| {
        let parameters = fit.parameters.iter().map(
            |p| json!({ "name": p.name, "value": p.value, "unit": p.unit, "sigma": p.sigma, "estimable": p.estimable }),
        );
        json!({
            "status": fit.status.name(),
            "converged": fit.status.converged(),
            "weights": fit.weights.name(),
            "parameters": parameters.collect::<Vec<_>>(),
        })
    });
    let data: Vec<Value> = bound
        .files
        .iter()
        .map(|f| json!({ "measurement": f.measurement, "file": f.file, "fingerprint": f.fingerprint, "rows": f.rows }))
        .collect();
    let (_, notes) = origin(bound, values, predicted);
    json!({
        "name": bound.session.program.name,
        "verdict": verdict(members),
        "values": values.map(|values| json!({ "file": values.file, "same_model": values.same_model(bound.session) })),
        "notes": notes,
        "data": data,
        "estimated": estimated,
        "measurements": measurements,
        "warnings": diag::json(warnings),
    })
}
