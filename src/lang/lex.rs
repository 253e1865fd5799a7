//! Text to tokens, one at a time, so that the first mistake in the text is the one reported.

use std::ops::Range;

use super::number::number;
use super::relation::{self, Comparison};
use super::{Op, ParseError, ParseErrorKind};
use crate::unit::Unit;

/// A token and its place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Token {
    pub(super) kind: TokenKind,
    pub(super) span: Range<usize>,
}

/// What a token is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TokenKind {
    /// A number, with its unit.
    Number { value: f64, unit: Option<(String, Unit)> },
    /// A name.
    Name(String),
    /// A text in single quotes, which a key may be.
    Text(String),
    /// `=`, `<=`, `>=`, between the sides of a relation only.
    Comparison(Comparison),
    /// An operator; `-` also stands before operands.
    Operator(Op),
    /// `(`
    OpenRound,
    /// `)`
    CloseRound,
    /// `[`
    OpenSquare,
    /// `]`
    CloseSquare,
    /// `,`
    Comma,
    /// `.`
    Dot,
    /// The end of the text.
    End,
}

/// Whether the whole text is a name: `[A-Za-z_][A-Za-z0-9_]*`, Greek letters included.
///
/// ```
/// use phical::lang::is_name;
///
/// assert!(is_name("hzL1") && is_name("θ_1"));
/// assert!(!is_name("L1.alpha") && !is_name("2x") && !is_name(""));
/// ```
pub fn is_name(text: &str) -> bool {
    !text.is_empty() && name_length(text) == text.len()
}

/// The length of the name at the start, 0 where there is none.
pub(super) fn name_length(text: &str) -> usize {
    let part = |c: char| starts_name(c) || c.is_ascii_digit();
    if text.starts_with(starts_name) { text.find(|c| !part(c)).unwrap_or(text.len()) } else { 0 }
}

/// Whether a name can begin with this character.
fn starts_name(c: char) -> bool {
    let greek = matches!(c, '\u{370}'..='\u{3FF}' | '\u{1F00}'..='\u{1FFF}') && c.is_alphabetic();
    c.is_ascii_alphabetic() || c == '_' || greek
}

/// Reads tokens from a text.
pub(super) struct Lexer<'a> {
    text: &'a str,
    at: usize,
    /// Whether the text is a relation, in which `=`, `<=` and `>=` have a meaning.
    relation: bool,
}

impl<'a> Lexer<'a> {
    pub(super) fn new(text: &'a str, relation: bool) -> Lexer<'a> {
        Lexer { text, at: 0, relation }
    }

    /// The next token; after the end, the end again.
    pub(super) fn next(&mut self) -> Result<Token, ParseError> {
        let rest = self.text.get(self.at..).unwrap_or_default().trim_start();
        let start = self.text.len() - rest.len();
        let (kind, end) = match rest.chars().next() {
            None => (TokenKind::End, start),
            Some(_) if starts_number(rest) => {
                let (value, unit, end) = number(self.text, start)?;
                (TokenKind::Number { value, unit }, end)
            }
            Some(c) if starts_name(c) => {
                let (name, _) = rest.split_at(name_length(rest));
                (TokenKind::Name(name.to_owned()), start + name.len())
            }
            Some('\'') => {
                let (text, length) = quoted(rest).map_err(|error| error.at(start))?;
                (TokenKind::Text(text), start + length)
            }
            Some(_) if self.relation && relation::begins(rest) => {
                let (comparison, length) = relation::comparison(rest).map_err(|error| error.at(start))?;
                (TokenKind::Comparison(comparison), start + length)
            }
            Some(c) => (sign(c, rest).map_err(|error| error.at(start))?, start + c.len_utf8()),
        };
        self.at = end;
        Ok(Token { kind, span: start..end })
    }
}

fn starts_number(text: &str) -> bool {
    text.strip_prefix('.').unwrap_or(text).starts_with(|c: char| c.is_ascii_digit())
}

/// The text in single quotes at the start, and how long it is with them. Two quotes inside stand for one.
fn quoted(rest: &str) -> Result<(String, usize), ParseError> {
    let mut text = String::new();
    let mut inside = rest.strip_prefix('\'').unwrap_or(rest);
    while let Some((piece, after)) = inside.split_once('\'') {
        text.push_str(piece);
        match after.strip_prefix('\'') {
            Some(further) => {
                text.push('\'');
                inside = further;
            }
            None => return Ok((text, rest.len() - after.len())),
        }
    }
    Err(ParseError::new(ParseErrorKind::UnexpectedCharacter, 0..1, "the text in quotes does not end")
        .hint("a unit follows its number; quotes are around the key of a family's member: `family['key']`"))
}

/// The token of a single character `c` at the start of `rest`.
fn sign(c: char, rest: &str) -> Result<TokenKind, ParseError> {
    Ok(match c {
        '*' if rest.starts_with("**") => return Err(refuse(rest)),
        '+' => TokenKind::Operator(Op::Add),
        '-' | '−' => TokenKind::Operator(Op::Sub),
        '*' | '·' | '×' | '⋅' => TokenKind::Operator(Op::Mul),
        '/' => TokenKind::Operator(Op::Div),
        '^' => TokenKind::Operator(Op::Pow),
        '(' => TokenKind::OpenRound,
        ')' => TokenKind::CloseRound,
        '[' => TokenKind::OpenSquare,
        ']' => TokenKind::CloseSquare,
        ',' => TokenKind::Comma,
        '.' => TokenKind::Dot,
        _ => return Err(refuse(rest)),
    })
}

/// Where comparisons stand.
const CONDITIONS: &str = "conditions on parameters stand under `constraints`";

/// Signs that other languages have: what they are, and what to write here.
const FOREIGN: &[(&str, ParseErrorKind, &str)] = &[
    ("**", ParseErrorKind::DoubleStar, "write `^` for a power"),
    ("<=", ParseErrorKind::Comparison, CONDITIONS),
    (">=", ParseErrorKind::Comparison, CONDITIONS),
    ("==", ParseErrorKind::Comparison, CONDITIONS),
    ("!=", ParseErrorKind::Comparison, CONDITIONS),
    ("<", ParseErrorKind::Comparison, CONDITIONS),
    (">", ParseErrorKind::Comparison, CONDITIONS),
    ("≤", ParseErrorKind::Comparison, CONDITIONS),
    ("≥", ParseErrorKind::Comparison, CONDITIONS),
    ("≠", ParseErrorKind::Comparison, CONDITIONS),
    (
        "=",
        ParseErrorKind::Assignment,
        "give an expression a name under `define`, and write a condition on parameters under `constraints`",
    ),
    ("{", ParseErrorKind::UnexpectedCharacter, "write `(` to group"),
    ("}", ParseErrorKind::UnexpectedCharacter, "write `)` to group"),
    (
        "%",
        ParseErrorKind::UnexpectedCharacter,
        "`%` is a unit and follows a number; `wrap(a)` brings an angle into one turn",
    ),
    ("°", ParseErrorKind::UnexpectedCharacter, "a unit follows a number; write `x * 1 deg`"),
    ("\"", ParseErrorKind::UnexpectedCharacter, "a unit follows its number; there are no texts in expressions"),
    ("–", ParseErrorKind::UnexpectedCharacter, "write `-` for minus"),
    ("²", ParseErrorKind::UnexpectedCharacter, "write `^2`"),
    ("³", ParseErrorKind::UnexpectedCharacter, "write `^3`"),
    ("√", ParseErrorKind::UnexpectedCharacter, "write `sqrt(x)`"),
    ("µ", ParseErrorKind::UnexpectedCharacter, "this is the micro sign; in names write the Greek letter `μ`"),
];

/// The error for a sign that is no token.
fn refuse(rest: &str) -> ParseError {
    let foreign = FOREIGN.iter().find(|(sign, ..)| rest.starts_with(sign));
    let (own, _) = rest.split_at(rest.chars().next().map_or(0, char::len_utf8));
    let (sign, kind, hint) = foreign.copied().unwrap_or((own, ParseErrorKind::UnexpectedCharacter, ""));
    let message = match kind {
        ParseErrorKind::Comparison => {
            format!("`{sign}` compares, and the language is comparison-free")
        }
        ParseErrorKind::Assignment => "`=` assigns, which an expression cannot".to_owned(),
        ParseErrorKind::DoubleStar => "`**` is not an operator".to_owned(),
        _ => format!("the character `{}` is not expected here", sign.escape_debug()),
    };
    let error = ParseError::new(kind, 0..sign.len(), message);
    if hint.is_empty() { error } else { error.hint(hint) }
}

impl ParseError {
    /// The same, `start` bytes further on.
    pub(super) fn at(mut self, start: usize) -> ParseError {
        self.span = self.span.start + start..self.span.end + start;
        self
    }
}
