//! One integration binary; its modules are the tests.
#![allow(unreachable_pub, reason = "a test binary has no outside")]
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

mod accuracy;
mod adjustments;
mod against;
mod audit;
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
mod far;
mod fitting;
mod flagship;
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
mod routes;
mod sequential;
mod sequential_cli;
mod shared;
mod shared_errors;
mod shipped_properties;
mod solvers;
mod testing_says;
mod tidy;
mod ui;
mod uncertainty;
