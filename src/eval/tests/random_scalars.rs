//! Random graphs of scalar operations, and how well their values are determined.

use num_dual::Dual64;
use proptest::prelude::*;

use super::points::whole;
use crate::graph::{Graph, Node, OPERATIONS, Operation, Scalar, Varies};

pub(super) const PARAMETERS: usize = 3;
pub(super) const INPUTS: usize = 3;

/// What a node is made of, whatever there is to make it from.
pub(super) type Gene = (u8, u8, u8);

pub(super) fn genes() -> impl Strategy<Value = Vec<Gene>> {
    prop::collection::vec(any::<Gene>(), 1..30)
}

/// Parameters, and rows of inputs.
pub(super) fn point(rows: std::ops::Range<usize>) -> impl Strategy<Value = (Vec<f64>, Vec<Vec<f64>>)> {
    let number = || prop_oneof![8 => -2.0..2.0, 1 => prop::sample::select(vec![0.0, 1.0, -1.0])];
    let row = prop::collection::vec(number(), INPUTS);
    (prop::collection::vec(number(), PARAMETERS), prop::collection::vec(row, rows))
}

/// A graph of all operations, inside their domains, with outputs that are inputs, constants, duplicates and negations too.
pub(super) fn build(genes: &[Gene]) -> (Graph, Vec<Scalar>) {
    let mut g = Graph::new();
    let mut pool: Vec<Scalar> = (0..PARAMETERS as u32).map(|i| g.parameter(i)).collect();
    pool.extend((0..INPUTS as u32).map(|i| g.input(i)));
    pool.extend([0.5, -1.0, 2.0, 0.0].map(|c| g.constant(c)));
    let mut outputs = Vec::new();
    for &(what, a, b) in genes {
        let at = |k: u8| pool[usize::from(k) % pool.len()];
        let (x, y) = (at(a), at(b));
        match what % 64 {
            // sums of products, which the engine fuses
            0..20 => {
                let (z, w) = (at(a.wrapping_add(b)), at(a ^ b));
                let (first, second) = (g.mul(x, y), g.mul(z, w));
                let sum = if what & 1 == 0 { g.add(first, second) } else { g.sub(first, second) };
                let sum = if what & 2 == 0 { g.neg(sum) } else { sum };
                let sum = match what % 3 {
                    0 => g.add(sum, x),
                    1 => g.sub(y, sum),
                    _ => sum,
                };
                pool.push(damped(&mut g, sum, what));
            }
            20..30 => outputs.push(x),
            30..34 => {
                let minus = g.neg(x);
                pool.push(minus);
                outputs.push(minus);
            }
            _ => {
                let operation = OPERATIONS[usize::from(what) % OPERATIONS.len()].operation;
                let f = inside(&mut g, operation, x, y, b);
                pool.push(damped(&mut g, f, b));
            }
        }
    }
    outputs.extend(pool.iter().rev().take(3));
    (g, outputs)
}

/// Sometimes brought back to where numbers are small.
fn damped(g: &mut Graph, x: Scalar, when: u8) -> Scalar {
    if when.is_multiple_of(4) { g.unary(Operation::Sin, x) } else { x }
}

/// An operation on operands brought into its domain.
fn inside(g: &mut Graph, operation: Operation, x: Scalar, y: Scalar, b: u8) -> Scalar {
    let shrunk = |g: &mut Graph, x: Scalar| {
        let (most, sine) = (g.constant(0.9), g.unary(Operation::Sin, x));
        g.mul(most, sine)
    };
    let positive = |g: &mut Graph, x: Scalar| {
        let (least, square) = (g.constant(0.3), g.mul(x, x));
        g.add(square, least)
    };
    let x = match operation {
        Operation::Asin | Operation::Acos | Operation::Exp | Operation::Tan => shrunk(g, x),
        Operation::Sqrt | Operation::Log | Operation::Pow | Operation::PowInteger => positive(g, x),
        Operation::Stumpff | Operation::Atanc | Operation::Atan2 => positive(g, x),
        _ => x,
    };
    let y = match operation {
        _ if whole(operation) => g.constant(f64::from(b % 4)),
        Operation::Div => positive(g, y),
        Operation::Pow => shrunk(g, y),
        Operation::AtLeast => g.constant(-1e9),
        _ => y,
    };
    g.apply(operation, x, y)
}

/// The error that one rounding of each operand may cause, times this, is what two right evaluations may differ by.
const MARGIN: f64 = 150.0;
const JITTER: f64 = 1.0 / (1 << 26) as f64;

/// How far values and derivatives of right evaluations may be apart: what becomes of tiny changes of all operands.
pub(super) fn uncertainty(g: &Graph, outputs: &[Scalar], parameters: &[Dual64], inputs: &[Dual64]) -> Vec<[f64; 2]> {
    let exact = jittered(g, outputs, parameters, inputs, None);
    let mut spread = vec![[0.0f64; 2]; outputs.len()];
    for seed in 1..9 {
        for (spread, (a, b)) in
            spread.iter_mut().zip(jittered(g, outputs, parameters, inputs, Some(seed)).iter().zip(&exact))
        {
            let [value, derivative] = [(a.re - b.re).abs(), (a.eps - b.eps).abs()];
            *spread = [spread[0].max(value), spread[1].max(derivative)];
        }
    }
    let scale = MARGIN * f64::EPSILON / JITTER;
    spread
        .iter()
        .zip(&exact)
        .map(|([v, d], e)| [scale * v + 4e-16 * e.re.abs(), scale * d + 4e-16 * e.eps.abs()])
        .collect()
}

fn jittered(g: &Graph, outputs: &[Scalar], parameters: &[Dual64], inputs: &[Dual64], seed: Option<u64>) -> Vec<Dual64> {
    let mut state = seed.unwrap_or(0);
    let mut factor = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        match seed {
            Some(_) => 1.0 + JITTER * ((state >> 32) as f64 / f64::from(1u32 << 31) - 1.0),
            None => 1.0,
        }
    };
    let mut values: Vec<Dual64> = Vec::with_capacity(g.len());
    for id in 0..g.len() as u32 {
        values.push(match g.node(id) {
            Node::Constant(bits) => Dual64::from(f64::from_bits(bits)),
            Node::Parameter(i) => parameters[i as usize],
            Node::Input(i) => inputs[i as usize],
            Node::Apply(operation, x, y) => {
                let mut operand = |s: Scalar| {
                    let v = values[s.0 as usize];
                    let exact = g.varies(s) == Varies::Never;
                    if exact { v } else { Dual64::new(v.re * factor(), v.eps * factor()) }
                };
                let (x, y) = (operand(x), operand(y));
                let f = operation.apply(&x, &y);
                // these subtract what is nearly the same, and divide by x
                let rounded = matches!(operation, Operation::Stumpff | Operation::Atanc);
                let [value, derivative] =
                    [factor(), factor()].map(|k| if rounded { 1.0 + 400.0 * (k - 1.0) } else { 1.0 });
                Dual64::new(f.re * value, f.eps * derivative)
            }
            other => unreachable!("{other:?} is not a scalar operation"),
        });
    }
    outputs.iter().map(|output| values[output.0 as usize]).collect()
}
