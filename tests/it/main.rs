//! One integration binary; its modules are the tests.
#![allow(unreachable_pub, reason = "a test binary has no outside")]
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::string_slice,
    clippy::unreachable,
    clippy::unwrap_used,
    reason = "a test that cannot go on fails"
)]
#![allow(
    clippy::panic_in_result_fn,
    clippy::unwrap_in_result,
    clippy::get_unwrap,
    reason = "a test that cannot go on fails"
)]
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

mod accuracy;
mod adjustments;
mod against;
mod audit;
mod cascade;
mod cli;
mod close;
mod comparison;
mod constraints;
mod coverage;
mod derivatives;
mod derive;
mod design;
mod emit;
mod engine;
mod exchange;
mod exchange_cli;
mod far;
mod fitting;
mod flagship;
mod fuzz;
mod guide;
mod identify;
mod kinematics;
mod laws;
mod nist;
mod paper;
mod peers;
mod prediction;
mod propagated;
mod published;
mod random;
mod readme;
mod real;
mod refusals;
mod report;
mod routes;
mod sequential;
mod sequential_cli;
mod shared;
mod shared_errors;
mod shipped_properties;
mod solvers;
mod stopped;
mod surveyed;
mod terminal;
mod testing_says;
mod tidy;
mod ui;
mod uncertainty;
mod whole;
