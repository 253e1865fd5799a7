//! What a model is, once it has been read and compiled.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::count;
use super::fit::unit;
use super::number::significant;
use super::table::{Align, Grid};
use crate::compile::{Constraint, Measurement, Parameter, Program, Role, Scenario, Setting, Sigma, Simulation};
use crate::diag;
use crate::problem;
use crate::session::Session;
use crate::solve::Relation;
use crate::unit::{Base, Dimension};

/// One coordinate of a parameter as declared, in reported units.
struct Row {
    name: String,
    role: Role,
    nominal: f64,
    unit: String,
    min: Option<f64>,
    max: Option<f64>,
    sigma: Option<f64>,
    tolerance: f64,
}

fn rows_of(program: &Program, parameter: &Parameter) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut add = |base: String, setting: &Setting| {
        let bounds = setting.min.iter().zip(&setting.max);
        let numbers = setting.nominal.iter().zip(bounds).zip(setting.sigma.iter().zip(&setting.tolerance));
        let components = parameter.shape.suffixes().iter().zip(&parameter.dimensions);
        let components = components.zip(&setting.roles);
        for (((suffix, &dimension), &role), ((&nominal, (&min, &max)), (sigma, &tolerance))) in components.zip(numbers)
        {
            let reported = |value: f64| program.units.to_reported(value, dimension);
            let bound = |value: f64| value.is_finite().then(|| reported(value));
            rows.push(Row {
                name: format!("{base}{suffix}"),
                role,
                nominal: reported(nominal),
                unit: program.units.symbol(dimension),
                min: bound(min),
                max: bound(max),
                sigma: sigma.map(reported),
                tolerance: reported(tolerance),
            });
        }
    };
    if parameter.family {
        add(format!("{}[*]", parameter.name), &parameter.setting);
        for (key, setting) in &parameter.members {
            add(format!("{}[{key}]", parameter.name), setting);
        }
    } else {
        add(parameter.name.clone(), &parameter.setting);
    }
    rows
}

fn all_rows(program: &Program) -> Vec<Row> {
    program.parameters.iter().flat_map(|parameter| rows_of(program, parameter)).collect()
}

fn role(role: Role) -> &'static str {
    match role {
        Role::Free => "free",
        Role::Held => "held",
    }
}

/// The model's unit of each base dimension.
fn units(program: &Program) -> Vec<(&'static str, String)> {
    Base::ALL.into_iter().map(|base| (base.name(), program.units.symbol(Dimension::of(base)))).collect()
}

/// The unit of a column, as the model says it.
fn column_unit(session: &Session, measurement: &Measurement, input: usize) -> String {
    let declared = session.model.measurements.get(&measurement.name);
    let input = measurement.inputs.get(input).zip(declared).and_then(|(input, all)| all.inputs.get(&input.name));
    let found = input.and_then(|input| input.unit.as_ref());
    found.map_or_else(|| "1".into(), |text| text.value.clone())
}

fn parameters_used<'p>(program: &'p Program, measurement: &Measurement) -> Vec<&'p str> {
    let mut used: Vec<usize> = measurement.slots.iter().map(|slot| slot.parameter).collect();
    used.sort_unstable();
    used.dedup();
    used.into_iter().filter_map(|index| program.parameters.get(index)).map(|p| p.name.as_str()).collect()
}

fn operations(program: &Program, measurement: &Measurement) -> Value {
    let counts = problem::operations(program, measurement);
    json!({ "per_iteration": counts.per_iteration, "per_row": counts.per_row })
}

/// What a scenario measures, and how many rows of it.
fn simulated<'p>(program: &'p Program, scenario: &'p Scenario) -> impl Iterator<Item = (&'p str, usize)> {
    let name = |m: &Simulation| program.measurements.get(m.measurement).map(|known| known.name.as_str());
    scenario.measurements.iter().filter_map(move |m| Some((name(m)?, m.rows)))
}

/// The summary as JSON.
pub fn check_json(session: &Session) -> Value {
    let program = &session.program;
    let parameters: Vec<Value> = all_rows(program)
        .into_iter()
        .map(|r| {
            json!({
                "name": r.name, "role": role(r.role), "nominal": r.nominal, "unit": r.unit, "min": r.min, "max": r.max,
                "sigma": r.sigma, "tolerance": r.tolerance,
            })
        })
        .collect();
    let measurements: Vec<Value> = program.measurements.iter().map(|m| measurement_json(session, m)).collect();
    let scenarios: Vec<Value> = program
        .scenarios
        .iter()
        .map(|s| {
            let simulated = simulated(program, s).map(|(name, rows)| json!({ "name": name, "rows": rows }));
            json!({ "name": s.name, "seed": s.seed, "measurements": simulated.collect::<Vec<_>>() })
        })
        .collect();
    let units: Map<String, Value> = units(program).into_iter().map(|(name, unit)| (name.into(), json!(unit))).collect();
    let mut counts = match program.measurements.first().map(|m| operations(program, m)) {
        Some(Value::Object(counts)) => counts,
        _ => Map::new(),
    };
    let by_measurement: Map<String, Value> =
        program.measurements.iter().map(|m| (m.name.clone(), operations(program, m))).collect();
    counts.insert("measurements".into(), Value::Object(by_measurement));
    json!({
        "ok": true,
        "name": program.name,
        "units": units,
        "parameters": parameters,
        "constraints": program.constraints.items.iter().map(|item| constraint_json(program, item)).collect::<Vec<_>>(),
        "measurements": measurements,
        "scenarios": scenarios,
        "operations": counts,
        "warnings": diag::json(&session.warnings),
    })
}

fn constraint_json(program: &Program, item: &Constraint) -> Value {
    let relation = match item.relation {
        Relation::Equal => "equal",
        Relation::AtMost => "at most",
    };
    let unit = program.units.symbol(item.dimension);
    json!({ "name": item.name, "text": item.text, "relation": relation, "unit": unit, "linear": item.linear })
}

fn measurement_json(session: &Session, m: &Measurement) -> Value {
    let units = &session.program.units;
    let columns: Vec<Value> = m
        .inputs
        .iter()
        .enumerate()
        .map(|(k, input)| {
            let in_column = |value: f64| units.from_internal(value, input.unit);
            json!({
                "name": input.name, "unit": column_unit(session, m, k), "sigma": input.sigma.and_then(Sigma::constant).map(in_column),
                "sigma_by_row": matches!(input.sigma, Some(Sigma::PerRow(_))), "group": input.group, "bias": in_column(input.bias), "default": input.default.map(in_column),
            })
        })
        .collect();
    let residual = |r: &crate::compile::Residual| {
        let sigma = r.sigma.and_then(Sigma::constant).map(|sigma| units.to_reported(sigma, r.dimension));
        let by_row = matches!(r.sigma, Some(Sigma::PerRow(_)));
        json!({ "name": r.name, "unit": units.symbol(r.dimension), "sigma": sigma, "sigma_by_row": by_row })
    };
    json!({
        "name": m.name,
        "inputs": m.inputs.iter().map(|i| i.name.as_str()).collect::<Vec<_>>(),
        "keys": m.keys,
        "residuals": m.residuals.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(),
        "outputs": m.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(),
        "parameters_used": parameters_used(&session.program, m),
        "columns": columns,
        "equations": m.residuals.iter().map(residual).collect::<Vec<_>>(),
    })
}

/// The summary as text.
pub fn check_text(session: &Session) -> String {
    let program = &session.program;
    let rows = all_rows(program);
    let free = rows.iter().filter(|row| row.role == Role::Free).count();
    let mut out = String::new();
    let names: Vec<String> = units(program).into_iter().map(|(_, symbol)| symbol).collect();
    let _ = writeln!(
        out,
        "No mistakes found.\n\n{} ({})\n  units {}; {}, {free} free\n",
        program.name,
        session.path.display(),
        names.join(", "),
        count(rows.len(), "parameter", "parameters"),
    );
    if !rows.is_empty() {
        out.push_str("Parameters\n");
        let mut grid =
            Grid::new(&[Align::Left, Align::Left, Align::Right, Align::Left, Align::Left, Align::Left, Align::Left]);
        for row in &rows {
            let bounds = match (row.min, row.max) {
                (None, None) => String::new(),
                (min, max) => {
                    let side = |bound: Option<f64>, none: &str| bound.map_or(none.into(), |b| significant(b, 9));
                    format!("[{}, {}]", side(min, "-inf"), side(max, "inf"))
                }
            };
            let prior = row.sigma.map_or(String::new(), |sigma| format!("prior ± {}", significant(sigma, 4)));
            let tolerance = format!("tolerance {}", significant(row.tolerance, 4));
            grid.row([
                row.name.as_str(),
                role(row.role),
                &significant(row.nominal, 10),
                unit(&row.unit),
                &tolerance,
                &prior,
                &bounds,
            ]);
        }
        out.push_str(&grid.text("  "));
    }
    if !program.constraints.items.is_empty() {
        out.push_str("\nConstraints\n");
        let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Left]);
        for item in &program.constraints.items {
            grid.row([item.name.as_str(), &item.text, if item.linear { "linear" } else { "nonlinear" }]);
        }
        out.push_str(&grid.text("  "));
    }
    for m in &program.measurements {
        out.push_str(&measurement_text(session, m));
    }
    for scenario in &program.scenarios {
        let rows = simulated(program, scenario);
        let rows: Vec<String> =
            rows.map(|(name, rows)| format!("{} of `{name}`", count(rows, "row", "rows"))).collect();
        let _ = writeln!(out, "\nScenario `{}`: {}, seed {}", scenario.name, rows.join(", "), scenario.seed);
    }
    out
}

fn measurement_text(session: &Session, m: &Measurement) -> String {
    let units = &session.program.units;
    let mut out = String::new();
    let counts = problem::operations(&session.program, m);
    let _ = writeln!(
        out,
        "\nMeasurement `{}`: {} operations per iteration, {} per row",
        m.name, counts.per_iteration, counts.per_row
    );
    let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Left]);
    for key in &m.keys {
        grid.row(["key", key, ""]);
    }
    for (k, input) in m.inputs.iter().enumerate() {
        let column = column_unit(session, m, k);
        let sigma = match input.sigma {
            Some(Sigma::Constant(sigma)) => {
                format!("{column} ± {}", significant(units.from_internal(sigma, input.unit), 4))
            }
            Some(Sigma::PerRow(_)) => format!("{column} ± by row"),
            None => unit(&column).to_owned(),
        };
        grid.row(["input", &input.name, &sigma]);
    }
    for residual in &m.residuals {
        let symbol = units.symbol(residual.dimension);
        let sigma = match residual.sigma {
            Some(Sigma::Constant(sigma)) => {
                format!("{symbol} ± {}", significant(units.to_reported(sigma, residual.dimension), 4))
            }
            Some(Sigma::PerRow(_)) => format!("{symbol} ± by row"),
            None => unit(&symbol).to_owned(),
        };
        grid.row(["residual", &residual.name, &sigma]);
    }
    for output in &m.outputs {
        grid.row(["output", &output.name, unit(&units.symbol(output.dimension))]);
    }
    out.push_str(&grid.text("  "));
    out
}
