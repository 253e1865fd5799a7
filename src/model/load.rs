//! A text into a model, or everything that is wrong with it.

use std::collections::BTreeMap;
use std::sync::Arc;

use ron::error::Error as RonError;

use super::Model;
use super::mend::{self, Mistake};
use super::read::{Fields, Reader};
use super::tree::{Body, Kind, Node, skip_blank, skip_block_comment, skip_line_comment};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, Position, Source, Span};

/// How many brackets may be open at once. Models need about ten; the parser stops at about sixty.
const DEEPEST: usize = 40;

/// Bytes of a model. The largest that people have written have some ten thousand; ten times as long takes a second.
const MOST_BYTES: usize = 4 << 20;

/// Reads a model file.
///
/// # Errors
///
/// Everything that is wrong with the structure of the file, at once. Where a text is not RON, what follows is judged as far as
/// the mistake is of a comma or a colon.
/// What expressions and quantities say is not looked at here.
pub fn load(source: &Arc<Source>) -> Result<(Model, Diagnostics), Diagnostics> {
    if source.text().len() > MOST_BYTES {
        let message = format!("`{}` is longer than {} MiB, which no model is", source.name(), MOST_BYTES >> 20);
        let found = Diagnostic::error(Code::TooLong, message).at_data(DataPlace::file(source.name()));
        return Err(found.hint("write what belongs to single rows into a table of data").into());
    }
    let brackets = Brackets::of(source.text());
    if let Some(span) = brackets.too_deep {
        let message = format!("more than {DEEPEST} brackets are open here");
        return Err(Diagnostic::error(Code::NestedTooDeep, message).at(source, span).into());
    }
    let text = source.text().strip_prefix('\u{feff}').unwrap_or(source.text());
    let shift = source.text().len() - text.len();
    // A raw value may not end in a comment: make sure of a line break.
    let mut text = format!("{text}\n");
    let (root, mistakes) = mend::parse(&mut text, shift);
    let mut reader = Reader::new(source);
    mistakes.iter().for_each(|mistake| reader.found.push(syntax(source, &text, shift, mistake, &brackets)));
    let Some(root) = root else { return Err(reader.found.sorted()) };

    let model = read_root(&root, &mut reader);
    if let Some(model) = &model {
        unique_joints(model, &mut reader);
    }
    match model {
        Some(model) if !reader.found.has_errors() => Ok((model, reader.found)),
        _ => Err(reader.found.sorted()),
    }
}

/// The root is `Model(…)` or `(…)`.
fn read_root(root: &Node, reader: &mut Reader) -> Option<Model> {
    let Kind::Group(word, body) = &root.kind else {
        return reader.wrong(root, "a model as `Model(name: …)`", None);
    };
    if let Some(word) = word
        && word.name != "Model"
    {
        reader.unknown_word::<()>(word, "kind of file", &["Model"]);
    }
    if *body == Body::Bare {
        return reader.wrong(root, "a model as `Model(name: …)`", None);
    }
    let fields = Fields::between(body, root, Model::WHAT, reader)?;
    Model::from_fields(fields, reader)
}

/// Parameters are named after joints, so a joint's name counts once in the file.
fn unique_joints(model: &Model, reader: &mut Reader) {
    let mut first = BTreeMap::new();
    for joint in model.chains.values().flatten() {
        let name = joint.name();
        let known = *first.entry(name.as_str()).or_insert(name.span);
        if known != name.span {
            reader.twice("the joint", name.as_str(), known, name.span);
        }
    }
}

/// What the parser says, at its place in the file.
fn syntax(source: &Arc<Source>, text: &str, shift: usize, mistake: &Mistake, brackets: &Brackets) -> Diagnostic {
    let error = &mistake.error;
    let parsed = Source::new("", text);
    let byte = |at: ron::error::Position| {
        let position = Position { line: at.line, column: at.col };
        parsed.offset(position) + shift
    };
    let end = byte(error.span.end).min(source.text().len());
    let mut start = byte(error.span.start).min(end);
    let rest = skip_blank(source.slice(Span::new(start, source.text().len())));
    if !rest.is_empty() {
        start = source.text().len() - rest.len();
    }
    let span = Span::new(start, end.max(start + 1));
    if error.code == RonError::ExceededRecursionLimit {
        let message = "brackets are nested too deeply here";
        return Diagnostic::error(Code::NestedTooDeep, message).at(source, span);
    }
    let ended = rest.is_empty() && brackets.unclosed.is_some();
    let message = match rest.chars().next() {
        _ if ended => "the text ends before all brackets are closed".to_owned(),
        Some(c @ ('=' | ';')) => format!("`{c}` does not belong here"),
        Some(',') => say(&error.code),
        _ if mistake.right == Some(":") => "expected a colon".to_owned(),
        _ => say(&error.code),
    };
    let mut found = Diagnostic::error(Code::Syntax, message).at(source, span);
    if let Some((open, close)) = brackets.mismatch {
        found = found.label(source, open, "this bracket").label(source, close, "is closed by this one");
    } else if let Some(open) = brackets.unclosed {
        found = found.label(source, open, "this bracket is not closed");
    }
    if rest.starts_with('=') {
        found = found.hint("a name and its value are joined by a colon: `nominal: 0`");
    } else if rest.starts_with(';') {
        found = found.hint("values are separated by commas");
    } else if rest.starts_with(':') {
        found = found.hint(
            "a value without a name cannot be followed by named ones: write `Free(nominal: …, min: …)`, `Scalar(value: …, sigma: …)`",
        );
    }
    found
}

/// The parser's words as the rest of the program speaks.
fn say(error: &RonError) -> String {
    match error {
        RonError::Eof => "the text ends too early".into(),
        RonError::ExpectedStructLikeEnd | RonError::ExpectedOptionEnd => "expected a comma or the closing `)`".into(),
        RonError::ExpectedArrayEnd => "expected a comma or the closing `]`".into(),
        RonError::ExpectedMapEnd => "expected a comma or the closing `}`".into(),
        RonError::ExpectedMapColon => "expected a colon".into(),
        RonError::ExpectedComma => "expected a comma".into(),
        RonError::ExpectedStringEnd => "the text in quotes does not end".into(),
        RonError::TrailingCharacters => "there is more text after the end of the model".into(),
        RonError::UnexpectedChar(c) => format!("`{}` does not belong here", c.escape_debug()),
        RonError::UnclosedBlockComment => "a comment is not closed".into(),
        other => {
            let words = other.to_string();
            let mut chars = words.chars();
            let first = chars.next().map(|c| c.to_lowercase().to_string());
            first.unwrap_or_default() + chars.as_str()
        }
    }
}

/// What can be said about the brackets of a text before it is parsed.
#[derive(Debug, Default)]
struct Brackets {
    too_deep: Option<Span>,
    /// An opening bracket and the wrong closing one.
    mismatch: Option<(Span, Span)>,
    /// The innermost that is open at the end.
    unclosed: Option<Span>,
}

impl Brackets {
    /// Looks over the text; brackets in quotes and comments do not count.
    fn of(text: &str) -> Self {
        let mut found = Self::default();
        let mut open: Vec<(char, usize)> = Vec::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            let at = text.len() - rest.len();
            let after = rest.strip_prefix(c).unwrap_or_default();
            let here = Span::new(at, at + c.len_utf8());
            rest = match c {
                '"' => skip_quoted(rest),
                'r' if raw_hashes(rest).is_some() => skip_raw(rest),
                '\'' => skip_character(rest),
                '/' if rest.starts_with("//") => skip_line_comment(rest),
                '/' if rest.starts_with("/*") => skip_block_comment(rest),
                _ => after,
            };
            match c {
                '(' | '[' | '{' => {
                    open.push((c, at));
                    if open.len() > DEEPEST && found.too_deep.is_none() {
                        found.too_deep = Some(here);
                        return found;
                    }
                }
                ')' | ']' | '}' => {
                    if let Some((opening, start)) = open.pop()
                        && !matches!((opening, c), ('(', ')') | ('[', ']') | ('{', '}'))
                    {
                        found.mismatch = Some((Span::new(start, start + 1), here));
                        return found;
                    }
                }
                _ => {}
            }
        }
        found.unclosed = open.last().map(|&(_, at)| Span::new(at, at + 1));
        found
    }
}

/// The text after the quoted one it starts with.
fn skip_quoted(text: &str) -> &str {
    let mut escaped = false;
    let mut rest = text.strip_prefix('"').unwrap_or(text).chars();
    while let Some(c) = rest.next() {
        match c {
            '"' if !escaped => return rest.as_str(),
            _ => escaped = c == '\\' && !escaped,
        }
    }
    ""
}

/// How many `#` a raw text starts with, if it is one.
fn raw_hashes(text: &str) -> Option<usize> {
    let after = text.strip_prefix('r')?;
    let quote = after.trim_start_matches('#');
    quote.starts_with('"').then(|| after.len() - quote.len())
}

/// The text after the raw one it starts with.
fn skip_raw(text: &str) -> &str {
    let end = format!("\"{}", "#".repeat(raw_hashes(text).unwrap_or(0)));
    // after `r`, the same stands in front backwards
    let inside = text.split_once('"').map_or("", |(_, inside)| inside);
    inside.split_once(&end).map_or("", |(_, after)| after)
}

/// The text after the character literal it starts with, or after the quote where it is none.
fn skip_character(text: &str) -> &str {
    let after = text.strip_prefix('\'').unwrap_or(text);
    let mut chars = after.chars();
    match chars.next() {
        Some('\\') => {
            // what is escaped may be a quote
            chars.next();
            chars.as_str().split_once('\'').map_or(after, |(_, rest)| rest)
        }
        Some(_) => chars.as_str().strip_prefix('\'').unwrap_or(after),
        None => after,
    }
}
