//! The expression language: text to tree and back.
//!
//! [`parse()`] reads an expression such as `p1 - p2 - length * vec(0, 0, 1)` into an [`Expr`] whose nodes know their place
//! in the text; [`print()`] writes a tree with the fewest brackets; [`parse_signature`] reads the head of a function. What
//! names mean is not known here.
//!
//! | form | binds |
//! |---|---|
//! | `a + b`, `a - b` | loosest |
//! | `a * b`, `a / b` (also `·`, `×`) | |
//! | `-a` | |
//! | `a ^ b` | from the right; its exponent may begin with `-` |
//! | `a.x`, `family[k, l]`, `f(a, b)` | tightest |
//!
//! A relation, `0 <= a + b <= 3 mm`, compares two or three of them: [`parse_relation`].
//!
//! A number takes the unit that follows it, with or without a space: `9.8 m/s^2`, `90°`, `12°34'56.7"`. The unit is the
//! longest that can be read without a space, so `2 m*s` are metre-seconds, and `2 m * s` is a product with `s`.
//!
//! ```
//! use phical::lang::{parse, print};
//!
//! let tree = parse("-(x^2) * (5 mm/s)")?;
//! assert_eq!(print(&tree), "-x^2 * 5 mm/s");
//! let error = parse("a + (b * 2 mmm").unwrap_err();
//! assert_eq!(error.message, "`mmm` is not a unit");
//! assert_eq!(error.hint.as_deref(), Some("did you mean `2 mm`? A product is written `2*mmm`"));
//! # Ok::<(), phical::lang::ParseError>(())
//! ```

mod ast;
mod complain;
mod error;
#[cfg(test)]
mod laws;
mod lex;
mod number;
mod parse;
mod print;
mod relation;
mod signature;
#[cfg(test)]
mod tests;

pub use ast::{Expr, ExprKind, Ident, Key, Op};
pub use error::{ParseError, ParseErrorKind};
pub use lex::is_name;
pub use parse::{MAX_DEPTH, parse};
pub use print::print;
pub use relation::{Comparison, Relation, parse_relation};
pub use signature::{Signature, parse_signature};
