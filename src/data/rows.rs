//! Rows as they are read from a table: a piece of it, or a single one.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;

/// Where rows are put that are not in memory. Used again for every piece, it allocates for the first only.
#[derive(Clone, Debug, Default)]
pub struct Buffer {
    pub(super) readings: Vec<f64>,
    pub(super) numbers: Vec<u32>,
}

/// Consecutive rows of a table. They are counted from zero here; [`first`](Self::first) is the number of the first one in
/// the table.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    pub(super) first: usize,
    pub(super) count: usize,
    /// readings of a row
    pub(super) width: usize,
    /// key columns
    pub(super) keys: usize,
    pub(super) readings: &'a [f64],
    /// of each row: the number of its name in each key column, then its line
    pub(super) numbers: &'a [u32],
}

impl<'a> Rows<'a> {
    /// The number of the first row in the table.
    #[must_use]
    pub fn first(&self) -> usize {
        self.first
    }

    /// How many rows there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// How many readings a row has.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// All readings in internal units, row after row: [`len`](Self::len) × [`width`](Self::width) of them.
    #[must_use]
    pub fn readings(&self) -> &'a [f64] {
        self.readings
    }

    /// The readings of row `i`, in the order of the measurement's inputs; none of a row that is not among them.
    #[must_use]
    pub fn row(&self, i: usize) -> &'a [f64] {
        piece(self.readings, i, self.width)
    }

    /// For each key column, the number of row `i`'s name among the names of that column; none of a row that is not among them.
    #[must_use]
    pub fn keys(&self, i: usize) -> &'a [u32] {
        self.numbers_of(i).map_or(&[], |(_, keys)| keys)
    }

    /// The line of the file on which row `i` begins, where that is known.
    #[must_use]
    pub fn line(&self, i: usize) -> Option<usize> {
        self.numbers_of(i).map(|(&line, _)| line as usize).filter(|&line| line > 0)
    }

    /// The line of row `i`, and the numbers of its names before it.
    fn numbers_of(&self, i: usize) -> Option<(&'a u32, &'a [u32])> {
        piece(self.numbers, i, self.keys + 1).split_last()
    }
}

/// Piece `i` of those that are `length` long.
fn piece<T>(all: &[T], i: usize, length: usize) -> &[T] {
    let from = i.checked_mul(length);
    from.and_then(|from| all.get(from..from.checked_add(length)?)).unwrap_or_default()
}

/// The readings of one row.
#[derive(Clone, PartialEq)]
pub struct Row<'a>(pub(super) Cow<'a, [f64]>);

impl Deref for Row<'_> {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.0
    }
}

impl fmt::Debug for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl PartialEq<&[f64]> for Row<'_> {
    fn eq(&self, other: &&[f64]) -> bool {
        **self == **other
    }
}

impl<const N: usize> PartialEq<[f64; N]> for Row<'_> {
    fn eq(&self, other: &[f64; N]) -> bool {
        **self == *other
    }
}
