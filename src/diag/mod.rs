//! What can be wrong with the input, said in a way that helps to put it right.
//!
//! A [`Diagnostic`] has a [`Code`] with an explanation, one sentence, the [`Place`] it speaks of, further labelled places and a
//! hint. Stages collect [`Diagnostics`] and go on as far as they can, so that all mistakes are reported at once.
//! Pure code returns plain errors; whoever knows the place turns them into diagnostics.
//!
//! ```
//! use phical::diag::{Code, Diagnostic, Source, Span, text};
//!
//! let source = Source::new("model.ron", "(nam: \"arm\")");
//! let found = Diagnostic::error(Code::UnknownField, "a model has no field `nam`")
//!     .at(&source, Span::new(1, 4))
//!     .hint("did you mean `name`?");
//! assert_eq!(found.code.id(), "E003");
//! assert!(text(&[found], false).contains("model.ron:1:2"));
//! ```

mod code;
mod diagnostic;
mod render;
mod source;
mod suggest;

pub use code::{Code, Severity};
pub use diagnostic::{DataPlace, Diagnostic, Diagnostics, Place};
pub use render::{json, text};
pub use source::{Position, Source, Span};
pub use suggest::{did_you_mean, nearest};
