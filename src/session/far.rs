//! Starting far away: the start of a fit, found by a continuation, from several starts, or both.

use super::continuation::{FOLLOWED, follow};
use super::procedure::fit_by_search;
use super::search::Search;
use super::starts::{Ended, MultiStart, compare_starts};
use crate::diag::{Code, Diagnostic};
use crate::fit::{Continuation, Fit, Starts, Tested};
use crate::problem::Problem;
use crate::solve::Status;

/// How a start is found; by default it is the declared one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Far {
    /// The best of several starts.
    pub starts: Option<MultiStart>,
    /// Each start is followed along a path of readings; see [`follow`].
    pub continuation: bool,
}

/// What was found on the way.
pub(super) struct Arrived {
    starts: Option<Starts>,
    continuation: Option<Continuation>,
    unit: bool,
    /// not all that was asked for was tried
    cut: bool,
}

impl Far {
    /// Puts a problem's start where the fit is to begin.
    pub(super) fn arrive(&self, problem: &mut Problem, by: Search) -> Result<Arrived, Box<Diagnostic>> {
        let mut arrived = Arrived { starts: None, continuation: None, unit: !problem.weights.are_real(), cut: false };
        if let Some(options) = self.starts {
            let search = |from: &Problem| self.end(from, by);
            let (best, starts) = compare_starts(problem, options, &search)?;
            problem.start = best;
            arrived.starts = Some(starts);
        }
        if self.continuation {
            let (_, told, point) = self.better(problem, by)?;
            problem.start = point;
            arrived.continuation = told;
        }
        let tried = self.starts.is_some() || self.continuation;
        arrived.cut = tried && problem.execution.stopped();
        Ok(arrived)
    }

    /// Where a search from the problem's start ends.
    fn end(&self, problem: &Problem, by: Search) -> Result<Ended, Box<Diagnostic>> {
        match self.continuation {
            true => self.better(problem, by).map(|(end, ..)| end),
            false => ended(problem, by),
        }
    }

    /// The better of what the path and the start alone lead to, and the point that leads there.
    fn better(
        &self,
        problem: &Problem,
        by: Search,
    ) -> Result<(Ended, Option<Continuation>, Vec<f64>), Box<Diagnostic>> {
        let alone = ended(problem, by);
        let (point, told) = follow(problem)?;
        if told.reached < FOLLOWED {
            return Ok((alone?, Some(told), problem.start.clone()));
        }
        let mut near = problem.clone();
        near.start = point;
        match (alone, ended(&near, by)) {
            (Ok(alone), Ok(led)) if (!alone.converged, alone.cost) <= (!led.converged, led.cost) => {
                Ok((alone, Some(told), problem.start.clone()))
            }
            (_, Ok(led)) => Ok((led, Some(told), near.start)),
            (alone, Err(_)) => Ok((alone?, Some(told), problem.start.clone())),
        }
    }
}

fn ended(problem: &Problem, by: Search) -> Result<Ended, Box<Diagnostic>> {
    let fit = fit_by_search(problem, Tested::None, by)?;
    Ok(Ended { converged: fit.status.converged(), cost: fit.cost, point: fit.point })
}

impl Arrived {
    /// Adds to a fit what was found, and what to be careful about.
    pub(super) fn told(self, fit: &mut Fit) {
        if let Some(starts) = &self.starts
            && let [best, others @ ..] = &starts.minima[..]
        {
            if !best.declared {
                let message = match others.iter().find(|minimum| minimum.declared) {
                    Some(own) => {
                        format!("the declared start ends at cost {:.6e}, another one at {:.6e}", own.cost, best.cost)
                    }
                    None => "the declared start does not converge, another one does".to_owned(),
                };
                let found = Diagnostic::warning(Code::BetterElsewhere, message);
                fit.warnings.push(found.hint("the better one is reported; declare nominal values near it"));
            }
            let as_good = others.iter().filter(|minimum| minimum.as_good).count();
            if as_good > 0 {
                let why = if self.unit { "the scatter of the residuals" } else { "the declared errors" };
                let message = format!("{} minima are as good as one another, by {why}", as_good + 1);
                let found = Diagnostic::warning(Code::Ambiguous, message);
                fit.warnings
                    .push(found.hint("narrow the bounds so that one remains, or measure what tells them apart"));
            }
        }
        if let Some(told) = self.continuation.filter(|told| told.reached < FOLLOWED) {
            let message = format!("the continuation ended at {:.1} % of the way", 100.0 * told.reached);
            let found = Diagnostic::warning(Code::NotFollowed, message);
            fit.warnings.push(
                found.hint("the result is that of a search from the start alone; start nearer, or ask for `--starts`"),
            );
        }
        if self.cut {
            fit.status = Status::Interrupted;
        }
        fit.starts = self.starts;
        fit.continuation = self.continuation;
    }
}
