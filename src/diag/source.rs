//! Text with a name, byte spans in it, and the lines and columns people count in.

use std::io::Read;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use std::{fmt, fs};

use super::{Code, DataPlace, Diagnostic};

/// Bytes of a text that is read as a whole, such as a fit or a matrix: a quarter of a gibibyte takes about two of memory once it is
/// understood. Rows of data are read piece by piece and have no such limit.
const MOST_BYTES: u64 = 1 << 28;

/// A range of bytes in a [`Source`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Span {
    /// The first byte.
    pub start: usize,
    /// The byte after the last.
    pub end: usize,
}

impl Span {
    /// The bytes from `start` up to, not including, `end`.
    #[must_use]
    pub const fn new(start: usize, end: usize) -> Self {
        Self { start, end }
    }

    /// The range of bytes.
    #[must_use]
    pub const fn range(self) -> Range<usize> {
        self.start..self.end
    }

    /// The smallest span that holds both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self::new(self.start.min(other.start), self.end.max(other.end))
    }
}

/// A line and a column, both counted from one, columns in characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The line.
    pub line: usize,
    /// The character in the line.
    pub column: usize,
}

/// A text and the name it is shown under, usually a path.
pub struct Source {
    name: String,
    text: String,
    line_starts: Vec<usize>,
}

/// By its name: the text would bury whatever holds it.
impl fmt::Debug for Source {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_tuple("Source").field(&self.name).finish()
    }
}

impl Source {
    /// A text and its name, ready to be pointed into.
    #[must_use]
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Arc<Self> {
        let text = text.into();
        let line_starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Arc::new(Self { name: name.into(), text, line_starts })
    }

    /// The text of a file.
    ///
    /// # Errors
    ///
    /// [`Code::UnreadableFile`] where there is no such file, it may not be read, or it is not UTF-8; [`Code::TooLong`] where it has
    /// no end in sight.
    pub fn read(path: &Path) -> Result<Arc<Self>, Box<Diagnostic>> {
        let name = path.display().to_string();
        let unreadable = |why: String| {
            let place = DataPlace::file(&name);
            Box::new(Diagnostic::error(Code::UnreadableFile, why).at_data(place))
        };
        let cannot = |e| unreadable(format!("`{name}` cannot be read: {e}"));
        let mut bytes = Vec::new();
        let file = fs::File::open(path).map_err(cannot)?;
        file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(cannot)?;
        if bytes.len() as u64 > MOST_BYTES {
            let message = format!("`{name}` is longer than {} MiB", MOST_BYTES >> 20);
            let found = Diagnostic::error(Code::TooLong, message).at_data(DataPlace::file(&name));
            return Err(Box::new(found.hint("name the file that was meant, or write a shorter one")));
        }
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self::new(name, text)),
            Err(e) => {
                let at = e.utf8_error().valid_up_to();
                Err(unreadable(format!("`{name}` is not UTF-8 text (byte {at} is the first that is not)")))
            }
        }
    }

    /// The name it is shown under.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The text of a span; bytes outside the text or inside a character are left out.
    #[must_use]
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(self.clamp(span).range()).unwrap_or("")
    }

    /// The line and column of a byte; past the end counts as the end.
    #[must_use]
    pub fn position(&self, byte: usize) -> Position {
        let byte = self.floor(byte);
        let line = self.line_starts.partition_point(|&start| start <= byte);
        let start = self.line_starts.get(line.saturating_sub(1)).copied().unwrap_or(0);
        Position { line, column: 1 + self.slice(Span::new(start, byte)).chars().count() }
    }

    /// The byte of a line and column; past the end of a line counts as its end.
    #[must_use]
    pub fn offset(&self, position: Position) -> usize {
        let Some(&start) = self.line_starts.get(position.line.saturating_sub(1)) else {
            return self.text.len();
        };
        let line = self.slice(Span::new(start, self.text.len())).split('\n').next().unwrap_or("");
        let within = line.char_indices().nth(position.column.saturating_sub(1));
        start + within.map_or(line.len(), |(at, _)| at)
    }

    /// The last character boundary that is not after the byte.
    fn floor(&self, byte: usize) -> usize {
        let most = byte.min(self.text.len());
        let boundary = (0..=most).rev().find(|&b| self.text.is_char_boundary(b));
        boundary.unwrap_or(0)
    }

    /// The span, moved to lie inside the text and between characters.
    #[must_use]
    pub fn clamp(&self, span: Span) -> Span {
        let start = self.floor(span.start);
        let least = span.end.clamp(start, self.text.len());
        let end = (least..).find(|&byte| self.text.is_char_boundary(byte));
        let end = end.unwrap_or(self.text.len());
        Span::new(start, end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        let source = Source::new("m", "a°b\nµ\n");
        assert_eq!(source.position(3), Position { line: 1, column: 3 });
        assert_eq!(source.position(5), Position { line: 2, column: 1 });
        assert_eq!(source.position(7), Position { line: 2, column: 2 });
        assert_eq!(source.position(99), Position { line: 3, column: 1 });
    }

    #[test]
    fn bytes_and_positions_are_inverse() {
        let source = Source::new("m", "(a: \"µm\",\n\n  b: 1)");
        for (byte, _) in source.text().char_indices() {
            assert_eq!(source.offset(source.position(byte)), byte);
        }
        assert_eq!(source.offset(Position { line: 9, column: 1 }), source.text().len());
        assert_eq!(source.offset(Position { line: 1, column: 99 }), 10);
    }

    #[test]
    fn spans_are_clamped_to_characters() {
        let source = Source::new("m", "a°b");
        assert_eq!(source.clamp(Span::new(2, 2)), Span::new(1, 3));
        assert_eq!(source.slice(Span::new(3, 50)), "b");
        assert_eq!(source.slice(Span::new(9, 2)), "");
    }

    #[test]
    fn a_missing_file_has_a_code() {
        let missing = Source::read(Path::new("no/such/model.ron"));
        assert_eq!(missing.unwrap_err().code, Code::UnreadableFile);
    }
}
