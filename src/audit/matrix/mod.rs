//! A Jacobian made elsewhere, as a matrix of numbers, against the exact one.
//!
//! `read` (a file of numbers) → `layout` (which number is which derivative) → `multiples` (what whole columns, residuals and blocks have
//! in common) → `precision` and `quotients` (what small errors look like) → `refit` (what the mistake costs a calibration).
//!
//! A conversion of conventions is undone before errors are looked for: the entries of residual i by column j that all are f times the
//! exact ones, f = dᵢ cⱼ, tell of a sign or a unit, not of many mistakes.

mod layout;
mod multiples;
mod precision;
mod quotients;
mod read;
mod refit;
mod stack;
mod verdict;

pub use multiples::{Finding, Kind};
pub use precision::Precision;
pub use quotients::{Quotient, Rule, Steps};
pub use read::{Given, Sheet, read_matrices};
pub use refit::{Ended, Refit, refit};
pub use stack::Stack;
pub use verdict::{Entry, MatrixAudit, audit_matrix};
