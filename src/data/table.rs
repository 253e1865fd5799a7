//! A table of readings.

use std::collections::HashMap;

use crate::diag::DataPlace;

/// The rows of one measurement: readings in internal units, names of the key columns, and where each row stands.
///
/// ```
/// use phical::data::Table;
/// let mut table = Table::new(1, 2);
/// table.begin("front.csv");
/// table.push(&["a"], &[1.0, 2.0], Some(2));
/// table.push(&["b"], &[3.0, 4.0], Some(3));
/// assert_eq!((table.rows(), table.row(1), table.key(1, 0)), (2, &[3.0, 4.0][..], "b"));
/// assert_eq!((table.place(1).line, table.place(1).row), (Some(3), Some(2)));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Table {
    width: usize,
    readings: Vec<f64>,
    keys: Vec<Names>,
    /// the line of each row, zero where it is not known
    lines: Vec<u32>,
    /// each file, and the first row that came from it
    files: Vec<(String, usize)>,
}

/// A column of names, each stored once.
#[derive(Clone, Debug, Default)]
struct Names {
    names: Vec<String>,
    known: HashMap<String, u32>,
    rows: Vec<u32>,
}

impl Names {
    /// The number of a name, new or known.
    fn intern(&mut self, name: &str) -> u32 {
        // neighbouring rows mostly have the same name
        if let Some(&last) = self.rows.last()
            && self.names.get(last as usize).is_some_and(|known| known == name)
        {
            return last;
        }
        if let Some(&known) = self.known.get(name) {
            return known;
        }
        let number = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
        self.names.push(name.to_owned());
        self.known.insert(name.to_owned(), number);
        number
    }
}

impl Table {
    /// A table without rows, for so many key columns and inputs.
    #[must_use]
    pub fn new(keys: usize, inputs: usize) -> Self {
        Table { width: inputs, keys: vec![Names::default(); keys], ..Table::default() }
    }

    /// Says from which file the rows come that are pushed from now on.
    pub fn begin(&mut self, file: &str) {
        self.files.push((file.to_owned(), self.rows()));
    }

    /// Adds a row: a name for each key column, a reading for each input, and the line of the file where there is one.
    ///
    /// # Panics
    ///
    /// Where there are not as many names and readings as the table has columns.
    pub fn push(&mut self, keys: &[&str], readings: &[f64], line: Option<usize>) {
        assert_eq!((keys.len(), readings.len()), (self.keys.len(), self.width), "a row has one value for each column");
        self.push_with(|k| keys[k], readings, line);
    }

    /// Adds a row of which `name` gives the name in each key column, and which has as many readings as the table.
    pub(crate) fn push_with<'k>(&mut self, name: impl Fn(usize) -> &'k str, readings: &[f64], line: Option<usize>) {
        for (k, column) in self.keys.iter_mut().enumerate() {
            let number = column.intern(name(k));
            column.rows.push(number);
        }
        self.readings.extend_from_slice(readings);
        self.lines.push(line.and_then(|line| u32::try_from(line).ok()).unwrap_or(0));
    }

    /// Adds the rows of another table of the same columns.
    ///
    /// # Panics
    ///
    /// Where the other one has not as many columns.
    pub fn append(&mut self, other: &Table) {
        assert_eq!((self.keys.len(), self.width), (other.keys.len(), other.width), "tables of the same columns");
        let before = self.rows();
        self.files.extend(other.files.iter().map(|(name, first)| (name.clone(), before + first)));
        for (column, more) in self.keys.iter_mut().zip(&other.keys) {
            let numbers: Vec<u32> = more.names.iter().map(|name| column.intern(name)).collect();
            column.rows.extend(more.rows.iter().map(|&row| numbers[row as usize]));
        }
        self.readings.extend_from_slice(&other.readings);
        self.lines.extend_from_slice(&other.lines);
    }

    /// How many rows there are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// How many readings a row has.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// All readings in internal units, row after row.
    #[must_use]
    pub fn readings(&self) -> &[f64] {
        &self.readings
    }

    /// The readings of a row, in the order of the measurement's inputs.
    #[must_use]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.readings[row * self.width..(row + 1) * self.width]
    }

    /// The name in a key column.
    #[must_use]
    pub fn key(&self, row: usize, column: usize) -> &str {
        let names = &self.keys[column];
        &names.names[names.rows[row] as usize]
    }

    /// The number of that name in [`names`](Self::names).
    #[must_use]
    pub fn key_index(&self, row: usize, column: usize) -> u32 {
        self.keys[column].rows[row]
    }

    /// The distinct names of a key column, in the order of their first appearance.
    #[must_use]
    pub fn names(&self, column: usize) -> &[String] {
        &self.keys[column].names
    }

    /// Where a row stands: its file, the line where that is known, and the row of that file counted from one.
    #[must_use]
    pub fn place(&self, row: usize) -> DataPlace {
        // of files without rows that begin at the same row, the last one has it
        let file = self.files.partition_point(|(_, first)| *first <= row).checked_sub(1).map(|at| &self.files[at]);
        let (name, first) = file.map_or(("", 0), |(name, first)| (name.as_str(), *first));
        let line = self.lines.get(row).map(|&line| line as usize).filter(|&line| line > 0);
        DataPlace { line, row: Some(row - first + 1), ..DataPlace::file(name) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(file: &str, names: &[&str]) -> Table {
        let mut table = Table::new(1, 1);
        table.begin(file);
        for (i, name) in names.iter().enumerate() {
            table.push(&[name], &[i as f64], Some(i + 2));
        }
        table
    }

    #[test]
    fn appended_tables_share_names_and_keep_their_places() {
        let mut table = of("one.csv", &["a", "b", "b"]);
        table.append(&of("none.csv", &[]));
        table.append(&of("two.csv", &["c", "a"]));
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
        table.push(&["a"], &[], None);
        table.push(&["b"], &[], None);
        assert_eq!((table.rows(), table.row(1).len(), table.key(1, 0)), (2, 0, "b"));
        assert_eq!(table.place(1), DataPlace { row: Some(2), ..DataPlace::default() });
    }
}
