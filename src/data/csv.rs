//! From the files of a measurement to a table.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use super::ahead::Ahead;
use super::heading::Reading;
use super::intake::Intake;
use super::lines::Lines;
use super::records::{Record, Records};
use super::table::Table;
use super::watch::{Watch, Watched};
use crate::compile::Program;
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::model::DataFile;

/// The path that stands for standard input.
pub const STANDARD_INPUT: &str = "-";

/// What the files of a measurement say.
#[derive(Clone, Debug)]
pub struct Data {
    /// All their rows.
    pub table: Table,
    /// The files that were there, in the order of the rows.
    pub files: Vec<FileRead>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileRead {
    /// The file, as given.
    pub file: String,
    /// How many rows it has.
    pub rows: usize,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub fingerprint: String,
}

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
    read_files(program, measurement, files, directory, &Watch::default(), diagnostics).map(|data| data.table)
}

/// The same as [`read`], with what is worth knowing of each file. Every file is read once; `watch` is told how many of its bytes.
pub fn read_files(
    program: &Program,
    measurement: usize,
    files: &[DataFile],
    directory: &Path,
    watch: &Watch,
    diagnostics: &mut Diagnostics,
) -> Option<Data> {
    let declared = program.measurement(measurement).map_err(|found| diagnostics.push(*found)).ok()?;
    let table = Table::new(declared.keys.len(), declared.inputs.len());
    let mut data = Data { table, files: Vec::new() };
    let mut found = Diagnostics::new();
    for file in files {
        let given = file.file.value.as_str();
        let path = directory.join(given);
        let name = if given == STANDARD_INPUT { "standard input".to_owned() } else { path.display().to_string() };
        let reading = Reading { program, measurement: declared, file, name: &name };
        if given == STANDARD_INPUT {
            data.take(&reading, io::stdin(), &mut found);
            continue;
        }
        match File::open(&path) {
            Ok(open) => {
                let length = open.metadata().map_or(0, |of| of.len());
                let watched = Watched { from: open, read: 0, length, watch: watch.clone() };
                data.take(&reading, watched, &mut found);
            }
            Err(error) => found.push(cannot_open(&reading, &error)),
        }
    }
    let failed = found.has_errors();
    diagnostics.extend(found);
    if !failed {
        diagnostics.extend(data.table.refused());
    }
    (!failed).then_some(data)
}

/// Reads what is no file as if it were one, with the name that messages give it.
pub fn read_input(
    program: &Program,
    measurement: usize,
    file: &DataFile,
    input: impl BufRead,
    diagnostics: &mut Diagnostics,
) -> Option<Table> {
    let declared = program.measurement(measurement).map_err(|found| diagnostics.push(*found)).ok()?;
    let mut table = Table::new(declared.keys.len(), declared.inputs.len());
    let mut found = Diagnostics::new();
    let name = file.file.value.as_str();
    read_from(&Reading { program, measurement: declared, file, name }, input, &mut table, &mut found);
    let failed = found.has_errors();
    diagnostics.extend(found);
    (!failed).then_some(table)
}

/// Reads standard input as it comes: `each` is called with a table of the row that came last, and says whether to go on. A
/// mistake ends it, and so does a last line without its end, which may have lost digits. Where `stop` says so nothing more is
/// waited for.
pub fn follow(
    program: &Program,
    measurement: usize,
    diagnostics: &mut Diagnostics,
    stop: &dyn Fn() -> bool,
    each: &mut dyn FnMut(&Table) -> bool,
) -> Option<FileRead> {
    let declared = program.measurement(measurement).map_err(|found| diagnostics.push(*found)).ok()?;
    let file = DataFile { file: STANDARD_INPUT.into(), ..DataFile::default() };
    let reading = Reading { program, measurement: declared, file: &file, name: "standard input" };
    let input = Ahead::new(io::stdin()).map_err(|error| diagnostics.push(unreadable(&reading, &error))).ok()?;
    let mut input = input.until(stop);
    let (empty, mut rows) = (Table::new(declared.keys.len(), declared.inputs.len()), 0);
    let mut table = empty.clone();
    let mut one = |table: &mut Table| {
        rows += 1;
        let more = each(table);
        *table = empty.clone();
        table.begin(reading.name);
        more
    };
    let mut found = Diagnostics::new();
    read_rows(&reading, &mut input, &mut table, &mut found, Some(&mut one));
    // what came of a row when it was stopped is nobody's mistake
    if !stop() {
        diagnostics.extend(found);
    }
    let fingerprint = input.fingerprint().unwrap_or_default();
    Some(FileRead { file: STANDARD_INPUT.to_owned(), rows, fingerprint })
}

impl Data {
    /// Reads one file.
    fn take(&mut self, reading: &Reading, input: impl Read + Send + 'static, found: &mut Diagnostics) {
        let before = self.table.rows();
        let mut input = match Ahead::new(input) {
            Ok(input) => input,
            Err(error) => return found.push(unreadable(reading, &error)),
        };
        read_from(reading, &mut input, &mut self.table, found);
        // where the end was not reached, it is said why
        let Some(fingerprint) = input.fingerprint() else { return };
        let (file, rows) = (reading.file.file.value.clone(), self.table.rows() - before);
        self.files.push(FileRead { file, rows, fingerprint });
    }
}

fn cannot_open(reading: &Reading, error: &io::Error) -> Diagnostic {
    let name = reading.name;
    let found = match error.kind() {
        io::ErrorKind::NotFound if reading.file.optional => {
            Diagnostic::warning(Code::OptionalAbsent, format!("the optional data file `{name}` is absent"))
        }
        io::ErrorKind::NotFound => Diagnostic::error(Code::DataFileMissing, format!("there is no file `{name}`")).hint(
            "paths in a model are relative to the model file, those of the command line to the folder in which it runs",
        ),
        _ => return unreadable(reading, error),
    };
    found.at_data(DataPlace::file(name))
}

/// Reads one file. With mistakes the table may have part of its rows.
pub(super) fn read_from(reading: &Reading, input: impl BufRead, table: &mut Table, found: &mut Diagnostics) {
    read_rows(reading, input, table, found, None);
}

/// The same, with `each` called after every row; it says whether to go on. The last line has to have an end then.
pub(super) fn read_rows(
    reading: &Reading,
    input: impl BufRead,
    table: &mut Table,
    found: &mut Diagnostics,
    mut each: Option<&mut dyn FnMut(&mut Table) -> bool>,
) {
    let lines = Lines::new(input);
    let cut = lines.cut();
    let mut lines = BufReader::new(lines);
    let (head, delimiter) = match head(&mut lines, reading.file.columns.len()) {
        Ok(found) => found,
        Err(error) => return found.push(unreadable(reading, &error)),
    };
    let mut records = Records::new(head, lines, delimiter);

    table.begin(reading.name);
    let mut rows: Option<Intake> = None;
    let mut skip = reading.file.header && !reading.file.columns.is_empty();
    if !reading.file.columns.is_empty() {
        let names: Vec<String> = reading.file.columns.iter().map(|name| name.value.trim().to_owned()).collect();
        let Some(plan) = reading.plan(&names, None, found) else { return };
        rows = Some(Intake::new(reading, plan, names));
    }
    loop {
        match records.advance() {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return found.push(unreadable(reading, &error)),
        }
        let (record, line) = (records.record(), records.line());
        if record.len() == 1 && record.text.trim_ascii().is_empty() {
            continue;
        }
        if std::mem::take(&mut skip) {
            continue;
        }
        match &mut rows {
            Some(rows) if each.is_some() && cut.get() => return found.push(cut_short(reading, rows.count() + 1, line)),
            Some(rows) => {
                let before = table.rows();
                rows.take(record, line, table, found);
                if let Some(each) = &mut each
                    && (table.rows() == before || !each(table))
                {
                    return;
                }
            }
            None => {
                let Some(names) = heading(reading, record, line, found) else { return };
                let Some(plan) = reading.plan(&names, Some(line), found) else { return };
                rows = Some(Intake::new(reading, plan, names));
            }
        }
    }
    match rows {
        Some(rows) if rows.count() > 0 => rows.finish(table, found),
        Some(_) => found.push(no_rows(reading, "there is no row of data")),
        None => found.push(no_rows(reading, "the file is empty: it has no heading")),
    }
}

fn unreadable(reading: &Reading, error: &io::Error) -> Diagnostic {
    let message = format!("`{}` cannot be read: {error}", reading.name);
    if error.kind() == io::ErrorKind::FileTooLarge {
        let found = Diagnostic::error(Code::TooLong, message).at_data(DataPlace::file(reading.name));
        return found.hint("a quote may not be closed, or the file is no table");
    }
    Diagnostic::error(Code::UnreadableFile, message).at_data(DataPlace::file(reading.name))
}

fn cut_short(reading: &Reading, row: usize, line: usize) -> Diagnostic {
    let message = format!("the data end in the middle of row {row}");
    let place = DataPlace { line: Some(line), row: Some(row), ..DataPlace::file(reading.name) };
    let hint = "rows before it are in the state that `--save` writes: go on from it with `--resume`; a whole row ends with its line";
    Diagnostic::error(Code::CutShort, message).at_data(place).hint(hint)
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
        let line = head.get(start..).unwrap_or_default().trim_ascii();
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

fn heading(reading: &Reading, record: Record, line: usize, found: &mut Diagnostics) -> Option<Vec<String>> {
    let names: Option<Vec<String>> =
        record.cells().map(|name| std::str::from_utf8(name).ok().map(|name| name.trim().to_owned())).collect();
    if names.is_none() {
        let place = DataPlace { line: Some(line), ..DataPlace::file(reading.name) };
        let wrong = Diagnostic::error(Code::UnreadableFile, "the heading is not UTF-8 text").at_data(place);
        found.push(wrong.hint("save the file again as UTF-8"));
    }
    names
}
