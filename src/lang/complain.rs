//! What the parser says where the text does not go on as it should.

use std::ops::Range;

use super::lex::TokenKind;
use super::parse::Parser;
use super::{Expr, ExprKind, Op, ParseError, ParseErrorKind};
use crate::unit::Unit;

impl Parser<'_> {
    /// The error for the bracket at `open`.
    pub(super) fn unclosed(&self, open: &Range<usize>) -> ParseError {
        let message = format!("`{}` is not closed", self.written(open));
        ParseError::new(ParseErrorKind::UnclosedBracket, open.clone(), message)
    }

    /// The error where an operand has to stand and none does.
    pub(super) fn missing_operand(&self) -> ParseError {
        let before = self.written(&self.previous);
        let token = self.written(&self.token.span);
        let missing = |span, message| ParseError::new(ParseErrorKind::MissingOperand, span, message);
        match self.token.kind {
            TokenKind::OpenSquare => {
                let message = "`[` has to follow the name of a family";
                let error = ParseError::new(ParseErrorKind::UnexpectedCharacter, self.token.span.clone(), message);
                error.hint("a vector is written `vec(x, y, z)`")
            }
            TokenKind::Text(_) => {
                let message = "a text in quotes is the key of a family's member, in `[…]`";
                ParseError::new(ParseErrorKind::UnexpectedCharacter, self.token.span.clone(), message)
            }
            TokenKind::Comparison(_) if self.brackets > 0 => self.inside_brackets(),
            TokenKind::End if before == "(" => self.unclosed(&self.previous),
            TokenKind::CloseRound | TokenKind::CloseSquare if self.brackets == 0 => self.unexpected(),
            _ if before == "(" && token == ")" => {
                missing(self.previous.start..self.token.span.end, "there is nothing between the brackets".to_owned())
            }
            TokenKind::Operator(Op::Add) => missing(self.here(), "there is nothing in front of `+`".to_owned())
                .hint("a number needs no `+` in front"),
            TokenKind::Operator(_) | TokenKind::Comma | TokenKind::Comparison(_)
                if matches!(before, "" | "(" | ",") =>
            {
                missing(self.here(), format!("there is nothing in front of `{token}`"))
            }
            TokenKind::Dot => missing(self.here(), "there is nothing in front of `.`".to_owned()),
            _ => missing(self.previous.clone(), format!("there is nothing after `{before}`")),
        }
    }

    /// The error where an expression has ended and something else than an operator follows.
    pub(super) fn unexpected(&self) -> ParseError {
        let token = self.written(&self.token.span);
        let error = |kind, message| ParseError::new(kind, self.here(), message);
        match &self.token.kind {
            TokenKind::CloseRound | TokenKind::CloseSquare => {
                error(ParseErrorKind::UnopenedBracket, format!("`{token}` closes nothing"))
            }
            TokenKind::Comparison(_) if self.brackets > 0 => self.inside_brackets(),
            TokenKind::Comma => {
                let found = error(ParseErrorKind::TrailingText, "the comma is not between arguments".to_owned());
                found.hint("decimals follow a point, as in `0.5`")
            }
            kind => {
                let found =
                    error(ParseErrorKind::MissingOperator, format!("there is no operator in front of `{token}`"));
                let unit = |name: &str| Unit::parse(name).is_ok();
                match kind {
                    TokenKind::Name(name) if unit(name) && self.after_number() => {
                        found.hint("a unit has no spaces inside, as in `5 m*s`; a product is written `*`")
                    }
                    _ => found.hint("a product is written `*`"),
                }
            }
        }
    }

    /// The error for a comparison where brackets are open.
    fn inside_brackets(&self) -> ParseError {
        let message = format!("`{}` stands between the sides, not in brackets", self.written(&self.token.span));
        ParseError::new(ParseErrorKind::Comparison, self.token.span.clone(), message)
    }

    /// Whether the token before is a number.
    fn after_number(&self) -> bool {
        self.written(&self.previous).starts_with(|c: char| c.is_ascii_digit() || c == '.')
    }

    /// The error for a call of `base`.
    pub(super) fn not_callable(&self, base: &Expr) -> ParseError {
        let message = "only a function or a chain can be called, by its name";
        let error = ParseError::new(ParseErrorKind::NotCallable, base.span.clone(), message);
        match &base.kind {
            ExprKind::Field(_, field) => error.hint(format!("a function comes before its arguments, `{field}(…)`")),
            _ => error.hint("a product is written `*`"),
        }
    }
}
