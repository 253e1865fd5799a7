//! `phical derive MODEL --to text|latex|rust|c|python`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::arguments::Chosen;
use super::{Format, Outcome};
use crate::data::Output;
use crate::derive::{Asked, Derivation, derive};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::emit::{Emitted, Language, emit};
use crate::report::{derivation_json, derivation_latex, derivation_text, emitted_json};
use crate::session::Session;

/// What derivatives are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum To {
    /// Formulas in the language of models
    Text,
    /// A LaTeX document
    Latex,
    /// A Rust module without heap or dependencies
    Rust,
    /// C99 without heap or dependencies
    C,
    /// Python functions that need the math module only
    Python,
}

impl To {
    /// The language, where code is written.
    fn language(self) -> Option<Language> {
        match self {
            To::Text | To::Latex => None,
            To::Rust => Some(Language::Rust),
            To::C => Some(Language::C),
            To::Python => Some(Language::Python),
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct Derive {
    /// The model file
    model: PathBuf,
    /// As what
    #[arg(long, value_enum, default_value_t = To::Text)]
    to: To,
    /// A measurement [default: all that have residuals]
    #[arg(long, value_name = "M")]
    measurement: Option<String>,
    /// Write to a file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Formulas")]
    formulas: Formulas,
    #[command(flatten, next_help_heading = "Code")]
    chosen: Chosen,
}

#[derive(Debug, Args)]
struct Formulas {
    /// A residual, a vector as a whole [default: all]
    #[arg(long, value_name = "R")]
    residual: Vec<String>,
    /// A parameter or input by which to differentiate, everything written out [default: any parameter]
    #[arg(long, value_name = "P")]
    by: Vec<String>,
    /// Second derivatives by each pair of `--by` as well
    #[arg(long, requires = "by")]
    second: bool,
}

/// Derivatives of one kind or the other.
enum Found {
    Formulas(Vec<Derivation>),
    Code(Emitted, Language),
}

impl Derive {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        self.suit()?;
        let session = Session::open(&self.model, &[])?;
        let measurements: Vec<usize> = match &self.measurement {
            Some(name) => vec![session.measurement(name).map_err(|found| Diagnostics::from(*found))?],
            None => {
                let all = session.program.measurements.iter().enumerate();
                all.filter(|(_, measurement)| !measurement.residuals.is_empty()).map(|(index, _)| index).collect()
            }
        };
        let found = self.found(&session, &measurements)?;
        let text = || match (&found, self.to) {
            (Found::Code(emitted, _), _) => emitted.code.clone(),
            (Found::Formulas(all), To::Latex) => derivation_latex(all, &session.program.name),
            (Found::Formulas(all), _) => derivation_text(all),
        };
        if let Some(path) = &self.out {
            let written = Output::open(path).and_then(|out| out.finish(|out| out.write_all(text().as_bytes())));
            written.map_err(|found| Diagnostics::from(*found))?;
        }
        let shown = || if self.out.is_some() { String::new() } else { text() };
        let json = || match &found {
            Found::Code(emitted, language) => emitted_json(emitted, *language),
            Found::Formulas(all) => derivation_json(all),
        };
        Ok(Outcome::new(format, shown, json).warned(session.warnings.clone()))
    }

    /// Refuses what only the other kind of output can have.
    fn suit(&self) -> Result<(), Diagnostics> {
        let of_formulas = [
            ("--residual", !self.formulas.residual.is_empty()),
            ("--by", !self.formulas.by.is_empty()),
            ("--second", self.formulas.second),
        ];
        let of_code = [("--fix", !self.chosen.fix.is_empty()), ("--free", !self.chosen.free.is_empty())];
        let (others, kind, hint) = match self.to.language() {
            Some(_) => {
                (&of_formulas[..], "formulas", "code has all residuals and their derivatives by all that is free")
            }
            None => (&of_code[..], "code", "formulas have parameters by name, held ones too"),
        };
        match others.iter().find(|(_, given)| *given) {
            Some((name, _)) => {
                let message = format!("`{name}` is for {kind}, and `--to` says otherwise");
                Err(Diagnostic::error(Code::NotAvailable, message).hint(hint).into())
            }
            None => Ok(()),
        }
    }

    fn found(&self, session: &Session, measurements: &[usize]) -> Result<Found, Diagnostics> {
        match self.to.language() {
            Some(language) => {
                let emitted = emit(&session.program, measurements, &self.chosen.selection(None), language)?;
                Ok(Found::Code(emitted, language))
            }
            None => self.derivations(session, measurements).map(Found::Formulas),
        }
    }

    fn derivations(&self, session: &Session, measurements: &[usize]) -> Result<Vec<Derivation>, Diagnostics> {
        let Formulas { residual, by, second } = &self.formulas;
        let asked = Asked { residuals: residual.clone(), by: by.clone(), second: *second };
        let mut found = Vec::new();
        let mut mistakes = Diagnostics::new();
        for &measurement in measurements {
            match derive(&session.program, measurement, &asked) {
                Ok(one) => found.push(one),
                Err(why) => mistakes.extend(why),
            }
        }
        // a name has to mean something in one measurement, not in all
        if found.is_empty() { Err(mistakes) } else { Ok(found) }
    }
}
