//! Errors counted against what was said of them.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use crate::statistics::{Interval, Moments, clopper_pearson, wilson};

/// A coverage within these bounds is as good as the 95 % that an interval promises.
pub const HONEST: RangeInclusive<f64> = 0.925..=0.975;
/// How sure a coverage has to be outside them before it counts against the intervals.
pub const LEAST_DOUBT: f64 = 0.999;
/// A bias of so many of its standard errors is no chance.
pub const CERTAIN: f64 = 4.0;
/// A bias of this share of the spread hardly matters.
pub const SMALL: f64 = 0.1;
/// The level of the interval of a coverage that is shown.
const SHOWN: f64 = 0.95;

/// An error and its uncertainty.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    pub(super) error: f64,
    /// none where nothing is said of it
    pub(super) sigma: Option<f64>,
    /// standard uncertainties to either side of the interval
    pub(super) factor: f64,
}

/// What one run says of a quantity, once or in several rows; nothing where it should have said something and did not.
pub(super) struct Told {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) trials: Vec<Option<Trial>>,
    /// whether the run could determine it; none where the run failed
    pub(super) estimable: Option<bool>,
}

/// How often an interval held the truth, beside how often it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Consistency {
    /// As often, as far as the number of runs can tell.
    Honest,
    /// Too seldom.
    TooSeldom,
    /// Too often.
    TooOften,
}

impl Consistency {
    /// `honest`, `too_seldom` or `too_often`.
    pub fn name(self) -> &'static str {
        match self {
            Consistency::Honest => "honest",
            Consistency::TooSeldom => "too_seldom",
            Consistency::TooOften => "too_often",
        }
    }
}

/// A parameter or a predicted output over all runs, in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The mean of estimate − truth.
    pub bias: Option<f64>,
    /// The standard error of that mean.
    pub bias_error: Option<f64>,
    /// The standard deviation of estimate − truth.
    pub actual: Option<f64>,
    /// The root mean square of the stated standard uncertainties.
    pub predicted: Option<f64>,
    /// The share of intervals that held the truth; a missing interval did not.
    pub coverage: f64,
    /// The interval of that share (Wilson, 95 %).
    pub interval: Interval,
    /// Whether it is consistent with what was promised.
    pub consistency: Consistency,
    /// Runs in which it occurs.
    pub runs: u64,
    /// Intervals: one for each run, or for each run and row.
    pub intervals: u64,
    /// Intervals that are missing, because a run failed or could not tell.
    pub missing: u64,
}

impl Quantity {
    /// Its bias by its predicted spread, where that is beyond doubt and matters: more than [`CERTAIN`] of its standard
    /// errors and more than [`SMALL`].
    pub fn notable_bias(&self) -> Option<f64> {
        let bias = self.bias.zip(self.bias_error).filter(|(bias, error)| bias.abs() > CERTAIN * error)?.0;
        let share = bias / self.predicted.filter(|predicted| *predicted > 0.0)?;
        (share.abs() > SMALL).then_some(share)
    }

    /// Actual over predicted spread.
    pub fn ratio(&self) -> Option<f64> {
        Some(self.actual? / self.predicted.filter(|predicted| *predicted > 0.0)?)
    }
}

/// Quantities by name, in the order of their first appearance.
#[derive(Default)]
pub(super) struct Tallies {
    all: Vec<Tally>,
    known: HashMap<String, usize>,
}

#[derive(Default)]
struct Tally {
    name: String,
    unit: String,
    errors: Moments,
    /// the mean error of each run
    means: Moments,
    /// Σ σ² and how many
    variances: (f64, u64),
    runs: u64,
    intervals: u64,
    held: u64,
    missing: u64,
    /// Σ h², Σ h n, Σ n² over runs with n intervals of which h held the truth
    clusters: [f64; 3],
    /// runs that say they can, and that they cannot, determine it
    seen: u64,
    unseen: u64,
}

impl Tallies {
    pub(super) fn add(&mut self, run: Vec<Told>) {
        for told in run {
            let next = self.all.len();
            let at = *self.known.entry(told.name.clone()).or_insert(next);
            if at == next {
                let (name, unit) = (told.name.clone(), told.unit.clone());
                self.all.push(Tally { name, unit, ..Tally::default() });
            }
            if let Some(tally) = self.all.get_mut(at) {
                tally.add(&told);
            }
        }
    }

    /// All that was told of, and the names of those that nothing could be.
    pub(super) fn finish(self) -> (Vec<Quantity>, Vec<String>) {
        let (mut quantities, mut blind) = (Vec::new(), Vec::new());
        for tally in self.all {
            if tally.unseen > 0 && tally.seen == 0 {
                blind.push(tally.name);
            } else {
                quantities.extend(tally.finish());
            }
        }
        (quantities, blind)
    }
}

impl Tally {
    fn add(&mut self, told: &Told) {
        match told.estimable {
            Some(true) => self.seen += 1,
            Some(false) => self.unseen += 1,
            None => {}
        }
        if told.trials.is_empty() {
            return;
        }
        let (mut sum, mut count, mut held) = (0.0, 0u64, 0u64);
        for trial in &told.trials {
            let Some(Trial { error, sigma, factor }) = *trial else {
                self.missing += 1;
                continue;
            };
            self.errors.push(error);
            sum += error;
            count += 1;
            match sigma {
                Some(sigma) => {
                    self.variances.0 += sigma * sigma;
                    self.variances.1 += 1;
                    held += u64::from(error.abs() <= factor * sigma);
                }
                None => self.missing += 1,
            }
        }
        if count > 0 {
            self.means.push(sum / count as f64);
        }
        let n = told.trials.len() as u64;
        self.runs += 1;
        self.intervals += n;
        self.held += held;
        let (h, n) = (held as f64, n as f64);
        for (sum, product) in self.clusters.iter_mut().zip([h * h, h * n, n * n]) {
            *sum += product;
        }
    }

    /// How many independent intervals tell as much: those of one run share its parameters. The number of intervals over the
    /// design effect, n/deff with
    ///
    /// > deff = (c/(c − 1)) Σ (h − p n)² / (n p (1 − p)) ≥ 1  over c runs (Kish, Survey Sampling, 1965, §5.4)
    fn effective(&self) -> u64 {
        let (n, c) = (self.intervals as f64, self.runs as f64);
        let p = self.held as f64 / n;
        let spread = n * p * (1.0 - p);
        if self.intervals == self.runs || self.runs < 2 || spread <= 0.0 {
            return self.runs;
        }
        let [hh, hn, nn] = self.clusters;
        let effect = c / (c - 1.0) * (hh - 2.0 * p * hn + p * p * nn) / spread;
        ((n / effect.max(1.0)).round() as u64).max(1)
    }

    fn finish(self) -> Option<Quantity> {
        let coverage = if self.intervals > 0 { self.held as f64 / self.intervals as f64 } else { return None };
        let n = self.effective();
        let k = ((coverage * n as f64).round() as u64).min(n);
        let certain = clopper_pearson(k, n, LEAST_DOUBT)?;
        let consistency = if certain.high < *HONEST.start() {
            Consistency::TooSeldom
        } else if certain.low > *HONEST.end() {
            Consistency::TooOften
        } else {
            Consistency::Honest
        };
        let predicted = (self.variances.1 > 0).then(|| (self.variances.0 / self.variances.1 as f64).sqrt());
        Some(Quantity {
            interval: wilson(k, n, SHOWN)?,
            bias: self.errors.mean(),
            bias_error: self.means.deviation().map(|sd| sd / self.means.count().sqrt()),
            actual: self.errors.deviation(),
            predicted,
            coverage,
            consistency,
            runs: self.runs,
            intervals: self.intervals,
            missing: self.missing,
            name: self.name,
            unit: self.unit,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(trials: Vec<Option<Trial>>) -> Vec<Told> {
        vec![Told { name: "a".into(), unit: "mm".into(), trials, estimable: Some(true) }]
    }

    fn trial(error: f64) -> Option<Trial> {
        Some(Trial { error, sigma: Some(1.0), factor: 2.0 })
    }

    fn one(tallies: Tallies) -> Quantity {
        tallies.finish().0.remove(0)
    }

    #[test]
    fn errors_and_misses_are_counted() {
        let mut tallies = Tallies::default();
        for error in [-1.0, 3.0, 1.0] {
            tallies.add(told(vec![trial(error)]));
        }
        tallies.add(told(vec![None]));
        let found = one(tallies);
        assert_eq!((found.bias, found.actual, found.predicted), (Some(1.0), Some(2.0), Some(1.0)));
        assert_eq!(found.bias_error, Some(2.0 / 3f64.sqrt()));
        assert_eq!((found.coverage, found.runs, found.missing, found.ratio()), (0.5, 4, 1, Some(2.0)));
    }

    #[test]
    fn rows_that_err_together_count_as_one() {
        let (mut together, mut apart) = (Tallies::default(), Tallies::default());
        for run in 0..400usize {
            let held = |row: usize| trial(if (run + row).is_multiple_of(10) { 5.0 } else { 0.0 });
            together.add(told(vec![held(0); 10]));
            apart.add(told((0..10).map(held).collect()));
        }
        let (together, apart) = (together.all.remove(0), apart.all.remove(0));
        assert_eq!((together.intervals, apart.intervals), (4000, 4000));
        assert_eq!((together.held, apart.held), (3600, 3600));
        assert!((399..=400).contains(&together.effective()), "{}", together.effective());
        assert_eq!(apart.effective(), 4000);
        assert_eq!(together.finish().unwrap().consistency, Consistency::Honest);
        assert_eq!(apart.finish().unwrap().consistency, Consistency::TooSeldom);
    }

    #[test]
    fn what_is_always_held_by_many_is_too_much() {
        let mut tallies = Tallies::default();
        (0..1000).for_each(|_| tallies.add(told(vec![trial(0.0)])));
        assert_eq!(one(tallies).consistency, Consistency::TooOften);
    }

    #[test]
    fn what_no_run_can_tell_is_blind_and_what_all_fail_is_missed() {
        let with = |estimable| vec![Told { trials: vec![None], estimable, ..told(Vec::new()).remove(0) }];
        let mut tallies = Tallies::default();
        tallies.add(with(Some(false)));
        tallies.add(with(None));
        assert_eq!(tallies.finish(), (vec![], vec!["a".to_owned()]));
        let mut tallies = Tallies::default();
        tallies.add(with(None));
        assert_eq!(one(tallies).coverage, 0.0);
    }
}
