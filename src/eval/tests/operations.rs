//! Values of every operation, however its operands arrive, on every instruction set.

use super::compare::{agree, ulps};
use super::engine::{Engine, Run, compiled};
use super::points::{Batch, Kind, batches, whole};
use crate::graph::{Graph, Node, OPERATIONS, Operation};
use crate::simd::InstructionSet;

/// How far a value may be from the table's: the instruction set's own sine and cosine are within 1.5 units in the last place,
/// and the standard library's within one half.
fn tolerance(operation: Operation, kinds: [Kind; 2], expected: f64) -> f64 {
    match operation {
        Operation::Sin | Operation::Cos if kinds[0] == Kind::Row => ulps(expected, 2.0),
        _ => 0.0,
    }
}

/// Compares all values of an operation with the table's. Returns how many there were.
pub(super) fn check(operation: Operation, set: InstructionSet, engine: Engine<'_>) -> Result<usize, String> {
    let mut compared = 0;
    for batch in batches(operation) {
        compared += check_batch(operation, &batch, set, engine)?;
    }
    Ok(compared)
}

fn check_batch(operation: Operation, batch: &Batch, set: InstructionSet, engine: Engine<'_>) -> Result<usize, String> {
    let mut g = Graph::new();
    let [x, y] = batch.operands(&mut g);
    let f = g.apply(operation, x, y);
    // 0·y is the constant 0, which presumes that y is defined
    let dropped = g.value(f).is_some();
    let parameters = batch.points[0];
    let rows: Vec<Vec<f64>> = batch.points.iter().map(|point| point.to_vec()).collect();
    let found = engine(Run { set, graph: &g, outputs: &[f], parameters: &parameters, rows: &rows });
    let mut compared = 0;
    for ([x, y], found) in batch.arriving().zip(found) {
        let expected = operation.apply(&x, &y);
        if dropped && !expected.is_finite() {
            continue;
        }
        compared += 1;
        if !agree(found[0], expected, tolerance(operation, batch.kinds, expected)) {
            let (name, kinds) = (operation.row().name, batch.kinds);
            return Err(format!("{name}({x:e}, {y:e}), {kinds:?}, {}: {:e}, not {expected:e}", set.name(), found[0]));
        }
    }
    Ok(compared)
}

#[test]
fn every_operation_has_its_value_however_its_operands_arrive() {
    for set in InstructionSet::available() {
        for row in OPERATIONS {
            let compared = check(row.operation, set, &compiled).unwrap_or_else(|difference| panic!("{difference}"));
            assert!(compared > 100, "{}: {compared}", row.name);
        }
    }
}

#[test]
fn a_wrong_value_of_any_operation_is_noticed() {
    type Wrong = (&'static str, fn(f64) -> f64);
    let wrong: [Wrong; 4] = [
        ("opposite", |f| -f),
        ("three units in the last place off", |f| f + ulps(f, 3.0)),
        ("zero where it is not a number", |f| if f.is_nan() { 0.0 } else { f }),
        ("not a number where it is small", |f| if f.abs() < 1e-3 { f64::NAN } else { f }),
    ];
    for set in InstructionSet::available() {
        for row in OPERATIONS {
            for (name, wrong) in wrong {
                let engine = |run: Run<'_>| {
                    let mut found = compiled(run);
                    found.iter_mut().flatten().for_each(|f| *f = wrong(*f));
                    found
                };
                assert!(check(row.operation, set, &engine).is_err(), "{} {name}", row.name);
            }
        }
    }
}

#[test]
fn another_operation_in_its_place_is_noticed() {
    // each operation run as each other one of as many operands
    for row in OPERATIONS {
        for other in OPERATIONS.iter().filter(|other| other.operation != row.operation && other.arity == row.arity) {
            if whole(other.operation) && !whole(row.operation) {
                continue;
            }
            let engine = |run: Run<'_>| {
                let mut graph = run.graph.clone();
                let replaced = match graph.node(run.outputs[0].0) {
                    Node::Apply(_, x, y) => graph.apply(other.operation, x, y),
                    _ => run.outputs[0],
                };
                compiled(Run { graph: &graph, outputs: &[replaced], ..run })
            };
            assert!(check(row.operation, InstructionSet::Baseline, &engine).is_err(), "{} {}", row.name, other.name);
        }
    }
}
