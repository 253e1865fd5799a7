//! Rows one at a time against all at once.

use phical::compile::Program;
use phical::data::Table;
use phical::fit::{Fit, analyse};
use phical::linalg::{Matrix, SquareRootInformation};
use phical::problem::{Options, Problem, Selection, Weights};
use phical::simulate::{self, simulate};
use phical::solve::{InRows, Keep, LeastSquares, LevenbergMarquardt, Sequential, SequentialState, Settings, Solver};
use phical::statistics::chi_squared_upper_tail;
use proptest::prelude::*;

use crate::fitting::{fit, table};
use crate::flagship::{compiled, flagship};

type State = SequentialState<Vec<f64>, (usize, usize)>;

type Tables = Vec<(usize, Table)>;
type Truth = Vec<(String, f64)>;

/// Rows of the flagship, and the true values of its coordinates in internal units.
fn simulated(program: &Program, rows: usize, seed: u64) -> (Tables, Truth) {
    let options = simulate::Options { rows: vec![(0, rows)], seed: Some(seed), exact: false };
    let simulated = simulate(program, &program.scenarios[0], &options).expect("it simulates");
    (simulated.tables, simulated.truth)
}

fn bound<'p>(program: &'p Program, tables: Vec<(usize, Table)>, free: &[&str], start: &[(String, f64)]) -> Problem<'p> {
    let free = free.iter().map(|name| (*name).to_owned()).collect();
    let selection = Selection { free, start: start.to_vec(), ..Selection::default() };
    Problem::bind(program, tables, &Options { selection, ..Options::default() }).expect("it binds").0
}

fn begun(problem: &Problem, keep: Keep) -> State {
    State::new(problem, problem.start.clone(), keep, Settings::default())
}

fn finished(problem: &Problem, state: &mut State) -> Fit {
    let solution = state.estimate(problem).expect("it starts").clone();
    analyse(&problem.seen_by(state), solution).expect("defined")
}

/// The same estimates to a share of their sigmas, and the same covariances.
#[track_caller]
fn same(one: &Fit, other: &Fit, of_sigma: f64, of_covariance: f64) {
    for (i, (a, b)) in one.parameters.iter().zip(&other.parameters).enumerate() {
        assert_eq!((&a.name, a.estimable), (&b.name, b.estimable));
        let (Some(sigma), Some(covariance)) = (b.sigma, &one.covariance) else { continue };
        assert!((a.value - b.value).abs() <= of_sigma * sigma, "{}: {} {} {sigma}", a.name, a.value, b.value);
        let expected = other.covariance.as_ref().expect("a covariance");
        for j in 0..=i {
            let size = (expected.entries[i][i] * expected.entries[j][j]).sqrt();
            let (a, b) = (covariance.entries[i][j], expected.entries[i][j]);
            assert!((a - b).abs() <= of_covariance * size, "{i} {j}: {a} {b}");
        }
    }
}

#[test]
fn with_rows_kept_every_estimate_is_that_of_the_batch_in_any_order() {
    let flagship = flagship();
    let (tables, _) = simulated(&flagship.0, 120, 4);
    let problem = bound(&flagship.0, tables, &[], &[]);
    let orders: [Vec<usize>; 2] = [(0..120).collect(), (0..120).map(|i| (i * 77 + 5) % 120).collect()];
    for order in orders {
        let mut state = begun(&problem, Keep::All);
        for (count, &row) in order.iter().enumerate() {
            state.add(&problem, &[(0, row)]).expect("defined");
            if ![10, 100, 120].contains(&(count + 1)) {
                continue;
            }
            let found = finished(&problem, &mut state);
            let others: Vec<usize> = order[count + 1..].to_vec();
            let batch = fit(&problem.without_rows(&[others]));
            same(&found, &batch, 1e-8, 1e-6);
            assert_eq!((found.equations, found.dof), (batch.equations, batch.dof));
        }
    }
}

#[test]
fn the_solver_is_one_of_the_solvers() {
    let flagship = flagship();
    let (tables, _) = simulated(&flagship.0, 90, 8);
    let problem = bound(&flagship.0, tables, &["L1.b"], &[]);
    let solvers: [&dyn Solver<Problem>; 2] = [&LevenbergMarquardt::default(), &Sequential::default()];
    let fits = solvers.map(|solver| {
        let solution = solver.solve(&problem, problem.start.clone()).expect("it starts");
        assert!(solution.status.converged(), "{}", solver.name());
        analyse(&problem, solution).expect("defined")
    });
    same(&fits[1], &fits[0], 1e-7, 1e-6);
    assert_eq!(fits[1].null_directions.len(), 1);
}

const PARABOLA: &str = r#"(
    name: "parabola",
    parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(0)), "c": Scalar(Free(nominal: 0, sigma: 3)) },
    measurements: { "point": (inputs: {"x": (), "y": ()}, residuals: {"r": (value: "y - a - b*x - c*x^2", sigma: "0.3")}) },
)"#;

fn parabola(rows: usize) -> Table {
    let wave = |i: usize| 0.3 * ((i * i) as f64 * 0.7).sin();
    let row = |i: usize| vec![i as f64 * 0.1, 2.0 - 0.5 * i as f64 * 0.1 + wave(i)];
    table(&(0..rows).map(row).collect::<Vec<_>>())
}

#[test]
fn linear_problems_need_no_rows() {
    let program = compiled(PARABOLA);
    let problem = bound(&program, vec![(0, parabola(300))], &[], &[]);
    let batch = fit(&problem);
    for keep in [Keep::AtStart, Keep::Last(0), Keep::Last(7)] {
        let mut state = begun(&problem, keep);
        problem.rows().iter().for_each(|row| state.add(&problem, &[*row]).expect("defined"));
        assert!(state.kept().len() < 80);
        let found = finished(&problem, &mut state);
        same(&found, &batch, 1e-12, 1e-12);
        assert!((found.cost / batch.cost - 1.0).abs() < 1e-12, "{} {}", found.cost, batch.cost);
        assert_eq!((found.dof, found.equations, found.priors), (batch.dof, batch.equations, 1));
        assert!(found.verdict().trustworthy() == batch.verdict().trustworthy());
    }
}

#[test]
fn rows_that_are_gone_leave_honest_uncertainties() {
    let seeds: u64 = std::env::var("PHICAL_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(20);
    let flagship = flagship();
    let (mut sum, mut parameters) = (0.0, 0);
    for seed in 0..seeds {
        let (tables, truth) = simulated(&flagship.0, 300, 500 + seed);
        // the datum where it truly is, so that nothing takes it up as bias
        let datum: Vec<(String, f64)> = truth.iter().filter(|(name, _)| name == "L1.b").cloned().collect();
        let problem = bound(&flagship.0, tables.clone(), &[], &datum);
        let mut state = begun(&problem, Keep::Last(40));
        problem.rows().chunks(16).for_each(|rows| state.add(&problem, rows).expect("defined"));
        let fit = finished(&problem, &mut state);
        assert!(fit.status.converged() && state.kept().len() < 110);
        let value = |name: &str| truth.iter().find(|(known, _)| known == name).expect("a truth").1;
        let error: Vec<f64> = fit.parameters.iter().map(|p| (p.value - value(&p.name)) / p.reported).collect();
        let solution = state.estimate(&problem).expect("it is there");
        let seen = solution.information.r().mul_vec(&error);
        sum += seen.iter().map(|e| e * e).sum::<f64>();
        parameters += error.len();

        // and with the datum free, nothing is claimed of it
        let problem = bound(&flagship.0, tables, &["L1.b"], &[]);
        let mut state = begun(&problem, Keep::Last(40));
        problem.rows().chunks(16).for_each(|rows| state.add(&problem, rows).expect("defined"));
        let fit = finished(&problem, &mut state);
        assert_eq!((fit.rank, fit.null_directions.len()), (20, 1));
        let blind: Vec<&str> = fit.parameters.iter().filter(|p| p.sigma.is_none()).map(|p| p.name.as_str()).collect();
        assert_eq!(blind, ["L1.b", "R1.b"]);
        let z: Vec<f64> = state.estimate(&problem).expect("it is there").invisible[0].clone();
        let delta: Vec<f64> = z.iter().zip(problem.scale()).map(|(z, scale)| z * scale).collect();
        let absorbed = &state.absorbed().information;
        let claimed = phical::linalg::norm(&absorbed.r().mul_vec(&delta));
        let alone = absorbed.r().column_norms().iter().zip(&delta).map(|(r, d)| (r * d).powi(2)).sum::<f64>().sqrt();
        assert!(claimed < 1e-3 * alone, "{claimed} {alone}");
    }
    let tail = chi_squared_upper_tail(sum, f64::from(parameters as u32)).expect("a probability");
    assert!(tail > 1e-4 && tail < 1.0 - 1e-4, "{sum} at {parameters}");
}

#[test]
fn parts_made_at_one_point_merge_to_one_pass() {
    // the corrections of readings stand still to a share of their errors only, and a little sooner or later among other rows
    for (weights, share) in [(Weights::Unit, 1e-12), (Weights::Propagated, 1e-8)] {
        parts_merge(weights, share);
    }
}

fn parts_merge(weights: Weights, share: f64) {
    let flagship = flagship();
    let (tables, _) = simulated(&flagship.0, 100, 31);
    let selection = Selection { free: vec!["L1.b".to_owned()], ..Selection::default() };
    let options = Options { weights: Some(weights), selection, ..Options::default() };
    let problem = Problem::bind(&flagship.0, tables, &options).expect("it binds").0;
    let rows = problem.rows();
    let of = |rows: &[(usize, usize)], problem: &Problem, keep: Keep| {
        let mut state = begun(problem, keep);
        state.add(problem, rows).expect("defined");
        state
    };
    let whole = of(&rows, &problem, Keep::AtStart);
    let mut merged = of(&rows[..13], &problem, Keep::AtStart);
    for part in [13..14, 14..60, 60..100] {
        merged.merge(&problem, &of(&rows[part], &problem, Keep::AtStart)).expect("one point");
    }
    let (a, b) = (&merged.absorbed().information, &whole.absorbed().information);
    assert_eq!((a.rows(), b.rows()), (500, 500));
    let (a, b) = (gram(a), gram(b));
    let size = |i: usize| b[i][i].sqrt();
    for i in 0..a.len() {
        (0..a.len()).for_each(|j| assert!((a[i][j] - b[i][j]).abs() <= share * size(i) * size(j), "{i} {j}"));
    }
    // kept rows are relinearised, wherever they come from
    let mut halves = of(&rows[..50], &problem, Keep::All);
    halves.merge(&problem, &of(&rows[50..], &problem, Keep::All)).expect("rows");
    same(&finished(&problem, &mut halves), &fit(&problem), 1e-7, 1e-6);
    let mut elsewhere = problem.clone();
    elsewhere.start[0] += 1e-3;
    assert!(merged.merge(&problem, &of(&rows[..5], &elsewhere, Keep::AtStart)).is_err());
}

/// \[R d\]ᵀ\[R d\] with the rest.
fn gram(of: &SquareRootInformation) -> Vec<Vec<f64>> {
    let n = of.dimension();
    let column = |j: usize| if j < n { of.r().column(j) } else { of.d() };
    let product = |i: usize, j: usize| column(i).iter().zip(column(j)).map(|(a, b)| a * b).sum::<f64>();
    let rest = |i: usize, j: usize| if i == n && j == n { of.rest() } else { 0.0 };
    (0..=n).map(|i| (0..=n).map(|j| product(i, j) + rest(i, j)).collect()).collect()
}

#[test]
fn a_row_taken_out_was_never_there() {
    let flagship = flagship();
    let (tables, _) = simulated(&flagship.0, 60, 12);
    let mut problem = bound(&flagship.0, tables, &[], &[]);
    let rows = problem.rows();
    let without = fit(&problem.without_rows(&[vec![7]]));
    let with = fit(&problem);
    let mut state = begun(&problem, Keep::All);
    rows.iter().for_each(|row| state.add(&problem, &[*row]).expect("defined"));
    state.remove(&mut problem, (0, 7)).expect("it is there");
    same(&finished(&problem, &mut state), &without, 1e-8, 1e-6);
    problem.set_weight((0, 7), 1.0);
    state.add(&problem, &[(0, 7)]).expect("defined");
    same(&finished(&problem, &mut state), &with, 1e-8, 1e-6);
    // counted twice, it is as if it were there twice
    let mut table = Table::new(0, flagship.width());
    (0..60)
        .chain([7])
        .for_each(|row| table.push(&[], &problem.blocks[0].table.row(row), None).expect("a row of the table"));
    let twice = fit(&bound(&flagship.0, vec![(0, table)], &[], &[]));
    state.reweight(&mut problem, (0, 7), (1.0, 2.0)).expect("it is there");
    let found = finished(&problem, &mut state);
    same(&found, &twice, 1e-8, 1e-6);
    assert!((found.cost / twice.cost - 1.0).abs() < 1e-10);

    // absorbed at one point, it can be taken out there
    problem.set_weight((0, 7), 1.0);
    let mut state = begun(&problem, Keep::AtStart);
    state.add(&problem, &rows).expect("defined");
    let before = gram(&state.absorbed().information);
    state.remove(&mut problem, (0, 7)).expect("it was absorbed");
    assert!(state.remove(&mut problem, (0, 7)).is_ok(), "a row that counts nothing takes nothing away");
    problem.set_weight((0, 7), 1.0);
    state.add(&problem, &[(0, 7)]).expect("defined");
    let after = gram(&state.absorbed().information);
    for i in 0..before.len() {
        for j in 0..before.len() {
            let size = (before[i][i] * before[j][j]).sqrt();
            assert!((after[i][j] - before[i][j]).abs() <= 1e-9 * size, "{i} {j}");
        }
    }
}

proptest! {
    // one case in twenty thousand leaves so little of a pivot that the rotations have to give up
    #![proptest_config(ProptestConfig::with_cases(40_000))]

    /// What is taken out again was never there, also where it alone saw a direction.
    #[test]
    fn removal_undoes_a_merge(
        n in 1_usize..6, rows in 0_usize..9, more in 1_usize..5, blind in 0_usize..6,
        entries in prop::collection::vec(-1.0..1.0_f64, 19 * 7),
    ) {
        let part = |from: usize, count: usize, blind: usize| {
            let row = |i: usize| {
                let mut row = entries[(from + i) * 7..][..=n].to_vec();
                if blind < n { row[blind] = 0.0; }
                row
            };
            let mut information = SquareRootInformation::new(n);
            information.absorb(&mut Matrix::from_rows(n + 1, &(0..count).map(row).collect::<Vec<_>>())).unwrap();
            information
        };
        let (first, second) = (part(0, rows, blind), part(9, more, 9));
        let mut both = first.clone();
        both.merge(&second).unwrap();
        both.remove(&second).unwrap();
        prop_assert_eq!(both.rows(), first.rows());
        let (found, wanted) = (gram(&both), gram(&first));
        for i in 0..=n {
            for j in 0..=n {
                prop_assert!((found[i][j] - wanted[i][j]).abs() < 1e-9, "{:?} {:?}", found, wanted);
            }
        }
        let mut none = first.clone();
        prop_assert!(none.remove(&part(9, rows + 1, 9)).is_err());
    }
}

#[test]
fn weights_and_losses_have_rows_too() {
    let flagship = flagship();
    let (tables, _) = simulated(&flagship.0, 60, 3);
    for weights in [Weights::Unit, Weights::Propagated] {
        let options = Options { weights: Some(weights), ..Options::default() };
        let problem = Problem::bind(&flagship.0, tables.clone(), &options).expect("it binds").0;
        let mut state = begun(&problem, Keep::All);
        problem.rows().iter().for_each(|row| state.add(&problem, &[*row]).expect("defined"));
        same(&finished(&problem, &mut state), &fit(&problem), 1e-8, 1e-6);
    }
}
