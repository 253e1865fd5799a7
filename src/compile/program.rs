//! What a model is once it is mathematics: parameters with numbers, and one tape for each measurement.
//!
//! Numbers are internal: lengths and times in the model's own units, angles in radians ([`crate::unit::Units`]).

use std::sync::Arc;

use super::constraint::Constraints;
use crate::diag::{Code, Diagnostic, Source, Span};
use crate::graph::{Graph, Scalar, Tape};
use crate::statistics::Loss;
use crate::symbolic::Labels;
use crate::unit::{Dimension, Unit, Units};

/// A compiled model.
#[derive(Clone, Debug)]
pub struct Program {
    /// The model's name.
    pub name: String,
    /// The units in which its numbers are read and reported.
    pub units: Units,
    /// All parameters, free or held, in the order of their declaration.
    pub parameters: Vec<Parameter>,
    /// Names that are constants or ties of chains, which nothing can free.
    pub constants: Vec<String>,
    /// Conditions between the parameters.
    pub constraints: Constraints,
    /// All measurements, in the order of their declaration.
    pub measurements: Vec<Measurement>,
    /// What can be simulated.
    pub scenarios: Vec<Scenario>,
    /// The text it was compiled from, for diagnostics.
    pub source: Arc<Source>,
}

impl Program {
    /// A measurement by its number.
    ///
    /// # Errors
    /// Where there are not as many.
    pub fn measurement(&self, number: usize) -> Result<&Measurement, Box<Diagnostic>> {
        self.measurements.get(number).ok_or_else(|| {
            let all = self.measurements.len();
            let message = format!("there is no measurement number {number}: the model has {all}, counted from 0");
            Box::new(Diagnostic::error(Code::UnknownMeasurement, message))
        })
    }
}

/// The shape of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// one number
    Scalar,
    /// three numbers that add
    Vec3,
    /// a rotation vector; updates R·exp(ω)
    Rotation,
    /// a translation that adds, then a rotation vector
    Pose,
}

impl Shape {
    /// Tangent coordinates, which are as many as the numbers that state its value.
    pub fn dimension(self) -> usize {
        self.suffixes().len()
    }

    /// What follows the parameter's name in the names of its coordinates.
    pub fn suffixes(self) -> &'static [&'static str] {
        match self {
            Shape::Scalar => &[""],
            Shape::Vec3 => &[".x", ".y", ".z"],
            Shape::Rotation => &[".rx", ".ry", ".rz"],
            Shape::Pose => &[".x", ".y", ".z", ".rx", ".ry", ".rz"],
        }
    }

    /// The first of its coordinates that is a rotation's, if any.
    pub fn rotation(self) -> Option<usize> {
        match self {
            Shape::Scalar | Shape::Vec3 => None,
            Shape::Rotation => Some(0),
            Shape::Pose => Some(3),
        }
    }

    /// Numbers that a tape reads for it: its value, and, for a rotation, a perturbation ω that is zero but has the
    /// derivatives.
    pub fn leaves(self) -> usize {
        self.dimension() + if self.rotation().is_some() { 3 } else { 0 }
    }

    /// The leaf by which to differentiate for a coordinate.
    pub fn tangent_leaf(self, coordinate: usize) -> usize {
        match self.rotation() {
            Some(first) if coordinate >= first => coordinate + 3,
            _ => coordinate,
        }
    }
}

/// Whether a parameter is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// estimated
    Free,
    /// held at its value, until released
    Held,
}

/// The numbers of a parameter, or of one member of a family, one for each coordinate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting {
    /// estimated or held
    pub roles: Vec<Role>,
    /// where to start, and the centre of the prior
    pub nominal: Vec<f64>,
    /// hard lower bounds, −∞ where there is none
    pub min: Vec<f64>,
    /// hard upper bounds, ∞ where there is none
    pub max: Vec<f64>,
    /// standard deviations of the prior, where there is one
    pub sigma: Vec<Option<f64>>,
    /// what counts as known well enough
    pub tolerance: Vec<f64>,
}

impl Setting {
    /// Whether a coordinate is estimated.
    pub fn is_free(&self, coordinate: usize) -> bool {
        self.roles.get(coordinate) == Some(&Role::Free)
    }

    /// Whether any coordinate is estimated.
    pub fn has_free(&self) -> bool {
        self.roles.contains(&Role::Free)
    }
}

/// A declared parameter or family of parameters.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// `L1.alpha`, `target`, `socket`
    pub name: String,
    /// scalar, vector, rotation, pose
    pub shape: Shape,
    /// of each coordinate
    pub dimensions: Vec<Dimension>,
    /// the parameter's, and that of family members which are not named
    pub setting: Setting,
    /// whether there is one member for each key
    pub family: bool,
    /// members with a setting of their own
    pub members: Vec<(String, Setting)>,
    /// where it is declared
    pub span: Span,
}

impl Parameter {
    /// The setting of a member.
    pub fn member(&self, key: &str) -> &Setting {
        self.members.iter().find(|(name, _)| name == key).map_or(&self.setting, |(_, setting)| setting)
    }
}

/// A parameter as one measurement uses it. Its leaves are numbered from `first_leaf`.
#[derive(Clone, Debug)]
pub struct Slot {
    /// which parameter
    pub parameter: usize,
    /// the key columns that choose the member, for a family
    pub keys: Vec<usize>,
    /// the number of its first leaf on the measurement's tapes
    pub first_leaf: usize,
}

/// A standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sigma {
    /// the same for all rows
    Constant(f64),
    /// a node of the measurement's graph, which inputs decide
    PerRow(Scalar),
}

impl Sigma {
    /// Where it is the same for all rows.
    pub fn constant(self) -> Option<f64> {
        match self {
            Sigma::Constant(sigma) => Some(sigma),
            Sigma::PerRow(_) => None,
        }
    }
}

/// A column of readings.
#[derive(Clone, Debug)]
pub struct Input {
    /// the column's name
    pub name: String,
    /// the column's unit
    pub unit: Unit,
    /// whether the column holds degrees-minutes-seconds
    pub dms: bool,
    /// standard deviation of a reading, where it is measured
    pub sigma: Option<Sigma>,
    /// subtracted from a reading
    pub bias: f64,
    /// its value where there is no such column
    pub default: Option<f64>,
    /// what its errors have in common with those of others: as declared, or else what it measures
    pub group: String,
}

/// What large residuals count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robust {
    /// its kernel and tuning constant
    pub loss: Loss,
    /// of what it is a function
    pub of: LossOf,
    /// whether the scale of the residuals is estimated from their middle
    pub estimated: bool,
}

/// Of what a loss is a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LossOf {
    /// the length of a row's whitened residuals
    Row,
    /// each corrected input, in its standard deviations
    Input,
}

/// One scalar that should be zero.
#[derive(Clone, Debug)]
pub struct Residual {
    /// `vo.x`, `kci1`
    pub name: String,
    /// what it measures
    pub dimension: Dimension,
    /// its standard deviation, where declared
    pub sigma: Option<Sigma>,
    /// where its expression stands
    pub span: Span,
}

/// One scalar of a derived quantity.
#[derive(Clone, Debug)]
pub struct Output {
    /// `p1.x`
    pub name: String,
    /// what it measures
    pub dimension: Dimension,
    /// where its expression stands, in the model or on the command line
    pub place: (Arc<Source>, Span),
}

/// A measurement: columns, parameters used, and what should vanish.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// its name
    pub name: String,
    /// columns of names
    pub keys: Vec<String>,
    /// columns of readings
    pub inputs: Vec<Input>,
    /// the sigmas of inputs that differ by row, over inputs
    pub sigma_tape: Tape,
    /// the correlations of the errors of the inputs that have a sigma, where there are any: row by row of these inputs
    pub correlations: Option<Vec<Vec<f64>>>,
    /// what large residuals count
    pub robust: Option<Robust>,
    /// the parameters it uses, for both tapes
    pub slots: Vec<Slot>,
    /// how many leaves the slots have
    pub leaves: usize,
    /// what should be zero, in the order of the tape's outputs
    pub residuals: Vec<Residual>,
    /// all that the measurement says, over leaves and inputs
    pub graph: Arc<Graph>,
    /// what the model calls the nodes of the graph
    pub labels: Labels,
    /// the residuals as nodes of the graph
    pub equations: Vec<Scalar>,
    /// the residuals over leaves and inputs
    pub tape: Tape,
    /// derived quantities, in the order of their tape's outputs
    pub outputs: Vec<Output>,
    /// the derived quantities as nodes of the graph
    pub derived: Vec<Scalar>,
    /// the derived quantities over leaves and inputs
    pub output_tape: Tape,
    /// where its data are, as the model says
    pub data: Vec<crate::model::DataFile>,
    /// where its name stands
    pub span: Span,
}

/// How a number is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Distribution {
    /// always this
    Constant(f64),
    /// evenly between two bounds
    Uniform(f64, f64),
    /// normally, by mean and standard deviation
    Normal(f64, f64),
    /// normally around the nominal value, by standard deviation: what is drawn is added to it
    Around(f64),
    /// one after the other, again and again
    Cycle(Vec<f64>),
    /// any of them
    Choice(Vec<f64>),
    /// drawn for so many rows at a time, at least one
    Each(usize, Box<Distribution>),
}

/// How a name is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum KeyDistribution {
    /// one after the other, again and again
    Cycle(Vec<String>),
    /// any of them
    Choice(Vec<String>),
    /// drawn for so many rows at a time, at least one
    Each(usize, Box<KeyDistribution>),
}

/// A declared simulation.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// its name
    pub name: String,
    /// the seed of its random numbers, unless another is given
    pub seed: u64,
    /// true values that differ from the nominal ones, by coordinate name
    pub truth: Vec<(String, Distribution)>,
    /// what is measured in it
    pub measurements: Vec<Simulation>,
}

/// How the rows of one measurement come about.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// which measurement
    pub measurement: usize,
    /// how many rows, unless another number is given
    pub rows: usize,
    /// names drawn, by key column
    pub keys: Vec<(usize, KeyDistribution)>,
    /// numbers drawn, by variable: first the measurement's inputs, then auxiliary ones
    pub draws: Vec<(usize, Distribution)>,
    /// how many variables there are
    pub variables: usize,
    /// the parameters used
    pub slots: Vec<Slot>,
    /// how many leaves they have
    pub leaves: usize,
    /// what is computed or solved for, in an order that works
    pub steps: Vec<Step>,
    /// mean and standard deviation of what is added to each input at the end
    pub noise: Vec<(f64, Option<Sigma>)>,
    /// where it is declared
    pub span: Span,
}

/// One step towards the inputs of a simulated row.
#[derive(Clone, Debug)]
pub enum Step {
    /// an input by its formula, the tape's only output
    Set {
        /// the variable
        variable: usize,
        /// its formula
        tape: Tape,
    },
    /// inputs that make all outputs of the tape vanish
    Solve {
        /// the variables
        unknowns: Vec<usize>,
        /// where to start
        start: Vec<f64>,
        /// where to start as an output for each, where that depends on the row
        from: Option<Tape>,
        /// whether each is an angle, and so is brought into (−π, π]
        angles: Vec<bool>,
        /// what should vanish
        tape: Tape,
    },
}
