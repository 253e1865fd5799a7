//! How many rows reach what is required.

use super::criterion::{Criterion, Goal};
use super::experiment::Experiment;
use super::search::{Picked, lowest, pick};
use crate::linalg::LinalgError;

/// How many rows are needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Whether any number of the candidates is enough.
    pub reached: bool,
    /// No fewer are enough, whichever they are.
    pub least: usize,
}

/// The smallest number of candidates found with which a criterion is one or less, and how few could be enough at best; with all
/// candidates where not even these are.
///
/// The relaxation's value falls with N, for further weight only adds information, so the largest N whose lower bound is above one is found by
/// halving; one more is the least possible. From there on designs are made until one is good enough.
pub(super) fn reach(experiment: &Experiment, criterion: &Criterion) -> Result<(Option<Picked>, Reach), LinalgError> {
    let goal = Goal::new(experiment, criterion)?;
    let all = experiment.candidates();
    let every = pick(experiment, criterion, all)?;
    if every.as_ref().is_none_or(|picked| picked.value > 1.0) {
        return Ok((every, Reach { reached: false, least: all }));
    }
    // too few, and perhaps enough
    let (mut low, mut high) = (0, all);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        *(if lowest(experiment, &goal, middle) > 1.0 { &mut low } else { &mut high }) = middle;
    }
    let least = high;
    // as many more as it takes, then back to the fewest
    let enough = |count: usize| Ok::<_, LinalgError>(pick(experiment, criterion, count)?.filter(|p| p.value <= 1.0));
    let (mut failed, mut step) = (least - 1, 1);
    let mut best = loop {
        let count = (failed + step).min(all);
        if let Some(found) = enough(count)? {
            break found;
        }
        if count == all {
            return Ok((every, Reach { reached: true, least }));
        }
        failed = count;
        // one by one at first: the bound is close
        step = if failed < least + 3 { 1 } else { 2 * step };
    };
    while best.chosen.len() > failed + 1 {
        let middle = failed + (best.chosen.len() - failed) / 2;
        match enough(middle)? {
            Some(found) => best = found,
            None => failed = middle,
        }
    }
    Ok((Some(best), Reach { reached: true, least }))
}
