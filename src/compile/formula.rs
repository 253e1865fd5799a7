//! Derivatives that people wrote by hand, in the model's `derivatives`, to be compared with the exact ones.

use std::sync::Arc;

use super::declarations::Declarations;
use super::measurement;
use super::program::Input;
use super::quantity::Quantities;
use super::scope::{Binding, Locals, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostics, Source, Span, nearest};
use crate::graph::{Graph, Scalar};
use crate::lang::Expr;
use crate::model::{self, Map, Model, Text};
use crate::unit::Dimension;

/// The name of the parameter in question, in a formula for several.
const ANY: &str = "q";
/// The key of another form of the quantity itself.
const SAME: &str = "=";

/// A formula that somebody wrote by hand: the derivative of a quantity by a parameter or input, or another form of itself.
#[derive(Clone, Debug)]
pub struct Formula {
    /// The quantity.
    pub of: String,
    /// Its components, `vo.x`, or itself.
    pub names: Vec<String>,
    /// What it measures.
    pub dimension: Dimension,
    /// The components as nodes of the graph.
    pub values: Vec<Scalar>,
    /// By what it is differentiated; by nothing where the formula is another form of the quantity itself.
    pub by: Option<By>,
    /// The formula's components.
    pub given: Vec<Scalar>,
    /// The formula as written.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

/// By what a formula differentiates.
#[derive(Clone, Debug)]
pub struct By {
    /// The coordinate or input.
    pub name: String,
    /// Its leaf in the graph.
    pub leaf: Scalar,
    /// What it measures.
    pub dimension: Dimension,
    /// Whether it is an input.
    pub input: bool,
    /// Whether the formula speaks of several as `q`.
    pub any: bool,
}

/// The formulas of one measurement.
#[derive(Clone, Debug)]
pub struct Formulas {
    /// The number of the measurement.
    pub measurement: usize,
    /// All that they and the quantities are made of, over the leaves and inputs of the compiled measurement.
    pub graph: Graph,
    /// One for each quantity and each parameter or input that a text speaks of.
    pub all: Vec<Formula>,
}

/// Compiles the `derivatives` of a model, which has been compiled before.
///
/// # Errors
/// Mistakes of names, shapes and dimensions.
pub fn formulas(model: &Model, source: &Arc<Source>) -> Result<Vec<Formulas>, Diagnostics> {
    let (mut all, mut diagnostics) = (Vec::new(), Diagnostics::new());
    for (measurement, (_, declared)) in model.measurements.iter().enumerate() {
        if declared.derivatives.is_empty() {
            continue;
        }
        let found = within(model, source, declared, |scope, leaves| {
            let all = of_measurement(scope, leaves, &declared.derivatives);
            (all, std::mem::take(&mut scope.graph), std::mem::take(&mut scope.diagnostics))
        });
        diagnostics.extend(found.2);
        all.push(Formulas { measurement, graph: found.1, all: found.0 });
    }
    if diagnostics.has_errors() { Err(diagnostics.sorted()) } else { Ok(all) }
}

/// Does something where the definitions and residuals of a measurement are known.
fn within<R>(
    model: &Model,
    source: &Arc<Source>,
    declared: &model::Measurement,
    with: impl FnOnce(&mut Scope, &[By]) -> R,
) -> R {
    let mut ignored = Diagnostics::new();
    let declarations = Declarations::read(model, source, &mut ignored);
    let quantities = Quantities::read(model, source, &mut ignored);
    let inputs = measurement::inputs(declared, &quantities, &mut ignored);
    let mut scope = Scope::new(&declarations);
    measurement::bind(&mut scope, declared, &inputs);
    measurement::residuals(&mut scope, declared, &quantities, &mut ignored);
    scope.diagnostics = Diagnostics::new();
    let leaves = leaves(&mut scope, &inputs);
    with(&mut scope, &leaves)
}

fn of_measurement(scope: &mut Scope, leaves: &[By], declared: &Map<Map<Text>>) -> Vec<Formula> {
    let source = Arc::clone(&scope.declarations.source);
    let mut all = Vec::new();
    for (of, texts) in declared.iter() {
        let Some(value) = scope.value(&Snippet::new(of, &source)) else { continue };
        let Some(components) = value.components(&mut scope.graph) else {
            let message =
                format!("a derivative is that of a scalar or a vector, and `{}` is {}", of.value, value.shape());
            let hint = "take the origin or an axis of a frame: `F.o`, `F.z`";
            scope.diagnostics.push(Snippet::new(of, &source).whole(Code::WrongShape, message).hint(hint));
            continue;
        };
        let named: Vec<&str> = texts.keys().map(|by| by.value.as_str()).filter(|by| !by.ends_with('*')).collect();
        for (by, text) in texts.iter() {
            let snippet = Snippet::new(text, &source);
            let Ok(expr) = snippet.parse().map_err(|found| scope.diagnostics.push(*found)) else { continue };
            let chosen = chosen(&by.value, leaves, &named);
            if chosen.is_empty() {
                let message = format!("no parameter or input of this measurement is called `{}`", by.value);
                let hint = nearest(&by.value, leaves.iter().map(|leaf| leaf.name.as_str()));
                let hint = hint.map(|near| format!("did you mean `{near}`?"));
                let found = Snippet::new(by, &source).whole(Code::UnknownName, message);
                scope.diagnostics.push(found.maybe_hint(hint));
            }
            for by in chosen {
                let Some(given) = given(scope, &expr, &snippet, by.as_ref(), value) else { break };
                all.push(Formula {
                    of: of.value.clone(),
                    names: components.iter().map(|(suffix, _, _)| format!("{}{suffix}", of.value)).collect(),
                    dimension: value.dimension().unwrap_or(Dimension::NUMBER),
                    values: components.iter().map(|(_, s, _)| *s).collect(),
                    by,
                    given,
                    text: text.value.clone(),
                    span: snippet.place(),
                });
            }
        }
    }
    all
}

/// What a key means: `=` the quantity itself, a name what is called so, `L1.*` all that begin so, `*` all parameters; those that have
/// a formula of their own left out.
fn chosen(key: &str, leaves: &[By], named: &[&str]) -> Vec<Option<By>> {
    if key == SAME {
        return vec![None];
    }
    let Some(start) = key.strip_suffix('*') else {
        return leaves.iter().filter(|leaf| leaf.name == key).cloned().map(Some).collect();
    };
    // inputs come last
    let among = leaves.iter().filter(|leaf| !start.is_empty() || !leaf.input);
    let meant = among.filter(|leaf| leaf.name.starts_with(start) && !named.contains(&leaf.name.as_str()));
    meant.map(|leaf| Some(By { any: true, ..leaf.clone() })).collect()
}

/// The components of a formula by a leaf.
fn given(scope: &mut Scope, expr: &Expr, at: &Snippet, by: Option<&By>, of: Value) -> Option<Vec<Scalar>> {
    let Some(by) = by.filter(|by| by.any) else {
        let found = scope.expression(expr, at, &Locals::default())?;
        return fitting(scope, found, at, by, of);
    };
    if scope.has(ANY) || scope.declarations.symbol(ANY).is_some() {
        let message = format!("`{ANY}` names the parameter in question here, and is a name of the model as well");
        let found = at.whole(Code::NameTaken, message);
        scope.diagnostics.push(found.hint("give the other one another name, or name each parameter by itself"));
        return None;
    }
    // not `bind`: the leaf keeps its own name
    scope.lend(ANY, Binding::Value(Value::Scalar(by.leaf, by.dimension)));
    let found = scope.expression(expr, at, &Locals::default());
    scope.take_back(ANY);
    fitting(scope, found?, at, Some(by), of)
}

/// The components of a value that has the shape and dimension of the derivative.
fn fitting(scope: &mut Scope, found: Value, at: &Snippet, by: Option<&By>, of: Value) -> Option<Vec<Scalar>> {
    if !matches!((found, of), (Value::Scalar(..), Value::Scalar(..)) | (Value::Vector(..), Value::Vector(..))) {
        let message = format!("what is wanted here is {}, and this is {}", of.shape(), found.shape());
        scope.diagnostics.push(at.whole(Code::WrongShape, message));
        return None;
    }
    let number = Dimension::NUMBER;
    let of = of.dimension().unwrap_or(number);
    let wanted = by.map_or(Some(of), |by| of.checked_div(by.dimension.without_angle())).unwrap_or(number);
    let dimension = found.dimension().unwrap_or(number);
    if !dimension.compatible(wanted) && !found.is_zero(&mut scope.graph) {
        let what = match by {
            Some(by) => format!("the derivative of {} by {}", of.noun(), by.dimension.noun()),
            None => "the quantity".to_owned(),
        };
        let message = format!("{what} is {}, and this is {}", wanted.noun(), dimension.noun());
        scope.diagnostics.push(at.whole(Code::WrongDimension, message));
        return None;
    }
    let components = found.components(&mut scope.graph)?;
    Some(components.into_iter().map(|(_, s, _)| s).collect())
}

/// Everything by which a measurement can be differentiated: the coordinates of its parameters, its inputs.
fn leaves(scope: &mut Scope, inputs: &[Input]) -> Vec<By> {
    let mut slots: Vec<_> = scope.slots.clone();
    slots.sort_by_key(|slot| slot.parameter);
    let mut all = Vec::new();
    for slot in &slots {
        let declared = scope.declarations.numbered(slot.parameter);
        let (shape, dimensions, plain) = (declared.shape, declared.dimensions.clone(), declared.name.clone());
        let keys: Vec<String> = slot.keys.iter().filter_map(|&key| scope.key_name(key)).collect();
        let name = if keys.is_empty() { plain } else { format!("{plain}[{}]", keys.join(", ")) };
        for (i, (suffix, dimension)) in shape.suffixes().iter().zip(dimensions).enumerate() {
            let leaf = scope.graph.parameter((slot.first_leaf + shape.tangent_leaf(i)) as u32);
            all.push(By { name: format!("{name}{suffix}"), leaf, dimension, input: false, any: false });
        }
    }
    for (i, input) in inputs.iter().enumerate() {
        let leaf = scope.graph.input(i as u32);
        all.push(By { name: input.name.clone(), leaf, dimension: input.unit.dimension, input: true, any: false });
    }
    all
}

/// A place in which formulas can be tried instead of one that stands there.
pub struct Trial<'t, 'd> {
    scope: &'t mut Scope<'d>,
    alike: &'t [(usize, Formula)],
    value: Value,
    at: &'t Snippet,
}

impl<'t> Trial<'t, '_> {
    /// Does something with another formula instead of one of those of the text: its graph and components; none where it makes no sense.
    pub fn with<R>(&mut self, of: &Formula, expr: &Expr, look: impl FnOnce(&Graph, &[Scalar]) -> R) -> Option<R> {
        let (nodes, slots, labels) = (self.scope.graph.len(), self.scope.slots.len(), self.scope.labels.len());
        let found = given(self.scope, expr, self.at, of.by.as_ref(), self.value);
        let seen = found.map(|components| look(&self.scope.graph, &components));
        self.scope.forget(nodes, slots, labels);
        seen
    }

    /// The formulas of the text that stands there, in this graph, by their numbers: one for each parameter that it speaks of.
    pub fn formulas(&self) -> &'t [(usize, Formula)] {
        self.alike
    }
}

/// Tries formulas in the place of the text of one of a measurement's, both by their numbers; none where there is no such formula.
pub fn try_formulas<R>(
    model: &Model,
    source: &Arc<Source>,
    (measurement, number): (usize, usize),
    with: impl FnOnce(&mut Trial) -> R,
) -> Option<R> {
    let (_, declared) = model.measurements.iter().nth(measurement)?;
    within(model, source, declared, |scope, leaves| {
        let all = of_measurement(scope, leaves, &declared.derivatives);
        let span = all.get(number)?.span;
        let alike: Vec<(usize, Formula)> = all.into_iter().enumerate().filter(|(_, one)| one.span == span).collect();
        let (of, texts) = declared.derivatives.entry(&alike.first()?.1.of)?;
        let text = texts.values().find(|text| text.span == span)?;
        let value = scope.value(&Snippet::new(of, source))?;
        let at = Snippet::new(text, source);
        Some(with(&mut Trial { scope, alike: &alike, value, at: &at }))
    })
}
