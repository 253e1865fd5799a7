//! What `cargo bench --bench peers` compares phical with gives the same residuals and derivatives.

#[path = "../../benches/peers/dual.rs"]
mod dual;
#[path = "../../benches/peers/hand.rs"]
mod hand;
#[path = "../../benches/peers/normal.rs"]
mod normal;

use phical::compile::Program;
use phical::problem::Problem;
use phical::simulate::{Options, simulate};
use phical::solve::{Settings, minimise};
use phical::unit::Dimension;

use crate::close::close;
use crate::flagship::{READINGS, flagship};
use hand::{Line, PARAMETERS, RESIDUAL, Rows, WIDTH};

const LINES: usize = 100;

/// Every entry of residuals and Jacobian over all lines: `[entry][line]`.
fn entries(all: &[Rows]) -> Vec<Vec<f64>> {
    let entry = |entry: usize| all.iter().map(|rows| rows[entry / WIDTH][entry % WIDTH]).collect();
    (0..5 * WIDTH).map(entry).collect()
}

/// Lines of the paper's scenario, and its true parameters.
fn lines(program: &Program) -> (Vec<Line>, Vec<f64>) {
    let options = Options { rows: vec![(0, LINES)], ..Options::default() };
    let simulated = simulate(program, &program.scenarios[0], &options).expect("it simulates");
    let row = |row| simulated.tables[0].1.row(row)[..READINGS].try_into().expect("nine readings");
    ((0..LINES).map(row).collect(), simulated.truth.iter().map(|(_, value)| *value).collect())
}

/// What phical's reference evaluator gives.
fn reference(problem: &Problem, q: &[f64]) -> Vec<Rows> {
    let mut all = Vec::new();
    problem.blocks[0]
        .jacobians(&problem.layout, q, &problem.places(), |found| {
            let mut rows = [[0.0; WIDTH]; 5];
            for (i, row) in rows.iter_mut().enumerate() {
                for (k, &column) in found.columns.iter().enumerate() {
                    row[column] = found.derivatives[i * PARAMETERS + k];
                }
                row[RESIDUAL] = found.residuals[i];
            }
            all.push(rows);
            Ok(())
        })
        .expect("defined");
    all
}

#[test]
fn all_peers_agree() {
    let flagship = flagship();
    let (lines, truth) = lines(&flagship.0);
    let problem = flagship.bound(&lines.concat());
    let nominal = problem.start.clone();
    let third: Vec<f64> = (0..PARAMETERS)
        .map(|k| {
            let reach = if problem.layout.coordinates[k].dimension == Dimension::ANGLE { 0.2 } else { 100.0 };
            nominal[k] + reach * (1.0 + 7.3 * k as f64).sin()
        })
        .collect();
    for (what, q) in [("nominal", nominal), ("truth", truth), ("third", third)] {
        let expected = entries(&reference(&problem, &q));
        let mut rows = vec![[[0.0; WIDTH]; 5]; LINES];
        let by_hand = hand::Pair::new(&q);
        lines.iter().zip(&mut rows).for_each(|(line, rows)| by_hand.linearise(line, rows));
        for (line, rows) in lines.iter().zip(&rows) {
            close(&by_hand.residuals(line), &rows.map(|row| row[RESIDUAL]), 1e-12, "residuals alone");
        }
        let found_by_hand = entries(&rows);
        let dual = dual::Pair::new(&q);
        lines.iter().zip(&mut rows).for_each(|(line, rows)| dual.linearise(line, rows));
        let found_by_dual = entries(&rows);
        for (name, found) in [("hand", found_by_hand), ("dual", found_by_dual)] {
            for (entry, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let what = format!("{name} at {what}: residual {}, column {}", entry / WIDTH, entry % WIDTH);
                close(found, expected, 1e-9, &what);
            }
        }
    }
}

#[test]
fn the_fit_by_hand_agrees() {
    let flagship = flagship();
    let lines = lines(&flagship.0).0;
    let problem = flagship.bound(&lines.concat());
    let found = normal::fit(&problem.start, &lines);
    let expected = minimise(&problem, problem.start.clone(), &Settings::default()).expect("it starts");
    close(&[found.cost], &[expected.cost], 1e-8, "cost");
    assert!(found.trials < 20);
}
