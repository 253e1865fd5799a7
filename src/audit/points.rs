//! Points of parameters and inputs at which formulas are compared.

use std::f64::consts::PI;

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::compile::{Measurement, Program};
use crate::data::Table;
use crate::simulate::{Options, simulate};
use crate::unit::{Base, Dimension};

/// Parameters lie this far from their nominal values, to either side: in sizes of the value, and in tolerances.
const SPREAD: (f64, f64) = (0.05, 300.0);
/// Inputs that are not angles lie up to this many times the largest nominal value of their kind from zero.
const RANGE: f64 = 1.5;

/// Numbers for all leaves of a measurement, in internal units.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Of its parameters; perturbations of rotations are zero.
    pub leaves: Vec<f64>,
    /// Of its inputs.
    pub inputs: Vec<f64>,
}

/// A leaf that may be given another value: its name, its place, what it measures, its nominal value.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) name: String,
    /// of a parameter's leaf, or of an input
    pub(super) leaf: Result<usize, usize>,
    pub(super) dimension: Dimension,
    pub(super) nominal: f64,
    tolerance: f64,
}

impl Point {
    pub(super) fn get(&self, place: &Place) -> f64 {
        match place.leaf {
            Ok(leaf) => self.leaves[leaf],
            Err(input) => self.inputs[input],
        }
    }

    pub(super) fn set(&mut self, place: &Place, value: f64) {
        match place.leaf {
            Ok(leaf) => self.leaves[leaf] = value,
            Err(input) => self.inputs[input] = value,
        }
    }
}

/// Every leaf of a measurement that has a value of its own.
pub(super) fn places(program: &Program, measurement: &Measurement) -> Vec<Place> {
    let mut all = Vec::new();
    for slot in &measurement.slots {
        let parameter = &program.parameters[slot.parameter];
        let keys: Vec<&str> = slot.keys.iter().filter_map(|&k| measurement.keys.get(k)).map(String::as_str).collect();
        let name =
            if keys.is_empty() { parameter.name.clone() } else { format!("{}[{}]", parameter.name, keys.join(", ")) };
        for (i, suffix) in parameter.shape.suffixes().iter().enumerate() {
            all.push(Place {
                name: format!("{name}{suffix}"),
                leaf: Ok(slot.first_leaf + i),
                dimension: parameter.dimensions[i],
                nominal: parameter.setting.nominal[i],
                tolerance: parameter.setting.tolerance[i],
            });
        }
    }
    for (i, input) in measurement.inputs.iter().enumerate() {
        all.push(Place {
            name: input.name.clone(),
            leaf: Err(i),
            dimension: input.unit.dimension,
            nominal: input.default.unwrap_or(0.0),
            tolerance: 0.0,
        });
    }
    all
}

/// The nominal values of the parameters, and inputs at their defaults.
fn nominal(measurement: &Measurement, places: &[Place]) -> Point {
    let mut point = Point { leaves: vec![0.0; measurement.leaves], inputs: vec![0.0; measurement.inputs.len()] };
    places.iter().for_each(|place| point.set(place, place.nominal));
    point
}

/// A value of a parameter near to another one.
pub(super) fn near(value: f64, tolerance: f64, random: &mut ChaCha8Rng) -> f64 {
    value + (2.0 * random.random::<f64>() - 1.0) * (SPREAD.0 * value.abs() + SPREAD.1 * tolerance)
}

/// A number that differs in its last digits.
pub(super) fn nudged(value: f64, random: &mut ChaCha8Rng) -> f64 {
    value * (1.0 + f64::EPSILON * f64::from(random.random_range(-4..=4_i32)))
}

/// A random point.
pub(super) fn random(measurement: &Measurement, places: &[Place], seed: u64) -> Point {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut point = nominal(measurement, places);
    for place in places {
        let mut share = || 2.0 * random.random::<f64>() - 1.0;
        let value = match place.leaf {
            Ok(_) => near(place.nominal, place.tolerance, &mut random),
            Err(input) if measurement.inputs[input].default.is_some() => {
                place.nominal + 0.1 * share() * largest(places, place)
            }
            Err(_) if place.dimension == Dimension::of(Base::Angle) => share() * PI,
            Err(_) => share() * RANGE * largest(places, place),
        };
        point.set(place, value);
    }
    point
}

/// Rows of a scenario without errors, where one measures this: as many or fewer.
pub(super) fn simulated(program: &Program, measurement: usize, seed: u64, count: usize) -> Option<Table> {
    program.scenarios.iter().find_map(|scenario| {
        scenario.measurements.iter().find(|simulation| simulation.measurement == measurement)?;
        let options = Options { rows: vec![(measurement, count)], seed: Some(seed), exact: true };
        let made = simulate(program, scenario, &options).ok()?;
        made.tables.into_iter().find(|(of, _)| *of == measurement).map(|(_, table)| table)
    })
}

/// Points with the inputs of a scenario without errors, where one measures this, and parameters about their nominal values.
pub(super) fn measured(program: &Program, measurement: usize, places: &[Place], seed: u64, count: usize) -> Vec<Point> {
    let declared = &program.measurements[measurement];
    let Some(table) = simulated(program, measurement, seed, count) else { return Vec::new() };
    let of_row = |row: usize| {
        let mut point = random(declared, places, seed.wrapping_add(row as u64));
        point.inputs.copy_from_slice(&table.row(row));
        point
    };
    (0..table.rows().min(count)).map(of_row).collect()
}

/// The largest nominal value of a kind; 1 where all are zero.
fn largest(places: &[Place], like: &Place) -> f64 {
    let alike = places.iter().filter(|place| place.dimension == like.dimension);
    let found = alike.fold(0.0, |most: f64, place| most.max(place.nominal.abs()));
    if found > 0.0 { found } else { 1.0 }
}
