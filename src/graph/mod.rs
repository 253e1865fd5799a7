//! Mathematics as a hash-consed graph of scalar, vector and rigid-motion operations.
//!
//! A [`Graph`] knows geometry, not robots or files. Its builder folds constants and shares what stands twice; frames stay
//! frames until [`Tape::lower`] turns what is wanted into a straight line of scalar operations, which [`crate::eval`]
//! runs over `f64` or any dual number. The closed set of scalar operations is one table, [`OPERATIONS`].
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

mod build;
mod lower;
mod node;
mod operation;
mod simplify;
mod special;
mod tape;
#[cfg(test)]
mod tests;

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

    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.nodes[id as usize]
    }

    pub(crate) fn node_varies(&self, id: NodeId) -> Varies {
        self.varies[id as usize]
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
