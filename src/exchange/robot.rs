//! What an import finds in a file, whatever its format.

use super::serial::{Joint, Kind, Serial};

/// Between which numbers a joint moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// From here.
    pub min: f64,
    /// Up to here.
    pub max: f64,
}

impl Limits {
    /// Whether they leave something between them, and are finite.
    pub fn are_useful(&self) -> bool {
        self.min < self.max && self.min.is_finite() && self.max.is_finite()
    }
}

/// How a joint moves with what is read: *multiplier·reading + offset*.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The joint whose reading it is: its own name, or that of the joint it mimics.
    pub of: String,
    /// How that joint moves.
    pub kind: Kind,
    /// The limits of the reading; equal where none are known.
    pub limits: Limits,
    /// How often it counts.
    pub multiplier: f64,
    /// What is added.
    pub offset: f64,
}

impl Reading {
    /// A joint with a reading of its own.
    pub fn of_joint(joint: &Joint, limits: Limits) -> Reading {
        Reading { of: joint.name.clone(), kind: joint.kind, limits, multiplier: 1.0, offset: 0.0 }
    }
}

/// A robot as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// The kind of file, and its units, in words.
    pub source: String,
    /// Its geometry: lengths in `length`, angles in radians.
    pub serial: Serial<f64>,
    /// By moving joint.
    pub readings: Vec<Reading>,
    /// The symbol of the unit of lengths.
    pub length: String,
    /// The symbol of the unit in which angles are read.
    pub angle: String,
}
