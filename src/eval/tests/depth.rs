//! Long chains and deep graphs.

use std::time::{Duration, Instant};

use super::engine::{Run, compiled};
use crate::eval::Compiled;
use crate::graph::{Axis, Frame, Graph, Operation, Scalar, Tape, View, differentiate};
use crate::simd::InstructionSet;

/// The origin of a chain of joints, each with four parameters and an input, and all parameters.
fn chain(joints: u32, right: bool) -> (Graph, Vec<Scalar>, Vec<Scalar>) {
    let mut g = Graph::new();
    let zero = g.constant(0.0);
    let mut leaves = Vec::new();
    let frames: Vec<Frame> = (0..joints)
        .map(|k| {
            let link = [0, 1, 2, 3].map(|i| g.parameter(4 * k + i));
            leaves.extend(link);
            let angle = g.input(k);
            g.phi_joint(angle, zero, link)
        })
        .collect();
    let all = if right {
        frames.into_iter().rev().reduce(|after, f| g.compose_frame(f, after))
    } else {
        frames.into_iter().reduce(|before, f| g.compose_frame(before, f))
    };
    let origin = g.origin(all.expect("a joint"));
    let outputs = Axis::ALL.map(|axis| g.component(origin, axis)).to_vec();
    (g, outputs, leaves)
}

#[test]
fn operations_of_a_chain_grow_with_its_joints_and_no_faster() {
    for right in [false, true] {
        let count = |joints: u32| {
            let (g, outputs, leaves) = chain(joints, right);
            let derived = differentiate(&g, &outputs, &leaves, &View::default());
            let wanted = [derived.values, derived.derivatives].concat();
            Compiled::new(&derived.graph, &wanted, InstructionSet::Baseline).counts().per_row
        };
        let counts: Vec<(u32, usize)> = [2, 3, 5, 8, 13, 20, 30, 40].map(|joints| (joints, count(joints))).to_vec();
        // each further joint has a matrix, an origin and 3·4 derivatives
        let per_joint = |from: (u32, usize), to: (u32, usize)| (to.1 - from.1) as f64 / f64::from(to.0 - from.0);
        let least = per_joint(counts[1], counts[2]);
        for pair in counts.windows(2) {
            assert!(per_joint(pair[0], pair[1]) < 1.2 * least + 4.0, "{counts:?}");
        }
        assert!(least < 120.0, "{counts:?}");
    }
}

#[test]
fn a_long_chain_has_the_derivatives_of_dual_numbers() {
    use crate::eval::{Evaluator, Leaf};
    for (joints, right) in [(2, false), (40, false), (40, true)] {
        let (g, outputs, leaves) = chain(joints, right);
        let derived = differentiate(&g, &outputs, &leaves, &View::default());
        let wanted = [derived.values, derived.derivatives].concat();
        let parameters: Vec<f64> = (0..leaves.len()).map(|i| (0.7 * i as f64).sin()).collect();
        let row: Vec<f64> = (0..joints).map(|i| f64::from(i).cos()).collect();
        let tape = Tape::lower(&g, &outputs);
        let mut evaluator = Evaluator::new(&tape, (0..leaves.len()).map(Leaf::Parameter).collect());
        let (mut value, mut derivative) = (vec![0.0; 3], vec![0.0; 3 * leaves.len()]);
        evaluator.begin(&parameters);
        evaluator.row(&row, &mut value, &mut derivative);
        let expected = [value, derivative].concat();
        let rows = [row];
        for set in InstructionSet::available() {
            let found =
                compiled(Run { set, graph: &derived.graph, outputs: &wanted, parameters: &parameters, rows: &rows });
            for (found, expected) in found[0].iter().zip(&expected) {
                assert!(super::compare::agree(*found, *expected, 1e-11), "{found} {expected}");
            }
        }
    }
}

/// Σ p sin(x + i/1000), one term upon the other.
fn sum(terms: u32) -> (Graph, Scalar, Vec<Scalar>) {
    let mut g = Graph::new();
    let (p, x) = (g.parameter(0), g.input(0));
    let mut sum = g.constant(0.0);
    for i in 0..terms {
        let shift = g.constant(f64::from(i) * 1e-3);
        let angle = g.add(x, shift);
        let sine = g.unary(Operation::Sin, angle);
        let term = g.mul(p, sine);
        sum = g.add(sum, term);
    }
    (g, sum, vec![p, x])
}

/// sin(x + sin(x + sin(x + …))): each upon the one before.
fn tower(height: u32) -> (Graph, Scalar, Vec<Scalar>) {
    let mut g = Graph::new();
    let (p, x) = (g.parameter(0), g.input(0));
    let mut f = g.mul(p, x);
    for _ in 0..height {
        let (half, inner) = (g.constant(0.5), g.unary(Operation::Sin, f));
        let inner = g.mul(half, inner);
        f = g.add(inner, x);
    }
    (g, f, vec![p, x])
}

#[test]
fn a_graph_as_deep_as_100_000_operations_needs_neither_stack_nor_patience() {
    for make in [sum, tower] {
        let (g, f, leaves) = make(33_334);
        let begun = Instant::now();
        let expected = {
            let tape = Tape::lower(&g, &[f]);
            let [p, x] = [0.9, 0.3].map(num_dual::Dual64::from);
            [tape.evaluate(&[p.derivative()], &[x])[0], tape.evaluate(&[p], &[x.derivative()])[0]]
        };
        let derived = differentiate(&g, &[f], &leaves, &View::default());
        let wanted = [derived.values, derived.derivatives].concat();
        let rows = [vec![0.3]];
        for set in InstructionSet::available() {
            let found = compiled(Run { set, graph: &derived.graph, outputs: &wanted, parameters: &[0.9], rows: &rows });
            for (found, expected) in found[0].iter().zip([expected[0].re, expected[0].eps, expected[1].eps]) {
                assert!(super::compare::agree(*found, expected, 1e-10 * (1.0 + expected.abs())), "{found} {expected}");
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "{:?}", begun.elapsed());
    }
}
