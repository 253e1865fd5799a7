//! placeholder
pub mod compile;
pub mod diag;
pub mod eval;
pub mod graph;
pub mod lang;
pub mod model;
pub mod unit;
