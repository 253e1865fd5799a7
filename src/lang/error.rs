//! What can be wrong with the text of an expression.

use std::ops::Range;

/// A mistake in the text of an expression: where, what, and often the cure.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ParseError {
    /// Bytes of the expression's text, on character boundaries; empty at the end of an empty text.
    pub span: Range<usize>,
    /// Which mistake.
    pub kind: ParseErrorKind,
    /// One sentence without a full stop.
    pub message: String,
    /// What to write instead.
    pub hint: Option<String>,
}

/// The mistakes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ParseErrorKind {
    /// There is no expression at all.
    Empty,
    /// A character that the language does not use, or not there.
    UnexpectedCharacter,
    /// An opening bracket without its closing one; the span is the opening one's.
    UnclosedBracket,
    /// A closing bracket without its opening one.
    UnopenedBracket,
    /// An operator, bracket or comma without what it needs.
    MissingOperand,
    /// Two operands side by side.
    MissingOperator,
    /// Something after the end of the expression.
    TrailingText,
    /// A name has to stand here: a field, a key, a parameter.
    ExpectedName,
    /// A call of something that is no name.
    NotCallable,
    /// Square brackets after something that is no name.
    NotIndexable,
    /// Nested more than [`MAX_DEPTH`](super::MAX_DEPTH) deep.
    TooDeep,
    /// A number that is malformed or beyond what a double holds.
    BadNumber,
    /// A word after a number that is no unit.
    UnknownUnit,
    /// `<`, `==` and the like.
    Comparison,
    /// `=`.
    Assignment,
    /// `**`.
    DoubleStar,
    /// A parameter's name that stands twice.
    DuplicateParameter,
}

impl ParseError {
    pub(super) fn new(kind: ParseErrorKind, span: Range<usize>, message: impl Into<String>) -> ParseError {
        ParseError { span, kind, message: message.into(), hint: None }
    }

    pub(super) fn hint(mut self, hint: impl Into<String>) -> ParseError {
        self.hint = Some(hint.into());
        self
    }
}
