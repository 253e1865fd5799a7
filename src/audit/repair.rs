//! Where in a formula the mistake is: the single change that makes it right.
//!
//! Mistakes of hand derivation are small: a sign, a factor two, a name for its neighbour, a sine for a cosine, a term or the inner
//! derivative of a chain forgotten. Each part of the formula is changed in each such way, functions of the model written out;
//! the change after which the formula is right at all points is the repair.

use std::ops::Range;
use std::sync::Arc;

use super::formulas::Comparison;
use super::points::Point;
use crate::compile::{Trial, try_formulas};
use crate::diag::Source;
use crate::lang::{Expr, ExprKind, Key, Op, parse, parse_signature, print};
use crate::model::Model;

/// Changes that are tried.
const MOST_CHANGES: usize = 20_000;
/// Points at which a change is looked at.
const POINTS: usize = 4;

/// A single change that makes a formula right.
#[derive(Clone, Debug, PartialEq)]
pub struct Repair {
    /// The part as it stands.
    pub instead_of: String,
    /// What should stand there.
    pub write: String,
    /// The function of the model in whose body it stands, if not in the formula itself.
    pub within: Option<String>,
    /// Its bytes in the text of the formula, or of the function's body.
    pub span: Range<usize>,
}

impl Repair {
    /// What to do, in words.
    pub fn sentence(&self) -> String {
        let place = self.within.as_ref().map(|name| format!(" in `{name}`")).unwrap_or_default();
        format!("`{}`{place} should be `{}`", self.instead_of, self.write)
    }
}

/// A text with a tree: the formula, or the body of a function it uses.
struct Part {
    name: Option<String>,
    tree: Expr,
}

/// Looks for the change after which formula `number` of a measurement is right at the points, and with it all others of its text;
/// `scales` of all formulas of the measurement are what their rounding counts from.
pub(super) fn repair(
    model: &Model,
    source: &Arc<Source>,
    (measurement, number): (usize, usize),
    scales: &[f64],
    points: &[Point],
) -> Option<Repair> {
    try_formulas(model, source, (measurement, number), |trial| {
        let whole = parse(&trial.formulas().first()?.1.text).ok()?;
        let parts = parts(model, &whole);
        let vocabulary = vocabulary(&parts);
        let mut tried = 0;
        for part in &parts {
            for path in paths(&part.tree) {
                let old = at(&part.tree, &path);
                for new in changes(old, &vocabulary) {
                    tried += 1;
                    if tried > MOST_CHANGES {
                        return None;
                    }
                    let changed = with(&part.tree, &path, new.clone());
                    let formula = match &part.name {
                        None => written_out(model, &changed, None),
                        Some(name) => written_out(model, &whole, Some((name, &changed))),
                    };
                    if right(trial, &formula, number, scales, points) {
                        return Some(Repair {
                            instead_of: print(old),
                            write: print(&new),
                            within: part.name.clone(),
                            span: old.span.clone(),
                        });
                    }
                }
            }
        }
        None
    })?
}

/// Whether an expression is right, first of the formula that is known to be wrong, then of all of its text.
fn right(trial: &mut Trial, expr: &Expr, number: usize, scales: &[f64], points: &[Point]) -> bool {
    let all = trial.formulas();
    let (first, others): (Vec<_>, Vec<_>) = all.iter().partition(|(own, _)| *own == number);
    first.into_iter().chain(others).all(|(own, formula)| {
        let right = trial.with(formula, expr, |graph, given| {
            let comparison = Comparison::new(graph, formula, given, scales[*own]);
            points.iter().take(POINTS).all(|point| comparison.at(point, 1).is_some_and(|at| !at.any_off()))
        });
        right.unwrap_or(false)
    })
}

/// The formula, and the bodies of the model's own functions that it leads to.
fn parts(model: &Model, whole: &Expr) -> Vec<Part> {
    let mut parts = vec![Part { name: None, tree: whole.clone() }];
    let mut k = 0;
    while k < parts.len() {
        let mut called = Vec::new();
        parts[k].tree.visit(|expr| {
            if let ExprKind::Call { function, .. } = &expr.kind {
                called.push(function.clone());
            }
        });
        for name in called {
            if parts.iter().all(|part| part.name.as_ref() != Some(&name))
                && let Some((_, body)) = own_function(model, &name)
            {
                parts.push(Part { name: Some(name), tree: body });
            }
        }
        k += 1;
    }
    parts
}

/// Parameters and body of a function of the model.
fn own_function(model: &Model, name: &str) -> Option<(Vec<String>, Expr)> {
    model.functions.iter().find_map(|(head, body)| {
        let signature = parse_signature(&head.value).ok()?;
        let parameters = signature.parameters.iter().map(|parameter| parameter.name.clone()).collect();
        (signature.name.name == name).then(|| Some((parameters, parse(&body.value).ok()?)))?
    })
}

/// A formula with the model's functions written out, one of them with another body.
fn written_out(model: &Model, expr: &Expr, other: Option<(&str, &Expr)>) -> Expr {
    expanded(model, expr, other, &mut Vec::new())
}

/// As [`written_out`], inside the bodies of the functions that are open. A changed body may call one of them again: that call stays.
fn expanded(model: &Model, expr: &Expr, other: Option<(&str, &Expr)>, open: &mut Vec<String>) -> Expr {
    let children: Vec<Expr> = expr.children().map(|child| expanded(model, child, other, open)).collect();
    if let ExprKind::Call { function, .. } = &expr.kind
        && !open.contains(function)
        && let Some((parameters, own)) = own_function(model, function)
    {
        let body = other.filter(|(name, _)| name == function).map_or(own, |(_, body)| body.clone());
        let filled = filled(&body, &parameters, &children);
        open.push(function.clone());
        let whole = expanded(model, &filled, other, open);
        open.pop();
        return whole;
    }
    expr.with_children(children)
}

/// A body with arguments in the place of names.
fn filled(body: &Expr, parameters: &[String], arguments: &[Expr]) -> Expr {
    if let ExprKind::Name(name) = &body.kind
        && let Some(k) = parameters.iter().position(|parameter| parameter == name)
        && let Some(argument) = arguments.get(k)
    {
        return argument.clone();
    }
    let children: Vec<Expr> = body.children().map(|child| filled(child, parameters, arguments)).collect();
    body.with_children(children)
}

/// Ways from the root to every part, those of the smallest parts last.
fn paths(expr: &Expr) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    let mut k = 0;
    while k < all.len() {
        let path = all[k].clone();
        let count = at(expr, &path).children().count();
        all.extend((0..count).map(|child| [path.as_slice(), &[child]].concat()));
        k += 1;
    }
    all
}

fn at<'e>(expr: &'e Expr, path: &[usize]) -> &'e Expr {
    path.iter().fold(expr, |expr, &child| expr.children().nth(child).unwrap_or(expr))
}

fn with(expr: &Expr, path: &[usize], new: Expr) -> Expr {
    let Some((&first, rest)) = path.split_first() else { return new };
    let children = expr.children().enumerate();
    let children = children.map(|(k, child)| if k == first { with(child, rest, new.clone()) } else { child.clone() });
    expr.with_children(children.collect())
}

/// Names, fields and numbers that the formula and its functions use.
struct Vocabulary {
    names: Vec<String>,
    fields: Vec<String>,
    functions: Vec<String>,
}

fn vocabulary(parts: &[Part]) -> Vocabulary {
    let (mut names, mut fields, mut functions) = (Vec::new(), Vec::new(), Vec::new());
    let add = |list: &mut Vec<String>, name: &str| {
        if !list.iter().any(|known| known == name) {
            list.push(name.to_owned());
        }
    };
    for part in parts {
        part.tree.visit(|expr| match &expr.kind {
            ExprKind::Name(name) => add(&mut names, name),
            ExprKind::Field(_, field) => add(&mut fields, field),
            ExprKind::Call { function, .. } => add(&mut functions, function),
            _ => {}
        });
    }
    for field in ["x", "y", "z", "o"] {
        add(&mut fields, field);
    }
    Vocabulary { names, fields, functions }
}

fn of(kind: ExprKind, like: &Expr) -> Expr {
    Expr { kind, span: like.span.clone() }
}

fn binary(op: Op, left: Expr, right: Expr) -> Expr {
    let span = left.span.clone();
    Expr { kind: ExprKind::Binary { op, left: Box::new(left), right: Box::new(right) }, span }
}

fn number(value: f64, like: &Expr) -> Expr {
    of(ExprKind::Number { value, unit: None }, like)
}

fn call(function: &str, argument: Expr) -> Expr {
    let span = argument.span.clone();
    Expr {
        kind: ExprKind::Call { function: function.into(), name_span: span.clone(), arguments: vec![argument] },
        span,
    }
}

/// Everything that may have been meant instead of a part.
fn changes(old: &Expr, words: &Vocabulary) -> Vec<Expr> {
    let mut all = Vec::new();
    // what stands alone comes first: it is the likeliest, and the easiest to read
    match &old.kind {
        ExprKind::Number { value, unit } => {
            for other in [2.0 * value, value / 2.0, value + 1.0, value - 1.0, 1.0 / value] {
                if other.is_finite() && other != *value {
                    all.push(of(ExprKind::Number { value: other, unit: unit.clone() }, old));
                }
            }
        }
        ExprKind::Name(name) => {
            let others = words.names.iter().filter(|other| *other != name);
            all.extend(others.map(|other| of(ExprKind::Name(other.clone()), old)));
        }
        ExprKind::Field(base, field) => {
            let others = words.fields.iter().filter(|other| *other != field);
            all.extend(others.map(|other| of(ExprKind::Field(base.clone(), other.clone()), old)));
        }
        ExprKind::Index { family, keys } if keys.len() > 1 => {
            let mut keys: Vec<Key> = keys.clone();
            keys.reverse();
            all.push(of(ExprKind::Index { family: family.clone(), keys }, old));
        }
        ExprKind::Call { function, name_span, arguments } => {
            let named = |function: &str, arguments: Vec<Expr>| {
                of(ExprKind::Call { function: function.into(), name_span: name_span.clone(), arguments }, old)
            };
            const PAIRS: &[(&str, &str)] = &[
                ("sin", "cos"),
                ("asin", "acos"),
                ("rotation_x", "rotation_y"),
                ("rotation_y", "rotation_z"),
                ("rotation_x", "rotation_z"),
            ];
            for (a, b) in PAIRS {
                for (a, b) in [(a, b), (b, a)] {
                    if function == a {
                        all.push(named(b, arguments.clone()));
                    }
                }
            }
            for other in words.functions.iter().filter(|other| *other != function) {
                all.push(named(other, arguments.clone()));
            }
            for i in 0..arguments.len() {
                for j in i + 1..arguments.len() {
                    let mut swapped = arguments.clone();
                    swapped.swap(i, j);
                    all.push(named(function, swapped));
                }
            }
            // the argument alone: what was applied should not have been
            all.extend(arguments.iter().cloned());
        }
        ExprKind::Negate(operand) => all.push((**operand).clone()),
        ExprKind::Binary { op, left, right } => {
            let (left, right) = ((**left).clone(), (**right).clone());
            for other in Op::ALL.into_iter().filter(|other| other != op) {
                all.push(binary(other, left.clone(), right.clone()));
            }
            if matches!(op, Op::Sub | Op::Div | Op::Mul) {
                all.push(binary(*op, right.clone(), left.clone()));
            }
            all.push(left);
            all.push(right);
        }
        _ => {}
    }
    all.push(of(ExprKind::Negate(Box::new(old.clone())), old));
    for factor in [2.0, 0.5] {
        all.push(binary(Op::Mul, number(factor, old), old.clone()));
    }
    let pi = || of(ExprKind::Name("pi".into()), old);
    let half_turn = || number(180.0, old);
    all.push(binary(Op::Div, binary(Op::Mul, old.clone(), pi()), half_turn()));
    all.push(binary(Op::Div, binary(Op::Mul, old.clone(), half_turn()), pi()));
    for function in ["sin", "cos", "inverse"] {
        all.push(call(function, old.clone()));
    }
    // a factor or a term of the formula that is missing here
    for name in &words.names {
        let name = of(ExprKind::Name(name.clone()), old);
        all.push(binary(Op::Mul, old.clone(), name.clone()));
        all.push(binary(Op::Add, old.clone(), name));
    }
    all
}
