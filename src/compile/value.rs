//! Values of expressions while they are compiled: a node of the graph with its shape and dimension.

use crate::graph::{Axis, Frame, Graph, NodeId, Rotation, Scalar, Vector};
use crate::unit::Dimension;

/// What an expression stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Value {
    Scalar(Scalar, Dimension),
    Vector(Vector, Dimension),
    Rotation(Rotation),
    /// with the dimension of its origin
    Frame(Frame, Dimension),
}

impl Value {
    /// The node.
    pub(crate) fn node(&self) -> NodeId {
        match *self {
            Value::Scalar(s, _) => s.0,
            Value::Vector(v, _) => v.0,
            Value::Rotation(r) => r.0,
            Value::Frame(f, _) => f.0,
        }
    }

    /// The shape in words.
    pub(crate) fn shape(&self) -> &'static str {
        match self {
            Value::Scalar(..) => "a scalar",
            Value::Vector(..) => "a vector",
            Value::Rotation(_) => "a rotation",
            Value::Frame(..) => "a frame",
        }
    }

    /// The scalars that make it up, with dimension and suffix of each: a scalar itself, or a vector's components.
    /// Rotations and frames have none.
    pub(crate) fn components(&self, graph: &mut Graph) -> Option<Vec<(&'static str, Scalar, Dimension)>> {
        match *self {
            Value::Scalar(s, dimension) => Some(vec![("", s, dimension)]),
            Value::Vector(v, dimension) => Some(
                [".x", ".y", ".z"]
                    .into_iter()
                    .zip(Axis::ALL)
                    .map(|(suffix, axis)| (suffix, graph.component(v, axis), dimension))
                    .collect(),
            ),
            Value::Rotation(_) | Value::Frame(..) => None,
        }
    }

    /// Whether it is zero by construction, and so of any dimension.
    pub(crate) fn is_zero(&self, graph: &mut Graph) -> bool {
        self.components(graph).is_some_and(|all| all.iter().all(|&(_, s, _)| graph.value(s) == Some(0.0)))
    }

    /// Whether it is made of plain constants.
    pub(crate) fn is_constant(&self, graph: &mut Graph) -> bool {
        self.components(graph).is_some_and(|all| all.iter().all(|&(_, s, _)| graph.value(s).is_some()))
    }

    /// The dimension of its scalars.
    pub(crate) fn dimension(&self) -> Option<Dimension> {
        match *self {
            Value::Scalar(_, d) | Value::Vector(_, d) | Value::Frame(_, d) => Some(d),
            Value::Rotation(_) => None,
        }
    }
}
