//! Property tests of declared models: strategies for what may happen to them, and assertions of what must hold. With the feature
//! `proptest`.
//!
//! *Strategies* of the crate `proptest`: [`chains()`] (serial chains of φ-model joints, with the rank that counting gives),
//! [`rotations`] and [`poses()`], [`parameters`] of a bound model, [`readings`] of a measurement, and [`data`] of a scenario. All are
//! decided by the runner's seed alone, and what fails shrinks: to fewer joints, to nominal values, to fewer rows.
//!
//! *Assertions* say what they found in the words of the reports:
//!
//! | assertion | what must hold |
//! |---|---|
//! | [`assert_identifiable`] | every free parameter can be known |
//! | [`assert_rank`] | so many independent directions of the parameters are seen |
//! | [`assert_invisible`] | exactly these parameters cannot be known |
//! | [`assert_derivatives`] | dual numbers, the engine, formulas, differences and the complex step agree |
//! | [`assert_jacobian`] | a function written by hand gives the derivatives |
//! | [`assert_recovers`] | exact data of the scenario are fitted back to the truth |
//! | [`assert_same_fit`] | two fits say the same |
//!
//! Each takes a [`Probe`](crate::identify::Probe) or what turns into one: a [`Program`], a [`Session`](crate::session::Session), a
//! [`Problem`](crate::problem::Problem) with data. Each has a twin, `check_…`, that returns the message instead, for
//! `check_rank(&program, 20).map_err(TestCaseError::fail)?` inside of a property.
//!
//! ```
//! use phical::identify::Probe;
//! use phical::problem::{Options, Problem};
//! use phical::session::{Procedure, Session, fit_by};
//! use phical::testing::{
//!     assert_derivatives, assert_identifiable, assert_invisible, assert_rank, assert_recovers, data,
//! };
//! use proptest::prelude::*;
//!
//! # fn main() -> Result<(), phical::diag::Diagnostics> {
//! let session = Session::open("models/two_theodolite/model.ron".as_ref(), &[])?;
//! assert_identifiable(&session);
//! assert_derivatives(&session, 2); // at the nominal values and two other points
//! assert_recovers(&session, 0..2); // exact data of two seeds
//! // without its datum the flagship is one short
//! let all = Probe::from(&session).freeing(&["L1.b"]);
//! assert_rank(all.clone(), 20);
//! assert_invisible(all, &["L1.b", "R1.b"]);
//!
//! let program = &session.program;
//! let config = ProptestConfig::with_cases(4);
//! proptest!(config, |(made in data(program, &program.scenarios[0], 30..=60, false))| {
//!     let (problem, _) = Problem::bind(program, made.simulated.tables, &Options::default()).expect("rows");
//!     let fit = fit_by(&problem, &Procedure::default()).expect("a fit");
//!     prop_assert!(fit.status.converged() && fit.rank == 20);
//! });
//! # Ok(())
//! # }
//! ```

#![allow(clippy::indexing_slicing, reason = "rows and parameters are numbered by the problem under test")]

mod chains;
mod derivatives;
mod fits;
mod identifiable;
mod jacobians;
mod points;
mod poses;
mod recovery;
mod rows;

pub use crate::audit::differences;
pub use chains::{JointKind, Kinds, Measured, Serial, chains};
pub use derivatives::{Compared, assert_derivatives, check_derivatives};
pub use fits::{assert_same_fit, check_same_fit};
pub use identifiable::{
    assert_identifiable, assert_invisible, assert_rank, check_identifiable, check_invisible, check_rank,
};
pub use jacobians::{assert_jacobian, check_jacobian};
pub use points::{Spread, parameters};
pub use poses::{poses, rotations};
pub use recovery::{assert_recovers, check_recovers};
pub use rows::{Data, Reading, data, readings};

use crate::compile::{Program, compile};
use crate::diag::{self, Diagnostics, Source};
use crate::model::load;

/// A model from its text, compiled.
///
/// # Panics
/// With all mistakes of the text, each with its place.
///
/// ```
/// let program = phical::testing::program(
///     r#"(name: "mean", parameters: {"a": Scalar(Free(1))}, measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "x - a"})})"#,
/// );
/// assert_eq!(program.parameters[0].name, "a");
/// ```
#[track_caller]
pub fn program(text: &str) -> Program {
    let source = Source::new("model.ron", text);
    let compiled = load(&source).and_then(|(model, _)| compile(&model, &source, &[]));
    demand(compiled.map_err(|mistakes| said(&mistakes))).0
}

fn said(mistakes: &Diagnostics) -> String {
    diag::text(mistakes, false)
}

/// What a check found is what an assertion panics with.
#[track_caller]
#[allow(clippy::panic, reason = "an assertion that fails says so")]
fn demand<T>(found: Result<T, String>) -> T {
    match found {
        Ok(found) => found,
        // not in a closure, which would stand for the place of the test
        Err(message) => panic!("{message}"),
    }
}
