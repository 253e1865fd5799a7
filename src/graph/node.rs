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
    /// The same node on other operands.
    pub(crate) fn mapped(&self, mut to: impl FnMut(NodeId) -> NodeId) -> Node {
        match *self {
            Node::Constant(_) | Node::Parameter(_) | Node::Input(_) | Node::NoRotation => *self,
            Node::Apply(operation, x, y) => Node::Apply(operation, Scalar(to(x.0)), Scalar(to(y.0))),
            Node::Component(v, axis) => Node::Component(Vector(to(v.0)), axis),
            Node::Dot(a, b) => Node::Dot(Vector(to(a.0)), Vector(to(b.0))),
            Node::Vector(x, y, z) => Node::Vector(Scalar(to(x.0)), Scalar(to(y.0)), Scalar(to(z.0))),
            Node::AddVector(a, b) => Node::AddVector(Vector(to(a.0)), Vector(to(b.0))),
            Node::SubVector(a, b) => Node::SubVector(Vector(to(a.0)), Vector(to(b.0))),
            Node::Scale(s, v) => Node::Scale(Scalar(to(s.0)), Vector(to(v.0))),
            Node::Cross(a, b) => Node::Cross(Vector(to(a.0)), Vector(to(b.0))),
            Node::Rotate(r, v) => Node::Rotate(Rotation(to(r.0)), Vector(to(v.0))),
            Node::Column(r, axis) => Node::Column(Rotation(to(r.0)), axis),
            Node::Origin(f) => Node::Origin(Frame(to(f.0))),
            Node::Transform(f, v) => Node::Transform(Frame(to(f.0)), Vector(to(v.0))),
            Node::Turn(axis, angle) => Node::Turn(axis, Scalar(to(angle.0))),
            Node::ExpRotation(v) => Node::ExpRotation(Vector(to(v.0))),
            Node::Columns(x, y, z) => Node::Columns(Vector(to(x.0)), Vector(to(y.0)), Vector(to(z.0))),
            Node::ComposeRotation(r, s) => Node::ComposeRotation(Rotation(to(r.0)), Rotation(to(s.0))),
            Node::InverseRotation(r) => Node::InverseRotation(Rotation(to(r.0))),
            Node::RotationOf(f) => Node::RotationOf(Frame(to(f.0))),
            Node::Frame(r, origin) => Node::Frame(Rotation(to(r.0)), Vector(to(origin.0))),
            Node::ComposeFrame(f, g) => Node::ComposeFrame(Frame(to(f.0)), Frame(to(g.0))),
            Node::InverseFrame(f) => Node::InverseFrame(Frame(to(f.0))),
        }
    }

    /// Calls `visit` with every operand.
    pub(crate) fn operands(&self, mut visit: impl FnMut(NodeId)) {
        let _ = self.mapped(|operand| {
            visit(operand);
            operand
        });
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
