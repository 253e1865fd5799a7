//! `derivative(x, q)`: how an expression changes with a parameter or an input.

use super::core::{self, Mismatch};
use super::scope::{Locals, Scope};
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::Code;
use crate::graph::Scalar;
use crate::lang::Expr;
use crate::symbolic::{Change, differential, unit};
use crate::unit::Dimension;

impl Scope<'_> {
    pub(super) fn derivative(
        &mut self,
        arguments: &[Expr],
        expr: &Expr,
        at: &Snippet,
        locals: &Locals,
    ) -> Option<Value> {
        let [of, by] = arguments else {
            return self.checked(Err(core::wrong_arity("derivative", 2, arguments.len())), expr, at);
        };
        let (value, leaf) = (self.expression(of, at, locals), self.leaf(by, at, locals));
        let (value, (leaf, by)) = (value?, leaf?);
        if matches!(value, Value::Frame(..)) {
            let message = "`derivative` takes a scalar, a vector or a rotation, and this is a frame";
            let hint = "take its origin `F.o`, an axis such as `F.z`, or its rotation `F.r`";
            self.report(Code::WrongShape, of, at, message, Some(hint.into()));
            return None;
        }
        let quotient = |of: Dimension| {
            let beyond = || Mismatch::dimension("the derivative's dimension is beyond all use");
            of.checked_div(by.without_angle()).ok_or_else(beyond)
        };
        let dimension = match quotient(value.dimension().unwrap_or(Dimension::NUMBER)) {
            Ok(dimension) => dimension,
            Err(mismatch) => return self.checked(Err(mismatch), expr, at),
        };
        Some(match (value, self.change(value, leaf)) {
            (Value::Scalar(..), Some(Change::Scalar(change))) => Value::Scalar(change, dimension),
            (Value::Scalar(..), _) => Value::Scalar(self.graph.constant(0.0), dimension),
            (_, Some(Change::Vector(change) | Change::Rotation(change))) => Value::Vector(change, dimension),
            _ => Value::Vector(self.graph.constant_vector([0.0; 3]), dimension),
        })
    }

    fn change(&mut self, value: Value, leaf: Scalar) -> Option<Change> {
        let seed = unit(&mut self.graph, leaf);
        differential(&mut self.graph, &[value.node()], &[seed], &|_| false).remove(&value.node())
    }
}
