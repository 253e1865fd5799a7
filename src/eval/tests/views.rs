//! Gathered parameters, parameters that are zero, and weights.

use proptest::prelude::*;

use super::frames::{Reference, check, dual, leaves};
use super::random_frames::{INPUTS, PARAMETERS, build, genes, point};
use crate::graph::{Graph, Tape, View, differentiate};
use crate::simd::InstructionSet;

/// Parameters that each row gets from inputs behind its own.
const GATHERED: [(u32, u32); 2] = [(1, INPUTS as u32), (3, INPUTS as u32 + 1)];
const ZEROS: [u32; 3] = [4, 5, 6];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_view_changes_where_parameters_come_from_and_nothing_else(
        genes in genes(), (parameters, rows) in point(), members in prop::array::uniform4(-1.5f64..1.5),
        weights in prop::collection::vec(-3.0f64..3.0, 20), weighted: bool,
    ) {
        let (mut graph, outputs) = build(&genes);
        let leaves = leaves(&mut graph);
        let weights = if weighted { weights[..outputs.len()].to_vec() } else { Vec::new() };
        let view = View { gathered: GATHERED.to_vec(), zeros: ZEROS.to_vec(), weights: weights.clone(), ..View::default() };
        let derived = differentiate(&graph, &outputs, &leaves, &view);

        // what the view says, said by the numbers
        let (mut seen, mut by_row) = (Vec::new(), Vec::new());
        for (n, row) in rows.iter().enumerate() {
            let own = &members[2 * n..2 * n + 2];
            seen.push([row.as_slice(), own].concat());
            let mut parameters = parameters.clone();
            ZEROS.iter().for_each(|&k| parameters[k as usize] = 0.0);
            GATHERED.iter().zip(own).for_each(|((k, _), &value)| parameters[*k as usize] = value);
            by_row.push((parameters, row.clone()));
        }
        let mut reference = dual(&graph, &outputs, &by_row);
        weigh(&mut reference, &weights);
        // neither is looked at
        let mut others = parameters.clone();
        for k in GATHERED.map(|(k, _)| k).into_iter().chain(ZEROS) {
            others[k as usize] = f64::NAN;
        }
        for set in InstructionSet::available() {
            let result = check(&derived, &reference, &others, &seen, set);
            prop_assert!(result.is_ok(), "{:?}", result);
        }
    }
}

fn weigh(reference: &mut Reference, weights: &[f64]) {
    let width = PARAMETERS + INPUTS;
    for (values, derivatives) in reference.values.iter_mut().zip(&mut reference.derivatives) {
        for (i, &weight) in weights.iter().enumerate() {
            values[i] *= weight;
            derivatives[i * width..(i + 1) * width].iter_mut().for_each(|d| *d *= weight);
        }
    }
    for uncertain in &mut reference.uncertain {
        for (i, &weight) in weights.iter().enumerate() {
            uncertain[i * width..(i + 1) * width].iter_mut().for_each(|d| *d *= weight.abs());
        }
    }
}

#[test]
fn a_parameter_that_is_a_constant_is_one_no_more() {
    // sin(q₁)·q₀·x where q₁ = 0.5
    let mut g = Graph::new();
    let (q, held, x) = (g.parameter(0), g.parameter(1), g.input(0));
    let sine = g.unary(crate::graph::Operation::Sin, held);
    let scaled = g.mul(sine, q);
    let y = g.mul(scaled, x);
    let derived = differentiate(&g, &[y], &[q, x], &View { constants: vec![(1, 0.5)], ..View::default() });
    assert_eq!(derived.graph.known_parameter(1), None);
    let outputs = [&derived.values[..], &derived.derivatives].concat();
    let found = Tape::lower(&derived.graph, &outputs).evaluate(&[2.0], &[3.0]);
    let s = 0.5f64.sin();
    assert_eq!(found, [6.0 * s, 3.0 * s, 2.0 * s]);
}

#[test]
fn a_perturbation_of_a_rotation_is_differentiated_by_at_zero() {
    // R·exp(ω)·p by ω at ω = 0 is −R [p]×
    let mut g = Graph::new();
    let [x, y, z, a, b, c] = [0, 1, 2, 3, 4, 5].map(|i| g.parameter(i));
    let (v, omega) = (g.vector(x, y, z), g.vector(a, b, c));
    let (r, step) = (g.exp_rotation(v), g.exp_rotation(omega));
    let both = g.compose_rotation(r, step);
    let p = [0.3, -1.2, 2.0];
    let at = g.constant_vector(p);
    let moved = g.rotate(both, at);
    let outputs = crate::graph::Axis::ALL.map(|axis| g.component(moved, axis));
    let view = View { zeros: vec![3, 4, 5], ..View::default() };
    let derived = differentiate(&g, &outputs, &[a, b, c], &view);
    let tape = crate::graph::Tape::lower(&derived.graph, &derived.derivatives);
    let found = tape.evaluate(&[0.4, 0.5, -0.6], &[]);
    let rotation = nalgebra::Rotation3::new(nalgebra::vector![0.4, 0.5, -0.6]);
    let expected = -rotation.matrix() * nalgebra::Vector3::from(p).cross_matrix();
    for i in 0..3 {
        for j in 0..3 {
            assert!((found[3 * i + j] - expected[(i, j)]).abs() < 1e-15, "{i} {j}");
        }
    }
}

#[test]
fn a_leaf_may_be_given_twice() {
    let mut g = Graph::new();
    let (q, x) = (g.parameter(0), g.input(0));
    let y = g.mul(q, x);
    let derived = differentiate(&g, &[y], &[q, x, q], &View::default());
    let tape = crate::graph::Tape::lower(&derived.graph, &derived.derivatives);
    assert_eq!(tape.evaluate(&[3.0], &[5.0]), [5.0, 3.0, 5.0]);
}
