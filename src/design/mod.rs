//! What to measure: the rows that make a stated target best, found and certified before anything is measured.
//!
//! Candidates are rows at inputs that are consistent with the nominal values; candidate i would tell Mᵢ = JᵢᵀJᵢ of the parameters, with Jᵢ the
//! derivatives of its whitened equations, and priors tell M₀. A design is N of them, and a [`Criterion`] says how good M₀ + Σ Mᵢ is.
//!
//! [`Experiment`] → [`pick`]: a greedy design, a relaxation (weights between 0 and 1) from it, a lower bound that weak duality makes of the
//! relaxation's gradient, and exchanges until no one against one helps. The bound holds for every design, whatever the search did, so a
//! design that is within 1 % of it is within 1 % of the best.
//!
//! [`design()`] does this for a model, with targets over a volume and words for what no candidate sees; [`confirm()`] simulates the
//! chosen rows, fits them, and compares.
//!
//! Everything is to first order at the nominal values: before a measurement there is nothing else to go by.

#![allow(
    clippy::indexing_slicing,
    reason = "candidates and coordinates are numbered by the experiment that was set up"
)]

mod bound;
mod confirm;
mod criterion;
mod exchange;
mod experiment;
mod outcome;
mod reach;
mod relax;
mod search;
mod setup;
mod target;

pub use confirm::{Compared, Confirmation, confirm};
pub use criterion::Criterion;
pub use experiment::Experiment;
pub use outcome::{Aim, Design, Expected, Foretold, RANDOM, Request, design};
pub use reach::Reach;
pub use search::{Picked, pick, value};
pub use target::{Asked, Target, puts_out};
