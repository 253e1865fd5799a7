//! A text of the model with its place: what diagnostics point at.

use std::ops::Range;
use std::sync::Arc;

use crate::diag::{Code, Diagnostic, Source, Span};
use crate::lang::{self, Expr, ParseError, ParseErrorKind, Relation};
use crate::model::Text;

/// An expression as text, and where it stands.
#[derive(Clone, Debug)]
pub(crate) struct Snippet {
    text: Text,
    pub(crate) source: Arc<Source>,
}

impl Snippet {
    pub(crate) fn new(text: &Text, source: &Arc<Source>) -> Self {
        Snippet { text: text.clone(), source: Arc::clone(source) }
    }

    /// A text that is a source of its own: the prelude, an expression of the command line.
    pub(crate) fn alone(name: &str, text: &str) -> Self {
        let span = Span::new(0, text.len());
        Snippet { text: Text { value: text.to_owned(), span, exact: true }, source: Source::new(name, text) }
    }

    /// The place of a part of the text.
    pub(crate) fn span(&self, inner: &Range<usize>) -> Span {
        self.text.locate(Span::new(inner.start, inner.end))
    }

    /// The place of the whole text.
    pub(crate) fn place(&self) -> Span {
        self.text.span
    }

    /// A mistake of the whole text.
    pub(crate) fn whole(&self, code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(code, message).at(&self.source, self.place())
    }

    /// The tree of the text.
    pub(crate) fn parse(&self) -> Result<Expr, Box<Diagnostic>> {
        lang::parse(&self.text.value).map_err(|error| self.mistake(error))
    }

    /// What the text compares.
    pub(crate) fn relation(&self) -> Result<Relation, Box<Diagnostic>> {
        lang::parse_relation(&self.text.value).map_err(|error| self.mistake(error))
    }

    fn mistake(&self, error: ParseError) -> Box<Diagnostic> {
        let code = match error.kind {
            ParseErrorKind::UnknownUnit => Code::UnknownUnit,
            ParseErrorKind::TooDeep => Code::NestedTooDeep,
            _ => Code::BadExpression,
        };
        Box::new(Diagnostic::error(code, error.message).at(&self.source, self.span(&error.span)).maybe_hint(error.hint))
    }
}
