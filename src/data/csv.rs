//! From the files of a measurement to a table.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder};

use super::cell::{self, Wrong};
use super::column::Column;
use super::heading::{Origin, Plan, Reading, unit_name};
use super::lines::Lines;
use super::table::Table;
use crate::compile::{Input, Measurement, Program};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::model::DataFile;
use crate::unit::{Dimension, Unit};

/// The path that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// Mistakes of one file that are reported one by one.
const MOST_MISTAKES: usize = 20;

const BUFFER: usize = 1 << 16;

/// Reads the files of a measurement, with paths relative to `directory`, into one table.
///
/// Everything that is wrong with any of the files is reported, and then there is no table. Where all files are optional and
/// absent the table has no rows.
pub fn read(
    program: &Program,
    measurement: usize,
    files: &[DataFile],
    directory: &Path,
    diagnostics: &mut Diagnostics,
) -> Option<Table> {
    let declared = &program.measurements[measurement];
    let mut table = Table::new(declared.keys.len(), declared.inputs.len());
    let mut found = Diagnostics::new();
    for file in files {
        let given = file.file.value.as_str();
        let path = directory.join(given);
        let name = if given == STANDARD_INPUT { "standard input".to_owned() } else { path.display().to_string() };
        let reading = Reading { program, measurement: declared, file, name: &name };
        if given == STANDARD_INPUT {
            read_from(&reading, io::stdin().lock(), &mut table, &mut found);
            continue;
        }
        match File::open(&path) {
            Ok(open) => read_from(&reading, open, &mut table, &mut found),
            Err(error) => found.push(cannot_open(&reading, &error)),
        }
    }
    found.extend(large_angles(declared, &table));
    let failed = found.has_errors();
    diagnostics.extend(found);
    (!failed).then_some(table)
}

/// Columns declared in radians that read more than two turns, which no instrument does: they are in degrees or gon.
fn large_angles(declared: &Measurement, table: &Table) -> Vec<Diagnostic> {
    let radians = Unit { factor: 1.0, dimension: Dimension::ANGLE };
    let suspicious = |(i, input): (usize, &Input)| {
        let large = |row: &usize| table.row(*row)[i].abs() > 2.0 * std::f64::consts::TAU;
        let row = (0..table.rows()).find(large).filter(|_| input.unit == radians && !input.dms)?;
        let message = format!("the column `{}` reads {} rad, more than two turns", input.name, table.row(row)[i]);
        let place = DataPlace { column: Some(input.name.clone()), ..table.place(row) };
        let hint = "if it is in degrees or gon, declare `unit: \"deg\"` or `unit: \"gon\"`";
        Some(Diagnostic::warning(Code::LargeAngle, message).at_data(place).hint(hint))
    };
    declared.inputs.iter().enumerate().filter_map(suspicious).collect()
}

fn cannot_open(reading: &Reading, error: &io::Error) -> Diagnostic {
    let name = reading.name;
    let found = match error.kind() {
        io::ErrorKind::NotFound if reading.file.optional => {
            Diagnostic::warning(Code::OptionalAbsent, format!("the optional data file `{name}` is absent"))
        }
        io::ErrorKind::NotFound => Diagnostic::error(Code::DataFileMissing, format!("there is no file `{name}`"))
            .hint("paths in a model are relative to the model file"),
        _ => Diagnostic::error(Code::UnreadableFile, format!("`{name}` cannot be read: {error}")),
    };
    found.at_data(DataPlace::file(name))
}

/// Reads one file. With mistakes the table may have part of its rows.
pub(super) fn read_from(reading: &Reading, input: impl Read, table: &mut Table, found: &mut Diagnostics) {
    let mut lines = BufReader::with_capacity(BUFFER, Lines::new(BufReader::with_capacity(BUFFER, input)));
    let unreadable = |error: &dyn std::error::Error| {
        let message = format!("`{}` cannot be read: {error}", reading.name);
        Diagnostic::error(Code::UnreadableFile, message).at_data(DataPlace::file(reading.name))
    };
    let (head, delimiter) = match head(&mut lines, reading.file.columns.len()) {
        Ok(found) => found,
        Err(error) => return found.push(unreadable(&error)),
    };
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(delimiter)
        .buffer_capacity(BUFFER)
        .from_reader(Cursor::new(head).chain(lines));

    table.begin(reading.name);
    let mut rows: Option<Rows> = None;
    let mut skip = reading.file.header && !reading.file.columns.is_empty();
    let mut record = ByteRecord::new();
    if !reading.file.columns.is_empty() {
        let names: Vec<String> = reading.file.columns.iter().map(|name| name.value.trim().to_owned()).collect();
        let Some(plan) = reading.plan(&names, None, found) else { return };
        rows = Some(Rows::new(reading, plan, names));
    }
    loop {
        match reader.read_byte_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return found.push(unreadable(&error)),
        }
        if record.len() == 1 && record.as_slice().trim_ascii().is_empty() {
            continue;
        }
        if std::mem::take(&mut skip) {
            continue;
        }
        let line = first_line(&record, reader.position().line());
        match &mut rows {
            Some(rows) => rows.take(&record, line, table, found),
            None => {
                let Some(names) = heading(reading, &record, line, found) else { return };
                let Some(plan) = reading.plan(&names, Some(line), found) else { return };
                rows = Some(Rows::new(reading, plan, names));
            }
        }
    }
    match rows {
        Some(rows) if rows.count > 0 => rows.finish(found),
        Some(_) => found.push(no_rows(reading, "there is no row of data")),
        None => found.push(no_rows(reading, "the file is empty: it has no heading")),
    }
}

fn no_rows(reading: &Reading, message: &str) -> Diagnostic {
    Diagnostic::error(Code::NoRows, message).at_data(DataPlace::file(reading.name))
}

/// All up to the first line that says something, without a byte-order mark, and what separates its fields.
fn head(lines: &mut impl BufRead, columns: usize) -> io::Result<(Vec<u8>, u8)> {
    let mut head = Vec::new();
    loop {
        let start = head.len();
        if lines.read_until(b'\n', &mut head)? == 0 {
            return Ok((head, b','));
        }
        if start == 0 && head.starts_with(b"\xef\xbb\xbf") {
            head.drain(..3);
        }
        let line = head[start..].trim_ascii();
        if !line.is_empty() && !line.starts_with(b"#") {
            let delimiter = delimiter(line, columns);
            return Ok((head, delimiter));
        }
    }
}

/// The comma, unless only another separator is there, or gives the number of columns that is wanted where the comma does not.
fn delimiter(line: &[u8], columns: usize) -> u8 {
    const KNOWN: [u8; 3] = [b',', b';', b'\t'];
    let count = |delimiter| line.iter().filter(|&&byte| byte == delimiter).count();
    let fits = KNOWN.into_iter().find(|&delimiter| columns > 1 && count(delimiter) + 1 == columns);
    fits.or_else(|| KNOWN.into_iter().find(|&delimiter| count(delimiter) > 0)).unwrap_or(b',')
}

/// The line on which a record begins, where the reader is at line `after`. All lines end with `\n` here.
fn first_line(record: &ByteRecord, after: u64) -> usize {
    let text = record.as_slice();
    let inside = text.iter().filter(|&&byte| byte == b'\n').count();
    // a quote that is never closed has swallowed its own line's end too
    let own = usize::from(text.last() != Some(&b'\n'));
    usize::try_from(after).unwrap_or(usize::MAX).saturating_sub(inside + own).max(1)
}

fn heading(reading: &Reading, record: &ByteRecord, line: usize, found: &mut Diagnostics) -> Option<Vec<String>> {
    let names: Option<Vec<String>> =
        record.iter().map(|name| std::str::from_utf8(name).ok().map(|name| name.trim().to_owned())).collect();
    if names.is_none() {
        let place = DataPlace { line: Some(line), ..DataPlace::file(reading.name) };
        let wrong = Diagnostic::error(Code::UnreadableFile, "the heading is not UTF-8 text").at_data(place);
        found.push(wrong.hint("save the file again as UTF-8"));
    }
    names
}

/// Rows on their way into the table.
struct Rows<'a> {
    reading: &'a Reading<'a>,
    plan: Plan,
    names: Vec<String>,
    columns: Vec<Column>,
    units: Vec<String>,
    /// rows seen, good or not
    count: usize,
    readings: Vec<f64>,
    mistakes: usize,
    /// the first mistake that is counted only
    hidden: Option<(Code, DataPlace)>,
}

impl<'a> Rows<'a> {
    fn new(reading: &'a Reading<'a>, plan: Plan, names: Vec<String>) -> Self {
        let inputs = &reading.measurement.inputs;
        Rows {
            reading,
            plan,
            names,
            columns: inputs.iter().map(|input| Column::new(&reading.program.units, input)).collect(),
            units: inputs.iter().map(|input| unit_name(reading.program, input)).collect(),
            count: 0,
            readings: Vec::with_capacity(inputs.len()),
            mistakes: 0,
            hidden: None,
        }
    }

    fn take(&mut self, record: &ByteRecord, line: usize, table: &mut Table, found: &mut Diagnostics) {
        self.count += 1;
        if record.len() != self.names.len() {
            let message = format!("the row has {} fields, and there are {} columns", record.len(), self.names.len());
            let hint = Some("a decimal comma, a missing value and a missing quote are the usual causes".to_owned());
            return self.mistake(Wrong { code: Code::FieldCount, message, hint }, line, None, found);
        }
        let before = self.mistakes;
        self.readings.clear();
        for i in 0..self.plan.inputs.len() {
            let value = match self.plan.inputs[i] {
                Origin::Whole(value) => value,
                Origin::Cell(at) => match self.reading(i, &record[at]) {
                    Ok(value) => value,
                    Err(wrong) => {
                        self.mistake(wrong, line, Some((at, &record[at])), found);
                        0.0
                    }
                },
            };
            self.readings.push(value);
        }
        for k in 0..self.plan.keys.len() {
            if let Origin::Cell(at) = self.plan.keys[k]
                && let Err(wrong) = cell::text(&record[at])
            {
                self.mistake(wrong, line, Some((at, &record[at])), found);
            }
        }
        if self.mistakes > before {
            return;
        }
        let name = |k: usize| match &self.plan.keys[k] {
            Origin::Whole(name) => name.as_str(),
            Origin::Cell(at) => cell::text(&record[*at]).unwrap_or_default(),
        };
        table.push_with(name, &self.readings, Some(line));
    }

    /// The reading of input `i` in internal units.
    fn reading(&self, i: usize, cell: &[u8]) -> Result<f64, Wrong> {
        let value = match self.reading.measurement.inputs[i].dms {
            true => cell::angle(cell)?,
            false => cell::number(cell, &self.units[i])?,
        };
        let reading = self.columns[i].to_internal(value);
        if reading.is_finite() { Ok(reading) } else { Err(cell::not_finite(cell)) }
    }

    fn mistake(&mut self, wrong: Wrong, line: usize, cell: Option<(usize, &[u8])>, found: &mut Diagnostics) {
        self.mistakes += 1;
        let place = DataPlace {
            file: self.reading.name.to_owned(),
            line: Some(line),
            row: Some(self.count),
            column: cell.map(|(at, _)| self.names[at].clone()),
            value: cell.map(|(_, value)| cell::shown(value)),
        };
        if self.mistakes > MOST_MISTAKES {
            self.hidden.get_or_insert((wrong.code, place));
            return;
        }
        found.push(Diagnostic::error(wrong.code, wrong.message).at_data(place).maybe_hint(wrong.hint));
    }

    /// Says how many mistakes have not been said.
    fn finish(self, found: &mut Diagnostics) {
        if let Some((code, place)) = self.hidden {
            let more = self.mistakes - MOST_MISTAKES;
            let message = format!("{more} more mistake{} from here on", if more == 1 { "" } else { "s" });
            let place = DataPlace { column: None, value: None, ..place };
            found.push(Diagnostic::error(code, message).at_data(place));
        }
    }
}
