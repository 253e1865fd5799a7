//! The functions that are part of the language itself, beside the scalar operations that are functions by their row in
//! [`crate::graph::OPERATIONS`]. What can be written in the language is in the prelude instead.

use super::value::Value;
use crate::diag::Code;
use crate::graph::{Axis, DimensionRule, Graph, Operation};
use crate::unit::Dimension;

/// A mistake in an expression, before it has a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mismatch {
    pub(crate) kind: MismatchKind,
    pub(crate) message: String,
    pub(crate) hint: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MismatchKind {
    Arity,
    Shape,
    Dimension,
}

impl MismatchKind {
    pub(crate) fn code(self) -> Code {
        match self {
            MismatchKind::Arity => Code::WrongArity,
            MismatchKind::Shape => Code::WrongShape,
            MismatchKind::Dimension => Code::WrongDimension,
        }
    }
}

impl Mismatch {
    pub(crate) fn shape(message: impl Into<String>) -> Self {
        Mismatch { kind: MismatchKind::Shape, message: message.into(), hint: None }
    }

    pub(crate) fn dimension(message: impl Into<String>) -> Self {
        Mismatch { kind: MismatchKind::Dimension, message: message.into(), hint: None }
    }

    pub(crate) fn arity(message: impl Into<String>) -> Self {
        Mismatch { kind: MismatchKind::Arity, message: message.into(), hint: None }
    }

    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

type Checked = Result<Value, Mismatch>;

/// A row: name, arguments as shown to the user, what it does.
struct Core {
    name: &'static str,
    arguments: &'static [&'static str],
    apply: fn(&mut Graph, &[Value]) -> Checked,
}

/// Every core function that is not a scalar operation.
const CORE: &[Core] = &[
    Core { name: "vec", arguments: &["x", "y", "z"], apply: vec },
    Core { name: "dot", arguments: &["a", "b"], apply: dot },
    Core { name: "cross", arguments: &["a", "b"], apply: cross },
    Core { name: "norm", arguments: &["v"], apply: norm },
    Core { name: "unit", arguments: &["v"], apply: unit },
    Core { name: "rotation_x", arguments: &["angle"], apply: |g, a| turn(g, a, Axis::X) },
    Core { name: "rotation_y", arguments: &["angle"], apply: |g, a| turn(g, a, Axis::Y) },
    Core { name: "rotation_z", arguments: &["angle"], apply: |g, a| turn(g, a, Axis::Z) },
    Core { name: "rotation_vector", arguments: &["v"], apply: rotation_vector },
    Core { name: "quaternion", arguments: &["w", "x", "y", "z"], apply: quaternion },
    Core { name: "frame", arguments: &["o", "R"], apply: frame },
    Core { name: "rotate", arguments: &["R", "v"], apply: rotate },
    Core { name: "transform", arguments: &["F", "p"], apply: transform },
    Core { name: "inverse", arguments: &["F"], apply: inverse },
    Core { name: "log_rotation", arguments: &["R"], apply: log_rotation },
];

/// The one whose second argument is no value, but what one differentiates by.
pub(crate) const DERIVATIVE: &str = "derivative";

/// The names of all core functions, operations included.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    let operations = crate::graph::OPERATIONS.iter().filter(|row| row.function).map(|row| row.name);
    CORE.iter().map(|core| core.name).chain(operations).chain([DERIVATIVE])
}

/// How many arguments a core function has, `None` where there is no such function.
pub(crate) fn arity(name: &str) -> Option<usize> {
    if name == DERIVATIVE {
        return Some(2);
    }
    let core = CORE.iter().find(|core| core.name == name).map(|core| core.arguments.len());
    core.or_else(|| Operation::function(name).map(|operation| operation.row().arity))
}

/// Calls a core function, `None` where there is no such function.
pub(crate) fn call(graph: &mut Graph, name: &str, arguments: &[Value]) -> Option<Checked> {
    let wanted = arity(name)?;
    if arguments.len() != wanted {
        return Some(Err(wrong_arity(name, wanted, arguments.len())));
    }
    Some(match CORE.iter().find(|core| core.name == name) {
        Some(core) => (core.apply)(graph, arguments),
        None => scalar_operation(graph, Operation::function(name)?, arguments),
    })
}

pub(crate) fn wrong_arity(name: &str, wanted: usize, found: usize) -> Mismatch {
    let plural = if wanted == 1 { "" } else { "s" };
    Mismatch::arity(format!("`{name}` takes {wanted} argument{plural}, and {found} are given"))
}

fn scalar_operation(graph: &mut Graph, operation: Operation, arguments: &[Value]) -> Checked {
    let row = operation.row();
    let mut scalars = Vec::with_capacity(2);
    for argument in arguments {
        let Value::Scalar(s, dimension) = *argument else {
            let better = if matches!((operation, argument), (Operation::Abs, Value::Vector(..))) {
                "norm(v) is the length of a vector"
            } else {
                "take a component, such as `v.x`"
            };
            return Err(
                Mismatch::shape(format!("`{}` takes scalars, and this is {}", row.name, argument.shape())).hint(better)
            );
        };
        scalars.push((s, dimension));
    }
    let Some(&(x, dx)) = scalars.first() else { return Err(wrong_arity(row.name, row.arity, 0)) };
    let y = scalars.get(1).map_or(x, |(y, _)| *y);
    let pair = |graph: &mut Graph| match arguments {
        [one, other] => common(graph, one, other, row.name),
        _ => Err(wrong_arity(row.name, 2, arguments.len())),
    };
    let dimension = match row.dimensions {
        DimensionRule::OfAngle | DimensionRule::OfNumber | DimensionRule::ToAngle
            if !dx.without_angle().is_number() =>
        {
            let wanted = if row.dimensions == DimensionRule::OfAngle { "an angle" } else { "a plain number" };
            return Err(Mismatch::dimension(format!("`{}` takes {wanted}, and this is {}", row.name, dx.noun()))
                .hint("divide by a quantity of the same kind"));
        }
        DimensionRule::OfAngle | DimensionRule::OfNumber => Dimension::NUMBER,
        DimensionRule::ToAngle => Dimension::ANGLE,
        DimensionRule::QuotientToAngle => {
            pair(graph)?;
            Dimension::ANGLE
        }
        DimensionRule::Root => {
            dx.sqrt().ok_or_else(|| Mismatch::dimension(format!("the root of {} has no dimension", dx.noun())))?
        }
        _ if row.arity == 2 => pair(graph)?,
        _ => dx,
    };
    Ok(Value::Scalar(graph.apply(operation, x, y), dimension))
}

/// The dimension that two values share, zero fitting everywhere.
pub(crate) fn common(graph: &mut Graph, a: &Value, b: &Value, what: &str) -> Result<Dimension, Mismatch> {
    let (Some(da), Some(db)) = (a.dimension(), b.dimension()) else {
        return Err(Mismatch::shape(format!("`{what}` does not apply to {} and {}", a.shape(), b.shape())));
    };
    if a.is_zero(graph) && !b.is_zero(graph) {
        return Ok(db);
    }
    if b.is_zero(graph) {
        return Ok(da);
    }
    if !da.compatible(db) {
        return Err(Mismatch::dimension(format!("`{what}` of {} and {}", da.noun(), db.noun())));
    }
    Ok(if da.is_number() { db } else { da })
}

/// The product of two dimensions.
pub(crate) fn product(a: Dimension, b: Dimension) -> Result<Dimension, Mismatch> {
    a.checked_mul(b).ok_or_else(|| Mismatch::dimension("the product's dimension is beyond all use"))
}

fn wrong(name: &str, wanted: &str, found: &Value) -> Mismatch {
    Mismatch::shape(format!("`{name}` takes {wanted}, and this is {}", found.shape()))
}

fn vec(graph: &mut Graph, arguments: &[Value]) -> Checked {
    let &[mut so_far, ..] = arguments else { return Err(wrong_arity("vec", 3, 0)) };
    let mut nodes = Vec::with_capacity(3);
    for argument in arguments {
        let Value::Scalar(s, _) = *argument else { return Err(wrong("vec", "three scalars", argument)) };
        let dimension = common(graph, &so_far, argument, "vec")?;
        if let Value::Scalar(node, _) = if so_far.is_zero(graph) { *argument } else { so_far } {
            so_far = Value::Scalar(node, dimension);
        }
        nodes.push(s);
    }
    let &[x, y, z] = nodes.as_slice() else { return Err(wrong_arity("vec", 3, nodes.len())) };
    Ok(Value::Vector(graph.vector(x, y, z), so_far.dimension().unwrap_or(Dimension::NUMBER)))
}

fn dot(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        [Value::Vector(a, da), Value::Vector(b, db)] => Ok(Value::Scalar(graph.dot(*a, *b), product(*da, *db)?)),
        [Value::Vector(..), other] | [other, _] => Err(wrong("dot", "two vectors", other)),
        _ => Err(wrong_arity("dot", 2, arguments.len())),
    }
}

fn cross(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        [Value::Vector(a, da), Value::Vector(b, db)] => Ok(Value::Vector(graph.cross(*a, *b), product(*da, *db)?)),
        [Value::Vector(..), other] | [other, _] => Err(wrong("cross", "two vectors", other)),
        _ => Err(wrong_arity("cross", 2, arguments.len())),
    }
}

fn norm(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        &[Value::Vector(v, d)] => Ok(Value::Scalar(graph.norm(v), d)),
        [other] => Err(wrong("norm", "a vector", other)),
        _ => Err(wrong_arity("norm", 1, arguments.len())),
    }
}

fn unit(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        &[Value::Vector(v, _)] => Ok(Value::Vector(graph.unit(v), Dimension::NUMBER)),
        [other] => Err(wrong("unit", "a vector", other)),
        _ => Err(wrong_arity("unit", 1, arguments.len())),
    }
}

fn turn(graph: &mut Graph, arguments: &[Value], axis: Axis) -> Checked {
    let name = match axis {
        Axis::X => "rotation_x",
        Axis::Y => "rotation_y",
        Axis::Z => "rotation_z",
    };
    match arguments {
        &[Value::Scalar(s, d)] if d.without_angle().is_number() => Ok(Value::Rotation(graph.turn(axis, s))),
        &[Value::Scalar(_, d)] => {
            Err(Mismatch::dimension(format!("`{name}` takes an angle, and this is {}", d.noun())))
        }
        [other] => Err(wrong(name, "an angle", other)),
        _ => Err(wrong_arity(name, 1, arguments.len())),
    }
}

fn rotation_vector(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        &[Value::Vector(v, d)] if d.without_angle().is_number() => Ok(Value::Rotation(graph.exp_rotation(v))),
        &[Value::Vector(_, d)] => {
            Err(Mismatch::dimension(format!("`rotation_vector` takes angles, and this is {}", d.noun())))
        }
        [other] => Err(wrong("rotation_vector", "a vector of angles", other)),
        _ => Err(wrong_arity("rotation_vector", 1, arguments.len())),
    }
}

fn quaternion(graph: &mut Graph, arguments: &[Value]) -> Checked {
    let mut nodes = Vec::with_capacity(4);
    for argument in arguments {
        match *argument {
            Value::Scalar(s, d) if d.is_number() => nodes.push(s),
            Value::Scalar(_, d) => {
                return Err(Mismatch::dimension(format!("`quaternion` takes plain numbers, and this is {}", d.noun())));
            }
            ref other => return Err(wrong("quaternion", "four scalars", other)),
        }
    }
    let &[w, x, y, z] = nodes.as_slice() else { return Err(wrong_arity("quaternion", 4, nodes.len())) };
    Ok(Value::Rotation(graph.quaternion(w, x, y, z)))
}

fn frame(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        [Value::Vector(o, d), Value::Rotation(r)] => Ok(Value::Frame(graph.frame(*r, *o), *d)),
        [Value::Vector(..), other] => Err(wrong("frame", "a rotation second", other)),
        [other, _] => Err(wrong("frame", "a vector first", other)),
        _ => Err(wrong_arity("frame", 2, arguments.len())),
    }
}

fn rotate(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        [Value::Rotation(r), Value::Vector(v, d)] => Ok(Value::Vector(graph.rotate(*r, *v), *d)),
        [Value::Frame(f, _), Value::Vector(v, d)] => {
            let r = graph.rotation_of(*f);
            Ok(Value::Vector(graph.rotate(r, *v), *d))
        }
        [Value::Rotation(_) | Value::Frame(..), other] => Err(wrong("rotate", "a vector second", other)),
        [other, _] => Err(wrong("rotate", "a rotation first", other)),
        _ => Err(wrong_arity("rotate", 2, arguments.len())),
    }
}

fn transform(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        [Value::Frame(f, df), Value::Vector(v, d)] => {
            let here = Value::Vector(*v, *d);
            let origin = graph.origin(*f);
            let dimension = common(graph, &Value::Vector(origin, *df), &here, "transform")?;
            Ok(Value::Vector(graph.transform(*f, *v), dimension))
        }
        [Value::Frame(..), other] => Err(wrong("transform", "a point second", other)),
        [other, _] => Err(wrong("transform", "a frame first", other)),
        _ => Err(wrong_arity("transform", 2, arguments.len())),
    }
}

fn inverse(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        &[Value::Rotation(r)] => Ok(Value::Rotation(graph.inverse_rotation(r))),
        &[Value::Frame(f, d)] => Ok(Value::Frame(graph.inverse_frame(f), d)),
        [other] => Err(wrong("inverse", "a rotation or a frame", other)),
        _ => Err(wrong_arity("inverse", 1, arguments.len())),
    }
}

fn log_rotation(graph: &mut Graph, arguments: &[Value]) -> Checked {
    match arguments {
        &[Value::Rotation(r)] => Ok(Value::Vector(graph.log_rotation(r), Dimension::ANGLE)),
        [other] => Err(wrong("log_rotation", "a rotation", other).hint("a frame's rotation is `F.r`")),
        _ => Err(wrong_arity("log_rotation", 1, arguments.len())),
    }
}
