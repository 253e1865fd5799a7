//! From the cells of a row to a row of the table, or to what is wrong with them.

use super::cell::{self, Wrong};
use super::column::Column;
use super::heading::{Origin, Plan, Reading, unit_name};
use super::records::Record;
use super::table::Table;
use crate::compile::{Input, Program};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::unit::{Dimension, Unit};

/// Mistakes of one file that are reported one by one.
const MOST_MISTAKES: usize = 20;

/// Rows of a file on their way into the table.
pub(super) struct Intake<'a> {
    reading: &'a Reading<'a>,
    plan: Plan,
    names: Vec<String>,
    inputs: Vec<Cells>,
    /// rows seen, good or not
    count: usize,
    readings: Vec<f64>,
    mistakes: usize,
    /// the first mistake that is counted only
    hidden: Option<(Code, DataPlace)>,
}

/// How the cells of an input are read.
struct Cells {
    column: Column,
    unit: String,
    dms: bool,
    /// whether they are in radians
    radians: bool,
    /// the first reading that is no angle, and its row in the table
    large: Option<(f64, usize)>,
}

/// No instrument reads more than two turns: such a column is in degrees or gon.
const LARGEST_ANGLE: f64 = 2.0 * std::f64::consts::TAU;

impl Cells {
    fn new(program: &Program, input: &Input) -> Self {
        let radians = Unit { factor: 1.0, dimension: Dimension::ANGLE };
        Cells {
            column: Column::new(&program.units, input),
            unit: unit_name(program, input),
            dms: input.dms,
            radians: input.unit == radians && !input.dms,
            large: None,
        }
    }

    /// The reading where the cell is a plain number.
    fn plain(&self, cell: Option<&str>) -> Option<f64> {
        if self.dms {
            return None;
        }
        let value: f64 = cell?.trim_ascii().parse().ok()?;
        Some(self.column.to_internal(value)).filter(|reading| reading.is_finite())
    }

    /// The reading in internal units, or what is wrong with the cell.
    fn reading(&self, cell: &[u8]) -> Result<f64, Wrong> {
        let value = match self.dms {
            true => cell::angle(cell)?,
            false => cell::number(cell, &self.unit)?,
        };
        let reading = self.column.to_internal(value);
        if reading.is_finite() { Ok(reading) } else { Err(cell::not_finite(cell)) }
    }
}

impl<'a> Intake<'a> {
    pub(super) fn new(reading: &'a Reading<'a>, plan: Plan, names: Vec<String>) -> Self {
        let inputs: Vec<Cells> =
            reading.measurement.inputs.iter().map(|input| Cells::new(reading.program, input)).collect();
        let readings = Vec::with_capacity(inputs.len());
        Intake { reading, plan, names, inputs, count: 0, readings, mistakes: 0, hidden: None }
    }

    /// How many rows there were, good or not.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Puts a row into the table, or says what is wrong with it.
    pub(super) fn take(&mut self, record: Record, line: usize, table: &mut Table, found: &mut Diagnostics) {
        self.count += 1;
        if record.len() != self.names.len() {
            let message = format!("the row has {} fields, and there are {} columns", record.len(), self.names.len());
            let hint = Some("a decimal comma, a missing value and a missing quote are the usual causes".to_owned());
            return self.mistake(Wrong { code: Code::FieldCount, message, hint }, line, None, found);
        }
        let mut wrongs: Vec<(Wrong, usize)> = Vec::new();
        // one check of the row is quicker than one for each cell
        let text = std::str::from_utf8(record.text).unwrap_or_default();
        self.readings.clear();
        for (cells, origin) in self.inputs.iter().zip(&self.plan.inputs) {
            let reading = match *origin {
                Origin::Whole(value) => Ok(value),
                Origin::Cell(at) => {
                    let plain = cells.plain(text.get(record.range(at)));
                    plain.map_or_else(|| cells.reading(record.cell(at)).map_err(|wrong| (wrong, at)), Ok)
                }
            };
            self.readings.push(reading.unwrap_or_else(|(wrong, at)| {
                wrongs.push((wrong, at));
                0.0
            }));
        }
        let keys = self.plan.keys.iter().filter_map(|origin| match origin {
            Origin::Cell(at) => cell::text(record.cell(*at)).err().map(|wrong| (wrong, *at)),
            Origin::Whole(_) => None,
        });
        wrongs.extend(keys);
        if !wrongs.is_empty() {
            for (wrong, at) in wrongs {
                self.mistake(wrong, line, Some((at, record.cell(at))), found);
            }
            return;
        }
        let names = self.plan.keys.iter().map(|origin| match origin {
            Origin::Whole(name) => name.as_str(),
            Origin::Cell(at) => cell::text(record.cell(*at)).unwrap_or_default(),
        });
        table.put(names, &self.readings, Some(line));
        for (cells, reading) in self.inputs.iter_mut().zip(&self.readings) {
            if cells.radians && reading.abs() > LARGEST_ANGLE && cells.large.is_none() {
                cells.large = Some((*reading, table.rows() - 1));
            }
        }
    }

    fn mistake(&mut self, wrong: Wrong, line: usize, cell: Option<(usize, &[u8])>, found: &mut Diagnostics) {
        self.mistakes += 1;
        let place = DataPlace {
            file: self.reading.name.to_owned(),
            line: Some(line),
            row: Some(self.count),
            column: cell.and_then(|(at, _)| self.names.get(at).cloned()),
            value: cell.map(|(_, value)| cell::shown(value)),
        };
        if self.mistakes > MOST_MISTAKES {
            self.hidden.get_or_insert((wrong.code, place));
            return;
        }
        found.push(Diagnostic::error(wrong.code, wrong.message).at_data(place).maybe_hint(wrong.hint));
    }

    /// Says how many mistakes have not been said, and which columns seem to be in another unit.
    pub(super) fn finish(self, table: &Table, found: &mut Diagnostics) {
        if let Some((code, place)) = self.hidden {
            let more = self.mistakes - MOST_MISTAKES;
            let message = format!("{more} more mistake{} from here on", if more == 1 { "" } else { "s" });
            let place = DataPlace { column: None, value: None, ..place };
            found.push(Diagnostic::error(code, message).at_data(place));
        }
        for (input, cells) in self.reading.measurement.inputs.iter().zip(&self.inputs) {
            let Some((reading, row)) = cells.large else { continue };
            let message = format!("the column `{}` reads {reading} rad, more than two turns", input.name);
            let place = DataPlace { column: Some(input.name.clone()), ..table.place(row) };
            let hint = "if it is in degrees or gon, declare `unit: \"deg\"` or `unit: \"gon\"`";
            found.push(Diagnostic::warning(Code::LargeAngle, message).at_data(place).hint(hint));
        }
    }
}
