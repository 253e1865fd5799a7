//! Running tapes: values over `f64`, exact first derivatives over dual numbers.
//!
//! This evaluation *defines* what is right; any faster one is tested against it. A [`Evaluator`] holds what one pass over
//! the rows of a measurement needs: parameters are set once per iteration, rows are run one at a time.

mod evaluator;

pub use evaluator::{Evaluator, Leaf};
