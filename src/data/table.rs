//! A table of readings.

use std::borrow::Cow;
use std::io;
use std::ops::Range;

use super::names::Names;
use super::rows::{Buffer, Row, Rows};
use super::store::{IN_MEMORY, Store};
use crate::diag::{Code, DataPlace, Diagnostic};

/// Rows that are copied from table to table at once.
const PIECE: usize = 1024;

/// The rows of one measurement: readings in internal units, names of the key columns, and where each row stands.
///
/// Whatever the number of rows, no more than eight megabytes of them are in memory; the others are in a temporary file. So a
/// table is read in pieces, by any number of threads at once:
///
/// ```
/// use phical::data::{Buffer, Table};
/// let mut table = Table::new(1, 2);
/// table.begin("front.csv");
/// table.push(&["a"], &[1.0, 2.0], Some(2))?;
/// table.push(&["b"], &[3.0, 4.0], Some(3))?;
///
/// let mut buffer = Buffer::default(); // one for all pieces
/// let rows = table.read(0..2, &mut buffer)?;
/// assert_eq!((rows.readings(), rows.row(1)), (&[1.0, 2.0, 3.0, 4.0][..], &[3.0, 4.0][..]));
/// assert_eq!(table.names(0)[rows.keys(1)[0] as usize], "b");
///
/// assert_eq!(table.row(1), [3.0, 4.0]);
/// assert_eq!((table.rows(), table.key(1, 0)), (2, "b"));
/// assert_eq!((table.place(1).line, table.place(1).row), (Some(3), Some(2)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Table {
    keys: Vec<Names>,
    /// of each row its readings, the number of its name in each key column, and its line, zero where it is not known
    store: Store,
    /// each file, and the first row that came from it
    files: Vec<(String, usize)>,
}

/// A row, or a table, of other columns than the table it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} names and {} readings are given to a table of {} key columns and {} inputs", .found.0, .found.1, .wanted.0, .wanted.1)]
pub struct ColumnError {
    /// How many names and readings are given.
    pub found: (usize, usize),
    /// How many key columns and inputs the table has.
    pub wanted: (usize, usize),
}

/// A table without columns and rows.
impl Default for Table {
    fn default() -> Self {
        Table::new(0, 0)
    }
}

impl Table {
    /// A table without rows, for so many key columns and inputs.
    #[must_use]
    pub fn new(keys: usize, inputs: usize) -> Self {
        Table::with_bound(keys, inputs, IN_MEMORY)
    }

    /// The same that keeps no more than so many bytes of rows in memory.
    pub(super) fn with_bound(keys: usize, inputs: usize, bytes: usize) -> Self {
        let store = Store::new(inputs, keys + 1, bytes);
        Table { keys: vec![Names::default(); keys], store, files: Vec::new() }
    }

    /// Says from which file the rows come that are pushed from now on.
    pub fn begin(&mut self, file: &str) {
        self.files.push((file.to_owned(), self.rows()));
    }

    /// Adds a row: a name for each key column, a reading for each input, and the line of the file where there is one.
    ///
    /// # Errors
    ///
    /// Where there are not as many names and readings as the table has columns; the table is then as it was.
    pub fn push(&mut self, keys: &[&str], readings: &[f64], line: Option<usize>) -> Result<(), ColumnError> {
        self.fits(keys.len(), readings.len())?;
        self.put(keys.iter().copied(), readings, line);
        Ok(())
    }

    /// Adds a row of which `name` gives the name in each key column, and which has as many readings as the table.
    pub(crate) fn push_with<'k>(&mut self, name: impl Fn(usize) -> &'k str, readings: &[f64], line: Option<usize>) {
        self.put((0..).map(name), readings, line);
    }

    /// Adds a row that has been made for this table: were there less than its columns, names would be empty and readings not
    /// numbers, and what is beyond is left out.
    pub(crate) fn put<'k>(&mut self, names: impl IntoIterator<Item = &'k str>, readings: &[f64], line: Option<usize>) {
        let line = line.and_then(|line| u32::try_from(line).ok()).unwrap_or(0);
        let names = names.into_iter().chain(std::iter::repeat(""));
        let numbers = self.keys.iter_mut().zip(names).map(|(column, name)| column.intern(name));
        self.store.push(readings, numbers.chain([line]));
    }

    /// Whether a row of so many names and readings, or a table of such rows, has the columns of this one.
    pub(crate) fn fits(&self, keys: usize, inputs: usize) -> Result<(), ColumnError> {
        let wanted = (self.keys.len(), self.width());
        if (keys, inputs) == wanted { Ok(()) } else { Err(ColumnError { found: (keys, inputs), wanted }) }
    }

    /// Adds the rows of another table of the same columns.
    ///
    /// # Errors
    ///
    /// Where the other one has not as many columns, or its temporary file cannot be read.
    pub fn append(&mut self, other: &Table) -> io::Result<()> {
        self.fits(other.keys.len(), other.width())
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        let before = self.rows();
        self.files.extend(other.files.iter().map(|(name, first)| (name.clone(), before + first)));
        let numbers: Vec<Vec<u32>> = self
            .keys
            .iter_mut()
            .zip(&other.keys)
            .map(|(column, more)| more.all().iter().map(|name| column.intern(name)).collect())
            .collect();
        let mut buffer = Buffer::default();
        for first in (0..other.rows()).step_by(PIECE) {
            let rows = other.read(first..other.rows().min(first + PIECE), &mut buffer)?;
            for i in 0..rows.len() {
                let line = rows.line(i).and_then(|line| u32::try_from(line).ok()).unwrap_or(0);
                let number =
                    |(&key, numbers): (&u32, &Vec<u32>)| numbers.get(key as usize).copied().unwrap_or(u32::MAX);
                let keys = rows.keys(i).iter().zip(&numbers).map(number);
                self.store.push(rows.row(i), keys.chain([line]));
            }
        }
        Ok(())
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.store.rows()
    }

    /// How many key columns there are.
    #[must_use]
    pub fn keys(&self) -> usize {
        self.keys.len()
    }

    /// How many readings a row has.
    #[must_use]
    pub fn width(&self) -> usize {
        self.store.width()
    }

    /// Consecutive rows. Those in memory are given as they are, those in the temporary file are read into the buffer, which is
    /// best used again for the next piece.
    ///
    /// # Errors
    ///
    /// Where the table has not all these rows, or its temporary file cannot be read; [`unreadable`](Self::unreadable) says so
    /// to the user.
    pub fn read<'a>(&'a self, rows: Range<usize>, buffer: &'a mut Buffer) -> io::Result<Rows<'a>> {
        self.store.read(rows, buffer)
    }

    /// What there is to say where [`read`](Self::read) fails.
    #[must_use]
    pub fn unreadable(error: &io::Error) -> Diagnostic {
        Diagnostic::error(Code::UnreadableFile, format!("the temporary file of rows cannot be read: {error}"))
    }

    /// What there is to say where no temporary file could be written, so that all further rows are in memory.
    #[must_use]
    pub fn refused(&self) -> Option<Diagnostic> {
        let why = self.store.refused()?;
        let message = format!("rows are kept in memory, for no temporary file can be written: {why}");
        let hint = "make room in the directory for temporary files, or name another by `TMPDIR`";
        Some(Diagnostic::warning(Code::RowsInMemory, message).hint(hint))
    }

    /// The readings of a row, in the order of the measurement's inputs. Those of a row that is not there, or cannot be read
    /// from the temporary file, are not numbers. All rows are better read by [`read`](Self::read).
    #[must_use]
    pub fn row(&self, row: usize) -> Row<'_> {
        let fetched = || self.store.fetch(row).unwrap_or_else(|_| vec![f64::NAN; self.width()]);
        Row(self.store.held(row).map_or_else(|| Cow::Owned(fetched()), Cow::Borrowed))
    }

    /// The name in a key column; empty where there is none, or it cannot be read from the temporary file.
    #[must_use]
    pub fn key(&self, row: usize, column: usize) -> &str {
        self.names(column).get(self.key_index(row, column) as usize).map_or("", String::as_str)
    }

    /// The number of that name in [`names`](Self::names); the largest there is where there is no such
    /// row or column, or it cannot be read from the temporary file.
    #[must_use]
    pub fn key_index(&self, row: usize, column: usize) -> u32 {
        // the number after the names is the line
        if column < self.keys.len() { self.store.number(row, column).unwrap_or(u32::MAX) } else { u32::MAX }
    }

    /// The distinct names of a key column, in the order of their first appearance; none of a column that is not there.
    #[must_use]
    pub fn names(&self, column: usize) -> &[String] {
        self.keys.get(column).map_or(&[], Names::all)
    }

    /// Where a row stands: its file, the line where that is known, and the row of that file counted from one.
    #[must_use]
    pub fn place(&self, row: usize) -> DataPlace {
        // of files without rows that begin at the same row, the last one has it
        let file = self.files.iter().rfind(|(_, first)| *first <= row);
        let (name, first) = file.map_or(("", 0), |(name, first)| (name.as_str(), *first));
        let line = (row < self.rows()).then(|| self.store.number(row, self.keys.len()).unwrap_or(0) as usize);
        DataPlace {
            line: line.filter(|&line| line > 0),
            row: Some((row - first).saturating_add(1)),
            ..DataPlace::file(name)
        }
    }

    #[cfg(test)]
    pub(super) fn store(&self) -> &Store {
        &self.store
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(file: &str, names: &[&str]) -> Table {
        let mut table = Table::new(1, 1);
        table.begin(file);
        for (i, name) in names.iter().enumerate() {
            table.push(&[name], &[i as f64], Some(i + 2)).expect("a row of the table");
        }
        table
    }

    #[test]
    fn appended_tables_share_names_and_keep_their_places() {
        let mut table = of("one.csv", &["a", "b", "b"]);
        table.append(&of("none.csv", &[])).unwrap();
        table.append(&of("two.csv", &["c", "a"])).unwrap();
        assert_eq!(table.names(0), ["a", "b", "c"]);
        let all: Vec<&str> = (0..table.rows()).map(|row| table.key(row, 0)).collect();
        assert_eq!(all, ["a", "b", "b", "c", "a"]);
        assert_eq!((table.key_index(3, 0), table.key_index(4, 0)), (2, 0));
        assert_eq!(table.row(4), [1.0]);
        for (row, file, line, number) in
            [(0, "one.csv", 2, 1), (2, "one.csv", 4, 3), (3, "two.csv", 2, 1), (4, "two.csv", 3, 2)]
        {
            let place = table.place(row);
            assert_eq!((place.file.as_str(), place.line, place.row), (file, Some(line), Some(number)));
        }
    }

    #[test]
    fn a_table_without_readings_has_rows_all_the_same() {
        let mut table = Table::new(1, 0);
        table.push(&["a"], &[], None).expect("a row of the table");
        table.push(&["b"], &[], None).expect("a row of the table");
        assert_eq!((table.rows(), table.row(1).len(), table.key(1, 0)), (2, 0, "b"));
        assert_eq!(table.place(1), DataPlace { row: Some(2), ..DataPlace::default() });
    }

    #[test]
    fn rows_that_cannot_be_written_stay_in_memory() {
        let mut table = Table::with_bound(1, 1, 100);
        table.store.fill_disk();
        for row in 0..50 {
            table.push(&["a"], &[row as f64], Some(row + 2)).expect("a row of the table");
        }
        assert_eq!((table.rows(), table.store().in_files()), (50, 0));
        assert!((0..50).all(|row| table.row(row) == [row as f64] && table.place(row).line == Some(row + 2)));
        assert_eq!(table.refused().unwrap().code.id(), "W012");
        assert!(of("a.csv", &["a"]).refused().is_none());
    }
}
