//! One integration binary; its modules are the tests.

mod close;
mod flagship;
mod shared;
