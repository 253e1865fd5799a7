//! The search: a relaxation that says how good designs can be, and a design that comes close.

use super::criterion::{Criterion, Goal};
use super::exchange::{exchange, greedy, worth};
use super::experiment::Experiment;
use super::relax::{Relaxed, relax};
use crate::linalg::LinalgError;

/// The power that stands for the largest of several while designs are exchanged.
const SHARP: f64 = 48.0;
/// Candidates for exchange, by what they promise, in multiples of how many are chosen.
const PROMISING: usize = 4;

/// Where there are no more choices than this, all are tried.
const FEW: usize = 2000;

/// Candidates that were chosen, and how good that is.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The candidates, by number, in increasing order.
    pub chosen: Vec<usize>,
    /// The criterion of these: −log det M, a mean variance, or the largest of several.
    pub value: f64,
    /// No choice of as many candidates, whole or in part, has a lower one.
    pub bound: f64,
    /// The weights of the relaxation, by candidate.
    pub weights: Vec<f64>,
    /// How many coordinates −log det M is of; none for other criteria.
    determinant_of: Option<usize>,
}

impl Picked {
    /// The uncertainty (a standard deviation, for D the geometric mean of n of them) by the best possible, less one: zero is best, and
    /// the true excess is at most this.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.ratio(self.value, self.bound)
    }

    /// The same of another value by this one.
    pub(super) fn against(&self, other: f64) -> f64 {
        self.ratio(other, self.value)
    }

    fn ratio(&self, value: f64, best: f64) -> f64 {
        let ratio = match self.determinant_of {
            Some(n) => ((value - best) / n as f64).exp(),
            None if value <= 0.0 => 1.0,
            None => value / best,
        };
        ratio.sqrt() - 1.0
    }
}

/// Picks so many candidates; none where any so many see too little.
///
/// The straight line a + b x with 21 places from −1 to 1: for D, measure at the ends.
///
/// ```
/// use phical::design::{Criterion, Experiment, pick};
/// use phical::problem::Execution;
/// let places: Vec<f64> = (0..=20).map(|k| f64::from(k) / 10.0 - 1.0).collect();
/// let candidates: Vec<Vec<f64>> = places.iter().map(|x| vec![1.0, *x]).collect();
/// let experiment = Experiment::new(2, &candidates, &[], &Execution::default())?;
/// let best = pick(&experiment, &Criterion::d(), 2)?.expect("two places see a line");
/// assert_eq!(best.chosen, [0, 20]);
/// assert!(best.excess() < 1e-4);
/// # Ok::<(), phical::linalg::LinalgError>(())
/// ```
///
/// # Errors
/// Where the criterion's rows do not fit.
pub fn pick(experiment: &Experiment, criterion: &Criterion, count: usize) -> Result<Option<Picked>, LinalgError> {
    let goal = Goal::new(experiment, criterion)?;
    let count = count.min(experiment.candidates());
    let sharp = if goal.is_smooth() { goal.clone() } else { goal.with_power(SHARP) };
    if count == experiment.candidates() {
        return Ok(every(experiment, &goal));
    }
    let mut first = Vec::new();
    greedy(experiment, &sharp, &mut first, count);
    let Some(relaxed) = relaxed_from(experiment, &goal, count, &first) else { return Ok(None) };

    // exchanges among what promises most, then among all
    let mut order: Vec<usize> = (0..experiment.candidates()).collect();
    order.sort_by(|&a, &b| relaxed.gains[b].total_cmp(&relaxed.gains[a]).then(a.cmp(&b)));
    let mut promising: Vec<usize> = order.iter().copied().take(PROMISING * count + 20).collect();
    promising.extend((0..relaxed.weights.len()).filter(|&i| relaxed.weights[i] > 0.0));
    promising.sort_unstable();
    promising.dedup();
    let mut second = heaviest(&relaxed.weights, count);
    let mut best: Option<(f64, Vec<usize>)> = None;
    for start in [&mut second, &mut first] {
        let value = exchange(experiment, &sharp, start, &promising);
        if best.as_ref().is_none_or(|(known, _)| value < *known) {
            best = Some((value, start.clone()));
        }
    }
    let Some((_, mut chosen)) = best else { return Ok(None) };
    let all: Vec<usize> = (0..experiment.candidates()).collect();
    exchange(experiment, &sharp, &mut chosen, &all);
    if few(all.len(), count) {
        chosen = best_of_all(experiment, &goal, count).unwrap_or(chosen);
    }
    chosen.sort_unstable();
    let Some(value) = value_of(experiment, &goal, &chosen) else { return Ok(None) };
    let determinant_of = matches!(goal, Goal::Determinant(_)).then(|| experiment.coordinates());
    Ok(Some(Picked { chosen, value, bound: relaxed.bound, weights: relaxed.weights, determinant_of }))
}

/// Whether there are no more than [`FEW`] choices of so many among all.
fn few(all: usize, count: usize) -> bool {
    // each factor of the binomial coefficient makes a whole number of the one before
    let mut choices = 1_usize;
    for k in 0..count.min(all - count) {
        choices = choices.saturating_mul(all - k) / (k + 1);
        if choices > FEW {
            return false;
        }
    }
    true
}

/// The best of all choices, in the order of candidates; none where all see too little.
fn best_of_all(experiment: &Experiment, goal: &Goal, count: usize) -> Option<Vec<usize>> {
    let all = experiment.candidates();
    let mut choice: Vec<usize> = (0..count).collect();
    let mut best: Option<(f64, Vec<usize>)> = None;
    loop {
        if let Some(value) = value_of(experiment, goal, &choice)
            && best.as_ref().is_none_or(|(known, _)| value < *known)
        {
            best = Some((value, choice.clone()));
        }
        let Some(at) = (0..count).rev().find(|&k| choice[k] < all - count + k) else { break };
        choice[at] += 1;
        (at + 1..count).for_each(|k| choice[k] = choice[k - 1] + 1);
    }
    best.map(|(_, choice)| choice)
}

/// The criterion of a design; none where it sees too little.
///
/// # Errors
/// Where the criterion's rows do not fit, or there is no such candidate.
pub fn value(experiment: &Experiment, criterion: &Criterion, chosen: &[usize]) -> Result<Option<f64>, LinalgError> {
    let expected = experiment.candidates();
    if let Some(&found) = chosen.iter().find(|&&candidate| candidate >= expected) {
        return Err(LinalgError::Shape { expected, found });
    }
    Ok(value_of(experiment, &Goal::new(experiment, criterion)?, chosen))
}

/// All candidates: there is nothing to choose.
fn every(experiment: &Experiment, goal: &Goal) -> Option<Picked> {
    let all: Vec<usize> = (0..experiment.candidates()).collect();
    let relaxed = relax(experiment, goal, all.len(), &vec![1.0; all.len()])?;
    let determinant_of = matches!(goal, Goal::Determinant(_)).then(|| experiment.coordinates());
    let Relaxed { weights, value, bound, .. } = relaxed;
    Some(Picked { chosen: all, value, bound, weights, determinant_of })
}

/// A value that no so many candidates fall below; infinite where any so many see too little.
pub(super) fn lowest(experiment: &Experiment, goal: &Goal, count: usize) -> f64 {
    // from those that promise most beside even weights: cheaper than a greedy design, and where the search begins does not matter
    let even = vec![count as f64 / experiment.candidates().max(1) as f64; experiment.candidates()];
    let inverse = experiment.weighted(&even).inverse();
    let Some(pull) = inverse.and_then(|inverse| goal.at(&inverse)) else { return f64::INFINITY };
    let start = heaviest(&experiment.seen(&pull.directions), count);
    relaxed_from(experiment, goal, count, &start).map_or(f64::INFINITY, |relaxed| relaxed.bound)
}

fn value_of(experiment: &Experiment, goal: &Goal, chosen: &[usize]) -> Option<f64> {
    let inverse = experiment.of(chosen).inverse()?;
    Some(goal.at(&inverse)?.value)
}

/// The relaxation from a design, or from even weights where the design sees too little.
fn relaxed_from(experiment: &Experiment, goal: &Goal, count: usize, design: &[usize]) -> Option<Relaxed> {
    let mut start = vec![0.0; experiment.candidates()];
    if worth(experiment, goal, design).is_finite() {
        design.iter().for_each(|&i| start[i] = 1.0);
    } else {
        start.fill(count as f64 / experiment.candidates() as f64);
    }
    relax(experiment, goal, count, &start)
}

/// The candidates with the largest weights.
fn heaviest(weights: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..weights.len()).collect();
    order.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]).then(a.cmp(&b)));
    order.truncate(count);
    order
}
