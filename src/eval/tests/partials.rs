//! Derivatives of every operation, however its operands arrive, against dual numbers.

use std::cell::Cell;

use num_dual::Dual64;

use super::compare::agree;
use super::engine::{Run, compiled};
use super::points::{Batch, Kind, batches, whole};
use crate::graph::{Derived, Graph, OPERATIONS, Operation, Scalar, View, differentiate};
use crate::simd::InstructionSet;

/// What differentiates an output by leaves.
type Differentiation<'e> = &'e dyn Fn(&Graph, Scalar, &[Scalar]) -> Derived;

fn right(graph: &Graph, f: Scalar, leaves: &[Scalar]) -> Derived {
    differentiate(graph, &[f], leaves, &View::default())
}

/// How far a derivative may be from that of dual numbers, relative to it.
fn relative(operation: Operation, x: f64, y: f64) -> f64 {
    let rounding = f64::EPSILON;
    match operation {
        // 1 − x² has lost digits near 1, in dual numbers
        Operation::Asin | Operation::Acos => rounding * (4.0 + 2.0 / (1.0 - x.abs())),
        Operation::PowInteger => rounding * (4.0 + 2.0 * y.abs()),
        // closed forms divide differences by x, in dual numbers too: from 1/2 on, and from 1/100 on, once for each step
        Operation::Stumpff => 1e-11,
        Operation::Atanc => rounding * (16.0 + 8.0 * x.max(0.01).powf(-1.0 - y)),
        _ => 16.0 * rounding,
    }
}

/// Compares all derivatives of an operation with those of dual numbers. Returns how many there were.
fn check(operation: Operation, set: InstructionSet, differentiation: Differentiation<'_>) -> Result<usize, String> {
    let mut compared = 0;
    for batch in batches(operation) {
        compared += check_batch(operation, &batch, set, differentiation)?;
    }
    Ok(compared)
}

fn check_batch(
    operation: Operation,
    batch: &Batch,
    set: InstructionSet,
    differentiation: Differentiation<'_>,
) -> Result<usize, String> {
    let mut g = Graph::new();
    let operands = batch.operands(&mut g);
    let f = g.apply(operation, operands[0], operands[1]);
    let by: Vec<usize> = (0..operation.row().arity).filter(|&k| batch.kinds[k] != Kind::Constant).collect();
    if by.is_empty() {
        return Ok(0);
    }
    // 0/y is the constant 0, which presumes that y is not
    let dropped = g.value(f).is_some();
    let leaves: Vec<Scalar> = by.iter().map(|&k| operands[k]).collect();
    let derived = differentiation(&g, f, &leaves);
    let outputs = [derived.values, derived.derivatives].concat();
    let rows: Vec<Vec<f64>> = batch.points.iter().map(|point| point.to_vec()).collect();
    let run = Run { set, graph: &derived.graph, outputs: &outputs, parameters: &batch.points[0], rows: &rows };
    let mut compared = 0;
    for ([x, y], found) in batch.arriving().zip(compiled(run)) {
        if !x.is_finite() || !y.is_finite() || dropped && !(operation.row().defined)(x, y) {
            continue;
        }
        for (&k, &derivative) in by.iter().zip(&found[1..]) {
            let fault = fault(operation, [x, y], k, found[0], derivative);
            compared += usize::from(fault != Some(Fault::NotComparable));
            if let Some(Fault::Wrong(expected)) = fault {
                let (name, kinds) = (operation.row().name, batch.kinds);
                let set = set.name();
                return Err(format!("{name}({x:e}, {y:e}) by {k}, {kinds:?}, {set}: {derivative:e}, not {expected}"));
            }
        }
    }
    Ok(compared)
}

#[derive(Clone, Debug, PartialEq)]
enum Fault {
    Wrong(String),
    /// dual numbers overflow on the way
    NotComparable,
}

/// What is wrong with a derivative by operand k.
fn fault(operation: Operation, point: [f64; 2], k: usize, value: f64, derivative: f64) -> Option<Fault> {
    let [x, y] = point;
    let row = operation.row();
    if !(row.defined)(x, y) || !(row.smooth)(x, y) {
        // the series of these go on below zero, where squares never are
        let continued = matches!(operation, Operation::Stumpff | Operation::Atanc);
        let noticed = !value.is_finite() || !derivative.is_finite() || continued;
        return (!noticed).then(|| Fault::Wrong("a number where there is no derivative".into()));
    }
    let mut dual = point.map(Dual64::from);
    dual[k] = dual[k].derivative();
    let expected = operation.apply(&dual[0], &dual[1]);
    if !expected.re.is_finite() || !expected.eps.is_finite() {
        return Some(Fault::NotComparable);
    }
    // what is rounded to a subnormal number on the way has fewer digits, or none
    let lost = match operation {
        // x/s · 1/s, where s is the larger
        Operation::Hypot => 4.0 * f64::MIN_POSITIVE * x.abs().max(y.abs()).max(1.0),
        // the rules are differences of the next functions, nearly the same where x is large
        Operation::Stumpff | Operation::Atanc => {
            [1.0, 2.0].iter().map(|more| 1e-12 * operation.apply(&x, &(y + more)).abs()).sum::<f64>()
                + f64::MIN_POSITIVE
        }
        _ => f64::MIN_POSITIVE,
    };
    let tolerance = relative(operation, x, y) * expected.eps.abs() + lost;
    (!agree(derivative, expected.eps, tolerance)).then(|| Fault::Wrong(format!("{:e}", expected.eps)))
}

#[test]
fn every_operation_has_the_derivatives_of_dual_numbers() {
    for set in InstructionSet::available() {
        for row in OPERATIONS {
            match check(row.operation, set, &right) {
                Ok(compared) => assert!(compared > 100, "{}: {compared}", row.name),
                Err(difference) => panic!("{difference}"),
            }
        }
    }
}

/// A wrong rule made from the right one: which derivative, and what becomes of it.
type Rule = fn(&mut Graph, Scalar, Scalar) -> Scalar;

#[test]
fn a_wrong_rule_of_any_operation_is_noticed() {
    let rules: [(&str, Rule); 6] = [
        ("opposite", |g, d, _| g.neg(d)),
        ("a factor 1 + 1e-9", |g, d, _| {
            let factor = g.constant(1.0 + 1e-9);
            g.mul(factor, d)
        }),
        ("1e-9 more", |g, d, _| {
            let more = g.constant(1e-9);
            g.add(d, more)
        }),
        ("five more", |g, d, _| {
            let more = g.constant(5.0);
            g.add(d, more)
        }),
        ("squared", |g, d, _| g.mul(d, d)),
        ("the other one", |_, _, other| other),
    ];
    for row in OPERATIONS {
        let active = if whole(row.operation) { 1 } else { row.arity };
        // all operands are leaves, so that there is another one
        let mut batches = batches(row.operation);
        batches.retain(|batch| batch.kinds[..active].iter().all(|&kind| kind != Kind::Constant));
        for (name, rule) in rules {
            for k in 0..active {
                let differs = Cell::new(false);
                let wrong = |graph: &Graph, f: Scalar, leaves: &[Scalar]| {
                    let mut derived = right(graph, f, leaves);
                    let (d, other) = (derived.derivatives[k], derived.derivatives[active - 1 - k]);
                    let changed = rule(&mut derived.graph, d, other);
                    differs.set(differs.get() || changed != d);
                    derived.derivatives[k] = changed;
                    derived
                };
                let noticed = batches
                    .iter()
                    .any(|batch| check_batch(row.operation, batch, InstructionSet::Baseline, &wrong).is_err());
                assert!(noticed || !differs.get(), "{} by {k}: {name}", row.name);
            }
        }
    }
}
