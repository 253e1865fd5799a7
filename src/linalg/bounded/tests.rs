//! Against every possible active set, against the Karush–Kuhn–Tucker conditions, and at corners.

use super::*;
use proptest::prelude::*;

/// The best cost over all 3ⁿ active sets whose minimiser lies in the box.
fn brute_force(a: &Matrix, d: &[f64], lower: &[f64], upper: &[f64]) -> f64 {
    let n = a.columns();
    let mut best = f64::INFINITY;
    for code in 0..3_usize.pow(u32::try_from(n).unwrap()) {
        let mut delta = vec![0.0; n];
        let (mut free, mut rest) = (vec![], code);
        for j in 0..n {
            match rest % 3 {
                0 => free.push(j),
                1 => delta[j] = lower[j],
                _ => delta[j] = upper[j],
            }
            rest /= 3;
        }
        let mut residual = a.mul_vec(&delta);
        add_scaled(&mut residual, 1.0, d);
        if !free.is_empty() {
            let mut columns: Vec<&[f64]> = free.iter().map(|&j| a.column(j)).collect();
            columns.push(&residual);
            let mut information = SquareRootInformation::new(free.len());
            information.absorb(&mut Matrix::from_columns(a.rows(), &columns)).unwrap();
            let Ok(x) = solve_upper(information.r(), &information.d().iter().map(|d| -d).collect::<Vec<_>>()) else {
                continue;
            };
            for (&j, x) in free.iter().zip(x) {
                delta[j] = x;
            }
        }
        if (0..n).all(|j| delta[j] >= lower[j] - 1e-12 && delta[j] <= upper[j] + 1e-12) {
            let mut residual = a.mul_vec(&delta);
            add_scaled(&mut residual, 1.0, d);
            best = best.min(0.5 * dot(&residual, &residual));
        }
    }
    best
}

fn cost(a: &Matrix, d: &[f64], delta: &[f64]) -> f64 {
    let mut residual = a.mul_vec(delta);
    add_scaled(&mut residual, 1.0, d);
    0.5 * dot(&residual, &residual)
}

/// On the bounds where active, inside where free, and (1) holds.
fn check(solution: &BoundedSolution, lower: &[f64], upper: &[f64]) {
    assert!(solution.settled, "{solution:?}");
    for (j, active) in solution.active.iter().enumerate() {
        let (x, g) = (solution.delta[j], solution.multipliers[j]);
        assert!(lower[j] <= x && x <= upper[j]);
        match active {
            Bound::Free => assert_eq!(g, 0.0),
            Bound::Lower => assert!(x == lower[j] && (g >= -1e-10 || lower[j] == upper[j])),
            Bound::Upper => assert!(x == upper[j] && g <= 1e-10),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_active_set_does_better(
        n in 1_usize..=5,
        entries in prop::collection::vec(-1.0..1.0_f64, 25),
        d in prop::collection::vec(-3.0..3.0_f64, 5),
        centre in prop::collection::vec(-1.0..1.0_f64, 5),
        width in prop::collection::vec(prop_oneof![Just(0.0), 0.0..2.0_f64], 5),
        guess in prop::collection::vec(0..3_u8, 5),
    ) {
        let a = Matrix::from_columns(n, &(0..n).map(|j| &entries[5 * j..5 * j + n]).collect::<Vec<_>>());
        let lower: Vec<f64> = (0..n).map(|j| centre[j] - width[j]).collect();
        let upper: Vec<f64> = (0..n).map(|j| centre[j] + width[j]).collect();
        let cold = bounded_least_squares(&a, &d[..n], &lower, &upper, None).unwrap();
        let start = Start {
            delta: centre[..n].to_vec(),
            active: guess[..n].iter().map(|g| [Bound::Free, Bound::Lower, Bound::Upper][usize::from(*g)]).collect(),
        };
        let warm = bounded_least_squares(&a, &d[..n], &lower, &upper, Some(&start)).unwrap();
        let best = brute_force(&a, &d[..n], &lower, &upper);
        for solution in [&cold, &warm] {
            check(solution, &lower, &upper);
            let cost = cost(&a, &d[..n], &solution.delta);
            prop_assert!((cost - best).abs() <= 1e-11 * (1.0 + best), "{cost} {best}");
        }
    }

    #[test]
    fn ill_conditioned_problems_of_21_satisfy_the_conditions(
        entries in prop::collection::vec(-1.0..1.0_f64, 21 * 21),
        d in prop::collection::vec(-1.0..1.0_f64, 21),
        decades in 0.0..8.0_f64,
    ) {
        // Singular values from 1 down to 10^−decades.
        let n = 21;
        let random = Matrix::from_columns(n, &entries.chunks(n).collect::<Vec<_>>());
        let Svd { u, v, .. } = svd(&random).unwrap();
        let sigma: Vec<f64> = (0..n).map(|k| 10_f64.powf(-decades * k as f64 / 20.0)).collect();
        let a = u.scale_columns(&sigma).mul(&v.transpose());
        let (lower, upper) = (vec![-0.5; n], vec![0.8; n]);
        let cold = bounded_least_squares(&a, &d, &lower, &upper, None).unwrap();
        check(&cold, &lower, &upper);
        // From its own active set the solution comes back at once.
        let start = Start { delta: vec![0.0; n], active: cold.active.clone() };
        let warm = bounded_least_squares(&a, &d, &lower, &upper, Some(&start)).unwrap();
        check(&warm, &lower, &upper);
        prop_assert!(warm.iterations <= cold.iterations);
        for (a, b) in warm.delta.iter().zip(&cold.delta) {
            prop_assert!((a - b).abs() <= 1e-14 * 10_f64.powf(decades) * 100.0);
        }
    }
}

use super::super::Svd;

#[test]
fn without_bounds_it_is_least_squares() {
    let a = Matrix::from_rows(2, &[[2.0, 1.0], [0.0, 4.0], [0.0, 0.0]]);
    let free = [f64::INFINITY; 2];
    let solution = bounded_least_squares(&a, &[-4.0, -8.0, 1.0], &free.map(|b| -b), &free, None).unwrap();
    assert_eq!(solution.active, [Bound::Free; 2]);
    assert!((solution.delta[0] - 1.0).abs() < 1e-15 && (solution.delta[1] - 2.0).abs() < 1e-15);
}

#[test]
fn an_unseen_direction_stays_where_it_was() {
    // Only δ₁ + 10 δ₂ is seen.
    let a = Matrix::from_rows(3, &[[1.0, 10.0, 0.0]]);
    let (lower, upper) = ([-9.0; 3], [9.0; 3]);
    let shortest = bounded_least_squares(&a, &[-101.0], &lower, &[9.0, 20.0, 9.0], None).unwrap();
    assert!((shortest.delta[0] - 1.0).abs() < 1e-14 && (shortest.delta[1] - 10.0).abs() < 1e-14);
    assert_eq!(shortest.delta[2], 0.0);
    let held = bounded_least_squares(&a, &[-91.0], &lower, &upper, None).unwrap();
    assert_eq!(held.active[1], Bound::Upper);
    assert!((held.delta[0] - 1.0).abs() < 1e-13 && held.settled);
    let start = Start { delta: vec![0.0, 0.0, 5.0], active: vec![Bound::Free; 3] };
    assert_eq!(bounded_least_squares(&a, &[1.0], &lower, &upper, Some(&start)).unwrap().delta[2], 5.0);
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let a = Matrix::identity(1);
    let solve = |d: f64, lower: f64, upper: f64| bounded_least_squares(&a, &[d], &[lower], &[upper], None);
    assert_eq!(solve(0.0, 1.0, 0.0), Err(LinalgError::EmptyBox(0)));
    assert_eq!(solve(0.0, f64::NAN, 0.0), Err(LinalgError::EmptyBox(0)));
    assert_eq!(solve(0.0, f64::INFINITY, f64::INFINITY), Err(LinalgError::EmptyBox(0)));
    assert_eq!(solve(f64::NAN, 0.0, 1.0), Err(LinalgError::NotFinite));
    assert!(bounded_least_squares(&a, &[], &[0.0], &[1.0], None).is_err());
    assert!(bounded_least_squares(&a, &[0.0], &[], &[1.0], None).is_err());
    let fixed = solve(5.0, 2.0, 2.0).unwrap();
    assert!(fixed.settled && fixed.delta == [2.0] && fixed.multipliers == [7.0]);
}
