//! Derivatives by dual numbers against differences, on random models.

use std::cell::Cell;

use num_dual::{Dual2_64, HyperDual64};
use phical::compile::Program;
use phical::eval::{Evaluator, Leaf};
use phical::graph::{Instruction, Operation, Tape};
use phical::problem::{Quantities, Selection};
use phical::testing::differences;
use proptest::test_runner::{Config, TestCaseError, TestRunner};

use crate::fitting::{bound, table};
use crate::flagship::compiled;
use crate::random::{Random, models};

/// The leaves of the only measurement at the nominal values.
fn nominal(program: &Program) -> Vec<f64> {
    let measurement = &program.measurements[0];
    let mut leaves = vec![0.0; measurement.leaves];
    for slot in &measurement.slots {
        let nominal = &program.parameters[slot.parameter].setting.nominal;
        leaves[slot.first_leaf..slot.first_leaf + nominal.len()].copy_from_slice(nominal);
    }
    leaves
}

/// Whether a derivative does not exist, such as that of the norm of a vector that is zero, or ends so near, at a corner, that
/// even the finest differences reach across.
fn at_an_edge(tape: &Tape, leaves: &[f64], row: &[f64]) -> bool {
    const NEAR: f64 = 0.02;
    let mut slots = tape.begin(leaves);
    tape.row(row, &mut slots);
    let corner = |at: &Instruction| {
        let (x, y) = (slots[at.x as usize], slots[at.y as usize]);
        match at.operation {
            Operation::Abs => x.abs() < NEAR,
            Operation::Sqrt => x < NEAR * NEAR,
            Operation::Atan2 => x.hypot(y) < NEAR,
            _ => false,
        }
    };
    tape.undefined(&slots, true).is_some() || tape.instructions().iter().any(corner)
}

/// How many derivatives were compared, and how many of those by differences that are good to 1e-7.
#[derive(Default)]
struct Tally {
    all: Cell<usize>,
    sharp: Cell<usize>,
}

impl Tally {
    fn compare(
        &self,
        dual: f64,
        difference: (f64, f64),
        size: f64,
        what: impl Fn() -> String,
    ) -> Result<(), TestCaseError> {
        let (expected, error) = difference;
        self.all.set(self.all.get() + 1);
        let unit = 1.0 + size.abs() + dual.abs();
        // near a corner or a pole differences show nothing
        if error > 1e-7 * unit && dual.is_finite() {
            return Ok(());
        }
        self.sharp.set(self.sharp.get() + 1);
        let off = (dual - expected).abs();
        if off > 30.0 * error + 1e-9 * unit || !dual.is_finite() {
            return Err(TestCaseError::fail(format!("{}: {dual:e} by duals, {expected:e} ± {error:e}", what())));
        }
        Ok(())
    }

    /// Nothing is shown by differences that are good for nothing.
    fn assert_sharp(&self) {
        let (all, sharp) = (self.all.get(), self.sharp.get());
        eprintln!("{all} derivatives, {sharp} of them by sharp differences");
        assert!(all > 10_000 && sharp as f64 > 0.95 * all as f64, "{sharp} of {all}");
    }
}

fn runner(cases: u32) -> TestRunner {
    TestRunner::new(Config { cases, max_global_rejects: cases, failure_persistence: None, ..Config::default() })
}

fn first_derivatives(random: &Random, tally: &Tally, mistake: f64) -> Result<(), TestCaseError> {
    let program = compiled(&random.text);
    let problem = bound(&program, &[table(&random.rows)], Selection::default(), None);
    let (block, q, n) = (&problem.blocks[0], &problem.start, problem.free.len());
    let names = |i: usize| program.measurements[0].residuals[i].name.clone();
    let mut found: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let leaves = nominal(&program);
    if random.rows.iter().any(|row| at_an_edge(&block.measurement.tape, &leaves, row)) {
        return Err(TestCaseError::reject("a derivative does not exist"));
    }
    let linearised = block.jacobians(&problem.layout, q, &problem.places(), |row| {
        let m = row.residuals.len();
        let mut dense = vec![0.0; m * n];
        for i in 0..m {
            for (k, &column) in row.columns.iter().enumerate() {
                dense[i * n + column] += row.derivatives[i * row.columns.len() + k] * mistake;
            }
        }
        found.push((row.residuals.to_vec(), dense));
        Ok(())
    });
    linearised.map_err(|error| TestCaseError::fail(error.to_string()))?;
    let m = found[0].0.len();
    use phical::solve::LeastSquares;
    for k in 0..n {
        let at = |h: f64| {
            let mut delta = vec![0.0; n];
            delta[k] = h;
            let mut rows = Vec::new();
            let moved = problem.retract(q, &delta);
            block
                .values(Quantities::Residuals, &problem.layout, &moved, |_, values| rows.extend_from_slice(values))
                .ok()?;
            Some(rows)
        };
        let expected = differences(m * found.len(), at);
        for (row, (values, derivatives)) in found.iter().enumerate() {
            for i in 0..m {
                let name =
                    || format!("row {row}, {} by {}", names(i), problem.layout.coordinates[problem.free[k]].name);
                tally.compare(derivatives[i * n + k], expected[row * m + i], values[i], name)?;
            }
        }
    }
    let mut outcome = Ok(());
    block
        .input_jacobians(&problem.layout, q, |row, evaluate| {
            let inputs = random.rows[row].clone();
            let used = block.measurement.tape.inputs();
            let (mut values, mut derivatives) = (vec![0.0; m], vec![0.0; m * used]);
            evaluate(&inputs, &mut values, &mut derivatives);
            let evaluate = std::cell::RefCell::new(evaluate);
            for k in 0..used {
                let at = |h: f64| {
                    let mut moved = inputs.clone();
                    moved[k] += h;
                    let (mut values, mut derivatives) = (vec![0.0; m], vec![0.0; m * used]);
                    (evaluate.borrow_mut())(&moved, &mut values, &mut derivatives);
                    values.iter().all(|value| value.is_finite()).then_some(values)
                };
                for (i, expected) in differences(m, at).into_iter().enumerate() {
                    let name = || format!("row {row}, {} by input {}", names(i), block.measurement.inputs[k].name);
                    if outcome.is_ok() && derivatives[i * used + k].is_finite() {
                        outcome = tally.compare(derivatives[i * used + k], expected, values[i], name);
                    }
                }
            }
        })
        .expect("a point of the problem");
    outcome
}

#[test]
fn first_derivatives_are_those_of_differences() {
    let tally = Tally::default();
    runner(150).run(&models(), |random| first_derivatives(&random, &tally, 1.0)).unwrap_or_else(|e| panic!("{e}"));
    tally.assert_sharp();
}

#[test]
fn a_wrong_derivative_is_found() {
    let tally = Tally::default();
    let found = runner(20).run(&models(), |random| first_derivatives(&random, &tally, 1.0 + 1e-6));
    assert!(found.is_err());
}

/// ∂²/∂aᵢ∂aⱼ of all outputs by hyper-dual numbers, over leaves and inputs as one list.
fn second_derivatives(random: &Random, tally: &Tally) -> Result<(), TestCaseError> {
    let program = compiled(&random.text);
    let measurement = &program.measurements[0];
    let tape = &measurement.tape;
    let leaves = nominal(&program);
    let inputs = tape.inputs();
    let of = |k: usize| if k < leaves.len() { Leaf::Parameter(k) } else { Leaf::Input(k - leaves.len()) };
    let count = leaves.len() + inputs;
    for (pair, row) in random.picks.chunks(2).zip(random.rows.iter().cycle()) {
        let all: Vec<f64> = leaves.iter().chain(&row[..inputs]).copied().collect();
        let (a, b) = (pair[0] as usize % count, pair[1] as usize % count);
        let gradient = |h: f64| {
            let mut moved = all.clone();
            moved[b] += h;
            let mut evaluator = Evaluator::new(tape, vec![of(a)]);
            evaluator.begin(&moved[..leaves.len()]);
            let (mut values, mut derivatives) = (vec![0.0; tape.outputs()], vec![0.0; tape.outputs()]);
            evaluator.row(&moved[leaves.len()..], &mut values, &mut derivatives);
            values.iter().chain(&derivatives).all(|value| value.is_finite()).then_some(derivatives)
        };
        if at_an_edge(tape, &leaves, row) {
            continue;
        }
        let first = gradient(0.0).expect("defined");
        let expected = differences(tape.outputs(), gradient);
        let hyper: Vec<HyperDual64> = (0..count)
            .map(|k| HyperDual64::new(all[k], f64::from(u8::from(k == a)), f64::from(u8::from(k == b)), 0.0))
            .collect();
        let found = tape.evaluate(&hyper[..leaves.len()], &hyper[leaves.len()..]);
        for (i, found) in found.iter().enumerate() {
            let name = || format!("{} by {:?} and {:?}", measurement.residuals[i].name, of(a), of(b));
            tally.compare(found.eps1, (first[i], 0.0), found.re, name)?;
            tally.compare(found.eps1eps2, expected[i], first[i].abs() + found.re.abs(), name)?;
        }
        if a == b {
            let dual: Vec<Dual2_64> =
                (0..count).map(|k| Dual2_64::new(all[k], f64::from(u8::from(k == a)), 0.0)).collect();
            let same = tape.evaluate(&dual[..leaves.len()], &dual[leaves.len()..]);
            for (found, same) in found.iter().zip(same) {
                tally.compare(same.v2, (found.eps1eps2, 0.0), found.re, || "dual and hyper-dual".into())?;
            }
        }
    }
    Ok(())
}

#[test]
fn second_derivatives_are_those_of_differences() {
    let tally = Tally::default();
    runner(150).run(&models(), |random| second_derivatives(&random, &tally)).unwrap_or_else(|e| panic!("{e}"));
    tally.assert_sharp();
}
