//! Units and dimensions: what `"17.59 arcsec"` and `unit: "mm/s"` mean.
//!
//! [`Unit::parse`] reads a unit from its symbol, [`Units`] holds the units of a model and converts, [`parse_dms`] reads
//! degrees, minutes and seconds. The closed set of units is one table, [`TABLE`].
//!
//! ```
//! use phical::unit::{Unit, Units};
//!
//! let units = Units::default(); // mm, rad, s, kg, K
//! let speed = Unit::parse("m/s")?;
//! assert_eq!(units.to_internal(343.0, speed), 343_000.0);
//! assert_eq!(units.symbol(speed.dimension), "mm/s");
//! # Ok::<(), phical::unit::UnknownUnit>(())
//! ```

mod dimension;
mod dms;
mod parse;
mod table;
mod units;

pub use dimension::{Base, Dimension};
pub use dms::{DmsError, parse_dms, scan_marked};
pub use parse::{Unit, UnknownUnit, starts_unit};
pub use table::{Entry, TABLE};
pub use units::{Conversion, Units, UnitsError, nearest};
