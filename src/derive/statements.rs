//! Statements: a name, and what it is.

use std::collections::{HashMap, HashSet};

use super::names::{self, Leaf};
use super::pieces::{Kind, Pieces, kind, node};
use crate::compile::{Measurement, Program};
use crate::diag::{Code, Diagnostic, Diagnostics, nearest};
use crate::graph::{Graph, Node, NodeId, Vector};
use crate::lang::{Expr, print};
use crate::symbolic::{Change, Label, Labels, Screw, Writer, differential, rebuilt, unit};

/// The parameter that a formula for every parameter speaks of.
const ANY: &str = "q";

/// What is wanted.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// Residuals by name, vectors as a whole; all where none is named.
    pub residuals: Vec<String>,
    /// Parameters or inputs by which to differentiate, everything written out; where none is named, once for every parameter,
    /// and the frames of chains by each free one.
    pub by: Vec<String>,
    /// Whether second derivatives by each pair of `by` are wanted.
    pub second: bool,
}

/// A name and what it is, in one or several ways.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// What is said.
    pub name: Expr,
    /// What it is, the shortest first.
    pub forms: Vec<Expr>,
}

impl Statement {
    /// `name = form = form`
    pub fn text(&self) -> String {
        let all = std::iter::once(&self.name).chain(&self.forms);
        all.map(print).collect::<Vec<_>>().join(" = ")
    }
}

/// Statements that belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// What they are.
    pub title: String,
    /// In an order in which what uses others comes first.
    pub statements: Vec<Statement>,
}

/// A measurement in formulas.
#[derive(Clone, Debug, PartialEq)]
pub struct Derivation {
    /// The measurement.
    pub measurement: String,
    /// What it says, and the derivatives.
    pub sections: Vec<Section>,
    /// Names and functions whose values are frames.
    pub frames: HashSet<String>,
}

/// Derives the residuals of a measurement, by its number.
///
/// # Errors
/// Names of residuals, parameters or inputs that it does not have.
pub fn derive(program: &Program, measurement: usize, asked: &Asked) -> Result<Derivation, Diagnostics> {
    let measurement = program.measurement(measurement).map_err(|found| Diagnostics::from(*found))?;
    let mut pieces = Pieces::new(program, measurement);
    let targets = targets(&pieces, measurement, &asked.residuals)?;
    let named = pieces.named(&targets);
    let mut sections = vec![Section { title: "Residuals".into(), statements: definitions(&pieces, &named) }];
    if asked.by.is_empty() {
        let mut any = Section { title: format!("Derivatives by any parameter {ANY}"), statements: Vec::new() };
        let parts = by_any(&mut pieces, &named, &mut any.statements);
        sections.push(any);
        let leaves = names::coordinates(program, measurement, &pieces.graph);
        for leaf in leaves.into_iter().filter(|leaf| leaf.free) {
            let mut own = by_one(&mut pieces, &parts, &leaf);
            own.retain(|statement| !statement.forms.is_empty());
            if !own.is_empty() {
                sections.push(Section { title: format!("Derivatives by {}", leaf.name), statements: own });
            }
        }
    } else {
        let leaves = names::chosen(&asked.by, program, measurement, &pieces.graph)?;
        for leaf in &leaves {
            let statements = by_one(&mut pieces, &named, leaf);
            sections.push(Section { title: format!("Derivatives by {}", leaf.name), statements });
        }
        if asked.second {
            for (i, first) in leaves.iter().enumerate() {
                for second in leaves.iter().skip(i) {
                    let title = format!("Second derivatives by {} and {}", first.name, second.name);
                    sections.push(Section { title, statements: by_two(&pieces, &named, first, second) });
                }
            }
        }
    }
    Ok(Derivation { measurement: measurement.name.clone(), sections, frames: frames(&pieces) })
}

fn targets(pieces: &Pieces, measurement: &Measurement, wanted: &[String]) -> Result<Vec<NodeId>, Diagnostics> {
    if wanted.is_empty() {
        return Ok(pieces.residuals.iter().map(|(_, node)| *node).collect());
    }
    let mut diagnostics = Diagnostics::new();
    let mut found = Vec::new();
    for name in wanted {
        let whole = name.rsplit_once('.').map_or(name.as_str(), |(base, _)| base);
        let known = |name: &str| pieces.residuals.iter().find(|(known, _)| known == name).map(|(_, node)| *node);
        match known(name).or_else(|| known(whole)) {
            Some(node) => found.push(node),
            None => {
                let message = format!("`{}` has no residual `{name}`", measurement.name);
                let hint = nearest(name, pieces.residuals.iter().map(|(known, _)| known.as_str()));
                let hint = hint.map(|near| format!("did you mean `{near}`?"));
                diagnostics.push(Diagnostic::error(Code::UnknownName, message).maybe_hint(hint));
            }
        }
    }
    if diagnostics.has_errors() { Err(diagnostics) } else { Ok(found) }
}

/// Names whose values are frames or rotations, and chains.
fn frames(pieces: &Pieces) -> HashSet<String> {
    let named = pieces.labels.iter().filter(|(id, _)| matches!(kind(&pieces.graph, *id), Kind::Frame | Kind::Rotation));
    let name = |label: &Label| match label {
        Label::Name(name) | Label::Call(name, _) | Label::Chain(name, _) => {
            let plain = name.split(['[', '.']).next().unwrap_or(name);
            Some(plain.to_owned())
        }
        _ => None,
    };
    named.filter_map(|(_, label)| name(label)).collect()
}

/// What each named piece is. Perturbations of rotations are zero here.
fn definitions(pieces: &Pieces, named: &[NodeId]) -> Vec<Statement> {
    let settled = Settled::new(&pieces.graph, &pieces.labels, pieces, named);
    let writer = settled.writer();
    let mut all = Vec::new();
    for id in named.iter().filter_map(|id| settled.to.get(id).copied()) {
        let labels = writer.labels(id);
        let is_leaf = matches!(settled.graph.node(id), Node::Parameter(_) | Node::Input(_));
        if is_leaf || matches!(labels.first(), Some(Label::Field(..))) {
            continue;
        }
        let others = labels.iter().skip(1).filter(|label| matches!(label, Label::Call(..) | Label::Chain(..)));
        let mut forms: Vec<Expr> = others.map(|label| writer.label(label)).collect();
        let chain = labels.iter().any(|label| matches!(label, Label::Chain(..)));
        // a parameter of several numbers is what it is
        let whole = matches!(settled.graph.node(id), Node::Vector(..)) && is_parameter(&settled.graph, id);
        if !chain && !whole {
            forms.push(writer.made_of(id));
        }
        let statement = Statement { name: writer.node(id), forms };
        if !statement.forms.is_empty() && !all.contains(&statement) {
            all.push(statement);
        }
    }
    all
}

fn is_parameter(graph: &Graph, id: NodeId) -> bool {
    let mut only = true;
    graph.node(id).operands(|operand| only &= matches!(graph.node(operand), Node::Parameter(_)));
    only
}

/// A graph whose perturbations are zero, and the labels of its nodes.
struct Settled {
    graph: Graph,
    labels: Labels,
    to: HashMap<NodeId, NodeId>,
}

impl Settled {
    fn new(graph: &Graph, labels: &Labels, pieces: &Pieces, wanted: &[NodeId]) -> Settled {
        let zeros: Vec<_> = pieces.zeros.iter().map(|leaf| (*leaf, 0.0)).collect();
        let mut all = wanted.to_vec();
        all.extend(labels.iter().map(|(id, _)| *id));
        let (graph, to) = rebuilt(graph, &all, &zeros);
        let labels = labels.moved(|id| to.get(&id).copied().filter(|id| !matches!(graph.node(*id), Node::Constant(_))));
        Settled { graph, labels, to }
    }

    fn writer(&self) -> Writer<'_> {
        Writer::new(&self.graph, &self.labels)
    }
}

/// Derivatives of named pieces by a parameter that is not said, in terms of those of the pieces that they are made of. Returns
/// the parts of chains whose derivatives remain to be told.
fn by_any(pieces: &mut Pieces, named: &[NodeId], statements: &mut Vec<Statement>) -> Vec<NodeId> {
    let mut graph = pieces.graph.clone();
    let mut labels = pieces.labels.clone();
    let writer = Writer::new(&pieces.graph, &pieces.labels);
    let varying: Vec<NodeId> = named.iter().copied().filter(|&id| pieces.varies(id)).collect();
    // each varying piece gets a derivative that is only a name
    let mut next = u32::MAX / 2;
    let mut symbol = |graph: &mut Graph, labels: &mut Labels, of: NodeId, vector: bool| -> NodeId {
        let mut leaf = || {
            next += 1;
            graph.parameter(next)
        };
        let made = if vector {
            let [x, y, z] = [leaf(), leaf(), leaf()];
            graph.vector(x, y, z).0
        } else {
            leaf().0
        };
        labels.add(made, Label::Derivative(of, ANY.into()));
        made
    };
    let mut seeds: HashMap<NodeId, Change> = HashMap::new();
    for &id in &varying {
        let change = match kind(&graph, id) {
            Kind::Scalar => Change::Scalar(crate::graph::Scalar(symbol(&mut graph, &mut labels, id, false))),
            Kind::Vector => Change::Vector(Vector(symbol(&mut graph, &mut labels, id, true))),
            Kind::Rotation => Change::Rotation(Vector(symbol(&mut graph, &mut labels, id, true))),
            Kind::Frame => {
                let frame = crate::graph::Frame(id);
                let mut algebra = crate::symbolic::Algebra { graph: &mut graph };
                let (r, o) = (algebra.rotation_of(frame), algebra.origin(frame));
                let turn = Vector(symbol(&mut graph, &mut labels, r.0, true));
                let slide = Vector(symbol(&mut graph, &mut labels, o.0, true));
                Change::Frame(vec![Screw { turn: Some((turn, o)), slide: Some(slide) }])
            }
        };
        seeds.insert(id, change);
    }
    let mut parts = Vec::new();
    let mut told = Vec::new();
    for &id in &varying {
        let in_chain = match writer.labels(id).first() {
            Some(Label::Field(base, _)) => writer.labels(*base).iter().any(|label| matches!(label, Label::Chain(..))),
            _ => writer.labels(id).iter().any(|label| matches!(label, Label::Chain(..))),
        };
        let leaf = matches!(graph.node(id), Node::Parameter(_)) || is_parameter(&graph, id);
        if in_chain {
            parts.push(id);
        }
        if in_chain || leaf || kind(&graph, id) == Kind::Frame {
            continue;
        }
        let own = seeds.remove(&id);
        let all: Vec<(NodeId, Change)> = seeds.iter().map(|(id, change)| (*id, change.clone())).collect();
        let found = differential(&mut graph, &[id], &all, &|_| false);
        if let Some(change) = found.get(&id).and_then(node) {
            told.push((id, change));
        }
        seeds.extend(own.map(|own| (id, own)));
    }
    let mut wanted: Vec<NodeId> = told.iter().flat_map(|(id, change)| [*id, *change]).collect();
    wanted.extend(&varying);
    let settled = Settled::new(&graph, &labels, pieces, &wanted);
    let writer = settled.writer();
    for (id, change) in told {
        let (Some(&id), Some(&change)) = (settled.to.get(&id), settled.to.get(&change)) else { continue };
        let name = writer.label(&Label::Derivative(id, ANY.into()));
        statements.push(Statement { name, forms: vec![writer.node(change)] });
    }
    parts
}

/// Derivatives of named pieces by one parameter or input, those that are not zero.
fn by_one(pieces: &mut Pieces, named: &[NodeId], by: &Leaf) -> Vec<Statement> {
    let mut graph = pieces.graph.clone();
    let mut labels = pieces.labels.clone();
    let found = changes(&mut graph, &mut labels, named, by);
    told(pieces, &graph, &labels, &found, |id| Label::Derivative(id, by.name.clone()))
}

/// The derivatives of named pieces, each named after its piece.
fn changes(graph: &mut Graph, labels: &mut Labels, named: &[NodeId], by: &Leaf) -> Vec<(NodeId, NodeId)> {
    let seed = unit(graph, by.leaf);
    let points: HashSet<NodeId> = labels.iter().map(|(id, _)| *id).collect();
    let all = differential(graph, named, &[seed], &|id| points.contains(&id));
    let mut found = Vec::new();
    for &id in named {
        let Some(change) = all.get(&id).and_then(node).filter(|_| id != by.leaf.0) else { continue };
        if !simple(graph, labels, change) {
            labels.add(change, Label::Derivative(id, by.name.clone()));
        }
        found.push((id, change));
    }
    found
}

/// Whether a node is a number, has a name, or is the opposite of what has one.
fn simple(graph: &Graph, labels: &Labels, id: NodeId) -> bool {
    let has_name = |id: NodeId| labels.iter().any(|(node, label)| *node == id && !matches!(label, Label::Form(..)));
    match graph.node(id) {
        Node::Constant(_) | Node::Parameter(_) | Node::Input(_) => true,
        Node::Vector(x, y, z) => [x, y, z].iter().all(|s| graph.value(*s).is_some()),
        Node::Scale(_, v) => has_name(id) || has_name(v.0),
        Node::Apply(crate::graph::Operation::Neg, x, _) => has_name(id) || has_name(x.0),
        _ => has_name(id),
    }
}

fn by_two(pieces: &Pieces, named: &[NodeId], first: &Leaf, second: &Leaf) -> Vec<Statement> {
    let mut graph = pieces.graph.clone();
    let mut labels = pieces.labels.clone();
    let once = changes(&mut graph, &mut labels, named, first);
    // what the second derivatives are made of has names as well
    changes(&mut graph, &mut labels, named, second);
    let seed = unit(&mut graph, second.leaf);
    let firsts: Vec<NodeId> = once.iter().map(|(_, change)| *change).collect();
    let points: HashSet<NodeId> = labels.iter().map(|(id, _)| *id).collect();
    let all = differential(&mut graph, &firsts, &[seed], &|id| points.contains(&id));
    let found: Vec<(NodeId, NodeId)> =
        once.iter().filter_map(|(id, change)| Some((*id, all.get(change).and_then(node)?))).collect();
    let title = |settled: &Writer, id: NodeId| {
        let inner = settled.label(&Label::Derivative(id, first.name.clone()));
        crate::symbolic::call("derivative", vec![inner, crate::symbolic::name(&second.name)])
    };
    stated(pieces, &graph, &labels, &found, title)
}

fn told(
    pieces: &Pieces,
    graph: &Graph,
    labels: &Labels,
    found: &[(NodeId, NodeId)],
    label: impl Fn(NodeId) -> Label,
) -> Vec<Statement> {
    stated(pieces, graph, labels, found, |writer, id| writer.label(&label(id)))
}

fn stated(
    pieces: &Pieces,
    graph: &Graph,
    labels: &Labels,
    found: &[(NodeId, NodeId)],
    name: impl Fn(&Writer, NodeId) -> Expr,
) -> Vec<Statement> {
    let wanted: Vec<NodeId> = found.iter().flat_map(|(id, change)| [*id, *change]).collect();
    let settled = Settled::new(graph, labels, pieces, &wanted);
    let writer = settled.writer();
    let zero = |id: NodeId| match settled.graph.node(id) {
        Node::Vector(x, y, z) => [x, y, z].iter().all(|s| settled.graph.value(*s) == Some(0.0)),
        _ => settled.graph.value(crate::graph::Scalar(id)) == Some(0.0),
    };
    let mut all: Vec<Statement> = Vec::new();
    for (id, change) in found {
        let (Some(&id), Some(&change)) = (settled.to.get(id), settled.to.get(change)) else { continue };
        if zero(change) {
            continue;
        }
        let name = name(&writer, id);
        // not by the derivative of another piece that happens to be the same
        let form = match writer.labels(change).first() {
            Some(Label::Derivative(..)) => writer.made_of(change),
            _ => writer.node(change),
        };
        let statement = Statement { name, forms: vec![form] };
        if !all.contains(&statement) {
            all.push(statement);
        }
    }
    all
}
