//! Nodes of the graph, and the typed handles by which the rest of the program holds them.

use super::operation::Operation;

/// The number of a node in its [`super::Graph`]. A node's operands have smaller numbers than the node itself.
pub(crate) type NodeId = u32;

/// A scalar in a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Scalar(pub(crate) NodeId);

/// A 3-vector in a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Vector(pub(crate) NodeId);

/// A rotation in a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Rotation(pub(crate) NodeId);

/// A rigid motion, or frame, in a graph: a rotation and an origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Frame(pub(crate) NodeId);

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// the first
    X,
    /// the second
    Y,
    /// the third
    Z,
}

impl Axis {
    /// The three axes in order.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// What a node does. Two nodes that do the same to the same operands are one node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Node {
    /// A constant, by its bits.
    Constant(u64),
    /// A number that is the same for all rows.
    Parameter(u32),
    /// A number that each row has of its own.
    Input(u32),
    /// A row of the table of operations; a unary operation has its operand twice.
    Apply(Operation, Scalar, Scalar),
    Component(Vector, Axis),
    Dot(Vector, Vector),

    Vector(Scalar, Scalar, Scalar),
    AddVector(Vector, Vector),
    SubVector(Vector, Vector),
    Scale(Scalar, Vector),
    Cross(Vector, Vector),
    Rotate(Rotation, Vector),
    /// A column of a rotation's matrix: where the axis goes.
    Column(Rotation, Axis),
    Origin(Frame),
    /// The point moved by the frame.
    Transform(Frame, Vector),

    /// The identity.
    NoRotation,
    /// A turn about a coordinate axis.
    Turn(Axis, Scalar),
    /// exp of a rotation vector.
    ExpRotation(Vector),
    /// The rotation with these columns; that they are orthonormal is the maker's duty.
    Columns(Vector, Vector, Vector),
    ComposeRotation(Rotation, Rotation),
    InverseRotation(Rotation),
    RotationOf(Frame),

    /// A frame from its rotation and origin.
    Frame(Rotation, Vector),
    ComposeFrame(Frame, Frame),
    InverseFrame(Frame),
}

impl Node {
    /// Calls `visit` with every operand.
    pub(crate) fn operands(&self, mut visit: impl FnMut(NodeId)) {
        use Node::*;
        match *self {
            Constant(_) | Parameter(_) | Input(_) | NoRotation => {}
            Apply(_, a, b) => {
                visit(a.0);
                visit(b.0);
            }
            Component(v, _) | ExpRotation(v) => visit(v.0),
            Dot(a, b) | AddVector(a, b) | SubVector(a, b) | Cross(a, b) => {
                visit(a.0);
                visit(b.0);
            }
            Vector(x, y, z) => {
                visit(x.0);
                visit(y.0);
                visit(z.0);
            }
            Scale(s, v) => {
                visit(s.0);
                visit(v.0);
            }
            Rotate(r, v) => {
                visit(r.0);
                visit(v.0);
            }
            Column(r, _) | InverseRotation(r) => visit(r.0),
            Origin(f) | RotationOf(f) | InverseFrame(f) => visit(f.0),
            Transform(f, v) => {
                visit(f.0);
                visit(v.0);
            }
            Turn(_, s) => visit(s.0),
            Columns(x, y, z) => {
                visit(x.0);
                visit(y.0);
                visit(z.0);
            }
            ComposeRotation(a, b) => {
                visit(a.0);
                visit(b.0);
            }
            Frame(r, v) => {
                visit(r.0);
                visit(v.0);
            }
            ComposeFrame(a, b) => {
                visit(a.0);
                visit(b.0);
            }
        }
    }
}

/// On what a node's value depends. The order is that of the loops: constants once, parameters once per iteration,
/// rows once per row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Varies {
    /// with nothing
    Never,
    /// with parameters only
    PerIteration,
    /// with the row's inputs
    PerRow,
}
