//! Residuals and their derivatives as code in other languages: Rust, C, Python.
//!
//! [`emit()`] writes a file that needs nothing but its language. Of every measurement it has
//!
//! | function | it does |
//! |---|---|
//! | `prepare(q)` | what depends on the parameters alone, once per iteration |
//! | `residuals(p, x)` | r |
//! | `jacobian(p, x)` | r and ∂r/∂q |
//! | `jacobian_rows(p, x)` | the same of [`ROWS`] rows at a time, in loops that compilers turn into vectors; not in Python |
//! | `derivatives(p, x)` | r, ∂r/∂q and ∂r/∂x |
//!
//! and a test vector: a made-up row, and what the reference evaluation by dual numbers gives there. Where families are used,
//! functions take the numbers of the members that a row names as `m`, and fill ∂r/∂m. Rows and columns are in declared order and
//! numbers in the model's own units, as in [`crate::evaluate::Jacobian`]. Held parameters are constants of the code.
//!
//! The way there: model ─`routine`→ one graph of scalar operations ─`line`→ statements ─`syntax`, `rust`, `c`, `python`→ text.
//!
//! ```
//! use phical::{compile::compile, diag::Source, emit::{Language, emit}, model::load, problem::Selection};
//! let source = Source::new("line.ron", r#"(
//!     name: "line",
//!     parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(2)) },
//!     measurements: { "point": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - (a + b*x)"}) },
//! )"#);
//! let (model, _) = load(&source)?;
//! let (program, _) = compile(&model, &source, &[])?;
//! let emitted = emit(&program, &[0], &Selection::default(), Language::Python)?;
//! assert!(emitted.code.contains("def point_derivatives(p, x):"));
//! assert_eq!(emitted.routines[0].parameters[1].name, "b");
//! # Ok::<(), phical::diag::Diagnostics>(())
//! ```

#![allow(
    clippy::indexing_slicing,
    reason = "statements, slots and leaves are numbered by the tape that is written down"
)]

mod c;
mod file;
mod line;
mod making;
mod names;
mod point;
mod python;
mod routine;
mod rust;
mod rust_support;
mod signed;
mod syntax;

pub use point::Point;
pub use routine::{Number, ROWS, Routine};

use crate::compile::{Measurement, Program};
use crate::data::Table;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::problem::{Options, Problem, Selection, Weights};
use file::File;

/// What code is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Rust, without heap or dependencies.
    Rust,
    /// C99.
    C,
    /// Python 3, with its math module.
    Python,
}

impl Language {
    /// Every language.
    pub const ALL: [Language; 3] = [Language::Rust, Language::C, Language::Python];

    /// `rust`, `c` or `python`.
    pub fn name(self) -> &'static str {
        match self {
            Language::Rust => "rust",
            Language::C => "c",
            Language::Python => "python",
        }
    }
}

/// A file, and what is in it.
#[derive(Clone, Debug)]
pub struct Emitted {
    /// The text.
    pub code: String,
    /// What is written for each measurement.
    pub routines: Vec<Routine>,
}

/// Writes measurements of a program, by their numbers. `selection` frees, fixes and says where held parameters stand; of a
/// family it takes `family[*]`.
///
/// # Errors
/// Mistakes of the selection, and measurements without residuals.
pub fn emit(
    program: &Program,
    measurements: &[usize],
    selection: &Selection,
    language: Language,
) -> Result<Emitted, Diagnostics> {
    let mut mistakes = Diagnostics::new();
    for &index in measurements {
        let measurement = &program.measurements[index];
        if measurement.residuals.is_empty() {
            let message = format!("the measurement `{}` states nothing that must vanish", measurement.name);
            mistakes.push(Diagnostic::error(Code::NoResiduals, message).at(&program.source, measurement.span));
        }
    }
    if mistakes.has_errors() {
        return Err(mistakes);
    }
    let tables = measurements.iter().map(|&index| (index, made_up(program, &program.measurements[index]))).collect();
    let selection = selection.clone();
    let options = Options { weights: Some(Weights::Unit), selection, unconstrained: true, ..Options::default() };
    // what the rows say counts for nothing, and neither do warnings about them
    let (problem, _) = Problem::bind(program, tables, &options)?;
    let routines: Vec<Routine> = problem.blocks.iter().map(|block| Routine::new(&problem, block.measurement)).collect();
    let file = File { model: &program.name, source: program.source.name(), routines: &routines };
    let code = match language {
        Language::Rust => rust::file(&file),
        Language::C => c::file(&file),
        Language::Python => python::file(&file),
    };
    Ok(Emitted { code, routines })
}

/// Rows that name every declared member, so that all can be freed and fixed, and one made-up member at least.
fn made_up(program: &Program, measurement: &Measurement) -> Table {
    let mut table = Table::new(measurement.keys.len(), measurement.inputs.len());
    let readings = vec![0.0; measurement.inputs.len()];
    let others: Vec<String> = (1..=measurement.keys.len()).map(|k| format!("m{k}")).collect();
    let mut push = |keys: &[&str]| table.put(keys.iter().copied(), &readings, None);
    let usual: Vec<&str> = others.iter().map(String::as_str).collect();
    push(&usual);
    for slot in &measurement.slots {
        for (member, _) in &program.parameters[slot.parameter].members {
            let mut keys = usual.clone();
            let parts: Vec<&str> = member.splitn(slot.keys.len().max(1), '/').collect();
            for (&key, part) in slot.keys.iter().zip(parts) {
                keys[key] = part;
            }
            push(&keys);
        }
    }
    table
}
