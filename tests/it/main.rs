//! One integration binary; its modules are the tests.
#![allow(unreachable_pub, reason = "a test binary has no outside")]

mod accuracy;
mod close;
mod flagship;
mod kinematics;
mod paper;
mod real;
mod shared;
mod tidy;
