//! A design, as text and JSON.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::count;
use super::fit::unit;
use super::number::significant;
use super::table::{Align, Grid};
use crate::design::{Aim, Confirmation, Design, Expected};
use crate::problem::Block;
use crate::session::Session;

/// Chosen rows that are shown.
const MOST_ROWS: usize = 10;

/// What is said beside the design itself.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a> {
    /// Where candidates come from.
    pub candidates: &'a str,
    /// Where targets are wanted.
    pub volume: &'a str,
    /// The prediction, confirmed or not.
    pub confirmed: Option<&'a Confirmation>,
    /// The files of the chosen rows.
    pub files: &'a [(String, String)],
}

/// A share in per cent, upwards, so that a bound stays one.
fn percent(share: f64) -> String {
    let percent = 100.0 * share.max(0.0);
    let digits = 10f64.powi(1 - percent.max(0.001).log10().floor() as i32);
    format!("{} %", significant((percent * digits).ceil() / digits, 2))
}

fn verdict(found: &Design) -> String {
    let (chosen, all) = (found.picked.chosen.len(), found.origin.len());
    let excess = found.picked.excess();
    match &found.reach {
        None if excess.is_finite() => format!(
            "{chosen} of {all} rows chosen, within {} of the least uncertainty that any {chosen} can give (certified)",
            percent(excess)
        ),
        None => format!("{chosen} of {all} rows chosen"),
        Some(reach) if reach.reached && reach.least == chosen => {
            format!("{chosen} of {all} rows reach what is required; no fewer can (certified)")
        }
        Some(reach) if reach.reached => {
            format!("{chosen} of {all} rows reach what is required; fewer than {} cannot (certified)", reach.least)
        }
        Some(_) => format!("Not reached: all {all} candidates together are not enough for what is required"),
    }
}

fn purpose(aim: Aim) -> &'static str {
    match aim {
        Aim::D => "the volume of the ellipsoid of uncertainty of all parameters (D)",
        Aim::A => "the mean variance of all parameters in tolerances (A)",
        Aim::E => "what is known worst of all parameters in tolerances (E)",
        Aim::Targets => "the targets",
    }
}

/// The report of a design.
pub fn design_text(found: &Design, session: &Session, told: &Told) -> String {
    let mut out = format!("{}\n", verdict(found));
    if let Some(confirmed) = told.confirmed {
        let _ = writeln!(out, "{}", confirmation(confirmed));
    }
    let _ = writeln!(out, "\n{} ({})", session.program.name, session.path.display());
    let chosen = |(block, rows, _): (&Block, Vec<usize>, Vec<usize>)| {
        format!("{} of {} of {}", rows.len(), count(block.table.rows(), "row", "rows"), block.measurement.name)
    };
    let by: Vec<String> = chosen_rows(found).map(chosen).collect();
    let _ = writeln!(out, "  candidates: {}; chosen {}", told.candidates, by.join(", "));
    if found.left_out > 0 {
        let _ = writeln!(out, "  {} without consistent inputs left out", count(found.left_out, "row", "rows"));
    }
    let _ = writeln!(
        out,
        "  {}, {}; weights {}; for {}",
        count(found.parameters.len(), "free parameter", "free parameters"),
        count(found.problem.priors(), "prior", "priors"),
        found.problem.weights.name(),
        purpose(found.aim)
    );
    if let Some(excess) = found.random_excess.filter(|excess| excess.is_finite()) {
        let _ = writeln!(
            out,
            "  as many rows at random: uncertainty {} times as large (median of {})",
            significant(1.0 + excess, 3),
            crate::design::RANDOM
        );
    }
    targets(&mut out, found, told);
    parameters(&mut out, found);
    if let Some(confirmed) = told.confirmed {
        compared(&mut out, confirmed);
    }
    if found.met() {
        rows(&mut out, found);
    }
    for (measurement, file) in told.files {
        let _ = writeln!(out, "\n{measurement}: {file}");
    }
    out
}

fn confirmation(confirmed: &Confirmation) -> String {
    let runs = count(usize::try_from(confirmed.runs).unwrap_or(usize::MAX), "simulated run", "simulated runs");
    match (confirmed.failed, confirmed.agrees()) {
        (0, true) => format!("Confirmed by {runs}"),
        (0, false) => format!("Not confirmed: {runs} scatter otherwise"),
        (failed, _) => format!("Not confirmed: {failed} of {runs} did not converge"),
    }
}

fn targets(out: &mut String, found: &Design, told: &Told) {
    if found.expected.is_empty() {
        return;
    }
    let real = found.problem.weights.are_real();
    let points = count(found.points, "row", "rows");
    let _ = writeln!(out, "\nTargets over {points} of {}, by the calibration alone", told.volume);
    if !real {
        out.push_str("  weights are unit, so nothing tells how large errors are\n");
        return;
    }
    let random = found.expected.iter().any(|target| target.random.is_some());
    let required = found.expected.iter().any(|target| target.required.is_some());
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Right, Align::Right, Align::Right, Align::Left]);
    let shown = |on: bool, text: &str| if on { text.to_owned() } else { String::new() };
    grid.row([
        String::new(),
        "rms".into(),
        "largest".into(),
        shown(required, "required"),
        shown(random, "at random"),
        String::new(),
    ]);
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| significant(value, 3));
    for Expected { name, unit: symbol, rms, largest, required, random } in &found.expected {
        grid.row([
            name.clone(),
            format!("± {}", significant(*rms, 3)),
            format!("± {}", significant(*largest, 3)),
            optional(*required),
            optional(*random),
            unit(symbol).to_owned(),
        ]);
    }
    out.push_str(&grid.text("  "));
}

fn parameters(out: &mut String, found: &Design) {
    if !found.problem.weights.are_real() {
        return;
    }
    out.push_str("\nParameters, predicted standard uncertainty against tolerance\n");
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Left, Align::Left]);
    for known in &found.parameters {
        let sigma = known.sigma.map_or(String::new(), |sigma| format!("± {}", significant(sigma, 2)));
        let note = match known.sigma {
            None => "not estimable",
            Some(sigma) if sigma > known.tolerance => "weaker than its tolerance",
            Some(_) => "",
        };
        let tolerance = format!("of {}", significant(known.tolerance, 2));
        grid.row([known.name.as_str(), &sigma, &tolerance, unit(&known.unit), note]);
    }
    out.push_str(&grid.text("  "));
}

fn compared(out: &mut String, confirmed: &Confirmation) {
    if confirmed.compared.is_empty() {
        return;
    }
    out.push_str("\nSimulated and fitted: error against prediction, root mean square\n");
    let right = Align::Right;
    let mut grid = Grid::new(&[Align::Left, right, right, Align::Left, right, Align::Left]);
    grid.row(["", "actual", "predicted", "", "ratio", "by chance"]);
    for one in &confirmed.compared {
        let chance = format!("{} to {}", significant(one.range[0], 3), significant(one.range[1], 3));
        let note = if one.agrees() { chance } else { format!("{chance}: not by chance") };
        grid.row([
            one.name.clone(),
            significant(one.actual, 3),
            significant(one.predicted, 3),
            unit(&one.unit).to_owned(),
            significant(one.ratio(), 3),
            note,
        ]);
    }
    out.push_str(&grid.text("  "));
}

/// Keys and inputs of a row: names, and text in reported units.
fn cells(found: &Design, block: &Block, row: usize) -> Vec<String> {
    let units = &found.problem.program.units;
    let keys = (0..block.measurement.keys.len()).map(|key| block.table.key(row, key).to_owned());
    let readings = block.table.row(row);
    let inputs = block.measurement.inputs.iter().zip(readings.iter());
    keys.chain(inputs.map(|(input, value)| format!("{:.4}", units.to_reported(*value, input.unit.dimension)))).collect()
}

fn heads(found: &Design, block: &Block) -> Vec<String> {
    let units = &found.problem.program.units;
    let inputs = block.measurement.inputs.iter().map(|input| {
        let symbol = units.symbol(input.unit.dimension);
        if unit(&symbol).is_empty() { input.name.clone() } else { format!("{} [{symbol}]", input.name) }
    });
    block.measurement.keys.iter().cloned().chain(inputs).collect()
}

/// The chosen rows of each block: their numbers, and those they were made with.
fn chosen_rows<'d>(found: &'d Design) -> impl Iterator<Item = (&'d Block<'d>, Vec<usize>, Vec<usize>)> {
    let all = found.chosen().into_iter();
    all.filter_map(|(block, rows, made)| Some((found.problem.blocks.get(block)?, rows, made)))
}

fn rows(out: &mut String, found: &Design) {
    for (block, rows, made) in chosen_rows(found) {
        if rows.is_empty() {
            continue;
        }
        let more = rows.len().saturating_sub(MOST_ROWS);
        let _ = writeln!(out, "\nRows of {}, inputs at the nominal values", block.measurement.name);
        let heads = heads(found, block);
        let mut grid = Grid::new(&vec![Align::Right; heads.len() + 1]);
        grid.row(std::iter::once("row".to_owned()).chain(heads));
        for (&row, made) in rows.iter().zip(&made).take(MOST_ROWS) {
            grid.row(std::iter::once((made + 1).to_string()).chain(cells(found, block, row)));
        }
        out.push_str(&grid.text("  "));
        if more > 0 {
            let _ = writeln!(out, "  and {more} more");
        }
    }
}

/// A design as JSON.
pub fn design_json(found: &Design, told: &Told) -> Value {
    let real = found.problem.weights.are_real();
    let stated = |value: f64| if real && value.is_finite() { json!(value) } else { Value::Null };
    let finite = |value: f64| if value.is_finite() { json!(value) } else { Value::Null };
    let units = &found.problem.program.units;
    let mut measurements = Map::new();
    for (block, rows, made) in chosen_rows(found) {
        let one = |(&row, &made): (&usize, &usize)| {
            let keys = block.measurement.keys.iter().enumerate();
            let keys = keys.map(|(key, name)| (name.clone(), json!(block.table.key(row, key))));
            let readings = block.table.row(row);
            let inputs = block.measurement.inputs.iter().zip(readings.iter());
            let inputs = inputs
                .map(|(input, value)| (input.name.clone(), json!(units.to_reported(*value, input.unit.dimension))));
            json!({"row": made + 1, "inputs": keys.chain(inputs).collect::<Map<_, _>>()})
        };
        let chosen: Vec<Value> = rows.iter().zip(&made).map(one).collect();
        let name = block.measurement.name.clone();
        measurements.insert(name, json!({"candidates": block.table.rows(), "chosen": chosen}));
    }
    let targets = found.expected.iter().map(|target| {
        json!({
            "name": target.name, "unit": target.unit, "rms": stated(target.rms), "largest": stated(target.largest),
            "required": target.required, "random": target.random.map_or(Value::Null, stated),
        })
    });
    let parameters = found.parameters.iter().map(|known| {
        json!({
            "name": known.name, "unit": known.unit, "sigma": known.sigma.map_or(Value::Null, stated),
            "tolerance": known.tolerance, "estimable": known.sigma.is_some(),
        })
    });
    let confirmed = told.confirmed.map(|confirmed| {
        let compared = confirmed.compared.iter().map(|one| {
            json!({
                "name": one.name, "unit": one.unit, "actual": finite(one.actual), "predicted": finite(one.predicted),
                "ratio": finite(one.ratio()), "low": finite(one.range[0]), "high": finite(one.range[1]), "agrees": one.agrees(),
            })
        });
        json!({
            "runs": confirmed.runs, "failed": confirmed.failed, "agrees": confirmed.agrees(),
            "compared": compared.collect::<Vec<_>>(),
        })
    });
    let weights = found.picked.weights.iter().zip(&found.origin).filter(|(weight, _)| **weight > 0.0);
    let relaxed = weights.filter_map(|(weight, (block, _, made))| {
        let block = found.problem.blocks.get(*block)?;
        Some(json!({"measurement": block.measurement.name, "row": made + 1, "weight": weight}))
    });
    json!({
        "criterion": found.aim.name(),
        "inputs": told.candidates,
        "candidates": found.origin.len(),
        "left_out": found.left_out,
        "picked": found.picked.chosen.len(),
        "measurements": measurements,
        "value": finite(found.picked.value),
        "bound": finite(found.picked.bound),
        "excess": finite(found.picked.excess()),
        "random_excess": found.random_excess.map_or(Value::Null, finite),
        "required": found.reach.map(|reach| json!({"reached": reach.reached, "least": reach.least})),
        "weights": found.problem.weights.name(),
        "free": found.parameters.len(),
        "priors": found.problem.priors(),
        "volume": json!({"inputs": told.volume, "rows": found.points}),
        "targets": targets.collect::<Vec<_>>(),
        "parameters": parameters.collect::<Vec<_>>(),
        "confirmed": confirmed,
        "relaxed": relaxed.collect::<Vec<_>>(),
        "files": told.files.iter().map(|(name, file)| json!({"measurement": name, "file": file})).collect::<Vec<_>>(),
    })
}
