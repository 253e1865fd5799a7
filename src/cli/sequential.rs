//! Options of `--solver sequential`, and what is printed while rows come.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::interrupt::Interrupt;
use super::solving::Solving;
use super::{Format, pretty};
use crate::data::Output;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::Fit;
use crate::problem::Options;
use crate::report::{significant, with_sigma};
use crate::session::{Bound, Choice, Running, Sequence, Session};
use crate::solve::Keep;

/// Which rows a sequential fit keeps, what it tells, and where it goes on.
#[derive(Debug, Args)]
pub(super) struct OneByOne {
    /// With `--solver sequential`: relinearise all rows, or at least the last N; those before are absorbed [default: all]
    #[arg(long, value_name = "all|N", value_parser = keep)]
    keep: Option<Keep>,
    /// With `--solver sequential`: print the estimate after every N rows
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// With `--solver sequential`: write what is known after all rows, to go on from or to be merged
    #[arg(long, value_name = "STATE.json")]
    save: Option<PathBuf>,
    /// With `--solver sequential`: go on from a saved state; from several, merged. Rows are those of `--data` alone then
    #[arg(long, value_name = "STATE.json")]
    resume: Vec<String>,
    /// With `--solver sequential`: linearise at the start and nowhere else, so that parts of the data merge exactly
    #[arg(long, conflicts_with = "keep")]
    hold_point: bool,
}

fn keep(text: &str) -> Result<Keep, String> {
    match text {
        "all" => Ok(Keep::All),
        _ => text.parse().map(Keep::Last).map_err(|_| "write `all`, or a number of rows".into()),
    }
}

impl OneByOne {
    /// Whether another solver is asked for what this one alone can do.
    pub(super) fn fit(&self, solver: &Solving) -> Result<(), Box<Diagnostic>> {
        let given = [
            ("--keep", self.keep.is_some()),
            ("--every", self.every.is_some()),
            ("--save", self.save.is_some()),
            ("--resume", !self.resume.is_empty()),
            ("--hold-point", self.hold_point),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((name, _)) if !solver.is_sequential() => {
                let own = solver.name().unwrap_or("lm");
                let message = format!("`{name}` is for rows that come one at a time, and the solver is `{own}`");
                let hint = "say `--solver sequential` too, or leave it out";
                Err(Box::new(Diagnostic::error(Code::NotAvailable, message).hint(hint)))
            }
            _ => Ok(()),
        }
    }

    fn keep(&self) -> Keep {
        if self.hold_point { Keep::AtStart } else { self.keep.unwrap_or_default() }
    }

    /// What the fit file says of it.
    pub(super) fn kept(&self, solver: &Solving) -> Value {
        if solver.is_sequential() { json!(self.keep().name()) } else { Value::Null }
    }

    /// Whether JSON comes in lines, an object each.
    pub(super) fn in_lines(&self) -> bool {
        self.every.is_some()
    }

    /// Takes in all rows, and gives the problem that they leave.
    pub(super) fn run<'s>(
        &self,
        session: &'s Session,
        choice: &Choice,
        options: Options,
        format: Format,
        interrupt: &Interrupt,
    ) -> Result<Bound<'s>, Diagnostics> {
        let save = self.save.as_deref().map(Output::open).transpose().map_err(|found| Diagnostics::from(*found))?;
        let every = self.every.map_or(0, |every| every as usize);
        let sequence = Sequence { keep: self.keep(), every, resume: self.resume.clone() };
        // a reader who has seen enough is no mistake
        let mut tell = |rows: usize, fit: &Fit| {
            let text = match format {
                Format::Text => so_far(rows, fit),
                Format::Json => format!("{}\n", so_far_json(rows, fit)),
            };
            let mut out = std::io::stdout().lock();
            let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        };
        let mut running = Running::new(session, options, sequence, &mut tell);
        let done = running.read(choice).and_then(|coming| {
            interrupt.heed();
            running.take_in(coming)
        });
        // what was taken in is worth keeping, whatever came after it
        if let (Some(save), Some(state)) = (save, running.saved()) {
            let written = save.finish(|out| out.write_all(pretty(&state).as_bytes()));
            written.map_err(|found| Diagnostics::from(*found))?;
        }
        done?;
        running.finish()
    }
}

/// Names that are longer take no part in how wide the column is.
const WIDEST: usize = 60;

/// The estimate so far, for people.
fn so_far(rows: usize, fit: &Fit) -> String {
    let mut text = format!("after {rows} row{}: ", if rows == 1 { "" } else { "s" });
    let size = fit.sigma0.map_or_else(|| "nothing to spare".to_owned(), |s| format!("sigma0 {}", significant(s, 4)));
    // a String takes everything
    let _ = writeln!(
        text,
        "{} equations, {size}{}",
        fit.equations,
        if fit.status.converged() { "" } else { ", not converged" }
    );
    let width = fit.parameters.iter().map(|p| p.name.len()).max().unwrap_or(0).min(WIDEST);
    for p in &fit.parameters {
        let value = match p.sigma {
            Some(sigma) => {
                let (value, sigma) = with_sigma(p.value, sigma);
                format!("{value} ± {sigma} {}", p.unit)
            }
            None if !p.estimable => "not estimable".to_owned(),
            None => format!("{} {}", significant(p.value, 9), p.unit),
        };
        let _ = writeln!(text, "  {:width$}  {}", p.name, value.trim_end());
    }
    text
}

/// The same for programs.
fn so_far_json(rows: usize, fit: &Fit) -> Value {
    let parameter = |p: &crate::fit::Estimate| json!({ "name": p.name, "value": p.value, "unit": p.unit, "sigma": p.sigma, "estimable": p.estimable });
    let parameters: Vec<Value> = fit.parameters.iter().map(parameter).collect();
    json!({
        "rows": rows, "converged": fit.status.converged(), "equations": fit.equations, "cost": fit.cost, "dof": fit.dof,
        "sigma0": fit.sigma0, "rank": fit.rank, "parameters": parameters,
    })
}
