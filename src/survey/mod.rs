//! What the rows of a fit look like, as columns to draw: readings, their corrections, what is derived, and what should vanish, before
//! and after; and the instrument itself, as a [`Scene`].
//!
//! Of very many rows, every k-th is kept: figures bin them anyway.

mod bins;
mod depends;
mod placed;
mod scene;

pub use bins::{Density, Histogram, Span};
pub use depends::{Dependence, Group, dependence};
pub use scene::{Chain, Frame, Point, Scene, Shot, scene};

use crate::compile::{Input, Measurement};
use crate::data::Buffer;
use crate::problem::{Block, Observed, Problem, Quantities, Undefined};
use crate::unit::{Dimension, Units};

/// Rows of a measurement of which columns are kept.
pub const MOST_ROWS: usize = 100_000;

/// Seconds of arc in a radian.
const ARCSEC: f64 = 180.0 * 3600.0 / std::f64::consts::PI;

/// A column of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// `hzL1`, `p1.x`
    pub name: String,
    /// Its unit; empty for a plain number.
    pub unit: String,
    /// By row that is kept.
    pub values: Vec<f64>,
}

/// A residual with the declared values of the parameters, and with those of the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// With the fit's.
    pub after: Series,
    /// With the declared ones; none where something is undefined with these.
    pub before: Option<Vec<f64>>,
}

/// What a fit corrects a reading by.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// The reading; angles in seconds of arc.
    pub corrections: Series,
    /// The declared standard deviation of its error, where that is the same for all rows.
    pub sigma: Option<f64>,
    /// The group of its errors.
    pub group: String,
}

/// The rows of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Surveyed {
    /// Its name.
    pub name: String,
    /// How many rows take part.
    pub rows: usize,
    /// The numbers of the rows that are kept, from zero.
    pub kept: Vec<usize>,
    /// Readings.
    pub inputs: Vec<Series>,
    /// What readings are corrected by; nothing where weights correct nothing.
    pub corrections: Vec<Correction>,
    /// Derived quantities.
    pub outputs: Vec<Series>,
    /// What should vanish.
    pub residuals: Vec<Compared>,
}

/// The rows of a problem at two points: with the declared values of the free parameters, and after the fit.
///
/// # Errors
/// Where rows cannot be read, or something is undefined after the fit.
pub fn survey(problem: &Problem, after: &[f64]) -> Result<Vec<Surveyed>, Undefined> {
    let before = declared(problem, after);
    let mut all: Vec<Surveyed> = Vec::with_capacity(problem.blocks.len());
    for block in &problem.blocks {
        all.push(of_block(problem, block, &before, after)?);
    }
    corrections(problem, after, &mut all)?;
    Ok(all)
}

/// The point with the declared values of the free coordinates; what is held stays where it is.
fn declared(problem: &Problem, point: &[f64]) -> Vec<f64> {
    let free = |c: usize| problem.free.contains(&c);
    let value = |(c, (&at, of)): (usize, (&f64, &crate::problem::Coordinate))| if free(c) { of.nominal } else { at };
    point.iter().zip(&problem.layout.coordinates).enumerate().map(value).collect()
}

/// The rows of a block that are kept.
fn kept(block: &Block) -> (usize, Vec<usize>) {
    let taking_part = || (0..block.table.rows()).filter(|&row| !block.excludes(row));
    let rows = taking_part().count();
    let every = rows.div_ceil(MOST_ROWS).max(1);
    (rows, taking_part().step_by(every).collect())
}

/// Takes the values of rows that are kept, as they come by.
struct Columns<'a> {
    wanted: std::iter::Peekable<std::slice::Iter<'a, usize>>,
    columns: Vec<Vec<f64>>,
    factors: Vec<f64>,
}

impl<'a> Columns<'a> {
    fn new(kept: &'a [usize], factors: Vec<f64>) -> Self {
        let columns = vec![Vec::with_capacity(kept.len()); factors.len()];
        Columns { wanted: kept.iter().peekable(), columns, factors }
    }

    fn take(&mut self, row: usize, values: &[f64]) {
        if self.wanted.next_if(|&&wanted| wanted == row).is_some() {
            for ((column, value), factor) in self.columns.iter_mut().zip(values).zip(&self.factors) {
                column.push(value * factor);
            }
        }
    }
}

fn of_block(problem: &Problem, block: &Block, before: &[f64], after: &[f64]) -> Result<Surveyed, Undefined> {
    let measurement = block.measurement;
    let units = &problem.program.units;
    let (rows, kept) = kept(block);
    let reported = |dimension: Dimension| units.to_reported(1.0, dimension);
    let series = |name: &str, dimension: Dimension, values: Vec<f64>| Series {
        name: name.to_owned(),
        unit: plain(units.symbol(dimension)),
        values,
    };
    let values = |what: Quantities, point: &[f64], factors: Vec<f64>| -> Result<Vec<Vec<f64>>, Undefined> {
        let mut columns = Columns::new(&kept, factors);
        if !columns.factors.is_empty() {
            block.values(what, &problem.layout, point, |row, values| columns.take(row, values))?;
        }
        Ok(columns.columns)
    };
    let of_residuals: Vec<f64> = measurement.residuals.iter().map(|of| reported(of.dimension)).collect();
    let of_outputs: Vec<f64> = measurement.outputs.iter().map(|of| reported(of.dimension)).collect();
    let residuals = values(Quantities::Residuals, after, of_residuals.clone())?;
    let were = values(Quantities::Residuals, before, of_residuals).ok();
    let outputs = values(Quantities::Outputs, after, of_outputs).unwrap_or_default();
    let mut were = were.into_iter().flatten();
    let residuals = measurement
        .residuals
        .iter()
        .zip(residuals)
        .map(|(of, values)| Compared { after: series(&of.name, of.dimension, values), before: were.next() });
    let outputs = measurement.outputs.iter().zip(outputs).map(|(of, values)| series(&of.name, of.dimension, values));
    let read = readings(block, &kept, measurement.inputs.iter().map(|of| reported(of.unit.dimension)).collect())?;
    let inputs = measurement.inputs.iter().zip(read).map(|(of, values)| series(&of.name, of.unit.dimension, values));
    Ok(Surveyed {
        name: measurement.name.clone(),
        rows,
        inputs: inputs.collect(),
        corrections: Vec::new(),
        outputs: outputs.collect(),
        residuals: residuals.collect(),
        kept,
    })
}

/// The readings of the rows that are kept, by input.
fn readings(block: &Block, kept: &[usize], factors: Vec<f64>) -> Result<Vec<Vec<f64>>, Undefined> {
    /// rows read at once
    const PIECE: usize = 4096;
    let mut columns = Columns::new(kept, factors);
    let mut buffer = Buffer::default();
    for first in (0..block.table.rows()).step_by(PIECE) {
        let piece = first..block.table.rows().min(first + PIECE);
        let rows = block.table.read(piece, &mut buffer);
        let rows = rows.map_err(|error| Undefined(Box::new(crate::data::Table::unreadable(&error))))?;
        for i in 0..rows.len() {
            columns.take(first + i, rows.row(i));
        }
    }
    Ok(columns.columns)
}

/// What measured readings are corrected by.
fn corrections(problem: &Problem, point: &[f64], all: &mut [Surveyed]) -> Result<(), Undefined> {
    let measured = |block: usize| -> Vec<usize> {
        let input = |observed: &Observed| match observed {
            Observed::Input(input) => Some(*input),
            Observed::Residual(_) => None,
        };
        problem.observations(block).iter().filter_map(input).collect()
    };
    let inputs: Vec<Vec<usize>> = (0..problem.blocks.len()).map(measured).collect();
    if inputs.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let units = &problem.program.units;
    let mut columns: Vec<Columns> = Vec::new();
    let kept: Vec<Vec<usize>> = all.iter().map(|of| of.kept.clone()).collect();
    for ((block, inputs), kept) in problem.blocks.iter().zip(&inputs).zip(&kept) {
        let factors =
            inputs.iter().filter_map(|&input| shown(units, block.measurement, input)).map(|(_, factor, _)| factor);
        columns.push(Columns::new(kept, factors.collect()));
    }
    problem.inspect(point, |row| {
        if let (Some(columns), Some(inputs)) = (columns.get_mut(row.block), inputs.get(row.block)) {
            let moved = |&input: &usize| row.corrected.get(input).zip(row.read.get(input)).map(|(at, read)| at - read);
            let moved: Vec<f64> = inputs.iter().filter_map(moved).collect();
            columns.take(row.row, &moved);
        }
    })?;
    for (((of, block), inputs), columns) in all.iter_mut().zip(&problem.blocks).zip(&inputs).zip(columns) {
        let found = inputs.iter().filter_map(|&input| shown(units, block.measurement, input)).zip(columns.columns);
        of.corrections = found
            .map(|((input, factor, unit), values)| Correction {
                corrections: Series { name: input.name.clone(), unit, values },
                sigma: input.sigma.and_then(crate::compile::Sigma::constant).map(|sigma| sigma * factor),
                group: input.group.clone(),
            })
            .collect();
    }
    Ok(())
}

/// An input, and the unit in which its corrections are shown: a factor from internal units, and a symbol.
fn shown<'m>(units: &Units, of: &'m Measurement, input: usize) -> Option<(&'m Input, f64, String)> {
    let input = of.inputs.get(input)?;
    let dimension = input.unit.dimension;
    Some(match dimension == Dimension::ANGLE {
        true => (input, ARCSEC, "arcsec".to_owned()),
        false => (input, units.to_reported(1.0, dimension), plain(units.symbol(dimension))),
    })
}

/// A plain number has no unit to show.
fn plain(symbol: String) -> String {
    if symbol == "1" { String::new() } else { symbol }
}
