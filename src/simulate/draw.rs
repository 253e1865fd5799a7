//! Random streams, one for each purpose.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

use crate::compile::{Distribution, KeyDistribution};

/// The random numbers of one purpose.
#[derive(Debug)]
pub(crate) struct Stream {
    random: ChaCha8Rng,
    /// what was drawn last
    last: f64,
    /// which name was drawn last
    last_name: usize,
}

impl Stream {
    /// The stream of a purpose.
    pub(crate) fn new(seed: u64, purpose: &str) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number(purpose));
        Stream { random, last: 0.0, last_name: 0 }
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
            Distribution::Around(sigma) => sigma * self.normal(),
            Distribution::Cycle(all) => cycle(all, row).copied().unwrap_or(0.0),
            Distribution::Choice(all) => self.choice(all.len()).and_then(|at| all.get(at)).copied().unwrap_or(0.0),
            Distribution::Each(rows, drawn) => {
                let rows = (*rows).max(1);
                if row.is_multiple_of(rows) {
                    self.last = self.draw(drawn, row / rows);
                }
                self.last
            }
        }
    }

    /// The name of row `row`.
    pub(super) fn name<'d>(&mut self, distribution: &'d KeyDistribution, row: usize) -> &'d str {
        let (all, at) = match distribution {
            KeyDistribution::Cycle(all) => return cycle(all, row).map_or("", String::as_str),
            KeyDistribution::Choice(all) => {
                self.last_name = self.choice(all.len()).unwrap_or(0);
                (all, self.last_name)
            }
            KeyDistribution::Each(rows, drawn) => {
                let rows = (*rows).max(1);
                match &**drawn {
                    KeyDistribution::Choice(all) if !row.is_multiple_of(rows) => (all, self.last_name),
                    drawn => return self.name(drawn, row / rows),
                }
            }
        };
        all.get(at).map_or("", String::as_str)
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

    /// One of so many.
    fn choice(&mut self, count: usize) -> Option<usize> {
        // by 64 bits, so that machines of any word size agree
        (count > 0).then(|| self.random.random_range(0..count as u64) as usize)
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
        let threes = drawn(Distribution::Each(3, Box::new(Distribution::Cycle(vec![1.0, 2.0]))));
        assert_eq!(threes[..8], [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0]);
        let fives = drawn(Distribution::Each(5, Box::new(Distribution::Normal(0.0, 1.0))));
        assert!(fives.chunks(5).all(|five| five.iter().all(|x| *x == five[0])) && fives[0] != fives[5]);
        let mut stream = Stream::new(7, "x");
        let all = KeyDistribution::Choice(vec!["a".into(), "b".into(), "c".into()]);
        let fours = KeyDistribution::Each(4, Box::new(all));
        let names: Vec<&str> = (0..400).map(|row| stream.name(&fours, row)).collect();
        assert!(names.chunks(4).all(|four| four.iter().all(|name| *name == four[0])));
        assert!(["a", "b", "c"].iter().all(|name| names.contains(name)));
        let chosen = drawn(Distribution::Choice(vec![1.0, 2.0]));
        assert!((moments(&chosen).0 - 1.5).abs() < 0.02);
    }
}
