//! From the cells of a row to a row of the table, or to what is wrong with them.

use super::cell::{self, Wrong};
use super::column::Column;
use super::heading::{Origin, Plan, Reading, unit_name};
use super::records::Record;
use super::table::Table;
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::unit::{Dimension, Unit};

/// Mistakes of one file that are reported one by one.
const MOST_MISTAKES: usize = 20;

/// Rows of a file on their way into the table.
pub(super) struct Intake<'a> {
    reading: &'a Reading<'a>,
    plan: Plan,
    names: Vec<String>,
    columns: Vec<Column>,
    units: Vec<String>,
    /// rows seen, good or not
    count: usize,
    readings: Vec<f64>,
    /// for each input, whether its column is in radians
    radians: Vec<bool>,
    /// for each input, the first reading that is no angle, and its row in the table
    large: Vec<Option<(f64, usize)>>,
    mistakes: usize,
    /// the first mistake that is counted only
    hidden: Option<(Code, DataPlace)>,
}

/// No instrument reads more than two turns: such a column is in degrees or gon.
const LARGEST_ANGLE: f64 = 2.0 * std::f64::consts::TAU;

impl<'a> Intake<'a> {
    pub(super) fn new(reading: &'a Reading<'a>, plan: Plan, names: Vec<String>) -> Self {
        let inputs = &reading.measurement.inputs;
        let radians = Unit { factor: 1.0, dimension: Dimension::ANGLE };
        Intake {
            reading,
            plan,
            names,
            columns: inputs.iter().map(|input| Column::new(&reading.program.units, input)).collect(),
            units: inputs.iter().map(|input| unit_name(reading.program, input)).collect(),
            count: 0,
            readings: Vec::with_capacity(inputs.len()),
            radians: inputs.iter().map(|input| input.unit == radians && !input.dms).collect(),
            large: vec![None; inputs.len()],
            mistakes: 0,
            hidden: None,
        }
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
        let before = self.mistakes;
        // one check of the row is quicker than one for each cell
        let text = std::str::from_utf8(record.text).unwrap_or_default();
        self.readings.clear();
        for i in 0..self.plan.inputs.len() {
            let value = match self.plan.inputs[i] {
                Origin::Whole(value) => value,
                Origin::Cell(at) => match self.plain(i, text.get(record.range(at))) {
                    Some(value) => value,
                    None => self.reading(i, record.cell(at)).unwrap_or_else(|wrong| {
                        self.mistake(wrong, line, Some((at, record.cell(at))), found);
                        0.0
                    }),
                },
            };
            self.readings.push(value);
        }
        for k in 0..self.plan.keys.len() {
            if let Origin::Cell(at) = self.plan.keys[k]
                && let Err(wrong) = cell::text(record.cell(at))
            {
                self.mistake(wrong, line, Some((at, record.cell(at))), found);
            }
        }
        if self.mistakes > before {
            return;
        }
        let name = |k: usize| match &self.plan.keys[k] {
            Origin::Whole(name) => name.as_str(),
            Origin::Cell(at) => cell::text(record.cell(*at)).unwrap_or_default(),
        };
        table.push_with(name, &self.readings, Some(line));
        for (i, reading) in self.readings.iter().enumerate() {
            if self.radians[i] && reading.abs() > LARGEST_ANGLE && self.large[i].is_none() {
                self.large[i] = Some((*reading, table.rows() - 1));
            }
        }
    }

    /// The reading of input `i` where its cell is a plain number.
    fn plain(&self, i: usize, cell: Option<&str>) -> Option<f64> {
        if self.reading.measurement.inputs[i].dms {
            return None;
        }
        let value: f64 = cell?.trim_ascii().parse().ok()?;
        Some(self.columns[i].to_internal(value)).filter(|reading| reading.is_finite())
    }

    /// The reading of input `i` in internal units, or what is wrong with the cell.
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

    /// Says how many mistakes have not been said, and which columns seem to be in another unit.
    pub(super) fn finish(self, table: &Table, found: &mut Diagnostics) {
        if let Some((code, place)) = self.hidden {
            let more = self.mistakes - MOST_MISTAKES;
            let message = format!("{more} more mistake{} from here on", if more == 1 { "" } else { "s" });
            let place = DataPlace { column: None, value: None, ..place };
            found.push(Diagnostic::error(code, message).at_data(place));
        }
        for (input, large) in self.reading.measurement.inputs.iter().zip(&self.large) {
            let Some((reading, row)) = *large else { continue };
            let message = format!("the column `{}` reads {reading} rad, more than two turns", input.name);
            let place = DataPlace { column: Some(input.name.clone()), ..table.place(row) };
            let hint = "if it is in degrees or gon, declare `unit: \"deg\"` or `unit: \"gon\"`";
            found.push(Diagnostic::warning(Code::LargeAngle, message).at_data(place).hint(hint));
        }
    }
}
