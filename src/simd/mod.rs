//! The vector instructions of the machine, found at run time.
//!
//! A build for every machine uses what the oldest one has, and loses a factor of two to five. Work that deserves better is
//! written once over [`pulp::Simd`], and [`InstructionSet::run`] runs it with the widest vectors there are. Results are
//! the same bits on every run of one instruction set; between sets, fused multiply-adds and the order of sums differ by
//! rounding.

#![allow(clippy::indexing_slicing, reason = "lengths are looked at where slices are cut")]

mod aligned;
mod arithmetic;
mod trig;

use std::sync::OnceLock;

use pulp::{Simd, WithSimd};

pub use aligned::Aligned;
pub(crate) use arithmetic::{largest_of, mul_add, neg_mul_add};
pub(crate) use trig::{near_all, near_sin_cos, sin_cos};

/// A set of vector instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstructionSet {
    /// What every processor of its kind has; no fused multiply-add.
    Baseline,
    /// x86-64-v3: four numbers at a time, fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// x86-64-v4: eight numbers at a time, fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// Two numbers at a time, fused multiply-add.
    #[cfg(target_arch = "aarch64")]
    Neon,
}

impl InstructionSet {
    /// All sets that this machine has, slowest first.
    ///
    /// ```
    /// use phical::simd::InstructionSet;
    /// assert_eq!(InstructionSet::available().first(), Some(&InstructionSet::Baseline));
    /// assert!(InstructionSet::available().contains(&InstructionSet::detect()));
    /// ```
    pub fn available() -> Vec<InstructionSet> {
        let mut found = vec![InstructionSet::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            found.extend(pulp::x86::V3::try_new().map(|_| InstructionSet::Avx2));
            found.extend(pulp::x86::V4::try_new().map(|_| InstructionSet::Avx512));
        }
        #[cfg(target_arch = "aarch64")]
        found.extend(pulp::aarch64::Neon::try_new().map(|_| InstructionSet::Neon));
        found
    }

    /// The widest set that this machine has, or the one that the environment variable `PHICAL_INSTRUCTIONS` names, where the
    /// machine has it: `baseline` gives the same bits on all machines of one architecture.
    pub fn detect() -> InstructionSet {
        static FOUND: OnceLock<InstructionSet> = OnceLock::new();
        *FOUND.get_or_init(|| {
            let available = Self::available();
            let wanted = std::env::var("PHICAL_INSTRUCTIONS").ok();
            let named = available.iter().copied().find(|set| Some(set.name()) == wanted.as_deref());
            named.or(available.last().copied()).unwrap_or(InstructionSet::Baseline)
        })
    }

    /// The set's name.
    pub fn name(self) -> &'static str {
        match self {
            InstructionSet::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => "avx512",
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => "neon",
        }
    }

    /// Does the work with this set, or, where the machine does not have it, with the baseline.
    pub fn run<W: WithSimd>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => match pulp::x86::V4::try_new() {
                Some(simd) => Simd::vectorize(simd, work),
                None => Simd::vectorize(pulp::Scalar256b, work),
            },
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => match pulp::x86::V3::try_new() {
                Some(simd) => Simd::vectorize(simd, work),
                None => Simd::vectorize(pulp::Scalar256b, work),
            },
            #[cfg(target_arch = "aarch64")]
            InstructionSet::Neon => match pulp::aarch64::Neon::try_new() {
                Some(simd) => Simd::vectorize(simd, work),
                None => Simd::vectorize(pulp::Scalar256b, work),
            },
            InstructionSet::Baseline => Simd::vectorize(pulp::Scalar256b, work),
        }
    }
}
