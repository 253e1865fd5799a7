//! Values and first derivatives of scalars as one graph of scalar operations.

use std::collections::HashMap;

use super::linear::Vertex;
use super::lower::Lowering;
use super::tangent::Tangents;
use super::{Frame, Graph, Node, NodeId, Rotation, Scalar};

/// A graph of scalar operations, and in it values and derivatives.
///
/// ```
/// use phical::graph::{Graph, Tape, View, differentiate};
/// let mut g = Graph::new();
/// let (q, x) = (g.parameter(0), g.input(0));
/// let y = g.mul(q, x);
/// let derived = differentiate(&g, &[y], &[q, x], &View::default());
/// let tape = Tape::lower(&derived.graph, &derived.derivatives);
/// assert_eq!(tape.evaluate(&[3.0], &[5.0]), [5.0, 3.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Derived {
    /// Scalar operations only.
    pub graph: Graph,
    /// The outputs.
    pub values: Vec<Scalar>,
    /// ∂output/∂leaf, by output and then by leaf. What no row can change is the constant zero.
    pub derivatives: Vec<Scalar>,
}

/// How a graph is seen while it is differentiated.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Parameters that each row has of its own, such as a member of a family that the row names, and the inputs that they
    /// become.
    pub gathered: Vec<(u32, u32)>,
    /// Parameters that are zero, and are there only to be differentiated by.
    pub zeros: Vec<u32>,
    /// Factors of the outputs; none where all are one.
    pub weights: Vec<f64>,
    /// Parameters that are no longer parameters, and their values.
    pub constants: Vec<(u32, f64)>,
}

/// Differentiates outputs with respect to leaves, which are parameters or inputs of the graph. Without leaves it only lowers.
pub fn differentiate(graph: &Graph, outputs: &[Scalar], leaves: &[Scalar], view: &View) -> Derived {
    let mut moved = Moved::new(graph, view, !leaves.is_empty());
    let leaves = moved.all(leaves);
    let mut outputs = moved.all(outputs);
    let flat = &mut moved.graph;
    for (output, &weight) in outputs.iter_mut().zip(&view.weights) {
        let weight = flat.constant(weight);
        *output = flat.mul(weight, *output);
    }
    if leaves.is_empty() {
        let mut lowering = Lowering::new(flat, &view.zeros);
        let values = lowering.outputs(&outputs);
        return Derived { graph: lowering.to, values, derivatives: Vec::new() };
    }
    let mut tangents = Tangents::new(flat, &leaves, &view.zeros);
    let values = tangents.lowering.outputs(&outputs);
    tangents.all(&flat.needed(&outputs));
    let vertices: Vec<Vertex> = outputs.iter().map(|&output| tangents.output(output)).collect();
    let (linear, mut graph) = tangents.finish();
    let mut derivatives = linear.jacobian(&vertices, &mut graph);
    // a leaf that is given twice has its derivatives twice
    let columns: HashMap<Scalar, usize> = leaves.iter().enumerate().map(|(k, &leaf)| (leaf, k)).collect();
    for row in derivatives.chunks_mut(leaves.len()) {
        for (k, leaf) in leaves.iter().enumerate() {
            row[k] = row[columns[leaf]];
        }
    }
    Derived { graph, values, derivatives }
}

/// A copy of a graph.
struct Moved {
    graph: Graph,
    to: Vec<NodeId>,
}

impl Moved {
    /// With `flat`, chains are composed from the base on, ((F·G)·H), so that what comes before a joint is one frame for all
    /// that follows.
    fn new(from: &Graph, view: &View, flat: bool) -> Moved {
        let mut graph = Graph::new();
        let mut to: Vec<NodeId> = Vec::with_capacity(from.len());
        let constant = |index: u32| view.constants.iter().find(|(parameter, _)| *parameter == index);
        for id in 0..from.len() as NodeId {
            let node = match from.node(id).mapped(|old| to[old as usize]) {
                Node::Parameter(index) => match view.gathered.iter().find(|(parameter, _)| *parameter == index) {
                    Some((_, input)) => Node::Input(*input),
                    None => match constant(index) {
                        Some(&(_, value)) => {
                            let value = graph.constant(value);
                            graph.node(value.0)
                        }
                        None => Node::Parameter(index),
                    },
                },
                other => other,
            };
            to.push(match node {
                Node::ComposeFrame(f, g) if flat => graph.chain_frame(f, g).0,
                Node::ComposeRotation(r, s) if flat => graph.chain_rotation(r, s).0,
                other => graph.intern(other),
            });
        }
        Moved { graph, to }
    }

    fn all(&self, scalars: &[Scalar]) -> Vec<Scalar> {
        scalars.iter().map(|s| Scalar(self.to[s.0 as usize])).collect()
    }
}

impl Graph {
    fn chain_frame(&mut self, f: Frame, g: Frame) -> Frame {
        match self.node(g.0) {
            Node::ComposeFrame(first, second) => {
                let inner = self.chain_frame(f, first);
                self.compose_frame(inner, second)
            }
            _ => self.compose_frame(f, g),
        }
    }

    fn chain_rotation(&mut self, r: Rotation, s: Rotation) -> Rotation {
        match self.node(s.0) {
            Node::ComposeRotation(first, second) => {
                let inner = self.chain_rotation(r, first);
                self.compose_rotation(inner, second)
            }
            _ => self.compose_rotation(r, s),
        }
    }
}
