//! Laws that hold for every problem.

use super::super::Kind;
use super::super::state::State;
use super::functions::FUNCTIONS;
use super::{Closure, Dual, LeastSquares};
use num_dual::DualNum;
use proptest::prelude::*;

/// Decaying exponentials seen at a few times, with any data.
fn decay(y: [f64; 6]) -> Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>> {
    Closure::new(3, move |x| {
        Some((0..6).map(|i| (x[1].clone() * (-0.4 * i as f64)).exp() * &x[0] + &x[2] - y[i]).collect())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn accepted_cost_never_rises(
        y in prop::array::uniform6(-2.0..2.0_f64), start in prop::array::uniform3(-2.0..2.0_f64),
        width in prop::array::uniform3(0.1..4.0_f64),
    ) {
        for bounded in [false, true] {
            let mut problem = decay(y);
            if bounded {
                problem.lower = width.iter().map(|w| -w).collect();
                problem.upper = width.to_vec();
            }
            let solution = problem.solve(&start);
            let mut cost = solution.trace.first().map_or(solution.cost, |first| first.cost);
            for iteration in solution.trace.iter().filter(|iteration| iteration.kind == Kind::Step) {
                prop_assert_eq!(iteration.cost, cost);
                if iteration.accepted {
                    let trial = iteration.trial_cost.expect("accepted where undefined");
                    prop_assert!(trial <= cost + iteration.rounding, "{trial} after {cost}: {iteration:?}");
                    cost = trial;
                }
            }
            for (j, q) in solution.point.iter().enumerate() {
                prop_assert!(problem.lower[j] <= *q && *q <= problem.upper[j]);
            }
            if solution.status.converged() && solution.datum == super::super::Datum::NotNeeded {
                prop_assert_eq!(solution.cost, cost);
            }
        }
    }

    /// q in other units, tolerances alike, is the same problem.
    #[test]
    fn units_do_not_matter(
        y in prop::array::uniform6(0.0..2.0_f64), decades in prop::array::uniform3(-9..9_i32),
    ) {
        let units = decades.map(|decade| 2.0_f64.powi(3 * decade));
        let plain = decay(y);
        let mut other = Closure::new(3, |x| (plain.residuals)(&[
            x[0].clone() / units[0], x[1].clone() / units[1], x[2].clone() / units[2],
        ]));
        other.scale = units.to_vec();
        let start = [1.0, 0.5, 0.1];
        let (a, b) = (plain.solve(&start), other.solve(&[units[0], 0.5 * units[1], 0.1 * units[2]]));
        prop_assert_eq!(a.status, b.status);
        prop_assert!((a.cost - b.cost).abs() <= 1e-12 * a.cost + 1e-28);
        if a.status.converged() && a.invisible.is_empty() {
            for (j, unit) in units.iter().enumerate() {
                let error = (a.point[j] - b.point[j] / unit).abs();
                prop_assert!(error <= 1e-9 * (1.0 + a.point[j].abs()), "{:?} {:?}", a.point, b.point);
            }
        }
    }
}

/// Distances of (x, y) from five stations, less those read.
fn ranges<T: DualNum>([x, y]: [&T; 2], stations: &[[T; 2]; 5], read: &[T; 5]) -> Vec<T> {
    let square = |a: &T, b: &T| (a.clone() - b).powi(2);
    stations.iter().zip(read).map(|([a, b], read)| (square(x, a) + square(y, b)).sqrt() - read).collect()
}

proptest! {
    /// What rounding makes of a cost, seen in single precision, where what is rounded is as large as the parameters.
    #[test]
    fn the_rounding_of_a_cost_is_known(
        stations in prop::array::uniform5(prop::array::uniform2(-2000.0..2000.0_f32)),
        x in prop::array::uniform16(prop::array::uniform2(4000.0..9000.0_f32)),
        error in prop::array::uniform5(0.3..1.0_f32), decades in 0..2_i32,
    ) {
        let mut seen = 0.0_f64;
        for [x, y] in x {
            let exact = ranges([&x, &y], &stations, &[0.0; 5]);
            let read: [f32; 5] = std::array::from_fn(|i| exact[i] + error[i] * 10_f32.powi(-decades));
            let single: f32 = ranges([&x, &y], &stations, &read).iter().map(|r| 0.5 * r * r).sum();
            let problem = Closure::new(2, |q: &[Dual]| {
                let wide = |v: f32| Dual::from_re(f64::from(v));
                Some(ranges([&q[0], &q[1]], &stations.map(|at| at.map(wide)), &read.map(wide)))
            });
            let point = vec![f64::from(x), f64::from(y)];
            let cost = problem.cost(&point).expect("a cost");
            let information = problem.linearise(&point).expect("derivatives");
            let noise = State::new(&problem, point, cost, information, vec![], vec![]).noise();
            let noise = noise * f64::from(f32::EPSILON) / f64::EPSILON;
            seen = seen.max((f64::from(single) - cost).abs() / noise);
        }
        prop_assert!((0.02..5.0).contains(&seen), "{seen} of what is claimed");
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    for function in FUNCTIONS {
        let (a, b) = (function.closure().solve(function.start), function.closure().solve(function.start));
        assert_eq!((a.point, a.trace, a.information), (b.point, b.trace, b.information));
    }
}
