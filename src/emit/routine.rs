//! What is written for one measurement: its arguments, and its functions as one graph of scalar operations.

use super::line::Line;
use super::point::Point;
use crate::graph::{Graph, NodeId};
use crate::unit::{Dimension, Units};

/// A number of an argument or a result.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// `L1.alpha`, `hzL1`, `socket[hole].x`, `vo.z`
    pub name: String,
    /// Its unit, `1` where it has none.
    pub unit: String,
    pub(super) dimension: Dimension,
}

impl Number {
    pub(super) fn new(name: String, dimension: Dimension, units: &Units) -> Number {
        Number { name, unit: units.symbol(dimension), dimension }
    }
}

/// The functions of one measurement.
#[derive(Clone, Debug)]
pub struct Routine {
    /// The measurement's name.
    pub measurement: String,
    /// What `q` holds: the free parameters of the model in declared order, and all three numbers of a rotation that is free in
    /// part.
    pub parameters: Vec<Number>,
    /// The columns of ∂r/∂q, as numbers of parameters: those that are free.
    pub columns: Vec<usize>,
    /// What `x` holds: the inputs.
    pub inputs: Vec<Number>,
    /// What `m` holds: the members of families that the row names.
    pub members: Vec<Number>,
    /// The columns of ∂r/∂m, as numbers of members: those that are free.
    pub member_columns: Vec<usize>,
    /// What `r` holds.
    pub residuals: Vec<Number>,
    /// What is a constant of the code: names, values and units.
    pub held: Vec<(String, f64, String)>,
    /// The residuals as the model states them: names and expressions.
    pub(super) formulas: Vec<(String, String)>,
    pub(super) graph: Graph,
    /// what depends on parameters alone and each row reads
    pub(super) prepared: Vec<NodeId>,
    pub(super) prepare: Line,
    pub(super) functions: Vec<Function>,
    /// A made-up row at which the code can be checked; none where everything that was tried is undefined.
    pub point: Option<Point>,
}

/// How many rows a function of several takes.
pub const ROWS: usize = 8;

/// What a function puts out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// r
    Residuals,
    /// r, ∂r/∂q and ∂r/∂m
    Jacobian,
    /// the same of [`ROWS`] rows at a time, in a loop that compilers turn into vectors
    JacobianRows,
    /// these and ∂r/∂x
    Derivatives,
}

/// A function of a row.
#[derive(Clone, Debug)]
pub(super) struct Function {
    pub(super) kind: Kind,
    pub(super) line: Line,
    /// entries of r, ∂r/∂q, ∂r/∂m and ∂r/∂x that are zero in every row
    pub(super) zeros: Vec<usize>,
}

/// An array that holds outputs, and how many numbers each residual has in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Array {
    R,
    ByParameters,
    ByMembers,
    ByInputs,
}

impl Array {
    pub(super) const ALL: [Array; 4] = [Array::R, Array::ByParameters, Array::ByMembers, Array::ByInputs];
}

impl Kind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Kind::Residuals => "residuals",
            Kind::Jacobian => "jacobian",
            Kind::JacobianRows => "jacobian_rows",
            Kind::Derivatives => "derivatives",
        }
    }

    fn has(self, array: Array) -> bool {
        match array {
            Array::R => true,
            Array::ByParameters | Array::ByMembers => self != Kind::Residuals,
            Array::ByInputs => self == Kind::Derivatives,
        }
    }
}

impl Routine {
    /// How many numbers each residual has in an array; none where there is no such array.
    pub(super) fn width(&self, array: Array) -> usize {
        match array {
            Array::R => 1,
            Array::ByParameters => self.columns.len(),
            Array::ByMembers => self.member_columns.len(),
            Array::ByInputs => self.inputs.len(),
        }
    }

    /// The arrays that a function fills.
    pub(super) fn arrays(&self, kind: Kind) -> impl Iterator<Item = Array> + '_ {
        Array::ALL.into_iter().filter(move |&array| kind.has(array) && self.width(array) > 0)
    }

    /// The array of an output, and its residual and its column there; none of an output that there is not.
    pub(super) fn place(&self, mut output: usize) -> Option<(Array, usize, usize)> {
        for array in Array::ALL {
            let (width, all) = (self.width(array), self.width(array) * self.residuals.len());
            if output < all {
                return Some((array, output / width, output % width));
            }
            output -= all;
        }
        None
    }

    /// Operations once per iteration, and of each function per row: a product and the sum it goes into are one, and so is a
    /// sine.
    pub fn operations(&self) -> (usize, Vec<(&'static str, usize)>) {
        let of = |function: &Function| (function.kind.name(), function.line.operations());
        let single = self.functions.iter().filter(|function| function.kind != Kind::JacobianRows);
        (self.prepare.operations(), single.map(of).collect())
    }
}
