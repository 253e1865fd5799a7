//! Against the box solver, against the Karush–Kuhn–Tucker conditions, and from starts that are wrong.

use super::*;
use crate::linalg::{Condition, Row, bounded_least_squares};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// A random problem whose conditions are met by the origin.
#[derive(Debug)]
struct Problem {
    a: Matrix,
    d: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    rows: Vec<Row>,
}

impl Problem {
    fn conditions(&self) -> Conditions<'_> {
        Conditions { lower: &self.lower, upper: &self.upper, rows: &self.rows }
    }

    /// How large a coordinate is, or as far as A knows could be: its rounding is a share of that.
    fn unit(&self, j: usize, delta: &[f64]) -> f64 {
        delta[j].abs() + (norm(&self.d) + WILD) / norm(self.a.column(j)).max(1e-9)
    }

    /// (3), from δ and the multipliers alone.
    fn check(&self, found: &ConstrainedSolution) -> Result<(), TestCaseError> {
        prop_assert!(found.settled, "{found:?}");
        let n = self.a.columns();
        let mut residual = self.a.mul_vec(&found.delta);
        add_scaled(&mut residual, 1.0, &self.d);
        let mut left = self.a.transpose_mul_vec(&residual);
        for (row, mu) in self.rows.iter().zip(&found.row_multipliers) {
            add_scaled(&mut left, *mu, &row.coefficients);
            let slack = row.right - dot(&row.coefficients, &found.delta);
            let unit: Vec<f64> = (0..n).map(|j| self.unit(j, &found.delta)).collect();
            let rounding = 1e-12 * row.terms(&unit);
            prop_assert!(slack >= -rounding && (!row.equal || slack <= rounding), "{slack:e} {rounding:e}");
            prop_assert!(row.equal || *mu == 0.0 || slack <= rounding);
        }
        let size = norm(&self.d) + norm(&residual) + WILD;
        let spread: f64 = (0..n).map(|j| norm(self.a.column(j)) * found.delta[j].abs()).sum();
        for j in 0..n {
            let length = norm(self.a.column(j));
            prop_assert!((left[j] - found.bound_multipliers[j]).abs() <= 1e-11 * length * (size + spread) + 1e-290);
            prop_assert!(self.lower[j] <= found.delta[j] && found.delta[j] <= self.upper[j]);
            match found.active[j] {
                Bound::Free => {}
                Bound::Lower => prop_assert_eq!(found.delta[j], self.lower[j]),
                Bound::Upper => prop_assert_eq!(found.delta[j], self.upper[j]),
            }
        }
        Ok(())
    }
}

const N: usize = 6;

/// How far away starts are, in the units of d.
const WILD: f64 = 5.0;

prop_compose! {
    fn problems(equations: usize, inequalities: usize)(
        entries in prop::collection::vec(-1.0..1.0_f64, 9 * N), d in prop::collection::vec(-3.0..3.0_f64, 9),
        width in prop::collection::vec(0.01..1.0_f64, 2 * N), rows in prop::collection::vec(-1.0..1.0_f64, 9 * N),
        room in prop::collection::vec(prop_oneof![Just(0.0), 0.0..0.3_f64], 9),
        decades in prop::collection::vec(-4.0..4.0_f64, N), weak in 0.0..6.0_f64, open in prop::collection::vec(any::<bool>(), 2 * N),
        corner in any::<bool>(),
    ) -> Problem {
        let unit: Vec<f64> = decades.iter().map(|decade| 10_f64.powf(*decade)).collect();
        let mut a = Matrix::zeros(9, N);
        for j in 0..N {
            for i in 0..9 {
                // the last column nearly repeats the first: condition up to 1e6
                let own = if j == N - 1 { entries[i] + 10_f64.powf(-weak) * entries[j * 9 + i] } else { entries[j * 9 + i] };
                a[(i, j)] = own / unit[j];
            }
        }
        let edge = |k: usize, j: usize| match (open[k], corner) {
            (true, _) => f64::INFINITY,
            (_, true) => 0.0,
            _ => width[k] * unit[j],
        };
        let rows = (0..equations + inequalities).map(|i| Row {
            coefficients: (0..N).map(|j| rows[i * N + j] / unit[j]).collect(),
            right: if i < equations { 0.0 } else { room[i] },
            equal: i < equations,
        }).collect();
        Problem {
            a, d, rows,
            lower: (0..N).map(|j| -edge(j, j)).collect(),
            upper: (0..N).map(|j| edge(N + j, j)).collect(),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_box_alone_is_that_of_the_box_solver(problem in problems(0, 0)) {
        let own = constrained_least_squares(&problem.a, &problem.d, &problem.conditions(), None).unwrap();
        let other = bounded_least_squares(&problem.a, &problem.d, &problem.lower, &problem.upper, None).unwrap();
        problem.check(&own)?;
        let cost = |delta: &[f64]| {
            let mut residual = problem.a.mul_vec(delta);
            add_scaled(&mut residual, 1.0, &problem.d);
            norm(&residual)
        };
        // neither is better by more than the rounding of the terms that cancel in A δ
        let terms = |delta: &[f64]| (0..N).map(|j| norm(problem.a.column(j)) * delta[j].abs()).sum::<f64>();
        let rounding = 1e-14 * (norm(&problem.d) + terms(&own.delta).max(terms(&other.delta)));
        prop_assert!((cost(&own.delta) - cost(&other.delta)).abs() <= rounding);
    }

    #[test]
    fn the_conditions_of_a_minimum_hold(problem in (0..3_usize, 0..7_usize).prop_flat_map(|(e, i)| problems(e, i))) {
        let found = constrained_least_squares(&problem.a, &problem.d, &problem.conditions(), None).unwrap();
        problem.check(&found)?;
        // from its own working set it is there at once
        let start = ConstrainedStart { delta: found.delta.clone(), active: found.active.clone(), rows: found.rows.clone() };
        let again = constrained_least_squares(&problem.a, &problem.d, &problem.conditions(), Some(&start)).unwrap();
        problem.check(&again)?;
    }
}

/// At a corner where the origin alone is left the loop may end before it has found the multipliers: one in ten thousand of these
/// does, and says so.
#[test]
fn a_wrong_start_does_not_matter() {
    const CASES: u32 = 300;
    let strategy = (
        problems(1, 4),
        prop::collection::vec(-WILD..WILD, N),
        prop::collection::vec(prop::sample::select(vec![Bound::Free, Bound::Lower, Bound::Upper]), N),
        prop::collection::vec(any::<bool>(), 5),
    );
    let unsettled = std::cell::Cell::new(0);
    let tried = TestRunner::new(ProptestConfig::with_cases(CASES)).run(&strategy, |(problem, wild, active, rows)| {
        let delta = wild.iter().enumerate().map(|(j, x)| x / norm(problem.a.column(j)).max(1e-9)).collect();
        let start = ConstrainedStart { delta, active, rows };
        let found = constrained_least_squares(&problem.a, &problem.d, &problem.conditions(), Some(&start)).unwrap();
        if found.settled {
            return problem.check(&found);
        }
        unsettled.set(unsettled.get() + 1);
        Ok(())
    });
    tried.unwrap();
    assert!(100 * unsettled.get() <= CASES, "{} of {CASES} did not settle", unsettled.get());
}

#[test]
fn what_no_row_sees_stays_and_what_one_row_asks_is_met_by_the_shortest_step() {
    let a = Matrix::from_rows(3, &[[1.0, 0.0, 0.0]]);
    let rows = [Row { coefficients: vec![0.0, 1.0, 1.0], right: 2.0, equal: true }];
    let conditions = Conditions { lower: &[-9.0; 3], upper: &[9.0; 3], rows: &rows };
    let found = constrained_least_squares(&a, &[-3.0], &conditions, None).unwrap();
    for (found, expected) in found.delta.iter().zip([3.0, 1.0, 1.0]) {
        assert!((found - expected).abs() < 1e-14);
    }
    let none = Conditions { lower: &[], upper: &[], rows: &[] };
    assert!(constrained_least_squares(&Matrix::zeros(1, 0), &[1.0], &none, None).unwrap().settled);
}

#[test]
fn contradictions_are_refused() {
    let rows = [Row { coefficients: vec![1.0, 1.0], right: 5.0, equal: true }];
    let conditions = Conditions { lower: &[0.0; 2], upper: &[1.0; 2], rows: &rows };
    let refused = constrained_least_squares(&Matrix::identity(2), &[0.0; 2], &conditions, None);
    assert_eq!(refused, Err(LinalgError::Infeasible));
    let all = [Condition::Upper(0), Condition::Upper(1), Condition::Row(0)];
    assert_eq!(crate::linalg::conflict(&conditions).unwrap().unwrap(), all);
}

/// Columns that no row of A knows, and rows that are empty: what is left is one number and one inequality.
#[test]
fn an_inequality_stops_a_step_beside_what_is_unknown() {
    let mut a = Matrix::zeros(9, 6);
    (a[(0, 5)], a[(1, 5)], a[(3, 5)]) = (-0.3441035864063423, -0.43822615553031524, -0.8542673357182331);
    let mut d = vec![0.0; 9];
    d[3] = -1.3331884525171493;
    let empty = |equal| Row { coefficients: vec![0.0; 6], right: 0.0, equal };
    let row = Row { coefficients: vec![0.0, 0.2, 0.0, 0.0, 0.0, -0.7], right: 0.0, equal: false };
    let rows = vec![empty(true), empty(false), row];
    let lower = vec![-0.01, -0.01, -0.01, -0.01, -0.01, f64::NEG_INFINITY];
    let upper = vec![0.01, 0.01, 0.01, f64::INFINITY, 0.01, 0.01];
    let problem = Problem { a, d, lower, upper, rows };
    let start = ConstrainedStart { delta: vec![0.0; 6], active: vec![Bound::Free; 6], rows: vec![false; 3] };
    let found = constrained_least_squares(&problem.a, &problem.d, &problem.conditions(), Some(&start)).unwrap();
    problem.check(&found).unwrap();
    assert!(found.delta[5] >= 0.2 * -0.01 / 0.7 - 1e-15, "{found:?}");
}
