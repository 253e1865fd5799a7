//! The names that the expressions of one measurement see, and their translation into the graph.
//!
//! An expression whose mistake has been reported has no value (`None`), and what uses it is silently without value too,
//! so that one mistake is one message.

use std::collections::HashMap;

use super::core::{self, Mismatch};
use super::declarations::{Declarations, Symbol};
use super::operator;
use super::program::Slot;
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostic, Diagnostics, Span, nearest};
use crate::graph::Graph;
use crate::lang::{Expr, ExprKind, Key};
use crate::symbolic::{Label, Labels};
use crate::unit::Dimension;

/// Graphs beyond this many nodes are refused, after a second or two; functions that call others twice double them at every
/// level.
const MOST_NODES: usize = 1_000_000;
/// Function calls and operands nested beyond this depth are refused.
const DEEPEST: usize = 600;

/// What a name of the measurement stands for.
#[derive(Clone, Debug)]
pub(crate) enum Binding {
    Value(Value),
    /// the key column with this number
    Key(usize),
    /// its mistake has been reported
    Broken,
}

/// Names of one place: the arguments of a function, or nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Locals {
    pub(super) names: HashMap<String, Value>,
    /// the body of a function sees its arguments and what the model declares, not the measurement
    pub(super) function: bool,
}

/// What the expressions of constraints may name that those of measurements may not, and the other way round.
#[derive(Clone, Debug, Default)]
pub(crate) struct Literals {
    /// keys of members in the order of their first use, by which slots choose
    pub(crate) members: Vec<String>,
    /// where each slot is first named
    pub(crate) spans: Vec<Span>,
    /// names of measurements, and what each of them is
    pub(crate) elsewhere: HashMap<String, String>,
}

/// One measurement's graph and names, or those of the constraints.
pub(crate) struct Scope<'d> {
    pub(crate) declarations: &'d Declarations,
    pub(crate) graph: Graph,
    pub(crate) slots: Vec<Slot>,
    pub(crate) leaves: usize,
    pub(crate) diagnostics: Diagnostics,
    /// with constraints, whose members are named by their keys
    pub(crate) literals: Option<Literals>,
    /// what the model calls its nodes
    pub(crate) labels: Labels,
    names: HashMap<String, Binding>,
    order: Vec<String>,
    pub(super) slot_values: HashMap<(usize, Vec<usize>), Value>,
    symbols: HashMap<String, Option<Value>>,
    pub(super) calls: HashMap<(String, Vec<Value>), Option<Value>>,
    /// functions and ties being expanded, to find circles
    pub(super) expanding: Vec<String>,
    depth: usize,
}

impl<'d> Scope<'d> {
    pub(crate) fn new(declarations: &'d Declarations) -> Self {
        Scope {
            declarations,
            graph: Graph::new(),
            slots: Vec::new(),
            leaves: 0,
            diagnostics: Diagnostics::new(),
            literals: None,
            labels: Labels::default(),
            names: HashMap::new(),
            order: Vec::new(),
            slot_values: HashMap::new(),
            symbols: HashMap::new(),
            calls: HashMap::new(),
            expanding: Vec::new(),
            depth: 0,
        }
    }

    /// Binds a name; the caller has checked that it is not taken.
    pub(crate) fn bind(&mut self, name: &str, binding: Binding) {
        if let Binding::Value(value) = &binding {
            self.label(*value, Label::Name(name.to_owned()));
        }
        if self.names.insert(name.to_owned(), binding).is_none() {
            self.order.push(name.to_owned());
        }
    }

    /// Forgets what expressions have led to since the graph had so many nodes, the slots and labels so many entries.
    pub(super) fn forget(&mut self, nodes: usize, slots: usize, labels: usize) {
        let known = |value: &Value| (value.node() as usize) < nodes;
        self.calls.retain(|(_, arguments), value| arguments.iter().all(known) && value.as_ref().is_none_or(known));
        self.symbols.retain(|_, value| value.as_ref().is_none_or(known));
        self.slot_values.retain(|_, value| known(value));
        self.leaves = self.slots.get(slots).map_or(self.leaves, |slot| slot.first_leaf);
        self.slots.truncate(slots);
        self.labels.truncate(labels);
        self.graph.truncate(nodes);
        self.diagnostics = Diagnostics::new();
    }

    /// Binds a name for a while, without calling its value so.
    pub(super) fn lend(&mut self, name: &str, binding: Binding) {
        self.names.insert(name.to_owned(), binding);
    }

    pub(super) fn take_back(&mut self, name: &str) {
        self.names.remove(name);
    }

    /// The name of a key column.
    pub(super) fn key_name(&self, number: usize) -> Option<String> {
        let known =
            self.order.iter().find(|name| matches!(self.names.get(*name), Some(Binding::Key(k)) if *k == number));
        known.cloned()
    }

    /// Whether the measurement already has this name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    /// The value of a text of the model; mistakes are reported, and then there is none.
    pub(crate) fn value(&mut self, snippet: &Snippet) -> Option<Value> {
        match snippet.parse() {
            Ok(expr) => self.expression(&expr, snippet, &Locals::default()),
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                None
            }
        }
    }

    pub(super) fn expression(&mut self, expr: &Expr, at: &Snippet, locals: &Locals) -> Option<Value> {
        if self.depth >= DEEPEST || self.graph.len() > MOST_NODES {
            let message = "the expression leads to more operations than this program handles";
            self.report(Code::TooLarge, expr, at, message, Some("name common parts in `define`".into()));
            return None;
        }
        self.depth += 1;
        let value = self.expression_inside(expr, at, locals);
        self.depth -= 1;
        value
    }

    fn expression_inside(&mut self, expr: &Expr, at: &Snippet, locals: &Locals) -> Option<Value> {
        match &expr.kind {
            ExprKind::Number { value, unit: None } => {
                Some(Value::Scalar(self.graph.constant(*value), Dimension::NUMBER))
            }
            ExprKind::Number { value, unit: Some((_, unit)) } => {
                let internal = self.declarations.units.to_internal(*value, *unit);
                Some(Value::Scalar(self.graph.constant(internal), unit.dimension))
            }
            ExprKind::Name(name) => self.name(name, expr, at, locals),
            ExprKind::Field(base, field) => self.field(base, field, expr, at, locals),
            ExprKind::Index { family, keys } => self.index(family, keys, expr, at, locals),
            ExprKind::Call { function, arguments, .. } if function == core::DERIVATIVE => {
                self.derivative(arguments, expr, at, locals)
            }
            ExprKind::Call { function, arguments, .. } => {
                let values: Vec<_> = arguments.iter().map(|argument| self.expression(argument, at, locals)).collect();
                let values = values.into_iter().collect::<Option<Vec<_>>>();
                self.call(function, values, arguments.len(), expr, at)
            }
            ExprKind::Negate(operand) => {
                let value = self.expression(operand, at, locals)?;
                let negative = operator::negate(&mut self.graph, value);
                self.checked(negative, expr, at)
            }
            ExprKind::Binary { op, left, right } => {
                let (left, right) = (self.expression(left, at, locals), self.expression(right, at, locals));
                let result = operator::binary(&mut self.graph, &self.declarations.units, *op, left?, right?);
                self.checked(result, expr, at)
            }
        }
    }

    fn name(&mut self, name: &str, expr: &Expr, at: &Snippet, locals: &Locals) -> Option<Value> {
        if let Some(&value) = locals.names.get(name) {
            return Some(value);
        }
        if !locals.function {
            match self.names.get(name) {
                Some(Binding::Value(value)) => return Some(*value),
                Some(Binding::Broken) => return None,
                Some(Binding::Key(_)) => {
                    let message = format!("`{name}` is a column of names, not of numbers");
                    let hint = format!("names choose a member of a family: `family[{name}]`");
                    self.report(Code::WrongShape, expr, at, &message, Some(hint));
                    return None;
                }
                None => {}
            }
        }
        if name == "pi" {
            return Some(Value::Scalar(self.graph.constant(std::f64::consts::PI), Dimension::ANGLE));
        }
        if let Some(known) = self.symbol(name) {
            return known;
        }
        let is_function = self.declarations.functions.contains_key(name) || core::arity(name).is_some();
        let family = |symbol: &Symbol| matches!(symbol, Symbol::Parameter(p) if self.declarations.numbered(*p).family);
        let hint = if self.declarations.symbol(name).is_some_and(family) {
            Some(format!("`{name}` is a family, and `{name}[key]` one of its members"))
        } else if is_function || self.declarations.chain(name).is_some() {
            Some(format!("`{name}` is called with its arguments: `{name}(…)`"))
        } else {
            self.suggest(name, locals)
        };
        self.report(Code::UnknownName, expr, at, &format!("there is no `{name}` here"), hint);
        None
    }

    fn field(&mut self, base: &Expr, field: &str, expr: &Expr, at: &Snippet, locals: &Locals) -> Option<Value> {
        if let ExprKind::Name(name) = &base.kind {
            let shadowed = locals.names.contains_key(name) || (!locals.function && self.names.contains_key(name));
            let dotted = format!("{name}.{field}");
            if !shadowed {
                if let Some(known) = self.symbol(&dotted) {
                    return known;
                }
                if self.declarations.symbol(name).is_none() {
                    let hint = self.suggest(&dotted, locals);
                    self.report(Code::UnknownName, expr, at, &format!("there is no `{dotted}` here"), hint);
                    return None;
                }
            }
        }
        let value = self.expression(base, at, locals)?;
        let found = operator::field(&mut self.graph, value, field);
        if found.is_none() {
            let fields = operator::fields(&value);
            let message = format!("{} has no `.{field}`", value.shape());
            let hint = (!fields.is_empty()).then(|| {
                let all: Vec<_> = fields.iter().map(|field| format!("`.{field}`")).collect();
                format!("it has {}", all.join(", "))
            });
            self.report(Code::WrongShape, expr, at, &message, hint);
        }
        found
    }

    fn index(&mut self, family: &str, keys: &[Key], expr: &Expr, at: &Snippet, locals: &Locals) -> Option<Value> {
        let Some(&Symbol::Parameter(parameter)) = self.declarations.symbol(family) else {
            let hint = self.suggest(family, locals);
            self.report(Code::UnknownName, expr, at, &format!("there is no family `{family}`"), hint);
            return None;
        };
        if !self.declarations.numbered(parameter).family {
            let message = format!("`{family}` is one parameter, not a family");
            self.report(Code::WrongShape, expr, at, &message, Some("say `family: true` where it is declared".into()));
            return None;
        }
        if let (Some(literals), false) = (&mut self.literals, locals.function) {
            let names: Vec<&str> = keys.iter().map(|key| key.name.as_str()).collect();
            let member = names.join("/");
            let known = literals.members.iter().position(|known| *known == member);
            let number = known.unwrap_or(literals.members.len());
            if known.is_none() {
                literals.members.push(member);
            }
            let slots = self.slots.len();
            let value = self.parameter(parameter, vec![number]);
            if let (Some(literals), true) = (&mut self.literals, self.slots.len() > slots) {
                literals.spans.resize(slots, Span::default());
                literals.spans.push(at.span(&expr.span));
            }
            return Some(value);
        }
        let mut found = Vec::with_capacity(keys.len());
        for key in keys {
            match self.names.get(&key.name) {
                Some(Binding::Key(column)) if !locals.function && !key.quoted => found.push(*column),
                _ if key.quoted => {
                    let message = format!("`'{}'` names one member, which only a constraint does", key.name);
                    let hint = "here a column of names chooses the member of each row: list one in `keys`, and give it by `constants` of the data or draw it by `Cycle`";
                    self.report(Code::WrongShape, expr, at, &message, Some(hint.into()));
                    return None;
                }
                _ => {
                    let message = format!("`{}` is not a column of names", key.name);
                    let hint = "columns of names are listed in the measurement's `keys`";
                    self.report(Code::UnknownName, expr, at, &message, Some(hint.into()));
                    return None;
                }
            }
        }
        Some(self.parameter(parameter, found))
    }

    /// Expands a tie or definition for its mistakes alone.
    pub(crate) fn touch(&mut self, name: &str) {
        let _ = self.symbol(name);
    }

    /// The value of a parameter, constant or tie by its full name; `None` where there is no such symbol.
    pub(super) fn symbol(&mut self, name: &str) -> Option<Option<Value>> {
        if let Some(known) = self.symbols.get(name) {
            return Some(*known);
        }
        let symbol = self.declarations.symbol(name)?;
        let value = match symbol {
            Symbol::Parameter(parameter) => {
                let declared = self.declarations.numbered(*parameter);
                if declared.family {
                    // a family without its key: a mistake of every expression that names it so
                    return None;
                }
                Some(self.parameter(*parameter, Vec::new()))
            }
            Symbol::Constant(value, dimension) => Some(Value::Scalar(self.graph.constant(*value), *dimension)),
            Symbol::Broken => None,
            Symbol::Tie(snippet, wanted) | Symbol::Definition(snippet, wanted) => {
                if self.expanding.iter().any(|outer| outer == name) {
                    let message = format!("`{name}` depends on itself");
                    let hint = "give one of those it leads to a value of its own";
                    self.diagnostics.push(snippet.whole(Code::Circular, message).hint(hint));
                    None
                } else {
                    self.expanding.push(name.to_owned());
                    let value = self.tie(snippet, *wanted);
                    self.expanding.pop();
                    value
                }
            }
        };
        if let (Some(value), Symbol::Tie(..) | Symbol::Definition(..)) = (value, symbol) {
            self.label(value, Label::Name(name.to_owned()));
        }
        self.symbols.insert(name.to_owned(), value);
        Some(value)
    }

    /// An expression of parameters, and the dimension it should have if one is wanted.
    fn tie(&mut self, snippet: &Snippet, wanted: Option<Dimension>) -> Option<Value> {
        let expr = match snippet.parse() {
            Ok(expr) => expr,
            Err(diagnostic) => {
                self.diagnostics.push(*diagnostic);
                return None;
            }
        };
        let locals = Locals { names: HashMap::new(), function: true };
        let value = self.expression(&expr, snippet, &locals)?;
        let Some(wanted) = wanted else { return Some(value) };
        match value {
            Value::Scalar(s, d) if d.compatible(wanted) || self.graph.value(s) == Some(0.0) => {
                Some(Value::Scalar(s, wanted))
            }
            Value::Scalar(_, d) => {
                self.diagnostics.push(
                    snippet
                        .whole(Code::WrongDimension, format!("{} is wanted, and this is {}", wanted.noun(), d.noun())),
                );
                None
            }
            other => {
                self.diagnostics.push(
                    snippet.whole(Code::WrongShape, format!("a scalar is wanted, and this is {}", other.shape())),
                );
                None
            }
        }
    }

    pub(super) fn checked(&mut self, result: Result<Value, Mismatch>, expr: &Expr, at: &Snippet) -> Option<Value> {
        match result {
            Ok(value) => Some(value),
            Err(mismatch) => {
                self.report(mismatch.kind.code(), expr, at, &mismatch.message, mismatch.hint);
                None
            }
        }
    }

    pub(super) fn report(&mut self, code: Code, expr: &Expr, at: &Snippet, message: &str, hint: Option<String>) {
        let diagnostic = Diagnostic::error(code, message).at(&at.source, at.span(&expr.span)).maybe_hint(hint);
        self.diagnostics.push(diagnostic);
    }

    pub(super) fn suggest(&self, name: &str, locals: &Locals) -> Option<String> {
        let first = name.split('.').next().unwrap_or(name);
        if let Some(what) = self.literals.as_ref().and_then(|literals| literals.elsewhere.get(first)) {
            return Some(format!("`{first}` is {what}, and a constraint speaks of parameters alone"));
        }
        let mut candidates: Vec<&str> = locals.names.keys().map(String::as_str).collect();
        candidates.sort_unstable();
        if !locals.function {
            candidates.extend(self.order.iter().map(String::as_str));
        }
        candidates.extend(self.declarations.symbol_names());
        nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
    }

    /// The scalars of a vector node, for the last step of a measurement.
    pub(crate) fn components(&mut self, value: Value) -> Option<Vec<(&'static str, crate::graph::Scalar, Dimension)>> {
        value.components(&mut self.graph)
    }
}
