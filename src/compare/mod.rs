//! Two fits side by side: does freeing a parameter pay, and do they say the same?
//!
//! - [`Nested`]: fits of the same data by models one of which contains the other, by F, likelihood ratio and information criteria.
//! - [`Agreement`]: whether two fits agree, in terms that no datum changes. What differs along an invisible direction is a
//!   choice, not a finding, so differences and covariances are projected onto what the data see.

mod agreement;
mod nested;

pub use agreement::{Agreement, Difference, agreement};
pub use nested::{Nested, nested};
