//! What a model with given values says of data: statistics of the residuals, derived outputs row by row with their
//! uncertainty, and the Jacobian.
//!
//! Everything is in reported units. A vector residual `miss` is counted twice: by components `miss.x .y .z`, and by its
//! length, for consistency is quoted as the root mean square of distances.

#![allow(
    clippy::indexing_slicing,
    reason = "coordinates and outputs are numbered by the problem; points from outside are checked by it first"
)]

mod estimated;
mod jacobian;
mod members;
mod statistics;
mod uncertainty;

pub use estimated::{Estimated, Why};
pub use jacobian::{Jacobian, jacobians};
pub use members::{Members, unseen};
pub use statistics::Statistics;
pub use uncertainty::{COVERAGE, Gap, MOST_COVARIANCES, Uncertainties, Uncertainty, uncertainties};

use crate::compile::Role;
use crate::problem::{Block, Problem, Quantities, Undefined};
use statistics::Running;

/// What the values say of all data.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// By measurement, in declared order; those without data are left out.
    pub measurements: Vec<Evaluated>,
}

/// What they say of one measurement.
#[derive(Clone, Debug)]
pub struct Evaluated {
    /// Its name.
    pub name: String,
    /// How many rows it has.
    pub rows: usize,
    /// Each scalar residual.
    pub residuals: Vec<(String, String, Statistics)>,
    /// The residuals of every row, in reported units.
    pub residual_values: Vec<Vec<f64>>,
    /// The length of each vector residual, by its name without suffix.
    pub vectors: Vec<(String, String, Statistics)>,
    /// Each key column, and its name in each row.
    pub keys: Vec<(String, Vec<String>)>,
    /// Derived quantities.
    pub outputs: Vec<Column>,
}

/// One scalar of a derived quantity.
#[derive(Clone, Debug)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value in each row.
    pub values: Vec<f64>,
    /// Over all rows.
    pub statistics: Statistics,
}

/// The point that values in reported units give: theirs, even where they leave the bounds of a fit, and elsewhere the start.
pub fn point(problem: &Problem, given: &[(String, f64)]) -> Vec<f64> {
    let mut point = problem.start.clone();
    let units = &problem.program.units;
    for (name, value) in given {
        if let Some(c) = problem.layout.find(name)
            && problem.layout.coordinates[c].role == Role::Free
        {
            point[c] = units.to_internal(*value, units.unit(problem.layout.coordinates[c].dimension));
        }
    }
    point
}

/// Evaluates all residuals and outputs of a problem at a point.
///
/// # Errors
/// The first row where something is undefined.
pub fn evaluate(problem: &Problem, point: &[f64]) -> Result<Evaluation, Undefined> {
    let measurements = problem.blocks.iter().map(|block| of_block(problem, block, point)).collect::<Result<_, _>>()?;
    Ok(Evaluation { measurements })
}

fn of_block(problem: &Problem, block: &Block, point: &[f64]) -> Result<Evaluated, Undefined> {
    let measurement = block.measurement;
    let units = &problem.program.units;
    let rows = block.table.rows();
    let triples = triples(measurement);
    let mut each = vec![Running::default(); measurement.residuals.len()];
    let mut residual_values = vec![vec![0.0; rows]; measurement.residuals.len()];
    let mut lengths = vec![Running::default(); triples.len()];
    block.values(Quantities::Residuals, &problem.layout, point, |row, values| {
        for (running, &value) in each.iter_mut().zip(values) {
            running.push(row, value);
        }
        for ((column, &value), residual) in residual_values.iter_mut().zip(values).zip(&measurement.residuals) {
            column[row] = units.to_reported(value, residual.dimension);
        }
        for (running, (_, first)) in lengths.iter_mut().zip(&triples) {
            running.push(row, values[*first].hypot(values[first + 1]).hypot(values[first + 2]));
        }
    })?;
    let named = |name: &str, of: usize, running: &Running| {
        let dimension = measurement.residuals[of].dimension;
        let statistics = running.statistics(|value| units.to_reported(value, dimension));
        (name.to_owned(), units.symbol(dimension), statistics)
    };
    let residuals = each.iter().enumerate().map(|(i, running)| named(&measurement.residuals[i].name, i, running));
    let vectors = lengths.iter().zip(&triples).map(|(running, (name, first))| named(name, *first, running));
    let (residuals, vectors) = (residuals.collect(), vectors.collect());

    let mut values = vec![vec![0.0; rows]; measurement.outputs.len()];
    if !values.is_empty() {
        block.values(Quantities::Outputs, &problem.layout, point, |row, found| {
            for ((column, &value), output) in values.iter_mut().zip(found).zip(&measurement.outputs) {
                column[row] = units.to_reported(value, output.dimension);
            }
        })?;
    }
    let outputs = values.into_iter().zip(&measurement.outputs).map(|(values, output)| {
        let mut running = Running::default();
        values.iter().enumerate().for_each(|(row, &value)| running.push(row, value));
        let statistics = running.statistics(|value| value);
        Column { name: output.name.clone(), unit: units.symbol(output.dimension), values, statistics }
    });
    let key = |k: usize| (0..rows).map(|row| block.table.key(row, k).to_owned()).collect();
    Ok(Evaluated {
        name: measurement.name.clone(),
        rows,
        residuals,
        residual_values,
        vectors,
        keys: measurement.keys.iter().enumerate().map(|(k, name)| (name.clone(), key(k))).collect(),
        outputs: outputs.collect(),
    })
}

/// The vector residuals: their names, and the number of their first component.
fn triples(measurement: &crate::compile::Measurement) -> Vec<(String, usize)> {
    let names: Vec<&str> = measurement.residuals.iter().map(|residual| residual.name.as_str()).collect();
    let starts = |(first, window): (usize, &[&str])| {
        let base = window[0].strip_suffix(".x")?;
        let is = |name: &str, suffix| name.strip_suffix(suffix) == Some(base);
        (is(window[1], ".y") && is(window[2], ".z")).then(|| (base.to_owned(), first))
    };
    names.windows(3).enumerate().filter_map(starts).collect()
}
