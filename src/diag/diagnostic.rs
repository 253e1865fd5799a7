//! One mistake or warning with its place, and collections of them.

use std::sync::Arc;

use super::{Code, Severity, Source, Span};

/// A place in a table of data. What is not known is absent.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct DataPlace {
    /// The file, as shown.
    pub file: String,
    /// The line of the file, counted from one.
    pub line: Option<usize>,
    /// The row of the table, counted from one, headings left out.
    pub row: Option<usize>,
    /// The name of the column.
    pub column: Option<String>,
    /// What stands there.
    pub value: Option<String>,
}

impl DataPlace {
    /// A file as a whole.
    #[must_use]
    pub fn file(name: impl Into<String>) -> Self {
        Self { file: name.into(), ..Self::default() }
    }
}

/// What a diagnostic speaks of.
#[derive(Clone, Debug)]
pub enum Place {
    /// A piece of a text.
    Text {
        /// The text.
        source: Arc<Source>,
        /// The piece.
        span: Span,
    },
    /// A cell, a row or a file of data.
    Data(DataPlace),
}

/// What places are sorted by: the file, then where in it.
type PlaceKey<'a> = (&'a str, usize, usize, Option<&'a str>);

/// What diagnostics are sorted by, and are the same by.
pub(super) type Key<'a> = (Option<PlaceKey<'a>>, Code, &'a str);

impl Place {
    fn key(&self) -> PlaceKey<'_> {
        match self {
            Self::Text { source, span } => (source.name(), span.start, span.end, None),
            Self::Data(data) => (&data.file, data.line.unwrap_or(0), data.row.unwrap_or(0), data.column.as_deref()),
        }
    }
}

/// A mistake or a warning.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// Which kind of mistake; explained by `phical explain`.
    pub code: Code,
    /// Whether the run can go on.
    pub severity: Severity,
    /// One sentence, without a full stop.
    pub message: String,
    /// What it speaks of.
    pub place: Option<Place>,
    /// Other places that matter, each with a few words.
    pub labels: Vec<(Place, String)>,
    /// What to do about it.
    pub hint: Option<String>,
}

impl Diagnostic {
    /// An error: the run cannot start.
    #[must_use]
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, message.into())
    }

    /// A warning: the run goes on, and the output says so.
    #[must_use]
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, message.into())
    }

    fn new(code: Code, severity: Severity, message: String) -> Self {
        Self { code, severity, message, place: None, labels: Vec::new(), hint: None }
    }

    /// Says where it is in a text.
    #[must_use]
    pub fn at(mut self, source: &Arc<Source>, span: Span) -> Self {
        self.place = Some(Place::Text { source: Arc::clone(source), span: source.clamp(span) });
        self
    }

    /// Says where it is in the data.
    #[must_use]
    pub fn at_data(mut self, place: DataPlace) -> Self {
        self.place = Some(Place::Data(place));
        self
    }

    /// Adds another place in a text, with a few words.
    #[must_use]
    pub fn label(mut self, source: &Arc<Source>, span: Span, words: impl Into<String>) -> Self {
        let place = Place::Text { source: Arc::clone(source), span: source.clamp(span) };
        self.labels.push((place, words.into()));
        self
    }

    /// Says what to do about it.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        self.maybe_hint(Some(hint.into()))
    }

    /// Says what to do about it, where that is known.
    #[must_use]
    pub fn maybe_hint(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }

    /// What diagnostics are sorted by, and are the same by.
    pub(super) fn key(&self) -> Key<'_> {
        (self.place.as_ref().map(Place::key), self.code, &self.message)
    }
}

/// Diagnostics in the order they were found.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(Vec::new())
    }

    /// Adds one.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.0.push(diagnostic);
    }

    /// Whether any is an error.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.0.iter().any(|d| d.severity == Severity::Error)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// In the order found.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.0.iter()
    }

    /// Sorted by place, each said once. Those without a place come first.
    #[must_use]
    pub fn sorted(mut self) -> Self {
        self.0.sort_by(|a, b| a.key().cmp(&b.key()));
        self.0.dedup_by(|a, b| a.key() == b.key());
        self
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(one: Diagnostic) -> Self {
        Self(vec![one])
    }
}

impl Extend<Diagnostic> for Diagnostics {
    fn extend<I: IntoIterator<Item = Diagnostic>>(&mut self, more: I) {
        self.0.extend(more);
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl<'a> IntoIterator for &'a Diagnostics {
    type Item = &'a Diagnostic;
    type IntoIter = std::slice::Iter<'a, Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorting_orders_by_place_and_says_each_once() {
        let source = Source::new("m.ron", "(a: 1, b: 2)");
        let at =
            |start| Diagnostic::error(Code::UnknownField, "no such field").at(&source, Span::new(start, start + 1));
        let mut found = Diagnostics::from(at(7));
        found.extend([at(1), at(7), Diagnostic::warning(Code::UnitWeights, "weights are unit")]);
        assert!(found.has_errors());
        let sorted = found.sorted();
        let places: Vec<_> = sorted.iter().map(|d| d.key().0).collect();
        assert_eq!(places, [None, Some(("m.ron", 1, 2, None)), Some(("m.ron", 7, 8, None))]);
    }
}
