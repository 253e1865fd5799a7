//! The linearised graph: what a small change of the leaves does to every node, by the frame rule.
//!
//! A scalar moves by one number and a vector by three. A rotation moves by three and a frame by six, for it stays rigid: its
//! change is a *twist* (ω, v) in the outer coordinates, dR = \[ω\]× R and do = v + ω × o. A joint therefore moves all that
//! follows it by one screw, whatever follows. Source: Murray, Li & Sastry, A Mathematical Introduction to Robotic Manipulation
//! (1994), §2.4, §3.4.

use std::collections::HashMap;

use super::linear::{Linear, Vertex};
use super::lower::{Lowering, Triple};
use super::{Graph, Node, NodeId, Scalar};

/// A change of one number: a vertex of the linearised graph, forwards or backwards; none where it does not change.
type Change = Option<(Vertex, Sign)>;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sign {
    Plus,
    Minus,
}

/// Linearises a graph while it is lowered.
pub(super) struct Tangents<'a> {
    from: &'a Graph,
    pub(super) lowering: Lowering<'a>,
    linear: Linear,
    changes: HashMap<NodeId, [Change; 6]>,
}

impl<'a> Tangents<'a> {
    /// `leaves` are nodes of `from`.
    pub(super) fn new(from: &'a Graph, leaves: &[Scalar], zeros: &[u32]) -> Self {
        let mut changes = HashMap::new();
        let linear = Linear::new(leaves.len());
        for (k, leaf) in leaves.iter().enumerate() {
            changes.insert(leaf.0, [Some((linear.leaf(k), Sign::Plus)), None, None, None, None, None]);
        }
        Tangents { from, lowering: Lowering::multiplying(from, zeros), linear, changes }
    }

    /// The linearised graph, and the graph of its coefficients.
    pub(super) fn finish(self) -> (Linear, Graph) {
        (self.linear, self.lowering.to)
    }

    /// The change of a node; its operands' are known.
    fn of(&self, id: NodeId) -> [Change; 6] {
        self.changes.get(&id).copied().unwrap_or([None; 6])
    }

    fn three(&self, id: NodeId) -> [Change; 3] {
        let all = self.of(id);
        [all[0], all[1], all[2]]
    }

    /// Linearises every node that `needed` marks, in order.
    pub(super) fn all(&mut self, needed: &[bool]) {
        for id in 0..needed.len() as NodeId {
            if needed[id as usize] && !self.changes.contains_key(&id) {
                let change = self.node(id);
                if change.iter().any(Option::is_some) {
                    self.changes.insert(id, change);
                }
            }
        }
    }

    /// The change of an output, as a vertex of its own.
    pub(super) fn output(&mut self, output: Scalar) -> Vertex {
        let one = self.lowering.to.constant(1.0);
        let change = self.of(output.0)[0];
        let terms = self.signed(change, one);
        self.linear.vertex(terms)
    }

    fn node(&mut self, id: NodeId) -> [Change; 6] {
        use Node::*;
        let node = self.from.node(id);
        let mut active = false;
        node.operands(|operand| active |= self.changes.contains_key(&operand));
        if !active {
            return [None; 6];
        }
        match node {
            Constant(_) | Parameter(_) | Input(_) | NoRotation => [None; 6],
            Apply(operation, x, y) => {
                let (dx, dy) = (self.of(x.0)[0], self.of(y.0)[0]);
                let value = self.lowering.scalar(Scalar(id));
                let (x, y) = (self.lowering.scalar(x), self.lowering.scalar(y));
                let mut terms = Terms::new();
                let [by_x, by_y] = operation.partials(&mut self.lowering.to, x, y, value);
                terms.extend(self.signed(dx, by_x));
                if operation.row().arity == 2 {
                    terms.extend(self.signed(dy, by_y));
                }
                one(self.sum(terms))
            }
            Component(v, axis) => one(self.of(v.0)[axis.index()]),
            Dot(a, b) => {
                let (da, db) = (self.three(a.0), self.three(b.0));
                let (va, vb) = (self.lowering.vector(a), self.lowering.vector(b));
                let mut terms = Terms::new();
                if a == b {
                    // 2 (a · da): what follows is doubled once
                    for i in 0..3 {
                        terms.extend(self.signed(da[i], va[i]));
                    }
                    let half = self.sum(terms);
                    let two = self.lowering.to.constant(2.0);
                    terms = self.signed(half, two);
                } else {
                    for i in 0..3 {
                        terms.extend(self.signed(da[i], vb[i]));
                        terms.extend(self.signed(db[i], va[i]));
                    }
                }
                one(self.sum(terms))
            }
            Vector(x, y, z) => three([x, y, z].map(|s| self.of(s.0)[0])),
            AddVector(a, b) => three(self.plus(self.three(a.0), self.three(b.0))),
            SubVector(a, b) => {
                let minus = self.three(b.0).map(negated);
                three(self.plus(self.three(a.0), minus))
            }
            Scale(s, v) => {
                let (ds, dv) = (self.of(s.0)[0], self.three(v.0));
                let (s, v) = (self.lowering.scalar(s), self.lowering.vector(v));
                three([0, 1, 2].map(|i| {
                    let mut terms = self.signed(ds, v[i]);
                    terms.extend(self.signed(dv[i], s));
                    self.sum(terms)
                }))
            }
            Cross(a, b) => {
                let (da, db) = (self.three(a.0), self.three(b.0));
                let (va, vb) = (self.lowering.vector(a), self.lowering.vector(b));
                // da × b + a × db
                let first = self.crossed(da, vb);
                let second = self.crossed(db, va).map(negated);
                three(self.plus(first, second))
            }
            // d(R v) = ω × R v + R dv
            Rotate(r, v) => {
                let value = self.lowering.vector(super::Vector(id));
                let turned = self.crossed(self.three(r.0), value);
                let inner = self.turned(r.0, self.three(v.0));
                three(self.plus(turned, inner))
            }
            Column(r, _) => {
                let value = self.lowering.vector(super::Vector(id));
                three(self.crossed(self.three(r.0), value))
            }
            // do = v + ω × o
            Origin(f) => {
                let value = self.lowering.vector(super::Vector(id));
                three(self.carried(self.of(f.0), value))
            }
            // d(R p + o) = v + ω × (R p + o) + R dp
            Transform(f, p) => {
                let value = self.lowering.vector(super::Vector(id));
                let carried = self.carried(self.of(f.0), value);
                let inner = self.turned(f.0, self.three(p.0));
                three(self.plus(carried, inner))
            }
            Turn(axis, angle) => {
                let mut omega = [None; 3];
                omega[axis.index()] = self.of(angle.0)[0];
                three(omega)
            }
            ExpRotation(v) => three(self.exponential(v)),
            // ω = ½ Σ c × dc over the columns c
            Columns(x, y, z) => {
                let half = self.lowering.to.constant(0.5);
                let mut sum = [None; 3];
                for column in [x, y, z] {
                    let change = self.three(column.0);
                    let c = self.lowering.vector(column).map(|s| self.lowering.to.mul(half, s));
                    let turned = self.crossed(change, c).map(negated);
                    sum = self.plus(sum, turned);
                }
                three(sum)
            }
            // ω = ω₁ + R₁ ω₂
            ComposeRotation(a, b) => {
                let inner = self.turned(a.0, self.three(b.0));
                three(self.plus(self.three(a.0), inner))
            }
            // ω = −Rᵀ ω
            InverseRotation(r) => three(self.turned_back(r.0, self.three(r.0)).map(negated)),
            RotationOf(f) => three(self.three(f.0)),
            // v = do + o × ω
            Frame(r, o) => {
                let (omega, change) = (self.three(r.0), self.three(o.0));
                let origin = self.lowering.vector(o);
                let moment = self.crossed(omega, origin).map(negated);
                six(omega, self.plus(change, moment))
            }
            // (ω, v) = (ω₁, v₁) + (u, R₁ v₂ + o₁ × u), u = R₁ ω₂
            ComposeFrame(f, g) => {
                let (outer, inner) = (self.of(f.0), self.of(g.0));
                let u = self.turned(f.0, [inner[0], inner[1], inner[2]]);
                let slide = self.turned(f.0, [inner[3], inner[4], inner[5]]);
                let moment = if u.iter().any(Option::is_some) {
                    let origin = self.lowering.origin(f);
                    self.crossed(u, origin).map(negated)
                } else {
                    [None; 3]
                };
                let omega = self.plus([outer[0], outer[1], outer[2]], u);
                let v = self.total(&[[outer[3], outer[4], outer[5]], slide, moment]);
                six(omega, v)
            }
            // (ω, v) = −(Rᵀ ω, Rᵀ (v − o × ω))
            InverseFrame(f) => {
                let change = self.of(f.0);
                let omega = [change[0], change[1], change[2]];
                let origin = self.lowering.origin(f);
                let moment = self.crossed(omega, origin);
                let v = self.plus([change[3], change[4], change[5]], moment);
                let omega = self.turned_back(f.0, omega).map(negated);
                let v = self.turned_back(f.0, v).map(negated);
                six(omega, v)
            }
        }
    }

    /// dexp: ω = (I + c₂ \[v\]× + c₃ \[v\]×²) dv with Stumpff's functions of v·v. Source: Chirikjian, Stochastic Models,
    /// Information Theory, and Lie Groups 2 (2012), §10.6.
    fn exponential(&mut self, v: super::Vector) -> [Change; 3] {
        let change = self.three(v.0);
        let v = self.lowering.vector(v);
        let [c2, c3] = self.lowering.stumpff(v, [2, 3]);
        // \[v\]× dv, and again
        let first = self.crossed(change, v).map(negated);
        let second = self.crossed(first, v).map(negated);
        let first = self.scaled(first, c2);
        let second = self.scaled(second, c3);
        self.total(&[change, first, second])
    }

    /// da × b, where a changes.
    fn crossed(&mut self, da: [Change; 3], b: Triple) -> [Change; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
            let mut terms = self.signed(da[i], b[j]);
            terms.extend(self.signed(da[j].map(|(vertex, sign)| (vertex, opposite(sign))), b[i]));
            self.sum(terms)
        })
    }

    /// v + ω × p: where a twist takes a point.
    fn carried(&mut self, twist: [Change; 6], p: Triple) -> [Change; 3] {
        let turned = self.crossed([twist[0], twist[1], twist[2]], p);
        self.plus([twist[3], twist[4], twist[5]], turned)
    }

    /// R dv, with the rotation of a rotation or frame.
    fn turned(&mut self, r: NodeId, change: [Change; 3]) -> [Change; 3] {
        if change.iter().all(Option::is_none) {
            return [None; 3];
        }
        let m = self.lowering.any_matrix(r);
        [0, 1, 2].map(|i| {
            let terms = (0..3).flat_map(|j| self.signed(change[j], m[j][i])).collect();
            self.sum(terms)
        })
    }

    /// Rᵀ dv
    fn turned_back(&mut self, r: NodeId, change: [Change; 3]) -> [Change; 3] {
        if change.iter().all(Option::is_none) {
            return [None; 3];
        }
        let m = self.lowering.any_matrix(r);
        [0, 1, 2].map(|i| {
            let terms = (0..3).flat_map(|j| self.signed(change[j], m[i][j])).collect();
            self.sum(terms)
        })
    }

    fn scaled(&mut self, change: [Change; 3], s: Scalar) -> [Change; 3] {
        change.map(|change| {
            let terms = self.signed(change, s);
            self.sum(terms)
        })
    }

    fn plus(&mut self, a: [Change; 3], b: [Change; 3]) -> [Change; 3] {
        self.total(&[a, b])
    }

    fn total(&mut self, parts: &[[Change; 3]]) -> [Change; 3] {
        let one = self.lowering.to.constant(1.0);
        [0, 1, 2].map(|i| {
            let terms = parts.iter().flat_map(|part| self.signed(part[i], one)).collect();
            self.sum(terms)
        })
    }

    /// A change times a coefficient, as terms.
    fn signed(&mut self, change: Change, coefficient: Scalar) -> Terms {
        let Some((vertex, sign)) = change else { return Terms::new() };
        if self.lowering.to.value(coefficient) == Some(0.0) {
            return Terms::new();
        }
        let coefficient = match sign {
            Sign::Plus => coefficient,
            Sign::Minus => self.lowering.to.neg(coefficient),
        };
        vec![(vertex, coefficient)]
    }

    /// The sum of terms as one change: a vertex of its own only where it is more than another one, or its opposite.
    fn sum(&mut self, terms: Terms) -> Change {
        match terms.as_slice() {
            [] => None,
            [(vertex, coefficient)] => match self.lowering.to.value(*coefficient) {
                Some(1.0) => Some((*vertex, Sign::Plus)),
                Some(-1.0) => Some((*vertex, Sign::Minus)),
                _ => Some((self.linear.vertex(terms), Sign::Plus)),
            },
            _ => Some((self.linear.vertex(terms), Sign::Plus)),
        }
    }
}

/// Vertices and their coefficients.
type Terms = Vec<(Vertex, Scalar)>;

fn opposite(sign: Sign) -> Sign {
    match sign {
        Sign::Plus => Sign::Minus,
        Sign::Minus => Sign::Plus,
    }
}

fn negated(change: Change) -> Change {
    change.map(|(vertex, sign)| (vertex, opposite(sign)))
}

fn one(change: Change) -> [Change; 6] {
    [change, None, None, None, None, None]
}

fn three([x, y, z]: [Change; 3]) -> [Change; 6] {
    [x, y, z, None, None, None]
}

fn six([a, b, c]: [Change; 3], [x, y, z]: [Change; 3]) -> [Change; 6] {
    [a, b, c, x, y, z]
}
