//! The tree of an expression.

use std::ops::Range;

use crate::unit::Unit;

/// An expression and its place: bytes of the text it was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// What stands there.
    pub kind: ExprKind,
    /// Where it stands. Brackets around the whole of it are not part of it.
    pub span: Range<usize>,
}

/// The forms of an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// A number, never negative where it was read from text, with its unit as written.
    Number {
        /// The number, in its unit.
        value: f64,
        /// The unit's symbol and meaning. Degrees-minutes-seconds become decimal degrees.
        unit: Option<(String, Unit)>,
    },
    /// A name.
    Name(String),
    /// A component, `L1.alpha`, `v.x`. The name of the field ends where the expression ends.
    Field(Box<Expr>, String),
    /// A member of a family, `socket[hole]`, `socket['front/0']`.
    Index {
        /// The family.
        family: String,
        /// The names of its key columns, or texts that are keys themselves; at least one.
        keys: Vec<Key>,
    },
    /// A call of a function or chain.
    Call {
        /// What is called.
        function: String,
        /// The place of that name.
        name_span: Range<usize>,
        /// The arguments, possibly none.
        arguments: Vec<Expr>,
    },
    /// `-a`.
    Negate(Box<Expr>),
    /// An operation on two operands.
    Binary {
        /// Which one.
        op: Op,
        /// The first operand.
        left: Box<Expr>,
        /// The second operand.
        right: Box<Expr>,
    },
}

/// A name and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ident {
    /// The name.
    pub name: String,
    /// Where it stands.
    pub span: Range<usize>,
}

/// What stands in the brackets after a family's name, and its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// The name, or the text between the quotes, two of which stand for one.
    pub name: String,
    /// Whether it stands in quotes, `'front/0'`.
    pub quoted: bool,
    /// Where it stands, quotes included.
    pub span: Range<usize>,
}

/// An operation on two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    /// `a + b`
    Add,
    /// `a - b`
    Sub,
    /// `a * b`
    Mul,
    /// `a / b`
    Div,
    /// `a ^ b`
    Pow,
}

impl Op {
    /// All of them.
    pub const ALL: [Op; 5] = [Op::Add, Op::Sub, Op::Mul, Op::Div, Op::Pow];

    /// The operator as it is written.
    pub fn symbol(self) -> &'static str {
        match self {
            Op::Add => "+",
            Op::Sub => "-",
            Op::Mul => "*",
            Op::Div => "/",
            Op::Pow => "^",
        }
    }

    /// How tightly it binds; see [`level`] for the other forms.
    pub(super) fn level(self) -> u8 {
        match self {
            Op::Add | Op::Sub => level::SUM,
            Op::Mul | Op::Div => level::PRODUCT,
            Op::Pow => level::POWER,
        }
    }

    /// The least level of the second operand. That of `^` may begin with a minus, which is not a matter of level.
    pub(super) fn right_level(self) -> u8 {
        match self {
            Op::Pow => level::POWER,
            _ => self.level() + 1,
        }
    }
}

/// How tightly the forms bind.
pub(super) mod level {
    pub(in crate::lang) const SUM: u8 = 1;
    pub(in crate::lang) const PRODUCT: u8 = 2;
    pub(in crate::lang) const NEGATE: u8 = 3;
    pub(in crate::lang) const POWER: u8 = 4;
    pub(in crate::lang) const POSTFIX: u8 = 5;
}

impl Expr {
    /// The expressions it is made of, in the order of the text.
    pub fn children(&self) -> impl DoubleEndedIterator<Item = &Expr> {
        let (first, second, many): (Option<&Expr>, Option<&Expr>, &[Expr]) = match &self.kind {
            ExprKind::Number { .. } | ExprKind::Name(_) | ExprKind::Index { .. } => (None, None, &[]),
            ExprKind::Field(base, _) => (Some(base), None, &[]),
            ExprKind::Negate(operand) => (Some(operand), None, &[]),
            ExprKind::Call { arguments, .. } => (None, None, arguments),
            ExprKind::Binary { left, right, .. } => (Some(left), Some(right), &[]),
        };
        first.into_iter().chain(second).chain(many)
    }

    /// The same head over other children, as many as it has.
    #[must_use]
    pub fn with_children(&self, children: Vec<Expr>) -> Expr {
        let mut children = children.into_iter();
        let mut next = || children.next().unwrap_or_else(|| self.clone());
        let kind = match &self.kind {
            ExprKind::Field(_, field) => ExprKind::Field(Box::new(next()), field.clone()),
            ExprKind::Negate(_) => ExprKind::Negate(Box::new(next())),
            ExprKind::Binary { op, .. } => {
                ExprKind::Binary { op: *op, left: Box::new(next()), right: Box::new(next()) }
            }
            ExprKind::Call { function, name_span, arguments } => ExprKind::Call {
                function: function.clone(),
                name_span: name_span.clone(),
                arguments: arguments.iter().map(|_| next()).collect(),
            },
            leaf => leaf.clone(),
        };
        Expr { kind, span: self.span.clone() }
    }

    /// Shows every expression inside, itself first, then its children in the order of the text. Needs no stack.
    ///
    /// ```
    /// use phical::lang::{ExprKind, parse};
    ///
    /// let mut names = Vec::new();
    /// parse("left(hzL1, vL1).o + L1.a")?.visit(|expr| {
    ///     if let ExprKind::Name(name) = &expr.kind {
    ///         names.push(name.clone());
    ///     }
    /// });
    /// assert_eq!(names, ["hzL1", "vL1", "L1"]);
    /// # Ok::<(), phical::lang::ParseError>(())
    /// ```
    pub fn visit<'a>(&'a self, mut see: impl FnMut(&'a Expr)) {
        let mut waiting = vec![self];
        while let Some(expr) = waiting.pop() {
            see(expr);
            waiting.extend(expr.children().rev());
        }
    }

    /// Whether both are the same expression, wherever they stand. Numbers are compared bit by bit.
    pub fn same(&self, other: &Expr) -> bool {
        let mut waiting = vec![(self, other)];
        while let Some((a, b)) = waiting.pop() {
            if !same_head(&a.kind, &b.kind) || a.children().count() != b.children().count() {
                return false;
            }
            waiting.extend(a.children().zip(b.children()));
        }
        true
    }
}

/// Whether both are the same apart from spans and children.
fn same_head(a: &ExprKind, b: &ExprKind) -> bool {
    use ExprKind::*;
    match (a, b) {
        (Number { value: a, unit: u }, Number { value: b, unit: v }) => a.to_bits() == b.to_bits() && u == v,
        (Name(a), Name(b)) | (Field(_, a), Field(_, b)) => a == b,
        (Index { family: a, keys: k }, Index { family: b, keys: l }) => {
            a == b && k.iter().map(|key| (&key.name, key.quoted)).eq(l.iter().map(|key| (&key.name, key.quoted)))
        }
        (Call { function: a, .. }, Call { function: b, .. }) => a == b,
        (Negate(_), Negate(_)) => true,
        (Binary { op: a, .. }, Binary { op: b, .. }) => a == b,
        _ => false,
    }
}
