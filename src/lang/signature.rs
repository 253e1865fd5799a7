//! The head of a function: `sight_length(l, r)`.

use super::lex::TokenKind;
use super::parse::Parser;
use super::{Ident, ParseError, ParseErrorKind};

/// The name of a function and of its parameters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// The function.
    pub name: Ident,
    /// Its parameters, in order, all different.
    pub parameters: Vec<Ident>,
}

/// Reads the head of a function.
///
/// ```
/// use phical::lang::parse_signature;
///
/// let head = parse_signature("sight_length(l, r)")?;
/// assert_eq!(head.name.name, "sight_length");
/// assert_eq!(head.parameters.len(), 2);
/// assert_eq!(parse_signature("f(a, a)").unwrap_err().message, "the parameter `a` stands twice");
/// # Ok::<(), phical::lang::ParseError>(())
/// ```
pub fn parse_signature(text: &str) -> Result<Signature, ParseError> {
    let mut parser = Parser::new(text, false)?;
    if parser.token.kind == TokenKind::End {
        let error = ParseError::new(ParseErrorKind::Empty, 0..text.len(), "there is no function head");
        return Err(error.hint("write `name(a, b)`"));
    }
    let name = parser.name("a function head begins with the function's name")?;
    if parser.token.kind != TokenKind::OpenRound {
        let error = ParseError::new(ParseErrorKind::MissingOperand, parser.here(), "the parameters are missing");
        return Err(error.hint(format!("write `{}(a, b)`", name.name)));
    }
    let open = parser.open()?;
    let parameters = match parser.token.kind {
        TokenKind::CloseRound => Vec::new(),
        TokenKind::End => Vec::new(),
        _ => parser.names("the name of a parameter")?,
    };
    parser.close(&open, TokenKind::CloseRound)?;
    if parser.token.kind != TokenKind::End {
        let error = ParseError::new(ParseErrorKind::TrailingText, parser.here(), "a function head ends with `)`");
        return Err(error);
    }
    for (index, parameter) in parameters.iter().enumerate() {
        if parameters.iter().take(index).any(|earlier| earlier.name == parameter.name) {
            let message = format!("the parameter `{}` stands twice", parameter.name);
            return Err(ParseError::new(ParseErrorKind::DuplicateParameter, parameter.span.clone(), message));
        }
    }
    Ok(Signature { name, parameters })
}
