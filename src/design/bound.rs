//! How good any design can be at best: weak duality.
//!
//! For any vectors y and M ⪰ 0, t M⁻¹ tᵀ ≥ 2 t y − yᵀ M y. Summed over the rows of T with the columns of any Y, and with the largest sum
//! that N weights 0 ≤ wᵢ ≤ 1 can give, this is a lower bound of tr(T M⁻¹ Tᵀ) for every choice of N candidates, relaxed or not;
//! at the best length of Y it is
//!
//! > tr(T Y)² / (‖A₀ Y‖² + Σ of the N largest ‖Aᵢ Y‖²)          (1)
//!
//! It is as large as the trace where Y = M⁻¹Tᵀ of the best relaxed weights. E and the largest of several traces are at least tr(Z V)/tr Z for
//! any Z ⪰ 0, so (1) with Z^½ T, over tr Z, bounds them too. For D the concave log det lies below its tangents: for any X ≻ 0
//!
//! > log det M ≤ n log(b/n) − log det X,  b = tr(X M₀) + Σ of the N largest tr(X Mᵢ)          (2)
//!
//! (Boyd & Vandenberghe, Convex Optimization, 2004, 7.5.2; Joshi & Boyd, IEEE Trans. Signal Process. 57 (2009) 451.) Any Y or X gives
//! a bound that holds: how it was found, and how far that search converged, does not matter, and rounding matters only in the sums
//! themselves, for which a margin is left.

use super::criterion::{Goal, Pull};
use super::experiment::{Experiment, Inverse, products};

/// The share of a bound that is left for rounding: sums of some 10⁵ squares lose 10⁻¹¹ at most.
const MARGIN: f64 = 1e-9;

/// A value that φ cannot fall below with so many candidates; `pull` belongs to `inverse`.
pub(super) fn bound(
    experiment: &Experiment,
    goal: &Goal,
    inverse: &Inverse,
    pull: &Pull,
    seen: &[f64],
    count: usize,
) -> f64 {
    let mut most = seen.to_vec();
    most.sort_by(|a, b| b.total_cmp(a));
    let all = experiment.seen_beforehand(&pull.directions) + most.iter().take(count).sum::<f64>();
    if let Goal::Determinant(shift) = goal {
        let n = experiment.coordinates() as f64;
        return shift - (inverse.log_determinant + n * (all / n).ln()) - n * MARGIN;
    }
    let n = experiment.coordinates();
    let lines = pull.wanted.chunks_exact(n).zip(pull.directions.chunks_exact(n));
    let trace: f64 = lines.map(|(t, y)| products(n, t, y)[0]).sum();
    if all > 0.0 { trace * trace / all / pull.size * (1.0 - MARGIN) } else { 0.0 }
}
