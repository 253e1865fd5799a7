//! Mathematics as a hash-consed graph of scalar, vector and rigid-motion operations.
//!
//! A [`Graph`] knows geometry, not robots or files. Its builder folds constants and shares what stands twice; frames stay
//! frames until what is wanted is lowered to scalar operations: by [`Tape::lower`] to a straight line that runs over `f64` or
//! any dual number, and by [`differentiate()`], together with its derivatives, to another graph that [`crate::eval`] compiles.
//! The closed set of scalar operations is one table, [`OPERATIONS`].
//!
//! # How derivatives are found
//!
//! A frame stays rigid, so its change is a screw: six numbers, whatever follows it (`tangent`). The graph of all changes is then
//! reduced to a Jacobian by eliminating one intermediate number after the other, in the order that takes fewest operations per
//! row: forwards, backwards, or through what is narrow (`linear`, `order`). What depends on parameters alone costs nothing
//! there, since it is computed once per iteration.
//!
//! ```
//! use phical::graph::{Axis, Graph, Tape};
//! let mut g = Graph::new();
//! let q = g.parameter(0);
//! let reach = g.constant(2.0);
//! let turn = g.turn(Axis::Z, q);
//! let x = g.column(turn, Axis::X);
//! let tip = g.scale(reach, x);
//! let y = g.component(tip, Axis::Y);
//! let tape = Tape::lower(&g, &[y]);
//! assert_eq!(tape.evaluate(&[std::f64::consts::FRAC_PI_6], &[]), [2.0 * std::f64::consts::FRAC_PI_6.sin()]);
//! ```

#![allow(
    clippy::indexing_slicing,
    reason = "a node only comes from the graph that made it, and operands have smaller numbers than what is made of them"
)]

mod build;
mod differentiate;
mod linear;
mod lower;
mod node;
mod operation;
mod order;
mod simplify;
mod special;
mod tangent;
mod tape;
#[cfg(test)]
mod tests;

pub use differentiate::{Derived, View, differentiate};
pub use node::{Axis, Frame, Rotation, Scalar, Varies, Vector};
pub use operation::{DimensionRule, Number, OPERATIONS, Operation, Row};
pub use special::{atanc, stumpff};
pub use tape::{Counts, Instruction, Tape, Undefined};

pub(crate) use node::{Node, NodeId};

use std::collections::HashMap;

/// An arena of nodes without duplicates, in the order of their making.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    varies: Vec<Varies>,
    known: HashMap<Node, NodeId>,
}

impl Graph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The parameter with this number, where the graph has it.
    pub fn known_parameter(&self, index: u32) -> Option<Scalar> {
        self.find(Node::Parameter(index)).map(Scalar)
    }

    /// The input with this number, where the graph has it.
    pub fn known_input(&self, index: u32) -> Option<Scalar> {
        self.find(Node::Input(index)).map(Scalar)
    }

    /// On what a scalar depends.
    pub fn varies(&self, s: Scalar) -> Varies {
        self.varies[s.0 as usize]
    }

    /// The value of a constant scalar, `None` for any other.
    pub fn value(&self, s: Scalar) -> Option<f64> {
        match self.nodes[s.0 as usize] {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// Whether a scalar is a parameter or an input.
    pub(crate) fn is_leaf(&self, s: Scalar) -> bool {
        matches!(self.node(s.0), Node::Parameter(_) | Node::Input(_))
    }

    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.nodes[id as usize]
    }

    pub(crate) fn node_varies(&self, id: NodeId) -> Varies {
        self.varies[id as usize]
    }

    /// Forgets all nodes but the first ones.
    pub(crate) fn truncate(&mut self, nodes: usize) {
        for node in self.nodes.drain(nodes..) {
            self.known.remove(&node);
        }
        self.varies.truncate(nodes);
    }

    /// The node's number, where it is known.
    pub(crate) fn find(&self, node: Node) -> Option<NodeId> {
        self.known.get(&node).copied()
    }

    /// Which nodes the outputs need.
    pub(crate) fn needed(&self, outputs: &[Scalar]) -> Vec<bool> {
        let mut needed = vec![false; self.len()];
        for output in outputs {
            needed[output.0 as usize] = true;
        }
        for id in (0..needed.len()).rev() {
            if needed[id] {
                self.nodes[id].operands(|operand| needed[operand as usize] = true);
            }
        }
        needed
    }

    /// The node's number, new or known.
    pub(crate) fn intern(&mut self, node: Node) -> NodeId {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let mut varies = match node {
            Node::Parameter(_) => Varies::PerIteration,
            Node::Input(_) => Varies::PerRow,
            _ => Varies::Never,
        };
        node.operands(|operand| varies = varies.max(self.varies[operand as usize]));
        let id = NodeId::try_from(self.nodes.len()).unwrap_or(NodeId::MAX);
        self.nodes.push(node);
        self.varies.push(varies);
        self.known.insert(node, id);
        id
    }
}
