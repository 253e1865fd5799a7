//! The rows of one measurement, with the members that each row touches.

use std::collections::HashMap;
use std::sync::Arc;

use super::execution::Execution;
use super::layout::Layout;
use super::noise::Noise;
use super::pass::{Pass, Span, pieces};
use super::programs::{Programs, Seen};
use super::robust::RowLoss;
use super::solving::Undefined;
use crate::compile::{Measurement, Program, Robust, Slot};
use crate::data::{Buffer, Table};
use crate::diag::{Code, DataPlace, Diagnostic};
use crate::eval::{Evaluator, Leaf};
use crate::graph::Tape;
use crate::linalg::same_size;

/// Rows of one measurement.
#[derive(Clone, Debug)]
pub struct Block<'p> {
    /// Its number in the program.
    pub index: usize,
    /// What is measured.
    pub measurement: &'p Measurement,
    /// The rows.
    pub table: Arc<Table>,
    /// What each residual is multiplied by: 1/σ where that says it all, else one over its reported unit.
    pub weights: Vec<f64>,
    /// The errors that rows carry, where weights do not say it all.
    pub(super) noise: Option<Noise>,
    /// What large residuals count.
    pub(super) loss: Option<RowLoss>,
    /// What it was made from.
    pub(super) robust: Option<Robust>,
    /// Rows that take no part, as numbers, in order.
    pub(super) excluded: Arc<Vec<usize>>,
    /// How many times rows count, where that is not once.
    pub(super) counted: Arc<HashMap<usize, f64>>,
    pub(super) seen: Seen<'p>,
    pub(super) execution: Execution,
    /// For each combination of members: the group of each slot.
    pub(super) combinations: Vec<Vec<usize>>,
    /// The key columns that choose members.
    keys: Vec<usize>,
    /// The combination of each list of names' numbers in these columns.
    known: HashMap<Vec<u32>, u32>,
    pub(super) programs: Programs,
}

/// How the rows of a block are weighted.
#[derive(Clone, Debug, Default)]
pub(super) struct Weighting {
    /// factors of the residuals
    pub(super) weights: Vec<f64>,
    pub(super) noise: Option<Noise>,
    pub(super) loss: Option<RowLoss>,
    pub(super) robust: Option<Robust>,
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

/// The member that a row's keys name: names joined by `/`. `numbers` are those of the names in each key column.
pub(super) fn member(slot: &Slot, table: &Table, numbers: &[u32]) -> String {
    let name = |&key: &usize| table.names(key).get(numbers[key] as usize).map_or("", String::as_str);
    let names: Vec<&str> = slot.keys.iter().map(name).collect();
    names.join("/")
}

impl<'p> Block<'p> {
    /// Finds all combinations of members that rows name.
    ///
    /// # Errors
    /// Where the rows cannot be read.
    pub(super) fn new(
        program: &'p Program,
        index: usize,
        table: Table,
        weighting: Weighting,
        layout: &Layout,
        execution: Execution,
    ) -> Result<Self, Box<Diagnostic>> {
        let Weighting { weights, noise, loss, robust } = weighting;
        let measurement = &program.measurements[index];
        let mut keys: Vec<usize> = measurement.slots.iter().flat_map(|slot| slot.keys.clone()).collect();
        keys.sort_unstable();
        keys.dedup();
        let mut block = Block {
            index,
            measurement,
            table: Arc::new(table),
            weights,
            noise,
            loss,
            robust,
            excluded: Arc::default(),
            counted: Arc::default(),
            seen: Seen { program, measurement },
            execution,
            combinations: Vec::new(),
            keys,
            known: HashMap::new(),
            programs: Programs::default(),
        };
        block.combine(layout)?;
        Ok(block)
    }

    fn combine(&mut self, layout: &Layout) -> Result<(), Box<Diagnostic>> {
        let table = Arc::clone(&self.table);
        let program = self.seen.program;
        let mut buffer = Buffer::default();
        let all = if self.keys.is_empty() { table.rows().min(1) } else { table.rows() };
        for piece in pieces(all) {
            let rows = table.read(piece, &mut buffer).map_err(|error| Box::new(Table::unreadable(&error)))?;
            for row in 0..rows.len() {
                let numbers = rows.keys(row);
                let chosen: Vec<u32> = self.keys.iter().map(|&key| numbers[key]).collect();
                if self.known.contains_key(&chosen) {
                    continue;
                }
                let group = |slot: &Slot| {
                    let family = program.parameters[slot.parameter].family;
                    let member = family.then(|| member(slot, &table, numbers));
                    layout.group(slot.parameter, member.as_deref()).unwrap_or(0)
                };
                self.known.insert(chosen, self.combinations.len() as u32);
                self.combinations.push(self.measurement.slots.iter().map(group).collect());
            }
        }
        Ok(())
    }

    /// Adds a row whose combination of names is known; whether it is, and the row has the columns of the others.
    pub(super) fn push(&mut self, names: &[&str], readings: &[f64], line: Option<usize>) -> bool {
        let number =
            |&key: &usize| self.table.names(key).iter().position(|known| Some(&known.as_str()) == names.get(key));
        let numbers: Option<Vec<u32>> = self.keys.iter().map(|key| number(key).map(|at| at as u32)).collect();
        let known = numbers.is_some_and(|numbers| self.known.contains_key(&numbers));
        // without rows there is no combination yet
        let known = known && !self.combinations.is_empty();
        known && Arc::make_mut(&mut self.table).push(names, readings, line).is_ok()
    }

    /// Whether there is a row of this number.
    ///
    /// # Errors
    /// Where there is none.
    pub(super) fn has_row(&self, row: usize) -> Result<(), Undefined> {
        let rows = self.table.rows();
        if row < rows {
            return Ok(());
        }
        let message = format!("`{}` has no row number {row}: it has {rows}, counted from 0", self.measurement.name);
        Err(Undefined(Box::new(Diagnostic::error(Code::NoRows, message))))
    }

    /// Whether a row takes no part.
    pub fn excludes(&self, row: usize) -> bool {
        !self.excluded.is_empty() && self.excluded.binary_search(&row).is_ok()
    }

    /// Whether every row that takes part counts once.
    pub(super) fn counts_once(&self) -> bool {
        self.counted.is_empty()
    }

    /// How many times a row counts that takes part.
    pub(super) fn weight(&self, row: usize) -> f64 {
        if self.counted.is_empty() { 1.0 } else { self.counted.get(&row).copied().unwrap_or(1.0) }
    }

    /// The same rows, with nothing compiled yet.
    pub(super) fn anew(&self) -> Self {
        Block { programs: Programs::default(), ..self.clone() }
    }

    /// The combination of a row whose names have these numbers.
    pub(super) fn combination(&self, numbers: &[u32]) -> u32 {
        if self.keys.is_empty() {
            return 0;
        }
        let chosen: Vec<u32> = self.keys.iter().map(|&key| numbers[key]).collect();
        self.known.get(&chosen).copied().unwrap_or(0)
    }

    pub(super) fn combination_of(&self, row: usize) -> usize {
        let numbers: Vec<u32> = (0..self.measurement.keys.len()).map(|key| self.table.key_index(row, key)).collect();
        self.combination(&numbers) as usize
    }

    /// The numbers of a combination's leaves at a point.
    pub(super) fn leaves(&self, combination: usize, layout: &Layout, point: &[f64]) -> Vec<f64> {
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

    /// Calls `visit(row, values)` for every row in order, with residuals (not whitened) or outputs.
    ///
    /// # Errors
    /// Where an output is not a number, or the point has not as many numbers as there are coordinates.
    pub fn values(
        &self,
        what: Quantities,
        layout: &Layout,
        point: &[f64],
        mut visit: impl FnMut(usize, &[f64]),
    ) -> Result<(), Undefined> {
        layout.fits(point)?;
        let compiled = match what {
            Quantities::Residuals => self.seen.residuals(&self.programs, &self.weights, self.execution.instructions()),
            Quantities::Outputs => self.seen.outputs(&self.programs, self.execution.instructions()),
        };
        let factors: Vec<f64> = match what {
            Quantities::Residuals => self.weights.iter().map(|weight| 1.0 / weight).collect(),
            Quantities::Outputs => vec![1.0; compiled.outputs()],
        };
        let pass = Pass::new(self, compiled, layout, point);
        let mut values = vec![0.0; compiled.outputs()];
        for piece in pieces(self.table.rows()) {
            pass.piece(piece, |span, found| {
                for i in 0..span.count {
                    for (output, (value, factor)) in values.iter_mut().zip(&factors).enumerate() {
                        *value = found.output(output)[i] * factor;
                    }
                    if values.iter().any(|value| !value.is_finite()) {
                        return Err(self.explain(what, layout, point, span, false));
                    }
                    visit(span.first + i, &values);
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Calls `visit` with the whitened residuals and derivatives of every row, by dual numbers: what all faster evaluation is
    /// measured against. `place` gives each coordinate's place among the free ones.
    ///
    /// # Errors
    /// Where a residual or a derivative is not a number, or the point, or `place`, has not as many numbers as there are
    /// coordinates.
    pub fn jacobians(
        &self,
        layout: &Layout,
        point: &[f64],
        place: &[Option<usize>],
        mut visit: impl FnMut(RowJacobian) -> Result<(), Undefined>,
    ) -> Result<(), Undefined> {
        layout.fits(point)?;
        same_size(layout.coordinates.len(), place.len())?;
        let tape = &self.measurement.tape;
        let mut values = vec![0.0; tape.outputs()];
        let mut begun: HashMap<usize, (Evaluator, Vec<usize>, Vec<f64>)> = HashMap::new();
        for row in 0..self.table.rows() {
            let combination = self.combination_of(row);
            let (evaluator, columns, derivatives) = begun.entry(combination).or_insert_with(|| {
                let Touched { leaves, columns } = self.touched(combination, layout, place);
                let mut evaluator = Evaluator::new(tape, leaves);
                evaluator.begin(&self.leaves(combination, layout, point));
                let derivatives = vec![0.0; tape.outputs() * columns.len()];
                (evaluator, columns, derivatives)
            });
            let inputs = self.table.row(row);
            evaluator.row(&inputs, &mut values, derivatives);
            if values.iter().chain(&*derivatives).any(|value| !value.is_finite()) {
                return Err(self.undefined(evaluator, &inputs, row, Quantities::Residuals, true));
            }
            for (i, &weight) in self.weights.iter().enumerate() {
                values[i] *= weight;
                for derivative in &mut derivatives[i * columns.len()..(i + 1) * columns.len()] {
                    *derivative *= weight;
                }
            }
            visit(RowJacobian { row, residuals: &values, derivatives, columns })?;
        }
        Ok(())
    }

    /// Calls `visit(row, evaluate)` for every row, where `evaluate(inputs, residuals, derivatives by inputs)` gives what is not
    /// whitened, by dual numbers.
    ///
    /// # Errors
    /// Where the point has not as many numbers as there are coordinates.
    pub fn input_jacobians(
        &self,
        layout: &Layout,
        point: &[f64],
        mut visit: impl FnMut(usize, &mut dyn FnMut(&[f64], &mut [f64], &mut [f64])),
    ) -> Result<(), Undefined> {
        layout.fits(point)?;
        let tape = &self.measurement.tape;
        let mut begun: HashMap<usize, Evaluator> = HashMap::new();
        for row in 0..self.table.rows() {
            let combination = self.combination_of(row);
            let evaluator = begun.entry(combination).or_insert_with(|| {
                let mut evaluator = Evaluator::new(tape, (0..tape.inputs()).map(Leaf::Input).collect());
                evaluator.begin(&self.leaves(combination, layout, point));
                evaluator
            });
            visit(row, &mut |inputs, values, derivatives| evaluator.row(inputs, values, derivatives));
        }
        Ok(())
    }

    /// Why a span of rows has something that is not a number: the first row and operation, by the evaluation that names them.
    pub(super) fn explain(
        &self,
        what: Quantities,
        layout: &Layout,
        point: &[f64],
        span: &Span,
        derivatives: bool,
    ) -> Undefined {
        let width = self.measurement.inputs.len();
        let find = |derivatives: bool| {
            span.combination.iter().enumerate().find_map(|(i, &combination)| {
                let inputs = &span.readings[i * width..(i + 1) * width];
                let mut evaluator = Evaluator::new(self.tape(what), Vec::new());
                evaluator.begin(&self.leaves(combination as usize, layout, point));
                let bad = inputs.iter().any(|reading| !reading.is_finite())
                    || evaluator.undefined(inputs, derivatives).is_some();
                bad.then(|| self.undefined(&mut evaluator, inputs, span.first + i, what, derivatives))
            })
        };
        find(false).or_else(|| derivatives.then(|| find(true)).flatten()).unwrap_or_else(|| {
            let (first, last) = (span.first + 1, span.first + span.count);
            let message = format!(
                "measurement `{}`, rows {first} to {last}: a number is too large, or no number",
                self.measurement.name
            );
            let place = self.table.place(span.first);
            Undefined(Box::new(Diagnostic::error(Code::UndefinedAtStart, message).at_data(place)))
        })
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
            Some(undefined) => (why(undefined), undefined.spoils.first().and_then(|&i| self.name(what, i))),
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

/// What an operation lacks where it is undefined.
pub(super) fn why(undefined: &crate::graph::Undefined) -> String {
    let operation = undefined.operation.row();
    let missing = if (operation.defined)(undefined.x, undefined.y) { "derivative" } else { "value" };
    let (name, domain) = (operation.name, operation.domain);
    format!("`{name}` has no {missing} at {}; it is defined {domain}", arguments(undefined))
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
