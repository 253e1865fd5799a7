//! How to search for the minimum, and of what.

use clap::{Args, ValueEnum};

use crate::diag::{Code, Diagnostic};
use crate::session::Search;
use crate::solve::Norm;

/// How to search for the minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Solver {
    /// Levenberg-Marquardt
    Lm,
    /// conic steps within bounds and constraints, by Clarabel
    Clarabel,
    /// one row at a time
    Sequential,
}

/// The solver, and what it minimises.
#[derive(Debug, Args)]
pub(super) struct Solving {
    /// How to search for the minimum [default: clarabel where the model has constraints, else lm]
    #[arg(long, value_enum)]
    solver: Option<Solver>,
    /// What is minimised instead of squares, over all whitened equations; with `--solver clarabel`
    #[arg(long, value_name = "l1|huber[:K]|minimax", value_parser = norm)]
    norm: Option<Norm>,
}

fn norm(text: &str) -> Result<Norm, String> {
    /// 95 % as efficient as squares where errors are normal (Huber 1981).
    const TUNING: f64 = 1.345;
    let positive = |text: &str| text.parse::<f64>().ok().filter(|k| *k > 0.0 && k.is_finite());
    match text.split_once(':') {
        None if text == "l1" => Ok(Norm::L1),
        None if text == "minimax" => Ok(Norm::Minimax),
        None if text == "huber" => Ok(Norm::Huber(TUNING)),
        Some(("huber", k)) => positive(k).map(Norm::Huber).ok_or_else(|| "K is a positive number".into()),
        _ => Err("write l1, minimax, huber or huber:K".into()),
    }
}

impl Solving {
    pub(super) fn name(&self) -> Option<&'static str> {
        self.solver.map(|solver| match solver {
            Solver::Lm => "lm",
            Solver::Clarabel => "clarabel",
            Solver::Sequential => "sequential",
        })
    }

    pub(super) fn is_sequential(&self) -> bool {
        self.solver == Some(Solver::Sequential)
    }

    /// What searches.
    pub(super) fn search(&self) -> Result<Search, Box<Diagnostic>> {
        match (self.solver, self.norm) {
            (Some(Solver::Clarabel), norm) => Ok(Search::Conic(norm.unwrap_or_default())),
            (_, Some(_)) => {
                let message = "`--norm` needs cones";
                let hint = "say `--solver clarabel` too; `--loss` is for any solver";
                Err(Box::new(Diagnostic::error(Code::NotAvailable, message).hint(hint)))
            }
            (Some(Solver::Lm), None) => Ok(Search::LevenbergMarquardt),
            (Some(Solver::Sequential) | None, None) => Ok(Search::Suited),
        }
    }
}
