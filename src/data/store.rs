//! Rows of numbers: in memory while they are few, in temporary files when they are many.
//!
//! A row has as many readings and as many whole numbers as any other, so that its place in a file follows from its number.
//! The last rows are in memory; when they fill it, they go to the files as a whole. Files have no name, take their space in the
//! system's directory for temporary files (`TMPDIR`), and are gone with the last copy of the store, however the program ends.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::{cast_slice, cast_slice_mut};

use super::positional::{read_at, write_at};
use super::rows::{Buffer, Rows};

/// Bytes of rows that a store keeps in memory: a hundred thousand rows of nine readings.
pub(super) const IN_MEMORY: usize = 8 << 20;

#[derive(Clone, Debug)]
pub(super) struct Store {
    /// readings of a row
    width: usize,
    /// whole numbers of a row
    numbers: usize,
    rows: usize,
    /// the rows before this one are in the files
    spilled: usize,
    /// of the rows that are in memory
    tail: Buffer,
    files: Option<Arc<Files>>,
    /// bytes in memory that send it to the files
    bound: usize,
    /// why there is more in memory than that
    refused: Option<String>,
}

/// Readings and whole numbers, row after row, as the machine has them.
#[derive(Debug)]
struct Files {
    readings: File,
    numbers: File,
}

impl Files {
    fn new() -> io::Result<Files> {
        Ok(Files { readings: tempfile::tempfile()?, numbers: tempfile::tempfile()? })
    }
}

/// Where the row begins in a file that has `each` numbers of type `T` in a row.
fn offset<T>(row: usize, each: usize) -> u64 {
    row as u64 * each as u64 * size_of::<T>() as u64
}

impl Store {
    pub(super) fn new(width: usize, numbers: usize, bound: usize) -> Store {
        let tail = Buffer::default();
        Store { width, numbers, rows: 0, spilled: 0, tail, files: None, bound, refused: None }
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Why rows are in memory that should be in a file.
    pub(super) fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    pub(super) fn push(&mut self, readings: &[f64], numbers: impl IntoIterator<Item = u32>) {
        self.rows += 1;
        let held = self.rows - self.spilled;
        self.tail.readings.extend_from_slice(readings);
        self.tail.readings.resize(held * self.width, f64::NAN);
        self.tail.numbers.extend(numbers);
        self.tail.numbers.resize(held * self.numbers, 0);
        let bytes = size_of_val(&*self.tail.readings) + size_of_val(&*self.tail.numbers);
        if bytes >= self.bound && self.refused.is_none() {
            // where nothing can be written, rows stay in memory: they are right there too, only larger
            self.refused = self.spill().err().map(|error| error.to_string());
        }
    }

    /// Writes what is in memory to the files.
    fn spill(&mut self) -> io::Result<()> {
        let files = match self.files.take() {
            // a copy of this store that goes on by itself would overwrite the rows of the other one
            Some(shared) if Arc::strong_count(&shared) > 1 => {
                let own = self.copied(&shared);
                self.files = Some(shared);
                Arc::new(own?)
            }
            Some(own) => own,
            None => Arc::new(Files::new()?),
        };
        let files = self.files.insert(files);
        write_at(&files.readings, cast_slice(&self.tail.readings), offset::<f64>(self.spilled, self.width))?;
        write_at(&files.numbers, cast_slice(&self.tail.numbers), offset::<u32>(self.spilled, self.numbers))?;
        self.spilled = self.rows;
        self.tail.readings.clear();
        self.tail.numbers.clear();
        Ok(())
    }

    fn copied(&self, from: &Files) -> io::Result<Files> {
        const BUFFER: u64 = 1 << 20;
        let to = Files::new()?;
        let mut buffer = Vec::new();
        for (from, to, end) in [
            (&from.readings, &to.readings, offset::<f64>(self.spilled, self.width)),
            (&from.numbers, &to.numbers, offset::<u32>(self.spilled, self.numbers)),
        ] {
            let mut at = 0;
            while at < end {
                buffer.resize((end - at).min(BUFFER) as usize, 0);
                read_at(from, &mut buffer, at)?;
                write_at(to, &buffer, at)?;
                at += buffer.len() as u64;
            }
        }
        Ok(to)
    }

    /// Consecutive rows, as they are in memory or else in the buffer. Rows that are not there cannot be read.
    pub(super) fn read<'a>(&'a self, rows: Range<usize>, buffer: &'a mut Buffer) -> io::Result<Rows<'a>> {
        if rows.start > rows.end || rows.end > self.rows {
            return Err(self.missing(format_args!("{rows:?}")));
        }
        let (width, numbers) = (self.width, self.numbers);
        let (first, count) = (rows.start, rows.len());
        let (readings, whole) = match &self.files {
            Some(files) if first < self.spilled => {
                buffer.readings.resize(count * width, 0.0);
                buffer.numbers.resize(count * numbers, 0);
                let there = rows.end.min(self.spilled) - first;
                let (readings, more_readings) = buffer.readings.split_at_mut(there * width);
                let (whole, more_numbers) = buffer.numbers.split_at_mut(there * numbers);
                read_at(&files.readings, cast_slice_mut(readings), offset::<f64>(first, width))?;
                read_at(&files.numbers, cast_slice_mut(whole), offset::<u32>(first, numbers))?;
                if there < count {
                    let (readings, whole) = self.tail(self.spilled..rows.end)?;
                    more_readings.copy_from_slice(readings);
                    more_numbers.copy_from_slice(whole);
                }
                (&buffer.readings[..], &buffer.numbers[..])
            }
            _ => self.tail(rows)?,
        };
        Ok(Rows { first, count, width, keys: numbers - 1, readings, numbers: whole })
    }

    /// Rows that are in memory.
    fn tail(&self, rows: Range<usize>) -> io::Result<(&[f64], &[u32])> {
        let held = || {
            // so that no product below is too large
            if rows.end > self.rows {
                return None;
            }
            let (from, to) = (rows.start.checked_sub(self.spilled)?, rows.end.checked_sub(self.spilled)?);
            let readings = self.tail.readings.get(from * self.width..to * self.width)?;
            Some((readings, self.tail.numbers.get(from * self.numbers..to * self.numbers)?))
        };
        held().ok_or_else(|| self.missing(format_args!("{rows:?}")))
    }

    fn missing(&self, rows: std::fmt::Arguments<'_>) -> io::Error {
        io::Error::new(io::ErrorKind::InvalidInput, format!("there are {} rows, and not {rows}", self.rows))
    }

    /// The row, where it is in memory.
    pub(super) fn held(&self, row: usize) -> Option<&[f64]> {
        self.tail(row..row.checked_add(1)?).ok().map(|(readings, _)| readings)
    }

    /// The row, from its file.
    pub(super) fn fetch(&self, row: usize) -> io::Result<Vec<f64>> {
        match &self.files {
            Some(files) if row < self.spilled => {
                let mut readings = vec![0.0; self.width];
                read_at(&files.readings, cast_slice_mut(&mut readings), offset::<f64>(row, self.width))?;
                Ok(readings)
            }
            _ => Err(self.missing(format_args!("{row}"))),
        }
    }

    /// A whole number of a row.
    pub(super) fn number(&self, row: usize, number: usize) -> io::Result<u32> {
        match &self.files {
            Some(files) if row < self.spilled && number < self.numbers => {
                let mut bytes = [0; 4];
                let at = offset::<u32>(row, self.numbers) + offset::<u32>(number, 1);
                read_at(&files.numbers, &mut bytes, at)?;
                Ok(u32::from_ne_bytes(bytes))
            }
            _ => {
                let (_, numbers) = self.tail(row..row.saturating_add(1))?;
                numbers.get(number).copied().ok_or_else(|| self.missing(format_args!("{row} with number {number}")))
            }
        }
    }

    #[cfg(test)]
    pub(super) fn in_files(&self) -> usize {
        self.spilled
    }

    /// As if the disk were full.
    #[cfg(test)]
    pub(super) fn fill_disk(&mut self) {
        let file = tempfile::NamedTempFile::new().expect("it can be made");
        let open = || File::open(file.path()).expect("it can be opened");
        self.files = Some(Arc::new(Files { readings: open(), numbers: open() }));
    }

    /// As if the files had been lost.
    #[cfg(test)]
    pub(super) fn ruin(&self) {
        let files = self.files.as_ref().expect("there are files");
        files.readings.set_len(0).and_then(|()| files.numbers.set_len(0)).expect("it can be cut");
    }
}
