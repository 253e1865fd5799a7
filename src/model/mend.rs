//! A text whose commas and colons are wrong, mended so that what follows can be judged too.
//!
//! A mend puts one byte in the place of another, so that every place in the text stays what it was. What is mended is still a
//! mistake, and no model comes of it.

use ron::error::{Error as RonError, Position, SpannedError};

use super::tree::{self, Node};
use crate::diag::{Position as Place, Source};

/// Bytes that are read again altogether.
const MOST_BYTES: usize = 8 << 20;

/// Mends at most.
const MOST: usize = 20;

/// What the parser says, and what should stand there.
pub(super) struct Mistake {
    pub(super) error: SpannedError,
    pub(super) right: Option<&'static str>,
}

/// The tree of a text, as far as it can be read, and what is wrong with the text. `shift` is added to every place of the tree.
pub(super) fn parse(text: &mut String, shift: usize) -> (Option<Node>, Vec<Mistake>) {
    let mut found: Vec<Mistake> = Vec::new();
    loop {
        let error = match tree::parse(text, shift) {
            Ok(root) => return (Some(root), found),
            Err(error) => error,
        };
        // a mend has to lead on
        let on = found.last().is_none_or(|last| after(&last.error.span.start, &error.span.start));
        let enough = found.len() >= MOST.min(MOST_BYTES / text.len().max(1));
        let mend = if on && !enough { mend(text, &error) } else { None };
        if on {
            found.push(Mistake { error, right: mend.map(|(_, right)| right) });
        }
        let Some((at, right)) = mend else { return (None, found) };
        text.replace_range(at..=at, right);
    }
}

fn after(last: &Position, next: &Position) -> bool {
    (next.line, next.col) > (last.line, last.col)
}

/// A byte, and what should stand there instead.
fn mend(text: &str, error: &SpannedError) -> Option<(usize, &'static str)> {
    let place = Place { line: error.span.start.line, column: error.span.start.col };
    let start = Source::new("", text).offset(place);
    let rest = tree::skip_blank(text.get(start..)?);
    let at = text.len() - rest.len();
    let before = at.checked_sub(1)?;
    // a blank that ends no comment
    let blank = match text.as_bytes().get(before)? {
        b' ' | b'\t' => true,
        b'\n' => !text.get(..before)?.lines().next_back()?.contains("//"),
        _ => false,
    };
    let first = rest.chars().next()?;
    // `name "m"`: a field's name alone where a value would be
    let head = text.get(..before)?.trim_end();
    let word = head.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_');
    let named = head.get(word.len()..)?.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let names = named && word.trim_end().ends_with(['(', ',']);
    let begins = first.is_alphanumeric() || matches!(first, '_' | '"' | '(' | '[' | '{' | '-' | '+' | '.');
    match &error.code {
        RonError::ExpectedMapColon if matches!(first, '=' | ',' | ';') => Some((at, ":")),
        RonError::ExpectedMapColon if begins && blank => Some((before, ":")),
        RonError::ExpectedComma
        | RonError::ExpectedStructLikeEnd
        | RonError::ExpectedArrayEnd
        | RonError::ExpectedMapEnd => match first {
            '=' => Some((at, ":")),
            ';' => Some((at, ",")),
            _ if begins && blank => Some((before, if names && first != '(' { ":" } else { "," })),
            _ => None,
        },
        RonError::UnexpectedChar(',') if first == ',' => Some((at, " ")),
        _ => None,
    }
}
