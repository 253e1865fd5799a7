//! What a robust loss costs where nothing is wrong: its asymptotic efficiency at normal errors, by quadrature.
//!
//! The M-estimate of a location in m dimensions with the spherical weight w(‖x‖²) has the influence ψ(x) = w(‖x‖²) x. Its
//! asymptotic covariance is B/A² times the identity (F. R. Hampel et al., Robust Statistics, 1986, 4.2), that of the mean is
//! the identity, and
//!
//! ```text
//! A = E[div ψ]/m = E[w + 2 s w′/m]         B = E[‖ψ‖²]/m = E[w² s]/m         s = ‖x‖² ~ χ²_m
//! ```
//!
//! Integrated by parts (Stein's identity, which holds across kinks and jumps) A = E[x · ψ]/m = E[w s]/m, and as s times the
//! density of χ²_m is m times that of χ²_{m+2},
//!
//! ```text
//! efficiency = A²/B = (E w)²/E[w²],   s ~ χ²_{m+2}
//! ```
//!
//! which needs no derivative, is at most one by Cauchy and Schwarz, and is one for w = 1 only.

use super::loss::{Loss, LossError};

/// Nodes and weights of Gauss and Legendre with 10 points on [−1, 1], of the positive half (DLMF 3.5.v).
const NODES: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_87),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_36),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// See [`Loss::efficiency`].
pub(super) fn efficiency(loss: &Loss, m: usize) -> f64 {
    /// χ has less than 10⁻³⁰ of its probability farther than this from its mode.
    const REACH: f64 = 12.0;
    const PANEL: f64 = 0.5;
    let power = m.max(1) as f64 + 1.0;
    let mode = power.sqrt();
    // of χ with m + 2 degrees of freedom, one at its mode
    let density = |u: f64| (power * (u / mode).ln() - 0.5 * (u - mode) * (u + mode)).exp();
    let (first, last) = ((mode - REACH).max(0.0), mode + REACH);
    // panels end at kinks, and grow from zero as the weight does
    let panels = ((last - first) / PANEL).ceil() as usize;
    let mut ends: Vec<f64> = (0..=panels).map(|k| first + (last - first) * k as f64 / panels as f64).collect();
    ends.extend(loss.kernel().kinks().iter().map(|kink| kink * loss.tuning()));
    ends.extend((-6..24).map(|k| loss.tuning() * f64::powi(2.0, k)));
    ends.retain(|end| (first..=last).contains(end));
    ends.sort_by(f64::total_cmp);

    let [mut whole, mut mean, mut square] = [0.0; 3];
    for (begin, end) in ends.iter().zip(ends.iter().skip(1)) {
        let (centre, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        for (node, share) in NODES.iter().flat_map(|(node, share)| [(-node, share), (*node, share)]) {
            let u = centre + half * node;
            let (weight, share) = (loss.weight(u * u), share * half * density(u));
            whole += share;
            mean += share * weight;
            square += share * weight * weight;
        }
    }
    // a kernel that rejects everything within reach is good for nothing
    if square > 0.0 { (mean / whole * (mean / square)).clamp(0.0, 1.0) } else { 0.0 }
}

/// See [`Loss::for_dimension`].
pub(super) fn for_dimension(loss: &Loss, m: usize) -> Result<Loss, LossError> {
    if m <= 1 {
        return Ok(*loss);
    }
    let target = loss.efficiency(1);
    let with = |tuning: f64| Loss::new(loss.kernel(), Some(tuning));
    let none = LossError::Dimension { kernel: loss.kernel(), efficiency: target, dimension: m };
    let mut low = (1e-3 * loss.tuning()).max(1e-6);
    let mut high = (10.0 * loss.tuning() * (m as f64).sqrt()).min(1e6);
    if with(low)?.efficiency(m) >= target || with(high)?.efficiency(m) < target {
        return Err(none);
    }
    while high > low * (1.0 + 1e-14) {
        let middle = (low * high).sqrt();
        if middle <= low || middle >= high {
            break;
        }
        if with(middle)?.efficiency(m) < target { low = middle } else { high = middle }
    }
    with(high)
}

#[cfg(test)]
mod tests {
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::statistics::tests::close;
    use crate::statistics::{Kernel, chi_squared_upper_tail, normal_upper_tail};

    fn loss(kernel: Kernel, tuning: f64) -> Loss {
        Loss::new(kernel, Some(tuning)).unwrap()
    }

    #[test]
    fn the_nodes_integrate_polynomials_of_degree_19() {
        for power in 0..10 {
            let sum: f64 = NODES.iter().map(|(node, share)| 2.0 * share * node.powi(2 * power)).sum();
            close(sum, 2.0 / f64::from(2 * power + 1), 1e-15);
        }
    }

    /// The constants of Holland & Welsch (1977) and others, as published, to three or four digits; the digits of the
    /// efficiencies are by mpmath's quadrature over each piece, with 15 digits.
    #[test]
    fn published_constants_have_95_percent() {
        for (kernel, tuning, expected) in [
            (Kernel::Huber, 1.345, 0.95000026),
            (Kernel::Fair, 1.3998, 0.95000085),
            (Kernel::Cauchy, 2.385, 0.95000261),
            (Kernel::Welsch, 2.985, 0.95001968),
            (Kernel::Tukey, 4.685, 0.94999735),
            (Kernel::Andrews, 1.339, 0.95004143),
            (Kernel::Hampel, 0.9016, 0.95002558),
            (Kernel::L1L2, 1.287099224, 0.95),
            (Kernel::L1L2, std::f64::consts::SQRT_2, 0.95745463),
            (Kernel::GemanMcClure, 3.787418761, 0.95),
            (Kernel::GemanMcClure, 1.0, 0.44356034),
            (Kernel::Danish, 2.0, 0.95097274),
            (Kernel::Danish, 3.0, 0.99816762),
        ] {
            close(loss(kernel, tuning).efficiency(1), expected, 6e-9);
        }
    }

    /// By the probabilities of the normal distribution: A = P(|z| < c), B = E min(z², c²).
    #[test]
    fn huber_in_closed_form() {
        for c in [0.01, 0.3, 1.0, 1.345, 2.0, 4.0f64] {
            let beyond = 2.0 * normal_upper_tail(c).unwrap();
            let density = (-0.5 * c * c).exp() / (2.0 * std::f64::consts::PI).sqrt();
            let b = 1.0 - beyond - 2.0 * c * density + c * c * beyond;
            close(loss(Kernel::Huber, c).efficiency(1), (1.0 - beyond).powi(2) / b, 1e-12);
        }
    }

    /// E exp(−t s) = (1 + 2 t)^(−k/2) of χ²_k.
    #[test]
    fn welsch_in_closed_form_in_any_dimension() {
        for m in [1, 2, 3, 6, 50, 1000] {
            for c in [0.3, 1.0, 3.0, 30.0f64] {
                let exponent = 0.5 * (m as f64 + 2.0);
                let ratio = (1.0 + 4.0 / (c * c)) / (1.0 + 2.0 / (c * c)).powi(2);
                close(loss(Kernel::Welsch, c).efficiency(m), ratio.powf(exponent), 1e-11);
            }
        }
    }

    /// Tukey's weight is a polynomial of s within c², and E sʲ over s < c² is a χ² probability of 2 j more degrees of freedom.
    #[test]
    fn tukey_by_truncated_moments() {
        for m in [1, 2, 3, 6] {
            for c in [0.5, 2.0, 4.685, 9.0f64] {
                let k = m as f64 + 2.0;
                let moment = |j: i32| {
                    let rising: f64 = (0..j).map(|i| k + 2.0 * f64::from(i)).product();
                    rising * (1.0 - chi_squared_upper_tail(c * c, k + 2.0 * f64::from(j)).unwrap()) / c.powi(2 * j)
                };
                let mean = moment(0) - 2.0 * moment(1) + moment(2);
                let square = moment(0) - 4.0 * moment(1) + 6.0 * moment(2) - 4.0 * moment(3) + moment(4);
                close(loss(Kernel::Tukey, c).efficiency(m), mean * mean / square, 1e-8);
            }
        }
    }

    /// As c → 0 those that become linear become the spatial median, of efficiency (m/2) (Γ((m+1)/2)/Γ((m+2)/2))²: 2/π, π/4, …
    #[test]
    fn a_small_constant_is_the_median() {
        let pi = std::f64::consts::PI;
        for (m, expected) in [(1, 2.0 / pi), (2, pi / 4.0), (3, 8.0 / (3.0 * pi)), (4, 9.0 * pi / 32.0)] {
            for kernel in [Kernel::Huber, Kernel::Fair, Kernel::L1L2] {
                close(loss(kernel, 1e-6).efficiency(m), expected, 3e-5);
            }
        }
    }

    #[test]
    fn from_ten_dimensions_on_the_median_has_95_percent() {
        for kernel in [Kernel::Huber, Kernel::Fair, Kernel::L1L2] {
            let own = Loss::new(kernel, None).unwrap();
            assert!(own.for_dimension(9).is_ok(), "{kernel}");
            assert!(matches!(own.for_dimension(10), Err(LossError::Dimension { dimension: 10, .. })), "{kernel}");
        }
    }

    /// By mpmath: root of the quadrature to ten digits.
    #[test]
    fn constants_in_more_dimensions() {
        for (kernel, tuning, expected) in [
            (Kernel::Huber, 1.344997509, [1.50114108, 1.62798792, 1.86933773]),
            (Kernel::Fair, 1.399776812, [1.22264566, 1.0439613, 0.543398459]),
            (Kernel::L1L2, 1.287099224, [1.30942726, 1.29221738, 1.06932223]),
            (Kernel::Cauchy, 2.384947119, [2.54863762, 2.66556834, 2.86237203]),
            (Kernel::GemanMcClure, 3.787418761, [4.09555234, 4.33728995, 4.84600451]),
            (Kernel::Welsch, 2.984637176, [3.25096677, 3.4690618, 3.96462306]),
            (Kernel::Tukey, 4.685064949, [5.12298609, 5.49024921, 6.35621629]),
            (Kernel::Andrews, 1.338710859, [1.46298435, 1.56716297, 1.81276295]),
            (Kernel::Hampel, 0.9014437819, [1.00447604, 1.08859119, 1.25137108]),
            (Kernel::Danish, 1.993002202, [2.21260544, 2.40433981, 2.88189664]),
        ] {
            for (m, expected) in [2, 3, 6].into_iter().zip(expected) {
                close(loss(kernel, tuning).for_dimension(m).unwrap().tuning(), expected, 2e-8);
            }
            assert_eq!(loss(kernel, tuning).for_dimension(1), Ok(loss(kernel, tuning)));
        }
    }

    #[test]
    fn efficiency_is_kept_in_every_dimension_where_it_can_be() {
        for kernel in Kernel::ALL {
            let own = Loss::new(kernel, None).unwrap();
            for m in [2, 3, 4, 6, 12, 100] {
                match own.for_dimension(m) {
                    Ok(found) => close(found.efficiency(m), own.efficiency(1), 1e-12),
                    Err(_) => assert!(loss(kernel, 1e-3 * own.tuning()).efficiency(m) > own.efficiency(1)),
                }
            }
        }
    }

    #[test]
    fn a_larger_constant_is_more_efficient() {
        for kernel in Kernel::ALL {
            for m in [1, 2, 3, 6, 30] {
                let efficiencies = (0..120).map(|k| loss(kernel, 10f64.powf(f64::from(k) / 40.0 - 1.0)).efficiency(m));
                let efficiencies: Vec<f64> = efficiencies.collect();
                assert!(efficiencies.is_sorted_by(|a, b| *a <= b + 1e-12), "{kernel} in {m} dimensions");
            }
        }
    }

    #[test]
    fn what_rejects_everything_has_no_efficiency() {
        assert_eq!(loss(Kernel::Tukey, 1.0).efficiency(100_000), 0.0);
        assert_eq!(loss(Kernel::Huber, 1.0).efficiency(0), loss(Kernel::Huber, 1.0).efficiency(1));
    }

    /// Locations of 4000 samples of 60 triples by reweighting, against their means: the theory is for large samples, so the
    /// tolerance has room for both.
    #[test]
    fn efficiency_by_simulation() {
        const SAMPLES: usize = 4000;
        const SIZE: usize = 60;
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for loss in [loss(Kernel::Huber, 0.7), loss(Kernel::Tukey, 3.5)] {
            let [mut of_mean, mut of_robust] = [0.0; 2];
            for _ in 0..SAMPLES {
                let sample: Vec<[f64; 3]> =
                    (0..SIZE).map(|_| [(); 3].map(|()| random.sample(StandardNormal))).collect();
                let weighted = |weight: &dyn Fn(&[f64; 3]) -> f64| {
                    let mut sum = [0.0; 4];
                    for x in &sample {
                        let w = weight(x);
                        sum.iter_mut().zip([w * x[0], w * x[1], w * x[2], w]).for_each(|(sum, term)| *sum += term);
                    }
                    [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]]
                };
                let square = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
                let mean = weighted(&|_| 1.0);
                let mut centre = mean;
                for _ in 0..30 {
                    let at = centre;
                    centre = weighted(&|x| loss.weight(square(&[x[0] - at[0], x[1] - at[1], x[2] - at[2]])));
                }
                of_mean += square(&mean);
                of_robust += square(&centre);
            }
            close(of_mean / of_robust, loss.efficiency(3), 0.02);
        }
    }
}
