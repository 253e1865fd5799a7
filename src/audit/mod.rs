//! Derivatives against the exact ones: other people's, and our own by other routes.
//!
//! *Routes* to the derivatives of a model's residuals are compared with dual numbers: the engine, the symbolic derivative, central
//! differences and the complex step.
//!
//! *Formulas* that are written in a model by hand (`derivatives`) are compared with dual numbers at random points; where one is
//! wrong, the point is shrunk to the simplest at which it still is, and single changes of the formula are tried until one makes it
//! right: that is where the mistake is.
//!
//! *Functions* for a Jacobian, written by hand in Rust, are compared in the same way.
//!
//! A *matrix* that another program made is compared entry by entry, once its conventions are recognised.

#![allow(
    clippy::indexing_slicing,
    reason = "equations and parameters are numbered by the stack they are of; what files say is looked up, in `read` and `layout`"
)]

mod cause;
mod complex;
mod differences;
mod formulas;
mod function;
mod matrix;
mod points;
mod repair;
mod routes;
mod shrink;

pub use cause::{Cause, cause};
pub use differences::differences;
pub use formulas::{CheckedFormula, check_formulas};
pub use function::{Blame, CheckedFunction, JacobianFunction, Mismatch, WrongEntry, check_function};
pub use matrix::{
    Ended, Entry, Finding, Given, Kind, MatrixAudit, Precision, Quotient, Refit, Rule, Sheet, Stack, Steps,
    audit_matrix, read_matrices, refit,
};
pub use points::Point;
pub use repair::Repair;
pub use routes::{CheckedRoute, CheckedRoutes, Route, WorstDerivative, check_points, check_routes};
pub use shrink::CounterExample;
