//! How far a standard uncertainty that was itself estimated can be trusted: Guide to the Expression of Uncertainty in
//! Measurement (JCGM 100:2008), annex G.

use super::distributions::{Tail, t_quantile};

/// The effective degrees of freedom of a sum of independent contributions, each a standard uncertainty *uᵢ* (sensitivity
/// included) with *νᵢ* degrees of freedom, by the formula of Welch and Satterthwaite (GUM G.4.1):
///
/// > ν_eff = u_c⁴ / Σ uᵢ⁴/νᵢ,  u_c² = Σ uᵢ²
///
/// A contribution that is known exactly (type B) has infinitely many. The result is infinite where all that contribute have;
/// the Guide takes the next lower integer where only tables are at hand. None where nothing contributes, where an
/// uncertainty is negative or not finite, or where degrees of freedom are not positive.
pub fn effective_dof(contributions: &[(f64, f64)]) -> Option<f64> {
    let possible = contributions.iter().all(|(u, dof)| *u >= 0.0 && u.is_finite() && *dof > 0.0);
    // fourth powers may be beyond the numbers
    let largest = contributions.iter().fold(0.0, |largest: f64, (u, _)| largest.max(*u));
    if !possible || largest == 0.0 {
        return None;
    }
    let shares = contributions.iter().map(|(u, dof)| ((u / largest).powi(2), dof));
    let (variance, fourth) = shares
        .fold((0.0, 0.0), |(variance, fourth), (square, dof)| (variance + square, fourth + square * square / dof));
    Some(variance * variance / fourth)
}

/// The factor *k_p* by which to multiply a standard uncertainty with `dof` degrees of freedom for an interval of `confidence`
/// *p* (GUM G.3.4): the quantile of Student's t at (1 + p)/2. None where p is not within (0, 1), or `dof` ≤ 0.
pub fn coverage_factor(confidence: f64, dof: f64) -> Option<f64> {
    let possible = confidence > 0.0 && confidence < 1.0;
    possible.then(|| t_quantile(Tail::Upper(0.5 * (1.0 - confidence)), dof)).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::tests::{close, relatively_close};

    /// GUM G.4.1: three contributions in percent, from 10, 5 and 15 observations.
    #[test]
    fn the_example_of_the_guide() {
        let found = effective_dof(&[(0.25, 9.0), (0.57, 4.0), (0.82, 14.0)]).unwrap();
        close((found * 10.0).round() / 10.0, 19.0, 0.0);
    }

    /// GUM H.1.6: the end gauge; u_c is 32 nm, and 2.92 × 32 nm covers 99 percent.
    #[test]
    fn the_end_gauge() {
        let found = effective_dof(&[(25.0, 18.0), (9.7, 25.6), (2.9, 50.0), (16.6, 2.0)]).unwrap();
        close((found * 10.0).round() / 10.0, 16.7, 0.5 / 16.7);
        close((coverage_factor(0.99, found.floor()).unwrap() * 100.0).round() / 100.0, 2.92, 1e-12);
    }

    #[test]
    fn equal_contributions_add_and_scale_does_not_matter() {
        for scale in [1e-200, 1.0, 1e200] {
            relatively_close(effective_dof(&[(scale, 5.0); 4]).unwrap(), 20.0, 1e-14);
        }
        assert_eq!(effective_dof(&[(3.0, 7.0), (0.0, 1.0)]), Some(7.0));
    }

    #[test]
    fn what_is_known_exactly_counts_only_as_variance() {
        let infinite = f64::INFINITY;
        assert_eq!(effective_dof(&[(1.0, infinite), (2.0, infinite)]), Some(infinite));
        relatively_close(effective_dof(&[(1.0, 4.0), (1.0, infinite)]).unwrap(), 16.0, 1e-14);
    }

    /// GUM Table G.2, some of its entries.
    #[test]
    fn coverage_factors_of_the_guide() {
        for (dof, percent, factor) in [
            (1.0, 95.45, 13.97),
            (1.0, 68.27, 1.84),
            (2.0, 99.73, 19.21),
            (4.0, 95.0, 2.78),
            (10.0, 95.45, 2.28),
            (20.0, 99.0, 2.85),
            (50.0, 99.73, 3.16),
            (100.0, 90.0, 1.660),
            (f64::INFINITY, 95.45, 2.0),
            (f64::INFINITY, 99.73, 3.0),
        ] {
            let found = coverage_factor(percent / 100.0, dof).unwrap();
            assert!((found - factor).abs() < 6e-3, "{found} instead of {factor}");
        }
    }

    #[test]
    fn what_is_not_defined_is_none() {
        for wrong in [&[][..], &[(0.0, 1.0)], &[(-1.0, 1.0)], &[(f64::NAN, 1.0)], &[(1.0, 0.0)], &[(1.0, f64::NAN)]] {
            assert_eq!(effective_dof(wrong), None);
        }
        for (confidence, dof) in [(0.0, 1.0), (1.0, 1.0), (f64::NAN, 1.0), (0.95, 0.0), (0.95, f64::NAN)] {
            assert_eq!(coverage_factor(confidence, dof), None);
        }
    }
}
