//! What ends a search, and what it must survive.

use super::super::{Datum, Kind, Settings, StartError, Status, minimise};
use super::functions::FUNCTIONS;
use super::{Closure, Refused};
use crate::linalg::Bound;
use num_dual::DualNum;

#[test]
fn the_arctangent_from_3_ends_at_0() {
    let solution = Closure::new(1, |x| Some(vec![x[0].atan()])).solve(&[3.0]);
    assert!(solution.status.converged(), "{:?}", solution.trace);
    assert!(solution.point[0].abs() < 1e-20);
    // Where the radius lets it, the full step leads to −9.5 and a higher cost: it must be refused.
    let far = Settings { radius: 100.0, ..Settings::default() };
    let solution = minimise(&Closure::new(1, |x| Some(vec![x[0].atan()])), vec![3.0], &far).expect("defined");
    assert!(solution.point[0].abs() < 1e-20 && !solution.trace[0].accepted);
    // From −500 the full step is 300 000 long.
    assert!(Closure::new(1, |x| Some(vec![x[0].atan()])).solve(&[-500.0]).point[0].abs() < 1e-20);
}

#[test]
fn a_wrong_jacobian_stalls() {
    for function in FUNCTIONS.iter().filter(|function| function.minima[0] > 0.0 && function.name != "Gaussian") {
        let mut wrong = function.closure();
        wrong.mistake = -1.0;
        let solution = wrong.solve(function.start);
        assert_eq!(solution.status, Status::Stalled, "{}", function.name);
        // What little is accepted is rounding.
        for (q, start) in solution.point.iter().zip(function.start) {
            assert!((q - start).abs() <= 1e-12 * start.abs().max(1.0), "{} {q} {start}", function.name);
        }
    }
    let mut wrong = Closure::new(1, |x| Some(vec![x[0].clone() - 1.0]));
    wrong.mistake = -1.0;
    assert_eq!(wrong.solve(&[3.0]).status, Status::Stalled);
}

#[test]
fn the_edge_of_the_domain_shortens_steps() {
    // From 20 the full step for log x = 0 leads to x = −40.
    let logarithm = Closure::new(1, |x| (x[0].re > 0.0).then(|| vec![x[0].ln()]));
    let solution = logarithm.solve(&[20.0]);
    assert!(solution.status.converged() && (solution.point[0] - 1.0).abs() < 1e-14);
    assert!(solution.trace.iter().any(|iteration| iteration.trial_cost.is_none() && !iteration.accepted));
    assert!(matches!(
        minimise(&logarithm, vec![-1.0], &Settings::default()),
        Err(StartError::Undefined(Refused::Domain))
    ));
    // A start from which every step is undefined.
    let island = Closure::new(1, |x| (x[0].re == 2.0).then(|| vec![x[0].clone()]));
    assert_eq!(island.solve(&[2.0]).status, Status::Undefined);
    // A cost that is not finite counts as undefined.
    let pole = Closure::new(1, |x| Some(vec![(x[0].clone() * 500.0).exp() - 1.0]));
    let solution = pole.solve(&[-0.02]);
    assert!(solution.trace[0].trial_cost.is_none());
    assert!(solution.status.converged() && solution.point[0].abs() < 1e-14, "{:?}", solution.status);
}

#[test]
fn nonsense_cannot_start() {
    let mut line = Closure::new(1, |x| Some(vec![x[0].clone()]));
    let bad = Settings { gain: 2.0, ..Settings::default() };
    assert!(matches!(minimise(&line, vec![1.0], &bad), Err(StartError::Settings(_))));
    line.scale = vec![0.0];
    assert!(matches!(minimise(&line, vec![1.0], &Settings::default()), Err(StartError::Problem("tolerances"))));
    line.scale = vec![1.0];
    (line.lower, line.upper) = (vec![2.0], vec![1.0]);
    assert!(matches!(minimise(&line, vec![1.0], &Settings::default()), Err(StartError::Problem("bounds"))));
    let infinite = Closure::new(1, |x| Some(vec![x[0].clone() / 0.0]));
    assert!(matches!(minimise(&infinite, vec![1.0], &Settings::default()), Err(StartError::NotFinite)));
}

#[test]
fn what_is_already_solved_stays() {
    let line = Closure::new(2, |x| Some(vec![x[0].clone() - 3.0, x[1].clone() + 1.0]));
    let solution = line.solve(&[3.0, -1.0]);
    assert_eq!((solution.status, solution.iterations), (Status::NothingLeft, 0));
    // Noise-free data whose residuals are rounding from the start.
    let noisy = Closure::new(2, |x| {
        Some((1..20).map(|i| (x[0].clone() * f64::from(i)).exp() * &x[1] - (0.3 * f64::from(i)).exp() * 0.7).collect())
    });
    let solution = noisy.solve(&[0.3 * (1.0 + 1e-16), 0.7]);
    assert!(solution.status.converged(), "{:?} {:?}", solution.status, solution.trace);
    // A sum of exponentials, ill-conditioned, near its exact fit: rounding of the parameters is what remains.
    let function = FUNCTIONS.iter().find(|function| function.name == "BiggsEXP6").expect("in the table");
    for k in 0..40 {
        let near = 1.0 + 1e-3 * f64::from(k);
        let start = [1.0 * near, 10.0, 1.0, 5.0 * near, 4.0, 3.0];
        let solution = function.closure().solve(&start);
        assert!(solution.status.converged() && solution.cost < 1e-24, "{k} {:?}", solution.status);
    }
    let none = Closure::new(0, |_| Some(vec![super::Dual::from_re(1.0)]));
    assert_eq!(none.solve(&[]).status, Status::Gradient);
}

#[test]
fn the_limit_of_trials_is_a_failure() {
    let function = &FUNCTIONS[0];
    let settings = Settings { max_trials: 5, ..Settings::default() };
    let solution = minimise(&function.closure(), function.start.to_vec(), &settings).expect("defined");
    assert_eq!((solution.status, solution.trace.len()), (Status::MaxTrials, 5));
}

#[test]
fn bounds_hold_and_are_told() {
    // Rosenbrock with x₁ ≤ 0.5: the minimum is (0.5, 0.25), with ‖r‖² = 0.25.
    let mut bounded = FUNCTIONS[0].closure();
    bounded.upper = vec![0.5, f64::INFINITY];
    let solution = bounded.solve(FUNCTIONS[0].start);
    assert!(solution.status.converged());
    assert_eq!((solution.active[0], solution.active[1]), (Bound::Upper, Bound::Free));
    assert_eq!(solution.point[0], 0.5);
    assert!((solution.point[1] - 0.25).abs() < 1e-12 && (solution.cost - 0.125).abs() < 1e-14);
    assert!(!solution.projected);
    // The same from outside.
    let outside = bounded.solve(&[7.0, 1.0]);
    assert!(outside.projected && outside.point[0] == 0.5 && (outside.point[1] - 0.25).abs() < 1e-12);
    // A bound that is met on the way but not at the end.
    bounded.upper = vec![f64::INFINITY; 2];
    bounded.lower = vec![-1.25, 0.02];
    let solution = bounded.solve(FUNCTIONS[0].start);
    assert_eq!(solution.active, [Bound::Free; 2]);
    assert!((solution.point[0] - 1.0).abs() < 1e-12, "{:?} {:?}", solution.point, solution.status);
}

#[test]
fn powells_singular_minimum_is_seen_to_be_singular_and_isolated() {
    let function = FUNCTIONS.iter().find(|function| function.name == "PowellSingular").expect("in the table");
    let mut closure = function.closure();
    closure.nominal = function.start.to_vec();
    let solution = closure.solve(function.start);
    assert_eq!((solution.invisible.len(), solution.datum), (2, Datum::Isolated), "{:?}", solution.status);
    assert!(solution.status.converged() && solution.cost < 1e-40);
    assert!(
        solution.trace.iter().filter(|iteration| iteration.kind != Kind::Step).all(|iteration| !iteration.accepted)
    );
}
