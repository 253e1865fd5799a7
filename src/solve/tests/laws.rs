//! Laws that hold for every problem.

use super::super::Kind;
use super::functions::FUNCTIONS;
use super::{Closure, Dual};
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
                    // but for what rounding makes of a cost where long columns nearly cancel
                    prop_assert!(trial <= cost * (1.0 + 1e-9));
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

#[test]
fn two_runs_give_the_same_bits() {
    for function in FUNCTIONS {
        let (a, b) = (function.closure().solve(function.start), function.closure().solve(function.start));
        assert_eq!((a.point, a.trace, a.information), (b.point, b.trace, b.information));
    }
}
