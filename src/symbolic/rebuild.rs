//! Copies of graphs, simplified on the way.

use std::collections::{BTreeSet, HashMap};

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
    // operands have smaller numbers: from the last down, each is needed before it is gone to
    let mut needed: BTreeSet<NodeId> = wanted.iter().copied().collect();
    let mut order = Vec::new();
    while let Some(id) = needed.pop_last() {
        order.push(id);
        from.node(id).operands(|operand| {
            needed.insert(operand);
        });
    }
    for id in order.into_iter().rev() {
        if !to.contains_key(&id) {
            // operands came before, and are there
            let node: Node = from.node(id).mapped(|operand| to.get(&operand).copied().unwrap_or(operand));
            let made = Algebra { graph: &mut graph }.remake(node);
            to.insert(id, made);
        }
    }
    (graph, to)
}
