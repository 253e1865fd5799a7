//! Tables of joints, read from text.

use std::f64::consts::PI;
use std::sync::Arc;

use super::heading::{Column, Heading, TableUnits, heading, unit_of};
use super::motion::Motion;
use super::number::{read_number, tidy_angle};
use super::robot::{Limits, Reading, Robot};
use super::rows::{Convention, Row, serial_of};
use super::serial::{Kind, Serial};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, Source, did_you_mean};
use crate::model::Reads;
use crate::unit::{Base, Dimension, Unit, Units};

/// Reads a table in a convention; none is that which its heading states. Units that the heading does not state are those of `units`, or
/// else metre and radian.
///
/// # Errors
/// All mistakes of the table: each with its line, its column and what it reads.
pub fn read_table(
    source: &Arc<Source>,
    convention: Option<Convention>,
    units: &TableUnits,
) -> Result<Robot, Diagnostics> {
    let mut found = Diagnostics::new();
    let file = source.name();
    let text = source.text().trim_start_matches('\u{feff}');
    let first = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
    let count = |c: char| first.matches(c).count();
    let delimiter = [',', ';', '\t'].into_iter().max_by_key(|c| (count(*c), *c == ',')).unwrap_or(',');
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(u8::try_from(delimiter).unwrap_or(b','))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut records = reader.records().map_while(Result::ok).map(|record| {
        let line = record.position().map_or(0, csv::Position::line);
        (usize::try_from(line).unwrap_or(0), record)
    });
    let Some((line, names)) = records.next() else {
        let wrong = Diagnostic::error(Code::NoRows, "the table is empty").at_data(DataPlace::file(file));
        let wrong =
            wrong.hint("its first line names the columns (theta, d, a, alpha), and every other line is a joint");
        return Err(wrong.into());
    };
    let heading = heading(file, line, &names.iter().collect::<Vec<_>>(), &mut found);
    let Some(convention) = convention.or(heading.convention) else {
        found.push(which_convention(file));
        return Err(found);
    };
    let mut scale = |given: &Option<String>, stated: &Option<String>, si: &str, dimension| {
        let symbol = given.as_ref().or(stated.as_ref()).map_or(si, String::as_str).to_owned();
        let unit = unit_of(&symbol, dimension).map_err(|wrong| found.push(*wrong)).ok();
        (symbol, unit.unwrap_or(Unit::ONE))
    };
    let length = scale(&heading.stated.length, &units.length, "m", Dimension::LENGTH);
    let angle = scale(&heading.stated.angle, &units.angle, "rad", Dimension::ANGLE);
    let assumed = [
        (heading.stated.length.is_none() && units.length.is_none()).then_some("m"),
        (heading.stated.angle.is_none() && units.angle.is_none()).then_some("rad"),
    ];
    // lengths of the model are in the table's unit, angles in radians
    let Ok(own) = Units::default().with(Base::Length, &length.0) else { return Err(found) };
    let reader = Reader { file, heading: &heading, own, length: length.1, angle: angle.1 };
    let mut rows: Vec<Read> = Vec::new();
    for (number, (line, record)) in records.enumerate() {
        let cells: Vec<&str> = record.iter().collect();
        if cells.iter().all(|cell| cell.is_empty()) {
            continue;
        }
        rows.extend(reader.row(line, number + 1, &cells, &mut found));
    }
    if !found.has_errors() && rows.iter().all(|row| row.row.reads == Reads::Nothing) {
        let what = if rows.is_empty() { "the table has no rows" } else { "no row of the table reads anything" };
        let code = if rows.is_empty() { Code::NoRows } else { Code::NothingMoves };
        found.push(Diagnostic::error(code, what).at_data(DataPlace::file(file)));
    }
    for (at, row) in rows.iter().enumerate() {
        if rows.iter().take(at).any(|before| before.row.name == row.row.name) {
            let wrong = Diagnostic::error(Code::Duplicate, format!("the joint `{}` stands twice", row.row.name));
            let place = DataPlace { line: Some(row.line), column: Some("joint".into()), ..DataPlace::file(file) };
            found.push(
                wrong.at_data(place).hint("parameters are called after their joints: rename one of the two rows"),
            );
        }
    }
    if found.has_errors() {
        return Err(found);
    }
    let assumed: Vec<&str> = assumed.into_iter().flatten().collect();
    let unstated = match assumed[..] {
        [] => String::new(),
        _ => format!(" ({} assumed: the heading does not say)", assumed.join(" and ")),
    };
    let words = format!("{} table; lengths in {}, angles in {}{unstated}", convention.name(), length.0, angle.0);
    Ok(robot(file, &rows, convention, words, &length.0, &angle.0))
}

/// A table that could be in either convention.
fn which_convention(file: &str) -> Diagnostic {
    let message =
        "a table with these columns is a Denavit-Hartenberg one or a modified one, and they multiply differently";
    let hint = "say `--as dh` for Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha), `--as mdh` for Craig's \
                Trans_x(a) Rot_x(alpha) Rot_z(theta) Trans_z(d)";
    Diagnostic::error(Code::WhichFormat, message).at_data(DataPlace::file(file)).hint(hint)
}

/// A row as read: its offset is in θ or d already.
struct Read {
    row: Row<f64>,
    reversed: bool,
    limits: Option<Limits>,
    line: usize,
}

struct Reader<'a> {
    file: &'a str,
    heading: &'a Heading,
    own: Units,
    length: Unit,
    angle: Unit,
}

impl Reader<'_> {
    fn row(&self, line: usize, number: usize, cells: &[&str], found: &mut Diagnostics) -> Option<Read> {
        let place = |column: Option<&str>, value: Option<&str>| DataPlace {
            file: self.file.to_owned(),
            line: Some(line),
            row: Some(number),
            column: column.map(str::to_owned),
            value: value.map(str::to_owned),
        };
        if cells.len() != self.heading.columns.len() {
            let message =
                format!("the row has {} fields, and there are {} columns", cells.len(), self.heading.columns.len());
            let hint = "a decimal comma, a missing value and a missing quote are the usual causes";
            found.push(Diagnostic::error(Code::FieldCount, message).at_data(place(None, None)).hint(hint));
            return None;
        }
        let at = |wanted: Column| self.heading.columns.iter().position(|column| *column == Some(wanted));
        let text =
            |wanted: Column| at(wanted).and_then(|at| cells.get(at)).map(|cell| cell.trim()).filter(|c| !c.is_empty());
        let reads = match text(Column::Reads).map(str::to_lowercase).as_deref() {
            None | Some("angle" | "r" | "revolute") => Some(Reads::Angle),
            Some("length" | "p" | "prismatic") => Some(Reads::Length),
            Some("nothing" | "f" | "fixed" | "none") => Some(Reads::Nothing),
            Some(other) => {
                let wrong = Diagnostic::error(
                    Code::UnknownVariant,
                    format!(
                        "the row says that its joint reads `{other}`, which is neither an angle nor a length nor nothing"
                    ),
                );
                let hint = did_you_mean(other, "what it can read", &["angle", "length", "nothing"]);
                found.push(wrong.at_data(place(Some("reads"), Some(other))).maybe_hint(hint));
                None
            }
        };
        let mut number_of = |wanted: Column, name: &str, default: Option<f64>, unit: Option<Unit>| {
            let Some(cell) = text(wanted) else {
                if default.is_none() {
                    let wrong = Diagnostic::error(Code::EmptyCell, "the cell is empty");
                    found.push(wrong.at_data(place(Some(name), Some(""))).hint("write 0 where it is nothing"));
                }
                return default;
            };
            let own = at(wanted).and_then(|at| self.heading.units.get(at).copied().flatten()).or(unit);
            let Some(value) = read_number(cell) else {
                let wrong = Diagnostic::error(Code::NotANumber, format!("`{cell}` is not a number"));
                found.push(
                    wrong
                        .at_data(place(Some(name), Some(cell)))
                        .hint("numbers have a point, and angles may be parts of pi: `0.4`, `-1e-3`, `-pi/2`"),
                );
                return None;
            };
            if !value.is_finite() {
                let wrong = Diagnostic::error(Code::DataNotFinite, format!("`{cell}` is not a finite number"));
                found.push(wrong.at_data(place(Some(name), Some(cell))));
                return None;
            }
            // a part of π is an angle whatever the unit
            let of_pi = cell.contains("pi") || cell.contains('π');
            Some(match own {
                Some(unit) if unit.dimension == Dimension::ANGLE && of_pi => value,
                Some(unit) if unit.dimension == Dimension::ANGLE => tidy_angle(self.own.to_internal(value, unit)),
                Some(unit) => self.own.to_internal(value, unit),
                None => value,
            })
        };
        let theta = number_of(Column::Theta, "theta", None, Some(self.angle));
        let d = number_of(Column::D, "d", None, Some(self.length));
        let a = number_of(Column::A, "a", None, Some(self.length));
        let alpha = number_of(Column::Alpha, "alpha", None, Some(self.angle));
        let beta = number_of(Column::Beta, "beta", Some(0.0), Some(self.angle));
        let of_reading = if reads == Some(Reads::Length) { self.length } else { self.angle };
        let offset = number_of(Column::Offset, "offset", Some(0.0), Some(of_reading));
        let sign = number_of(Column::Sign, "sign", Some(1.0), None);
        let min = number_of(Column::Min, "min", Some(f64::NEG_INFINITY), Some(of_reading));
        let max = number_of(Column::Max, "max", Some(f64::INFINITY), Some(of_reading));
        if let Some(sign) = sign.filter(|sign| sign.abs() != 1.0) {
            let wrong = Diagnostic::error(Code::NotANumber, format!("a sign is 1 or -1, and this is {sign}"));
            found.push(wrong.at_data(place(Some("sign"), text(Column::Sign))));
        }
        let reads = reads?;
        let (mut theta, mut d, offset) = (theta?, d?, offset?);
        match reads {
            Reads::Angle => theta += offset,
            Reads::Length => d += offset,
            Reads::Nothing => {}
        }
        let name = text(Column::Name).map_or_else(|| format!("J{number}"), str::to_owned);
        let row = Row { name, reads, numbers: [theta, d, a?, alpha?, beta?] };
        let limits = Some(Limits { min: min?, max: max? }).filter(Limits::are_useful);
        Some(Read { row, reversed: sign? < 0.0, limits, line })
    }
}

/// The robot of a table. A reversed reading turns its axis round: *Z(−q) = Rx(π)·Z(q)·Rx(π)*.
fn robot(file: &str, rows: &[Read], convention: Convention, words: String, length: &str, angle: &str) -> Robot {
    let plain: Vec<Row<f64>> = rows.iter().map(|read| read.row.clone()).collect();
    let stated: Serial<f64> = serial_of(&plain, convention);
    let moving: Vec<&Read> = rows.iter().filter(|read| read.row.reads != Reads::Nothing).collect();
    let mut round = Motion::none();
    (round.rotation[1][1], round.rotation[2][2]) = (-1.0, -1.0);
    let mut serial = Serial::default();
    let mut before = Motion::none();
    for ((constant, joint), read) in stated.constants.iter().zip(&stated.joints).zip(&moving) {
        let flip = if read.reversed { round } else { Motion::none() };
        serial.push(&before.then(constant).then(&flip));
        serial.joint(&joint.name, joint.kind);
        before = flip;
    }
    serial.push(&stated.constants.last().map_or(before, |last| before.then(last)));
    let readings = moving.iter().zip(&stated.joints).map(|(read, joint)| {
        let whole = if joint.kind == Kind::Revolute { PI } else { 0.0 };
        Reading::of_joint(joint, read.limits.unwrap_or(Limits { min: -whole, max: whole }))
    });
    let readings = readings.collect();
    let stem =
        std::path::Path::new(file).file_stem().map_or("robot".into(), |stem| stem.to_string_lossy().into_owned());
    Robot { name: stem, source: words, serial, readings, length: length.to_owned(), angle: angle.to_owned() }
}
