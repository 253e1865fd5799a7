//! The command line: arguments in, one text out, and an exit code.
//!
//! A subcommand is a file here. Each parses its arguments, calls the library, and returns an `Outcome`; [`run`] alone
//! writes. Results go to standard output, everything else to standard error.
//!
//! | exit code | meaning |
//! |---|---|
//! | 0 | done and trustworthy |
//! | 1 | done, but not to be trusted; the output says why |
//! | 2 | wrong input |

mod arguments;
mod calibrate;
mod check;
mod check_derivatives;
mod compare;
mod coverage;
mod datum;
mod derive;
mod design;
mod evaluate;
mod explain;
mod export;
mod far;
mod identify;
mod import;
mod init;
mod interrupt;
mod jacobian;
mod observations;
mod overview;
mod progress;
mod report;
mod sequential;
mod shell;
mod simulate;
mod solving;

use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use serde_json::{Value, json};

pub use interrupt::Interrupt;

use crate::diag::{self, Diagnostics, Severity};

/// Calibrate instruments and robots that are declared, not programmed.
#[derive(Debug, Parser)]
#[command(name = "phical", version, max_term_width = 100, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// How results are printed.
    #[arg(long, global = true, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Say nothing on standard error but why there is no result: no warnings, no progress
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Colours on a terminal
    #[arg(long, global = true, value_enum, default_value_t = clap::ColorChoice::Auto)]
    color: clap::ColorChoice,
}

/// How results are printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// for people
    #[default]
    Text,
    /// for programs
    Json,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Read a model, report all its mistakes at once, or say what it is
    Check(check::Check),
    /// Make up data from a declared scenario, with the truth beside them
    Simulate(simulate::Simulate),
    /// Fit a model to its data
    Calibrate(calibrate::Calibrate),
    /// Simulate and fit many times: are the stated uncertainties true?
    Coverage(coverage::Coverage),
    /// Residuals and their derivatives as formulas or code
    Derive(derive::Derive),
    /// What can be known, before or after measuring, and what to hold or measure where it cannot
    Identify(identify::Identify),
    /// Which rows to measure, out of many candidates
    Design(design::Design),
    /// Print residuals and their derivatives by parameters and inputs
    Jacobian(jacobian::Jacobian),
    /// Residuals and derived quantities at given values, on any data
    Evaluate(evaluate::Evaluate),
    /// Compare two fits: does freeing a parameter pay, and do they agree?
    Compare(compare::Compare),
    /// Fit many models: what is free, seen and least known of each, as a table
    Overview(overview::OverviewOf),
    /// A fit as a page to look at: one HTML file, figures as SVG
    Report(report::Report),
    /// Write a commented model to begin with
    Init(init::Init),
    /// A model from a Denavit-Hartenberg table or a URDF
    Import(import::Import),
    /// A chain's calibrated numbers as a Denavit-Hartenberg table or in its URDF, with their covariance
    Export(export::Export),
    /// Explain a code such as E012
    Explain(explain::Explain),
    /// Completions for a shell
    Completions(shell::Completions),
    /// The manual page
    Man(shell::Man),
}

impl Command {
    fn run(self, format: Format, interrupt: &Interrupt) -> Result<Outcome, Diagnostics> {
        match self {
            Command::Check(command) => command.run(format),
            Command::Simulate(command) => command.run(format),
            Command::Calibrate(command) => command.run(format, interrupt),
            Command::Coverage(command) => command.run(format, interrupt),
            Command::Derive(command) => command.run(format),
            Command::Identify(command) => command.run(format),
            Command::Design(command) => command.run(format, interrupt),
            Command::Jacobian(command) => command.run(format),
            Command::Evaluate(command) => command.run(format),
            Command::Compare(command) => command.run(format),
            Command::Overview(command) => command.run(format, interrupt),
            Command::Report(command) => command.run(format),
            Command::Init(command) => command.run(format),
            Command::Import(command) => command.run(format),
            Command::Export(command) => command.run(format),
            Command::Explain(command) => Ok(command.run(format)),
            Command::Completions(command) => Ok(command.run(format)),
            Command::Man(command) => command.run(format),
        }
    }
}

/// What a subcommand that could start leads to.
struct Outcome {
    /// What goes to standard output.
    output: String,
    /// Whether to trust it.
    trustworthy: bool,
    /// What goes to standard error.
    warnings: Diagnostics,
}

impl Outcome {
    /// The result in the wanted format.
    fn new(format: Format, text: impl FnOnce() -> String, json: impl FnOnce() -> Value) -> Self {
        let output = match format {
            Format::Text => text(),
            Format::Json => pretty(&json()),
        };
        Outcome { output, trustworthy: true, warnings: Diagnostics::new() }
    }

    fn warned(self, warnings: Diagnostics) -> Self {
        Outcome { warnings, ..self }
    }

    fn trusted(self, trustworthy: bool) -> Self {
        Outcome { trustworthy, ..self }
    }
}

/// Runs the program with its arguments, the program's name first.
///
/// ```
/// let (mut out, mut err) = (Vec::new(), Vec::new());
/// let code = phical::cli::run(["phical", "explain", "E012"], &mut out, &mut err);
/// assert_eq!(code, std::process::ExitCode::SUCCESS);
/// assert!(String::from_utf8(out).unwrap().starts_with("E012: the unit does not fit"));
/// ```
pub fn run<A: Into<OsString> + Clone>(
    arguments: impl IntoIterator<Item = A>,
    stdout: &mut dyn Write,
    stderr: &mut dyn Write,
) -> ExitCode {
    run_in(&Surroundings::default(), arguments, stdout, stderr)
}

/// What a run is started from.
#[derive(Debug, Default)]
pub struct Surroundings {
    /// What ends it early.
    pub interrupt: Interrupt,
    /// Whether standard output shows colours, where `--color` does not say.
    pub stdout_coloured: bool,
    /// Whether standard error does.
    pub stderr_coloured: bool,
}

/// The same, until it is interrupted, with colours where the streams show them.
pub fn run_in<A: Into<OsString> + Clone>(
    surroundings: &Surroundings,
    arguments: impl IntoIterator<Item = A>,
    stdout: &mut dyn Write,
    stderr: &mut dyn Write,
) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => return usage(&error, wants_json(&arguments), surroundings, stdout, stderr),
    };
    let coloured = |shown: bool| match cli.color {
        clap::ColorChoice::Auto => shown,
        clap::ColorChoice::Always => true,
        clap::ColorChoice::Never => false,
    };
    progress::be_quiet(cli.quiet);
    let (code, output, diagnostics) = match cli.command.run(cli.format, &surroundings.interrupt) {
        Ok(outcome) => {
            let output = match cli.format {
                Format::Text if coloured(surroundings.stdout_coloured) => {
                    in_colour(&outcome.output, outcome.trustworthy)
                }
                _ => outcome.output,
            };
            let warnings = if cli.quiet { Diagnostics::new() } else { outcome.warnings };
            (u8::from(!outcome.trustworthy), output, warnings)
        }
        Err(diagnostics) => {
            let output = match cli.format {
                Format::Text => String::new(),
                Format::Json => pretty(&refusal(&diagnostics)),
            };
            (2, output, diagnostics)
        }
    };
    // nobody can be told of a failure to write here
    let _ = stderr
        .write_all(diag::text(&diagnostics, coloured(surroundings.stderr_coloured)).as_bytes())
        .and_then(|()| stderr.flush());
    written(code, &output, stdout, stderr)
}

/// The verdict, up to the first colon, in green or red; the rest as it is, so that it can be pasted.
fn in_colour(output: &str, trustworthy: bool) -> String {
    use clap::builder::styling::{AnsiColor, Style};
    let line = output.find('\n').unwrap_or(output.len());
    match output.find(':').filter(|colon| *colon < line) {
        Some(colon) => {
            let colour = if trustworthy { AnsiColor::Green } else { AnsiColor::Red };
            let style = Style::new().bold().fg_color(Some(colour.into()));
            let (verdict, rest) = output.split_at(colon);
            format!("{style}{verdict}{style:#}{rest}")
        }
        None => output.to_owned(),
    }
}

/// Writes the result. A reader who has seen enough is no mistake.
fn written(code: u8, output: &str, stdout: &mut dyn Write, stderr: &mut dyn Write) -> ExitCode {
    match stdout.write_all(output.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            let _ = writeln!(stderr, "error: standard output cannot be written: {error}");
            ExitCode::from(2)
        }
        _ => ExitCode::from(code),
    }
}

/// What the parser of arguments has to say: help and version are results, all else is wrong input.
fn usage(
    error: &clap::Error,
    json: bool,
    surroundings: &Surroundings,
    stdout: &mut dyn Write,
    stderr: &mut dyn Write,
) -> ExitCode {
    let text = error.render().to_string();
    let shown = |coloured: bool| if coloured { error.render().ansi().to_string() } else { text.clone() };
    if !error.use_stderr() {
        return written(0, &shown(surroundings.stdout_coloured), stdout, stderr);
    }
    let _ = stderr.write_all(shown(surroundings.stderr_coloured).as_bytes()).and_then(|()| stderr.flush());
    let output = if json {
        let message = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
        let found = json!({ "code": null, "severity": "error", "message": message, "file": null, "hint": null });
        pretty(&json!({ "errors": [found], "warnings": [] }))
    } else {
        String::new()
    };
    written(2, &output, stdout, stderr)
}

/// Whether arguments that cannot be parsed ask for JSON.
fn wants_json(arguments: &[OsString]) -> bool {
    arguments.iter().any(|argument| argument == "--format=json")
        || arguments.iter().zip(arguments.iter().skip(1)).any(|(one, next)| one == "--format" && next == "json")
}

/// A run that could not start, as JSON.
fn refusal(diagnostics: &Diagnostics) -> Value {
    let of = |severity| diag::json(diagnostics.iter().filter(|d| d.severity == severity));
    json!({ "errors": of(Severity::Error), "warnings": of(Severity::Warning) })
}

/// JSON for files and standard output.
fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_reader_who_has_seen_enough_is_no_mistake() {
        struct Closed(ErrorKind);
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(self.0.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let mut told = Vec::new();
        let code = run(["phical", "explain"], &mut Closed(ErrorKind::BrokenPipe), &mut told);
        assert_eq!((code, told.len()), (ExitCode::SUCCESS, 0));
        let code = run(["phical", "explain"], &mut Closed(ErrorKind::StorageFull), &mut told);
        assert_eq!(code, ExitCode::from(2));
        assert!(!told.is_empty());
    }

    #[test]
    fn usage_mistakes_are_wrong_input_in_both_formats() {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        assert_eq!(run(["phical", "calibrat"], &mut out, &mut err), ExitCode::from(2));
        assert!(out.is_empty() && !err.is_empty());
        let code = run(["phical", "explain", "E999", "--format", "json"], &mut out, &mut err);
        assert_eq!(code, ExitCode::from(2));
        let value: Value = serde_json::from_slice(&out).unwrap();
        assert!(value["errors"][0]["message"].as_str().unwrap().contains("E999"));
    }

    #[test]
    fn help_and_version_are_results() {
        for flag in ["--help", "--version"] {
            let (mut out, mut err) = (Vec::new(), Vec::new());
            assert_eq!(run(["phical", flag], &mut out, &mut err), ExitCode::SUCCESS);
            assert!(!out.is_empty() && err.is_empty());
        }
    }
}
