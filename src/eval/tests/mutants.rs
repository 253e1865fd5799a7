//! Wrong engines, each of which the comparison of [`super::scalars`] must reject.

use super::engine::{Run, compiled};
use super::scalars::{Case, check};
use crate::eval::ROWS;
use crate::graph::{Graph, Node, NodeId, Operation, Scalar, Varies};
use crate::simd::InstructionSet;

/// A program in which every node matters: sums of products with all signs, shared factors, a shared angle, quotients, roots,
/// calls, and outputs that are an input, a duplicate and a negation.
fn program() -> (Graph, Vec<Scalar>) {
    let mut g = Graph::new();
    let [a, b, c] = [0, 1, 2].map(|i| g.parameter(i));
    let [x, y, z] = [0, 1, 2].map(|i| g.input(i));
    let (sin, cos) = (g.unary(Operation::Sin, x), g.unary(Operation::Cos, x));
    let [sy, cy, sb, ca] = [(sin, y), (cos, y), (sin, b), (cos, a)].map(|(s, t)| g.mul(s, t));
    let first = g.sub(ca, sy);
    let second = g.add(sb, cy);
    let third = {
        let (az, xy, minus) = (g.mul(a, z), g.mul(x, y), g.mul(second, z));
        let sum = g.add(az, xy);
        let sum = g.sub(sum, minus);
        g.add(sum, c)
    };
    let minus = g.neg(third);
    let root = {
        let (square, other) = (g.mul(third, third), g.mul(y, y));
        let sum = g.add(square, other);
        g.unary(Operation::Sqrt, sum)
    };
    let quotient = g.div(first, root);
    let angle = g.apply(Operation::Atan2, minus, root);
    let ab = g.mul(a, b);
    let more = g.mul(ab, angle);
    let last = g.add(more, quotient);
    (g, vec![first, second, third, last, minus, y, third])
}

const PARAMETERS: [f64; 3] = [0.7, -1.3, 0.4];

/// So many rows that two blocks are full, and a third has one in its last vector.
fn rows() -> Vec<Vec<f64>> {
    let wave = |n: usize, k: f64| 0.3 + (k * n as f64).sin();
    (0..2 * ROWS + 1).map(|n| vec![wave(n, 0.71), wave(n, 1.13), wave(n, 0.39)]).collect()
}

fn accepted(engine: &dyn Fn(Run<'_>) -> Vec<Vec<f64>>) -> Vec<bool> {
    let (graph, outputs) = program();
    let rows = rows();
    let sets = InstructionSet::available().into_iter();
    sets.map(|set| {
        check(Case { graph: &graph, outputs: &outputs, parameters: &PARAMETERS, rows: &rows, set }, engine).is_ok()
    })
    .collect()
}

#[test]
fn the_engine_itself_is_accepted() {
    assert!(accepted(&compiled).iter().all(|&accepted| accepted));
}

#[test]
fn results_in_wrong_places_are_rejected() {
    type Spoil = fn(&mut Vec<Vec<f64>>);
    let spoils: [(&str, Spoil); 8] = [
        ("the last vector of a block is left out", |rows| {
            rows.iter_mut().enumerate().filter(|(n, _)| n % ROWS >= ROWS - 2).for_each(|(_, row)| row.fill(0.0));
        }),
        ("the last vector of a block is that of the block before", |rows| {
            for n in ROWS..rows.len() {
                if n % ROWS == ROWS - 1 {
                    rows[n] = rows[n - ROWS].clone();
                }
            }
        }),
        ("the first row of a block that is not full is left out", |rows| {
            let last = rows.len() - 1;
            rows[last].fill(0.0);
        }),
        ("rows are shifted by one", |rows| rows.rotate_left(1)),
        ("rows of a vector are the first one's", |rows| {
            for n in 0..rows.len() {
                rows[n] = rows[n - n % 2].clone();
            }
        }),
        ("two outputs are exchanged", |rows| rows.iter_mut().for_each(|row| row.swap(0, 1))),
        ("a duplicate is left out", |rows| rows.iter_mut().for_each(|row| row[6] = 0.0)),
        ("a value is rounded to single precision", |rows| {
            rows.iter_mut().for_each(|row| row[3] = f64::from(row[3] as f32));
        }),
    ];
    for (name, spoil) in spoils {
        let engine = |run: Run<'_>| {
            let mut found = compiled(run);
            spoil(&mut found);
            found
        };
        assert!(accepted(&engine).iter().all(|accepted| !accepted), "{name}");
    }
}

#[test]
fn parameters_of_another_iteration_are_rejected() {
    for k in 0..PARAMETERS.len() {
        let engine = |run: Run<'_>| {
            let mut stale = run.parameters.to_vec();
            stale[k] *= 1.0 + 1e-9;
            compiled(Run { parameters: &stale, ..run })
        };
        assert!(accepted(&engine).iter().all(|accepted| !accepted), "parameter {k}");
    }
}

/// A fault at one node: what is made in its place, if the fault can be there. `earlier` are the nodes that vary with the row
/// made so far.
type Fault = fn(&mut Graph, Node, earlier: &[NodeId]) -> Option<NodeId>;

/// The graph with a fault at one node.
fn faulty(graph: &Graph, at: NodeId, fault: Fault) -> Option<(Graph, Vec<NodeId>)> {
    let mut g = Graph::new();
    let (mut to, mut earlier) = (Vec::with_capacity(graph.len()), Vec::new());
    for id in 0..graph.len() as NodeId {
        let node = graph.node(id).mapped(|old| to[old as usize]);
        let new = if id == at { fault(&mut g, node, &earlier)? } else { g.intern(node) };
        if g.node_varies(new) == Varies::PerRow && matches!(node, Node::Apply(..)) {
            earlier.push(new);
        }
        to.push(new);
    }
    Some((g, to))
}

const FAULTS: [(&str, usize, Fault); 9] = [
    ("the first addend is dropped", 5, |_, node, _| match node {
        Node::Apply(Operation::Add, _, y) => Some(y.0),
        _ => None,
    }),
    ("the second addend is dropped", 7, |_, node, _| match node {
        Node::Apply(Operation::Add | Operation::Sub, x, _) => Some(x.0),
        _ => None,
    }),
    ("a product has the wrong sign", 10, |g, node, _| match node {
        Node::Apply(Operation::Mul, x, y) => {
            let product = g.mul(x, y);
            Some(g.neg(product).0)
        }
        _ => None,
    }),
    ("a uniform is its neighbour", 3, |g, node, _| match node {
        Node::Parameter(index) => Some(g.parameter((index + 1) % 3).0),
        _ => None,
    }),
    ("an input is its neighbour", 3, |g, node, _| match node {
        Node::Input(index) => Some(g.input((index + 1) % 3).0),
        _ => None,
    }),
    ("a slot was freed too early: the first operand is what was computed last", 5, |g, node, earlier| match node {
        Node::Apply(operation, x, y) if operation.row().arity == 2 => {
            let last = earlier.iter().rev().find(|&&last| last != x.0 && last != y.0)?;
            Some(g.apply(operation, Scalar(*last), y).0)
        }
        _ => None,
    }),
    ("sine and cosine are exchanged", 2, |g, node, _| match node {
        Node::Apply(Operation::Sin, x, _) => Some(g.unary(Operation::Cos, x).0),
        Node::Apply(Operation::Cos, x, _) => Some(g.unary(Operation::Sin, x).0),
        _ => None,
    }),
    ("a negation is lost", 1, |_, node, _| match node {
        Node::Apply(Operation::Neg, x, _) => Some(x.0),
        _ => None,
    }),
    ("a factor is off by 1e-12", 10, |g, node, _| match node {
        Node::Apply(Operation::Mul, x, y) => {
            let factor = g.constant(1.0 + 1e-12);
            let product = g.mul(x, y);
            Some(g.mul(factor, product).0)
        }
        _ => None,
    }),
];

#[test]
fn a_fault_at_any_node_is_rejected() {
    let (graph, _) = program();
    for (name, least, fault) in FAULTS {
        let mut places = 0;
        for at in 0..graph.len() as NodeId {
            if faulty(&graph, at, fault).is_none() {
                continue;
            }
            places += 1;
            // the derivatives' graph is another, and stays as it is
            let engine = |run: Run<'_>| match faulty(run.graph, at, fault) {
                Some((wrong, to)) if run.graph.len() == graph.len() => {
                    let outputs: Vec<Scalar> = run.outputs.iter().map(|s| Scalar(to[s.0 as usize])).collect();
                    compiled(Run { graph: &wrong, outputs: &outputs, ..run })
                }
                _ => compiled(run),
            };
            assert!(accepted(&engine).iter().all(|accepted| !accepted), "{name}, at node {at}: {:?}", graph.node(at));
        }
        assert!(places >= least, "{name}: {places} places");
    }
}

#[test]
fn a_fault_at_any_node_of_the_derivatives_is_rejected() {
    let (graph, outputs) = program();
    for (name, _, fault) in FAULTS {
        let (mut places, mut rejected) = (0, 0);
        let length = std::cell::Cell::new(usize::MAX);
        let mut at = 0;
        while at < length.get() as NodeId && at < 2000 {
            let faulted = std::cell::Cell::new(false);
            let engine = |run: Run<'_>| {
                if run.outputs.len() == outputs.len() {
                    return compiled(run);
                }
                length.set(run.graph.len());
                let needed = run.graph.needed(run.outputs)[at as usize];
                match faulty(run.graph, at, fault).filter(|_| needed) {
                    Some((wrong, to)) => {
                        faulted.set(true);
                        let outputs: Vec<Scalar> = run.outputs.iter().map(|s| Scalar(to[s.0 as usize])).collect();
                        compiled(Run { graph: &wrong, outputs: &outputs, ..run })
                    }
                    None => compiled(run),
                }
            };
            let rows = &rows()[..3];
            let set = InstructionSet::detect();
            let case = Case { graph: &graph, outputs: &outputs, parameters: &PARAMETERS, rows, set };
            let fine = check(case, &engine).is_ok();
            if faulted.get() {
                places += 1;
                rejected += usize::from(!fine);
                assert!(!fine, "{name}, at node {at}");
            }
            at += 1;
        }
        assert!(places > 0 && rejected == places, "{name}: {rejected} of {places}");
    }
}

#[test]
fn outputs_that_are_opposites_of_each_other_keep_their_signs() {
    // f = −xy − xz is computed as xy + xz
    let mut g = Graph::new();
    let [x, y, z] = [0, 1, 2].map(|i| g.input(i));
    let (first, second) = (g.mul(x, y), g.mul(x, z));
    let minus = g.neg(first);
    let f = g.sub(minus, second);
    let opposite = g.neg(f);
    let rows = [vec![2.0, 3.0, 5.0]];
    for set in InstructionSet::available() {
        for outputs in [[opposite, f, opposite, f], [f, opposite, f, opposite]] {
            let found = compiled(Run { set, graph: &g, outputs: &outputs, parameters: &[], rows: &rows });
            let expected = outputs.map(|output| if output == f { -16.0 } else { 16.0 });
            assert_eq!(found[0], expected, "{}", set.name());
        }
    }
}
