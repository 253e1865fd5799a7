//! Data made up from a declared scenario: true parameters, exact geometry, then the errors of the sensors.
//!
//! [`simulate`] gives the truth and one [`Table`](crate::data::Table) for each measurement of a
//! [`Scenario`](crate::compile::Scenario). A row is made in this order: names and numbers are drawn, inputs are computed by
//! formula or solved for, and noise is added last; a reading is then rounded to what its column can state, so that a table
//! written to a file and read again is the same.
//!
//! # Order of the draws
//!
//! Every purpose has a random stream of its own (`ChaCha8`, the scenario's seed, the stream's number from the purpose's
//! name), and takes one draw per row from it, first row first. The purposes are each coordinate's true value (by its full
//! name, such as `socket[front/0].x`), each key column, each drawn variable, and the noise of each input (by measurement and column).
//! So more rows keep the first ones as they are, rows without noise have the geometry of those with it, the truth does not
//! depend on the rows, and a further drawn variable leaves the others alone.

mod draw;
mod noise;
mod root;
mod rows;
#[cfg(test)]
mod tests;
mod truth;

pub(crate) use draw::Stream;
pub use rows::{MOST_READINGS, Options, Simulated, simulate, simulate_again, simulate_watched, with_declared_errors};
