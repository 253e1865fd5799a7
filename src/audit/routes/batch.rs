//! Rows and points at which derivatives are looked at.

use std::sync::Arc;

use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::super::formulas::{POINTS, TRIED};
use super::super::points::{self, nudged, places, simulated};
use super::compare::Residuals;
use crate::compile::{Measurement, Program};
use crate::data::Table;
use crate::diag::Diagnostics;
use crate::problem::{Block, Options, Problem, Selection, Weights};

/// Rows of data that are looked at.
const DATA_ROWS: usize = 4;
/// Points that are tried for a row to have one at which everything is defined.
const TRIED_POINTS: usize = 20;

/// A row at a point, by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    pub(super) block: usize,
    pub(super) row: usize,
    pub(super) point: usize,
}

/// A problem, points of it, and which of its rows are looked at where.
#[derive(Clone, Debug)]
pub(super) struct Batch<'p> {
    pub(super) problem: Problem<'p>,
    pub(super) points: Vec<Vec<f64>>,
    pub(super) samples: Vec<Sample>,
}

impl<'p> Batch<'p> {
    /// Every row at every point.
    pub(super) fn at(problem: &Problem<'p>, points: &[Vec<f64>]) -> Batch<'p> {
        let mut samples = Vec::new();
        for point in 0..points.len() {
            for (block, bound) in problem.blocks.iter().enumerate() {
                samples.extend((0..bound.table.rows()).map(|row| Sample { block, row, point }));
            }
        }
        Batch { problem: problem.clone(), points: points.to_vec(), samples }
    }

    /// The same with all numbers changed in their last digits: what changes with them is rounding.
    pub(super) fn nudged(&self, random: &mut ChaCha8Rng) -> Batch<'p> {
        let mut batch = self.clone();
        batch.points.iter_mut().flatten().for_each(|number| *number = nudged(*number, random));
        for block in &mut batch.problem.blocks {
            block.table = Arc::new(changed(block, |number| nudged(number, random)));
        }
        batch
    }

    /// The rows of a measurement, with everything that it uses free: those that a scenario makes and random ones at a random point
    /// each; the first of them and rows of data at the nominal values or those given.
    ///
    /// # Errors
    /// What is wrong with names or numbers.
    pub(super) fn of(
        program: &'p Program,
        measurement: usize,
        data: Option<&Table>,
        given: &[(String, f64)],
        seed: u64,
    ) -> Result<Batch<'p>, Diagnostics> {
        let declared = &program.measurements[measurement];
        let mut table = drawn(program, measurement, data, seed);
        let made = table.rows();
        for row in 0..data.map_or(0, Table::rows).min(DATA_ROWS) {
            data.iter().for_each(|data| push(&mut table, declared, data, row, |number| number));
        }
        let options = Options {
            weights: Some(Weights::Unit),
            selection: Selection { free: used(program, declared), start: given.to_vec(), ..Selection::default() },
            unconstrained: true,
            ..Options::default()
        };
        let (problem, _) = Problem::bind(program, vec![(measurement, table)], &options)?;
        let block = &problem.blocks[0];
        let rows = block.table.rows();
        let residuals = Residuals::new(declared);
        // not the start of the problem, which bounds may have moved
        let centre: Vec<f64> = problem.layout.coordinates.iter().map(|coordinate| coordinate.nominal).collect();
        let centre = with_values(&problem, centre, given);
        let mut points = vec![centre.clone()];
        let mut samples = vec![Sample { block: 0, row: 0, point: 0 }];
        samples.extend((made..rows).map(|row| Sample { block: 0, row, point: 0 }));
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for row in 0..made {
            let near = |random: &mut ChaCha8Rng| {
                let coordinates = problem.layout.coordinates.iter().zip(&centre);
                coordinates.map(|(known, &value)| points::near(value, known.tolerance, random)).collect::<Vec<f64>>()
            };
            let tried: Vec<Vec<f64>> = (0..TRIED_POINTS).map(|_| near(&mut random)).collect();
            let defined = |point: &&Vec<f64>| residuals.defined_in(&problem, block, row, point);
            let point = tried.iter().find(defined).unwrap_or(&tried[0]);
            samples.push(Sample { block: 0, row, point: points.len() });
            points.push(point.clone());
        }
        Ok(Batch { problem, points, samples })
    }
}

/// Rows that a scenario makes, where one measures this, and as many or all at random.
fn drawn(program: &Program, measurement: usize, data: Option<&Table>, seed: u64) -> Table {
    let declared = &program.measurements[measurement];
    let mut table = Table::new(declared.keys.len(), declared.inputs.len());
    let made = simulated(program, measurement, seed, POINTS / 2);
    // names that differ by column are different members
    let own: Vec<&str> = declared.keys.iter().map(String::as_str).collect();
    let named = made.as_ref().or(data).filter(|named| named.rows() > 0);
    for row in 0..made.as_ref().map_or(0, Table::rows) {
        made.iter().for_each(|made| push(&mut table, declared, made, row, |number| number));
    }
    let (places, residuals) = (places(program, declared), Residuals::new(declared));
    let mut salt = 0;
    while table.rows() < POINTS {
        let mut point = points::random(declared, &places, seed.wrapping_add(salt));
        while salt < TRIED && !residuals.defined(&point.leaves, &point.inputs) {
            salt += 1;
            point = points::random(declared, &places, seed.wrapping_add(salt));
        }
        salt += 1;
        let names = named.map_or(own.clone(), |named| names(named, declared, table.rows() % named.rows()));
        table.put(names, &point.inputs, None);
    }
    table
}

/// The names of a row.
fn names<'t>(table: &'t Table, declared: &Measurement, row: usize) -> Vec<&'t str> {
    (0..declared.keys.len()).map(|key| table.key(row, key)).collect()
}

fn push(to: &mut Table, declared: &Measurement, from: &Table, row: usize, mut change: impl FnMut(f64) -> f64) {
    let readings: Vec<f64> = from.row(row).iter().map(|&number| change(number)).collect();
    to.put(names(from, declared, row), &readings, None);
}

/// The rows of a block with other readings.
fn changed(block: &Block, mut change: impl FnMut(f64) -> f64) -> Table {
    let mut table = Table::new(block.measurement.keys.len(), block.table.width());
    (0..block.table.rows()).for_each(|row| push(&mut table, block.measurement, &block.table, row, &mut change));
    table
}

/// The names of all parameters that a measurement uses.
fn used(program: &Program, declared: &Measurement) -> Vec<String> {
    let name = |parameter: usize| {
        let parameter = &program.parameters[parameter];
        if parameter.family { format!("{}[*]", parameter.name) } else { parameter.name.clone() }
    };
    declared.slots.iter().map(|slot| name(slot.parameter)).collect()
}

/// A point with values in reported units.
fn with_values(problem: &Problem, mut point: Vec<f64>, given: &[(String, f64)]) -> Vec<f64> {
    let units = &problem.program.units;
    for (name, value) in given {
        if let Some(c) = problem.layout.find(name) {
            point[c] = units.to_internal(*value, units.unit(problem.layout.coordinates[c].dimension));
        }
    }
    point
}
