//! Equations and inequalities between parameters: published minima, closed forms, contradictions.

use super::super::super::{LeastSquares, Relation, Restriction, Settings, StartError, minimise};
use super::super::{Closure, Dual};
use super::told;
use crate::linalg::{dot, norm};
use num_dual::DualNum;
use proptest::prelude::*;

type Conditions = fn(&[Dual]) -> Vec<Dual>;

/// A problem of Hock & Schittkowski, Test Examples for Nonlinear Programming Codes (1981), that is a sum of squares.
struct Published {
    number: u32,
    residuals: fn(&[Dual]) -> Vec<Dual>,
    /// = 0
    equations: Conditions,
    /// ≤ 0
    inequalities: Conditions,
    bounds: &'static [(f64, f64)],
    start: &'static [f64],
    minimum: f64,
}

const NONE: Conditions = |_| vec![];
const INF: f64 = f64::INFINITY;

fn x(x: &[Dual], i: usize) -> Dual {
    x[i - 1].clone()
}

const PUBLISHED: &[Published] = &[
    Published {
        number: 2,
        residuals: |q| vec![(x(q, 2) - x(q, 1) * x(q, 1)) * 10.0, x(q, 1) - 1.0],
        equations: NONE,
        inequalities: NONE,
        bounds: &[(-INF, INF), (1.5, INF)],
        start: &[-2.0, 1.0],
        minimum: 4.94122932,
    },
    Published {
        number: 6,
        residuals: |q| vec![x(q, 1) - 1.0],
        equations: |q| vec![(x(q, 2) - x(q, 1) * x(q, 1)) * 10.0],
        inequalities: NONE,
        bounds: &[],
        start: &[-1.2, 1.0],
        minimum: 0.0,
    },
    Published {
        number: 28,
        residuals: |q| vec![x(q, 1) + x(q, 2), x(q, 2) + x(q, 3)],
        equations: |q| vec![x(q, 1) + x(q, 2) * 2.0 + x(q, 3) * 3.0 - 1.0],
        inequalities: NONE,
        bounds: &[],
        start: &[-4.0, 1.0, 1.0],
        minimum: 0.0,
    },
    Published {
        number: 42,
        residuals: |q| (1..=4).map(|i| x(q, i) - i as f64).collect(),
        equations: |q| vec![x(q, 1) - 2.0, x(q, 3) * x(q, 3) + x(q, 4) * x(q, 4) - 2.0],
        inequalities: NONE,
        bounds: &[],
        start: &[1.0; 4],
        minimum: 13.857864376269049,
    },
    Published {
        number: 48,
        residuals: |q| vec![x(q, 1) - 1.0, x(q, 2) - x(q, 3), x(q, 4) - x(q, 5)],
        equations: |q| {
            vec![x(q, 1) + x(q, 2) + x(q, 3) + x(q, 4) + x(q, 5) - 5.0, x(q, 3) - (x(q, 4) + x(q, 5)) * 2.0 + 3.0]
        },
        inequalities: NONE,
        bounds: &[],
        start: &[3.0, 5.0, -3.0, 2.0, -2.0],
        minimum: 0.0,
    },
    Published {
        number: 51,
        residuals: |q| vec![x(q, 1) - x(q, 2), x(q, 2) + x(q, 3) - 2.0, x(q, 4) - 1.0, x(q, 5) - 1.0],
        equations: |q| vec![x(q, 1) + x(q, 2) * 3.0 - 4.0, x(q, 3) + x(q, 4) - x(q, 5) * 2.0, x(q, 2) - x(q, 5)],
        inequalities: NONE,
        bounds: &[],
        start: &[2.5, 0.5, 2.0, -1.0, 0.5],
        minimum: 0.0,
    },
    Published {
        number: 52,
        residuals: |q| vec![x(q, 1) * 4.0 - x(q, 2), x(q, 2) + x(q, 3) - 2.0, x(q, 4) - 1.0, x(q, 5) - 1.0],
        equations: |q| vec![x(q, 1) + x(q, 2) * 3.0, x(q, 3) + x(q, 4) - x(q, 5) * 2.0, x(q, 2) - x(q, 5)],
        inequalities: NONE,
        bounds: &[],
        start: &[2.0; 5],
        minimum: 1859.0 / 349.0,
    },
    Published {
        number: 53,
        residuals: |q| vec![x(q, 1) - x(q, 2), x(q, 2) + x(q, 3) - 2.0, x(q, 4) - 1.0, x(q, 5) - 1.0],
        equations: |q| vec![x(q, 1) + x(q, 2) * 3.0, x(q, 3) + x(q, 4) - x(q, 5) * 2.0, x(q, 2) - x(q, 5)],
        inequalities: NONE,
        bounds: &[(-10.0, 10.0); 5],
        start: &[2.0; 5],
        minimum: 176.0 / 43.0,
    },
    Published {
        number: 60,
        residuals: |q| {
            let difference = x(q, 2) - x(q, 3);
            vec![x(q, 1) - 1.0, x(q, 1) - x(q, 2), difference.clone() * difference]
        },
        equations: |q| vec![x(q, 1) * (x(q, 2) * x(q, 2) + 1.0) + x(q, 3).powi(4) - 4.0 - 3.0 * 2.0_f64.sqrt()],
        inequalities: NONE,
        bounds: &[(-10.0, 10.0); 3],
        start: &[2.0; 3],
        minimum: 0.03256820025,
    },
    Published {
        number: 65,
        residuals: |q| vec![x(q, 1) - x(q, 2), (x(q, 1) + x(q, 2) - 10.0) / 3.0, x(q, 3) - 5.0],
        equations: NONE,
        inequalities: |q| vec![x(q, 1) * x(q, 1) + x(q, 2) * x(q, 2) + x(q, 3) * x(q, 3) - 48.0],
        bounds: &[(-4.5, 4.5), (-4.5, 4.5), (-5.0, 5.0)],
        start: &[-5.0, 5.0, 0.0],
        minimum: 0.9535288567,
    },
];

impl Published {
    fn closure(&self) -> Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>> {
        let residuals = self.residuals;
        let mut problem = Closure::new(self.start.len(), move |q| Some(residuals(q)));
        let at: Vec<Dual> = self.start.iter().map(|&x| Dual::from_re(x)).collect();
        for (relation, conditions) in [(Relation::Equal, self.equations), (Relation::AtMost, self.inequalities)] {
            for i in 0..conditions(&at).len() {
                problem.ask(relation, move |q| conditions(q).swap_remove(i));
            }
        }
        for (j, &(lower, upper)) in self.bounds.iter().enumerate() {
            (problem.lower[j], problem.upper[j]) = (lower, upper);
        }
        problem
    }
}

#[test]
fn published_minima_are_reached() {
    let mut failures = vec![];
    for published in PUBLISHED {
        let problem = published.closure();
        let solution = problem.conic(published.start);
        let sum_of_squares = 2.0 * solution.cost;
        let near = (sum_of_squares - published.minimum).abs() <= 1e-8 * published.minimum + 1e-20;
        let met = solution.constraints.iter().all(|constraint| match constraint.relation {
            Relation::Equal => constraint.value.abs() <= 1e-13 && constraint.active,
            Relation::AtMost => constraint.value <= 1e-13 && constraint.multiplier >= 0.0,
        });
        let kkt = solution.kkt <= 1e-8 || published.minimum == 0.0;
        let line = format!(
            "HS{} {sum_of_squares:.10} {} {} trials, kkt {:.1e}",
            published.number,
            solution.status,
            solution.trace.len(),
            solution.kkt
        );
        if !near || !met || !kkt || !solution.status.converged() || !told(&solution) {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// The point of a sphere that is nearest to a given one.
fn sphere(centre: [f64; 3], radius: f64, given: [f64; 3]) -> Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>> {
    let mut problem = Closure::new(3, move |q| Some((0..3).map(|i| q[i].clone() - given[i]).collect()));
    problem.ask(Relation::Equal, move |q| {
        (0..3).fold(Dual::from_re(-radius * radius), |sum, i| {
            let way = q[i].clone() - centre[i];
            sum + way.clone() * way
        })
    });
    problem
}

#[test]
fn the_nearest_point_of_a_sphere() {
    let centre = [0.3, -0.2, 0.5];
    for distance in [0.2, 0.7, 1.5, 3.0, 20.0] {
        for (start, towards) in
            [([1.0, 1.0, 1.0], [0.6, 0.0, 0.8]), ([-2.0, 0.1, 0.4], [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0])]
        {
            let given: [f64; 3] = std::array::from_fn(|i| centre[i] + distance * towards[i]);
            let solution = sphere(centre, 1.0, given).conic(&start);
            assert!(solution.status.converged(), "{distance} {:?} {:?}", solution.status, solution.trace.last());
            for i in 0..3 {
                let error = solution.point[i] - centre[i] - towards[i];
                assert!(error.abs() < 1e-7, "{distance} {:?} {:?}", solution.point, solution.status);
            }
            assert!(solution.constraints[0].value.abs() < 1e-14);
            // (q − given) + 2μ(q − centre) = 0
            let mu = 0.5 * (distance - 1.0);
            assert!((solution.constraints[0].multiplier - mu).abs() < 1e-6 * (1.0 + mu.abs()), "{mu}");
        }
    }
}

#[test]
fn a_known_distance_between_two_unknown_points_is_met_to_rounding() {
    // Two points measured at 0 and 3 on a line, known to be 2 apart: each moves by ½; free across, where they are exact.
    let measured = [0.0, 0.1, 3.0, 0.1];
    let mut problem = Closure::new(4, move |q| Some((0..4).map(|i| q[i].clone() - measured[i]).collect()));
    problem.ask(Relation::Equal, |q| {
        let (x, y) = (q[2].clone() - &q[0], q[3].clone() - &q[1]);
        (x.clone() * x + y.clone() * y).sqrt() - 2.0
    });
    for start in [[0.0, 0.1, 3.0, 0.1], [1.0, 5.0, 2.0, -3.0]] {
        let solution = problem.conic(&start);
        assert!(solution.status.converged(), "{:?}", solution.status);
        for (found, expected) in solution.point.iter().zip([0.5, 0.1, 2.5, 0.1]) {
            assert!((found - expected).abs() < 1e-8, "{:?}", solution.point);
        }
        assert!(
            solution.constraints[0].value.abs() <= 1e-15 && (solution.constraints[0].multiplier - 0.5).abs() < 1e-8
        );
        assert!(solution.projected);
    }
}

#[test]
fn what_only_an_equation_sees_is_not_invisible() {
    // x is measured, y is not; y = x² ties it.
    let mut problem = Closure::new(2, |q| Some(vec![q[0].clone() - 1.5, q[0].clone() - 1.7]));
    problem.ask(Relation::Equal, |q| q[1].clone() - q[0].clone() * &q[0]);
    let solution = problem.conic(&[0.0, 4.0]);
    assert!(solution.status.converged() && solution.invisible.is_empty(), "{:?}", solution.invisible);
    assert!((solution.point[0] - 1.6).abs() < 1e-12 && (solution.point[1] - 2.56).abs() < 1e-12);
    // With nothing measured the nearest point to the nominal one, on the constraint: the circle's.
    let mut family = Closure::new(2, |_| Some(vec![Dual::from_re(0.0), Dual::from_re(1.0)]));
    family.ask(Relation::Equal, |q| q[0].clone() * &q[0] + q[1].clone() * &q[1] - 1.0);
    family.nominal = vec![3.0, 4.0];
    let solution = family.conic(&[1.0, 0.0]);
    assert!(solution.status.converged(), "{:?} {:?}", solution.status, solution.datum);
    assert!((solution.point[0] - 0.6).abs() < 1e-9 && (solution.point[1] - 0.8).abs() < 1e-9, "{:?}", solution.point);
}

#[test]
fn contradictions_are_named() {
    let mut problem = Closure::new(3, |q| Some(q.to_vec()));
    problem.ask(Relation::AtMost, |q| q[2].clone() - 100.0);
    problem.ask(Relation::Equal, |q| q[0].clone() + &q[1] - 1.0);
    problem.ask(Relation::AtMost, |q| q[0].clone() + 2.0);
    problem.ask(Relation::Equal, |q| q[2].clone() - 1.0);
    problem.upper[1] = 2.5;
    let Err(StartError::Infeasible { conflict }) = problem.try_conic(&[0.0; 3], Default::default()) else {
        panic!("accepted");
    };
    assert_eq!(conflict, [Restriction::Upper(1), Restriction::Constraint(1), Restriction::Constraint(2)]);
    // Levenberg–Marquardt says that it cannot.
    assert_eq!(minimise(&problem, vec![0.0; 3], &Settings::default()).err(), Some(StartError::Constraints));
    // A circle of imaginary radius: nothing linear contradicts until its middle.
    let mut circle = Closure::new(2, |q| Some(q.to_vec()));
    circle.ask(Relation::Equal, |q| q[0].clone() * &q[0] + q[1].clone() * &q[1] + 1.0);
    let refused = circle.try_conic(&[1.0, 0.5], Default::default());
    let expected = vec![Restriction::Constraint(0)];
    assert!(matches!(refused, Err(StartError::Infeasible { conflict }) if conflict == expected));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Inequalities that couple parameters: met, with the conditions of a minimum, whatever clamping could do.
    #[test]
    fn coupled_conditions_are_met(
        entries in prop::collection::vec(-1.0..1.0_f64, 7 * 4), b in prop::collection::vec(-2.0..2.0_f64, 7),
        rows in prop::collection::vec(-1.0..1.0_f64, 5 * 4), room in prop::collection::vec(0.0..0.5_f64, 5),
        decades in prop::array::uniform4(-5.0..5.0_f64), equations in 0..3_usize, curved in -0.3..0.3_f64,
    ) {
        let unit = decades.map(|decade| 10_f64.powf(decade));
        let mut problem = Closure::new(4, move |q| {
            let row = |i: usize| (0..4).fold(Dual::from_re(-b[i]), |sum, j| sum + q[j].clone() * (entries[4 * i + j] / unit[j]));
            Some((0..7).map(row).collect())
        });
        problem.scale = unit.to_vec();
        (problem.lower, problem.upper) = (unit.iter().map(|u| -2.0 * u).collect(), unit.iter().map(|u| 2.0 * u).collect());
        for i in 0..5 {
            let row: [f64; 4] = std::array::from_fn(|j| rows[4 * i + j] / unit[j]);
            let (relation, room) = if i < equations { (Relation::Equal, 0.0) } else { (Relation::AtMost, room[i]) };
            problem.ask(relation, move |q| {
                let straight = (0..4).fold(Dual::from_re(-room), |sum, j| sum + q[j].clone() * row[j]);
                straight.clone() + straight.clone() * straight * curved
            });
        }
        let solution = problem.conic(&[0.0; 4]);
        prop_assert!(solution.status.converged() && told(&solution), "{:?} {:?}", solution.status, solution.trace.last());
        prop_assert!(solution.kkt <= 1e-8, "{:e} {:?} {:?}", solution.kkt, solution.status, solution.trace.last());
        for constraint in &solution.constraints {
            prop_assert!(constraint.value <= 1e-13 && (constraint.relation == Relation::AtMost || constraint.value >= -1e-13));
            prop_assert!(constraint.relation == Relation::Equal || constraint.multiplier >= 0.0);
        }
        // the sum of the conditions by hand
        let mut left = problem.linearise(&solution.point).unwrap().gradient();
        for constraint in &solution.constraints {
            (0..4).for_each(|j| left[j] += constraint.multiplier * constraint.gradient[j]);
        }
        (0..4).for_each(|j| left[j] = (left[j] - solution.multipliers[j]) * unit[j]);
        prop_assert!(dot(&left, &left).sqrt() <= 1e-7 * norm(&[1.0, solution.cost]), "{left:?}");
    }
}
