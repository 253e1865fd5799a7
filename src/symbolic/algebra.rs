//! Nodes of a graph, simplified as they are made.
//!
//! The rules of scalars are those of the graph itself; here are those of vectors, rotations and frames. Each is an identity of
//! Euclidean geometry, stated beside it, and holds for all values of what it names; a property test applies all of them to
//! random expressions. They serve readers: the engine lowers geometry to scalars, where zeros and ones vanish anyway.

use crate::graph::{Axis, Frame, Graph, Node, NodeId, Operation, Rotation, Scalar, Vector};

/// Makes nodes of a graph.
#[derive(Debug)]
pub(crate) struct Algebra<'g> {
    pub(crate) graph: &'g mut Graph,
}

impl Algebra<'_> {
    pub(crate) fn node(&self, id: NodeId) -> Node {
        self.graph.node(id)
    }

    fn value(&self, s: Scalar) -> Option<f64> {
        self.graph.value(s)
    }

    /// The numbers of a constant vector.
    fn constants(&self, v: Vector) -> Option<[f64; 3]> {
        let Node::Vector(x, y, z) = self.node(v.0) else { return None };
        Some([self.value(x)?, self.value(y)?, self.value(z)?])
    }

    pub(crate) fn is_zero(&self, v: Vector) -> bool {
        self.constants(v) == Some([0.0; 3])
    }

    /// The axis, and whether backwards, where a vector is a coordinate axis.
    fn basis(&self, v: Vector) -> Option<(Axis, bool)> {
        let (axis, own) = match self.constants(v)? {
            [own, 0.0, 0.0] => (Axis::X, own),
            [0.0, own, 0.0] => (Axis::Y, own),
            [0.0, 0.0, own] => (Axis::Z, own),
            _ => return None,
        };
        (own.abs() == 1.0).then_some((axis, own < 0.0))
    }

    /// s and v, where a vector is s v.
    fn scaled(&self, v: Vector) -> Option<(Scalar, Vector)> {
        match self.node(v.0) {
            Node::Scale(s, v) => Some((s, v)),
            _ => None,
        }
    }

    /// v, where a vector is −v.
    fn opposite(&self, v: Vector) -> Option<Vector> {
        self.scaled(v).and_then(|(s, v)| (self.value(s) == Some(-1.0)).then_some(v))
    }

    pub(crate) fn zero(&mut self) -> Vector {
        self.graph.constant_vector([0.0; 3])
    }

    /// x·y, numbers first and together: 2·(3·x) = 6·x.
    pub(crate) fn mul(&mut self, x: Scalar, y: Scalar) -> Scalar {
        let number = |g: &Graph, s: Scalar| match g.node(s.0) {
            Node::Apply(Operation::Mul, a, b) => {
                g.value(a).map(|value| (value, b)).or(g.value(b).map(|value| (value, a)))
            }
            _ => None,
        };
        for (constant, product) in [(x, y), (y, x)] {
            if let (Some(outer), Some((inner, rest))) = (self.value(constant), number(self.graph, product)) {
                let both = self.graph.constant(outer * inner);
                return self.graph.mul(both, rest);
            }
        }
        self.graph.mul(x, y)
    }

    /// −v; −(a − b) = b − a.
    pub(crate) fn neg(&mut self, v: Vector) -> Vector {
        let minus = self.graph.constant(-1.0);
        self.scale(minus, v)
    }

    pub(crate) fn scale(&mut self, s: Scalar, v: Vector) -> Vector {
        if self.value(s) == Some(0.0) || self.is_zero(v) {
            return self.zero(); // 0 v = 0
        }
        if self.value(s) == Some(1.0) {
            return v; // 1 v = v
        }
        if let Some((t, inner)) = self.scaled(v) {
            let both = self.mul(s, t);
            return self.scale(both, inner); // s (t v) = (s t) v
        }
        if let (Some(-1.0), Node::SubVector(a, b)) = (self.value(s), self.node(v.0)) {
            return self.sub_vector(b, a); // −(a − b) = b − a
        }
        if let (Some(factor), Some(numbers)) = (self.value(s), self.constants(v)) {
            return self.graph.constant_vector(numbers.map(|x| factor * x));
        }
        self.graph.scale(s, v)
    }

    pub(crate) fn add_vector(&mut self, a: Vector, b: Vector) -> Vector {
        if self.is_zero(a) {
            return b; // 0 + b = b
        }
        if self.is_zero(b) {
            return a; // a + 0 = a
        }
        if a == b {
            let two = self.graph.constant(2.0);
            return self.scale(two, a); // a + a = 2 a
        }
        match (self.opposite(a), self.opposite(b)) {
            (_, Some(minus_b)) => self.sub_vector(a, minus_b), // a + (−b) = a − b
            (Some(minus_a), None) => self.sub_vector(b, minus_a), // −a + b = b − a
            _ => self.graph.add_vector(a, b),
        }
    }

    pub(crate) fn sub_vector(&mut self, a: Vector, b: Vector) -> Vector {
        if self.is_zero(b) {
            return a; // a − 0 = a
        }
        if a == b {
            return self.zero(); // a − a = 0
        }
        if self.is_zero(a) {
            return self.neg(b); // 0 − b = −b
        }
        match self.opposite(b) {
            Some(minus_b) => self.add_vector(a, minus_b), // a − (−b) = a + b
            None => self.graph.sub_vector(a, b),
        }
    }

    pub(crate) fn dot(&mut self, a: Vector, b: Vector) -> Scalar {
        if self.is_zero(a) || self.is_zero(b) {
            return self.graph.constant(0.0); // 0·b = 0
        }
        for (a, b) in [(a, b), (b, a)] {
            if let Some((s, v)) = self.scaled(a) {
                let rest = self.dot(v, b);
                return self.mul(s, rest); // (s a)·b = s (a·b)
            }
            if let Some((axis, backwards)) = self.basis(a) {
                let component = self.component(b, axis); // eᵢ·b = bᵢ
                return if backwards { self.graph.neg(component) } else { component };
            }
            if let Node::Cross(c, d) = self.node(b.0)
                && (a == c || a == d)
            {
                return self.graph.constant(0.0); // a·(a × d) = 0
            }
        }
        if let (Node::Column(r, i), Node::Column(s, j)) = (self.node(a.0), self.node(b.0))
            && r == s
        {
            return self.graph.constant(if i == j { 1.0 } else { 0.0 }); // columns of a rotation are orthonormal
        }
        self.graph.dot(a, b)
    }

    pub(crate) fn cross(&mut self, a: Vector, b: Vector) -> Vector {
        if a == b || self.is_zero(a) || self.is_zero(b) {
            return self.zero(); // a × a = 0
        }
        if let Some((s, v)) = self.scaled(a) {
            let rest = self.cross(v, b);
            return self.scale(s, rest); // (s a) × b = s (a × b)
        }
        if let Some((s, v)) = self.scaled(b) {
            let rest = self.cross(a, v);
            return self.scale(s, rest);
        }
        let columns = match (self.node(a.0), self.node(b.0)) {
            (Node::Column(r, i), Node::Column(s, j)) if r == s => Some((Some(r), i, j, false)),
            _ => match (self.basis(a), self.basis(b)) {
                (Some((i, p)), Some((j, q))) => Some((None, i, j, p != q)),
                _ => None,
            },
        };
        if let Some((r, i, j, backwards)) = columns {
            // R eᵢ × R eⱼ = R (eᵢ × eⱼ)
            let Some(k) = Axis::ALL.into_iter().find(|k| *k != i && *k != j) else { return self.zero() };
            let v = match r {
                Some(r) => self.column(r, k),
                None => self.axis(k),
            };
            let even = (i.index() + 1) % 3 == j.index();
            return if even == backwards { self.neg(v) } else { v };
        }
        self.graph.cross(a, b)
    }

    /// A coordinate axis.
    pub(crate) fn axis(&mut self, axis: Axis) -> Vector {
        self.graph.constant_vector(Axis::ALL.map(|other| if other == axis { 1.0 } else { 0.0 }))
    }

    pub(crate) fn component(&mut self, v: Vector, axis: Axis) -> Scalar {
        match self.node(v.0) {
            Node::AddVector(a, b) if self.constants(a).is_some() || self.constants(b).is_some() => {
                let (a, b) = (self.component(a, axis), self.component(b, axis));
                self.graph.add(a, b) // (a + b)ᵢ = aᵢ + bᵢ
            }
            Node::SubVector(a, b) if self.constants(a).is_some() || self.constants(b).is_some() => {
                let (a, b) = (self.component(a, axis), self.component(b, axis));
                self.graph.sub(a, b)
            }
            Node::Scale(s, inner) => {
                let inner = self.component(inner, axis);
                self.mul(s, inner) // (s v)ᵢ = s vᵢ
            }
            _ => self.graph.component(v, axis),
        }
    }

    pub(crate) fn vector(&mut self, x: Scalar, y: Scalar, z: Scalar) -> Vector {
        self.graph.vector(x, y, z)
    }

    pub(crate) fn compose_rotation(&mut self, r: Rotation, s: Rotation) -> Rotation {
        match (self.node(r.0), self.node(s.0)) {
            // R (S T) = (R S) T: composed from the base on
            (_, Node::ComposeRotation(first, second)) => {
                let outer = self.compose_rotation(r, first);
                self.compose_rotation(outer, second)
            }
            _ => self.graph.compose_rotation(r, s),
        }
    }

    pub(crate) fn rotate(&mut self, r: Rotation, v: Vector) -> Vector {
        if self.is_zero(v) {
            return v; // R 0 = 0
        }
        if let Some((s, inner)) = self.scaled(v) {
            let inner = self.rotate(r, inner);
            return self.scale(s, inner); // R (s v) = s (R v)
        }
        if let Some((axis, backwards)) = self.basis(v) {
            let column = self.column(r, axis); // R eᵢ is the column i
            return if backwards { self.neg(column) } else { column };
        }
        match self.node(v.0) {
            Node::Column(s, axis) => {
                let both = self.compose_rotation(r, s);
                self.column(both, axis) // R (S eᵢ) = (R S) eᵢ
            }
            Node::Rotate(s, inner) => {
                let both = self.compose_rotation(r, s);
                self.rotate(both, inner) // R (S v) = (R S) v
            }
            _ => self.graph.rotate(r, v),
        }
    }

    pub(crate) fn column(&mut self, r: Rotation, axis: Axis) -> Vector {
        match self.node(r.0) {
            Node::Turn(about, _) if about == axis => self.axis(axis), // a turn leaves its axis
            Node::ComposeRotation(outer, inner) => {
                // (R S) eᵢ = R (S eᵢ), where S eᵢ is a coordinate axis
                let last = self.column(inner, axis);
                match self.basis(last) {
                    Some(_) => self.rotate(outer, last),
                    None => self.graph.column(r, axis),
                }
            }
            _ => self.graph.column(r, axis),
        }
    }

    pub(crate) fn inverse_rotation(&mut self, r: Rotation) -> Rotation {
        match self.node(r.0) {
            Node::ComposeRotation(first, second) => {
                let (first, second) = (self.inverse_rotation(first), self.inverse_rotation(second));
                self.compose_rotation(second, first) // (R S)⁻¹ = S⁻¹ R⁻¹
            }
            _ => self.graph.inverse_rotation(r),
        }
    }

    pub(crate) fn compose_frame(&mut self, f: Frame, g: Frame) -> Frame {
        match self.node(g.0) {
            // F (G H) = (F G) H: composed from the base on
            Node::ComposeFrame(first, second) => {
                let outer = self.compose_frame(f, first);
                self.compose_frame(outer, second)
            }
            _ => self.graph.compose_frame(f, g),
        }
    }

    /// (F G).R = F.R G.R
    pub(crate) fn rotation_of(&mut self, f: Frame) -> Rotation {
        match self.node(f.0) {
            Node::ComposeFrame(f, g) => {
                let (r, s) = (self.rotation_of(f), self.rotation_of(g));
                self.compose_rotation(r, s)
            }
            Node::InverseFrame(f) => {
                let r = self.rotation_of(f);
                self.inverse_rotation(r)
            }
            _ => self.graph.rotation_of(f),
        }
    }

    pub(crate) fn origin(&mut self, f: Frame) -> Vector {
        if let Node::ComposeFrame(outer, inner) = self.node(f.0) {
            let last = self.origin(inner);
            if self.is_zero(last) {
                return self.origin(outer); // F (0) = F.o
            }
        }
        self.graph.origin(f)
    }

    pub(crate) fn transform(&mut self, f: Frame, p: Vector) -> Vector {
        if self.is_zero(p) {
            return self.origin(f); // F (0) = F.o
        }
        match self.node(p.0) {
            Node::Origin(g) => {
                let both = self.compose_frame(f, g);
                self.origin(both) // F (G.o) = (F G).o
            }
            Node::Transform(g, inner) => {
                let both = self.compose_frame(f, g);
                self.transform(both, inner) // F (G p) = (F G) p
            }
            _ => self.graph.transform(f, p),
        }
    }

    /// A node like another one, simplified; its operands are in the graph.
    pub(crate) fn remake(&mut self, node: Node) -> NodeId {
        match node {
            Node::Constant(bits) => self.graph.constant(f64::from_bits(bits)).0,
            Node::Parameter(_) | Node::Input(_) | Node::NoRotation => self.graph.intern(node),
            Node::Apply(Operation::Mul, x, y) => self.mul(x, y).0,
            Node::Apply(operation, x, y) => self.graph.apply(operation, x, y).0,
            Node::Component(v, axis) => self.component(v, axis).0,
            Node::Dot(a, b) => self.dot(a, b).0,
            Node::Vector(x, y, z) => self.vector(x, y, z).0,
            Node::AddVector(a, b) => self.add_vector(a, b).0,
            Node::SubVector(a, b) => self.sub_vector(a, b).0,
            Node::Scale(s, v) => self.scale(s, v).0,
            Node::Cross(a, b) => self.cross(a, b).0,
            Node::Rotate(r, v) => self.rotate(r, v).0,
            Node::Column(r, axis) => self.column(r, axis).0,
            Node::Origin(f) => self.origin(f).0,
            Node::Transform(f, p) => self.transform(f, p).0,
            Node::Turn(axis, angle) => self.graph.turn(axis, angle).0,
            Node::ExpRotation(v) if self.is_zero(v) => self.graph.no_rotation().0, // exp 0 = 1
            Node::ExpRotation(v) => self.graph.exp_rotation(v).0,
            Node::Columns(x, y, z) => self.graph.columns(x, y, z).0,
            Node::ComposeRotation(r, s) => self.compose_rotation(r, s).0,
            Node::InverseRotation(r) => self.inverse_rotation(r).0,
            Node::RotationOf(f) => self.rotation_of(f).0,
            Node::Frame(r, origin) => self.graph.frame(r, origin).0,
            Node::ComposeFrame(f, g) => self.compose_frame(f, g).0,
            Node::InverseFrame(f) => self.graph.inverse_frame(f).0,
        }
    }
}
