//! placeholder
pub mod compile;
pub mod data;
pub mod diag;
pub mod eval;
pub mod fit;
pub mod graph;
pub mod lang;
pub mod linalg;
pub mod model;
pub mod problem;
pub mod simulate;
pub mod solve;
pub mod unit;
