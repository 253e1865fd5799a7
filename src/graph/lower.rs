//! From geometry to scalars: the last step before a tape.
//!
//! What is wanted of a frame is mostly a point or an axis, so these are pushed through the chain from its far end,
//! R₁(R₂(R₃ v)), instead of multiplying matrices; a rotation that does not vary with the row is multiplied out, once per
//! iteration. Zeros and ones of constant columns vanish on the way, since the scalar builder folds them.

use std::collections::HashMap;

use super::{Axis, Frame, Graph, Node, NodeId, Operation, Rotation, Scalar, Varies, Vector};

/// Three scalars of the lowered graph.
pub(super) type Triple = [Scalar; 3];
/// The columns of a matrix.
pub(super) type Matrix = [Triple; 3];

/// How what comes before the last joint of a chain acts on a vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Chains {
    /// Joint by joint, which is the least for one point.
    Push,
    /// By its matrix, which derivatives need anyway.
    Multiply,
}

/// Lowers one graph into another that has scalar nodes only.
pub(super) struct Lowering<'a> {
    from: &'a Graph,
    chains: Chains,
    /// parameters that are zero
    zeros: Vec<u32>,
    pub(super) to: Graph,
    scalars: HashMap<NodeId, Scalar>,
    vectors: HashMap<NodeId, Triple>,
    matrices: HashMap<NodeId, Matrix>,
    rotated: HashMap<(NodeId, Triple), Triple>,
}

impl<'a> Lowering<'a> {
    /// For values alone.
    pub(super) fn new(from: &'a Graph, zeros: &[u32]) -> Self {
        Self::with(from, Chains::Push, zeros)
    }

    /// For values beside derivatives.
    pub(super) fn multiplying(from: &'a Graph, zeros: &[u32]) -> Self {
        Self::with(from, Chains::Multiply, zeros)
    }

    fn with(from: &'a Graph, chains: Chains, zeros: &[u32]) -> Self {
        Lowering {
            from,
            chains,
            zeros: zeros.to_vec(),
            to: Graph::new(),
            scalars: HashMap::new(),
            vectors: HashMap::new(),
            matrices: HashMap::new(),
            rotated: HashMap::new(),
        }
    }

    /// Lowers what the outputs need. Operands are lowered before their users, so that recursion stays as shallow as one
    /// chain however deep the graph is.
    pub(super) fn outputs(&mut self, outputs: &[Scalar]) -> Vec<Scalar> {
        let needed = self.from.needed(outputs);
        for (id, _) in needed.iter().enumerate().filter(|(_, needed)| **needed) {
            self.prepare(id as NodeId);
        }
        outputs.iter().map(|&output| self.scalar(output)).collect()
    }

    /// Lowers a scalar or vector node whose operands are ready; rotations and frames wait for what is wanted of them.
    fn prepare(&mut self, id: NodeId) {
        use Node::*;
        match self.from.node(id) {
            Constant(_) | Parameter(_) | Input(_) | Apply(..) | Component(..) | Dot(..) => {
                self.scalar(Scalar(id));
            }
            Vector(..) | AddVector(..) | SubVector(..) | Scale(..) | Cross(..) | Rotate(..) | Column(..)
            | Origin(..) | Transform(..) => {
                self.vector(super::Vector(id));
            }
            NoRotation | Turn(..) | ExpRotation(..) | Columns(..) | ComposeRotation(..) | InverseRotation(..)
            | RotationOf(..) | Frame(..) | ComposeFrame(..) | InverseFrame(..) => {}
        }
    }

    pub(super) fn scalar(&mut self, s: Scalar) -> Scalar {
        if let Some(&known) = self.scalars.get(&s.0) {
            return known;
        }
        let lowered = match self.from.node(s.0) {
            Node::Constant(bits) => self.to.constant(f64::from_bits(bits)),
            Node::Parameter(index) if self.zeros.contains(&index) => self.to.constant(0.0),
            Node::Parameter(index) => self.to.parameter(index),
            Node::Input(index) => self.to.input(index),
            Node::Apply(operation, x, y) => {
                let (x, y) = (self.scalar(x), self.scalar(y));
                self.to.apply(operation, x, y)
            }
            Node::Component(v, axis) => self.vector(v)[axis.index()],
            Node::Dot(a, b) => {
                let (a, b) = (self.vector(a), self.vector(b));
                self.dot(a, b)
            }
            other => self.nothing(other, "scalar"),
        };
        self.scalars.insert(s.0, lowered);
        lowered
    }

    /// No number, which is the value of a handle that was made by hand for a node of another kind.
    fn nothing(&mut self, node: Node, wanted: &str) -> Scalar {
        debug_assert!(false, "{node:?} is not a {wanted}");
        self.to.constant(f64::NAN)
    }

    pub(super) fn vector(&mut self, v: Vector) -> Triple {
        if let Some(&known) = self.vectors.get(&v.0) {
            return known;
        }
        let lowered = match self.from.node(v.0) {
            Node::Vector(x, y, z) => [x, y, z].map(|s| self.scalar(s)),
            Node::AddVector(a, b) => {
                let (a, b) = (self.vector(a), self.vector(b));
                self.zip(Operation::Add, a, b)
            }
            Node::SubVector(a, b) => {
                let (a, b) = (self.vector(a), self.vector(b));
                self.zip(Operation::Sub, a, b)
            }
            Node::Scale(s, v) => {
                let (s, v) = (self.scalar(s), self.vector(v));
                v.map(|component| self.to.mul(s, component))
            }
            Node::Cross(a, b) => {
                let (a, b) = (self.vector(a), self.vector(b));
                self.cross(a, b)
            }
            Node::Rotate(r, v) => {
                let v = self.vector(v);
                self.rotate(r, v)
            }
            Node::Column(r, axis) => {
                let unit = self.unit(axis);
                self.rotate(r, unit)
            }
            Node::Origin(f) => self.origin(f),
            Node::Transform(f, p) => {
                let p = self.vector(p);
                self.transform(f, p)
            }
            other => [self.nothing(other, "vector"); 3],
        };
        self.vectors.insert(v.0, lowered);
        lowered
    }

    /// R·v, pushed through the factors of R where R varies with the row.
    fn rotate(&mut self, r: Rotation, v: Triple) -> Triple {
        if let Some(&known) = self.rotated.get(&(r.0, v)) {
            return known;
        }
        let per_row = self.from.node_varies(r.0) == Varies::PerRow;
        let rotated = match self.from.node(r.0) {
            Node::NoRotation => v,
            Node::Turn(axis, angle) => {
                let angle = self.scalar(angle);
                self.turn(axis, angle, v)
            }
            Node::ComposeRotation(a, b) if per_row => {
                let inner = self.rotate(b, v);
                self.outer(a.0, inner)
            }
            Node::InverseRotation(original) if per_row => self.rotate_back(original, v),
            Node::RotationOf(f) if per_row => self.rotate_frame(f, v),
            _ => {
                let m = self.matrix(r);
                self.times(&m, v)
            }
        };
        self.rotated.insert((r.0, v), rotated);
        rotated
    }

    /// Rᵀ·v: the dot products of the columns with v.
    fn rotate_back(&mut self, r: Rotation, v: Triple) -> Triple {
        let m = self.matrix(r);
        m.map(|column| self.dot(column, v))
    }

    /// The rotation of a frame applied to v.
    fn rotate_frame(&mut self, f: Frame, v: Triple) -> Triple {
        match self.from.node(f.0) {
            Node::Frame(r, _) => self.rotate(r, v),
            Node::ComposeFrame(f, g) => {
                let inner = self.rotate_frame(g, v);
                self.outer(f.0, inner)
            }
            Node::InverseFrame(original) => {
                let m = self.frame_matrix(original);
                m.map(|column| self.dot(column, v))
            }
            other => [self.nothing(other, "frame"); 3],
        }
    }

    /// R·p + o
    fn transform(&mut self, f: Frame, p: Triple) -> Triple {
        match self.from.node(f.0) {
            Node::Frame(r, o) => {
                let (moved, o) = (self.rotate(r, p), self.vector(o));
                self.zip(Operation::Add, moved, o)
            }
            Node::ComposeFrame(f, g) => {
                let inner = self.transform(g, p);
                if self.chains == Chains::Push {
                    return self.transform(f, inner);
                }
                let (turned, o) = (self.outer(f.0, inner), self.origin(f));
                self.zip(Operation::Add, turned, o)
            }
            // F⁻¹ p = Rᵀ(p − o)
            Node::InverseFrame(original) => {
                let o = self.origin(original);
                let difference = self.zip(Operation::Sub, p, o);
                let m = self.frame_matrix(original);
                m.map(|column| self.dot(column, difference))
            }
            other => [self.nothing(other, "frame"); 3],
        }
    }

    /// The rotation of what comes before the last joint, applied to v.
    pub(super) fn outer(&mut self, id: NodeId, v: Triple) -> Triple {
        if self.chains == Chains::Multiply {
            let m = self.any_matrix(id);
            return self.times(&m, v);
        }
        match self.from.node(id) {
            Node::Frame(..) | Node::ComposeFrame(..) | Node::InverseFrame(..) => self.rotate_frame(Frame(id), v),
            _ => self.rotate(Rotation(id), v),
        }
    }

    /// The matrix of a rotation or frame, by columns.
    pub(super) fn any_matrix(&mut self, id: NodeId) -> Matrix {
        match self.from.node(id) {
            Node::Frame(..) | Node::ComposeFrame(..) | Node::InverseFrame(..) => self.frame_matrix(Frame(id)),
            _ => self.matrix(Rotation(id)),
        }
    }

    /// A frame's origin.
    pub(super) fn origin(&mut self, f: Frame) -> Triple {
        if let Some(&known) = self.vectors.get(&f.0) {
            return known;
        }
        let zero = self.zero();
        let origin = self.transform(f, zero);
        self.vectors.insert(f.0, origin);
        origin
    }

    /// c_k(v·v) of Stumpff's functions.
    pub(super) fn stumpff<const N: usize>(&mut self, v: Triple, k: [u32; N]) -> [Scalar; N] {
        let square = self.dot(v, v);
        k.map(|k| {
            let k = self.to.constant(f64::from(k));
            self.to.apply(Operation::Stumpff, square, k)
        })
    }

    fn frame_matrix(&mut self, f: Frame) -> Matrix {
        if let Some(&known) = self.matrices.get(&f.0) {
            return known;
        }
        let matrix = Axis::ALL.map(|axis| {
            let unit = self.unit(axis);
            self.rotate_frame(f, unit)
        });
        self.matrices.insert(f.0, matrix);
        matrix
    }

    /// The matrix of a rotation, by columns.
    fn matrix(&mut self, r: Rotation) -> Matrix {
        if let Some(&known) = self.matrices.get(&r.0) {
            return known;
        }
        let matrix = match self.from.node(r.0) {
            Node::Columns(x, y, z) => [x, y, z].map(|v| self.vector(v)),
            Node::ExpRotation(v) => {
                let v = self.vector(v);
                self.exponential(v)
            }
            Node::InverseRotation(original) => transpose(self.matrix(original)),
            Node::RotationOf(f) => self.frame_matrix(f),
            Node::ComposeRotation(a, b) => {
                let inner = self.matrix(b);
                inner.map(|column| self.rotate(a, column))
            }
            _ => Axis::ALL.map(|axis| {
                let unit = self.unit(axis);
                self.rotate(r, unit)
            }),
        };
        self.matrices.insert(r.0, matrix);
        matrix
    }

    /// v turned about a coordinate axis: with c, s the cosine and sine, (u, w) ↦ (c u − s w, s u + c w).
    fn turn(&mut self, axis: Axis, angle: Scalar, v: Triple) -> Triple {
        let (u, w) = match axis {
            Axis::X => (1, 2),
            Axis::Y => (2, 0),
            Axis::Z => (0, 1),
        };
        let (c, s) = match self.to.value(angle).and_then(quarter_turns) {
            Some((c, s)) => (self.to.constant(c), self.to.constant(s)),
            None => (self.to.unary(Operation::Cos, angle), self.to.unary(Operation::Sin, angle)),
        };
        let (cu, sw) = (self.to.mul(c, v[u]), self.to.mul(s, v[w]));
        let (su, cw) = (self.to.mul(s, v[u]), self.to.mul(c, v[w]));
        let mut turned = v;
        turned[u] = self.to.sub(cu, sw);
        turned[w] = self.to.add(su, cw);
        turned
    }

    /// Rodrigues' formula in Stumpff's functions: R = I + c₁(θ²)\[v\]× + c₂(θ²)\[v\]×², θ² = v·v; column j is
    /// eⱼ + c₁ v×eⱼ + c₂ v×(v×eⱼ). Smooth at zero.
    fn exponential(&mut self, v: Triple) -> Matrix {
        let [c1, c2] = self.stumpff(v, [1, 2]);
        Axis::ALL.map(|axis| {
            let unit = self.unit(axis);
            let first = self.cross(v, unit);
            let second = self.cross(v, first);
            let first = first.map(|s| self.to.mul(c1, s));
            let second = second.map(|s| self.to.mul(c2, s));
            let sum = self.zip(Operation::Add, unit, first);
            self.zip(Operation::Add, sum, second)
        })
    }

    fn times(&mut self, m: &Matrix, v: Triple) -> Triple {
        let m = transpose(*m);
        m.map(|row| self.dot(row, v))
    }

    fn dot(&mut self, a: Triple, b: Triple) -> Scalar {
        let [x, y, z] = self.zip(Operation::Mul, a, b);
        let sum = self.to.add(x, y);
        self.to.add(sum, z)
    }

    fn cross(&mut self, a: Triple, b: Triple) -> Triple {
        let mut minor = |i: usize, j: usize| {
            let (p, q) = (self.to.mul(a[i], b[j]), self.to.mul(a[j], b[i]));
            self.to.sub(p, q)
        };
        [minor(1, 2), minor(2, 0), minor(0, 1)]
    }

    fn zip(&mut self, operation: Operation, a: Triple, b: Triple) -> Triple {
        [0, 1, 2].map(|i| self.to.apply(operation, a[i], b[i]))
    }

    fn unit(&mut self, axis: Axis) -> Triple {
        let mut unit = self.zero();
        unit[axis.index()] = self.to.constant(1.0);
        unit
    }

    fn zero(&mut self) -> Triple {
        [self.to.constant(0.0); 3]
    }
}

fn transpose(m: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

/// Cosine and sine of an angle that is as near to quarter turns as a number can be: exact, where those of the number are off by
/// 6e-17 each quarter, so that the products with them vanish.
fn quarter_turns(angle: f64) -> Option<(f64, f64)> {
    use std::f64::consts::FRAC_PI_2;
    let quarters = (angle / FRAC_PI_2).round();
    if quarters.abs() > 4.0 || angle != quarters * FRAC_PI_2 {
        return None;
    }
    Some([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][quarters.rem_euclid(4.0) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn constant_quarter_turns_are_exact() {
        assert_eq!(quarter_turns(FRAC_PI_2), Some((0.0, 1.0)));
        assert_eq!(quarter_turns(-FRAC_PI_2), Some((0.0, -1.0)));
        assert_eq!(quarter_turns(-PI), Some((-1.0, 0.0)));
        assert_eq!(quarter_turns(90f64.to_radians()), Some((0.0, 1.0)));
        assert_eq!(quarter_turns(FRAC_PI_2.next_up()), None);
        let mut g = Graph::new();
        let (angle, input) = (g.constant(FRAC_PI_2), g.input(0));
        let zero = g.constant(0.0);
        let (turn, v) = (g.turn(Axis::Z, angle), g.vector(input, zero, zero));
        let v = g.rotate(turn, v);
        let mut lowering = Lowering::new(&g, &[]);
        let turned = lowering.vector(v);
        let (zero, input) = (lowering.to.constant(0.0), lowering.to.input(0));
        assert_eq!(turned, [zero, input, zero]);
    }
}
