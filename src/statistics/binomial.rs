//! Intervals of a probability that was seen to come true k times of n.

use super::distributions::{Tail, beta_quantile, normal_quantile};

/// From `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Interval {
    /// Whether a number is in it, ends included.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// α of a confidence 1 − α, if counts and confidence are possible.
fn doubt(successes: u64, trials: u64, confidence: f64) -> Option<f64> {
    let possible = trials > 0 && successes <= trials && confidence > 0.0 && confidence < 1.0;
    possible.then_some(1.0 - confidence)
}

/// Wilson's interval of a probability, of which `confidence` is the mean coverage, nearly:
///
/// > (p̂ + z²/2n ± z √(p̂(1−p̂)/n + z²/4n²)) / (1 + z²/n),  p̂ = k/n,  z the normal quantile of 1 − α/2
///
/// E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209; recommended by Brown, Cai & DasGupta, Stat. Sci. 16 (2001), 101. None
/// where there are no trials, more successes than trials, or the confidence is not within (0, 1).
pub fn wilson(successes: u64, trials: u64, confidence: f64) -> Option<Interval> {
    let alpha = doubt(successes, trials, confidence)?;
    let z = normal_quantile(Tail::Upper(0.5 * alpha))?;
    let (k, n) = (successes as f64, trials as f64);
    let centre = k + 0.5 * z * z;
    let half = z * (k * ((n - k) / n) + 0.25 * z * z).sqrt();
    let low = if successes == 0 { 0.0 } else { (centre - half) / (n + z * z) };
    let high = if successes == trials { 1.0 } else { (centre + half) / (n + z * z) };
    Some(Interval { low, high })
}

/// The interval of Clopper & Pearson, Biometrika 26 (1934), 404, which covers with at least `confidence`, whatever the
/// probability: below `low` k or more successes, and above `high` k or fewer, are less probable than α/2.
///
/// > low = I⁻¹(α/2; k, n − k + 1),  high = I⁻¹(1 − α/2; k + 1, n − k),  I the regularised incomplete beta function
///
/// None where there are no trials, more successes than trials, or the confidence is not within (0, 1).
pub fn clopper_pearson(successes: u64, trials: u64, confidence: f64) -> Option<Interval> {
    let alpha = doubt(successes, trials, confidence)?;
    let (k, n) = (successes as f64, trials as f64);
    let low = match successes {
        0 => 0.0,
        _ => beta_quantile(Tail::Lower(0.5 * alpha), k, n - k + 1.0)?,
    };
    let high = match trials - successes {
        0 => 1.0,
        _ => beta_quantile(Tail::Upper(0.5 * alpha), k + 1.0, n - k)?,
    };
    Some(Interval { low, high })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::tests::close;

    /// P(at least k of n), by its definition.
    fn at_least(k: u64, n: u64, p: f64) -> f64 {
        let mut choose = 1.0;
        let mut sum = 0.0;
        for j in 0..=n {
            if j >= k {
                sum += choose * p.powi(j as i32) * (1.0 - p).powi((n - j) as i32);
            }
            choose *= (n - j) as f64 / (j + 1) as f64;
        }
        sum
    }

    #[test]
    fn clopper_and_pearson_by_direct_sums() {
        for (k, n) in [(1, 1), (1, 10), (3, 10), (9, 10), (25, 60), (57, 60)] {
            for confidence in [0.5, 0.9, 0.95, 0.999] {
                let Interval { low, high } = clopper_pearson(k, n, confidence).unwrap();
                let half = 0.5 * (1.0 - confidence);
                close(at_least(k, n, low) / half, 1.0, 1e-11);
                if k < n {
                    close((1.0 - at_least(k + 1, n, high)) / half, 1.0, 1e-10);
                }
            }
        }
    }

    #[test]
    fn none_of_n_has_a_closed_form() {
        // (α/2)^(1/n): 3/n nearly, where α is 0.1
        for n in [1u64, 20, 1000, 1_000_000] {
            let found = clopper_pearson(0, n, 0.95).unwrap();
            close(found.high, -(0.025f64.ln() / n as f64).exp_m1(), 1e-14);
            assert_eq!(found.low, 0.0);
            let mirrored = clopper_pearson(n, n, 0.95).unwrap();
            close(mirrored.low, (0.025f64.ln() / n as f64).exp(), 1e-14);
            assert_eq!(mirrored.high, 1.0);
        }
    }

    /// The ends of Wilson's interval are where the normal test of p just rejects: (p̂ − p)² = z² p(1 − p)/n.
    #[test]
    fn wilson_inverts_the_score_test() {
        for (k, n) in [(0, 5), (1, 10), (81, 263), (15, 148), (950, 1000), (5, 5)] {
            let z = normal_quantile(Tail::Upper(0.025)).unwrap();
            let found = wilson(k, n, 0.95).unwrap();
            let share = k as f64 / n as f64;
            for end in [found.low, found.high] {
                if (0.0..1.0).contains(&end) && end > 0.0 {
                    close((share - end).powi(2), z * z * end * (1.0 - end) / n as f64, 1e-14);
                }
            }
            assert!(found.contains(share));
        }
    }

    /// R. G. Newcombe, Statistics in Medicine 17 (1998), 857, Table I: methods 3 (score) and 5 (exact).
    #[test]
    fn examples_of_newcombe() {
        let rounded = |i: Interval| [(i.low * 1e4).round() / 1e4, (i.high * 1e4).round() / 1e4];
        assert_eq!(rounded(wilson(81, 263, 0.95).unwrap()), [0.2553, 0.3662]);
        assert_eq!(rounded(wilson(15, 148, 0.95).unwrap()), [0.0624, 0.1605]);
        assert_eq!(rounded(wilson(0, 20, 0.95).unwrap()), [0.0, 0.1611]);
        assert_eq!(rounded(wilson(1, 29, 0.95).unwrap()), [0.0061, 0.1718]);
        assert_eq!(rounded(clopper_pearson(81, 263, 0.95).unwrap()), [0.2527, 0.3676]);
        assert_eq!(rounded(clopper_pearson(15, 148, 0.95).unwrap()), [0.0578, 0.1617]);
        assert_eq!(rounded(clopper_pearson(0, 20, 0.95).unwrap()), [0.0, 0.1684]);
        assert_eq!(rounded(clopper_pearson(1, 29, 0.95).unwrap()), [0.0009, 0.1776]);
    }

    #[test]
    fn impossible_counts_are_none() {
        for (k, n, confidence) in [(0, 0, 0.95), (2, 1, 0.95), (1, 2, 0.0), (1, 2, 1.0), (1, 2, f64::NAN)] {
            assert_eq!(wilson(k, n, confidence), None);
            assert_eq!(clopper_pearson(k, n, confidence), None);
        }
    }
}
