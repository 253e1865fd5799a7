//! Regularised incomplete gamma and beta functions for shapes from next to nothing to 10¹², and their inverses.
//!
//! ```text
//! P(a, x)   = ∫₀ˣ tᵃ⁻¹ e⁻ᵗ dt / Γ(a)               Q = 1 − P
//! I_x(a, b) = ∫₀ˣ tᵃ⁻¹ (1−t)ᵇ⁻¹ dt / B(a, b)       x = odds/(1 + odds)
//! ```
//!
//! Both are a density times a series or continued fraction (DLMF 8.7.1, 8.9.2, 8.17.8, 8.17.22; the second by the modified Lentz
//! method, Press et al., Numerical Recipes, 3rd ed. 2007, 5.2 and 6.2). The densities are those of the Poisson and the
//! binomial distribution in the saddle-point form of C. Loader, "Fast and accurate computation of binomial probabilities"
//! (2000), in which nothing large is subtracted:
//!
//! ```text
//! xᵃ e⁻ˣ/Γ(a)       = √(a/2π) exp(−δ(a) − D(a, x))
//! xᵃ (1−x)ᵇ/B(a, b) = √(a b/(2π n)) exp(δ(n) − δ(a) − δ(b) − D(a, n x) − D(b, n (1−x))),   n = a + b
//! δ(a)    = ln Γ(a+1) − (a + ½) ln a + a − ½ ln 2π
//! D(x, m) = x ln(x/m) + m − x
//! ```

use std::f64::consts::PI;

/// Terms of a series or fraction before it is given up; √(80 a) are needed.
const MOST_TERMS: usize = 10_000_000;

/// A relative change that no longer matters.
const NEGLIGIBLE: f64 = 1e-16;

/// The two tails of a distribution of a positive number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tails {
    /// The probability of less.
    pub(super) lower: f64,
    /// The probability of more.
    pub(super) upper: f64,
    /// The derivative of `lower` by the logarithm of the number.
    pub(super) slope: f64,
}

impl Tails {
    fn by_lower(lower: f64, slope: f64) -> Tails {
        Tails { lower, upper: 1.0 - lower, slope }
    }

    fn by_upper(upper: f64, slope: f64) -> Tails {
        Tails { lower: 1.0 - upper, upper, slope }
    }
}

/// δ(a), the error of Stirling's formula for ln Γ(a + 1); a > 0.
fn stirling_error(a: f64) -> f64 {
    const ASYMPTOTIC: f64 = 16.0;
    let (mut a, mut below) = (a, 0.0);
    while a < ASYMPTOTIC {
        // δ(a) − δ(a + 1) = (a + ½) ln(1 + 1/a) − 1
        below += (a + 0.5) * (1.0 / a).ln_1p() - 1.0;
        a += 1.0;
    }
    // DLMF 5.11.1
    const SERIES: [f64; 6] = [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360_360.0];
    let square = 1.0 / (a * a);
    below + SERIES.iter().rev().fold(0.0, |sum, term| sum * square + term) / a
}

/// D(x, m) = x ln(x/m) + m − x, without cancellation where x ≈ m; x and m > 0.
fn deviance(x: f64, m: f64) -> f64 {
    let difference = x - m;
    if difference.abs() >= 0.1 * (x + m) {
        return x * (x / m).ln() - difference;
    }
    // with v = (x − m)/(x + m): D = (x − m) v + 2 x Σ v²ʲ⁺¹/(2j + 1), j ≥ 1
    let v = difference / (x + m);
    let mut power = 2.0 * x * v;
    let mut sum = difference * v;
    for j in 1..100 {
        power *= v * v;
        let next = sum + power / f64::from(2 * j + 1);
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

/// P, Q and x dP/dx of the gamma distribution with shape a; none where a or x is not a positive number, or a is too large.
pub(super) fn gamma_tails(a: f64, x: f64) -> Option<Tails> {
    if !(a > 0.0 && a.is_finite() && x > 0.0 && x.is_finite()) {
        return None;
    }
    let slope = (a / (2.0 * PI)).sqrt() * (-stirling_error(a) - deviance(a, x)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0, 1.0);
        for k in 1..MOST_TERMS {
            term *= x / (a + k as f64);
            sum += term;
            if term <= NEGLIGIBLE * sum {
                return Some(Tails::by_lower((slope / a * sum).min(1.0), slope));
            }
        }
        return None;
    }
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (f64::MAX, 1.0 / b);
    let mut fraction = d;
    for k in 1..MOST_TERMS {
        let k = k as f64;
        let numerator = -k * (k - a);
        b += 2.0;
        d = 1.0 / not_zero(numerator * d + b);
        c = not_zero(b + numerator / c);
        fraction *= c * d;
        if (c * d - 1.0).abs() <= 2.0 * NEGLIGIBLE {
            return Some(Tails::by_upper((slope * fraction).min(1.0), slope));
        }
    }
    None
}

/// I_x(a, b), what is above it, and its derivative by ln odds, where x = odds/(1 + odds); none where one of the three is not
/// a positive number, or too large.
pub(super) fn beta_tails(a: f64, b: f64, odds: f64) -> Option<Tails> {
    let positive = [a, b, odds].iter().all(|value| *value > 0.0 && value.is_finite());
    if !positive {
        return None;
    }
    let (x, y) = (odds / (1.0 + odds), 1.0 / (1.0 + odds));
    let n = a + b;
    let exponent = stirling_error(n) - stirling_error(a) - stirling_error(b) - deviance(a, n * x) - deviance(b, n * y);
    // √(a b/n) where the product may be beyond the numbers
    let slope = (a.min(b) / (2.0 * PI) * (a.max(b) / n)).sqrt() * exponent.exp();
    // how far x is below the mean a/n, times n
    let below = a * y - b * x;
    // of a shape that is next to nothing the fraction converges too slowly even at the mean
    if a < 1.0 && (n * x).max(x) < 0.5 {
        Some(Tails::by_lower((slope / a * beta_series(a, b, x)?).min(1.0), slope))
    } else if b < 1.0 && (n * y).max(y) < 0.5 {
        Some(Tails::by_upper((slope / b * beta_series(b, a, y)?).min(1.0), slope))
    } else if below > 0.0 {
        Some(Tails::by_lower((slope * beta_fraction(a, b, x, y, below)?).min(1.0), slope))
    } else {
        Some(Tails::by_upper((slope * beta_fraction(b, a, y, x, -below)?).min(1.0), slope))
    }
}

/// ₂F₁(a + b, 1; a + 1; x), DLMF 8.17.8; all terms are positive.
fn beta_series(a: f64, b: f64, x: f64) -> Option<f64> {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..MOST_TERMS {
        let before = k as f64 - 1.0;
        term *= (a + b + before) / (a + 1.0 + before) * x;
        sum += term;
        if term <= NEGLIGIBLE * sum {
            return Some(sum);
        }
    }
    None
}

/// The even part of the continued fraction of DLMF 8.17.22, over a; x + y = 1, and `below` = a y − b x ≥ 0.
///
/// Didonato & Morris, ACM TOMS 18 (1992), 360 (the function BFRAC): as neither 1 − x nor a − n x appears as a difference, it
/// is as good where one shape is a million times the other.
fn beta_fraction(a: f64, b: f64, x: f64, y: f64, below: f64) -> Option<f64> {
    let first = 1.0 + below;
    let (mut numerator, mut last_numerator) = (1.0, 0.0);
    let (mut denominator, mut last_denominator) = (first / (1.0 + 1.0 / a), 1.0);
    let mut fraction = numerator / denominator;
    for k in 1..MOST_TERMS {
        let k = k as f64;
        let (before, twice) = (k - 1.0, 2.0 * k);
        let product = k * (b - k) * x;
        let scale = a / (a + twice - 1.0);
        let share = 1.0 + before / a;
        let alpha = share * (share + b / a) * scale * scale * (product * x);
        let beta =
            k + product / (a + twice - 1.0) + (1.0 + k / a) / (1.0 + (1.0 + twice) / a) * (first + k * (1.0 + y));
        (numerator, last_numerator) = (alpha * last_numerator + beta * numerator, numerator);
        (denominator, last_denominator) = (alpha * last_denominator + beta * denominator, denominator);
        let next = numerator / denominator;
        let change = (next - fraction).abs();
        fraction = next;
        if change <= 4.0 * NEGLIGIBLE * fraction {
            return Some(fraction);
        }
        last_numerator /= denominator;
        last_denominator /= denominator;
        (numerator, denominator) = (fraction, 1.0);
    }
    None
}

/// Lentz: a denominator may come near zero, but not be zero.
fn not_zero(value: f64) -> f64 {
    const TINY: f64 = 1e-300;
    if value.abs() < TINY { TINY } else { value }
}

/// The number below which there is `lower`, and above which `upper`, of the probability; the search starts at `start`. None
/// where the tails have none, or the number is not representable.
///
/// Newton's method on the logarithm of the smaller tail over the logarithm of the number, in which both tails of the gamma
/// and beta families are nearly straight, within a bracket that is halved where a step leaves it.
pub(super) fn invert(lower: f64, upper: f64, start: f64, tails: impl Fn(f64) -> Option<Tails>) -> Option<f64> {
    const MOST_STEPS: usize = 200;
    const SETTLED: f64 = 1e-13;
    const RIGHT: f64 = 1e-6;
    let scale = if start > 0.0 && start.is_finite() { start } else { 1.0 };
    if !(lower > 0.0 && upper > 0.0) {
        return None;
    }
    let gap_and_rate = |u: f64| {
        let at = tails(scale * u.exp())?;
        Some(match lower <= upper {
            true => ((at.lower / lower).ln(), at.slope / at.lower),
            false => (-(at.upper / upper).ln(), at.slope / at.upper),
        })
    };
    // from the start, as the logarithm of a large number has fewer digits after the point
    let (mut low, mut high) = (f64::MIN_POSITIVE.ln() + 1.0 - scale.ln(), f64::MAX.ln() - 1.0 - scale.ln());
    let mut u = 0.0;
    for _ in 0..MOST_STEPS {
        let (gap, rate) = gap_and_rate(u)?;
        if gap == 0.0 {
            break;
        }
        if gap < 0.0 {
            low = u
        } else {
            high = u
        }
        let newton = u - gap / rate;
        let within = newton > low && newton < high;
        let next = if within { newton } else { 0.5 * (low + high) };
        let step = (next - u).abs();
        u = next;
        if (within && step <= SETTLED) || high - low <= SETTLED * 1e-2 {
            break;
        }
    }
    let (gap, _) = gap_and_rate(u)?;
    (gap.abs() <= RIGHT).then(|| scale * u.exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::tests::{close, relatively_close};

    #[test]
    fn the_error_of_stirling_is_that_of_factorials() {
        let mut factorial = 1.0;
        for n in 1..=20 {
            let n = f64::from(n);
            factorial *= n;
            let stirling = (n + 0.5) * n.ln() - n + 0.5 * (2.0 * PI).ln();
            close(stirling_error(n), f64::ln(factorial) - stirling, 2e-14);
        }
    }

    #[test]
    fn the_deviance_has_no_seam() {
        for m in [0.5, 3.0, 1e6] {
            for ratio in [0.8181, 0.8182, 1.2222, 1.2223, 1.0 + 1e-8] {
                let direct = |ratio: f64| m * (ratio * ratio.ln() - (ratio - 1.0));
                close(deviance(m * ratio, m) / m, direct(ratio) / m, 1e-15);
            }
        }
        relatively_close(deviance(1.0 + 1e-8, 1.0), 5e-17, 2e-8);
    }

    /// Q(n, x) = e⁻ˣ Σ xᵏ/k!, k < n: DLMF 8.4.10.
    #[test]
    fn gamma_of_whole_shape_is_a_sum() {
        for n in 1..30 {
            for x in [0.01, 0.5, 1.0, 3.0, 10.0, 25.0, 60.0] {
                let (mut term, mut sum) = (f64::exp(-x), 0.0);
                for k in 0..n {
                    sum += term;
                    term *= x / f64::from(k + 1);
                }
                relatively_close(gamma_tails(f64::from(n), x).unwrap().upper, sum, 1e-13);
            }
        }
    }

    /// I_x(j, n − j + 1) = Σ binomial(n, k) xᵏ (1 − x)ⁿ⁻ᵏ, k ≥ j: DLMF 8.17.5.
    #[test]
    fn beta_of_whole_shapes_is_a_sum() {
        for n in [1, 2, 7, 40] {
            for j in 1..=n {
                for x in [0.01, 0.3, 0.5, 0.77, 0.999] {
                    let (mut choose, mut sum) = (1.0, 0.0);
                    for k in 0..=n {
                        if k >= j {
                            sum += choose * f64::powi(x, k) * f64::powi(1.0 - x, n - k);
                        }
                        choose *= f64::from(n - k) / f64::from(k + 1);
                    }
                    let found = beta_tails(f64::from(j), f64::from(n - j + 1), x / (1.0 - x)).unwrap();
                    relatively_close(found.lower, sum, 3e-13);
                }
            }
        }
    }

    #[test]
    fn slopes_are_differences() {
        let step = 1e-5f64;
        for (a, b, z) in [(0.5, 0.5, 0.3), (3.0, 8.0, 0.2), (50.0, 1.0, 40.0), (1e4, 1e5, 0.1)] {
            let by = |f: &dyn Fn(f64) -> f64| (f(z * step.exp()) - f(z * (-step).exp())) / (2.0 * step);
            let slope = by(&|odds| beta_tails(a, b, odds).unwrap().lower);
            close(beta_tails(a, b, z).unwrap().slope, slope, 1e-6);
            let slope = by(&|x| gamma_tails(a, a * x).unwrap().lower);
            close(gamma_tails(a, a * z).unwrap().slope, slope, 1e-6);
        }
    }

    #[test]
    fn inverses_undo() {
        for shape in [0.2, 0.5, 1.0, 4.5, 300.0, 1e6] {
            for p in [1e-12, 1e-3, 0.3, 0.5, 0.9, 0.999] {
                let x = invert(p, 1.0 - p, 1.0, |x| gamma_tails(shape, x)).unwrap();
                relatively_close(gamma_tails(shape, x).unwrap().lower, p, 1e-10);
                for other in [0.5, 3.0, 2e3] {
                    let odds = invert(p, 1.0 - p, 1.0, |odds| beta_tails(shape, other, odds)).unwrap();
                    relatively_close(beta_tails(shape, other, odds).unwrap().lower, p, 1e-10);
                }
            }
        }
    }

    #[test]
    fn what_is_not_defined_is_none() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(gamma_tails(bad, 1.0), None);
            assert_eq!(gamma_tails(1.0, bad), None);
            assert_eq!(beta_tails(bad, 1.0, 1.0), None);
            assert_eq!(beta_tails(1.0, bad, 1.0), None);
            assert_eq!(beta_tails(1.0, 1.0, bad), None);
        }
        assert_eq!(invert(0.0, 1.0, 1.0, |x| gamma_tails(1.0, x)), None);
        // the number is about 10⁻³⁰⁰⁰⁰
        assert_eq!(invert(1e-3, 0.999, 1.0, |x| gamma_tails(1e-4, x)), None);
    }
}
