//! What is common to all languages: statements as text, by what a language says of each kind.

use std::collections::HashMap;

use super::line::{Atom, Expression, Line, Operand, Statement, Term};
use super::names::{Case, Names, plain};
use super::routine::Routine;
use crate::graph::{Node, NodeId, Operation};

/// How a language writes what a straight line is made of.
pub(super) trait Syntax {
    /// How names are written.
    fn case(&self) -> Case;
    /// A number that depends on parameters alone, where rows read it.
    fn field(&self, name: &str) -> String;
    /// A constant that is not negative, exactly.
    fn constant(&self, value: f64) -> String {
        format!("{value:?}")
    }
    /// A sum, by its parts: numbers before products.
    fn sum(&self, terms: &[Part]) -> String;
    /// An operation that is not a part of sums.
    fn call(&self, operation: Operation, x: &Shown, y: &Shown) -> String;
    /// A new name for a value.
    fn define(&self, name: &str, value: &str) -> String;
    /// Sine and cosine of one angle, as new names.
    fn sin_cos(&self, sin: Option<&str>, cos: Option<&str>, of: &Shown) -> Vec<String>;
    /// Sine and cosine of one angle, to places that are there.
    fn put_sin_cos(&self, sin: &str, cos: &str, of: &str) -> String;
}

/// An operand as text.
#[derive(Clone, Debug)]
pub(super) struct Shown {
    pub(super) text: String,
    pub(super) negative: bool,
    /// where it is a constant, without its sign
    pub(super) constant: Option<f64>,
}

impl Shown {
    /// With its sign.
    pub(super) fn signed(&self) -> String {
        format!("{}{}", if self.negative { "-" } else { "" }, self.text)
    }

    /// As something that a sign or a method can be put to.
    pub(super) fn closed(&self) -> String {
        if self.negative { format!("(-{})", self.text) } else { self.text.clone() }
    }
}

/// A part of a sum as text; a product's sign is that of its first factor.
pub(super) type Part = (Shown, Option<Shown>);

/// A sum with signs between its parts, as most languages write it.
pub(super) fn infix(terms: &[Part]) -> String {
    let mut out = String::new();
    for (i, (a, b)) in terms.iter().enumerate() {
        out += match (i, a.negative) {
            (0, true) => "-",
            (0, false) => "",
            (_, true) => " - ",
            (_, false) => " + ",
        };
        out += &a.text;
        if let Some(b) = b {
            out += " * ";
            out += &b.text;
        }
    }
    out
}

/// Names of what rows read: nodes that depend on parameters alone.
pub(super) struct Fields {
    names: HashMap<NodeId, String>,
}

impl Fields {
    pub(super) fn new(routine: &Routine, case: Case) -> Fields {
        let mut all = Names::default();
        let arguments = arguments(routine, case);
        let mut names: HashMap<NodeId, String> = HashMap::new();
        for (at, &id) in routine.prepared.iter().enumerate() {
            let name = match routine.graph.node(id) {
                Node::Parameter(index) => arguments.q[index as usize].clone(),
                Node::Apply(operation @ (Operation::Sin | Operation::Cos), x, _) => match routine.graph.node(x.0) {
                    Node::Parameter(index) => format!("{}_{}", operation.row().name, arguments.q[index as usize]),
                    _ => format!("p{}", at + 1),
                },
                _ => format!("p{}", at + 1),
            };
            names.insert(id, all.unique(name));
        }
        Fields { names }
    }

    /// In the order in which they are prepared.
    pub(super) fn all<'a>(&'a self, routine: &'a Routine) -> impl Iterator<Item = &'a str> {
        routine.prepared.iter().map(|id| self.names[id].as_str())
    }
}

/// Names of the numbers that arguments hold.
pub(super) struct Arguments {
    q: Vec<String>,
    x: Vec<String>,
    m: Vec<String>,
}

fn arguments(routine: &Routine, case: Case) -> Arguments {
    let mut all = Names::default();
    let mut named = |prefix: &str, numbers: &[super::routine::Number]| -> Vec<String> {
        numbers.iter().map(|number| all.unique(format!("{prefix}_{}", plain(&number.name, case)))).collect()
    };
    Arguments { q: named("q", &routine.parameters), x: named("x", &routine.inputs), m: named("m", &routine.members) }
}

/// In which function a line stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// what is done once
    Prepare,
    /// one row
    Row,
    /// row k of several
    Rows,
}

/// A line as text.
#[derive(Clone, Debug, Default)]
pub(super) struct Body {
    /// the statements
    pub(super) lines: Vec<String>,
    /// of several rows, what is done for row k in a loop before, so that the other one calls nothing
    pub(super) turns: Vec<String>,
    /// what is finite where the line is defined: the arguments, and results of operations that may have none
    pub(super) checked: Vec<String>,
}

impl Body {
    /// Zero where all is defined, else not a number; `before` is the same of what was done before.
    pub(super) fn zero(&self, before: Option<&str>) -> String {
        let all =
            before.map(str::to_owned).into_iter().chain(self.checked.iter().map(|value| format!("0.0 * {value}")));
        let all: Vec<String> = all.collect();
        if all.is_empty() { "0.0".to_owned() } else { all.join(" + ") }
    }
}

/// The statements of a line. `store` writes an output.
pub(super) fn body(
    syntax: &dyn Syntax,
    routine: &Routine,
    line: &Line,
    fields: &Fields,
    place: Place,
    output: &dyn Fn(usize) -> String,
    store: &dyn Fn(usize, &str) -> String,
) -> Body {
    let k = if place == Place::Rows { "[k]" } else { "" };
    let case = syntax.case();
    let arguments = arguments(routine, case);
    let (mut lines, mut turns, mut checked) = (Vec::new(), Vec::new(), Vec::new());
    let mut known: HashMap<NodeId, String> = HashMap::new();
    let mut entries: HashMap<NodeId, String> = HashMap::new();
    let mut given = Vec::new();
    line.reads(|id| given.push(id));
    given.sort_unstable();
    given.dedup();
    // arguments in their own order
    given.sort_by_key(|&id| match routine.graph.node(id) {
        Node::Parameter(index) | Node::Input(index) => index,
        _ => u32::MAX,
    });
    for id in given {
        if place != Place::Prepare
            && let Some(name) = fields.names.get(&id)
        {
            known.insert(id, syntax.field(name));
            continue;
        }
        let (array, at, name) = match routine.graph.node(id) {
            Node::Parameter(index) => ("q", index as usize, &arguments.q[index as usize]),
            Node::Input(index) => match (index as usize).checked_sub(routine.inputs.len()) {
                None => ("x", index as usize, &arguments.x[index as usize]),
                Some(member) => ("m", member, &arguments.m[member]),
            },
            // all else that is given is prepared
            _ => continue,
        };
        let entry = format!("{array}[{at}]{k}");
        lines.push(syntax.define(name, &entry));
        checked.push(entry.clone());
        known.insert(id, name.clone());
        entries.insert(id, entry);
    }
    let mut taken = Names::default();
    let mut counted = 0;
    for statement in &line.statements {
        let shown = |operand: &Operand| match operand.atom {
            Atom::Constant(value) => {
                Shown { text: syntax.constant(value), negative: operand.negative, constant: Some(value) }
            }
            Atom::Given(id) | Atom::Result(id) => {
                Shown { text: known[&id].clone(), negative: operand.negative, constant: None }
            }
        };
        let value = |expression: &Expression| match expression {
            Expression::Call(operation, x, y) => syntax.call(*operation, &shown(x), &shown(y)),
            Expression::Sum(terms) => {
                let numbers = terms.iter().filter_map(|term| match term {
                    Term::Number(number) => Some((shown(number), None)),
                    Term::Product(..) => None,
                });
                let products = terms.iter().filter_map(|term| match term {
                    Term::Product(a, b) => Some((shown(a), Some(shown(b)))),
                    Term::Number(_) => None,
                });
                syntax.sum(&numbers.chain(products).collect::<Vec<Part>>())
            }
        };
        match statement {
            Statement::Let(id, expression) => {
                counted += 1;
                let name = format!("t{counted}");
                lines.push(syntax.define(&name, &value(expression)));
                checked.extend(matches!(expression, Expression::Call(..)).then(|| name.clone()));
                known.insert(*id, name);
            }
            Statement::SinCos { sin, cos, of: angle } => {
                let of = shown(angle);
                let base = of.text.rsplit(['.', '>']).next().unwrap_or("").to_owned();
                let name = |function: &str, taken: &mut Names| taken.unique(format!("{function}_{base}"));
                let sin = sin.map(|id| (id, name("sin", &mut taken)));
                let cos = cos.map(|id| (id, name("cos", &mut taken)));
                let text = |found: &Option<(NodeId, String)>| found.as_ref().map(|(_, name)| name.clone());
                let entry = match angle {
                    Operand { atom: Atom::Given(id), negative: false } if place == Place::Rows => entries.get(id),
                    _ => None,
                };
                match entry {
                    None => lines.extend(syntax.sin_cos(text(&sin).as_deref(), text(&cos).as_deref(), &of)),
                    Some(entry) => {
                        let [first, second] = [0, 1].map(|more| format!("turns[{}][k]", 2 * turns.len() + more));
                        turns.push(syntax.put_sin_cos(&first, &second, entry));
                        for (found, place) in [(&sin, &first), (&cos, &second)] {
                            lines.extend(found.as_ref().map(|(_, name)| syntax.define(name, place)));
                        }
                    }
                }
                known.extend([sin, cos].into_iter().flatten());
            }
            Statement::Store(at, expression) => {
                lines.push(store(*at, &value(expression)));
                checked.extend(matches!(expression, Expression::Call(..)).then(|| output(*at)));
            }
        }
    }
    if place == Place::Rows {
        drop_unread(&mut lines);
    }
    Body { lines, turns, checked }
}

/// Leaves out arguments of which only the sine and the cosine are read, which are there already.
fn drop_unread(lines: &mut Vec<String>) {
    let word = |c: char| !(c.is_alphanumeric() || c == '_');
    let read: std::collections::HashSet<String> = lines
        .iter()
        .filter_map(|line| line.split_once(" = "))
        .flat_map(|(_, value)| value.split(word).map(str::to_owned).collect::<Vec<_>>())
        .collect();
    lines.retain(|line| match line.split_once(" = ") {
        Some((name, _)) if !name.contains('[') => name.split(word).next_back().is_some_and(|name| read.contains(name)),
        _ => true,
    });
}

/// Lines with four spaces for each depth.
pub(super) fn indent(out: &mut String, depth: usize, lines: impl IntoIterator<Item = impl AsRef<str>>) {
    for line in lines {
        if !line.as_ref().is_empty() {
            out.push_str(&"    ".repeat(depth));
            out.push_str(line.as_ref());
        }
        out.push('\n');
    }
}
