//! Copies of graphs, simplified on the way.

use std::collections::HashMap;

use super::algebra::Algebra;
use crate::graph::{Graph, Node, NodeId, Scalar};

/// A copy of what some nodes need, made anew by the rules of [`Algebra`] with numbers in the place of some leaves, and where
/// its nodes are there.
pub(crate) fn rebuilt(from: &Graph, wanted: &[NodeId], leaves: &[(Scalar, f64)]) -> (Graph, HashMap<NodeId, NodeId>) {
    let mut to: HashMap<NodeId, NodeId> = HashMap::new();
    let mut graph = Graph::new();
    for (leaf, value) in leaves {
        to.insert(leaf.0, graph.constant(*value).0);
    }
    let mut needed = vec![false; from.len()];
    wanted.iter().for_each(|&id| needed[id as usize] = true);
    for id in (0..needed.len()).rev() {
        if needed[id] {
            from.node(id as NodeId).operands(|operand| needed[operand as usize] = true);
        }
    }
    for id in (0..needed.len()).filter(|&id| needed[id]).map(|id| id as NodeId) {
        if !to.contains_key(&id) {
            // operands have smaller numbers, and are there
            let node: Node = from.node(id).mapped(|operand| to[&operand]);
            let made = Algebra { graph: &mut graph }.remake(node);
            to.insert(id, made);
        }
    }
    (graph, to)
}
