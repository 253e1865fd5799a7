//! A program bound to rows of data: what a solver minimises.
//!
//! [`Problem::bind`] gives every family its members, decides which coordinates are free, and whitens residuals. The problem is
//!
//! minimise ½ Σ (rᵢ(q)/σᵢ)² + ½ Σ ((qⱼ − nominalⱼ)/σⱼ)²
//!
//! over the free coordinates of q, the second sum over those with a prior; what [other fits](Estimates) know of them is added. With propagated weights the first is the sum over rows
//! of min ½ vᵀΣ⁻¹v over corrections v of the readings x that make the equations hold, f(q, x + v) = 0; with a loss ρ it is ½ Σ ρ(s)
//! of the squares s of the lengths of the rows' whitened residuals, or of the corrections. A row touches the members that its keys
//! name and nothing else.
//!
//! How a row comes to its whitened residuals and derivatives, which solvers see through
//! [`SquareRootInformation`](crate::linalg::SquareRootInformation):
//!
//! `noise` (what the weights count) → `propagated` (a step, as a graph) → `correction` (blocks of rows, until they stand still) or
//! `alone` (a row that a block cannot do) → `equations` (weights of losses, and sums) → `factor` (QR, by pieces and threads).

#![allow(
    clippy::indexing_slicing,
    reason = "coordinates, groups and blocks are numbered by the layout that binding made; what callers number is looked up"
)]

mod adjusted;
mod alone;
mod bind;
mod block;
mod components;
mod consistent;
mod constraints;
mod correction;
mod derivatives;
mod equations;
mod execution;
mod factor;
mod inspect;
mod known;
mod layout;
mod losses;
mod noise;
mod pass;
mod path;
mod prior;
mod programs;
mod propagated;
mod replicates;
mod robust;
mod rotation;
mod selection;
mod sensitivity;
mod sequential;
mod solving;
mod stacked;
mod whitening;

pub use bind::{Options, Weights};
pub use block::{Block, Quantities, RowJacobian};
pub use consistent::Consistent;
pub use derivatives::EngineRow;
pub use equations::Sums;
pub use execution::{Execution, Stop};
pub use factor::{Linearised, Rows};
pub use inspect::{Inspected, Observed};
pub use known::Estimates;
pub use layout::{Coordinate, Layout};
pub use noise::{Factors, residual_group};
pub use path::Path;
pub use programs::operations;
pub use replicates::PureError;
pub use selection::Selection;
pub use sensitivity::Sensitivity;
pub use solving::Undefined;

use std::sync::Arc;

use crate::compile::Program;
use crate::diag::{Code, Diagnostic};
use crate::solve::Absorbed;
use constraints::Conditions;
use known::Known;
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
    /// With which instructions, by how many threads, until when, and who is told.
    pub execution: Execution,
    /// The constraints that free coordinates can meet or break.
    conditions: Conditions,
    /// The tolerance of each free coordinate.
    scale: Vec<f64>,
    /// What other fits have found out.
    known: Arc<[Known]>,
    /// What is left of rows that are gone.
    absorbed: Option<Arc<Absorbed<Vec<f64>>>>,
}

impl<'p> Problem<'p> {
    /// A block by its number.
    pub(super) fn block(&self, number: usize) -> Result<&Block<'p>, Undefined> {
        self.blocks.get(number).ok_or_else(|| {
            let message = format!("there is no block number {number}: there are {}, counted from 0", self.blocks.len());
            Undefined(Box::new(Diagnostic::error(Code::UnknownMeasurement, message)))
        })
    }

    /// How many equations the data give.
    pub fn equations(&self) -> usize {
        self.blocks.iter().map(|block| block.table.rows() * block.measurement.residuals.len()).sum()
    }

    /// How many equations priors give: one for each free coordinate that has one, and those of other fits.
    pub fn priors(&self) -> usize {
        let known: usize = self.known.iter().map(Known::rank).sum();
        self.free.iter().filter(|&&c| self.layout.coordinates[c].sigma.is_some()).count() + known
    }
}
