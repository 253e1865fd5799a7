//! Operations as languages have them, on numbers whose signs are kept apart, so that what differs by its sign alone is one.

use crate::graph::{Graph, Node, Operation, Scalar};

/// A node of a graph that is no opposite, or its opposite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Value {
    pub(super) negative: bool,
    pub(super) of: Scalar,
}

impl Value {
    fn opposite(self) -> Value {
        Value { negative: !self.negative, ..self }
    }
}

/// Makes nodes of a graph.
pub(super) struct Signed<'g> {
    pub(super) graph: &'g mut Graph,
}

impl Signed<'_> {
    /// A node as a value: an opposite, or a constant below zero, is one with a sign.
    pub(super) fn value(&mut self, s: Scalar) -> Value {
        match (self.graph.node(s.0), self.graph.value(s)) {
            (Node::Apply(Operation::Neg, x, _), _) => self.value(x).opposite(),
            (_, Some(value)) if value < 0.0 => Value { negative: true, of: self.graph.constant(-value) },
            _ => Value { negative: false, of: s },
        }
    }

    /// A value as a node.
    pub(super) fn plain(&mut self, value: Value) -> Scalar {
        if value.negative { self.graph.neg(value.of) } else { value.of }
    }

    /// An operation by those that languages have.
    pub(super) fn apply(&mut self, operation: Operation, x: Value, y: Value) -> Value {
        match operation {
            Operation::Add => self.sum(x, y),
            Operation::Sub => self.sum(x, y.opposite()),
            Operation::Mul => self.product(x, y),
            Operation::Neg => x.opposite(),
            Operation::Div => {
                let quotient = self.graph.div(x.of, y.of);
                self.with(quotient, x.negative != y.negative)
            }
            Operation::PowInteger => self.power(x, self.graph.value(y.of).unwrap_or(0.0) as i32, y.negative),
            Operation::Pow => {
                let x = self.plain(x);
                let log = self.graph.unary(Operation::Log, x);
                let log = self.value(log);
                let product = self.product(log, y);
                let product = self.plain(product);
                let power = self.graph.unary(Operation::Exp, product);
                self.value(power)
            }
            _ => {
                let (x, y) = (self.plain(x), self.plain(y));
                let found = self.graph.apply(operation, x, y);
                self.value(found)
            }
        }
    }

    /// x + y: a sum, or the difference in which the older number is first, perhaps with a sign.
    fn sum(&mut self, x: Value, y: Value) -> Value {
        if x.negative == y.negative {
            let sum = self.graph.add(x.of, y.of);
            return self.with(sum, x.negative);
        }
        let (first, second) = if y.of < x.of { (y, x) } else { (x, y) };
        let difference = self.graph.sub(first.of, second.of);
        self.with(difference, first.negative)
    }

    fn product(&mut self, x: Value, y: Value) -> Value {
        let product = self.graph.mul(x.of, y.of);
        self.with(product, x.negative != y.negative)
    }

    /// By repeated squaring, as the engine does.
    fn power(&mut self, x: Value, n: i32, inverse: bool) -> Value {
        let one = self.graph.constant(1.0);
        let one = self.value(one);
        let mut square = if inverse { self.apply(Operation::Div, one, x) } else { x };
        let mut result = one;
        let mut left = n.unsigned_abs();
        while left > 0 {
            if left & 1 == 1 {
                result = self.product(square, result);
            }
            left >>= 1;
            if left > 0 {
                square = self.product(square, square);
            }
        }
        result
    }

    fn with(&mut self, s: Scalar, negative: bool) -> Value {
        let value = self.value(s);
        if negative { value.opposite() } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_by_its_sign_alone_is_one_number() {
        let mut graph = Graph::new();
        let (x, y) = (graph.input(0), graph.input(1));
        let mut signed = Signed { graph: &mut graph };
        let (x, y) = (signed.value(x), signed.value(y));
        let forth = signed.apply(Operation::Sub, x, y);
        assert_eq!(signed.apply(Operation::Sub, y, x), forth.opposite());
        let (minus_x, minus_y) = (x.opposite(), y.opposite());
        assert_eq!(signed.apply(Operation::Add, minus_x, y), forth.opposite());
        let sum = signed.apply(Operation::Add, x, y);
        assert_eq!(signed.apply(Operation::Sub, minus_x, y), sum.opposite());
        let product = signed.apply(Operation::Mul, x, minus_y);
        assert_eq!(signed.apply(Operation::Mul, minus_x, y), product);
        assert!(product.negative);
        assert_eq!(signed.apply(Operation::Div, minus_x, minus_y), signed.apply(Operation::Div, x, y));
    }

    #[test]
    fn powers_are_products() {
        let mut graph = Graph::new();
        let (x, n) = (graph.input(0), graph.constant(-3.0));
        let mut signed = Signed { graph: &mut graph };
        let (x, n) = (signed.value(x), signed.value(n));
        let power = signed.apply(Operation::PowInteger, x.opposite(), n);
        let power = signed.plain(power);
        let tape = crate::graph::Tape::lower(&graph, &[power]);
        assert_eq!(tape.evaluate(&[], &[2.0]), [-0.125]);
    }
}
