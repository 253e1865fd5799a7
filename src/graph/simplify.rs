//! Local rules for scalar operations, applied as nodes are made. Each is an identity of real numbers; the ones that drop an
//! operand (x·0 = 0) presume that the operand is defined.

use super::{Graph, Node, Operation, Scalar};

impl Graph {
    /// Applies an operation of the table; a unary one does not look at `y`.
    pub fn apply(&mut self, operation: Operation, x: Scalar, y: Scalar) -> Scalar {
        let y = if operation.row().arity == 1 { x } else { y };
        match self.simplified(operation, x, y) {
            Some(simpler) => simpler,
            None => {
                // a + b = b + a, a·b = b·a: one order, so that both are one node
                let commutes = matches!(operation, Operation::Add | Operation::Mul);
                let (x, y) = if commutes && y < x { (y, x) } else { (x, y) };
                Scalar(self.intern(Node::Apply(operation, x, y)))
            }
        }
    }

    fn simplified(&mut self, operation: Operation, x: Scalar, y: Scalar) -> Option<Scalar> {
        if let Some(folded) = self.folded(operation, x, y) {
            return Some(folded);
        }
        let is = |s: Scalar, value: f64| self.value(s) == Some(value);
        match operation {
            Operation::Add if is(x, 0.0) => Some(y), // 0 + y = y
            Operation::Add if is(y, 0.0) => Some(x), // x + 0 = x
            Operation::Add => match (self.negated(x), self.negated(y)) {
                (_, Some(minus_y)) => Some(self.sub(x, minus_y)),    // x + (−a) = x − a
                (Some(minus_x), None) => Some(self.sub(y, minus_x)), // (−a) + y = y − a
                _ => None,
            },
            Operation::Sub if is(y, 0.0) => Some(x),              // x − 0 = x
            Operation::Sub if is(x, 0.0) => Some(self.neg(y)),    // 0 − y = −y
            Operation::Sub if x == y => Some(self.constant(0.0)), // x − x = 0
            Operation::Sub => self.negated(y).map(|a| self.add(x, a)), // x − (−a) = x + a
            Operation::Mul if is(x, 0.0) || is(y, 0.0) => Some(self.constant(0.0)), // 0·y = 0
            Operation::Mul if is(x, 1.0) => Some(y),              // 1·y = y
            Operation::Mul if is(y, 1.0) => Some(x),              // x·1 = x
            Operation::Mul if is(x, -1.0) => Some(self.neg(y)),   // −1·y = −y
            Operation::Mul if is(y, -1.0) => Some(self.neg(x)),   // x·−1 = −x
            Operation::Mul => match (self.negated(x), self.negated(y)) {
                (Some(a), Some(b)) => Some(self.mul(a, b)), // (−a)·(−b) = a·b
                (Some(a), None) => {
                    let product = self.mul(a, y);
                    Some(self.neg(product)) // (−a)·y = −(a·y)
                }
                (None, Some(b)) => {
                    let product = self.mul(x, b);
                    Some(self.neg(product)) // x·(−b) = −(x·b)
                }
                _ => None,
            },
            Operation::Div if is(y, 1.0) => Some(x), // x/1 = x
            Operation::Div if is(x, 0.0) && self.value(y) != Some(0.0) => Some(x), // 0/y = 0
            Operation::Neg => self.negated(x),       // −(−a) = a
            Operation::PowInteger if is(y, 1.0) => Some(x), // x¹ = x
            Operation::PowInteger if is(y, 0.0) => Some(self.constant(1.0)), // x⁰ = 1
            Operation::PowInteger if is(y, 2.0) => Some(self.mul(x, x)), // x² = x·x
            Operation::Sin => self.negated(x).map(|a| {
                let sine = self.apply(Operation::Sin, a, a);
                self.neg(sine) // sin(−a) = −sin a
            }),
            Operation::Cos => self.negated(x).map(|a| self.apply(Operation::Cos, a, a)), // cos(−a) = cos a
            Operation::Abs => self.negated(x).map(|a| self.apply(Operation::Abs, a, a)), // |−a| = |a|
            _ => None,
        }
    }

    /// The constant that an operation on constants is, where it is defined and finite.
    fn folded(&mut self, operation: Operation, x: Scalar, y: Scalar) -> Option<Scalar> {
        let (a, b) = (self.value(x)?, self.value(y)?);
        if !(operation.row().defined)(a, b) {
            return None;
        }
        let value = operation.apply(&a, &b);
        value.is_finite().then(|| self.constant(value))
    }

    /// a, where x = −a.
    fn negated(&self, x: Scalar) -> Option<Scalar> {
        match self.node(x.0) {
            Node::Apply(Operation::Neg, a, _) => Some(a),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Graph, OPERATIONS, Operation, Tape};
    use proptest::prelude::*;

    #[test]
    fn zeros_and_ones_vanish() {
        let mut g = Graph::new();
        let (x, zero, one) = (g.parameter(0), g.constant(0.0), g.constant(1.0));
        assert_eq!(g.add(x, zero), x);
        assert_eq!(g.mul(one, x), x);
        assert_eq!(g.mul(x, zero), zero);
        assert_eq!(g.sub(x, x), zero);
        let minus = g.neg(x);
        assert_eq!(g.neg(minus), x);
        let y = g.parameter(1);
        assert_eq!(g.add(x, y), g.add(y, x));
    }

    #[test]
    fn undefined_constants_are_not_folded() {
        let mut g = Graph::new();
        let zero = g.constant(0.0);
        let one = g.constant(1.0);
        let quotient = g.div(one, zero);
        assert_eq!(g.value(quotient), None);
        let logarithm = g.apply(Operation::Log, zero, zero);
        assert_eq!(g.value(logarithm), None);
    }

    proptest! {
        // a quarter of all operations is undefined at their operands
        #![proptest_config(ProptestConfig { max_global_rejects: u32::MAX, ..ProptestConfig::default() })]

        /// Every rule keeps the value: two operations over operands that are constants, negations and variables.
        #[test]
        fn rules_keep_the_value(
            first in 0..OPERATIONS.len(), second in 0..OPERATIONS.len(),
            picks in [0usize..7, 0usize..7, 0usize..7], values in [0.1f64..0.9, 0.1f64..0.9],
        ) {
            let whole = |op: Operation| matches!(op, Operation::PowInteger | Operation::Stumpff | Operation::Atanc);
            let (first, second) = (OPERATIONS[first].operation, OPERATIONS[second].operation);
            let mut g = Graph::new();
            let (a, b) = (g.parameter(0), g.parameter(1));
            let (minus_a, minus_b) = (g.neg(a), g.neg(b));
            let constants = [g.constant(0.0), g.constant(1.0), g.constant(-1.0)];
            let pool = [a, b, minus_a, minus_b, constants[0], constants[1], constants[2]];
            let numbers = [values[0], values[1], -values[0], -values[1], 0.0, 1.0, -1.0];
            let two = g.constant(2.0);
            let (x, y) = (pool[picks[0]], if whole(first) { two } else { pool[picks[1]] });
            let (vx, vy) = (numbers[picks[0]], if whole(first) { 2.0 } else { numbers[picks[1]] });
            let (z, vz) = if whole(second) { (two, 2.0) } else { (pool[picks[2]], numbers[picks[2]]) };
            let inner = first.apply(&vx, &vy);
            prop_assume!((first.row().defined)(vx, vy) && inner.is_finite());
            // −0 and 0 are one constant, and half a turn apart there
            prop_assume!(second != Operation::Atan2 || inner != 0.0);
            let expected = second.apply(&inner, &vz);
            prop_assume!((second.row().defined)(inner, vz) && expected.is_finite());
            let node = g.apply(first, x, y);
            let node = g.apply(second, node, z);
            let found = Tape::lower(&g, &[node]).evaluate(&values, &[])[0];
            prop_assert!((found - expected).abs() <= 1e-14 * (1.0 + expected.abs()), "{first:?} {second:?}: {found} {expected}");
        }
    }
}
