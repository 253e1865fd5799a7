//! Other norms, against closed forms.

use super::super::super::{Norm, Relation, StartError};
use super::super::{Closure, Dual};
use crate::statistics::{Kernel, Loss};
use num_dual::DualNum;

const DATA: [f64; 7] = [3.1, -2.0, 4.4, 0.3, 19.0, 5.2, 2.7];

fn location() -> Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>> {
    Closure::new(1, |q| Some(DATA.iter().map(|y| q[0].clone() - *y).collect()))
}

fn solved(problem: &Closure<impl Fn(&[Dual]) -> Option<Vec<Dual>>>, start: &[f64], norm: Norm) -> (Vec<f64>, f64) {
    let solution = problem.try_conic(start, norm).expect("a start");
    assert!(solution.status.converged(), "{norm:?} {:?} {:#?}", solution.status, solution.trace);
    (solution.point, solution.cost)
}

#[test]
fn the_median_and_the_midrange() {
    for start in [0.0, 3.1, -300.0] {
        let (point, cost) = solved(&location(), &[start], Norm::L1);
        assert!((point[0] - 3.1).abs() < 1e-8, "{point:?}");
        assert!((cost - DATA.iter().map(|y| (y - 3.1).abs()).sum::<f64>()).abs() < 1e-8);
        let (point, cost) = solved(&location(), &[start], Norm::Minimax);
        assert!((point[0] - 8.5).abs() < 1e-8 && (cost - 10.5).abs() < 1e-8, "{point:?} {cost}");
        let (point, _) = solved(&location(), &[start], Norm::Huber(1e9));
        assert!((point[0] - DATA.iter().sum::<f64>() / 7.0).abs() < 1e-7, "{point:?}");
    }
}

#[test]
fn hubers_function_is_that_of_reweighting() {
    let k = 1.345;
    let loss = Loss::new(Kernel::Huber, Some(k)).unwrap();
    let mut expected = 3.0;
    for _ in 0..2000 {
        let weights = DATA.map(|y| loss.weight((y - expected) * (y - expected)));
        expected = DATA.iter().zip(weights).map(|(y, w)| w * y).sum::<f64>() / weights.iter().sum::<f64>();
    }
    let (point, cost) = solved(&location(), &[0.0], Norm::Huber(k));
    assert!((point[0] - expected).abs() < 1e-7, "{} {expected}", point[0]);
    let told: f64 = DATA.iter().map(|y| 0.5 * loss.rho((y - expected).powi(2))).sum();
    assert!((cost - told).abs() < 1e-8 * told, "{cost} {told}");
}

#[test]
fn a_line_goes_through_what_agrees() {
    // Five points of y = 2 x + 1 and two that are far off: the sum of moduli does not see them.
    let y = [1.0, 3.0, 5.0, 70.0, 9.0, -40.0, 13.0];
    let line =
        || Closure::new(2, move |q| Some((0..7).map(|i| q[0].clone() + q[1].clone() * i as f64 - y[i]).collect()));
    let (point, cost) = solved(&line(), &[0.0, 0.0], Norm::L1);
    assert!((point[0] - 1.0).abs() < 1e-7 && (point[1] - 2.0).abs() < 1e-7, "{point:?}");
    assert!((cost - 63.0 - 51.0).abs() < 1e-6);
    // with an equation, a bound and a prior on top
    let mut tied = line();
    tied.ask(Relation::Equal, |q| q[0].clone() - q[1].clone());
    tied.upper[1] = 1.5;
    let solution = tied.try_conic(&[0.0, 0.0], Norm::L1).expect("a start");
    let there = solution.point.iter().all(|x| (x - 1.5).abs() < 1e-8);
    assert!(there && solution.status.converged(), "{:?} {:?} {:#?}", solution.point, solution.status, solution.trace);
    assert!(solution.multipliers[1] < 0.0 && solution.trace.iter().all(|trial| trial.conic.is_some()));
}

#[test]
fn priors_stay_squares() {
    // |q − 4| + ½ (q/2)² : where the slope 1 meets q/4, beyond the datum, so at q = 4 … of −1 + q/4 = 0.
    let mut problem = Closure::new(1, |q| Some(vec![(q[0].clone() - 10.0), q[0].clone() * 0.5]));
    problem.priors = 1;
    let (point, cost) = solved(&problem, &[0.0], Norm::L1);
    assert!((point[0] - 4.0).abs() < 1e-5 && (cost - 8.0).abs() < 1e-8, "{point:?} {cost}");
}

#[test]
fn curved_models_are_fitted_in_every_norm() {
    // 2 exp(−x t) of exact data but for one outlier.
    let problem = Closure::new(2, |q| {
        Some(
            (0..8)
                .map(|i| {
                    let t = 0.25 * i as f64;
                    let off = if i == 3 { 1.0 } else { 0.0 };
                    (q[1].clone() * -t).exp() * &q[0] - 2.0 * (-0.7 * t).exp() - off
                })
                .collect(),
        )
    });
    let (point, _) = solved(&problem, &[1.0, 0.1], Norm::L1);
    assert!((point[0] - 2.0).abs() < 1e-7 && (point[1] - 0.7).abs() < 1e-7, "{point:?}");
    let (_, cost) = solved(&problem, &[1.0, 0.1], Norm::Minimax);
    assert!(cost < 0.6 && cost > 0.4, "{cost}");
}

#[test]
fn rows_are_needed() {
    struct Silent;
    use crate::linalg::{LinalgError, Matrix, SquareRootInformation};
    use crate::solve::{Conic, LeastSquares, Solver};
    impl LeastSquares for Silent {
        type Point = Vec<f64>;
        type Error = LinalgError;
        fn dimension(&self) -> usize {
            1
        }
        fn cost(&self, q: &Vec<f64>) -> Result<f64, LinalgError> {
            Ok(0.5 * q[0] * q[0])
        }
        fn linearise(&self, q: &Vec<f64>) -> Result<SquareRootInformation, LinalgError> {
            SquareRootInformation::from_rows(&Matrix::identity(1), q)
        }
        fn retract(&self, q: &Vec<f64>, delta: &[f64]) -> Vec<f64> {
            vec![q[0] + delta[0]]
        }
        fn offset(&self, q: &Vec<f64>) -> Vec<f64> {
            q.clone()
        }
        fn scale(&self) -> &[f64] {
            &[1.0]
        }
    }
    let refused = Conic { norm: Norm::L1, ..Conic::default() }.solve(&Silent, vec![1.0]);
    assert_eq!(refused.err(), Some(StartError::Rows));
    assert!(Conic::default().solve(&Silent, vec![1.0]).is_ok_and(|solution| solution.point[0].abs() < 1e-12));
}
