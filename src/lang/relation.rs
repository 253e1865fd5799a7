//! Relations between expressions: what a constraint states.

use std::fmt;

use super::lex::TokenKind;
use super::parse::Parser;
use super::{Expr, ParseError, ParseErrorKind};

/// How the sides of a relation compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// `a = b`
    Equal,
    /// `a <= b`
    AtMost,
    /// `a >= b`
    AtLeast,
}

impl Comparison {
    /// All of them.
    pub const ALL: [Comparison; 3] = [Comparison::Equal, Comparison::AtMost, Comparison::AtLeast];

    /// The sign as it is written.
    pub fn symbol(self) -> &'static str {
        match self {
            Comparison::Equal => "=",
            Comparison::AtMost => "<=",
            Comparison::AtLeast => ">=",
        }
    }
}

/// `a = b`, `a <= b`, `a >= b`, `a <= e <= b` or `a >= e >= b`.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// What stands between any two sides.
    pub comparison: Comparison,
    /// The sides in the order of the text: two, or the three of a range.
    pub sides: Vec<Expr>,
}

impl fmt::Display for Relation {
    /// Writes it so that [`parse_relation`] reads the same.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, side) in self.sides.iter().enumerate() {
            if at > 0 {
                write!(f, " {} ", self.comparison.symbol())?;
            }
            side.fmt(f)?;
        }
        Ok(())
    }
}

/// Reads a relation.
///
/// ```
/// use phical::lang::{Comparison, parse_relation};
///
/// let range = parse_relation("0.1mm <= L1.b + (R1.b) <= 3 mm")?;
/// assert_eq!((range.comparison, range.sides.len()), (Comparison::AtMost, 3));
/// assert_eq!(range.to_string(), "0.1 mm <= L1.b + R1.b <= 3 mm");
/// let error = parse_relation("a == b").unwrap_err();
/// assert_eq!(error.hint.as_deref(), Some("write `=`"));
/// # Ok::<(), phical::lang::ParseError>(())
/// ```
pub fn parse_relation(text: &str) -> Result<Relation, ParseError> {
    let mut parser = Parser::new(text, true)?;
    if parser.token.kind == TokenKind::End {
        let error = ParseError::new(ParseErrorKind::Empty, 0..text.len(), "there is no relation");
        return Err(error.hint(FORMS));
    }
    let mut sides = vec![parser.side()?];
    let mut found = None;
    while let TokenKind::Comparison(comparison) = parser.token.kind {
        let sign = parser.token.span.clone();
        let chained = |message: &str, hint: &str| {
            Err(ParseError::new(ParseErrorKind::Comparison, sign.clone(), message).hint(hint))
        };
        match found {
            Some(Comparison::Equal) => return chained("an equation has two sides", "write two constraints"),
            Some(first) if first != comparison => {
                return chained("both signs of a range point the same way", "write `least <= a <= most`");
            }
            Some(_) if sides.len() == 3 => return chained("a range has two ends", "write two constraints"),
            _ => found = Some(comparison),
        }
        parser.advance()?;
        sides.push(parser.side()?);
    }
    match (parser.token.kind == TokenKind::End, found) {
        (true, Some(comparison)) => Ok(Relation { comparison, sides }),
        (true, None) => {
            let error = ParseError::new(ParseErrorKind::MissingOperator, 0..text.len(), "nothing is compared here");
            Err(error.hint(FORMS))
        }
        (false, _) => Err(parser.unexpected()),
    }
}

/// What a relation may look like.
const FORMS: &str = "a constraint is `a = b`, `a <= b`, `a >= b` or `a <= b <= c`";

/// Signs of a relation: as written, which one it is, or else what to write instead. Longer ones come first.
const SIGNS: &[(&str, Result<Comparison, &str>)] = &[
    ("==", Err("write `=`")),
    ("=<", Err("write `<=`")),
    ("=>", Err("write `>=`")),
    ("!=", Err("what is only not equal restricts nothing: write `<=` or `>=`")),
    ("≠", Err("what is only not equal restricts nothing: write `<=` or `>=`")),
    ("<=", Ok(Comparison::AtMost)),
    ("≤", Ok(Comparison::AtMost)),
    (">=", Ok(Comparison::AtLeast)),
    ("≥", Ok(Comparison::AtLeast)),
    ("<", Err("write `<=`: a number next to the bound cannot be told from it")),
    (">", Err("write `>=`: a number next to the bound cannot be told from it")),
    ("=", Ok(Comparison::Equal)),
];

fn sign(rest: &str) -> Option<&'static (&'static str, Result<Comparison, &'static str>)> {
    SIGNS.iter().find(|(sign, _)| rest.starts_with(sign))
}

/// Whether a sign of a relation, or what is taken for one, is at the start.
pub(super) fn begins(rest: &str) -> bool {
    sign(rest).is_some()
}

/// The sign at the start, and its length.
pub(super) fn comparison(rest: &str) -> Result<(Comparison, usize), ParseError> {
    let (written, meaning) = sign(rest).copied().unwrap_or(("", Err(FORMS)));
    match meaning {
        Ok(comparison) => Ok((comparison, written.len())),
        Err(hint) => {
            let message = format!("`{written}` is not a sign of the language");
            Err(ParseError::new(ParseErrorKind::Comparison, 0..written.len(), message).hint(hint))
        }
    }
}
