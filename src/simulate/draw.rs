//! Random streams, one for each purpose.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

use crate::compile::{Distribution, KeyDistribution};

/// The random numbers of one purpose.
#[derive(Debug)]
pub(crate) struct Stream {
    random: ChaCha8Rng,
}

impl Stream {
    /// The stream of a purpose.
    pub(crate) fn new(seed: u64, purpose: &str) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number(purpose));
        Stream { random }
    }

    /// The number of row `row`.
    pub(super) fn draw(&mut self, distribution: &Distribution, row: usize) -> f64 {
        match distribution {
            Distribution::Constant(value) => *value,
            Distribution::Uniform(low, high) => {
                let share = self.random.random::<f64>();
                low * (1.0 - share) + high * share
            }
            Distribution::Normal(mean, sigma) => mean + sigma * self.normal(),
            Distribution::Cycle(all) => cycle(all, row).copied().unwrap_or(0.0),
            Distribution::Choice(all) => self.choice(all).copied().unwrap_or(0.0),
        }
    }

    /// The name of row `row`.
    pub(super) fn name<'d>(&mut self, distribution: &'d KeyDistribution, row: usize) -> &'d str {
        match distribution {
            KeyDistribution::Cycle(all) => cycle(all, row),
            KeyDistribution::Choice(all) => self.choice(all),
        }
        .map_or("", String::as_str)
    }

    /// A number of the standard normal distribution.
    pub(crate) fn normal(&mut self) -> f64 {
        self.random.sample(StandardNormal)
    }

    /// A number from 0 to 1.
    pub(crate) fn share(&mut self) -> f64 {
        self.random.random()
    }

    /// The numbers below `count` in a random order (Fisher & Yates; Durstenfeld 1964).
    pub(crate) fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for last in (1..count).rev() {
            // by 64 bits, so that machines of any word size agree
            let other = self.random.random_range(0..=last as u64) as usize;
            order.swap(last, other);
        }
        order
    }

    fn choice<'d, T>(&mut self, all: &'d [T]) -> Option<&'d T> {
        if all.is_empty() {
            return None;
        }
        // by 64 bits, so that machines of any word size agree
        let at = self.random.random_range(0..all.len() as u64);
        all.get(at as usize)
    }
}

fn cycle<T>(all: &[T], row: usize) -> Option<&T> {
    all.get(row.checked_rem(all.len())?)
}

/// The number of a purpose: its FNV-1a hash (Fowler, Noll, Vo; 64 bits), which no release of Rust changes.
fn number(purpose: &str) -> u64 {
    purpose.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_seed_and_purpose_only() {
        let first = |seed, purpose| Stream::new(seed, purpose).draw(&Distribution::Uniform(0.0, 1.0), 0);
        assert_eq!(first(1, "a"), first(1, "a"));
        assert_ne!(first(1, "a"), first(2, "a"));
        assert_ne!(first(1, "a"), first(1, "b"));
        assert_eq!(number("foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn distributions_are_what_they_say() {
        let n = 20_000;
        let drawn = |distribution: Distribution| {
            let mut stream = Stream::new(7, "x");
            (0..n).map(|row| stream.draw(&distribution, row)).collect::<Vec<f64>>()
        };
        let moments = |all: &[f64]| {
            let mean = all.iter().sum::<f64>() / n as f64;
            (mean, (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64).sqrt())
        };
        let (mean, sigma) = moments(&drawn(Distribution::Normal(3.0, 2.0)));
        assert!((mean - 3.0).abs() < 0.05 && (sigma - 2.0).abs() < 0.04, "{mean} {sigma}");
        let uniform = drawn(Distribution::Uniform(-1.0, 3.0));
        let (mean, sigma) = moments(&uniform);
        assert!((mean - 1.0).abs() < 0.04 && (sigma - 4.0 / 12.0_f64.sqrt()).abs() < 0.02, "{mean} {sigma}");
        assert!(uniform.iter().all(|x| (-1.0..=3.0).contains(x)));
        assert_eq!(drawn(Distribution::Cycle(vec![1.0, 2.0, 3.0]))[..4], [1.0, 2.0, 3.0, 1.0]);
        let chosen = drawn(Distribution::Choice(vec![1.0, 2.0]));
        assert!((moments(&chosen).0 - 1.5).abs() < 0.02);
    }
}
