//! The parameters of a measurement as leaves of its graph.

use super::program::{Parameter, Shape, Slot};
use super::scope::{Locals, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::Code;
use crate::graph::{Frame, Graph, Scalar};
use crate::lang::{self, Expr, ExprKind};
use crate::symbolic::Label;
use crate::unit::Dimension;

impl Scope<'_> {
    /// The nodes of a parameter, made once.
    pub(super) fn parameter(&mut self, parameter: usize, keys: Vec<usize>) -> Value {
        let key = (parameter, keys);
        if let Some(&known) = self.slot_values.get(&key) {
            return known;
        }
        let declared = self.declarations.numbered(parameter);
        let first = self.leaves;
        let leaf = |graph: &mut Graph, i: usize| graph.parameter((first + i) as u32);
        let triple = |graph: &mut Graph, from: usize| {
            let [x, y, z] = [0, 1, 2].map(|i| leaf(graph, from + i));
            graph.vector(x, y, z)
        };
        let g = &mut self.graph;
        let dimension = declared.dimensions.first().copied().unwrap_or(Dimension::NUMBER);
        let rotation = |g: &mut Graph, from: usize| {
            let (value, perturbation) = (triple(g, from), triple(g, from + 3));
            let (value, perturbation) = (g.exp_rotation(value), g.exp_rotation(perturbation));
            g.compose_rotation(value, perturbation)
        };
        let value = match declared.shape {
            Shape::Scalar => Value::Scalar(leaf(g, 0), dimension),
            Shape::Vec3 => Value::Vector(triple(g, 0), dimension),
            Shape::Rotation => Value::Rotation(rotation(g, 0)),
            Shape::Pose => {
                let (origin, r) = (triple(g, 0), rotation(g, 3));
                Value::Frame(g.frame(r, origin), dimension)
            }
        };
        self.label_parameter(declared, &key.1, first, value);
        self.leaves += declared.shape.leaves();
        self.slots.push(Slot { parameter, keys: key.1.clone(), first_leaf: first });
        self.slot_values.insert(key, value);
        value
    }

    /// A joint's symbol as a scalar.
    pub(crate) fn joint_scalar(&mut self, name: &str) -> Option<Scalar> {
        match self.symbol(name)?? {
            Value::Scalar(s, _) => Some(s),
            _ => None,
        }
    }

    /// A declared rotation or pose as a frame.
    pub(crate) fn joint_pose(&mut self, snippet: &Snippet, name: &str) -> Option<Frame> {
        match self.symbol(name) {
            Some(value) => match value? {
                Value::Frame(frame, _) => Some(frame),
                Value::Rotation(r) => {
                    let zero = self.graph.constant_vector([0.0; 3]);
                    Some(self.graph.frame(r, zero))
                }
                other => {
                    let message = format!("`{name}` is {}, and a pose or rotation is wanted", other.shape());
                    self.diagnostics.push(snippet.whole(Code::WrongShape, message));
                    None
                }
            },
            None => {
                let hint = self.suggest(name, &Locals::default());
                let found = snippet.whole(Code::UnknownName, format!("there is no parameter `{name}`"));
                self.diagnostics.push(found.maybe_hint(hint));
                None
            }
        }
    }

    /// Says what the model calls a value; a constant has no name, for it may stand for many things.
    pub(super) fn label(&mut self, value: Value, label: Label) {
        if !value.is_constant(&mut self.graph) {
            self.labels.add(value.node(), label);
        }
    }

    fn key_names(&self, keys: &[usize]) -> Vec<String> {
        let name = |key: &usize| match &self.literals {
            Some(literals) => literals.members.get(*key).cloned(),
            None => self.key_name(*key),
        };
        keys.iter().filter_map(name).collect()
    }

    /// What the model calls a parameter and its components. The perturbation of a rotation, which is zero, has no name.
    fn label_parameter(&mut self, declared: &Parameter, keys: &[usize], first: usize, value: Value) {
        let name = match keys {
            [] => declared.name.clone(),
            keys => format!("{}[{}]", declared.name, self.key_names(keys).join(", ")),
        };
        for (i, suffix) in declared.shape.suffixes().iter().enumerate() {
            let leaf = self.graph.parameter((first + i) as u32);
            self.labels.add(leaf.0, Label::Name(format!("{name}{suffix}")));
        }
        if declared.shape != Shape::Scalar {
            self.labels.add(value.node(), Label::Name(name));
        }
    }

    /// The leaf by which to differentiate for a parameter's component or an input, and its dimension.
    pub(super) fn leaf(&mut self, expr: &Expr, at: &Snippet, locals: &Locals) -> Option<(Scalar, Dimension)> {
        if let ExprKind::Field(base, field) = &expr.kind
            && let Some(found) = self.component_leaf(base, field, at, locals)
        {
            return Some(found);
        }
        let message = format!("`{}` is neither a parameter nor an input", lang::print(expr));
        match self.expression(expr, at, locals)? {
            Value::Scalar(s, dimension) if self.graph.is_leaf(s) => Some((s, dimension)),
            Value::Scalar(..) => {
                let hint = "one differentiates by what varies by itself: `L1.alpha`, `target.x`, `hz`";
                self.report(Code::WrongShape, expr, at, &message, Some(hint.into()));
                None
            }
            other => {
                let message = format!("one differentiates by one number, and this is {}", other.shape());
                let hint = match other {
                    Value::Vector(..) => "name a component: `.x`, `.y`, `.z`",
                    _ => "name a component: `.x`, `.y`, `.z` of its origin, `.rx`, `.ry`, `.rz` of its turn",
                };
                self.report(Code::WrongShape, expr, at, &message, Some(hint.into()));
                None
            }
        }
    }

    /// The leaf of a component of a parameter of several numbers; none where this is something else.
    fn component_leaf(
        &mut self,
        base: &Expr,
        field: &str,
        at: &Snippet,
        locals: &Locals,
    ) -> Option<(Scalar, Dimension)> {
        let name = match &base.kind {
            ExprKind::Name(name) if !locals.names.contains_key(name) => name,
            ExprKind::Index { family, .. } => family,
            _ => return None,
        };
        let number = self.declarations.parameter(name)?;
        let declared = self.declarations.numbered(number);
        let component = declared.shape.suffixes().iter().position(|suffix| suffix.strip_prefix('.') == Some(field))?;
        let (dimension, shape) = (*declared.dimensions.get(component)?, declared.shape);
        let value = self.expression(base, at, locals)?;
        let known = self.slot_values.iter().find(|((of, _), known)| *of == number && **known == value)?;
        let slot = self.slots.iter().find(|slot| slot.parameter == number && slot.keys == known.0.1)?;
        let leaf = slot.first_leaf + shape.tangent_leaf(component);
        Some((self.graph.parameter(leaf as u32), dimension))
    }
}
