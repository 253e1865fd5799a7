//! Text that knows its place.

use std::fmt;

use crate::diag::Span;

/// Text between quotes, and where it stands.
///
/// Equality compares the text, not the place.
#[derive(Clone, Debug, Default)]
pub struct Text {
    /// The text, escapes resolved.
    pub value: String,
    /// The bytes between the quotes.
    pub span: Span,
    /// Whether the text stands in the file as it is, without escapes: then byte `k` of it is byte `span.start + k` of the file.
    pub exact: bool,
}

impl PartialEq for Text {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl Text {
    /// The place in the file of a piece of this text; of the whole text where escapes hide the piece.
    #[must_use]
    pub fn locate(&self, inner: Span) -> Span {
        if self.exact {
            let end = self.span.end;
            Span::new(
                (self.span.start.saturating_add(inner.start)).min(end),
                (self.span.start.saturating_add(inner.end)).min(end),
            )
        } else {
            self.span
        }
    }

    /// The text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.value
    }
}

impl From<&str> for Text {
    fn from(value: &str) -> Self {
        Self { value: value.to_owned(), ..Self::default() }
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.value)
    }
}
