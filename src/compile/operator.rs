//! `+ - * / ^` and fields, on whatever shapes they have a meaning for.

use super::core::{Mismatch, common, product};
use super::value::Value;
use crate::graph::{Axis, Graph};
use crate::lang::Op;
use crate::unit::{Base, Dimension, Units};

type Checked = Result<Value, Mismatch>;

/// Applies an operator. `units` are the model's: they decide what a bare number may mean beside an angle.
pub(crate) fn binary(graph: &mut Graph, units: &Units, operator: Op, a: Value, b: Value) -> Checked {
    match operator {
        Op::Add | Op::Sub => sum(graph, units, operator, operator.symbol(), a, b),
        Op::Mul => multiply(graph, a, b),
        Op::Div => divide(graph, a, b),
        Op::Pow => power(graph, a, b),
    }
}

/// −a
pub(crate) fn negate(graph: &mut Graph, a: Value) -> Checked {
    match a {
        Value::Scalar(s, d) => Ok(Value::Scalar(graph.neg(s), d)),
        Value::Vector(v, d) => {
            let minus = graph.constant(-1.0);
            Ok(Value::Vector(graph.scale(minus, v), d))
        }
        _ => {
            Err(Mismatch::shape(format!("{} has no negative", a.shape()))
                .hint("the reverse of a motion is `inverse(…)`"))
        }
    }
}

/// a − b of what stands on the two sides of a sign, with the rules of a sum.
pub(crate) fn difference(graph: &mut Graph, units: &Units, sign: &str, a: Value, b: Value) -> Checked {
    sum(graph, units, Op::Sub, sign, a, b)
}

fn sum(graph: &mut Graph, units: &Units, operator: Op, sign: &str, a: Value, b: Value) -> Checked {
    let dimension = match (a, b) {
        (Value::Scalar(..), Value::Scalar(..)) | (Value::Vector(..), Value::Vector(..)) => {
            common(graph, &a, &b, sign).map_err(|mismatch| with_unit_hint(graph, units, mismatch, a, b))?
        }
        _ => return Err(Mismatch::shape(format!("`{sign}` does not apply to {} and {}", a.shape(), b.shape()))),
    };
    bare_beside_angle(graph, units, a, b)?;
    Ok(match (a, b, operator) {
        (Value::Scalar(a, _), Value::Scalar(b, _), Op::Add) => Value::Scalar(graph.add(a, b), dimension),
        (Value::Scalar(a, _), Value::Scalar(b, _), _) => Value::Scalar(graph.sub(a, b), dimension),
        (Value::Vector(a, _), Value::Vector(b, _), Op::Add) => Value::Vector(graph.add_vector(a, b), dimension),
        (Value::Vector(a, _), Value::Vector(b, _), _) => Value::Vector(graph.sub_vector(a, b), dimension),
        _ => return Err(Mismatch::shape(format!("`{sign}` does not apply to {} and {}", a.shape(), b.shape()))),
    })
}

/// `x + 5` where x is a length: say how to write what was meant.
fn with_unit_hint(graph: &mut Graph, units: &Units, mismatch: Mismatch, a: Value, b: Value) -> Mismatch {
    for (bare, other) in [(a, b), (b, a)] {
        if let (Value::Scalar(s, d), Some(wanted)) = (bare, other.dimension())
            && let (true, Some(value)) = (d.is_number(), graph.value(s))
        {
            return mismatch.hint(format!("a number has its unit with it: `{value} {}`", units.symbol(wanted)));
        }
    }
    mismatch
}

/// A bare number beside an angle means radians, and is refused in a model whose angles are written in something else.
fn bare_beside_angle(graph: &mut Graph, units: &Units, a: Value, b: Value) -> Result<(), Mismatch> {
    let radians = units.factor(Dimension::ANGLE) == 1.0;
    for (bare, other) in [(a, b), (b, a)] {
        let both = (bare.dimension(), other.dimension());
        if !radians
            && both == (Some(Dimension::NUMBER), Some(Dimension::ANGLE))
            && bare.is_constant(graph)
            && !bare.is_zero(graph)
        {
            let unit = units.symbol(Dimension::of(Base::Angle));
            return Err(Mismatch::dimension(
                "a bare number beside an angle, in a model whose angles are not in radians",
            )
            .hint(format!("write the unit: `… {unit}` or `… rad`")));
        }
    }
    Ok(())
}

fn multiply(graph: &mut Graph, a: Value, b: Value) -> Checked {
    Ok(match (a, b) {
        (Value::Scalar(a, da), Value::Scalar(b, db)) => Value::Scalar(graph.mul(a, b), product(da, db)?),
        (Value::Scalar(s, ds), Value::Vector(v, dv)) | (Value::Vector(v, dv), Value::Scalar(s, ds)) => {
            Value::Vector(graph.scale(s, v), product(ds, dv)?)
        }
        (Value::Rotation(r), Value::Rotation(s)) => Value::Rotation(graph.compose_rotation(r, s)),
        (Value::Rotation(r), Value::Vector(v, d)) => Value::Vector(graph.rotate(r, v), d),
        (Value::Frame(f, df), Value::Vector(p, dp)) => {
            let origin = Value::Vector(graph.origin(f), df);
            let dimension = common(graph, &origin, &Value::Vector(p, dp), "*")?;
            Value::Vector(graph.transform(f, p), dimension)
        }
        (Value::Frame(f, df), Value::Frame(g, dg)) => {
            let (of, og) = (Value::Vector(graph.origin(f), df), Value::Vector(graph.origin(g), dg));
            let dimension = common(graph, &of, &og, "*")?;
            Value::Frame(graph.compose_frame(f, g), dimension)
        }
        (Value::Frame(f, d), Value::Rotation(r)) => {
            let zero = graph.constant_vector([0.0; 3]);
            let turned = graph.frame(r, zero);
            Value::Frame(graph.compose_frame(f, turned), d)
        }
        (Value::Rotation(r), Value::Frame(f, d)) => {
            let zero = graph.constant_vector([0.0; 3]);
            let turned = graph.frame(r, zero);
            Value::Frame(graph.compose_frame(turned, f), d)
        }
        (Value::Vector(..), Value::Vector(..)) => {
            return Err(Mismatch::shape("two vectors are multiplied by `dot(a, b)` or `cross(a, b)`"));
        }
        _ => return Err(Mismatch::shape(format!("`*` does not apply to {} and {}", a.shape(), b.shape()))),
    })
}

fn divide(graph: &mut Graph, a: Value, b: Value) -> Checked {
    let Value::Scalar(divisor, db) = b else {
        return Err(Mismatch::shape(format!("one divides by a scalar, and this is {}", b.shape())));
    };
    let quotient = |da: Dimension| {
        da.checked_div(db).ok_or_else(|| Mismatch::dimension("the quotient's dimension is beyond all use"))
    };
    match a {
        Value::Scalar(s, da) => Ok(Value::Scalar(graph.div(s, divisor), quotient(da)?)),
        Value::Vector(v, da) => {
            let one = graph.constant(1.0);
            let inverse = graph.div(one, divisor);
            Ok(Value::Vector(graph.scale(inverse, v), quotient(da)?))
        }
        _ => Err(Mismatch::shape(format!("{} cannot be divided", a.shape()))),
    }
}

fn power(graph: &mut Graph, a: Value, b: Value) -> Checked {
    let (Value::Scalar(x, dx), Value::Scalar(n, dn)) = (a, b) else {
        return Err(Mismatch::shape(format!("`^` takes scalars, and these are {} and {}", a.shape(), b.shape())));
    };
    if !dn.without_angle().is_number() {
        return Err(Mismatch::dimension(format!("an exponent is a plain number, and this is {}", dn.noun())));
    }
    let dimension = match graph.value(n) {
        Some(value) => dx
            .pow(value)
            .or_else(|| dx.without_angle().is_number().then_some(Dimension::NUMBER))
            .ok_or_else(|| Mismatch::dimension(format!("{} to the power {value} has no dimension", dx.noun())))?,
        None if dx.without_angle().is_number() => Dimension::NUMBER,
        None => return Err(Mismatch::dimension(format!("{} takes a constant exponent only", dx.noun()))),
    };
    Ok(Value::Scalar(graph.pow(x, n), dimension))
}

/// The fields that a shape has.
pub(crate) fn fields(value: &Value) -> &'static [&'static str] {
    match value {
        Value::Scalar(..) => &[],
        Value::Vector(..) | Value::Rotation(_) => &["x", "y", "z"],
        Value::Frame(..) => &["o", "x", "y", "z", "r"],
    }
}

/// `value.name`, `None` where the shape has no such field.
pub(crate) fn field(graph: &mut Graph, value: Value, name: &str) -> Option<Value> {
    let axis = match name {
        "x" => Some(Axis::X),
        "y" => Some(Axis::Y),
        "z" => Some(Axis::Z),
        _ => None,
    };
    match (value, axis, name) {
        (Value::Vector(v, d), Some(axis), _) => Some(Value::Scalar(graph.component(v, axis), d)),
        (Value::Rotation(r), Some(axis), _) => Some(Value::Vector(graph.column(r, axis), Dimension::NUMBER)),
        (Value::Frame(f, _), Some(axis), _) => {
            let r = graph.rotation_of(f);
            Some(Value::Vector(graph.column(r, axis), Dimension::NUMBER))
        }
        (Value::Frame(f, d), None, "o") => Some(Value::Vector(graph.origin(f), d)),
        (Value::Frame(f, _), None, "r") => Some(Value::Rotation(graph.rotation_of(f))),
        _ => None,
    }
}
