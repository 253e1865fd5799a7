//! Options of starting far away.

use clap::Args;

use crate::session::{Far, MultiStart};

#[derive(Debug, Args)]
pub(super) struct FromAfar {
    /// Start from so many points, the declared one and others within the bounds and priors, and report the best minimum
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    starts: Option<u32>,
    /// Which starts are drawn
    #[arg(long, value_name = "S", default_value_t = 1, requires = "starts")]
    seed: u64,
    /// Lead the readings from those that the start explains to those that were made, and the solution with them
    #[arg(long)]
    continuation: bool,
}

impl FromAfar {
    pub(super) fn far(&self) -> Far {
        let starts = self.starts.map(|starts| MultiStart { starts: starts as usize, seed: self.seed });
        Far { starts, continuation: self.continuation }
    }

    pub(super) fn starts(&self) -> Option<u32> {
        self.starts
    }

    /// Where it matters.
    pub(super) fn seed(&self) -> Option<u64> {
        self.starts.map(|_| self.seed)
    }

    pub(super) fn continuation(&self) -> bool {
        self.continuation
    }
}
