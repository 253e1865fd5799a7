//! What data can see, before and after they are measured.
//!
//! *Structural*: what no data of the declared kind can see, whatever their number and quality. [`structure`] finds the rank of the
//! linearisation at several random points of the parameters, each with inputs that are consistent with it (where all residuals
//! vanish: at others a symmetry shows as a small singular value and would be taken for knowledge), and takes the largest. What
//! is invisible there is walked along: where parameters can follow so that the residuals stay zero, a whole family of them
//! explains any data; where they cannot, the point is a mere stationary one.
//!
//! *Practical*: how well the parameters would come to be known. [`practice`] predicts their standard uncertainties from the
//! weights' information at consistent inputs, without a fit and, with a scenario, without any data.
//!
//! *Cures*: [`cures()`] gives the smallest sets of parameters whose holding makes the rest determinable, [`change_datum`] moves a
//! finished fit from one such choice to another, [`Candidate`] says which further row would tell most.
//!
//! *Conventions*: [`conventions`] finds joints that are close to where their convention breaks down.

#![allow(
    clippy::indexing_slicing,
    reason = "coordinates are numbered by the problem, and directions have one entry for each free one"
)]

mod clusters;
mod collinear;
mod convention;
mod cures;
mod datum;
mod direction;
mod drawn;
mod indices;
mod inputs;
mod next;
mod practical;
mod structural;
mod walk;

pub use clusters::{CORRELATED, Cluster, clusters, multiple_correlations};
pub use collinear::{CONDITION_INDEX, Collinearity, Dependency, PROPORTION};
pub use convention::{Convention, conventions};
pub use cures::{Cure, cures};
pub use datum::{Moved, change_datum, held_datum};
pub use direction::{Direction, RANDOM_SPREAD, WEAK, spectrum};
pub use drawn::{ANGLES, LENGTHS, Ranges};
pub use indices::Observability;
pub use inputs::{At, Inputs, Probe};
pub use next::{Candidate, next};
pub use practical::{Known, Practice, practice};
pub use structural::{POINTS, Structure, structure};
pub use walk::{Walk, walk};
