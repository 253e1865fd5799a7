//! Two families of functions that make rotations exact at angle zero, over any number type.
//!
//! Rotations are analytic in the *square* of their angle; writing them so removes the square root, and with it the lost
//! derivative, at zero, where calibration offsets start. Both families are closed under differentiation.

use super::operation::Number;

/// Below this argument the power series is used; above, the closed form loses at most three bits to cancellation.
const SERIES: f64 = 0.5;

/// Stumpff's function c_k(x) = Σ (−x)ⁱ/(k + 2i)! for x ≥ 0.
///
/// c₀ = cos √x, c₁ = sin √x/√x, c₂ = (1 − cos √x)/x, and c_k = 1/k! − x c_{k+2}. Derivative: c_k′ = (k c_{k+2} − c_{k+1})/2.
/// Source: K. Stumpff, Himmelsmechanik I (1959), §41.
///
/// ```
/// use num_dual::Dual64;
/// use phical::graph::stumpff;
/// let angle: f64 = 0.7;
/// assert!((stumpff(1, &(angle * angle)) - angle.sin() / angle).abs() < 1e-15);
/// // the derivative at zero is there: c₁′(0) = −1/6
/// assert!((stumpff(1, &Dual64::from(0.0).derivative()).eps + 1.0 / 6.0).abs() < 1e-16);
/// ```
pub fn stumpff<T: Number>(k: u32, x: &T) -> T {
    if x.re() < SERIES {
        return series(x, |i| {
            let n = f64::from(k + 2 * i);
            if i == 0 { (1..=k).map(|j| 1.0 / f64::from(j)).product() } else { 1.0 / (n * (n - 1.0)) }
        });
    }
    let angle = x.sqrt();
    let (mut c, from) = if k.is_multiple_of(2) { (angle.cos(), 0) } else { (angle.sin() / &angle, 1) };
    // c_{j+2} = (1/j! − c_j)/x
    let mut factorial = 1.0;
    let mut j = from;
    while j < k {
        c = (T::from(1.0 / factorial) - c) / x;
        factorial *= f64::from((j + 1) * (j + 2));
        j += 2;
    }
    c
}

/// g_n(x) = Σ (−x)ⁱ/(2i + 2n + 1) for x ≥ 0; g₀ = arctan √x/√x.
///
/// g_n = 1/(2n + 1) − x g_{n+1}; g_n′ = ½((2n + 1) g_{n+1} − 1/(1 + x)).
pub fn atanc<T: Number>(n: u32, x: &T) -> T {
    if x.re() < 0.01 {
        let mut sum = T::from(0.0);
        for i in (0..10).rev() {
            sum = T::from(1.0 / f64::from(2 * i + 2 * n + 1)) - sum * x;
        }
        return sum;
    }
    let root = x.sqrt();
    let mut g = root.atan() / &root;
    for j in 0..n {
        g = (T::from(1.0 / f64::from(2 * j + 1)) - g) / x;
    }
    g
}

/// Σ tᵢ by Horner's rule where t₀ = ratio(0) and tᵢ = −x · ratio(i) · tᵢ₋₁.
fn series<T: Number>(x: &T, ratio: impl Fn(u32) -> f64) -> T {
    const TERMS: u32 = 12;
    let mut sum = T::from(1.0);
    for i in (1..TERMS).rev() {
        sum = T::from(1.0) - sum * x * ratio(i);
    }
    sum * ratio(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    #[test]
    fn series_and_closed_form_meet() {
        for k in 0..5 {
            let (below, above) = (stumpff(k, &(SERIES - 1e-12)), stumpff(k, &SERIES));
            assert!((below - above).abs() < 1e-12, "c{k}: {below} {above}");
        }
        for n in 0..3 {
            let (below, above): (f64, f64) = (atanc(n, &(0.01 - 1e-13)), atanc(n, &0.01));
            assert!((below - above).abs() < 1e-10, "g{n}: {below} {above}");
        }
    }

    #[test]
    fn derivatives_follow_the_recurrences() {
        for x in [0.0, 1e-9, 0.3, 0.6, 4.0, 9.5] {
            let dual = Dual64::from(x).derivative();
            for k in 0..4 {
                let expected = (f64::from(k) * stumpff(k + 2, &x) - stumpff(k + 1, &x)) / 2.0;
                assert!((stumpff(k, &dual).eps - expected).abs() < 2e-14, "c{k}'({x})");
            }
            for n in 0..2 {
                let expected = (f64::from(2 * n + 1) * atanc(n + 1, &x) - 1.0 / (1.0 + x)) / 2.0;
                assert!((atanc(n, &dual).eps - expected).abs() < 2e-13, "g{n}'({x})");
            }
        }
    }

    #[test]
    fn values_are_those_of_the_elementary_functions() {
        for angle in [0.1f64, 0.5, 0.8, 1.5, 3.0] {
            let x = angle * angle;
            assert!((stumpff(0, &x) - angle.cos()).abs() < 1e-15);
            assert!((stumpff(1, &x) - angle.sin() / angle).abs() < 1e-15);
            assert!((stumpff(2, &x) - 2.0 * ((angle / 2.0).sin() / angle).powi(2)).abs() < 1e-15);
            assert!((atanc(0, &x) - angle.atan() / angle).abs() < 1e-15);
        }
    }
}
