//! Mathematics as people write it: derivatives and simplifications that keep frames, vectors, dot and cross products.
//!
//! The engine reduces everything to scalars; what is read, compared with formulas on paper, or written into a model stays
//! geometry here. `differential` makes the derivative of any node as a node, by rules that are those of textbooks;
//! `rebuilt` simplifies; `Writer` writes nodes as expressions of the model language, in the names that the model gave
//! them, and [`latex()`] sets those in type.

mod algebra;
mod differential;
mod formula;
mod label;
mod latex;
mod rebuild;
#[cfg(test)]
mod tests;

pub(crate) use algebra::Algebra;
pub(crate) use differential::{Change, Screw, differential, suffix, unit};
pub(crate) use formula::{Writer, call, name};
pub(crate) use label::Label;
pub use label::Labels;
pub use latex::latex;
pub(crate) use latex::{escaped, terms};
pub(crate) use rebuild::rebuilt;
