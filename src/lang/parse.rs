//! Tokens to tree, by precedence climbing (Pratt).

use std::ops::Range;

use super::ast::level;
use super::lex::{Lexer, Token, TokenKind};
use super::{Expr, ExprKind, Ident, Key, Op, ParseError, ParseErrorKind};

/// The greatest height of a tree that [`parse()`] gives, and the deepest nesting of brackets it reads; whoever walks a tree
/// by recursion is safe.
pub const MAX_DEPTH: usize = 200;

/// Reads an expression.
///
/// ```
/// use phical::lang::{ParseErrorKind, parse};
///
/// assert!(parse("atan2(y, x)")?.same(&parse("atan2 (y,x)")?));
/// let error = parse("2*(a + b").unwrap_err();
/// assert_eq!((error.kind, error.span), (ParseErrorKind::UnclosedBracket, 2..3));
/// # Ok::<(), phical::lang::ParseError>(())
/// ```
pub fn parse(text: &str) -> Result<Expr, ParseError> {
    let mut parser = Parser::new(text, false)?;
    if parser.token.kind == TokenKind::End {
        let all = 0..text.len();
        return Err(ParseError::new(ParseErrorKind::Empty, all, "there is no expression"));
    }
    let parsed = parser.expression(level::SUM)?;
    match parser.token.kind {
        TokenKind::End => Ok(parsed.expr),
        _ => Err(parser.unexpected()),
    }
}

/// An expression with what its parent has to know.
struct Parsed {
    expr: Expr,
    /// Where it starts, brackets included.
    start: usize,
    /// The height of its tree; a leaf has 1.
    height: usize,
    /// Whether brackets are around it.
    bracketed: bool,
}

/// Reads tokens with one token of foresight.
pub(super) struct Parser<'a> {
    pub(super) text: &'a str,
    lexer: Lexer<'a>,
    pub(super) token: Token,
    /// The place of the token before.
    pub(super) previous: Range<usize>,
    /// How many brackets are open.
    pub(super) brackets: usize,
    /// How many operators wait for their last operand.
    pending: usize,
}

impl<'a> Parser<'a> {
    pub(super) fn new(text: &'a str, relation: bool) -> Result<Parser<'a>, ParseError> {
        let mut lexer = Lexer::new(text, relation);
        let token = lexer.next()?;
        Ok(Parser { text, lexer, token, previous: 0..0, brackets: 0, pending: 0 })
    }

    /// Goes one token on and gives the place of the one passed.
    pub(super) fn advance(&mut self) -> Result<Range<usize>, ParseError> {
        let next = self.lexer.next()?;
        self.previous = std::mem::replace(&mut self.token, next).span;
        Ok(self.previous.clone())
    }

    /// The text at a place.
    pub(super) fn written(&self, place: &Range<usize>) -> &'a str {
        self.text.get(place.clone()).unwrap_or_default()
    }

    /// A whole expression, up to what cannot go on with it.
    pub(super) fn side(&mut self) -> Result<Expr, ParseError> {
        self.expression(level::SUM).map(|parsed| parsed.expr)
    }

    /// An operand and the operators after it that bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Result<Parsed, ParseError> {
        let mut left = self.operand()?;
        while let TokenKind::Operator(op) = self.token.kind {
            if op.level() < least {
                break;
            }
            let place = self.advance()?;
            let right = self.waiting(&place, op.right_level())?;
            let height = 1 + left.height.max(right.height);
            let start = left.start;
            let kind = ExprKind::Binary { op, left: Box::new(left.expr), right: Box::new(right.expr) };
            left = self.node(kind, start, height, &place)?;
        }
        Ok(left)
    }

    /// The last operand of the operator at `place`.
    fn waiting(&mut self, place: &Range<usize>, least: u8) -> Result<Parsed, ParseError> {
        self.pending += 1;
        check_depth(self.pending, place)?;
        let operand = self.expression(least)?;
        self.pending -= 1;
        Ok(operand)
    }

    /// A minus with its operand, or a number, name or bracket with its `.x`, `[…]` and `(…)`.
    fn operand(&mut self) -> Result<Parsed, ParseError> {
        let start = self.token.span.start;
        let first = match self.token.kind.clone() {
            TokenKind::Operator(Op::Sub) => {
                let place = self.advance()?;
                let operand = self.waiting(&place, level::NEGATE)?;
                let height = operand.height + 1;
                return self.node(ExprKind::Negate(Box::new(operand.expr)), start, height, &place);
            }
            TokenKind::Number { value, unit } => {
                let place = self.advance()?;
                self.node(ExprKind::Number { value, unit }, start, 1, &place)?
            }
            TokenKind::Name(name) => {
                let place = self.advance()?;
                self.node(ExprKind::Name(name), start, 1, &place)?
            }
            TokenKind::OpenRound => {
                let open = self.open()?;
                let inner = self.expression(level::SUM)?;
                self.close(&open, TokenKind::CloseRound)?;
                Parsed { start, bracketed: true, ..inner }
            }
            _ => return Err(self.missing_operand()),
        };
        self.postfix(first)
    }

    /// The `.x`, `[…]` and `(…)` after an operand.
    fn postfix(&mut self, mut base: Parsed) -> Result<Parsed, ParseError> {
        loop {
            let name = match &base.expr.kind {
                ExprKind::Name(name) if !base.bracketed => Some(name.clone()),
                _ => None,
            };
            let number = base.bracketed || matches!(base.expr.kind, ExprKind::Number { .. });
            let start = base.start;
            base = match self.token.kind {
                TokenKind::Dot => {
                    let place = self.advance()?;
                    let field = self.name("the name of a component follows `.`")?;
                    let height = base.height + 1;
                    self.node(ExprKind::Field(Box::new(base.expr), field.name), start, height, &place)?
                }
                TokenKind::OpenRound if !number => match name.or_else(|| part_of_a_chain(&base)) {
                    Some(function) => self.call(function, base.expr.span)?,
                    None => return Err(self.not_callable(&base.expr)),
                },
                TokenKind::OpenSquare => match name {
                    Some(family) => self.index(family, start)?,
                    None => {
                        let message = "only the name of a family takes keys in `[…]`";
                        return Err(ParseError::new(ParseErrorKind::NotIndexable, self.token.span.clone(), message));
                    }
                },
                _ => return Ok(base),
            };
        }
    }

    /// The arguments of a call.
    fn call(&mut self, function: String, name_span: Range<usize>) -> Result<Parsed, ParseError> {
        let open = self.open()?;
        let mut arguments = Vec::new();
        let mut height = 0;
        if self.token.kind != TokenKind::CloseRound {
            loop {
                let argument = self.expression(level::SUM)?;
                height = height.max(argument.height);
                arguments.push(argument.expr);
                if self.token.kind != TokenKind::Comma {
                    break;
                }
                self.advance()?;
            }
        }
        self.close(&open, TokenKind::CloseRound)?;
        let start = name_span.start;
        self.node(ExprKind::Call { function, name_span, arguments }, start, height + 1, &open)
    }

    /// The keys of a member.
    fn index(&mut self, family: String, start: usize) -> Result<Parsed, ParseError> {
        let open = self.open()?;
        let mut keys = vec![self.key("stand here")?];
        while self.token.kind == TokenKind::Comma {
            self.advance()?;
            keys.push(self.key("follow the comma")?);
        }
        self.close(&open, TokenKind::CloseSquare)?;
        self.node(ExprKind::Index { family, keys }, start, 1, &open)
    }

    /// The name of a key column, or a key in quotes.
    fn key(&mut self, what: &str) -> Result<Key, ParseError> {
        let (name, quoted) = match &self.token.kind {
            TokenKind::Name(name) => (name.clone(), false),
            TokenKind::Text(text) => (text.clone(), true),
            _ => {
                let complaint = format!("the name of a key column, or a key in quotes, has to {what}");
                let error = ParseError::new(ParseErrorKind::ExpectedName, self.here(), complaint);
                return Err(match self.token.kind {
                    TokenKind::Number { .. } => {
                        error.hint(format!("write it in quotes: `'{}'`", self.written(&self.token.span)))
                    }
                    _ => error,
                });
            }
        };
        let span = self.advance()?;
        Ok(Key { name, quoted, span })
    }

    /// Names between commas, at least one.
    pub(super) fn names(&mut self, what: &str) -> Result<Vec<Ident>, ParseError> {
        let mut names = vec![self.name(&format!("{what} has to stand here"))?];
        while self.token.kind == TokenKind::Comma {
            self.advance()?;
            names.push(self.name(&format!("{what} has to follow the comma"))?);
        }
        Ok(names)
    }

    /// A name, or the complaint that there is none.
    pub(super) fn name(&mut self, complaint: &str) -> Result<Ident, ParseError> {
        let TokenKind::Name(name) = self.token.kind.clone() else {
            return Err(ParseError::new(ParseErrorKind::ExpectedName, self.here(), complaint));
        };
        let span = self.advance()?;
        Ok(Ident { name, span })
    }

    /// An opening bracket.
    pub(super) fn open(&mut self) -> Result<Range<usize>, ParseError> {
        self.brackets += 1;
        check_depth(self.brackets, &self.token.span)?;
        self.advance()
    }

    /// The closing bracket that belongs to the one at `open`.
    pub(super) fn close(&mut self, open: &Range<usize>, wanted: TokenKind) -> Result<(), ParseError> {
        if self.token.kind == wanted {
            self.brackets -= 1;
            self.advance()?;
            return Ok(());
        }
        match self.token.kind {
            TokenKind::End => Err(self.unclosed(open)),
            TokenKind::CloseRound | TokenKind::CloseSquare => {
                let other = self.written(&self.token.span);
                Err(self.unclosed(open).hint(format!("`{other}` stands where it should be closed")))
            }
            _ => Err(self.unexpected()),
        }
    }

    /// A node that ends where the last token ended.
    fn node(&self, kind: ExprKind, start: usize, height: usize, place: &Range<usize>) -> Result<Parsed, ParseError> {
        check_depth(height, place)?;
        let expr = Expr { kind, span: start..self.previous.end };
        Ok(Parsed { expr, start, height, bracketed: false })
    }

    /// The place of the token at hand; at the end, that of the token before.
    pub(super) fn here(&self) -> Range<usize> {
        if self.token.kind == TokenKind::End { self.previous.clone() } else { self.token.span.clone() }
    }
}

/// `left.L1`, which may be called.
fn part_of_a_chain(base: &Parsed) -> Option<String> {
    match &base.expr.kind {
        ExprKind::Field(chain, joint) if !base.bracketed => match &chain.kind {
            ExprKind::Name(chain) => Some(format!("{chain}.{joint}")),
            _ => None,
        },
        _ => None,
    }
}

/// The error where something is nested too deeply.
fn check_depth(depth: usize, place: &Range<usize>) -> Result<(), ParseError> {
    if depth <= MAX_DEPTH {
        return Ok(());
    }
    let message = format!("the expression is nested more than {MAX_DEPTH} deep");
    let error = ParseError::new(ParseErrorKind::TooDeep, place.clone(), message);
    Err(error.hint("give a part of it a name under `define`"))
}
