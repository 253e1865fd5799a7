//! The compiled engine and its derivatives against the reference: operations of the table on `f64` and on dual numbers, and
//! [`Evaluator`](super::Evaluator) on whole graphs.
//!
//! What is under test is an argument of every check: first the engine itself, which must pass, then wrong ones, which must
//! not (`mutants`, and the second half of `operations`).

mod compare;
mod depth;
mod engine;
pub(crate) mod frames;
mod mutants;
mod operations;
mod partials;
mod points;
pub(crate) mod random_frames;
mod random_scalars;
mod scalars;
mod views;
