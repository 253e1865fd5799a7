//! Rules against numbers: what is simplified has the value of what was meant, and derivatives are those of dual numbers.

use proptest::prelude::*;

use super::algebra::Algebra;
use super::differential::{Change, differential, unit};
use super::rebuild::rebuilt;
use crate::eval::tests::frames::{check, dual, leaves};
use crate::eval::tests::random_frames::{build, genes, point};
use crate::graph::{Axis, Derived, Frame, Graph, Node, NodeId, Rotation, Scalar, Tape, Vector, View, differentiate};
use crate::simd::InstructionSet;

/// Values and derivatives by all leaves, as geometry, lowered at the end.
fn symbolic(graph: &Graph, outputs: &[Scalar], leaves: &[Scalar]) -> (Graph, Vec<Scalar>, Vec<Scalar>) {
    let wanted: Vec<NodeId> = outputs.iter().chain(leaves).map(|s| s.0).collect();
    let (mut graph, to) = rebuilt(graph, &wanted, &[]);
    let values: Vec<Scalar> = outputs.iter().map(|s| Scalar(to[&s.0])).collect();
    let roots: Vec<NodeId> = values.iter().map(|s| s.0).collect();
    let mut derivatives = vec![graph.constant(0.0); outputs.len() * leaves.len()];
    for (k, leaf) in leaves.iter().enumerate() {
        let seed = unit(&mut graph, Scalar(to[&leaf.0]));
        let changes = differential(&mut graph, &roots, &[seed], &|_| false);
        for (i, value) in values.iter().enumerate() {
            if let Some(Change::Scalar(change)) = changes.get(&value.0) {
                derivatives[i * leaves.len() + k] = *change;
            }
        }
    }
    (graph, values, derivatives)
}

fn lowered(graph: &Graph, values: &[Scalar], derivatives: &[Scalar]) -> Derived {
    let all = [values, derivatives].concat();
    let flat = differentiate(graph, &all, &[], &View::default());
    let (values, derivatives) = flat.values.split_at(values.len());
    Derived { graph: flat.graph, values: values.to_vec(), derivatives: derivatives.to_vec() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn derivatives_as_geometry_are_those_of_dual_numbers(genes in genes(), (parameters, rows) in point()) {
        let (mut graph, outputs) = build(&genes);
        let leaves = leaves(&mut graph);
        let by_row: Vec<(Vec<f64>, Vec<f64>)> = rows.iter().map(|row| (parameters.clone(), row.clone())).collect();
        let reference = dual(&graph, &outputs, &by_row);
        let (graph, values, derivatives) = symbolic(&graph, &outputs, &leaves);
        let derived = lowered(&graph, &values, &derivatives);
        let result = check(&derived, &reference, &parameters, &rows, InstructionSet::Baseline);
        prop_assert!(result.is_ok(), "{:?}", result);
    }
}

/// Things to apply rules to, and how a rule is applied with the algebra or without.
struct Things {
    s: Scalar,
    t: Scalar,
    a: Vector,
    b: Vector,
    r: Rotation,
    q: Rotation,
    f: Frame,
    g: Frame,
}

fn things(g: &mut Graph) -> Things {
    let p: Vec<Scalar> = (0..12).map(|i| g.parameter(i)).collect();
    let (a, b) = (g.vector(p[0], p[1], p[2]), g.vector(p[3], p[4], p[5]));
    let (r, q) = (g.exp_rotation(a), g.exp_rotation(b));
    let (f, h) = (g.frame(r, b), g.frame(q, a));
    Things { s: p[6], t: p[7], a, b, r, q, f, g: h }
}

/// The same without any rule.
struct Plain<'g> {
    graph: &'g mut Graph,
}

macro_rules! plain {
    ($($name:ident($($argument:ident: $shape:ty),*) -> $made:ty;)*) => {
        impl Plain<'_> {
            $(fn $name(&mut self, $($argument: $shape),*) -> $made { self.graph.$name($($argument),*) })*

            fn neg(&mut self, v: Vector) -> Vector {
                let minus = self.graph.constant(-1.0);
                self.graph.scale(minus, v)
            }

            fn axis(&mut self, axis: Axis) -> Vector {
                let mut numbers = [0.0; 3];
                numbers[axis.index()] = 1.0;
                self.graph.constant_vector(numbers)
            }

            fn zero(&mut self) -> Vector {
                self.graph.constant_vector([0.0; 3])
            }
        }
    };
}

plain! {
    mul(x: Scalar, y: Scalar) -> Scalar;
    scale(s: Scalar, v: Vector) -> Vector;
    add_vector(a: Vector, b: Vector) -> Vector;
    sub_vector(a: Vector, b: Vector) -> Vector;
    dot(a: Vector, b: Vector) -> Scalar;
    cross(a: Vector, b: Vector) -> Vector;
    component(v: Vector, axis: Axis) -> Scalar;
    rotate(r: Rotation, v: Vector) -> Vector;
    column(r: Rotation, axis: Axis) -> Vector;
    compose_rotation(r: Rotation, s: Rotation) -> Rotation;
    inverse_rotation(r: Rotation) -> Rotation;
    compose_frame(f: Frame, g: Frame) -> Frame;
    rotation_of(f: Frame) -> Rotation;
    origin(f: Frame) -> Vector;
    transform(f: Frame, p: Vector) -> Vector;
}

type Rule = (&'static str, fn(&mut Algebra, &Things) -> NodeId, fn(&mut Plain, &Things) -> NodeId);

macro_rules! rules {
    ($($name:literal |$m:ident, $x:ident| $($step:ident = $value:expr),* => $body:expr;)*) => {
        /// Each rule: its name, what it is applied to, and the same made without it.
        const RULES: &[Rule] = &[$((
            $name,
            |$m: &mut Algebra, $x: &Things| { $(let $step = $value;)* let _ = $x; $body.0 },
            |$m: &mut Plain, $x: &Things| { $(let $step = $value;)* let _ = $x; $body.0 },
        ),)*];
    };
}

rules! {
    "2 (3 s)" |m, x| two = m.graph.constant(2.0), three = m.graph.constant(3.0), v = m.mul(three, x.s) => m.mul(two, v);
    "0 v" |m, x| zero = m.graph.constant(0.0) => m.scale(zero, x.a);
    "s (t v)" |m, x| v = m.scale(x.t, x.a) => m.scale(x.s, v);
    "-(a - b)" |m, x| v = m.sub_vector(x.a, x.b) => m.neg(v);
    "a + a" |m, x| => m.add_vector(x.a, x.a);
    "a + 0" |m, x| zero = m.zero() => m.add_vector(x.a, zero);
    "0 + a" |m, x| zero = m.zero() => m.add_vector(zero, x.a);
    "a - 0" |m, x| zero = m.zero() => m.sub_vector(x.a, zero);
    "a + (-b)" |m, x| v = m.neg(x.b) => m.add_vector(x.a, v);
    "-a + b" |m, x| v = m.neg(x.a) => m.add_vector(v, x.b);
    "a - (-b)" |m, x| v = m.neg(x.b) => m.sub_vector(x.a, v);
    "0 - b" |m, x| zero = m.zero() => m.sub_vector(zero, x.b);
    "a - a" |m, x| => m.sub_vector(x.a, x.a);
    "(s a).b" |m, x| v = m.scale(x.s, x.a) => m.dot(v, x.b);
    "b.(s a)" |m, x| v = m.scale(x.s, x.a) => m.dot(x.b, v);
    "e.b" |m, x| v = m.axis(Axis::Y) => m.dot(v, x.b);
    "(-e).b" |m, x| v = m.axis(Axis::Y), v = m.neg(v) => m.dot(v, x.b);
    "a.(a x b)" |m, x| v = m.graph.cross(x.a, x.b) => m.dot(x.a, v);
    "columns are orthogonal" |m, x| u = m.column(x.r, Axis::X), v = m.column(x.r, Axis::Z) => m.dot(u, v);
    "columns are of length one" |m, x| u = m.column(x.r, Axis::Y) => m.dot(u, u);
    "a x a" |m, x| => m.cross(x.a, x.a);
    "(s a) x b" |m, x| v = m.scale(x.s, x.a) => m.cross(v, x.b);
    "a x (s b)" |m, x| v = m.scale(x.s, x.b) => m.cross(x.a, v);
    "Rx x Ry" |m, x| u = m.column(x.r, Axis::X), v = m.column(x.r, Axis::Y) => m.cross(u, v);
    "Rx x Rz" |m, x| u = m.column(x.r, Axis::X), v = m.column(x.r, Axis::Z) => m.cross(u, v);
    "Rz x Ry" |m, x| u = m.column(x.r, Axis::Z), v = m.column(x.r, Axis::Y) => m.cross(u, v);
    "-ey x ez" |m, x| u = m.axis(Axis::Y), u = m.neg(u), v = m.axis(Axis::Z) => m.cross(u, v);
    "component of s v" |m, x| v = m.scale(x.s, x.a), v = m.add_vector(v, x.b), v = m.scale(x.t, v) => m.component(v, Axis::Z);
    "component of a - e" |m, x| v = m.axis(Axis::Y), v = m.sub_vector(x.a, v) => m.component(v, Axis::Y);
    "component of a + e" |m, x| v = m.axis(Axis::Y), v = m.add_vector(x.a, v) => m.component(v, Axis::Y);
    "R 0" |m, x| zero = m.zero() => m.rotate(x.r, zero);
    "R (s v)" |m, x| v = m.scale(x.s, x.b) => m.rotate(x.r, v);
    "R e" |m, x| v = m.axis(Axis::Z) => m.rotate(x.r, v);
    "R (-e)" |m, x| v = m.axis(Axis::Z), v = m.neg(v) => m.rotate(x.r, v);
    "R (S e)" |m, x| v = m.column(x.q, Axis::X) => m.rotate(x.r, v);
    "R (S v)" |m, x| v = m.graph.rotate(x.q, x.a) => m.rotate(x.r, v);
    "a turn leaves its axis" |m, x| turn = m.graph.turn(Axis::Y, x.s), both = m.compose_rotation(x.r, turn) => m.column(both, Axis::Y);
    "R (S T)" |m, x| turn = m.graph.turn(Axis::X, x.t), inner = m.graph.compose_rotation(x.q, turn), all = m.compose_rotation(x.r, inner) => m.rotate(all, x.a);
    "(R S)^-1" |m, x| both = m.compose_rotation(x.r, x.q), back = m.inverse_rotation(both) => m.rotate(back, x.a);
    "F (G H)" |m, x| h = m.graph.screw(Axis::X, x.s, x.t), inner = m.graph.compose_frame(x.g, h), all = m.compose_frame(x.f, inner) => m.origin(all);
    "(F G).r" |m, x| both = m.compose_frame(x.f, x.g), r = m.rotation_of(both) => m.rotate(r, x.a);
    "(F^-1).r" |m, x| both = m.compose_frame(x.f, x.g), back = m.graph.inverse_frame(both), r = m.rotation_of(back) => m.rotate(r, x.a);
    "(F G).o where G.o = 0" |m, x| zero = m.graph.constant(0.0), turn = m.graph.screw(Axis::X, x.s, zero), both = m.graph.compose_frame(x.g, turn) => m.origin(both);
    "F (0)" |m, x| zero = m.zero() => m.transform(x.f, zero);
    "F (G.o)" |m, x| both = m.compose_frame(x.g, x.f), o = m.origin(both) => m.transform(x.f, o);
    "F (G p)" |m, x| p = m.graph.transform(x.g, x.b) => m.transform(x.f, p);
}

#[test]
fn every_rule_keeps_the_value() {
    let point: Vec<f64> = (0..12).map(|i| 0.3 + 0.37 * f64::from(i) - 0.05 * f64::from(i * i)).collect();
    for (name, simplified, plain) in RULES {
        let mut g = Graph::new();
        let x = things(&mut g);
        let one = plain(&mut Plain { graph: &mut g }, &x);
        let other = simplified(&mut Algebra { graph: &mut g }, &x);
        assert_ne!(one, other, "{name}: the rule does nothing");
        let mut components = |id: NodeId| -> Vec<Scalar> {
            match g.node(id) {
                Node::Constant(_) | Node::Parameter(_) | Node::Apply(..) | Node::Component(..) | Node::Dot(..) => {
                    vec![Scalar(id)]
                }
                _ => Axis::ALL.map(|axis| g.component(Vector(id), axis)).to_vec(),
            }
        };
        let (one, other) = (components(one), components(other));
        let all = Tape::lower(&g, &[one.clone(), other].concat()).evaluate(&point, &[]);
        let (expected, found) = all.split_at(one.len());
        for (expected, found) in expected.iter().zip(found) {
            assert!((expected - found).abs() < 1e-13 * (1.0 + expected.abs()), "{name}: {found} instead of {expected}");
        }
    }
}
