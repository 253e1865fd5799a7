//! Conditions between parameters, g = 0 or g ≤ 0, as tapes over the parameters alone.

use std::collections::HashMap;
use std::sync::Arc;

use super::declarations::Declarations;
use super::operator;
use super::scope::{Literals, Locals, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostic, Diagnostics, Source, Span};
use crate::graph::{Derived, Scalar, Tape, View, differentiate};
use crate::lang::{self, Comparison};
use crate::model::Model;
use crate::solve::Relation;
use crate::unit::Dimension;

/// All constraints of a model.
#[derive(Clone, Debug)]
pub struct Constraints {
    /// the parameters and members that they name
    pub slots: Vec<Named>,
    /// how many leaves the slots have
    pub leaves: usize,
    /// what is asked, one scalar each, in the order of the file
    pub items: Vec<Constraint>,
    /// three outputs over the leaves for each item: g, the left side, the right side
    pub tape: Tape,
    /// ∂g over the leaves, by item and then by its columns
    pub derivatives: Tape,
}

/// A parameter or member that a constraint names. Its leaves are numbered from `first_leaf`.
#[derive(Clone, Debug)]
pub struct Named {
    /// which parameter
    pub parameter: usize,
    /// the key of the member, for a family
    pub member: Option<String>,
    /// the number of its first leaf
    pub first_leaf: usize,
    /// where a member is named first
    pub span: Span,
}

/// One scalar that a constraint asks to be zero, or to be not above zero.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// `known bar`, `together.x`, `range (lower)`
    pub name: String,
    /// the two sides that are compared, as the language writes them
    pub text: String,
    /// what is asked of g, the side that shall be smaller less the other
    pub relation: Relation,
    /// what its sides measure
    pub dimension: Dimension,
    /// whether g is linear in all parameters, free or held
    pub linear: bool,
    /// what it depends on: slots, and coordinates of their parameters
    pub columns: Vec<(usize, usize)>,
    /// where it stands
    pub span: Span,
}

/// Two sides whose difference is a scalar.
struct Pair {
    name: String,
    text: String,
    relation: Relation,
    dimension: Dimension,
    /// g, left, right
    nodes: [Scalar; 3],
    /// pairs of one number come from one comparison
    comparison: usize,
    span: Span,
}

/// Compiles the constraints of a model.
pub(crate) fn compile(model: &Model, declarations: &Declarations, diagnostics: &mut Diagnostics) -> Constraints {
    let mut scope = Scope::new(declarations);
    scope.literals = Some(Literals { elsewhere: elsewhere(model, declarations), ..Literals::default() });
    let mut pairs = Vec::new();
    for (name, text) in model.constraints.iter() {
        let snippet = Snippet::new(text, &declarations.source);
        match snippet.relation() {
            Ok(relation) => {
                // one mistake is one message
                let _ = compare(&mut scope, &name.value, &relation, &snippet, &mut pairs);
            }
            Err(mistake) => scope.diagnostics.push(*mistake),
        }
    }
    let slots = named(&mut scope);
    let (mut columns, mut leaves) = (Vec::new(), Vec::new());
    let mut view = View::default();
    for (s, slot) in slots.iter().enumerate() {
        let shape = declarations.numbered(slot.parameter).shape;
        columns.extend((0..shape.dimension()).map(|k| (s, k)));
        leaves.extend((0..shape.dimension()).map(|k| slot.first_leaf + shape.tangent_leaf(k)));
        view.zeros.extend((shape.dimension()..shape.leaves()).map(|k| (slot.first_leaf + k) as u32));
    }
    let leaves: Vec<Scalar> = leaves.into_iter().map(|leaf| scope.graph.parameter(leaf as u32)).collect();
    let g: Vec<Scalar> = pairs.iter().map(|pair| pair.nodes[0]).collect();
    let derived = differentiate(&scope.graph, &g, &leaves, &view);
    let (items, kept, derivatives) = classify(&pairs, &columns, &derived, &declarations.source, &mut scope.diagnostics);
    diagnostics.extend(std::mem::take(&mut scope.diagnostics));
    Constraints {
        slots,
        leaves: scope.leaves,
        items,
        tape: Tape::lower(&scope.graph, &kept),
        derivatives: Tape::lower(&derived.graph, &derivatives),
    }
}

/// Names that measurements know and constraints do not, each with what it is.
fn elsewhere(model: &Model, declarations: &Declarations) -> HashMap<String, String> {
    let mut found = HashMap::new();
    for (measurement, declared) in model.measurements.iter() {
        let mut add = |name: &str, what: &str| {
            if declarations.symbol(name).is_none() {
                found.entry(name.to_owned()).or_insert_with(|| format!("{what} of `{measurement}`"));
            }
        };
        declared.inputs.keys().for_each(|name| add(&name.value, "an input"));
        declared.keys.iter().for_each(|name| add(&name.value, "a column of names"));
        declared.define.keys().for_each(|name| add(&name.value, "a definition"));
    }
    found
}

/// The slots of a scope whose expressions have named them all.
fn named(scope: &mut Scope) -> Vec<Named> {
    let literals = scope.literals.take().unwrap_or_default();
    let slot = |(s, slot): (usize, super::program::Slot)| Named {
        parameter: slot.parameter,
        member: slot.keys.first().and_then(|&key| literals.members.get(key).cloned()),
        first_leaf: slot.first_leaf,
        span: literals.spans.get(s).copied().unwrap_or_default(),
    };
    std::mem::take(&mut scope.slots).into_iter().enumerate().map(slot).collect()
}

/// The pairs of scalars that a relation compares; none where a mistake has been reported.
fn compare(
    scope: &mut Scope,
    name: &str,
    relation: &lang::Relation,
    at: &Snippet,
    pairs: &mut Vec<Pair>,
) -> Option<()> {
    let (comparison, sides) = (relation.comparison, &relation.sides);
    let values: Vec<Option<Value>> = sides.iter().map(|side| scope.expression(side, at, &Locals::default())).collect();
    let values: Vec<Value> = values.into_iter().collect::<Option<_>>()?;
    let sign = comparison.symbol();
    for (value, side) in values.iter().zip(sides) {
        let hint = match value {
            Value::Rotation(_) | Value::Frame(..) => {
                "compare origins, `F.o = G.o`, and rotations, `log_rotation(inverse(F.r) * G.r) = vec(0, 0, 0)`"
            }
            Value::Vector(..) if comparison != Comparison::Equal => "compare a component, or `norm(…)`",
            _ => continue,
        };
        let message = format!("`{sign}` does not compare {}", plural(value));
        scope.report(Code::WrongShape, side, at, &message, Some(hint.into()));
        return None;
    }
    let ends = [values.first(), values.last()].map(|end| match end {
        Some(&Value::Scalar(s, _)) => scope.graph.value(s),
        _ => None,
    });
    let mut relation = match comparison {
        Comparison::Equal => Relation::Equal,
        Comparison::AtMost | Comparison::AtLeast => Relation::AtMost,
    };
    let mut suffixes = ["", ""];
    let mut count = sides.len() - 1;
    if let (3, [Some(first), Some(last)]) = (sides.len(), ends) {
        let empty = if comparison == Comparison::AtLeast { first < last } else { first > last };
        if empty {
            let message = format!("no value is within the range of `{name}`: its least is above its most");
            scope.diagnostics.push(at.whole(Code::ImpossibleConstraint, message));
            return None;
        }
        if first == last {
            // a range of one value is an equation, which solvers do better as such
            (relation, count) = (Relation::Equal, 1);
        }
    }
    if count == 2 {
        suffixes = if comparison == Comparison::AtMost { [" (lower)", " (upper)"] } else { [" (upper)", " (lower)"] };
    }
    let neighbours = sides.iter().zip(sides.iter().skip(1)).zip(values.iter().zip(values.iter().skip(1)));
    for (((one, other), (&left, &right)), suffix) in neighbours.zip(suffixes).take(count) {
        let units = scope.declarations.units;
        let dimension = match operator::difference(&mut scope.graph, &units, sign, left, right) {
            Ok(difference) => difference.dimension()?,
            Err(mismatch) => {
                let span = at.span(&(one.span.start..other.span.end));
                let found = Diagnostic::error(mismatch.kind.code(), mismatch.message).at(&at.source, span);
                scope.diagnostics.push(found.maybe_hint(mismatch.hint));
                return None;
            }
        };
        let [left, right] = [left, right].map(|value| value.components(&mut scope.graph).unwrap_or_default());
        let comparison = pairs.last().map_or(0, |pair| pair.comparison + 1);
        for ((component, left, _), (_, right, _)) in left.into_iter().zip(right) {
            let g = match sign {
                ">=" => scope.graph.sub(right, left),
                _ => scope.graph.sub(left, right),
            };
            pairs.push(Pair {
                name: format!("{name}{component}{suffix}"),
                text: format!("{one} {sign} {other}"),
                relation,
                dimension,
                nodes: [g, left, right],
                comparison,
                span: at.place(),
            });
        }
    }
    Some(())
}

fn plural(value: &Value) -> &'static str {
    match value {
        Value::Scalar(..) => "scalars",
        Value::Vector(..) => "vectors",
        Value::Rotation(_) => "rotations",
        Value::Frame(..) => "frames",
    }
}

/// The pairs that say something, the nodes of their tape, and their derivatives. What holds or fails whatever the parameters
/// are is reported; a component of a vector that always holds is left out.
fn classify(
    pairs: &[Pair],
    columns: &[(usize, usize)],
    derived: &Derived,
    source: &Arc<Source>,
    diagnostics: &mut Diagnostics,
) -> (Vec<Constraint>, Vec<Scalar>, Vec<Scalar>) {
    let number = |s: Scalar| derived.graph.value(s);
    let mut slopes = derived.derivatives.chunks(columns.len().max(1));
    let seen: Vec<Vec<((usize, usize), Scalar)>> = pairs
        .iter()
        .map(|_| {
            let row = slopes.next().unwrap_or_default();
            columns.iter().copied().zip(row.iter().copied()).filter(|&(_, slope)| number(slope) != Some(0.0)).collect()
        })
        .collect();
    let (mut items, mut nodes, mut derivatives) = (Vec::new(), Vec::new(), Vec::new());
    for ((pair, known), value) in pairs.iter().zip(&seen).zip(&derived.values) {
        if known.is_empty() {
            let holds = match (number(*value), pair.relation) {
                (Some(g), Relation::Equal) => g == 0.0,
                (Some(g), Relation::AtMost) => g <= 0.0,
                (None, _) => false,
            };
            let depends = pairs.iter().zip(&seen).any(|(p, seen)| p.comparison == pair.comparison && !seen.is_empty());
            let found = match (depends, holds) {
                (true, true) => continue,
                (true, false) => {
                    let message = format!("`{}` holds nowhere: no parameter changes either side", pair.name);
                    Diagnostic::error(Code::ImpossibleConstraint, message)
                }
                (false, _) => {
                    let message = format!("`{}` depends on no parameter", pair.text);
                    Diagnostic::error(Code::ConstantConstraint, message)
                        .hint("name what it shall restrict; a constant becomes a parameter by `Held(…)`")
                }
            };
            diagnostics.push(found.at(source, pair.span));
            continue;
        }
        items.push(Constraint {
            name: pair.name.clone(),
            text: pair.text.clone(),
            relation: pair.relation,
            dimension: pair.dimension,
            linear: known.iter().all(|&(_, slope)| number(slope).is_some()),
            columns: known.iter().map(|&(column, _)| column).collect(),
            span: pair.span,
        });
        nodes.extend(pair.nodes);
        derivatives.extend(known.iter().map(|&(_, slope)| slope));
    }
    (items, nodes, derivatives)
}
