//! From a program and tables to a problem.

use std::collections::HashSet;

use super::block::{Block, member};
use super::execution::Execution;
use super::layout::Layout;
use super::pass::pieces;
use super::selection::Selection;
use super::{Problem, solving::Undefined};
use crate::compile::{Measurement, Program, Role};
use crate::data::{Buffer, Table};
use crate::diag::{Code, Diagnostic, Diagnostics, nearest};

/// How residuals are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// All alike, each in its reported unit: the paper's (25).
    Unit,
    /// By the declared standard deviations of the residuals.
    Sigma,
}

impl Weights {
    /// `unit` or `sigma`.
    pub fn name(self) -> &'static str {
        match self {
            Weights::Unit => "unit",
            Weights::Sigma => "sigma",
        }
    }
}

/// How to bind.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// By default `sigma` where every residual has one, else `unit`.
    pub weights: Option<Weights>,
    /// What is freed, fixed, and started from.
    pub selection: Selection,
    /// With which instructions, and by how many threads.
    pub execution: Execution,
}

impl<'p> Problem<'p> {
    /// Binds tables (by measurement number) to a program. Measurements without a table take no part.
    ///
    /// # Errors
    /// Unknown names among what is freed, fixed or started from; weights without sigmas; no rows at all.
    pub fn bind(
        program: &'p Program,
        tables: Vec<(usize, Table)>,
        options: &Options,
    ) -> Result<(Problem<'p>, Diagnostics), Diagnostics> {
        let mut diagnostics = Diagnostics::new();
        let members = members(program, &tables, &mut diagnostics);
        unused_members(program, &members, &mut diagnostics);
        let mut layout = Layout::new(program, &members);
        let mut start = options.selection.apply(program, &mut layout, &mut diagnostics);
        let measurements = || tables.iter().map(|(index, _)| &program.measurements[*index]);
        if tables.iter().all(|(_, table)| table.rows() == 0) {
            let found = Diagnostic::error(Code::NoRows, "there are no rows of data");
            diagnostics.push(found.hint("name a file with `data` in the model, or by `--data MEASUREMENT=FILE`"));
        }
        let weights = decide_weights(program, measurements(), options.weights, &mut diagnostics);
        for (c, coordinate) in layout.coordinates.iter().enumerate() {
            let inside = start[c].clamp(coordinate.min, coordinate.max);
            if coordinate.role == Role::Free && inside != start[c] {
                let message =
                    format!("`{}` starts outside its bounds and was moved to the nearest of them", coordinate.name);
                diagnostics.push(Diagnostic::warning(Code::StartProjected, message));
                start[c] = inside;
            }
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let free: Vec<usize> =
            (0..layout.coordinates.len()).filter(|&c| layout.coordinates[c].role == Role::Free).collect();
        let scale = free.iter().map(|&c| layout.coordinates[c].tolerance).collect();
        let mut blocks = Vec::with_capacity(tables.len());
        for (index, table) in tables {
            let measurement = &program.measurements[index];
            let factors = whitening(program, measurement, weights);
            match Block::new(program, index, table, factors, &layout, options.execution.clone()) {
                Ok(block) => blocks.push(block),
                Err(found) => diagnostics.push(*found),
            }
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let execution = options.execution.clone();
        Ok((Problem { program, layout, blocks, weights, start, free, scale, execution }, diagnostics))
    }

    /// The same rows with other coordinates free.
    pub fn with_free(&self, free: Vec<usize>) -> Problem<'p> {
        let scale = free.iter().map(|&c| self.layout.coordinates[c].tolerance).collect();
        // what is differentiated changes
        let blocks = self.blocks.iter().map(Block::anew).collect();
        Problem { free, scale, blocks, ..self.clone() }
    }

    /// Whether all residuals have a value at a point.
    ///
    /// # Errors
    /// The first that has none.
    pub fn check(&self, point: &[f64]) -> Result<(), Undefined> {
        self.sum_of_squares(point).map(|_| ())
    }
}

/// 1/σ of each residual, or, for unit weights, one over the reported unit.
fn whitening(program: &Program, measurement: &Measurement, weights: Weights) -> Vec<f64> {
    let weight = |residual: &crate::compile::Residual| match (weights, residual.sigma) {
        (Weights::Sigma, Some(sigma)) => 1.0 / sigma,
        _ => program.units.to_reported(1.0, residual.dimension),
    };
    measurement.residuals.iter().map(weight).collect()
}

/// The members of each family that rows name: those that are declared first, then the others in the order of the rows. A
/// declared member that no row names takes no part, for no data can see it.
fn members(program: &Program, tables: &[(usize, Table)], diagnostics: &mut Diagnostics) -> Vec<Vec<String>> {
    let mut named: Vec<Vec<String>> = vec![Vec::new(); program.parameters.len()];
    let mut seen: Vec<HashSet<String>> = vec![HashSet::new(); program.parameters.len()];
    for (index, table) in tables {
        for slot in &program.measurements[*index].slots {
            if !program.parameters[slot.parameter].family {
                continue;
            }
            for numbers in chosen(table, &slot.keys, diagnostics) {
                let key = member(slot, table, &numbers);
                if seen[slot.parameter].insert(key.clone()) {
                    named[slot.parameter].push(key);
                }
            }
        }
    }
    for ((parameter, named), seen) in program.parameters.iter().zip(&mut named).zip(&seen) {
        let declared = || parameter.members.iter().map(|(key, _)| key);
        let known: HashSet<&String> = declared().collect();
        let mut all: Vec<String> = declared().filter(|key| seen.contains(*key)).cloned().collect();
        all.extend(named.iter().filter(|key| !known.contains(key)).cloned());
        *named = all;
    }
    named
}

/// The different names, by their numbers, that rows have in some key columns, in the order of the rows.
fn chosen(table: &Table, keys: &[usize], diagnostics: &mut Diagnostics) -> Vec<Vec<u32>> {
    let mut known: HashSet<Vec<u32>> = HashSet::new();
    let mut all = Vec::new();
    let mut buffer = Buffer::default();
    for piece in pieces(table.rows()) {
        let rows = match table.read(piece, &mut buffer) {
            Ok(rows) => rows,
            Err(error) => {
                diagnostics.push(Table::unreadable(&error));
                break;
            }
        };
        for row in 0..rows.len() {
            let numbers = rows.keys(row);
            if known.insert(keys.iter().map(|&key| numbers[key]).collect()) {
                all.push(numbers.to_vec());
            }
        }
    }
    all
}

/// Members that the model states and no row names.
fn unused_members(program: &Program, members: &[Vec<String>], diagnostics: &mut Diagnostics) {
    for (parameter, named) in program.parameters.iter().zip(members).filter(|(_, named)| !named.is_empty()) {
        for (key, _) in parameter.members.iter().filter(|(key, _)| !named.contains(key)) {
            let message = format!("the member `{key}` of `{}` is in no row", parameter.name);
            let hint = nearest(key, named.iter().map(String::as_str)).map(|near| format!("did you mean `{near}`?"));
            let found = Diagnostic::warning(Code::UnusedMember, message).at(&program.source, parameter.span);
            diagnostics.push(found.maybe_hint(hint));
        }
    }
}

fn decide_weights<'m>(
    program: &Program,
    measurements: impl Iterator<Item = &'m Measurement>,
    wanted: Option<Weights>,
    diagnostics: &mut Diagnostics,
) -> Weights {
    let measurements: Vec<_> = measurements.collect();
    let bare =
        measurements.iter().flat_map(|m| m.residuals.iter().map(move |r| (m, r))).find(|(_, r)| r.sigma.is_none());
    match (wanted, bare) {
        (Some(Weights::Sigma), Some((measurement, residual))) => {
            let message = format!("the residual `{}` of `{}` has no sigma", residual.name, measurement.name);
            diagnostics.push(Diagnostic::error(Code::SigmaMissing, message).at(&program.source, residual.span));
            Weights::Sigma
        }
        (Some(weights), _) => weights,
        (None, None) => Weights::Sigma,
        (None, Some((measurement, residual))) => {
            if measurements.iter().any(|m| m.residuals.iter().any(|r| r.sigma.is_some())) {
                let message = format!(
                    "sigmas of residuals are not used, for `{}` of `{}` has none: all residuals count alike",
                    residual.name, measurement.name
                );
                let found = Diagnostic::warning(Code::SigmasUnused, message).at(&program.source, residual.span);
                diagnostics.push(found.hint("give it a sigma, or say `--weights unit`"));
            }
            if measurements.iter().any(|m| m.inputs.iter().any(|input| input.sigma.is_some())) {
                let message =
                    "inputs carry sigmas, but weights propagated from them do not exist yet: all residuals count alike";
                diagnostics.push(
                    Diagnostic::warning(Code::UnitWeights, message).hint("say `--weights unit` to be rid of this"),
                );
            }
            Weights::Unit
        }
    }
}
