//! From a program and tables to a problem.

use std::collections::HashSet;

use super::block::{Block, Weighting, member};
use super::constraints::Conditions;
use super::execution::Execution;
use super::known::{Estimates, Known};
use super::layout::Layout;
use super::noise::{Factors, Noise, residual_group};
use super::pass::pieces;
use super::robust::RowLoss;
use super::selection::Selection;
use super::{Problem, solving::Undefined};
use crate::compile::{Measurement, Program, Residual, Robust, Role, Sigma};
use crate::data::{Buffer, Table};
use crate::diag::{Code, Diagnostic, Diagnostics, nearest};

/// Coordinates that are estimated together. Their matrices are dense: 5000 squared are 200 MB each, and a step takes minutes.
const MOST_FREE: usize = 5000;

/// How residuals are weighted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// All alike, each in its reported unit: the paper's (25).
    Unit,
    /// By the declared standard deviations of the residuals.
    Sigma,
    /// By what the declared errors of the inputs make of the residuals, and by those of the residuals: readings are
    /// corrected until the equations hold.
    Propagated,
}

impl Weights {
    /// Every kind.
    pub const ALL: [Weights; 3] = [Weights::Unit, Weights::Sigma, Weights::Propagated];

    /// `unit`, `sigma` or `propagated`.
    pub fn name(self) -> &'static str {
        match self {
            Weights::Unit => "unit",
            Weights::Sigma => "sigma",
            Weights::Propagated => "propagated",
        }
    }

    /// Whether they tell how large residuals may be.
    pub fn are_real(self) -> bool {
        self != Weights::Unit
    }
}

/// How to bind.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// By default `propagated` where inputs carry sigmas, `sigma` where only residuals do, else `unit`.
    pub weights: Option<Weights>,
    /// What large residuals count, instead of what the model says.
    pub robust: Option<Robust>,
    /// Factors of the declared standard deviations, by groups of inputs.
    pub factors: Factors,
    /// What is freed, fixed, and started from.
    pub selection: Selection,
    /// What other fits have found out; of their parameters it takes the place of the declared priors.
    pub known: Vec<Estimates>,
    /// With which instructions, and by how many threads.
    pub execution: Execution,
    /// Whether the model's constraints are left out, as where values are taken as they are and nothing is searched for.
    pub unconstrained: bool,
}

impl<'p> Problem<'p> {
    /// Binds tables (by measurement number) to a program. Measurements without a table take no part.
    ///
    /// # Errors
    /// Measurements that the program has not; tables of other columns than theirs; unknown names among what is freed, fixed or
    /// started from; weights without sigmas; no rows at all.
    pub fn bind(
        program: &'p Program,
        tables: Vec<(usize, Table)>,
        options: &Options,
    ) -> Result<(Problem<'p>, Diagnostics), Diagnostics> {
        let mut diagnostics = Diagnostics::new();
        for (index, table) in &tables {
            match program.measurement(*index) {
                Ok(measurement) => check_columns(measurement, table, &mut diagnostics),
                Err(found) => diagnostics.push(*found),
            }
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let members = members(program, &tables, &mut diagnostics);
        unused_members(program, &members, &mut diagnostics);
        let mut layout = Layout::new(program, &members);
        let mut known = Vec::new();
        for estimates in &options.known {
            match estimates.read(program, &layout) {
                Ok(found) => known.push(found),
                Err(found) => diagnostics.push(*found),
            }
        }
        let mut start: Vec<f64> = layout.coordinates.iter().map(|c| c.nominal).collect();
        for (c, estimate) in known.iter().flat_map(Known::values) {
            layout.coordinates[c].sigma = None;
            start[c] = estimate;
        }
        options.selection.apply(program, &mut layout, &mut start, &mut diagnostics);
        let measurements = || tables.iter().map(|(index, _)| &program.measurements[*index]);
        if tables.iter().all(|(_, table)| table.rows() == 0) {
            let found = Diagnostic::error(Code::NoRows, "there are no rows of data");
            diagnostics.push(found.hint("name a file with `data` in the model, or by `--data MEASUREMENT=FILE`"));
        }
        let groups = if options.unconstrained { None } else { Conditions::groups(program, &layout, &mut diagnostics) };
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let weights = decide_weights(program, measurements(), options.weights, &mut diagnostics);
        for (c, coordinate) in layout.coordinates.iter().enumerate() {
            let inside = start[c].clamp(coordinate.min, coordinate.max);
            if inside == start[c] {
                continue;
            }
            let shown = |value: f64| program.units.shown(value, coordinate.dimension);
            let (name, value, nearest) = (&coordinate.name, shown(start[c]), shown(inside));
            let beyond = if start[c] < inside { "below its least" } else { "above its most" };
            let found = match coordinate.role {
                Role::Free => {
                    start[c] = inside;
                    let message = format!("`{name}` starts at {value}, {beyond}, and was moved to {nearest}");
                    Diagnostic::warning(Code::StartProjected, message)
                }
                Role::Held => {
                    let message = format!("`{name}` is held at {value}, {beyond}, which is {nearest}");
                    Diagnostic::warning(Code::HeldOutside, message)
                }
            };
            let parameter = &program.parameters[layout.groups[coordinate.group].parameter];
            diagnostics.push(found.at(&program.source, parameter.span));
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let free: Vec<usize> =
            (0..layout.coordinates.len()).filter(|&c| layout.coordinates[c].role == Role::Free).collect();
        if free.len() > MOST_FREE {
            let message = format!("{} coordinates are free, and no more than {MOST_FREE} can be", free.len());
            let found = Diagnostic::error(Code::TooLarge, message);
            diagnostics.push(found.hint("hold members of families by `--fix`, or take fewer rows at a time"));
            return Err(diagnostics);
        }
        let conditions = groups.map(|groups| Conditions::new(program, groups, &layout, &free)).unwrap_or_default();
        conditions.check_held(program, &layout, &start, &mut diagnostics);
        let scale = free.iter().map(|&c| layout.coordinates[c].tolerance).collect();
        let mut blocks = Vec::with_capacity(tables.len());
        for (index, table) in tables {
            let measurement = &program.measurements[index];
            let robust = options.robust.or(measurement.robust);
            let weighting = weighting(program, measurement, weights, robust, &options.factors);
            match Block::new(program, index, table, weighting, &layout, options.execution.clone()) {
                Ok(block) => blocks.push(block),
                Err(found) => diagnostics.push(*found),
            }
        }
        if diagnostics.has_errors() {
            return Err(diagnostics);
        }
        let execution = options.execution.clone();
        Ok((
            Problem {
                program,
                layout,
                blocks,
                weights,
                start,
                free,
                conditions,
                scale,
                execution,
                known: known.into(),
                absorbed: None,
            },
            diagnostics,
        ))
    }

    /// The same rows with other coordinates free. Constraints in which nothing is free any more are left out, and so are numbers
    /// of coordinates that there are not.
    pub fn with_free(&self, mut free: Vec<usize>) -> Problem<'p> {
        free.retain(|&c| c < self.layout.coordinates.len());
        let scale = free.iter().map(|&c| self.layout.coordinates[c].tolerance).collect();
        // what is differentiated changes
        let blocks = self.blocks.iter().map(Block::anew).collect();
        let conditions = self.conditions.with_free(self.program, &self.layout, &free);
        Problem { free, conditions, scale, blocks, ..self.clone() }
    }

    /// Whether all residuals have a value at a point.
    ///
    /// # Errors
    /// The first that has none.
    pub fn check(&self, point: &[f64]) -> Result<(), Undefined> {
        self.sums(point).map(|_| ())
    }
}

/// Says where rows are not those of a measurement.
fn check_columns(measurement: &Measurement, table: &Table, diagnostics: &mut Diagnostics) {
    let name = &measurement.name;
    let mut check = |found: usize, what: &str, wanted: usize, of: &str| {
        if table.rows() > 0 && found != wanted {
            let message = format!("rows of `{name}` have {found} {what}, and it has {wanted} {of}");
            diagnostics.push(Diagnostic::error(Code::FieldCount, message));
        }
    };
    check(table.width(), "readings", measurement.inputs.len(), "inputs");
    check(table.keys(), "names", measurement.keys.len(), "keys");
}

/// How the rows of a measurement count.
pub(super) fn weighting(
    program: &Program,
    measurement: &Measurement,
    weights: Weights,
    robust: Option<Robust>,
    factors: &Factors,
) -> Weighting {
    let noise = Noise::new(measurement, weights, robust, factors);
    let weight = |residual: &Residual| match residual.sigma {
        Some(Sigma::Constant(sigma)) if weights.are_real() && noise.is_none() => {
            1.0 / (sigma * factors.get(&residual_group(&residual.name)).copied().unwrap_or(1.0))
        }
        _ => program.units.to_reported(1.0, residual.dimension),
    };
    let weights_of = measurement.residuals.iter().map(weight).collect();
    let loss = robust.map(|robust| RowLoss::new(&robust, measurement, noise.is_some(), 1.0));
    Weighting { weights: weights_of, noise, loss, robust }
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

/// The residuals whose size no declared error tells: neither their own nor, where these count, one of their inputs'.
fn without_errors(measurement: &Measurement, inputs: bool) -> Vec<&Residual> {
    let told = |output: usize, residual: &Residual| {
        let depends = || measurement.tape.dependencies(output).1;
        let measured = || depends().iter().zip(&measurement.inputs).any(|(&on, input)| on && input.sigma.is_some());
        residual.sigma.is_some() || (inputs && measured())
    };
    let all = measurement.residuals.iter().enumerate();
    all.filter(|(output, residual)| !told(*output, residual)).map(|(_, residual)| residual).collect()
}

fn decide_weights<'m>(
    program: &Program,
    measurements: impl Iterator<Item = &'m Measurement>,
    wanted: Option<Weights>,
    diagnostics: &mut Diagnostics,
) -> Weights {
    let measurements: Vec<_> = measurements.collect();
    let missing = |inputs: bool| {
        let all = measurements.iter().flat_map(|m| without_errors(m, inputs).into_iter().map(move |r| (*m, r)));
        all.collect::<Vec<_>>()
    };
    let any_input = measurements.iter().any(|m| m.inputs.iter().any(|input| input.sigma.is_some()));
    let any_residual = measurements.iter().any(|m| m.residuals.iter().any(|r| r.sigma.is_some()));
    match wanted {
        Some(Weights::Sigma) => {
            if let Some((measurement, residual)) = missing(false).first() {
                let message = format!("the residual `{}` of `{}` has no sigma", residual.name, measurement.name);
                diagnostics.push(Diagnostic::error(Code::SigmaMissing, message).at(&program.source, residual.span));
            }
            Weights::Sigma
        }
        Some(Weights::Propagated) => {
            for (measurement, residual) in missing(true) {
                let message = format!(
                    "the residual `{}` of `{}` has no sigma and depends on no input that has one",
                    residual.name, measurement.name
                );
                let found = Diagnostic::error(Code::NoNoise, message).at(&program.source, residual.span);
                diagnostics.push(found.hint("give one of its inputs a sigma, or itself, or say `--weights unit`"));
            }
            Weights::Propagated
        }
        Some(Weights::Unit) => Weights::Unit,
        None if any_input => match missing(true).first() {
            None => Weights::Propagated,
            Some((measurement, residual)) => {
                let message = format!(
                    "sigmas are not used, for `{}` of `{}` has none and depends on no input that has one: all residuals \
                     count alike",
                    residual.name, measurement.name
                );
                let found = Diagnostic::warning(Code::UnitWeights, message).at(&program.source, residual.span);
                diagnostics.push(found.hint("give it a sigma, or say `--weights unit` to be rid of this"));
                Weights::Unit
            }
        },
        None => match missing(false).first() {
            None => Weights::Sigma,
            Some((measurement, residual)) if any_residual => {
                let message = format!(
                    "sigmas of residuals are not used, for `{}` of `{}` has none: all residuals count alike",
                    residual.name, measurement.name
                );
                let found = Diagnostic::warning(Code::SigmasUnused, message).at(&program.source, residual.span);
                diagnostics.push(found.hint("give it a sigma, or say `--weights unit`"));
                Weights::Unit
            }
            Some(_) => Weights::Unit,
        },
    }
}
