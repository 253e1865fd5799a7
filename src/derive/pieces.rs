//! A measurement's graph, simplified, taken apart into what the model names.

use std::collections::HashSet;

use crate::compile::{Measurement, Program};
use crate::graph::{Axis, Frame, Graph, Node, NodeId, Rotation, Scalar};
use crate::symbolic::{Algebra, Change, Label, Labels, Writer, rebuilt, suffix};

/// What a measurement says, in pieces.
pub(super) struct Pieces {
    pub(super) graph: Graph,
    pub(super) labels: Labels,
    /// residuals by name, vectors as a whole
    pub(super) residuals: Vec<(String, NodeId)>,
    /// leaves that are zero, and are there only to be differentiated by
    pub(super) zeros: Vec<Scalar>,
    /// nodes that depend on a parameter
    vary: HashSet<NodeId>,
}

/// Leaves that stand for the perturbation of a rotation.
fn perturbations(program: &Program, measurement: &Measurement) -> Vec<u32> {
    let of_slot = |slot: &crate::compile::Slot| {
        let first = slot.first_leaf;
        let rotation = program.parameters.get(slot.parameter).and_then(|parameter| parameter.shape.rotation());
        rotation.into_iter().flat_map(move |at| (0..3).map(move |i| (first + at + 3 + i) as u32))
    };
    measurement.slots.iter().flat_map(of_slot).collect()
}

impl Pieces {
    pub(super) fn new(program: &Program, measurement: &Measurement) -> Pieces {
        let from = &measurement.graph;
        let named: Vec<NodeId> = measurement.labels.iter().map(|(node, _)| *node).collect();
        let leaves = 0..measurement.leaves as u32;
        let leaves = leaves.filter_map(|leaf| from.known_parameter(leaf)).map(|leaf| leaf.0);
        let mut wanted: Vec<NodeId> = named.into_iter().chain(leaves).collect();
        wanted.extend(measurement.equations.iter().map(|s| s.0));
        wanted.extend((0..measurement.inputs.len() as u32).filter_map(|i| from.known_input(i)).map(|s| s.0));
        let (mut graph, to) = rebuilt(from, &wanted, &[]);
        let mut labels = measurement.labels.moved(|node| to.get(&node).copied());
        let zeros: Vec<Scalar> =
            perturbations(program, measurement).into_iter().filter_map(|leaf| graph.known_parameter(leaf)).collect();
        labels = field_labels(&mut graph, labels);
        let mut residuals: Vec<(String, NodeId)> = Vec::new();
        for (residual, node) in measurement.residuals.iter().zip(&measurement.equations) {
            let whole = residual.name.rsplit_once('.').map(|(base, _)| base).unwrap_or(&residual.name);
            let find = |name: &str| {
                labels.iter().find(|(_, label)| *label == Label::Name(name.to_owned())).map(|(node, _)| *node)
            };
            let (name, node) = match (find(&residual.name), find(whole)) {
                (Some(node), _) => (residual.name.as_str(), node),
                (None, Some(node)) => (whole, node),
                (None, None) => match to.get(&node.0) {
                    Some(&node) => (residual.name.as_str(), node),
                    None => continue,
                },
            };
            if !residuals.iter().any(|(known, _)| known == name) {
                residuals.push((name.to_owned(), node));
            }
        }
        let vary = varying(&graph);
        Pieces { graph, labels, residuals, zeros, vary }
    }

    /// Whether a node depends on a parameter.
    pub(super) fn varies(&self, id: NodeId) -> bool {
        self.vary.contains(&id)
    }

    /// Nodes with a name of their own that others are made of, those that use others first; frames of chains are not taken apart.
    pub(super) fn named(&self, roots: &[NodeId]) -> Vec<NodeId> {
        let writer = Writer::new(&self.graph, &self.labels);
        let mut done: HashSet<NodeId> = HashSet::new();
        let mut order = Vec::new();
        // after all that it uses, so that the order backwards begins with what uses others
        let mut waiting: Vec<(NodeId, bool)> = roots.iter().map(|&root| (root, false)).collect();
        while let Some((id, finished)) = waiting.pop() {
            if finished {
                order.push(id);
                continue;
            }
            if !done.insert(id) {
                continue;
            }
            waiting.push((id, true));
            self.below(&writer, id, &mut |operand| waiting.push((operand, false)));
        }
        order.reverse();
        let has_name = |id: &NodeId| !matches!(writer.labels(*id).first(), None | Some(Label::Form(..)));
        order.retain(|id| roots.contains(id) || has_name(id));
        order
    }

    /// What a node is made of, as it is written.
    fn below(&self, writer: &Writer, id: NodeId, see: &mut dyn FnMut(NodeId)) {
        let labels = writer.labels(id);
        if labels.iter().any(|label| matches!(label, Label::Chain(..))) {
            return;
        }
        match labels.first() {
            Some(Label::Field(base, _)) => see(*base),
            _ => self.graph.node(id).operands(see),
        }
    }
}

/// Names the axes, origins and rotations of frames that have a name.
fn field_labels(graph: &mut Graph, mut labels: Labels) -> Labels {
    let named: Vec<NodeId> = labels.iter().map(|(node, _)| *node).collect();
    for id in named {
        let (rotation, origin) = match kind(graph, id) {
            Kind::Frame => {
                let mut algebra = Algebra { graph };
                (algebra.rotation_of(Frame(id)), Some(algebra.origin(Frame(id))))
            }
            Kind::Rotation => (Rotation(id), None),
            Kind::Scalar | Kind::Vector => continue,
        };
        let mut parts = Vec::new();
        if let Some(origin) = origin {
            parts.push((origin.0, "o"));
            parts.push((rotation.0, "r"));
        }
        for axis in Axis::ALL {
            parts.push((Algebra { graph }.column(rotation, axis).0, suffix(axis)));
        }
        for (part, field) in parts {
            let constant = matches!(graph.node(part), Node::NoRotation | Node::Vector(..));
            if part != id && !constant {
                labels.add(part, Label::Field(id, field));
            }
        }
    }
    labels
}

/// What a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar,
    Vector,
    Rotation,
    Frame,
}

pub(super) fn kind(graph: &Graph, id: NodeId) -> Kind {
    use Node::*;
    match graph.node(id) {
        Constant(_) | Parameter(_) | Input(_) | Apply(..) | Component(..) | Dot(..) => Kind::Scalar,
        Vector(..) | AddVector(..) | SubVector(..) | Scale(..) | Cross(..) | Rotate(..) | Column(..) | Origin(_)
        | Transform(..) => Kind::Vector,
        NoRotation | Turn(..) | ExpRotation(_) | Columns(..) | ComposeRotation(..) | InverseRotation(_)
        | RotationOf(_) => Kind::Rotation,
        Frame(..) | ComposeFrame(..) | InverseFrame(_) => Kind::Frame,
    }
}

fn varying(graph: &Graph) -> HashSet<NodeId> {
    let mut found = HashSet::new();
    for id in 0..graph.len() as NodeId {
        let node = graph.node(id);
        let mut varies = matches!(node, Node::Parameter(_));
        node.operands(|operand| varies |= found.contains(&operand));
        if varies {
            found.insert(id);
        }
    }
    found
}

/// The node of a change that is one vector or number.
pub(super) fn node(change: &Change) -> Option<NodeId> {
    match change {
        Change::Scalar(s) => Some(s.0),
        Change::Vector(v) | Change::Rotation(v) => Some(v.0),
        Change::Frame(_) => None,
    }
}
