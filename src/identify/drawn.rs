//! Inputs of a declared kind, where neither data nor a scenario say what they are.

use std::f64::consts::PI;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::compile::{Measurement, Program, Slot};
use crate::data::Table;
use crate::diag::{Code, Diagnostic};
use crate::simulate::MOST_READINGS;
use crate::unit::{Base, Dimension};

/// Angles are drawn evenly up to this, in radians, to either side of zero.
pub const ANGLES: f64 = PI;
/// Lengths, and numbers of any other kind, are drawn evenly up to this many times the largest nominal value of their kind among
/// the parameters, to either side of zero; up to 1 where there is none.
pub const LENGTHS: f64 = 1.5;
/// Made-up members of a family without declared ones.
const MEMBERS: [&str; 3] = ["m1", "m2", "m3"];
/// Equations per coordinate.
const EQUATIONS: usize = 6;
const LEAST_ROWS: usize = 40;
const MOST_ROWS: usize = 2000;

/// What the rows of a measurement may hold, where neither data nor a scenario say what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranges {
    /// The names of each key column.
    pub keys: Vec<Vec<String>>,
    /// For each input, in internal units: the middle of its range, and how far this goes to either side. An input with a default
    /// stays there.
    pub inputs: Vec<(f64, f64)>,
}

impl Ranges {
    /// Of a measurement.
    pub fn of(program: &Program, measurement: &Measurement) -> Ranges {
        let largest = |dimension: Dimension| {
            let all = program.parameters.iter().flat_map(|p| p.dimensions.iter().zip(&p.setting.nominal));
            let all = all.filter(|(d, _)| **d == dimension);
            let found = all.fold(0.0, |most: f64, (_, nominal)| most.max(nominal.abs()));
            if found > 0.0 { LENGTHS * found } else { 1.0 }
        };
        let range = |input: &crate::compile::Input| match input.default {
            Some(default) => (default, 0.0),
            None if input.unit.dimension == Dimension::of(Base::Angle) => (0.0, ANGLES),
            None => (0.0, largest(input.unit.dimension)),
        };
        Ranges {
            keys: (0..measurement.keys.len()).map(|key| names(program, &measurement.slots, key)).collect(),
            inputs: measurement.inputs.iter().map(range).collect(),
        }
    }
}

/// Tables for all measurements that have inputs or keys.
///
/// # Errors
/// Where more rows are asked for than a scenario makes.
pub(super) fn drawn(
    program: &Program,
    rows: &[(usize, usize)],
    seed: u64,
) -> Result<Vec<(usize, Table)>, Box<Diagnostic>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let coordinates: usize = program.parameters.iter().map(|p| p.dimensions.len() * (1 + p.members.len())).sum();
    let mut tables = Vec::new();
    for (index, measurement) in program.measurements.iter().enumerate() {
        let given = rows.iter().rev().find(|(of, _)| *of == index).map(|(_, rows)| *rows);
        let needed =
            (EQUATIONS * coordinates).div_ceil(measurement.residuals.len().max(1)).clamp(LEAST_ROWS, MOST_ROWS);
        let Ranges { keys, inputs } = Ranges::of(program, measurement);
        let alone = measurement.inputs.is_empty() && keys.is_empty();
        let count = given.unwrap_or(if alone { 1 } else { needed });
        let cells = (keys.len() + inputs.len()).max(1);
        if count.checked_mul(cells).is_none_or(|cells| cells > MOST_READINGS) {
            let message = format!("{count} rows of `{}` are too many", measurement.name);
            return Err(Box::new(Diagnostic::error(Code::TooLarge, message).at(&program.source, measurement.span)));
        }
        let mut table = Table::new(keys.len(), inputs.len());
        for _ in 0..count {
            let chosen: Vec<&str> =
                keys.iter().map(|all| all[random.random_range(0..all.len() as u64) as usize].as_str()).collect();
            let readings = inputs.iter().map(|(middle, range)| middle + (2.0 * random.random::<f64>() - 1.0) * range);
            let readings: Vec<f64> = readings.collect();
            table.put(chosen, &readings, None);
        }
        if table.rows() > 0 {
            tables.push((index, table));
        }
    }
    Ok(tables)
}

/// What a key column may hold: the parts of members that are declared or named by constraints, else made-up names.
fn names(program: &Program, slots: &[Slot], key: usize) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for slot in slots {
        let Some(place) = slot.keys.iter().position(|of| *of == key) else { continue };
        let declared = program.parameters[slot.parameter].members.iter().map(|(member, _)| member);
        let constrained = program.constraints.slots.iter().filter(|other| other.parameter == slot.parameter);
        for member in declared.chain(constrained.filter_map(|other| other.member.as_ref())) {
            if let Some(part) = member.split('/').nth(place)
                && !all.iter().any(|known| known == part)
            {
                all.push(part.to_owned());
            }
        }
    }
    if all.is_empty() { MEMBERS.map(str::to_owned).to_vec() } else { all }
}
