//! Residuals and their derivatives as formulas that a person can read.
//!
//! [`derive()`] takes a measurement apart into what the model names: `kci1` is `kci(l1, r1)`, which is `-dot(l1.o - r1.o, cross(r1.z,
//! l1.z))`. Each named piece gets its derivative in terms of those of the pieces that it is made of, once for every parameter q, as a
//! paper does; frames of chains, which is where parameters enter, then have theirs by each parameter. For given parameters everything
//! is written out instead, second derivatives included.
//!
//! Formulas are expressions of the model language, so that they can be pasted into a model; numbers in them are in the model's
//! internal units: lengths and times as it declares them, angles in radians.
//!
//! ```
//! use phical::{compile::compile, derive::{Asked, derive}, diag::Source, model::load};
//! let source = Source::new("line.ron", r#"(
//!     name: "line",
//!     parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(0)) },
//!     measurements: { "point": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - sin(a + b*x)"}) },
//! )"#);
//! let (model, _) = load(&source)?;
//! let (program, _) = compile(&model, &source, &[])?;
//! let asked = Asked { by: vec!["b".into()], ..Asked::default() };
//! let found = derive(&program, 0, &asked)?;
//! assert_eq!(found.sections[1].statements[0].text(), "derivative(r, b) = -(x * cos(a + x * b))");
//! # Ok::<(), phical::diag::Diagnostics>(())
//! ```

mod names;
mod pieces;
mod statements;

pub use statements::{Asked, Derivation, Section, Statement, derive};
