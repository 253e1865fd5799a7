//! Columns that stand under one another.

use std::fmt::Write;

/// Cells that are longer take no part in how wide a column is.
const WIDEST: usize = 200;

/// On which side the cells of a column stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// names
    Left,
    /// numbers
    Right,
}

/// Rows of cells, two blanks between columns.
///
/// ```
/// use phical::report::{Align, Grid};
/// let mut grid = Grid::new(&[Align::Left, Align::Right]);
/// grid.row(["vo.x", "0.15"]);
/// grid.row(["kci1", "12"]);
/// assert_eq!(grid.text("  "), "  vo.x  0.15\n  kci1    12\n");
/// ```
#[derive(Clone, Debug)]
pub struct Grid {
    align: Vec<Align>,
    rows: Vec<Vec<String>>,
}

impl Grid {
    /// A grid of so many columns.
    pub fn new(align: &[Align]) -> Self {
        Grid { align: align.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; what is missing stays empty.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All rows, each behind `indent`. Nothing stands behind the last cell.
    pub fn text(&self, indent: &str) -> String {
        let length = |cell: &str| cell.chars().count();
        let width = |k: usize| self.rows.iter().filter_map(move |row| row.get(k)).map(|cell| length(cell));
        let width = |k: usize| width(k).max().unwrap_or(0).min(WIDEST);
        let widths: Vec<usize> = (0..self.align.len()).map(width).collect();
        let mut out = String::new();
        for row in &self.rows {
            let mut line = indent.to_owned();
            for (k, ((cell, align), &width)) in row.iter().zip(&self.align).zip(&widths).enumerate() {
                let gap = if k == 0 { "" } else { "  " };
                let _ = match align {
                    Align::Left => write!(line, "{gap}{cell:<width$}"),
                    Align::Right => write!(line, "{gap}{cell:>width$}"),
                };
            }
            out.push_str(line.trim_end());
            out.push('\n');
        }
        out
    }
}
