//! Tests of hypotheses, and criteria by which to choose among models.
//!
//! Models are compared by their sums of squares. *n* counts equations (Gaussian priors are equations too), *p* estimated
//! parameters (the rank), *S* is the weighted sum of squares at the minimum. Whether the weights are real makes all the
//! difference, and is what [`Noise`] says:
//!
//! ```text
//! σ known      −2 ln likelihood = S            + constant
//! σ₀ unknown   −2 ln likelihood = n ln(S/n)    + constant,      σ₀² estimated as S/n
//! ```

use super::distributions::{
    MOST_DOF, Tail, chi_squared_upper_tail, f_upper_tail, normal_quantile, normal_tails, t_quantile,
};
use super::special::{Tails, invert};

/// A test statistic and how improbable it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Test {
    /// The statistic.
    pub statistic: f64,
    /// The probability of a larger one where the hypothesis is true.
    pub upper_tail: f64,
}

/// A two-sided normal test of one number, and the error that it finds.
///
/// W. Baarda, A testing procedure for use in geodetic networks, Netherlands Geodetic Commission, 2/5 (1968). An observation
/// is rejected where |w| > `critical`; of an error that moves w by `noncentrality` standard deviations, a share of `power` is
/// found. Reliability is `noncentrality` × σ/√redundancy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baarda {
    /// k with P(|z| > k) = α
    pub critical: f64,
    /// δ₀ with P(|z + δ₀| > k) = power; Baarda's λ₀ is its square.
    pub noncentrality: f64,
}

impl Baarda {
    /// For a test of significance α that is to find what it must with probability `power`; none where they are not within
    /// (0, 1), or `power` < α, as no test is worse than that.
    pub fn new(alpha: f64, power: f64) -> Option<Baarda> {
        let possible = alpha > 0.0 && power < 1.0 && power >= alpha;
        let critical = possible.then(|| normal_quantile(Tail::Upper(0.5 * alpha))).flatten()?;
        // P(|z + δ| > k) = P(z > k − δ) + P(z > k + δ)
        let powers = |delta: f64| {
            let (near_lower, near) = normal_tails(critical - delta)?;
            let (_, far) = normal_tails(critical + delta)?;
            let density = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
            let slope = delta * (density(critical - delta) - density(critical + delta));
            Some(Tails { lower: near + far, upper: near_lower - far, slope })
        };
        let noncentrality = match power == alpha {
            true => 0.0,
            false => invert(power, 1.0 - power, critical + normal_quantile(Tail::Lower(power))?, powers)?,
        };
        Some(Baarda { critical, noncentrality })
    }
}

/// The critical value of Pope's τ test of a residual divided by its estimated standard deviation, two-sided with
/// significance α, where `dof` *r* degrees of freedom gave σ₀:
///
/// > τ = √r t / √(r − 1 + t²),  t the quantile of Student's t at 1 − α/2 with r − 1 degrees of freedom
///
/// A. J. Pope, The statistics of residuals and the detection of outliers, NOAA Technical Report NOS 65 NGS 1 (1976). The
/// largest of n residuals is tested with α/n. None where α is not within (0, 1), or r ≤ 1.
pub fn pope_tau(alpha: f64, dof: f64) -> Option<f64> {
    let possible = alpha > 0.0 && alpha < 1.0 && dof > 1.0;
    let t = possible.then(|| t_quantile(Tail::Upper(0.5 * alpha), dof - 1.0)).flatten()?;
    if dof > MOST_DOF {
        return Some(t);
    }
    // in this form t² cannot be beyond the numbers
    let tau =
        if t > 1.0 { (dof / ((dof - 1.0) / t / t + 1.0)).sqrt() } else { dof.sqrt() * t / (dof - 1.0 + t * t).sqrt() };
    Some(tau)
}

/// Whether two independent estimates of a variance are of the same one, against the first being larger: F = s₁²/s₂².
/// None where a variance is negative or not finite, the second zero, or the degrees of freedom not positive.
pub fn variance_ratio(first: f64, first_dof: f64, second: f64, second_dof: f64) -> Option<Test> {
    let possible = first >= 0.0 && first.is_finite() && second > 0.0 && second.is_finite();
    let statistic = possible.then(|| first / second)?;
    Some(Test { statistic, upper_tail: f_upper_tail(statistic, first_dof, second_dof)? })
}

/// Whether the scale of the errors is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// The weights are one over the true standard deviations.
    Known,
    /// They are so but for a common factor σ₀.
    Unknown,
}

/// What of a fit is compared with other fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// S, the weighted sum of squares.
    pub sum_of_squares: f64,
    /// n, the number of equations.
    pub equations: usize,
    /// p, the number of parameters that were estimated.
    pub parameters: usize,
}

impl Summary {
    /// S, if it is that of a fit.
    fn squares(&self) -> Option<f64> {
        let possible = self.sum_of_squares >= 0.0 && self.sum_of_squares.is_finite() && self.equations > 0;
        possible.then_some(self.sum_of_squares)
    }

    /// n − p, if there are any.
    fn dof(&self) -> Option<usize> {
        self.equations.checked_sub(self.parameters).filter(|dof| *dof > 0)
    }
}

/// S of the smaller and of the larger of two nested models of the same equations, and how many parameters are between them.
fn nested(small: &Summary, large: &Summary) -> Option<(f64, f64, usize)> {
    /// By so much a minimum may be missed.
    const ROUNDING: f64 = 1e-9;
    let between = large.parameters.checked_sub(small.parameters).filter(|count| *count > 0)?;
    let (most, least) = (small.squares()?, large.squares()?);
    let possible = small.equations == large.equations && least <= most * (1.0 + ROUNDING);
    possible.then(|| (most.max(least), least, between))
}

/// Whether the smaller of two nested models is enough, where σ₀ is unknown:
///
/// > F = ((S₀ − S₁)/(p₁ − p₀)) / (S₁/(n − p₁))
///
/// F distributed with p₁ − p₀ and n − p₁ degrees of freedom where the models are linear, and nearly so elsewhere (Seber &
/// Wild, Nonlinear Regression, 1989, 5.7). None where the models are not nested (other equations, no more parameters, a
/// larger sum of squares), or the larger leaves nothing to judge by (no degrees of freedom, S₁ = 0).
pub fn f_test(small: &Summary, large: &Summary) -> Option<Test> {
    let (most, least, between) = nested(small, large)?;
    let (between, dof) = (between as f64, large.dof()? as f64);
    variance_ratio((most - least) / between, between, least / dof, dof)
}

/// The test of the likelihood ratio of two nested models; its statistic is χ² distributed with p₁ − p₀ degrees of freedom
/// where the smaller is true (S. S. Wilks, Ann. Math. Stat. 9, 1938, 60):
///
/// > S₀ − S₁ where σ is known (exact for linear models), n ln(S₀/S₁) where σ₀ is not (for large n; [`f_test`] for any)
///
/// None where the models are not nested (other equations, no more parameters, a larger sum of squares), or σ₀ is unknown and
/// S₁ = 0.
pub fn likelihood_ratio(small: &Summary, large: &Summary, noise: Noise) -> Option<Test> {
    let (most, least, between) = nested(small, large)?;
    let statistic = match noise {
        Noise::Known => most - least,
        Noise::Unknown if least > 0.0 => large.equations as f64 * ((most - least) / least).ln_1p(),
        Noise::Unknown => return None,
    };
    Some(Test { statistic, upper_tail: chi_squared_upper_tail(statistic, between as f64)? })
}

/// Information criteria; of models for the same equations, the one with the smallest is preferred. All lack the same
/// constant.
///
/// > aic = D + 2 K,  bic = D + K ln n,  aicc = aic + 2 K (K + 1)/(n − K − 1)
///
/// where σ₀ is unknown, with D = n ln(S/n), and K = p + 1, as σ₀ is estimated too. Where σ is known, D = S and K = p, and
/// aicc = aic: the correction is for what estimating σ₀ does, and without that aic is unbiased for linear models of any size,
/// as S is χ² distributed with n − p degrees of freedom.
///
/// H. Akaike, IEEE Trans. Automatic Control 19 (1974), 716; N. Sugiura, Comm. Stat. A7 (1978), 13, and Hurvich & Tsai,
/// Biometrika 76 (1989), 297; G. Schwarz, Ann. Stat. 6 (1978), 461; Burnham & Anderson, Model Selection (2002), 2.2 and 2.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Criteria {
    /// Akaike's.
    pub aic: f64,
    /// Akaike's, corrected for few equations; none where there are too few for that.
    pub aicc: Option<f64>,
    /// Schwarz's.
    pub bic: f64,
}

impl Criteria {
    /// Those of a fit; none where S is negative or not finite, there are no equations, or σ₀ is unknown and S = 0.
    pub fn new(fit: &Summary, noise: Noise) -> Option<Criteria> {
        let squares = fit.squares()?;
        let n = fit.equations as f64;
        let (deviance, k) = match noise {
            Noise::Known => (squares, fit.parameters as f64),
            Noise::Unknown if squares > 0.0 => (n * (squares / n).ln(), fit.parameters as f64 + 1.0),
            Noise::Unknown => return None,
        };
        let aic = deviance + 2.0 * k;
        let left = n - k - 1.0;
        let aicc = match noise {
            Noise::Known => Some(aic),
            Noise::Unknown => (left > 0.0).then(|| aic + 2.0 * k * (k + 1.0) / left),
        };
        Some(Criteria { aic, aicc, bic: deviance + k * n.ln() })
    }
}

/// Whether a model leaves more than repeated measurements scatter. `pure` is the sum of squares of these around the means of
/// their groups, with `pure_dof` degrees of freedom (Σ over groups of repetitions − 1), weighted as the fit is:
///
/// > F = ((S − pure)/(n − p − pure_dof)) / (pure/pure_dof)
///
/// Draper & Smith, Applied Regression Analysis, 3rd ed. (1998), 2.1. None where the repetitions leave no degrees of freedom to
/// one of the two, or S < pure.
pub fn lack_of_fit(fit: &Summary, pure: f64, pure_dof: usize) -> Option<Test> {
    let saturated =
        Summary { sum_of_squares: pure, equations: fit.equations, parameters: fit.equations.checked_sub(pure_dof)? };
    f_test(fit, &saturated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::tests::{close, relatively_close};

    fn summary(sum_of_squares: f64, equations: usize, parameters: usize) -> Summary {
        Summary { sum_of_squares, equations, parameters }
    }

    /// λ₀ = 17.075 is Baarda's (1968), for 0.1 % and 80 %; the others are z(1 − α/2) + z(power) of mpmath where the far tail
    /// is below 10⁻¹⁵.
    #[test]
    fn the_test_of_baarda() {
        let found = Baarda::new(0.001, 0.80).unwrap();
        close(found.critical, 3.290_526_731_491_895, 1e-14);
        close(found.noncentrality, 3.290_526_731_491_895 + 0.841_621_233_572_914_2, 1e-12);
        assert_eq!((found.noncentrality.powi(2) * 1e3).round() / 1e3, 17.075);
        let found = Baarda::new(0.0001, 0.95).unwrap();
        close(found.critical, 3.890_591_886_413_124, 1e-13);
        close(found.noncentrality, 3.890_591_886_413_124 + 1.644_853_626_951_472_2, 1e-12);
    }

    /// The two-sided power is a χ² probability of one degree of freedom; by the normal tails themselves.
    #[test]
    fn the_error_of_baarda_is_found_with_the_power_asked_for() {
        for alpha in [1e-6, 0.001, 0.05, 0.3] {
            for power in [0.31, 0.5, 0.8, 0.95, 0.9999] {
                let Baarda { critical, noncentrality } = Baarda::new(alpha, power).unwrap();
                let upper = |x| super::super::normal_upper_tail(x).unwrap();
                relatively_close(2.0 * upper(critical), alpha, 1e-12);
                relatively_close(upper(critical - noncentrality) + upper(critical + noncentrality), power, 1e-12);
            }
        }
        close(Baarda::new(0.05, 0.05 + 1e-12).unwrap().noncentrality, 0.0, 1e-4);
        assert_eq!(Baarda::new(0.05, 0.05).unwrap().noncentrality, 0.0);
        for (alpha, power) in [(0.0, 0.5), (0.1, 0.05), (0.1, 1.0), (1.0, 1.0), (f64::NAN, 0.5), (0.1, f64::NAN)] {
            assert_eq!(Baarda::new(alpha, power), None);
        }
    }

    /// With two degrees of freedom τ = √2 sin φ with φ uniform: P(|τ| > √2 sin φ) = 1 − 2φ/π, as t of one is tan φ.
    #[test]
    fn the_test_of_pope() {
        for alpha in [1e-9, 0.001, 0.05, 0.5] {
            let angle = std::f64::consts::FRAC_PI_2 * (1.0 - alpha);
            close(pope_tau(alpha, 2.0).unwrap(), std::f64::consts::SQRT_2 * angle.sin(), 1e-12);
        }
        // τ²/r is beta distributed with shapes ½ and (r − 1)/2
        for dof in [1.5, 3.0, 10.0, 1000.0] {
            for alpha in [1e-6, 0.01, 0.3] {
                let tau = pope_tau(alpha, dof).unwrap();
                let beta = super::super::distributions::beta_quantile(Tail::Upper(alpha), 0.5, 0.5 * (dof - 1.0));
                close(tau, (dof * beta.unwrap()).sqrt(), 1e-11);
            }
        }
        close(pope_tau(0.05, 1e14).unwrap(), 1.959_963_984_540_054, 1e-12);
        close(pope_tau(0.05, 1e11).unwrap(), 1.959_963_984_540_054, 1e-9);
        for (alpha, dof) in [(0.0, 5.0), (1.0, 5.0), (0.05, 1.0), (0.05, f64::NAN), (f64::NAN, 5.0)] {
            assert_eq!(pope_tau(alpha, dof), None);
        }
    }

    /// t = (x̄ − 0)/(s/√n) of a sample: F of "the mean is zero" against "some mean" is t² (1 and n − 1 degrees of freedom).
    #[test]
    fn one_parameter_more_is_a_test_of_t() {
        let sample = [0.3, -0.2, 0.9, 0.4, 0.1, 0.8f64];
        let n = sample.len() as f64;
        let mean = sample.iter().sum::<f64>() / n;
        let about = |centre: f64| sample.iter().map(|x| (x - centre).powi(2)).sum::<f64>();
        let found = f_test(&summary(about(0.0), 6, 0), &summary(about(mean), 6, 1)).unwrap();
        let t = mean / (about(mean) / (n - 1.0) / n).sqrt();
        close(found.statistic, t * t, 1e-13);
        close(found.upper_tail, 2.0 * super::super::t_upper_tail(t, n - 1.0).unwrap(), 1e-13);
    }

    #[test]
    fn likelihood_ratios_are_differences_of_aic() {
        let (small, large) = (summary(130.0, 100, 3), summary(100.0, 100, 5));
        let known = likelihood_ratio(&small, &large, Noise::Known).unwrap();
        // χ² with two degrees of freedom is exponential
        close(known.statistic, 30.0, 1e-14);
        relatively_close(known.upper_tail, f64::exp(-15.0), 1e-13);
        let unknown = likelihood_ratio(&small, &large, Noise::Unknown).unwrap();
        close(unknown.statistic, 100.0 * 1.3f64.ln(), 1e-14);
        for (noise, test) in [(Noise::Known, known), (Noise::Unknown, unknown)] {
            let (small, large) = (Criteria::new(&small, noise).unwrap(), Criteria::new(&large, noise).unwrap());
            close(small.aic - large.aic + 4.0, test.statistic, 1e-12);
            close(small.bic - large.bic + 2.0 * 100f64.ln(), test.statistic, 1e-12);
        }
    }

    #[test]
    fn criteria_by_hand() {
        let fit = summary(8.0, 8, 2);
        let known = Criteria::new(&fit, Noise::Known).unwrap();
        assert_eq!((known.aic, known.aicc), (12.0, Some(12.0)));
        close(known.bic, 8.0 + 2.0 * 8f64.ln(), 1e-15);
        let unknown = Criteria::new(&fit, Noise::Unknown).unwrap();
        assert_eq!((unknown.aic, unknown.aicc), (6.0, Some(12.0)));
        close(unknown.bic, 3.0 * 8f64.ln(), 1e-15);
        assert_eq!(Criteria::new(&summary(1.0, 4, 2), Noise::Unknown).unwrap().aicc, None);
        assert_eq!(Criteria::new(&summary(0.0, 4, 2), Noise::Unknown), None);
        assert_eq!(Criteria::new(&summary(f64::NAN, 4, 2), Noise::Known), None);
        assert_eq!(Criteria::new(&summary(-1.0, 4, 2), Noise::Known), None);
        assert_eq!(Criteria::new(&summary(1.0, 0, 0), Noise::Known), None);
    }

    /// Eight measurements at four places, a straight line: by hand from group means.
    #[test]
    fn lack_of_fit_by_hand() {
        let groups = [(0.0, [0.1, -0.1]), (1.0, [1.3, 1.1]), (2.0, [1.9, 2.3]), (3.0, [2.7, 2.9f64])];
        let (mut pure, mut lack) = (0.0, 0.0);
        // the line through the means is that through all, as the groups are of one size
        let means = groups.map(|(x, y)| (x, 0.5 * (y[0] + y[1])));
        let centre = means.iter().map(|(_, y)| y).sum::<f64>() / 4.0;
        let slope = means.iter().map(|(x, y)| (x - 1.5) * (y - centre)).sum::<f64>() / 5.0;
        for ((x, y), (_, mean)) in groups.iter().zip(means) {
            pure += y.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
            lack += 2.0 * (mean - centre - slope * (x - 1.5)).powi(2);
        }
        let found = lack_of_fit(&summary(pure + lack, 8, 2), pure, 4).unwrap();
        close(found.statistic, (lack / 2.0) / (pure / 4.0), 1e-12);
        // F with 2 and n: P(F > f) = (1 + 2 f/n)^(−n/2)
        close(found.upper_tail, (1.0 + 0.5 * found.statistic).powi(-2), 1e-13);
    }

    #[test]
    fn models_that_are_not_nested_are_none() {
        let large = summary(100.0, 50, 5);
        for small in [summary(120.0, 49, 3), summary(120.0, 50, 5), summary(99.0, 50, 3), summary(f64::NAN, 50, 3)] {
            assert_eq!(f_test(&small, &large), None);
            assert_eq!(likelihood_ratio(&small, &large, Noise::Known), None);
            assert_eq!(likelihood_ratio(&small, &large, Noise::Unknown), None);
        }
        let rounded = f_test(&summary(100.0 - 1e-9, 50, 3), &large).unwrap();
        assert_eq!((rounded.statistic, rounded.upper_tail), (0.0, 1.0));
        assert_eq!(f_test(&summary(1.0, 50, 3), &summary(0.0, 50, 5)), None);
        assert_eq!(f_test(&summary(1.0, 5, 3), &summary(0.5, 5, 5)), None);
        assert_eq!(lack_of_fit(&large, 50.0, 51), None);
        assert_eq!(lack_of_fit(&large, 50.0, 45), None);
        assert_eq!(lack_of_fit(&large, 50.0, 0), None);
        assert_eq!(variance_ratio(1.0, 5.0, 0.0, 5.0), None);
        assert_eq!(variance_ratio(-1.0, 5.0, 1.0, 5.0), None);
        close(variance_ratio(161.447_638_797_588_5, 1.0, 1.0, 1.0).unwrap().upper_tail, 0.05, 1e-13);
    }
}
