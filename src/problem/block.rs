//! The rows of one measurement, with the members that each row touches.

use std::collections::HashMap;

use super::layout::Layout;
use super::solving::Undefined;
use crate::compile::{Measurement, Program, Slot};
use crate::data::Table;
use crate::diag::{Code, DataPlace, Diagnostic};
use crate::eval::{Evaluator, Leaf};
use crate::graph::Tape;

/// Rows of one measurement.
#[derive(Clone, Debug)]
pub struct Block<'p> {
    /// Its number in the program.
    pub index: usize,
    /// What is measured.
    pub measurement: &'p Measurement,
    /// The rows.
    pub table: Table,
    /// 1/σ of each residual.
    pub weights: Vec<f64>,
    /// For each combination of members: the group of each slot.
    combinations: Vec<Vec<usize>>,
    /// The combination of each row.
    combination: Vec<u32>,
}

/// Which of a measurement's quantities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantities {
    /// what should vanish
    Residuals,
    /// what is derived
    Outputs,
}

/// A row's whitened residuals and their derivatives by the free coordinates it touches.
pub struct RowJacobian<'a> {
    /// The row's number.
    pub row: usize,
    /// Whitened residuals.
    pub residuals: &'a [f64],
    /// By residual, then by column: whitened.
    pub derivatives: &'a [f64],
    /// The free coordinate (its place among the free ones) of each column.
    pub columns: &'a [usize],
}

/// The free coordinates that a combination touches: the leaves to differentiate by, and each one's place among the free.
struct Touched {
    leaves: Vec<Leaf>,
    columns: Vec<usize>,
}

/// The member that a row's keys name: names joined by `/`.
pub(super) fn member(slot: &Slot, table: &Table, row: usize) -> String {
    let names: Vec<&str> = slot.keys.iter().map(|&key| table.key(row, key)).collect();
    names.join("/")
}

impl<'p> Block<'p> {
    /// Finds the members of every row.
    pub(super) fn new(program: &'p Program, index: usize, table: Table, weights: Vec<f64>, layout: &Layout) -> Self {
        let measurement = &program.measurements[index];
        let mut known: HashMap<Vec<u32>, u32> = HashMap::new();
        let mut combinations: Vec<Vec<usize>> = Vec::new();
        let mut combination = Vec::with_capacity(table.rows());
        let used: Vec<usize> = {
            let mut used: Vec<usize> = measurement.slots.iter().flat_map(|slot| slot.keys.clone()).collect();
            used.sort_unstable();
            used.dedup();
            used
        };
        for row in 0..table.rows() {
            let key: Vec<u32> = used.iter().map(|&k| table.key_index(row, k)).collect();
            let next = combinations.len() as u32;
            let id = *known.entry(key).or_insert_with(|| {
                let group = |slot: &Slot| {
                    let member = program.parameters[slot.parameter].family.then(|| member(slot, &table, row));
                    layout.group(slot.parameter, member.as_deref()).unwrap_or(0)
                };
                combinations.push(measurement.slots.iter().map(group).collect());
                next
            });
            combination.push(id);
        }
        Block { index, measurement, table, weights, combinations, combination }
    }

    /// The numbers of a combination's leaves at a point.
    fn leaves(&self, combination: usize, layout: &Layout, point: &[f64]) -> Vec<f64> {
        let mut leaves = vec![0.0; self.measurement.leaves];
        for (slot, &group) in self.measurement.slots.iter().zip(&self.combinations[combination]) {
            let group = &layout.groups[group];
            let n = group.shape.dimension();
            leaves[slot.first_leaf..slot.first_leaf + n].copy_from_slice(&point[group.first..group.first + n]);
        }
        leaves
    }

    fn touched(&self, combination: usize, layout: &Layout, place: &[Option<usize>]) -> Touched {
        let mut touched = Touched { leaves: Vec::new(), columns: Vec::new() };
        for (slot, &group) in self.measurement.slots.iter().zip(&self.combinations[combination]) {
            let group = &layout.groups[group];
            for k in 0..group.shape.dimension() {
                if let Some(column) = place[group.first + k] {
                    touched.leaves.push(Leaf::Parameter(slot.first_leaf + group.shape.tangent_leaf(k)));
                    touched.columns.push(column);
                }
            }
        }
        touched
    }

    /// Rows by combination, so that each is begun once; within one, in the order of the table.
    fn runs(&self) -> Vec<Vec<usize>> {
        let mut runs = vec![Vec::new(); self.combinations.len()];
        for (row, &combination) in self.combination.iter().enumerate() {
            runs[combination as usize].push(row);
        }
        runs
    }

    /// Calls `visit(row, values)` for every row, with residuals (not whitened) or outputs.
    ///
    /// # Errors
    /// Where an output is not a number.
    pub fn values(
        &self,
        what: Quantities,
        layout: &Layout,
        point: &[f64],
        mut visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), Undefined> {
        let tape = self.tape(what);
        let mut values = vec![0.0; tape.outputs()];
        for (combination, rows) in self.runs().into_iter().enumerate() {
            let mut evaluator = Evaluator::new(tape, Vec::new());
            evaluator.begin(&self.leaves(combination, layout, point));
            for row in rows {
                evaluator.values(self.table.row(row), &mut values);
                if values.iter().any(|value| !value.is_finite()) {
                    return Err(self.undefined(&mut evaluator, self.table.row(row), row, what, false));
                }
                visit(row, &values);
            }
        }
        Ok(())
    }

    /// Calls `visit` with the whitened residuals and derivatives of every row. `place` gives each coordinate's place among
    /// the free ones. With `adjusted`, rows are evaluated at those inputs instead of the table's.
    ///
    /// # Errors
    /// Where a residual or a derivative is not a number.
    pub fn jacobians(
        &self,
        layout: &Layout,
        point: &[f64],
        place: &[Option<usize>],
        adjusted: Option<&[f64]>,
        mut visit: impl FnMut(RowJacobian) -> Result<(), Undefined>,
    ) -> Result<(), Undefined> {
        let tape = &self.measurement.tape;
        let m = tape.outputs();
        let width = self.measurement.inputs.len();
        let mut values = vec![0.0; m];
        for (combination, rows) in self.runs().into_iter().enumerate() {
            let Touched { leaves, columns } = self.touched(combination, layout, place);
            let mut derivatives = vec![0.0; m * columns.len()];
            let mut evaluator = Evaluator::new(tape, leaves);
            evaluator.begin(&self.leaves(combination, layout, point));
            for row in rows {
                let inputs = match adjusted {
                    Some(all) => &all[row * width..(row + 1) * width],
                    None => self.table.row(row),
                };
                evaluator.row(inputs, &mut values, &mut derivatives);
                if values.iter().chain(&derivatives).any(|value| !value.is_finite()) {
                    return Err(self.undefined(&mut evaluator, inputs, row, Quantities::Residuals, true));
                }
                for (i, &weight) in self.weights.iter().enumerate() {
                    values[i] *= weight;
                    for derivative in &mut derivatives[i * columns.len()..(i + 1) * columns.len()] {
                        *derivative *= weight;
                    }
                }
                visit(RowJacobian { row, residuals: &values, derivatives: &derivatives, columns: &columns })?;
            }
        }
        Ok(())
    }

    /// Calls `visit(row, inputs, residuals, derivatives by inputs)` with what is not whitened, for every row.
    ///
    /// # Errors
    /// Where a residual or a derivative is not a number.
    pub fn input_jacobians(
        &self,
        layout: &Layout,
        point: &[f64],
        mut visit: impl FnMut(usize, &mut dyn FnMut(&[f64], &mut [f64], &mut [f64])),
    ) {
        let tape = &self.measurement.tape;
        let leaves: Vec<Leaf> = (0..tape.inputs()).map(Leaf::Input).collect();
        for (combination, rows) in self.runs().into_iter().enumerate() {
            let mut evaluator = Evaluator::new(tape, leaves.clone());
            evaluator.begin(&self.leaves(combination, layout, point));
            for row in rows {
                let mut evaluate = |inputs: &[f64], values: &mut [f64], derivatives: &mut [f64]| {
                    evaluator.row(inputs, values, derivatives);
                };
                visit(row, &mut evaluate);
            }
        }
    }

    fn tape(&self, what: Quantities) -> &'p Tape {
        match what {
            Quantities::Residuals => &self.measurement.tape,
            Quantities::Outputs => &self.measurement.output_tape,
        }
    }

    /// What a number of a tape is called.
    fn name(&self, what: Quantities, index: usize) -> Option<String> {
        match what {
            Quantities::Residuals => self.measurement.residuals.get(index).map(|r| format!("residual `{}`", r.name)),
            Quantities::Outputs => self.measurement.outputs.get(index).map(|o| format!("output `{}`", o.name)),
        }
    }

    fn undefined(
        &self,
        evaluator: &mut Evaluator,
        inputs: &[f64],
        row: usize,
        what: Quantities,
        derivatives: bool,
    ) -> Undefined {
        if let Some(k) = inputs.iter().position(|reading| !reading.is_finite()) {
            let (measurement, input) = (&self.measurement.name, &self.measurement.inputs[k].name);
            let message =
                format!("measurement `{measurement}`, row {}: the reading `{input}` is {}", row + 1, inputs[k]);
            let place = DataPlace { column: Some(input.clone()), ..self.table.place(row) };
            let diagnostic = Diagnostic::error(Code::DataNotFinite, message).at_data(place).hint("remove the row");
            return Undefined(Box::new(diagnostic));
        }
        let found = evaluator.undefined(inputs, derivatives);
        let (why, spoilt) = match &found {
            Some(undefined) => {
                let operation = undefined.operation.row();
                let spoilt = undefined.spoils.first().and_then(|&i| self.name(what, i));
                let missing = if (operation.defined)(undefined.x, undefined.y) { "derivative" } else { "value" };
                (
                    format!(
                        "`{}` has no {missing} at {}; it is defined {}",
                        operation.name,
                        arguments(undefined),
                        operation.domain
                    ),
                    spoilt,
                )
            }
            None => ("a number is too large".to_owned(), None),
        };
        let name = spoilt.map_or(String::new(), |name| format!(", {name}"));
        let message = format!("measurement `{}`, row {}{name}: {why}", self.measurement.name, row + 1);
        let hint = match found.map(|undefined| undefined.operation) {
            Some(crate::graph::Operation::AtLeast) => {
                "the row is at the edge of what the model describes, such as parallel lines of sight: correct or remove it"
            }
            _ => "start elsewhere, or correct the row",
        };
        let diagnostic = Diagnostic::error(Code::UndefinedAtStart, message).at_data(self.table.place(row)).hint(hint);
        Undefined(Box::new(diagnostic))
    }
}

fn arguments(undefined: &crate::graph::Undefined) -> String {
    let number = |value: f64| match value.abs() {
        size if size == 0.0 || (1e-4..1e6).contains(&size) => format!("{value}"),
        _ => format!("{value:e}"),
    };
    match undefined.operation.row().arity {
        1 => number(undefined.x),
        _ => format!("({}, {})", number(undefined.x), number(undefined.y)),
    }
}
