//! Rounds in which every peer has its turn, and the machine's peak.

use std::hint::black_box;
use std::time::{Duration, Instant};

use phical::simd::InstructionSet;
use pulp::{Simd, WithSimd};

/// Something that goes once through all lines.
pub(crate) struct Peer<'a> {
    pub(crate) name: String,
    /// The published time in ns per line, where there is one, on a machine of [`PUBLISHED_PEAK`].
    pub(crate) published: Option<f64>,
    pub(crate) pass: Pass<'a>,
}

/// How a peer is timed.
pub(crate) enum Pass<'a> {
    /// It runs here.
    Here(Box<dyn FnMut() + 'a>),
    /// It runs elsewhere, and says how many ns a line took.
    Elsewhere(Box<dyn FnMut() -> f64 + 'a>),
}

impl<'a> Peer<'a> {
    pub(crate) fn new(name: impl Into<String>, published: Option<f64>, pass: impl FnMut() + 'a) -> Self {
        Peer { name: name.into(), published, pass: Pass::Here(Box::new(pass)) }
    }

    pub(crate) fn elsewhere(name: impl Into<String>, time: impl FnMut() -> f64 + 'a) -> Self {
        Peer { name: name.into(), published: None, pass: Pass::Elsewhere(Box::new(time)) }
    }
}

/// GFLOP/s of the machine of the published times.
pub(crate) const PUBLISHED_PEAK: f64 = 122.0;

/// At least this long is one measurement.
const LEAST: Duration = Duration::from_millis(2);

/// ns per line of every peer, by peer and round. Peers take turns, so that what disturbs the machine disturbs all of them.
pub(crate) fn measure(peers: &mut [Peer], lines: usize, rounds: usize) -> Vec<Vec<f64>> {
    let mut times = vec![Vec::new(); peers.len()];
    for _ in 0..rounds {
        for (peer, times) in peers.iter_mut().zip(&mut times) {
            let pass = match &mut peer.pass {
                Pass::Here(pass) => pass,
                Pass::Elsewhere(time) => {
                    times.push(time());
                    continue;
                }
            };
            pass();
            let start = Instant::now();
            let mut passes = 0u32;
            while start.elapsed() < LEAST {
                pass();
                passes += 1;
            }
            times.push(start.elapsed().as_secs_f64() * 1e9 / f64::from(passes) / lines as f64);
        }
    }
    times
}

/// The middle one.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

/// Independent multiply-adds: enough to keep two units of six steps busy.
struct MultiplyAdds(usize);

/// As many as have registers.
const CHAINS: usize = 12;

impl WithSimd for MultiplyAdds {
    type Output = f64;

    /// Floating-point operations.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let [a, b, one] = [0.999, 0.001, 1.0].map(|x| simd.splat_f64s(black_box(x)));
        let mut sums = [one; CHAINS];
        for _ in 0..self.0 {
            sums = sums.map(|sum| simd.mul_add_f64s(sum, a, b));
        }
        black_box(sums.map(|sum| simd.reduce_sum_f64s(sum)));
        (self.0 * CHAINS * 2 * S::F64_LANES) as f64
    }
}

impl MultiplyAdds {
    /// For the baseline, whose fused multiply-add would be a call: products and sums, in vectors as the compiler sees fit.
    fn by_compiler(&self) -> f64 {
        let (a, b) = (black_box(0.999), black_box(0.001));
        let mut sums = [black_box(1.0); 2 * CHAINS];
        for _ in 0..self.0 {
            for sum in &mut sums {
                *sum = *sum * a + b;
            }
        }
        black_box(sums);
        (self.0 * sums.len() * 2) as f64
    }
}

/// GFLOP/s of one core: the best of some short runs.
pub(crate) fn peak(set: InstructionSet) -> f64 {
    let run = || {
        let start = Instant::now();
        let work = MultiplyAdds(black_box(200_000));
        let operations = if set == InstructionSet::Baseline { work.by_compiler() } else { set.run(work) };
        operations / start.elapsed().as_secs_f64() * 1e-9
    };
    (0..20).map(|_| run()).fold(0.0, f64::max)
}

/// What the bench itself was built for.
pub(crate) fn built_for() -> InstructionSet {
    #[cfg(target_feature = "avx512f")]
    return InstructionSet::Avx512;
    #[cfg(all(target_feature = "avx2", target_feature = "fma", not(target_feature = "avx512f")))]
    return InstructionSet::Avx2;
    #[cfg(target_arch = "aarch64")]
    return InstructionSet::Neon;
    #[cfg(not(any(
        target_feature = "avx512f",
        all(target_feature = "avx2", target_feature = "fma"),
        target_arch = "aarch64"
    )))]
    InstructionSet::Baseline
}
