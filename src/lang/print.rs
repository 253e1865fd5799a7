//! Tree to text.

use std::fmt::{self, Write};

use super::ast::level;
use super::{Expr, ExprKind, Key, Op};

/// Writes an expression with the fewest brackets that [`parse`](super::parse()) needs to read the same tree, apart from
/// brackets that keep a reader from mistaking `(2 mm)^2` for square millimetres and `(2).x` for a number.
///
/// A tree that was not read from text may hold negative numbers, which are read back as negations, and infinities, which
/// cannot be read at all.
///
/// ```
/// use phical::lang::{parse, print};
///
/// assert_eq!(print(&parse("(a*b) - ((c - d))*2mm")?), "a * b - (c - d) * 2 mm");
/// # Ok::<(), phical::lang::ParseError>(())
/// ```
pub fn print(expr: &Expr) -> String {
    expr.to_string()
}

impl fmt::Display for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write(f, self, level::SUM)
    }
}

/// Writes `expr` where `least` is the loosest level that needs no brackets.
fn write(f: &mut fmt::Formatter<'_>, expr: &Expr, least: u8) -> fmt::Result {
    if level_of(expr) < least {
        f.write_char('(')?;
        write_bare(f, expr)?;
        f.write_char(')')
    } else {
        write_bare(f, expr)
    }
}

fn write_bare(f: &mut fmt::Formatter<'_>, expr: &Expr) -> fmt::Result {
    match &expr.kind {
        ExprKind::Number { value, unit } => {
            write_number(f, *value)?;
            unit.iter().try_for_each(|(symbol, _)| write!(f, " {symbol}"))
        }
        ExprKind::Name(name) => f.write_str(name),
        ExprKind::Field(base, field) => {
            let number = matches!(base.kind, ExprKind::Number { .. });
            write(f, base, if number { level::POSTFIX + 1 } else { level::POSTFIX })?;
            write!(f, ".{field}")
        }
        ExprKind::Index { family, keys } => {
            write!(f, "{family}[")?;
            separated(f, keys, |f, Key { name, quoted, .. }| match quoted {
                true => write!(f, "'{}'", name.replace('\'', "''")),
                false => f.write_str(name),
            })?;
            f.write_char(']')
        }
        ExprKind::Call { function, arguments, .. } => {
            write!(f, "{function}(")?;
            separated(f, arguments, |f, argument| write(f, argument, level::SUM))?;
            f.write_char(')')
        }
        ExprKind::Negate(operand) => {
            f.write_char('-')?;
            write(f, operand, level::NEGATE)
        }
        ExprKind::Binary { op: Op::Pow, left, right } => {
            let united = matches!(left.kind, ExprKind::Number { unit: Some(_), .. });
            write(f, left, if united { level::POSTFIX + 1 } else { level::POSTFIX })?;
            f.write_char('^')?;
            write(f, right, level::NEGATE)
        }
        ExprKind::Binary { op, left, right } => {
            write(f, left, op.level())?;
            write!(f, " {} ", op.symbol())?;
            write(f, right, op.right_level())
        }
    }
}

fn level_of(expr: &Expr) -> u8 {
    match &expr.kind {
        ExprKind::Number { value, .. } if value.is_sign_negative() => level::NEGATE,
        ExprKind::Negate(_) => level::NEGATE,
        ExprKind::Binary { op, .. } => op.level(),
        _ => level::POSTFIX,
    }
}

/// Writes the shortest text that reads as the same double.
fn write_number(f: &mut fmt::Formatter<'_>, value: f64) -> fmt::Result {
    let size = value.abs();
    if size == 0.0 || (1e-5..1e16).contains(&size) { write!(f, "{value}") } else { write!(f, "{value:e}") }
}

fn separated<T>(
    f: &mut fmt::Formatter<'_>,
    items: &[T],
    each: impl Fn(&mut fmt::Formatter<'_>, &T) -> fmt::Result,
) -> fmt::Result {
    for (index, item) in items.iter().enumerate() {
        if index > 0 {
            f.write_str(", ")?;
        }
        each(f, item)?;
    }
    Ok(())
}
