//! Among equally good points, the one nearest to the nominal values in tolerances.

use super::super::{Datum, Kind};
use super::{Closure, Dual};
use crate::linalg::Bound;

/// The point of the unit circle nearest to `nominal` in tolerances, by brute force and golden section.
fn nearest_on_circle(nominal: [f64; 2], scale: [f64; 2]) -> f64 {
    let distance =
        |angle: f64| ((angle.cos() - nominal[0]) / scale[0]).powi(2) + ((angle.sin() - nominal[1]) / scale[1]).powi(2);
    let best = (0..3600)
        .map(|i| f64::from(i) * 1e-3 * std::f64::consts::TAU / 3.6)
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
        .expect("some");
    // Newton on the derivative of the distance.
    let slope = |t: f64| {
        -2.0 * t.sin() * (t.cos() - nominal[0]) / scale[0].powi(2)
            + 2.0 * t.cos() * (t.sin() - nominal[1]) / scale[1].powi(2)
    };
    (0..50).fold(best, |t, _| {
        let h = 1e-5;
        t - slope(t) * 2.0 * h / (slope(t + h) - slope(t - h))
    })
}

fn circle(x: &[Dual]) -> Option<Vec<Dual>> {
    Some(vec![x[0].clone() * &x[0] + x[1].clone() * &x[1] - 1.0])
}

#[test]
fn a_curved_family_is_followed_to_the_nearest_point() {
    for (nominal, scale) in [
        ([2.0, 1.0], [1.0, 1.0]),
        ([2.0, 1.0], [1.0, 0.1]),
        ([2.0, 1.0], [0.01, 1.0]),
        ([0.3, 0.1], [1e-3, 2e-3]),
        ([20.0, -15.0], [0.1, 0.3]),
        ([0.9, 0.5], [1e-4, 1e-4]),
    ] {
        for start in [nominal, [-1.5, 0.4], [0.1, 3.0]] {
            let mut problem = Closure::new(2, circle);
            (problem.nominal, problem.scale) = (nominal.to_vec(), scale.to_vec());
            let solution = problem.solve(&start);
            let angle = nearest_on_circle(nominal, scale);
            let error = (solution.point[0] - angle.cos()).hypot(solution.point[1] - angle.sin());
            assert!(solution.status.converged(), "{nominal:?} {scale:?} {start:?} {:?}", solution.status);
            assert_eq!((solution.datum, solution.invisible.len()), (Datum::Nearest, 1));
            assert!(error < 1e-9, "{nominal:?} {scale:?} {start:?}: {error:e} at {:?}", solution.point);
            assert!(solution.cost < 1e-25);
            assert!(solution.trace.len() < 200, "{} trials", solution.trace.len());
        }
    }
}

#[test]
fn a_linear_family_ends_at_the_point_of_least_norm() {
    // Two rows for four parameters. With A' = A S, δ = nominal + S A'⁺(b − A nominal).
    let rows = [[1.0, 2.0, 0.0, -1.0], [0.5, 1.0, 3.0, 2.0]];
    let (b, nominal, scale) = ([3.0, -2.0], [1.0, 0.5, -1.0, 2.0], [1.0, 10.0, 0.1, 2.0]);
    let mut problem = Closure::new(4, move |x| {
        Some((0..2).map(|i| (0..4).fold(Dual::from_re(-b[i]), |sum, j| sum + x[j].clone() * rows[i][j])).collect())
    });
    (problem.nominal, problem.scale) = (nominal.to_vec(), scale.to_vec());
    let entry = |i: usize, k: usize| (0..4).map(|j| rows[i][j] * rows[k][j] * scale[j] * scale[j]).sum::<f64>();
    let gap = |i: usize| b[i] - (0..4).map(|j| rows[i][j] * nominal[j]).sum::<f64>();
    let determinant = entry(0, 0) * entry(1, 1) - entry(0, 1) * entry(1, 0);
    let y = [
        (entry(1, 1) * gap(0) - entry(0, 1) * gap(1)) / determinant,
        (entry(0, 0) * gap(1) - entry(1, 0) * gap(0)) / determinant,
    ];
    for start in [nominal, [5.0, -3.0, 8.0, 100.0]] {
        let solution = problem.solve(&start);
        assert!(solution.status.converged() && solution.datum == Datum::Nearest);
        for j in 0..4 {
            let expected = nominal[j] + scale[j] * scale[j] * (rows[0][j] * y[0] + rows[1][j] * y[1]);
            assert!((solution.point[j] - expected).abs() < 1e-11, "{j} {} {expected}", solution.point[j]);
        }
    }
}

#[test]
fn noise_beside_a_family_is_not_followed() {
    // x + y is seen; noise in the inputs shows something of x − y, whose own minimum is ten thousand away.
    let mut problem = Closure::new(2, |x| {
        let unseen = x[0].clone() - &x[1];
        Some(vec![x[0].clone() + &x[1] - 2.0, unseen * 1e-6 - 1e-2, Dual::from_re(1.0)])
    });
    problem.invisible = Some(vec![vec![0.5_f64.sqrt(), -0.5_f64.sqrt()]]);
    problem.nominal = vec![3.0, 1.0];
    let solution = problem.solve(&[0.0, 0.0]);
    assert!(solution.status.converged());
    assert!((solution.point[0] - 2.0).abs() < 1e-9 && solution.point[1].abs() < 1e-9, "{:?}", solution.point);
}

#[test]
fn bounds_limit_the_way_along_a_family() {
    // The nearest point would be (2, 1)/√5; y ≤ 0.2 stops before it.
    let mut problem = Closure::new(2, circle);
    problem.nominal = vec![2.0, 1.0];
    problem.upper[1] = 0.2;
    let solution = problem.solve(&[1.5, -0.5]);
    assert!(solution.status.converged(), "{:?}", solution.status);
    assert_eq!((solution.active[1], solution.datum), (Bound::Upper, Datum::Nearest));
    assert!((solution.point[0] - 0.96_f64.sqrt()).abs() < 1e-12 && solution.point[1] == 0.2);
    // A second invisible parameter still goes to its nominal value.
    let mut problem = Closure::new(3, |x| Some(vec![x[0].clone() + &x[1] - 1.0]));
    problem.nominal = vec![4.0, 1.0, 7.0];
    problem.upper[0] = 1.5;
    let solution = problem.solve(&[0.0, 0.0, 0.0]);
    assert_eq!(solution.datum, Datum::Nearest);
    for (found, expected) in solution.point.iter().zip([1.5, -0.5, 7.0]) {
        assert!((found - expected).abs() < 1e-9, "{:?}", solution.point);
    }
}

#[test]
fn datum_steps_have_their_own_place_in_the_trace() {
    let mut problem = Closure::new(2, circle);
    problem.nominal = vec![2.0, 1.0];
    let solution = problem.solve(&[0.1, 3.0]);
    let kinds: Vec<Kind> = solution.trace.iter().map(|iteration| iteration.kind).collect();
    assert!(kinds[0] == Kind::Step && kinds.contains(&Kind::Datum) && kinds.contains(&Kind::Correction));
}
