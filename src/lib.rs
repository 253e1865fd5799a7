//! placeholder
pub mod graph;
pub mod eval;
