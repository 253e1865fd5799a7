//! The derivatives of one row by every route.

use super::super::complex::ComplexStep;
use super::super::differences::differences;
use super::batch::Batch;
use super::sizes::Sizes;
use crate::compile::Measurement;
use crate::eval::{Evaluator, Leaf};
use crate::graph::{Operation, Scalar, Tape};
use crate::problem::{Block, Problem, Undefined};
use crate::symbolic::{Change, differential, unit};
use crate::unit::Dimension;

/// Where a difference says that it is so uncertain, it may be off by so many times that.
const BEYOND_UNCERTAINTY: f64 = 30.0;
/// Rounding of a difference, as a share of what the derivative does to a residual for a change of the size of what is changed.
const SHARE: f64 = 1e-9;
/// Differences that are less certain than this share of it show nothing.
const SHARP: f64 = 1e-6;

/// What rounding of the terms of a residual makes of a difference with the finest step, 0.0006: two steps may agree by chance.
const ROUNDING: f64 = 4.0 * f64::EPSILON / 0.0006;

/// Smaller steps, as a share of the others.
const SMALLER: f64 = 1e-3;

/// By what the residuals of a row are differentiated.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: String,
    pub(super) dimension: Dimension,
    /// the coordinate, or the input
    of: Result<usize, usize>,
    /// the leaves that move with it, by their place among those of [`Residuals`]
    leaves: Vec<usize>,
}

impl Column {
    pub(super) fn is_input(&self) -> bool {
        self.of.is_err()
    }

    /// What it has at a point.
    pub(super) fn value(&self, row: &Row, point: &[f64]) -> f64 {
        match self.of {
            Ok(coordinate) => point[coordinate],
            Err(input) => row.inputs[input],
        }
    }
}

/// The residuals of a measurement as the routes beside the engine need them.
pub(super) struct Residuals<'p> {
    measurement: &'p Measurement,
    /// what a parameter's coordinates, slot by slot, and the inputs are differentiated by
    leaves: Vec<Leaf>,
    symbolic: Option<Tape>,
    steps: Vec<Result<ComplexStep, Operation>>,
}

/// A row at a point.
pub(super) struct Row {
    pub(super) columns: Vec<Column>,
    pub(super) leaves: Vec<f64>,
    pub(super) inputs: Vec<f64>,
    /// The residuals.
    values: Vec<f64>,
    /// By residual and then by column, by dual numbers.
    pub(super) exact: Vec<f64>,
}

/// A difference, and how far from the derivative it may be; none where it shows nothing.
pub(super) type Difference = Option<(f64, f64)>;

impl<'p> Residuals<'p> {
    /// For values and dual numbers.
    pub(super) fn new(measurement: &'p Measurement) -> Residuals<'p> {
        Residuals { measurement, leaves: Vec::new(), symbolic: None, steps: Vec::new() }
    }

    /// For all routes.
    pub(super) fn for_all_routes(problem: &Problem<'p>, block: &Block<'p>) -> Residuals<'p> {
        let measurement = block.measurement;
        let mut leaves = Vec::new();
        for slot in &measurement.slots {
            let shape = problem.program.parameters[slot.parameter].shape;
            leaves.extend((0..shape.dimension()).map(|k| Leaf::Parameter(slot.first_leaf + shape.tangent_leaf(k))));
        }
        leaves.extend((0..measurement.tape.inputs()).map(Leaf::Input));
        let step = |&equation: &Scalar| ComplexStep::new(&measurement.graph, equation);
        let steps = measurement.equations.iter().map(step).collect();
        Residuals { symbolic: Some(symbolic(measurement, &leaves)), steps, measurement, leaves }
    }

    /// The operation for which the complex step leaves a residual out.
    pub(super) fn not_analytic(&self, residual: usize) -> Option<Operation> {
        self.steps[residual].as_ref().err().copied()
    }

    /// Whether the residuals have values and derivatives.
    pub(super) fn defined(&self, leaves: &[f64], inputs: &[f64]) -> bool {
        let all: Vec<Leaf> = (0..self.measurement.tape.parameters()).map(Leaf::Parameter).collect();
        let (m, n) = (self.measurement.residuals.len(), all.len());
        let mut evaluator = Evaluator::new(&self.measurement.tape, all);
        let (mut values, mut derivatives) = (vec![0.0; m], vec![0.0; m * n]);
        evaluator.begin(leaves);
        evaluator.row(inputs, &mut values, &mut derivatives);
        values.iter().chain(&derivatives).all(|number| number.is_finite())
    }

    /// Whether those of a row have.
    pub(super) fn defined_in(&self, problem: &Problem, block: &Block, row: usize, point: &[f64]) -> bool {
        let leaves = block.leaves_of(&problem.layout, point, row);
        leaves.is_ok_and(|leaves| self.defined(&leaves, &block.table.row(row)))
    }

    /// A row by dual numbers, whatever is undefined.
    ///
    /// # Errors
    /// Where there is no such row, or the point is not one of the problem.
    pub(super) fn row(&self, problem: &Problem, block: &Block, row: usize, point: &[f64]) -> Result<Row, Undefined> {
        let columns = self.columns(problem, block, row);
        let (leaves, inputs) = (block.leaves_of(&problem.layout, point, row)?, block.table.row(row).to_vec());
        let (m, all) = (self.measurement.residuals.len(), self.leaves.len());
        // by these alone: what has no derivative by a parameter that is held may have one by all that is free
        let used: Vec<usize> = columns.iter().flat_map(|column| column.leaves.iter().copied()).collect();
        let mut evaluator =
            Evaluator::new(&self.measurement.tape, used.iter().map(|&leaf| self.leaves[leaf]).collect());
        let (mut values, mut found) = (vec![0.0; m], vec![0.0; m * used.len()]);
        evaluator.begin(&leaves);
        evaluator.row(&inputs, &mut values, &mut found);
        let mut derivatives = vec![0.0; m * all];
        for i in 0..m {
            for (k, leaf) in used.iter().enumerate() {
                derivatives[i * all + leaf] = found[i * used.len() + k];
            }
        }
        let exact = self.merged(&columns, &derivatives);
        Ok(Row { columns, leaves, inputs, values, exact })
    }

    /// The free coordinates that a row touches, and its inputs.
    fn columns(&self, problem: &Problem, block: &Block, row: usize) -> Vec<Column> {
        let (layout, places) = (&problem.layout, problem.places());
        let mut columns: Vec<Column> = Vec::new();
        let mut leaf = 0;
        for (slot, first) in self.measurement.slots.iter().zip(block.touched_by(layout, row)) {
            for k in 0..problem.program.parameters[slot.parameter].shape.dimension() {
                let (c, known) = (first + k, &layout.coordinates[first + k]);
                match columns.iter_mut().find(|column| column.of == Ok(c)) {
                    // one member by two names
                    Some(column) => column.leaves.push(leaf),
                    None if places[c].is_some() => columns.push(Column {
                        name: known.name.clone(),
                        dimension: known.dimension,
                        of: Ok(c),
                        leaves: vec![leaf],
                    }),
                    None => {}
                }
                leaf += 1;
            }
        }
        let inputs = self.measurement.inputs.iter().take(self.measurement.tape.inputs()).enumerate();
        columns.extend(inputs.map(|(k, input)| Column {
            name: input.name.clone(),
            dimension: input.unit.dimension,
            of: Err(k),
            leaves: vec![leaf + k],
        }));
        columns
    }

    /// From derivatives by leaves to those by columns.
    fn merged(&self, columns: &[Column], by_leaf: &[f64]) -> Vec<f64> {
        let line = |line: &[f64]| -> Vec<f64> {
            columns.iter().map(|column| column.leaves.iter().map(|&leaf| line[leaf]).sum()).collect()
        };
        by_leaf.chunks(self.leaves.len().max(1)).flat_map(line).collect()
    }

    /// By the symbolic derivative.
    pub(super) fn symbolic(&self, row: &Row) -> Vec<f64> {
        let found = self.symbolic.as_ref().map(|tape| tape.evaluate(&row.leaves, &row.inputs));
        self.merged(&row.columns, &found.unwrap_or_default())
    }

    /// By the complex step; none where it does not apply.
    pub(super) fn complex_step(&self, row: &Row) -> Vec<Option<f64>> {
        let place = |leaf: &Leaf| match *leaf {
            Leaf::Parameter(k) => Ok(k),
            Leaf::Input(k) => Err(k),
        };
        let one = |step: &ComplexStep, column: &Column| {
            let moving: Vec<_> = column.leaves.iter().map(|&leaf| place(&self.leaves[leaf])).collect();
            step.derivative((&row.leaves, &row.inputs), |leaf| moving.contains(&leaf))
        };
        let of = |step: &Result<ComplexStep, Operation>| -> Vec<Option<f64>> {
            row.columns.iter().map(|column| step.as_ref().ok().map(|step| one(step, column))).collect()
        };
        self.steps.iter().flat_map(of).collect()
    }

    /// By central differences: with steps of the size of what is changed, or, where large numbers have small differences that matter,
    /// with smaller ones.
    pub(super) fn differences(&self, problem: &Problem, row: &Row, point: &[f64]) -> Vec<Difference> {
        let sizes = Sizes::of(problem, point);
        let mut all = vec![None; row.exact.len()];
        for (j, column) in row.columns.iter().enumerate() {
            let unit = match column.of {
                Ok(c) => sizes.number(column.dimension, point[c], Some(problem.layout.coordinates[c].tolerance)),
                Err(k) => sizes.number(column.dimension, row.inputs[k], None),
            };
            for share in [1.0, SMALLER] {
                let unit = share * unit;
                for (i, found) in self.by_steps(row, column, unit).into_iter().enumerate() {
                    let at = i * row.columns.len() + j;
                    let natural = sizes.residual(self.measurement.residuals[i].dimension, row.values[i]);
                    let noise = ROUNDING * natural.max(self.largest_like(row, i));
                    let found = sharp(found, share * natural + (row.exact[at] * unit).abs(), noise, unit);
                    let better = |(_, allowed): &(f64, f64)| all[at].is_none_or(|(_, known)| *allowed < known);
                    all[at] = found.filter(better).or(all[at]);
                }
            }
        }
        all
    }

    /// The largest reading of a residual's dimension: it is a difference of numbers of this size, however small it is itself.
    fn largest_like(&self, row: &Row, residual: usize) -> f64 {
        let dimension = self.measurement.residuals[residual].dimension;
        let readings = self.measurement.inputs.iter().zip(&row.inputs);
        readings
            .filter(|(input, _)| input.unit.dimension == dimension)
            .fold(0.0, |most, (_, value)| most.max(value.abs()))
    }

    /// The change of each residual by a unit of a column, and how uncertain it is.
    fn by_steps(&self, row: &Row, column: &Column, unit: f64) -> Vec<(f64, f64)> {
        let moved = |h: f64| {
            let (mut leaves, mut inputs) = (row.leaves.clone(), row.inputs.clone());
            for &leaf in &column.leaves {
                match self.leaves[leaf] {
                    Leaf::Parameter(k) => leaves[k] += h * unit,
                    Leaf::Input(k) => inputs[k] += h * unit,
                }
            }
            let values = self.measurement.tape.evaluate(&leaves, &inputs);
            values.iter().all(|value| value.is_finite()).then_some(values)
        };
        differences(self.measurement.residuals.len(), moved)
    }
}

/// What a difference by a unit says of a derivative, where a residual is of some size and known but for some noise.
fn sharp((found, uncertainty): (f64, f64), size: f64, noise: f64, unit: f64) -> Difference {
    let allowed = BEYOND_UNCERTAINTY * uncertainty + SHARE * size + noise;
    (uncertainty <= SHARP * size).then_some((found / unit, allowed / unit))
}

impl Row {
    pub(super) fn is_defined(&self) -> bool {
        self.values.iter().chain(&self.exact).all(|number| number.is_finite())
    }
}

/// The derivatives of all residuals by all leaves, by residual and then by leaf: those that `derive` writes.
fn symbolic(measurement: &Measurement, leaves: &[Leaf]) -> Tape {
    let mut graph = (*measurement.graph).clone();
    let roots: Vec<_> = measurement.equations.iter().map(|equation| equation.0).collect();
    let mut outputs = vec![graph.constant(0.0); roots.len() * leaves.len()];
    for (k, leaf) in leaves.iter().enumerate() {
        let known = match *leaf {
            Leaf::Parameter(index) => graph.known_parameter(index as u32),
            Leaf::Input(index) => graph.known_input(index as u32),
        };
        let Some(known) = known else { continue };
        let seed = unit(&mut graph, known);
        let changes = differential(&mut graph, &roots, &[seed], &|_| false);
        for (i, root) in roots.iter().enumerate() {
            if let Some(Change::Scalar(change)) = changes.get(root) {
                outputs[i * leaves.len() + k] = *change;
            }
        }
    }
    Tape::lower(&graph, &outputs)
}

/// The derivatives of every sample by the engine, in the order of its row's columns.
pub(super) fn engine(batch: &Batch, rows: &[Row]) -> Result<Vec<Vec<f64>>, Undefined> {
    let mut all = vec![Vec::new(); batch.samples.len()];
    for block in 0..batch.problem.blocks.len() {
        let width = batch.problem.blocks[block].measurement.inputs.len();
        for (number, point) in batch.points.iter().enumerate() {
            let here = |k: &usize| batch.samples[*k].block == block && batch.samples[*k].point == number;
            let wanted: Vec<usize> = (0..batch.samples.len()).filter(here).collect();
            if wanted.is_empty() {
                continue;
            }
            batch.problem.engine_rows(block, point, |found| {
                for &k in wanted.iter().filter(|&&k| batch.samples[k].row == found.row) {
                    let lines = found.by_inputs.chunks(width.max(1));
                    let n = found.columns.len();
                    let m = batch.problem.blocks[block].measurement.residuals.len();
                    let lines: Vec<&[f64]> = if width == 0 { vec![&[]; m] } else { lines.collect() };
                    for (i, by_inputs) in lines.iter().enumerate() {
                        let by_coordinates = &found.by_coordinates[i * n..(i + 1) * n];
                        let entry = |column: &Column| match column.of {
                            Ok(c) => {
                                let columns = found.columns.iter().zip(by_coordinates);
                                columns.filter(|(known, _)| **known == c).map(|(_, derivative)| derivative).sum()
                            }
                            Err(k) => by_inputs[k],
                        };
                        all[k].extend(rows[k].columns.iter().map(entry));
                    }
                }
            })?;
        }
    }
    Ok(all)
}
