//! The change of vectors and frames as vectors and frames: derivatives that keep the geometry of what they are derivatives of.
//!
//! The engine reduces the same rules to scalars while it applies them ([`crate::graph::differentiate`]); here they make nodes.
//! A rigid motion changes by *screws*: turns ω about a point c with a slide t, dR = \[ω\]× R and do = t + ω × (o − c). Source: Murray,
//! Li & Sastry, A Mathematical Introduction to Robotic Manipulation (1994), §2.4.

use std::collections::{HashMap, HashSet};

use super::algebra::Algebra;
use crate::graph::{Axis, Graph, Node, NodeId, Operation, Rotation, Scalar, Vector};

/// A turn about a point, and a slide, of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Screw {
    /// ω, and the point c that it leaves
    pub(crate) turn: Option<(Vector, Vector)>,
    /// t
    pub(crate) slide: Option<Vector>,
}

/// How a node changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    Scalar(Scalar),
    Vector(Vector),
    /// ω of dR = \[ω\]× R
    Rotation(Vector),
    /// one screw after the other
    Frame(Vec<Screw>),
}

/// The changes of nodes and of all that they need, where there are any, from those of some nodes. Where a formula may be written
/// with one of several points, it is one that is `known` by a name.
pub(crate) fn differential(
    graph: &mut Graph,
    wanted: &[NodeId],
    seeds: &[(NodeId, Change)],
    known: &dyn Fn(NodeId) -> bool,
) -> HashMap<NodeId, Change> {
    let mut changes: HashMap<NodeId, Change> = seeds.iter().cloned().collect();
    let mut needed: HashSet<NodeId> = HashSet::new();
    let mut waiting = wanted.to_vec();
    while let Some(id) = waiting.pop() {
        if !changes.contains_key(&id) && needed.insert(id) {
            graph.node(id).operands(|operand| waiting.push(operand));
        }
    }
    let mut order: Vec<NodeId> = needed.into_iter().collect();
    order.sort_unstable();
    let mut rules = Rules { algebra: Algebra { graph }, changes, known };
    for id in order {
        if let Some(change) = rules.node(id) {
            rules.changes.insert(id, change);
        }
    }
    changes = rules.changes;
    changes
}

struct Rules<'g> {
    algebra: Algebra<'g>,
    changes: HashMap<NodeId, Change>,
    known: &'g dyn Fn(NodeId) -> bool,
}

impl Rules<'_> {
    fn scalar(&self, s: Scalar) -> Option<Scalar> {
        match self.changes.get(&s.0) {
            Some(Change::Scalar(change)) => Some(*change),
            _ => None,
        }
    }

    fn vector(&self, v: Vector) -> Option<Vector> {
        match self.changes.get(&v.0) {
            Some(Change::Vector(change)) => Some(*change),
            _ => None,
        }
    }

    fn turn(&self, r: Rotation) -> Option<Vector> {
        match self.changes.get(&r.0) {
            Some(Change::Rotation(omega)) => Some(*omega),
            _ => None,
        }
    }

    fn screws(&self, id: NodeId) -> Vec<Screw> {
        match self.changes.get(&id) {
            Some(Change::Frame(screws)) => screws.clone(),
            _ => Vec::new(),
        }
    }

    fn sum(&mut self, terms: impl IntoIterator<Item = Option<Vector>>) -> Option<Vector> {
        let sum = terms.into_iter().flatten().reduce(|a, b| self.algebra.add_vector(a, b))?;
        (!self.algebra.is_zero(sum)).then_some(sum)
    }

    fn scalar_sum(&mut self, terms: impl IntoIterator<Item = Option<Scalar>>) -> Option<Scalar> {
        let sum = terms.into_iter().flatten().reduce(|a, b| self.algebra.graph.add(a, b))?;
        (self.algebra.graph.value(sum) != Some(0.0)).then_some(sum)
    }

    /// Whether a frame turns about a coordinate axis and slides along it alone: then the axis goes through where it begins and
    /// where it ends.
    fn slides_along_its_axis(&self, frame: NodeId) -> bool {
        let Node::Frame(r, o) = self.algebra.node(frame) else { return false };
        let (Node::Turn(axis, _), Node::Vector(x, y, z)) = (self.algebra.node(r.0), self.algebra.node(o.0)) else {
            return false;
        };
        let beside = [x, y, z].into_iter().zip(Axis::ALL).filter(|(_, other)| *other != axis);
        beside.into_iter().all(|(s, _)| self.algebra.graph.value(s) == Some(0.0))
    }

    /// Where screws take a point of the body: Σ t + ω × (p − c).
    fn carried(&mut self, screws: &[Screw], p: Vector) -> Option<Vector> {
        let mut terms = Vec::new();
        for screw in screws {
            terms.push(screw.slide);
            if let Some((omega, about)) = screw.turn {
                let arm = self.algebra.sub_vector(p, about);
                terms.push(Some(self.algebra.cross(omega, arm)));
            }
        }
        self.sum(terms)
    }

    /// The change of a node; its operands' are known.
    fn node(&mut self, id: NodeId) -> Option<Change> {
        use Node::*;
        let node = self.algebra.node(id);
        let mut active = false;
        node.operands(|operand| active |= self.changes.contains_key(&operand));
        if !active {
            return None;
        }
        match node {
            Constant(_) | Parameter(_) | Input(_) | NoRotation => None,
            Apply(operation, x, y) => self.apply(operation, x, y, Scalar(id)).map(Change::Scalar),
            Component(v, axis) => {
                let change = self.vector(v)?;
                self.nonzero(|algebra| algebra.component(change, axis))
            }
            Dot(a, b) if a == b => {
                // d(a·a) = 2 a·da
                let change = self.vector(a)?;
                let two = self.algebra.graph.constant(2.0);
                self.nonzero(|algebra| {
                    let product = algebra.dot(a, change);
                    algebra.mul(two, product)
                })
            }
            Dot(a, b) => {
                // d(a·b) = da·b + a·db
                let (da, db) = (self.vector(a), self.vector(b));
                let terms = [da.map(|da| self.algebra.dot(da, b)), db.map(|db| self.algebra.dot(a, db))];
                self.scalar_sum(terms).map(Change::Scalar)
            }
            Vector(x, y, z) => {
                let zero = self.algebra.graph.constant(0.0);
                let [x, y, z] = [x, y, z].map(|s| self.scalar(s).unwrap_or(zero));
                Some(Change::Vector(self.algebra.vector(x, y, z)))
            }
            AddVector(a, b) => self.sum([self.vector(a), self.vector(b)]).map(Change::Vector),
            SubVector(a, b) => {
                let (da, db) = (self.vector(a), self.vector(b));
                let minus = db.map(|db| self.algebra.neg(db));
                self.sum([da, minus]).map(Change::Vector)
            }
            Scale(s, v) => {
                // d(s v) = ds v + s dv
                let (ds, dv) = (self.scalar(s), self.vector(v));
                let terms = [ds.map(|ds| self.algebra.scale(ds, v)), dv.map(|dv| self.algebra.scale(s, dv))];
                self.sum(terms).map(Change::Vector)
            }
            Cross(a, b) => {
                // d(a × b) = da × b + a × db
                let (da, db) = (self.vector(a), self.vector(b));
                let terms = [da.map(|da| self.algebra.cross(da, b)), db.map(|db| self.algebra.cross(a, db))];
                self.sum(terms).map(Change::Vector)
            }
            Rotate(r, v) => {
                // d(R v) = ω × R v + R dv
                let (omega, dv) = (self.turn(r), self.vector(v));
                let value = crate::graph::Vector(id);
                let terms =
                    [omega.map(|omega| self.algebra.cross(omega, value)), dv.map(|dv| self.algebra.rotate(r, dv))];
                self.sum(terms).map(Change::Vector)
            }
            Column(r, _) => {
                let omega = self.turn(r)?;
                let change = self.algebra.cross(omega, crate::graph::Vector(id));
                self.sum([Some(change)]).map(Change::Vector)
            }
            Origin(f) => {
                let screws = self.screws(f.0);
                self.carried(&screws, crate::graph::Vector(id)).map(Change::Vector)
            }
            Transform(f, p) => {
                // d(R p + o) = Σ t + ω × (R p + o − c) + R dp
                let screws = self.screws(f.0);
                let carried = self.carried(&screws, crate::graph::Vector(id));
                let r = self.algebra.rotation_of(f);
                let inner = self.vector(p).map(|dp| self.algebra.rotate(r, dp));
                self.sum([carried, inner]).map(Change::Vector)
            }
            Turn(axis, angle) => {
                let change = self.scalar(angle)?;
                let axis = self.algebra.axis(axis);
                Some(Change::Rotation(self.algebra.scale(change, axis)))
            }
            ExpRotation(v) => self.exponential(v).map(Change::Rotation),
            Columns(x, y, z) => {
                // ω = ½ Σ c × dc over the columns c
                let half = self.algebra.graph.constant(0.5);
                let turned = [x, y, z].map(|column| {
                    let change = self.vector(column)?;
                    let turned = self.algebra.cross(column, change);
                    Some(self.algebra.scale(half, turned))
                });
                self.sum(turned).map(Change::Rotation)
            }
            ComposeRotation(a, b) => {
                // ω = ω₁ + R₁ ω₂
                let (outer, inner) = (self.turn(a), self.turn(b));
                let inner = inner.map(|omega| self.algebra.rotate(a, omega));
                self.sum([outer, inner]).map(Change::Rotation)
            }
            InverseRotation(r) => {
                // ω = −Rᵀ ω
                let omega = self.turn(r)?;
                let back = self.algebra.inverse_rotation(r);
                let turned = self.algebra.rotate(back, omega);
                Some(Change::Rotation(self.algebra.neg(turned)))
            }
            RotationOf(f) => {
                let turns: Vec<_> = self.screws(f.0).iter().map(|screw| screw.turn.map(|(omega, _)| omega)).collect();
                self.sum(turns).map(Change::Rotation)
            }
            Frame(r, o) => {
                let screw = Screw { turn: self.turn(r).map(|omega| (omega, o)), slide: self.vector(o) };
                Some(Change::Frame(vec![screw]))
            }
            ComposeFrame(f, g) => {
                // those of G as seen from where F stands
                let r = self.algebra.rotation_of(f);
                let mut all = self.screws(f.0);
                let along = self.slides_along_its_axis(g.0);
                for screw in self.screws(g.0) {
                    let turn = screw.turn.map(|(omega, about)| {
                        let turned = self.algebra.rotate(r, omega);
                        let ends = [self.algebra.origin(f), self.algebra.origin(crate::graph::Frame(id))];
                        match ends.into_iter().find(|end| along && (self.known)(end.0)) {
                            Some(end) => (turned, end),
                            None if along => (turned, ends[0]),
                            None => (turned, self.algebra.transform(f, about)),
                        }
                    });
                    all.push(Screw { turn, slide: screw.slide.map(|t| self.algebra.rotate(r, t)) });
                }
                Some(Change::Frame(all))
            }
            InverseFrame(f) => {
                // F⁻¹ changes by the screws of F backwards, as seen from F
                let inverse = crate::graph::Frame(id);
                let r = self.algebra.rotation_of(inverse);
                let mut all = Vec::new();
                for screw in self.screws(f.0) {
                    let turn = screw.turn.map(|(omega, about)| {
                        let turned = self.algebra.rotate(r, omega);
                        (self.algebra.neg(turned), self.algebra.transform(inverse, about))
                    });
                    let slide = screw.slide.map(|t| {
                        let turned = self.algebra.rotate(r, t);
                        self.algebra.neg(turned)
                    });
                    all.push(Screw { turn, slide });
                }
                Some(Change::Frame(all))
            }
        }
    }

    fn nonzero(&mut self, make: impl FnOnce(&mut Algebra) -> Scalar) -> Option<Change> {
        let change = make(&mut self.algebra);
        (self.algebra.graph.value(change) != Some(0.0)).then_some(Change::Scalar(change))
    }

    /// d f(x, y) = ∂f/∂x dx + ∂f/∂y dy, as one would write it.
    fn apply(&mut self, operation: Operation, x: Scalar, y: Scalar, f: Scalar) -> Option<Scalar> {
        let (dx, dy) = (self.scalar(x), self.scalar(y));
        match operation {
            Operation::Mul if x == y => {
                // d(x²) = 2 x dx
                let two = self.algebra.graph.constant(2.0);
                let twice = self.algebra.mul(two, x);
                dx.map(|dx| self.algebra.mul(twice, dx))
            }
            Operation::Sub => match (dx, dy) {
                (Some(dx), Some(dy)) => Some(self.algebra.graph.sub(dx, dy)),
                (dx, dy) => dx.or(dy.map(|dy| self.algebra.graph.neg(dy))),
            },
            Operation::Div => {
                // d(x/y) = (dx − f dy)/y
                let zero = self.algebra.graph.constant(0.0);
                let second = dy.map(|dy| self.algebra.mul(f, dy)).unwrap_or(zero);
                let numerator = self.algebra.graph.sub(dx.unwrap_or(zero), second);
                Some(self.algebra.graph.div(numerator, y))
            }
            Operation::Sqrt => {
                // d√x = dx/(2 √x)
                let two = self.algebra.graph.constant(2.0);
                let twice = self.algebra.mul(two, f);
                dx.map(|dx| self.algebra.graph.div(dx, twice))
            }
            Operation::Log => dx.map(|dx| self.algebra.graph.div(dx, x)),
            Operation::Atan2 => {
                // d atan2(y, x) = (x dy − y dx)/(x² + y²); the first argument is y
                let (y, x, dy, dx) = (x, y, dx, dy);
                let first = dy.map(|dy| self.algebra.mul(x, dy));
                let second = dx.map(|dx| self.algebra.mul(y, dx));
                let second = second.map(|term| self.algebra.graph.neg(term));
                let numerator = self.scalar_sum([first, second])?;
                let (xx, yy) = (self.algebra.mul(x, x), self.algebra.mul(y, y));
                let square = self.algebra.graph.add(xx, yy);
                Some(self.algebra.graph.div(numerator, square))
            }
            _ => {
                let [by_x, by_y] = operation.partials(self.algebra.graph, x, y, f);
                let first = dx.map(|dx| self.algebra.mul(by_x, dx));
                let second = dy.filter(|_| operation.row().arity == 2);
                let second = second.map(|dy| self.algebra.mul(by_y, dy));
                return self.scalar_sum([first, second]);
            }
        }
        .filter(|change| self.algebra.graph.value(*change) != Some(0.0))
    }

    /// dexp: ω = dv + c₂ v × dv + c₃ v × (v × dv) with Stumpff's functions of v·v. Source: Chirikjian, Stochastic Models, Information
    /// Theory, and Lie Groups 2 (2012), §10.6.
    fn exponential(&mut self, v: Vector) -> Option<Vector> {
        let change = self.vector(v)?;
        let square = self.algebra.dot(v, v);
        let mut stumpff = |k: f64| {
            let k = self.algebra.graph.constant(k);
            self.algebra.graph.apply(Operation::Stumpff, square, k)
        };
        let (c2, c3) = (stumpff(2.0), stumpff(3.0));
        let first = self.algebra.cross(v, change);
        let second = self.algebra.cross(v, first);
        let terms = [change, self.algebra.scale(c2, first), self.algebra.scale(c3, second)];
        self.sum(terms.map(Some))
    }
}

/// The changes of a parameter or input: one.
pub(crate) fn unit(graph: &mut Graph, leaf: Scalar) -> (NodeId, Change) {
    (leaf.0, Change::Scalar(graph.constant(1.0)))
}

/// The axis after which a component is named.
pub(crate) fn suffix(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
    }
}
