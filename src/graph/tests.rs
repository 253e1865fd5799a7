use std::f64::consts::{FRAC_PI_2, PI};

use num_dual::{Dual2_64, Dual64};
use proptest::prelude::*;

use super::*;

/// The 4×4 product of the φ-model, (A2) and (A3), as the paper prints it.
fn phi_matrix(theta: f64, d: f64, [a, b, alpha, beta]: [f64; 4]) -> nalgebra::Matrix4<f64> {
    let (s, c) = theta.sin_cos();
    let (sa, ca) = alpha.sin_cos();
    let (sb, cb) = beta.sin_cos();
    let first = nalgebra::matrix![-s, 0.0, c, 0.0; c, 0.0, s, 0.0; 0.0, 1.0, 0.0, d; 0.0, 0.0, 0.0, 1.0];
    let second = nalgebra::matrix![
        cb, -sb * ca, sb * sa, b * cb; sb, cb * ca, -cb * sa, b * sb; 0.0, sa, ca, a; 0.0, 0.0, 0.0, 1.0];
    first * second
}

/// A joint as nodes: parameters a, b, α, β from `base` on, input θ.
fn joint(g: &mut Graph, base: u32, input: u32) -> Frame {
    let [a, b, alpha, beta] = [0, 1, 2, 3].map(|i| g.parameter(base + i));
    let zero = g.constant(0.0);
    let theta = g.input(input);
    g.phi_joint(theta, zero, [a, b, alpha, beta])
}

fn numbers(g: &mut Graph, f: Frame) -> Vec<Scalar> {
    let mut all = Vec::new();
    for axis in Axis::ALL {
        let r = g.rotation_of(f);
        let column = g.column(r, axis);
        all.extend(Axis::ALL.map(|i| g.component(column, i)));
    }
    let o = g.origin(f);
    all.extend(Axis::ALL.map(|i| g.component(o, i)));
    all
}

proptest! {
    #[test]
    fn a_chain_is_the_papers_matrix_product(q in prop::array::uniform8(-3.0f64..3.0), x in prop::array::uniform2(-3.0f64..3.0)) {
        let mut g = Graph::new();
        let (first, second) = (joint(&mut g, 0, 0), joint(&mut g, 4, 1));
        let both = g.compose_frame(first, second);
        let outputs = numbers(&mut g, both);
        let found = Tape::lower(&g, &outputs).evaluate(&q, &x);
        let [q1, q2] = [0, 4].map(|i| [q[i], q[i + 1], q[i + 2], q[i + 3]]);
        let expected = phi_matrix(x[0], 0.0, q1) * phi_matrix(x[1], 0.0, q2);
        for column in 0..4 {
            for row in 0..3 {
                prop_assert!((found[3 * column + row] - expected[(row, column)]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn a_frame_times_its_inverse_is_nothing(q in prop::array::uniform4(-3.0f64..3.0), x in -3.0f64..3.0) {
        let mut g = Graph::new();
        let f = joint(&mut g, 0, 0);
        let back = g.inverse_frame(f);
        let both = g.compose_frame(back, f);
        let outputs = numbers(&mut g, both);
        let found = Tape::lower(&g, &outputs).evaluate(&q, &[x]);
        let expected = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
        for (f, e) in found.iter().zip(expected) {
            prop_assert!((f - e).abs() < 1e-13);
        }
    }

    #[test]
    fn log_undoes_exp(v in prop::array::uniform3(-1.8f64..1.8), tiny in 0..4) {
        let v = v.map(|c| c * [1.0, 1e-3, 1e-9, 0.0][tiny as usize]);
        let mut g = Graph::new();
        let [x, y, z] = [0, 1, 2].map(|i| g.parameter(i));
        let vector = g.vector(x, y, z);
        let r = g.exp_rotation(vector);
        let log = g.log_rotation(r);
        let outputs = Axis::ALL.map(|i| g.component(log, i));
        let tape = Tape::lower(&g, &outputs);
        let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
        prop_assume!(length < 3.1);
        for (found, expected) in tape.evaluate(&v, &[]).iter().zip(v) {
            prop_assert!((found - expected).abs() < 1e-12 * (1.0 + length / (PI - length)));
        }
        // its derivative is the identity, at zero too
        for j in 0..3 {
            let mut seeded = v.map(Dual64::from);
            seeded[j] = seeded[j].derivative();
            for (i, found) in tape.evaluate(&seeded, &[]).iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                prop_assert!((found.eps - expected).abs() < 1e-10 / (PI - length).powi(2), "{found} {expected}");
            }
        }
    }
}

#[test]
fn turns_have_their_derivatives_at_exactly_zero() {
    // every motion primitive, first and second derivative of where it takes (1, 2, 3)
    for axis in Axis::ALL {
        let mut g = Graph::new();
        let q = g.parameter(0);
        let turn = g.turn(axis, q);
        let p = g.constant_vector([1.0, 2.0, 3.0]);
        let moved = g.rotate(turn, p);
        let zero = g.constant(0.0);
        let mut vector = [zero; 3];
        vector[axis.index()] = q;
        let v = g.vector(vector[0], vector[1], vector[2]);
        let exp = g.exp_rotation(v);
        let also = g.rotate(exp, p);
        for moved in [moved, also] {
            let outputs = Axis::ALL.map(|i| g.component(moved, i));
            let at_zero = Tape::lower(&g, &outputs).evaluate(&[Dual2_64::from(0.0).derivative()], &[]);
            let mut n = nalgebra::Vector3::zeros();
            n[axis.index()] = 1.0;
            let p = nalgebra::vector![1.0, 2.0, 3.0];
            let (first, second) = (n.cross(&p), n.cross(&n.cross(&p)));
            for i in 0..3 {
                assert!((at_zero[i].v1 - first[i]).abs() < 1e-15);
                assert!((at_zero[i].v2 - second[i]).abs() < 1e-14, "{axis:?} {:?} {second}", at_zero[i]);
            }
        }
    }
}

#[test]
fn quaternions_are_normalised_rotations() {
    let mut g = Graph::new();
    let [w, x, y, z] = [2.0, 0.0, 0.0, 2.0].map(|v| g.constant(v));
    let r = g.quaternion(w, x, y, z);
    let e = g.constant_vector([1.0, 0.0, 0.0]);
    let turned = g.rotate(r, e);
    let outputs = Axis::ALL.map(|i| g.component(turned, i));
    assert_eq!(Tape::lower(&g, &outputs).evaluate::<f64>(&[], &[]), [0.0, 1.0, 0.0]);
}

#[test]
fn half_a_turn_has_no_rotation_vector() {
    let mut g = Graph::new();
    let q = g.parameter(0);
    let r = g.turn(Axis::X, q);
    let log = g.log_rotation(r);
    let x = g.component(log, Axis::X);
    let tape = Tape::lower(&g, &[x]);
    let slots = tape.begin(&[PI]);
    let undefined = tape.undefined(&slots, true).expect("undefined at half a turn");
    assert_eq!(undefined.operation, Operation::AtLeast);
    assert_eq!(undefined.spoils, [0]);
    assert!(tape.undefined(&tape.begin(&[FRAC_PI_2]), true).is_none());
}

#[test]
fn what_depends_on_parameters_alone_runs_once() {
    let mut g = Graph::new();
    let f = joint(&mut g, 0, 0);
    let o = g.origin(f);
    let x = g.component(o, Axis::X);
    let counts = Tape::lower(&g, &[x]).counts();
    assert!(counts.per_row <= 5, "{counts:?}");
    assert!(counts.per_iteration > 0);
}

#[test]
fn a_constant_outside_a_domain_is_named() {
    let mut g = Graph::new();
    let zero = g.constant(0.0);
    let one = g.constant(1.0);
    let quotient = g.div(one, zero);
    let tape = Tape::lower(&g, &[quotient]);
    let slots = tape.begin::<f64>(&[]);
    assert_eq!(tape.undefined(&slots, false).map(|u| u.operation), Some(Operation::Div));
}
