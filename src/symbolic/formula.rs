//! Nodes as expressions of the model language, in the words of the model.

use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::PI;

use super::differential::suffix;
use super::label::{Label, Labels};
use crate::graph::{Axis, Graph, Node, NodeId, Operation, Scalar, Vector};
use crate::lang::{Expr, ExprKind, Op};

/// Writes the nodes of a graph as expressions.
pub(crate) struct Writer<'g> {
    graph: &'g Graph,
    labels: HashMap<NodeId, Vec<Label>>,
    /// nodes whose label is being written
    begun: RefCell<Vec<NodeId>>,
}

/// An expression that stands nowhere.
fn made(kind: ExprKind) -> Expr {
    Expr { kind, span: 0..0 }
}

pub(crate) fn name(name: &str) -> Expr {
    // `L1.alpha` is read as a field of L1, and `socket[hole].x` as one of a member
    if let Some((base, field)) = name.rsplit_once('.')
        && !field.ends_with(']')
    {
        return field_of(self::name(base), field);
    }
    if let Some((family, keys)) = name.strip_suffix(']').and_then(|rest| rest.split_once('[')) {
        let key = |name: &str| crate::lang::Key { name: name.trim().to_owned(), quoted: false, span: 0..0 };
        return made(ExprKind::Index { family: family.to_owned(), keys: keys.split(',').map(key).collect() });
    }
    made(ExprKind::Name(name.to_owned()))
}

fn field_of(base: Expr, field: &str) -> Expr {
    made(ExprKind::Field(Box::new(base), field.to_owned()))
}

pub(crate) fn call(function: &str, arguments: Vec<Expr>) -> Expr {
    made(ExprKind::Call { function: function.to_owned(), name_span: 0..0, arguments })
}

fn negate(operand: Expr) -> Expr {
    match operand.kind {
        ExprKind::Negate(inner) => *inner,
        // −(a ± b) = −a ∓ b
        ExprKind::Binary { op: Op::Add, left, right } => binary(Op::Sub, negate(*left), *right),
        ExprKind::Binary { op: Op::Sub, left, right } => binary(Op::Add, negate(*left), *right),
        // −(a × b) = b × a
        ExprKind::Call { function, name_span, mut arguments } if function == "cross" && arguments.len() == 2 => {
            arguments.swap(0, 1);
            made(ExprKind::Call { function, name_span, arguments })
        }
        kind => made(ExprKind::Negate(Box::new(Expr { kind, span: 0..0 }))),
    }
}

fn binary(op: Op, left: Expr, right: Expr) -> Expr {
    match (op, right.kind) {
        // a + (−b) = a − b
        (Op::Add, ExprKind::Negate(inner)) => binary(Op::Sub, left, *inner),
        (Op::Sub, ExprKind::Negate(inner)) => binary(Op::Add, left, *inner),
        // a + (b ± c) = a + b ± c, a − (b ± c) = a − b ∓ c
        (Op::Add, ExprKind::Binary { op: inner @ (Op::Add | Op::Sub), left: b, right: c }) => {
            binary(inner, binary(Op::Add, left, *b), *c)
        }
        (Op::Sub, ExprKind::Binary { op: inner @ (Op::Add | Op::Sub), left: b, right: c }) => {
            let other = if inner == Op::Add { Op::Sub } else { Op::Add };
            binary(other, binary(Op::Sub, left, *b), *c)
        }
        // (−a) b = −(a b), where it can be seen
        (Op::Mul, ExprKind::Negate(inner)) => negate(binary(Op::Mul, left, *inner)),
        (op, kind) => {
            let right = Expr { kind, span: 0..0 };
            match (op, left.kind) {
                (Op::Mul | Op::Div, ExprKind::Negate(inner)) => negate(binary(op, *inner, right)),
                // −a + b = b − a
                (Op::Add, ExprKind::Negate(inner)) => binary(Op::Sub, right, *inner),
                (op, kind) => {
                    let left = Box::new(Expr { kind, span: 0..0 });
                    made(ExprKind::Binary { op, left, right: Box::new(right) })
                }
            }
        }
    }
}

/// A number, as a share of π where it is one.
fn number(value: f64) -> Expr {
    let plain = |value: f64| made(ExprKind::Number { value, unit: None });
    if value < 0.0 {
        return negate(number(-value));
    }
    for divisor in [1.0, 2.0, 3.0, 4.0, 6.0] {
        let times = (value * divisor / PI).round();
        if (1.0..=12.0).contains(&times) && times * PI / divisor == value {
            let pi = name("pi");
            let top = if times == 1.0 { pi } else { binary(Op::Mul, plain(times), pi) };
            return if divisor == 1.0 { top } else { binary(Op::Div, top, plain(divisor)) };
        }
    }
    plain(value)
}

impl<'g> Writer<'g> {
    pub(crate) fn new(graph: &'g Graph, labels: &Labels) -> Writer<'g> {
        let mut all: HashMap<NodeId, Vec<Label>> = HashMap::new();
        for (node, label) in labels.iter() {
            let known = all.entry(*node).or_default();
            if !known.contains(label) {
                known.push(label.clone());
            }
        }
        all.values_mut().for_each(|labels| labels.sort_by_key(Label::rank));
        Writer { graph, labels: all, begun: RefCell::default() }
    }

    /// The labels of a node.
    pub(crate) fn labels(&self, id: NodeId) -> &[Label] {
        self.labels.get(&id).map_or(&[], Vec::as_slice)
    }

    /// The node by its first label, or else by what it is made of: so within its own label, where what is named is a part of what
    /// names it, as the origin of a frame that is written `frame(o, r)`.
    pub(crate) fn node(&self, id: NodeId) -> Expr {
        match self.labels(id).first() {
            Some(label) if !self.begun.borrow().contains(&id) => {
                self.begun.borrow_mut().push(id);
                let written = self.label(label);
                self.begun.borrow_mut().pop();
                written
            }
            _ => self.definition(id),
        }
    }

    /// What a named node is made of, as the model writes it where that is known.
    pub(crate) fn made_of(&self, id: NodeId) -> Expr {
        match self.labels(id).iter().find(|label| matches!(label, Label::Form(..))) {
            Some(form) if !self.begun.borrow().contains(&id) => {
                self.begun.borrow_mut().push(id);
                let written = self.label(form);
                self.begun.borrow_mut().pop();
                written
            }
            _ => self.definition(id),
        }
    }

    /// What a label says.
    pub(crate) fn label(&self, label: &Label) -> Expr {
        match label {
            Label::Name(known) => name(known),
            Label::Call(function, arguments) | Label::Chain(function, arguments) | Label::Form(function, arguments) => {
                call(function, arguments.iter().map(|argument| self.node(*argument)).collect())
            }
            Label::Field(base, field) => field_of(self.node(*base), field),
            Label::Derivative(of, by) => call("derivative", vec![self.node(*of), name(by)]),
        }
    }

    fn scalar(&self, s: Scalar) -> Expr {
        self.node(s.0)
    }

    fn vector(&self, v: Vector) -> Expr {
        self.node(v.0)
    }

    /// What a node is made of.
    pub(crate) fn definition(&self, id: NodeId) -> Expr {
        use Node::*;
        let of_axis = |base: Expr, axis: Axis| field_of(base, suffix(axis));
        match self.graph.node(id) {
            Constant(bits) => number(f64::from_bits(bits)),
            // neither stands without a label, but for those that no model has
            Parameter(index) => name(&format!("q{index}")),
            Input(index) => name(&format!("x{index}")),
            Apply(operation, x, y) => self.apply(operation, x, y),
            Component(v, axis) => of_axis(self.vector(v), axis),
            Dot(a, b) => call("dot", vec![self.vector(a), self.vector(b)]),
            Vector(x, y, z) => call("vec", vec![self.scalar(x), self.scalar(y), self.scalar(z)]),
            AddVector(a, b) => binary(Op::Add, self.vector(a), self.vector(b)),
            SubVector(a, b) => binary(Op::Sub, self.vector(a), self.vector(b)),
            Scale(s, v) => match (self.graph.value(s), self.graph.node(s.0)) {
                (Some(-1.0), _) => negate(self.vector(v)),
                // (1/s) v = v/s
                (_, Apply(Operation::Div, one, divisor))
                    if self.labels(s.0).is_empty() && self.graph.value(one) == Some(1.0) =>
                {
                    binary(Op::Div, self.vector(v), self.scalar(divisor))
                }
                _ => binary(Op::Mul, self.scalar(s), self.vector(v)),
            },
            Cross(a, b) => call("cross", vec![self.vector(a), self.vector(b)]),
            Rotate(r, v) => binary(Op::Mul, self.node(r.0), self.vector(v)),
            Column(r, axis) => of_axis(self.frame_of(r.0), axis),
            Origin(f) => field_of(self.node(f.0), "o"),
            Transform(f, p) => binary(Op::Mul, self.node(f.0), self.vector(p)),
            NoRotation => call("rotation_x", vec![number(0.0)]),
            Turn(axis, angle) => call(&format!("rotation_{}", suffix(axis)), vec![self.scalar(angle)]),
            ExpRotation(v) => call("rotation_vector", vec![self.vector(v)]),
            Columns(x, y, z) => self.columns([x, y, z]),
            ComposeRotation(r, s) => binary(Op::Mul, self.node(r.0), self.node(s.0)),
            InverseRotation(r) => call("inverse", vec![self.node(r.0)]),
            RotationOf(f) => field_of(self.node(f.0), "r"),
            Frame(r, origin) => call("frame", vec![self.vector(origin), self.node(r.0)]),
            ComposeFrame(f, g) => binary(Op::Mul, self.node(f.0), self.node(g.0)),
            InverseFrame(f) => call("inverse", vec![self.node(f.0)]),
        }
    }

    /// The frame whose rotation this is, or the rotation itself.
    fn frame_of(&self, rotation: NodeId) -> Expr {
        match (self.labels(rotation).first(), self.graph.node(rotation)) {
            (Some(Label::Field(frame, "r")), _) => self.node(*frame),
            (None, Node::RotationOf(frame)) => self.node(frame.0),
            _ => self.node(rotation),
        }
    }

    /// A rotation by its columns: the language has it by its quaternion, of which one component is ½√(1 + tr R).
    fn columns(&self, columns: [Vector; 3]) -> Expr {
        let numbers = |v: Vector| match self.graph.node(v.0) {
            Node::Vector(x, y, z) => {
                Some(nalgebra::Vector3::new(self.graph.value(x)?, self.graph.value(y)?, self.graph.value(z)?))
            }
            _ => None,
        };
        let [Some(x), Some(y), Some(z)] = columns.map(numbers) else {
            return call("columns", columns.iter().map(|v| self.vector(*v)).collect());
        };
        let m = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x, y, z]));
        let q = nalgebra::UnitQuaternion::from_rotation_matrix(&m);
        call("quaternion", vec![number(q.w), number(q.i), number(q.j), number(q.k)])
    }

    fn apply(&self, operation: Operation, x: Scalar, y: Scalar) -> Expr {
        use Operation::*;
        let (a, b) = (self.scalar(x), self.scalar(y));
        let whole = |s: Scalar| self.graph.value(s).unwrap_or(f64::NAN);
        match operation {
            Add => binary(Op::Add, a, b),
            Sub => binary(Op::Sub, a, b),
            Mul if x == y => binary(Op::Pow, a, number(2.0)),
            // numbers stand first
            Mul if self.graph.value(y).is_some() => binary(Op::Mul, b, a),
            Mul => binary(Op::Mul, a, b),
            Div => binary(Op::Div, a, b),
            Neg => negate(a),
            PowInteger | Pow => binary(Op::Pow, a, b),
            Hypot => {
                let square = |s: Expr| binary(Op::Pow, s, number(2.0));
                call("sqrt", vec![binary(Op::Add, square(a), square(b))])
            }
            Stumpff | Atanc => call(operation.row().name, vec![number(whole(y)), a]),
            _ if operation.row().arity == 1 => call(operation.row().name, vec![a]),
            _ => call(operation.row().name, vec![a, b]),
        }
    }
}
