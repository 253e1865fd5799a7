//! A program bound to rows of data: what a solver minimises.
//!
//! [`Problem::bind`] gives every family its members, decides which coordinates are free, and whitens residuals. The problem is
//!
//! minimise ½ Σ (rᵢ(q)/σᵢ)² + ½ Σ ((qⱼ − nominalⱼ)/σⱼ)²
//!
//! over the free coordinates of q, the second sum over those with a prior. A row touches the members that its keys name and
//! nothing else.

mod adjusted;
mod bind;
mod block;
mod execution;
mod factor;
mod layout;
mod pass;
mod prior;
mod programs;
mod rotation;
mod selection;
mod solving;

pub use adjusted::At;
pub use bind::{Options, Weights};
pub use block::{Block, Quantities, RowJacobian};
pub use execution::Execution;
pub use factor::Rows;
pub use layout::{Coordinate, Layout};
pub use programs::operations;
pub use selection::Selection;
pub use solving::Undefined;

use crate::compile::Program;
use prior::Prior;

/// A program bound to rows of data.
#[derive(Clone, Debug)]
pub struct Problem<'p> {
    /// What it was bound from.
    pub program: &'p Program,
    /// All coordinates of all parameters, free and held.
    pub layout: Layout,
    /// The rows, one block for each measurement that has any.
    pub blocks: Vec<Block<'p>>,
    /// How residuals are weighted.
    pub weights: Weights,
    /// Where to start: the value of every coordinate.
    pub start: Vec<f64>,
    /// The free coordinates, by their number.
    pub free: Vec<usize>,
    /// With which instructions, and by how many threads.
    pub execution: Execution,
    /// The tolerance of each free coordinate.
    scale: Vec<f64>,
}

impl Problem<'_> {
    /// How many equations the data give.
    pub fn equations(&self) -> usize {
        self.blocks.iter().map(|block| block.table.rows() * block.measurement.residuals.len()).sum()
    }

    /// How many free coordinates have a prior.
    pub fn priors(&self) -> usize {
        self.free.iter().filter(|&&c| self.layout.coordinates[c].sigma.is_some()).count()
    }
}
