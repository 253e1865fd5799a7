//! Robots as other programs state them: tables of Denavit and Hartenberg, modified ones, and URDF files; read as models, and written
//! with calibrated numbers.
//!
//! file ─`table`, `urdf`→ [`Robot`] ─`phi`, `model`→ text of a model ─calibrate→ [`ChainValues`] ─`rows`, `origins`→ [`Exported`]
//!
//! In the middle stands a [`Serial`] chain: motions about and along z, and constant motions between them, without any convention. The
//! zero of a reading and the place along an axis where a frame sits are nobody's but the convention's, so they go from one constant part over
//! to the next (a [`Screw`]), and every statement of a chain multiplies to the same frame at its end. Conversions are written over
//! any number type ([`Real`]): with dual numbers they carry the covariance of a fit over to the exported numbers.
//!
//! ```
//! use phical::diag::Source;
//! use phical::exchange::{Convention, TableUnits, model_text, read_table};
//!
//! let table = Source::new("scara.csv", "joint,reads,theta,d,a,alpha\nJ1,angle,0,0.2,0.25,0\nJ2,angle,0,0,0.15,pi\nJ3,length,0,0,0,0\n");
//! let robot = read_table(&table, Some(Convention::Dh), &TableUnits::default())?;
//! let imported = model_text(&robot, "scara.csv");
//! assert_eq!((imported.joints.len(), imported.free), (3, 4 + 4 + 2 + 3));
//! assert!(imported.text.contains("Revolute("));
//! # Ok::<(), phical::diag::Diagnostics>(())
//! ```

#![allow(clippy::indexing_slicing, reason = "vectors, rotations and rows have as many numbers as their types say")]

mod chain;
mod covariance;
mod export;
mod heading;
mod model;
mod motion;
mod number;
mod origins;
mod phi;
mod robot;
mod rows;
mod serial;
mod table;
mod urdf;

pub use chain::{ChainValues, chain_name};
pub use covariance::Covariance;
pub use export::{Exported, Target, export};
pub use heading::TableUnits;
pub use model::{Imported, model_text};
pub use motion::{Motion, Real, Screw, Vector};
pub use origins::{ORIGIN_SYMBOLS, Origin, origins, robot_of, with_origins};
pub use phi::{PhiLink, phi_links, phi_motion};
pub use robot::{Limits, Reading, Robot};
pub use rows::{ANGLES, Convention, Near, Row, Rows, SYMBOLS, Style, rows, serial_of};
pub use serial::{Joint, Kind, Serial};
pub use table::read_table;
pub use urdf::{Urdf, UrdfJoint, UrdfKind};
