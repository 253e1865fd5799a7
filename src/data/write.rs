//! From a table to a file.

use std::io::{self, Write};
use std::path::Path;

use csv::WriterBuilder;

use super::column::Column;
use super::output::{Output, Written};
use super::table::Table;
use crate::compile::Program;
use crate::diag::Diagnostic;
use crate::unit::{nearest, parse_dms};

/// Writes a table as CSV: a heading, then each row with its names and, in the columns' own units, its readings.
///
/// The file is to be [put](Written::put) in its place, as a whole or not at all. What [`read`](super::read) takes from it is the same table, to the bit
/// where the column's unit can state the reading.
///
/// # Errors
///
/// [`CannotWrite`](crate::diag::Code::CannotWrite) where the file cannot be written, or a reading is not finite.
pub fn write(program: &Program, measurement: usize, table: &Table, path: &Path) -> Result<Written, Box<Diagnostic>> {
    Output::open(path)?.write(|out| write_to(program, measurement, table, out))
}

/// Writes a table as CSV.
///
/// # Errors
///
/// Where the program has no such measurement, the table not its columns, writing fails, or a reading is not finite.
pub fn write_to(program: &Program, measurement: usize, table: &Table, out: &mut dyn Write) -> io::Result<()> {
    let declared =
        program.measurement(measurement).map_err(|found| io::Error::new(io::ErrorKind::InvalidInput, found.message))?;
    let fits = table.fits(declared.keys.len(), declared.inputs.len());
    fits.map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
    let columns: Vec<(Column, bool)> =
        declared.inputs.iter().map(|input| (Column::new(&program.units, input), input.dms)).collect();
    if columns.is_empty() && declared.keys.is_empty() {
        return Ok(());
    }
    let mut csv = WriterBuilder::new().comment(Some(b'#')).from_writer(out);
    let inputs = declared.inputs.iter().map(|input| input.name.as_str());
    csv.write_record(declared.keys.iter().map(String::as_str).chain(inputs))?;
    let mut cell = String::new();
    for row in 0..table.rows() {
        for k in 0..declared.keys.len() {
            csv.write_field(table.key(row, k))?;
        }
        for (&reading, (column, dms)) in table.row(row).iter().zip(&columns) {
            let value = column.from_internal(reading);
            if !value.is_finite() || (*dms && !(value * 648_000.0).is_finite()) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, format!("row {} is not finite", row + 1)));
            }
            cell.clear();
            put(&mut cell, value, *dms);
            csv.write_field(&cell)?;
        }
        csv.write_record(None::<&[u8]>)?;
    }
    csv.flush()
}

/// A number with the fewest digits that give it back, as an angle in degrees, minutes and seconds where wanted.
fn put(cell: &mut String, value: f64, dms: bool) {
    use std::fmt::Write as _;
    if !dms {
        // a String takes everything
        let _ = write!(cell, "{value}");
        return;
    }
    // the seconds of arc that are read back as this angle; below 2⁵³ their parts are exact
    let radians = |seconds: f64| seconds / 648_000.0 * std::f64::consts::PI;
    let seconds = nearest(value.abs() / std::f64::consts::PI * 648_000.0, value.abs(), radians);
    // remainders are exact, however many degrees there are
    let of_degree = seconds % 3600.0;
    let degrees = ((seconds - of_degree) / 3600.0).round();
    let minutes = (of_degree / 60.0).floor();
    let (sign, rest) = (if value < 0.0 { "-" } else { "" }, of_degree % 60.0);
    let _ = write!(cell, "{sign}{degrees}-{minutes:02}-");
    let start = cell.len();
    for decimals in 0..=MOST_DECIMALS {
        let width = if decimals == 0 { 2 } else { decimals + 3 };
        cell.truncate(start);
        let _ = write!(cell, "{rest:0width$.decimals$}");
        if parse_dms(cell) == Ok(value) {
            return;
        }
    }
    cell.truncate(start);
    let _ = write!(cell, "{}{rest}", if rest < 10.0 { "0" } else { "" });
}

/// Decimals of a second of arc that are tried before all are written.
const MOST_DECIMALS: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn degrees_minutes_and_seconds_keep_every_digit(angle in -7.0..7.0_f64) {
            let mut cell = String::new();
            // what an instrument of such a column states
            let seconds = angle / std::f64::consts::PI * 648_000.0;
            let angle = seconds / 648_000.0 * std::f64::consts::PI;
            put(&mut cell, angle, true);
            prop_assert_eq!(parse_dms(&cell), Ok(angle), "{}", cell);
        }

        /// Minutes and seconds stay below 60 where there are more degrees than digits.
        #[test]
        fn any_angle_is_written_and_read(power in 0.0..300.0_f64) {
            let mut cell = String::new();
            let angle = 10_f64.powf(power);
            put(&mut cell, angle, true);
            let read = parse_dms(&cell);
            prop_assert!(read.as_ref().is_ok_and(|read| (read / angle - 1.0).abs() < 1e-15), "{} {:?}", cell, read);
        }
    }

    #[test]
    fn degrees_minutes_and_seconds_look_as_usual() {
        for (text, expected) in [
            ("12-34-56.7", "12-34-56.7"),
            ("-0-0-5", "-0-00-05"),
            ("0 0 0", "0-00-00"),
            ("359°59'59.999\"", "359-59-59.999"),
            ("90-0-0", "90-00-00"),
        ] {
            let mut cell = String::new();
            put(&mut cell, parse_dms(text).unwrap(), true);
            assert_eq!(parse_dms(&cell), parse_dms(text), "{cell}");
            assert_eq!(cell, expected);
        }
    }
}
