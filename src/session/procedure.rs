//! Fits that are made of several: losses that want a near start or a scale, gross errors taken out one by one, and errors
//! whose size is estimated.

use std::time::Instant;

use super::far::Far;
use super::nanoseconds;
use super::search::Search;
use super::timed::Timed;
use crate::data::Stage;
use crate::diag::{Code, Diagnostic};
use crate::fit::{Component, Fit, Tested, analyse_with};
use crate::problem::{Block, Factors, Problem, Undefined, Weights};
use crate::solve::{Norm, Solution, Status};

/// Rounds of estimating scales or variance components.
const ROUNDS: usize = 60;
/// A scale or factor that changes by less than this share stands still.
const STILL: f64 = 1e-6;

/// What is done beside one fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Procedure {
    /// Iterative data snooping (Baarda 1968): the row with the worst suspect is taken out, and the rest fitted again, until
    /// there is no suspect.
    pub snoop: bool,
    /// The size of each group of errors is estimated with the parameters (Förstner 1979).
    pub variance_components: bool,
    /// All observations are tested, however many there are.
    pub test_all: bool,
    /// How the start is found, where the declared one is far.
    pub far: Far,
    /// The solver.
    pub search: Search,
}

/// The solver, and where the time goes.
pub(super) struct Clock {
    search: Search,
    /// nanoseconds in the problem's functions
    pub(super) spent: u64,
    /// nanoseconds in solvers
    pub(super) solved: u64,
    pub(super) linearised: usize,
}

impl Clock {
    pub(super) fn new(search: Search) -> Self {
        Clock { search, spent: 0, solved: 0, linearised: 0 }
    }
}

impl Procedure {
    /// Runs it from the problem's start.
    pub(super) fn run<'p>(
        &self,
        problem: &Problem<'p>,
        clock: &mut Clock,
    ) -> Result<(Fit, Problem<'p>), Box<Diagnostic>> {
        if self.variance_components && !problem.weights.are_real() {
            let message = "the size of errors cannot be estimated in declared sigmas where weights are unit";
            let found = Diagnostic::error(Code::NotAvailable, message);
            return Err(Box::new(found.hint("declare sigmas; with unit weights sigma0 is the size of all")));
        }
        if let Search::Conic(norm) = self.search
            && norm != Norm::LeastSquares
        {
            return self.by_norm(problem, norm, clock).map(|fit| (fit, problem.clone()));
        }
        let (mut problem, mut factors) = (problem.clone(), Factors::new());
        let arrived = self.far.arrive(&mut problem, self.search)?;
        let mut fit = self.components(&mut problem, &mut factors, clock)?;
        arrived.told(&mut fit);
        let mut removed = Vec::new();
        let suspects = |fit: &Fit| fit.observations.as_ref().map_or(Vec::new(), |all| all.suspects.clone());
        let telling = problem.execution.clone();
        while self.snoop
            && let [suspect, others @ ..] = &suspects(&fit)[..]
        {
            let (done, all) = (removed.len() as u64, (removed.len() + 1 + others.len()) as u64);
            telling.tell(Stage::Of { what: "suspects taken out", done, all });
            if problem.execution.stopped() {
                fit.status = Status::Interrupted;
                break;
            }
            let of = |block: &Block| if block.index == suspect.measurement { vec![suspect.row] } else { Vec::new() };
            let rows: Vec<Vec<usize>> = problem.blocks.iter().map(of).collect();
            let mut next = problem.without_rows(&rows);
            next.start.clone_from(&fit.point);
            next.execution = telling.silent();
            let next_fit = self.components(&mut next, &mut factors, clock)?;
            if next_fit.status == Status::Interrupted {
                fit.status = Status::Interrupted;
                break;
            }
            // what leaves less to be known than before is no cure
            if next_fit.rank < fit.rank || next_fit.dof == 0 {
                break;
            }
            removed.push(suspect.clone());
            (fit, problem) = (next_fit, next);
        }
        fit.removed = removed;
        if fit.status == Status::Interrupted {
            fit.warnings.push(interrupted("the values are the best so far, and no minimum"));
        }
        Ok((fit, problem))
    }

    /// Minimises something else than squares.
    fn by_norm(&self, problem: &Problem, norm: Norm, clock: &mut Clock) -> Result<Fit, Box<Diagnostic>> {
        let refuse = |what: &str, hint: &str| {
            let message = format!("a norm of single equations does not go with {what}");
            Err(Box::new(Diagnostic::error(Code::NotAvailable, message).hint(hint)))
        };
        if problem.weights == Weights::Propagated {
            return refuse(
                "propagated weights, which have whole rows only",
                "say `--weights unit`, or `--weights sigma` where residuals have sigmas",
            );
        }
        if problem.is_robust() || self.snoop || self.variance_components {
            return refuse("losses, snooping or variance components", "leave these out");
        }
        let mut problem = problem.clone();
        let arrived = self.far.arrive(&mut problem, self.search)?;
        let mut fit = solve(&problem, clock, Tested::None)?.of_norm(norm.sentence());
        arrived.told(&mut fit);
        if fit.status == Status::Interrupted {
            fit.warnings.push(interrupted("the values are the best so far, and no minimum"));
        }
        Ok(fit)
    }

    fn tested(&self) -> Tested {
        if self.test_all || self.snoop || self.variance_components { Tested::All } else { Tested::Few }
    }

    /// Fits, and where asked again with the errors as large as the last fit found them.
    fn components(
        &self,
        problem: &mut Problem,
        factors: &mut Factors,
        clock: &mut Clock,
    ) -> Result<Fit, Box<Diagnostic>> {
        let tested = self.tested();
        let mut fit = robust(problem, clock, tested)?;
        if !self.variance_components {
            return Ok(fit);
        }
        for _ in 0..ROUNDS {
            let groups = fit.observations.as_ref().map_or(&[][..], |all| &all.groups);
            let found = groups.iter().filter_map(|group| Some((group.name.clone(), group.variance_factor()?)));
            let mut largest = 0.0f64;
            for (name, variance) in found.collect::<Vec<_>>() {
                let factor = variance.sqrt().clamp(1e-3, 1e3);
                largest = largest.max((factor - 1.0).abs());
                *factors.entry(name).or_insert(1.0) *= factor;
            }
            if largest <= STILL {
                break;
            }
            if problem.execution.stopped() {
                fit.status = Status::Interrupted;
                break;
            }
            let mut next = problem.with_factors(factors);
            next.start.clone_from(&fit.point);
            fit = robust(&mut next, clock, tested)?;
            *problem = next;
        }
        fit.components = Component::all(factors, fit.observations.as_ref().map_or(&[][..], |all| &all.groups));
        Ok(fit)
    }
}

/// Fits from the problem's start as a calibration does where nothing beside one fit is asked for.
///
/// # Errors
/// Where a search cannot start, or a derivative at the end is undefined.
pub fn fit_once(problem: &Problem, tested: Tested) -> Result<Fit, Box<Diagnostic>> {
    fit_by_search(problem, tested, Search::default())
}

/// The same by a solver.
pub(super) fn fit_by_search(problem: &Problem, tested: Tested, search: Search) -> Result<Fit, Box<Diagnostic>> {
    let mut clock = Clock::new(search);
    robust(&mut problem.clone(), &mut clock, tested)
}

/// Fits with the losses that there are: from where one that never gives up a row leads, and with a scale that stands still.
fn robust(problem: &mut Problem, clock: &mut Clock, tested: Tested) -> Result<Fit, Box<Diagnostic>> {
    let undefined = |Undefined(found): Undefined| found;
    if !problem.is_robust() {
        return solve(problem, clock, tested);
    }
    let scales = problem.estimated_scales(&problem.start).map_err(undefined)?;
    let estimated = scales.iter().any(Option::is_some);
    let start = problem.start.clone();
    if problem.redescends() || estimated {
        let mut near = problem.with_convex_losses().with_scales(&scales);
        let mut last = scales;
        for _ in 0..ROUNDS {
            let solution = search(&near, clock)?;
            near.start = solution;
            let next = near.estimated_scales(&near.start).map_err(undefined)?;
            let still = still(&last, &next);
            near = near.with_scales(&next);
            last = next;
            if still || problem.execution.stopped() {
                break;
            }
        }
        problem.start.clone_from(&near.start);
        *problem = problem.with_scales(&last);
    }
    let mut fit = None;
    for _ in 0..ROUNDS {
        if problem.sums(&problem.start).map_err(undefined)?.all_rejected() {
            let message = "the loss gives no row any weight at the start";
            let hint = "start nearer, let the scale be estimated, or take a loss that never rejects, such as `huber`";
            return Err(Box::new(Diagnostic::error(Code::NothingLeft, message).hint(hint)));
        }
        let mut found = solve(problem, clock, tested)?;
        let before = problem.scales();
        let next = problem.estimated_scales(&found.point).map_err(undefined)?;
        let mut done = !estimated || still(&before, &next);
        if !done && problem.execution.stopped() {
            found.status = Status::Interrupted;
            done = true;
        }
        if !done {
            *problem = problem.with_scales(&next);
            problem.start.clone_from(&found.point);
        }
        fit = Some(found);
        if done {
            break;
        }
    }
    // where to start is the user's, wherever the way led
    problem.start = start;
    fit.ok_or_else(|| Box::new(Diagnostic::error(Code::NothingLeft, "there is nothing to fit")))
}

fn still(before: &[Option<f64>], after: &[Option<f64>]) -> bool {
    before.iter().zip(after).all(|(before, after)| match (before, after) {
        (Some(before), Some(after)) => (before - after).abs() <= STILL * after,
        (_, None) => true,
        (None, Some(_)) => false,
    })
}

/// What is said of a fit, or of what was to follow it, that was cut short.
pub(super) fn interrupted(what: &str) -> Diagnostic {
    Diagnostic::warning(Code::Interrupted, format!("interrupted: {what}")).hint("start again from there with `--start`")
}

/// Where the search from the start ends.
fn search(problem: &Problem, clock: &mut Clock) -> Result<Vec<f64>, Box<Diagnostic>> {
    timed(problem, clock).map(|solution| solution.point)
}

fn solve(problem: &Problem, clock: &mut Clock, tested: Tested) -> Result<Fit, Box<Diagnostic>> {
    let solution = timed(problem, clock)?;
    analyse_with(problem, solution, tested).map_err(|Undefined(found)| found)
}

fn timed(problem: &Problem, clock: &mut Clock) -> Result<Solution<Vec<f64>>, Box<Diagnostic>> {
    let begun = Instant::now();
    let timed = Timed::new(problem, &problem.execution);
    let solution = clock.search.solve(problem, &timed, problem.start.clone())?;
    clock.solved += nanoseconds(begun);
    clock.spent += u64::try_from(timed.spent().as_nanos()).unwrap_or(u64::MAX);
    clock.linearised += timed.linearised();
    Ok(solution)
}
