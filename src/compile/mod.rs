//! From what the file says to mathematics: [`compile`] turns a [`Model`] into a [`Program`].
//!
//! Names, arity, shapes and dimensions are checked here, before anything runs; all mistakes are reported at once. A chain
//! becomes a product of frames, the paper's formulas are functions of the [`PRELUDE`], and each measurement ends as a tape of
//! scalar operations over its own list of parameters, so that nothing presumes that every row sees every parameter.

mod call;
mod chain;
mod constraint;
mod core;
mod declarations;
mod derivative;
mod formula;
mod leaves;
mod measurement;
mod names;
mod noise;
mod operator;
mod prelude;
mod program;
mod quantity;
mod scenario;
mod scope;
mod snippet;
#[cfg(test)]
mod tests;
mod value;

pub use constraint::{Constraint, Constraints, Named};
pub use formula::{Formula, Formulas, Trial, formulas, try_formulas};
pub use names::{Coordinate, coordinates, is_taken};
pub use prelude::PRELUDE;
pub use program::{
    Distribution, Input, KeyDistribution, LossOf, Measurement, Output, Parameter, Program, Residual, Robust, Role,
    Scenario, Setting, Shape, Sigma, Simulation, Slot, Step,
};

use std::collections::HashSet;
use std::sync::Arc;

use crate::diag::{Code, Diagnostic, Diagnostics, Source, Span};
use crate::model::{Model, Quantity, Text};
use crate::solve::Relation;
use crate::unit::{Dimension, Unit};
use declarations::{Declarations, Symbol};
use quantity::Quantities;
use scope::Scope;

/// Compiles a model. Warnings come with the program; with any error there is none.
///
/// `extra` are expressions that every measurement which can shall put out as well.
///
/// # Errors
///
/// All mistakes of names, shapes, dimensions, bounds and definitions.
///
/// ```
/// use phical::{compile::compile, diag::Source, model::load};
/// let source = Source::new("line.ron", r#"(
///     name: "line",
///     parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(0)) },
///     measurements: { "point": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - (a + b*x)"}) },
/// )"#);
/// let (model, _) = load(&source).unwrap();
/// let (program, _) = compile(&model, &source, &[]).unwrap();
/// assert_eq!(program.measurements[0].residuals.len(), 1);
/// ```
pub fn compile(model: &Model, source: &Arc<Source>, extra: &[String]) -> Result<(Program, Diagnostics), Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let declarations = Declarations::read(model, source, &mut diagnostics);
    // its mistakes have been reported
    let quantities = Quantities::read(model, source, &mut Diagnostics::new());
    check_symbols(&declarations, &mut diagnostics);

    let mut measurements = Vec::new();
    let mut extra_mistakes = Vec::new();
    for (name, declared) in model.measurements.iter() {
        let mut own = Diagnostics::new();
        measurements.push(measurement::compile(name, declared, &declarations, &quantities, extra, &mut own));
        let (of_extra, own): (Vec<_>, Vec<_>) = own.into_iter().partition(|d| in_source(d, "--expr"));
        diagnostics.extend(own);
        extra_mistakes.push(of_extra);
    }
    // an expression of the command line has to mean something in one measurement, not in all
    if !extra_mistakes.is_empty() && extra_mistakes.iter().all(|mistakes| !mistakes.is_empty()) {
        diagnostics.extend(extra_mistakes.swap_remove(0));
    }
    if measurements.iter().all(|m| m.residuals.is_empty()) && !diagnostics.has_errors() {
        let found = Diagnostic::error(Code::NoResiduals, "the model states nothing that must vanish");
        diagnostics.push(
            found.at(source, model.name.span).hint("add a measurement with `residuals: {\"name\": \"expression\"}`"),
        );
    }
    let mut scenarios = Vec::new();
    for (name, declared) in model.scenarios.iter() {
        scenarios.push(scenario::compile(
            name,
            declared,
            model,
            &measurements,
            &declarations,
            &quantities,
            &mut diagnostics,
        ));
    }
    let constraints = constraint::compile(model, &declarations, &mut diagnostics);
    if !diagnostics.has_errors() {
        check_use(&declarations.parameters, &measurements, &constraints, source, &mut diagnostics);
    }
    let diagnostics = diagnostics.sorted();
    if diagnostics.has_errors() {
        return Err(diagnostics);
    }
    let constants = declarations.constants();
    let Declarations { units, parameters, .. } = declarations;
    let program = Program {
        name: model.name.value.clone(),
        units,
        parameters,
        constants,
        constraints,
        measurements,
        scenarios,
        source: Arc::clone(source),
    };
    Ok((program, diagnostics))
}

/// A constant of a wanted dimension from text outside the model, such as `0.2 mm`, in internal units. A bare number counts in
/// the model's unit; `what` says whose value it is.
///
/// # Errors
/// What is wrong with the text.
pub fn quantity(program: &Program, what: &str, text: &str, wanted: Dimension) -> Result<f64, Diagnostics> {
    let source = Source::new(what, text);
    let quantities = Quantities::of_units(program.units, &source);
    let span = Span::new(0, text.len());
    let text = Text { value: text.to_owned(), span, exact: true };
    let mut diagnostics = Diagnostics::new();
    quantities.constant(&Quantity::Text(text), wanted, None, &mut diagnostics).ok_or(diagnostics)
}

/// A constant of the model file for a column of this unit, in internal units. A bare number counts in the column's unit.
/// Mistakes are reported, and then there is none.
pub fn column_constant(
    program: &Program,
    quantity: &Quantity,
    unit: Unit,
    diagnostics: &mut Diagnostics,
) -> Option<f64> {
    let quantities = Quantities::of_units(program.units, &program.source);
    quantities.constant(quantity, unit.dimension, Some(unit), diagnostics)
}

fn in_source(diagnostic: &Diagnostic, name: &str) -> bool {
    matches!(&diagnostic.place, Some(crate::diag::Place::Text { source, .. }) if source.name() == name)
}

/// Ties and definitions are checked whether or not a measurement uses them.
fn check_symbols(declarations: &Declarations, diagnostics: &mut Diagnostics) {
    let mut scope = Scope::new(declarations);
    let names: Vec<String> = declarations.symbol_names().map(str::to_owned).collect();
    for name in &names {
        if let Some(Symbol::Tie(..) | Symbol::Definition(..)) = declarations.symbol(name) {
            scope.touch(name);
        }
    }
    diagnostics.extend(scope.diagnostics);
}

/// A free parameter that no residual depends on cannot be found, unless an equation leads from others to it.
fn check_use(
    parameters: &[Parameter],
    measurements: &[Measurement],
    constraints: &Constraints,
    source: &Arc<Source>,
    diagnostics: &mut Diagnostics,
) {
    let mut used: HashSet<usize> = HashSet::new();
    for measurement in measurements {
        let mut leaves = vec![false; measurement.leaves];
        for output in 0..measurement.tape.outputs() {
            for (leaf, used) in leaves.iter_mut().zip(measurement.tape.dependencies(output).0) {
                *leaf |= used;
            }
        }
        for slot in &measurement.slots {
            let own = leaves
                .iter()
                .skip(slot.first_leaf)
                .take(parameters.get(slot.parameter).map_or(0, |p| p.shape.leaves()));
            if own.into_iter().any(|&used| used) {
                used.insert(slot.parameter);
            }
        }
    }
    for item in constraints.items.iter().filter(|item| item.relation == Relation::Equal) {
        let slots = item.columns.iter().filter_map(|&(slot, _)| constraints.slots.get(slot));
        used.extend(slots.map(|slot| slot.parameter));
    }
    for (number, parameter) in parameters.iter().enumerate() {
        if !used.contains(&number) && parameter.setting.has_free() {
            let message = format!("no residual depends on the free parameter `{}`", parameter.name);
            let found = Diagnostic::error(Code::UnusedParameter, message).at(source, parameter.span);
            diagnostics.push(found.hint("use it, hold it with `Held(…)`, or remove it"));
        }
    }
}
