//! Rows of data: [`read()`] takes a measurement's files into one [`Table`] in internal units, [`write()`] puts one into a file.
//!
//! All mistakes of all files are reported at once, each with its file, line, row, column and what stands there. A table knows
//! where each of its rows came from, so that whoever meets an impossible row later can say so too.
//!
//! Files are CSV with a heading, or without one where the model names the columns. Cells are trimmed, blank lines and lines
//! that begin with `#` skipped, a byte-order mark too; lines end as they like; where the heading has semicolons or tabs instead of
//! commas, those separate. A heading may say the unit again, `hzL1 [deg]`, and then has to say the declared one.

mod ahead;
mod cell;
mod column;
mod csv;
mod heading;
mod intake;
mod lines;
mod names;
mod output;
mod positional;
mod records;
mod rows;
mod store;
mod table;
#[cfg(test)]
mod tests;
mod watch;
mod write;

pub use self::csv::{Data, FileRead, STANDARD_INPUT, follow, read, read_files, read_input};
pub use ahead::fingerprint;
pub use column::Column;
pub use output::{Output, Written, make_directory};
pub use rows::{Buffer, Row, Rows};
pub use table::{ColumnError, Table};
pub use watch::{Stage, Watch};
pub use write::{write, write_to};
