//! A measurement's columns, definitions, residuals and outputs as tapes.

use std::sync::Arc;

use super::declarations::{Declarations, Symbol};
use super::noise;
use super::program::{Input, Measurement, Output, Residual, Sigma};
use super::quantity::Quantities;
use super::scope::{Binding, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostics};
use crate::graph::{Scalar, Tape};
use crate::lang;
use crate::model::{self, Text};
use crate::symbolic::Label;
use crate::unit::{Dimension, Unit};

/// The columns of a measurement as numbers of the program, for now without their sigmas.
pub(crate) fn inputs(
    declared: &model::Measurement,
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> Vec<Input> {
    let mut inputs = Vec::with_capacity(declared.inputs.len());
    for (name, input) in declared.inputs.iter() {
        let (unit, dms) = match &input.unit {
            None => (Unit::ONE, false),
            Some(text) if matches!(text.value.as_str(), "d-m-s" | "dms") => {
                (Unit { factor: 1.0, dimension: Dimension::ANGLE }, true)
            }
            Some(text) => (quantities.unit(text, diagnostics).unwrap_or(Unit::ONE), false),
        };
        let wanted = unit.dimension;
        let mut constant = |q: &Option<model::Quantity>| {
            q.as_ref().and_then(|q| quantities.constant(q, wanted, Some(unit), diagnostics))
        };
        let (bias, default) = (constant(&input.bias).unwrap_or(0.0), constant(&input.default));
        let group = match &input.group {
            Some(group) => group.value.clone(),
            None => wanted.to_string(),
        };
        inputs.push(Input { name: name.value.clone(), unit, dms, sigma: None, bias, default, group });
    }
    inputs
}

/// Binds a measurement's columns and definitions.
pub(crate) fn bind(scope: &mut Scope, declared: &model::Measurement, inputs: &[Input]) {
    let source = Arc::clone(&scope.declarations.source);
    for (k, key) in declared.keys.iter().enumerate() {
        refuse_taken(scope, key, &source);
        scope.bind(&key.value, Binding::Key(k));
    }
    for (i, ((name, _), input)) in declared.inputs.iter().zip(inputs).enumerate() {
        refuse_taken(scope, name, &source);
        let node = scope.graph.input(i as u32);
        scope.bind(&name.value, Binding::Value(Value::Scalar(node, input.unit.dimension)));
    }
    definitions(scope, &declared.define, &source);
}

/// Binds definitions in their order, each seeing the ones before.
pub(crate) fn definitions(scope: &mut Scope, define: &model::Map<Text>, source: &Arc<crate::diag::Source>) {
    for (i, (name, text)) in define.iter().enumerate() {
        refuse_taken(scope, name, source);
        let snippet = Snippet::new(text, source);
        let before = scope.diagnostics.len();
        let value = scope.value(&snippet);
        if value.is_none() {
            // a name that is defined, but not before: say that instead of "there is no …"
            explain_order(scope, before, define, i);
        }
        scope.bind(&name.value, value.map_or(Binding::Broken, Binding::Value));
    }
}

/// Turns "there is no `b` here" into what it is where `b` is this definition or a later one.
fn explain_order(scope: &mut Scope, before: usize, define: &model::Map<Text>, at: usize) {
    let later: Vec<(&str, &Text)> = define.iter().skip(at).map(|(name, text)| (name.value.as_str(), text)).collect();
    let Some(&(this, _)) = later.first() else { return };
    let uses_this = |text: &Text| {
        lang::parse(&text.value).is_ok_and(|expr| {
            let mut found = false;
            expr.visit(|part| found |= matches!(&part.kind, lang::ExprKind::Name(name) if name == this));
            found
        })
    };
    for diagnostic in scope.diagnostics.0.iter_mut().skip(before) {
        let missing = |name: &str| diagnostic.message == format!("there is no `{name}` here");
        let Some(&(that, text)) = later.iter().find(|(name, _)| missing(name)) else { continue };
        if that == this || uses_this(text) {
            diagnostic.code = Code::Circular;
            diagnostic.message = if that == this {
                format!("`{this}` depends on itself")
            } else {
                format!("`{this}` and `{that}` depend on each other")
            };
            diagnostic.hint = Some("give one of them a value that does not lead back to it".into());
        } else {
            diagnostic.hint = Some(format!("`{that}` is defined further down: move it before `{this}`"));
        }
    }
}

fn refuse_taken(scope: &mut Scope, name: &Text, source: &Arc<crate::diag::Source>) {
    let at = Snippet::new(name, source);
    if !lang::is_name(&name.value) {
        scope.diagnostics.push(
            at.whole(Code::BadExpression, format!("`{}` is not a name", name.value))
                .hint("letters, digits and underscores, a letter first"),
        );
        return;
    } else if scope.has(&name.value) {
        let message = format!("`{}` is already another column or definition of this measurement", name.value);
        scope.diagnostics.push(at.whole(Code::NameTaken, message).hint("give one of them another name"));
        return;
    }
    refuse_taken_by_model(scope.declarations, name, &at, &mut scope.diagnostics);
}

/// Reports a name that the language or the model uses; says whether it did.
pub(crate) fn refuse_taken_by_model(
    declared: &Declarations,
    name: &Text,
    at: &Snippet,
    diagnostics: &mut Diagnostics,
) -> bool {
    let taken = if super::core::arity(&name.value).is_some() || name.value == "pi" {
        "part of the language"
    } else if declared.chain(&name.value).is_some() {
        "a chain"
    } else if matches!(declared.symbol(&name.value), Some(Symbol::Parameter(_) | Symbol::Definition(..))) {
        "a parameter or definition of the model"
    } else {
        return false;
    };
    let message = format!("`{}` is already {taken}", name.value);
    diagnostics.push(at.whole(Code::NameTaken, message).hint("give it another name here"));
    true
}

/// Compiles a measurement; `extra` are expressions of the command line, to be put out as well.
pub(crate) fn compile(
    name: &Text,
    declared: &model::Measurement,
    declarations: &Declarations,
    quantities: &Quantities,
    extra: &[String],
    diagnostics: &mut Diagnostics,
) -> Measurement {
    let source = Arc::clone(&declarations.source);
    let mut inputs = inputs(declared, quantities, diagnostics);
    let mut scope = Scope::new(declarations);
    bind(&mut scope, declared, &inputs);
    for ((_, declared), input) in declared.inputs.iter().zip(&mut inputs) {
        let (wanted, bare) = (input.unit.dimension, Some(input.unit));
        let found = declared.sigma.as_ref().map(|q| noise::sigma(&mut scope, q, wanted, bare, quantities, diagnostics));
        input.sigma = found.flatten();
    }
    let correlations = noise::correlations(&declared.correlations, &inputs, quantities, diagnostics);
    let robust = declared.loss.as_ref().and_then(|loss| noise::robust(loss, quantities, diagnostics));

    let (residuals, nodes) = residuals(&mut scope, declared, quantities, diagnostics);

    let (mut outputs, mut output_nodes) = (Vec::new(), Vec::new());
    let own = declared.outputs.iter().map(|(name, text)| (name.value.clone(), Snippet::new(text, &source)));
    let extra = extra.iter().map(|text| (text.clone(), Snippet::alone("--expr", text)));
    for (name, snippet) in own.chain(extra) {
        let Some(value) = scope.value(&snippet) else { continue };
        // an expression of the command line may name an output as well
        if lang::is_name(&name) && !scope.has(&name) {
            scope.bind(&name, Binding::Value(value));
        }
        for (suffix, node, dimension) in flattened(&mut scope, value) {
            outputs.push(Output {
                name: format!("{name}{suffix}"),
                dimension,
                place: (Arc::clone(&snippet.source), snippet.place()),
            });
            output_nodes.push(node);
        }
    }

    let varying = inputs.iter().filter_map(|input| match input.sigma {
        Some(Sigma::PerRow(node)) => Some(node),
        _ => None,
    });
    let sigma_tape = Tape::lower(&scope.graph, &varying.collect::<Vec<_>>());
    let tape = Tape::lower(&scope.graph, &nodes);
    let output_tape = Tape::lower(&scope.graph, &output_nodes);
    diagnostics.extend(scope.diagnostics);
    Measurement {
        name: name.value.clone(),
        keys: declared.keys.iter().map(|key| key.value.clone()).collect(),
        inputs,
        sigma_tape,
        correlations,
        robust,
        slots: scope.slots,
        leaves: scope.leaves,
        residuals,
        graph: Arc::new(scope.graph),
        labels: scope.labels,
        equations: nodes,
        tape,
        outputs,
        derived: output_nodes,
        output_tape,
        data: declared.data.0.clone(),
        span: name.span,
    }
}

/// What should vanish, and its nodes. Later expressions may name it.
pub(super) fn residuals(
    scope: &mut Scope,
    declared: &model::Measurement,
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> (Vec<Residual>, Vec<Scalar>) {
    let source = Arc::clone(&scope.declarations.source);
    let (mut residuals, mut nodes) = (Vec::new(), Vec::new());
    for (name, residual) in declared.residuals.iter() {
        let snippet = Snippet::new(&residual.value, &source);
        let Some((value, parts)) = scalars(scope, &snippet) else { continue };
        let free = lang::is_name(&name.value) && !scope.has(&name.value);
        let declarations = scope.declarations;
        if free && declarations.symbol(&name.value).is_none() && declarations.chain(&name.value).is_none() {
            scope.bind(&name.value, Binding::Value(value));
        } else {
            scope.label(value, Label::Name(name.value.clone()));
        }
        for (suffix, node, dimension) in parts {
            let sigma =
                residual.sigma.as_ref().and_then(|q| noise::sigma(scope, q, dimension, None, quantities, diagnostics));
            residuals.push(Residual {
                name: format!("{}{suffix}", name.value),
                dimension,
                sigma,
                span: snippet.place(),
            });
            nodes.push(node);
        }
    }
    (residuals, nodes)
}

/// Scalars of a value, with the suffix and the dimension of each.
type Parts = Vec<(&'static str, Scalar, Dimension)>;

/// The value of an expression that should vanish, and its scalars.
pub(crate) fn scalars(scope: &mut Scope, snippet: &Snippet) -> Option<(Value, Parts)> {
    let value = scope.value(snippet)?;
    let parts = scope.components(value);
    if parts.is_none() {
        let hint = "a scalar or a vector can vanish: `F.o - G.o` for positions, `log_rotation(inverse(F.r) * G.r)` for rotations";
        let found = snippet
            .whole(Code::WrongShape, format!("a residual is a scalar or a vector, and this is {}", value.shape()));
        scope.diagnostics.push(found.hint(hint));
    }
    Some((value, parts?))
}

/// The scalars of any value: a rotation gives its rotation vector, a frame its origin and its rotation vector.
fn flattened(scope: &mut Scope, value: Value) -> Vec<(&'static str, Scalar, Dimension)> {
    let rotation = |scope: &mut Scope, r| {
        let vector = scope.graph.log_rotation(r);
        let parts = scope.components(Value::Vector(vector, Dimension::ANGLE)).unwrap_or_default();
        parts.into_iter().zip([".rx", ".ry", ".rz"]).map(|((_, s, d), suffix)| (suffix, s, d)).collect::<Vec<_>>()
    };
    match value {
        Value::Rotation(r) => rotation(scope, r),
        Value::Frame(f, dimension) => {
            let (origin, r) = (scope.graph.origin(f), scope.graph.rotation_of(f));
            let mut parts = scope.components(Value::Vector(origin, dimension)).unwrap_or_default();
            parts.extend(rotation(scope, r));
            parts
        }
        _ => scope.components(value).unwrap_or_default(),
    }
}
