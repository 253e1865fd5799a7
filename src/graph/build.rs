//! Making nodes: one function per operation, with the identities of geometry that cost nothing.

use super::{Axis, Frame, Graph, Node, Operation, Rotation, Scalar, Vector};

impl Graph {
    /// A constant.
    pub fn constant(&mut self, value: f64) -> Scalar {
        // −0 and 0 are one constant
        let value = if value == 0.0 { 0.0 } else { value };
        Scalar(self.intern(Node::Constant(value.to_bits())))
    }

    /// The parameter with this number: the same for all rows.
    pub fn parameter(&mut self, index: u32) -> Scalar {
        Scalar(self.intern(Node::Parameter(index)))
    }

    /// The input with this number: each row has its own.
    pub fn input(&mut self, index: u32) -> Scalar {
        Scalar(self.intern(Node::Input(index)))
    }

    /// An operation of one argument.
    pub fn unary(&mut self, operation: Operation, x: Scalar) -> Scalar {
        self.apply(operation, x, x)
    }

    /// x + y
    pub fn add(&mut self, x: Scalar, y: Scalar) -> Scalar {
        self.apply(Operation::Add, x, y)
    }

    /// x − y
    pub fn sub(&mut self, x: Scalar, y: Scalar) -> Scalar {
        self.apply(Operation::Sub, x, y)
    }

    /// x·y
    pub fn mul(&mut self, x: Scalar, y: Scalar) -> Scalar {
        self.apply(Operation::Mul, x, y)
    }

    /// x/y
    pub fn div(&mut self, x: Scalar, y: Scalar) -> Scalar {
        self.apply(Operation::Div, x, y)
    }

    /// 1/x
    pub fn recip(&mut self, x: Scalar) -> Scalar {
        let one = self.constant(1.0);
        self.div(one, x)
    }

    /// −x
    pub fn neg(&mut self, x: Scalar) -> Scalar {
        self.unary(Operation::Neg, x)
    }

    /// xⁿ; repeated squaring where n is a whole constant, exp(n log x) otherwise.
    pub fn pow(&mut self, x: Scalar, n: Scalar) -> Scalar {
        match self.value(n) {
            Some(value) if value.fract() == 0.0 && value.abs() <= 64.0 => self.apply(Operation::PowInteger, x, n),
            Some(0.5) => self.unary(Operation::Sqrt, x),
            _ => self.apply(Operation::Pow, x, n),
        }
    }

    /// The vector (x, y, z).
    pub fn vector(&mut self, x: Scalar, y: Scalar, z: Scalar) -> Vector {
        Vector(self.intern(Node::Vector(x, y, z)))
    }

    /// A constant vector.
    pub fn constant_vector(&mut self, v: [f64; 3]) -> Vector {
        let [x, y, z] = v.map(|value| self.constant(value));
        self.vector(x, y, z)
    }

    /// A component of a vector.
    pub fn component(&mut self, v: Vector, axis: Axis) -> Scalar {
        match self.node(v.0) {
            Node::Vector(x, y, z) => [x, y, z][axis.index()],
            _ => Scalar(self.intern(Node::Component(v, axis))),
        }
    }

    /// a + b
    pub fn add_vector(&mut self, a: Vector, b: Vector) -> Vector {
        Vector(self.intern(Node::AddVector(a, b)))
    }

    /// a − b
    pub fn sub_vector(&mut self, a: Vector, b: Vector) -> Vector {
        Vector(self.intern(Node::SubVector(a, b)))
    }

    /// s·v
    pub fn scale(&mut self, s: Scalar, v: Vector) -> Vector {
        if self.value(s) == Some(1.0) {
            return v;
        }
        Vector(self.intern(Node::Scale(s, v)))
    }

    /// a·b
    pub fn dot(&mut self, a: Vector, b: Vector) -> Scalar {
        let (a, b) = if b < a { (b, a) } else { (a, b) };
        Scalar(self.intern(Node::Dot(a, b)))
    }

    /// a × b
    pub fn cross(&mut self, a: Vector, b: Vector) -> Vector {
        if b < a {
            // a × b = −(b × a): one order, so that both are one node
            let minus = self.constant(-1.0);
            let opposite = self.cross(b, a);
            return self.scale(minus, opposite);
        }
        Vector(self.intern(Node::Cross(a, b)))
    }

    /// √(v·v)
    pub fn norm(&mut self, v: Vector) -> Scalar {
        let square = self.dot(v, v);
        self.unary(Operation::Sqrt, square)
    }

    /// v/√(v·v)
    pub fn unit(&mut self, v: Vector) -> Vector {
        let norm = self.norm(v);
        let one = self.constant(1.0);
        let inverse = self.div(one, norm);
        self.scale(inverse, v)
    }

    /// No rotation.
    pub fn no_rotation(&mut self) -> Rotation {
        Rotation(self.intern(Node::NoRotation))
    }

    /// A turn about a coordinate axis, right-handed.
    pub fn turn(&mut self, axis: Axis, angle: Scalar) -> Rotation {
        if self.value(angle) == Some(0.0) {
            return self.no_rotation();
        }
        Rotation(self.intern(Node::Turn(axis, angle)))
    }

    /// exp of a rotation vector: a turn by its length about its direction; smooth at zero.
    pub fn exp_rotation(&mut self, v: Vector) -> Rotation {
        Rotation(self.intern(Node::ExpRotation(v)))
    }

    /// The rotation whose matrix has these columns, which must be orthonormal and right-handed.
    pub fn columns(&mut self, x: Vector, y: Vector, z: Vector) -> Rotation {
        Rotation(self.intern(Node::Columns(x, y, z)))
    }

    /// The rotation of the quaternion w + xi + yj + zk, normalised here.
    pub fn quaternion(&mut self, w: Scalar, x: Scalar, y: Scalar, z: Scalar) -> Rotation {
        let q = [w, x, y, z];
        let zero = self.constant(0.0);
        let norm2 = q.iter().fold(zero, |sum, &s| {
            let square = self.mul(s, s);
            self.add(sum, square)
        });
        let two = self.constant(2.0);
        let s = self.div(two, norm2);
        let mut product = |a: Scalar, b: Scalar| {
            let ab = self.mul(a, b);
            self.mul(s, ab)
        };
        let (xx, yy, zz) = (product(x, x), product(y, y), product(z, z));
        let (xy, xz, yz) = (product(x, y), product(x, z), product(y, z));
        let (wx, wy, wz) = (product(w, x), product(w, y), product(w, z));
        let one = self.constant(1.0);
        let mut diagonal = |a, b| {
            let sum = self.add(a, b);
            self.sub(one, sum)
        };
        let (dx, dy, dz) = (diagonal(yy, zz), diagonal(xx, zz), diagonal(xx, yy));
        let first = {
            let (b, c) = (self.add(xy, wz), self.sub(xz, wy));
            self.vector(dx, b, c)
        };
        let second = {
            let (a, c) = (self.sub(xy, wz), self.add(yz, wx));
            self.vector(a, dy, c)
        };
        let third = {
            let (a, b) = (self.add(xz, wy), self.sub(yz, wx));
            self.vector(a, b, dz)
        };
        self.columns(first, second, third)
    }

    /// R·S, S first.
    pub fn compose_rotation(&mut self, r: Rotation, s: Rotation) -> Rotation {
        match (self.node(r.0), self.node(s.0)) {
            (Node::NoRotation, _) => s,
            (_, Node::NoRotation) => r,
            _ => Rotation(self.intern(Node::ComposeRotation(r, s))),
        }
    }

    /// R⁻¹ = Rᵀ
    pub fn inverse_rotation(&mut self, r: Rotation) -> Rotation {
        match self.node(r.0) {
            Node::NoRotation => r,
            Node::InverseRotation(original) => original,
            Node::Turn(axis, angle) => {
                let back = self.neg(angle);
                self.turn(axis, back)
            }
            _ => Rotation(self.intern(Node::InverseRotation(r))),
        }
    }

    /// R·v
    pub fn rotate(&mut self, r: Rotation, v: Vector) -> Vector {
        match self.node(r.0) {
            Node::NoRotation => v,
            _ => Vector(self.intern(Node::Rotate(r, v))),
        }
    }

    /// Where the rotation takes a coordinate axis.
    pub fn column(&mut self, r: Rotation, axis: Axis) -> Vector {
        match self.node(r.0) {
            Node::NoRotation => {
                let mut v = [0.0; 3];
                v[axis.index()] = 1.0;
                self.constant_vector(v)
            }
            Node::Columns(x, y, z) => [x, y, z][axis.index()],
            _ => Vector(self.intern(Node::Column(r, axis))),
        }
    }

    /// The rotation vector of R, shorter than half a turn; undefined at half a turn, exact at none.
    ///
    /// With w = vee(R − Rᵀ)/2 = sin θ·n and c = (tr R − 1)/2 = cos θ: the vector is θ n = w · 2/(1 + c) · g₀(w·w/(1 + c)²),
    /// g₀(z) = arctan √z/√z, since tan(θ/2) = sin θ/(1 + cos θ).
    pub fn log_rotation(&mut self, r: Rotation) -> Vector {
        let columns = Axis::ALL.map(|axis| self.column(r, axis));
        let mut entry = |i: usize, j: usize| self.component(columns[j], Axis::ALL[i]);
        let off = [(entry(2, 1), entry(1, 2)), (entry(0, 2), entry(2, 0)), (entry(1, 0), entry(0, 1))];
        let diagonal = [entry(0, 0), entry(1, 1), entry(2, 2)];
        let half = self.constant(0.5);
        let w = off.map(|(a, b)| {
            let difference = self.sub(a, b);
            self.mul(half, difference)
        });
        // 1 + c = (tr R + 1)/2
        let sum = self.add(diagonal[0], diagonal[1]);
        let trace = self.add(sum, diagonal[2]);
        let one = self.constant(1.0);
        let plus = self.add(trace, one);
        let one_plus_c = self.mul(half, plus);
        let least = self.constant(1e-12);
        let one_plus_c = self.apply(Operation::AtLeast, one_plus_c, least);
        let [x, y, z] = w;
        let w = self.vector(x, y, z);
        let w2 = self.dot(w, w);
        let square = self.mul(one_plus_c, one_plus_c);
        let ratio = self.div(w2, square);
        let zero = self.constant(0.0);
        let g = self.apply(Operation::Atanc, ratio, zero);
        let two = self.constant(2.0);
        let twice = self.mul(two, g);
        let factor = self.div(twice, one_plus_c);
        self.scale(factor, w)
    }

    /// The frame with this rotation and origin.
    pub fn frame(&mut self, r: Rotation, origin: Vector) -> Frame {
        Frame(self.intern(Node::Frame(r, origin)))
    }

    /// F·G: G as seen from where F stands.
    pub fn compose_frame(&mut self, f: Frame, g: Frame) -> Frame {
        if self.is_identity(f) {
            return g;
        }
        if self.is_identity(g) {
            return f;
        }
        Frame(self.intern(Node::ComposeFrame(f, g)))
    }

    /// F⁻¹
    pub fn inverse_frame(&mut self, f: Frame) -> Frame {
        match self.node(f.0) {
            Node::InverseFrame(original) => original,
            _ => Frame(self.intern(Node::InverseFrame(f))),
        }
    }

    /// A frame's origin.
    pub fn origin(&mut self, f: Frame) -> Vector {
        match self.node(f.0) {
            Node::Frame(_, origin) => origin,
            _ => Vector(self.intern(Node::Origin(f))),
        }
    }

    /// A frame's rotation.
    pub fn rotation_of(&mut self, f: Frame) -> Rotation {
        match self.node(f.0) {
            Node::Frame(r, _) => r,
            _ => Rotation(self.intern(Node::RotationOf(f))),
        }
    }

    /// The point p, given in frame F, as seen from outside: R·p + o.
    pub fn transform(&mut self, f: Frame, p: Vector) -> Vector {
        Vector(self.intern(Node::Transform(f, p)))
    }

    /// A joint of the φ-model, (A1)–(A3) of Sultan & Wager: T(φ + θ, d)·T(a, b, α, β), with `angle` = φ + θ.
    ///
    /// (A2) is a turn about z by the angle, a slide along z by d, and the renaming of axes z ← x ← y ← z; (A3) is the DH
    /// motion Rot_z(β)·Trans(b, 0, a)·Rot_x(α). Kept in these factors, so that zeros and ones vanish when lowered.
    pub fn phi_joint(&mut self, angle: Scalar, d: Scalar, [a, b, alpha, beta]: [Scalar; 4]) -> Frame {
        let zero = self.constant(0.0);
        let moving = self.screw(Axis::Z, angle, d);
        let [x, y, z] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]].map(|v| self.constant_vector(v));
        let renaming = self.columns(x, y, z);
        let nowhere = self.vector(zero, zero, zero);
        let renaming = self.frame(renaming, nowhere);
        let link = {
            let (first, second) = (self.screw(Axis::Z, beta, a), self.screw(Axis::X, alpha, b));
            self.compose_frame(first, second)
        };
        let fixed = self.compose_frame(renaming, link);
        self.compose_frame(moving, fixed)
    }

    /// A turn about a coordinate axis and a slide along it.
    pub fn screw(&mut self, axis: Axis, angle: Scalar, slide: Scalar) -> Frame {
        let zero = self.constant(0.0);
        let mut origin = [zero; 3];
        origin[axis.index()] = slide;
        let [x, y, z] = origin;
        let origin = self.vector(x, y, z);
        let turn = self.turn(axis, angle);
        self.frame(turn, origin)
    }

    /// The identity frame.
    pub fn no_motion(&mut self) -> Frame {
        let zero = self.constant(0.0);
        self.screw(Axis::Z, zero, zero)
    }

    fn is_identity(&self, f: Frame) -> bool {
        let Node::Frame(r, o) = self.node(f.0) else { return false };
        let Node::Vector(x, y, z) = self.node(o.0) else { return false };
        self.node(r.0) == Node::NoRotation && [x, y, z].iter().all(|&s| self.value(s) == Some(0.0))
    }
}
