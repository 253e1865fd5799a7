//! Running graphs of scalar operations, in two ways.
//!
//! [`Evaluator`] runs a [`Tape`](crate::graph::Tape) over dual numbers, one row at a time. It *defines* what is right.
//!
//! [`Compiled`] runs values and derivatives, which [`differentiate`](crate::graph::differentiate) gives as one graph, over
//! blocks of [`ROWS`] rows: operations outside, rows inside, in the vectors that the machine has. From graph to numbers:
//!
//! graph ─`plan`→ steps (sums of products, no negations, what is the same for all rows taken out) ─`group`→ like steps together
//! ─`slots`→ few places ─`kernel`→ vectors
//!
//! It agrees with the first way to rounding, operation by operation and for whole models.

#![allow(
    clippy::indexing_slicing,
    reason = "slots and instructions are numbered by the plan that made them, and rows are cut to whole batches of it"
)]

mod compiled;
mod evaluator;
mod group;
mod kernel;
mod plan;
mod schedule;
mod slots;
#[cfg(test)]
pub(crate) mod tests;

pub use compiled::{Block, Compiled};
pub use evaluator::{Evaluator, Leaf};
pub use kernel::ROWS;
