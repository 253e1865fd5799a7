//! Where numbers are and how far they scatter: mean and variance of a stream, and the median of a sample with its scale,
//! which no minority can move far.

use super::distributions::{Tail, chi_squared_quantile};

/// Mean and variance of a stream of numbers, by Welford's update (Technometrics 4, 1962, 419).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// One number more.
    pub fn push(&mut self, value: f64) {
        self.count += 1.0;
        let before = value - self.mean;
        self.mean += before / self.count;
        self.squares += before * (value - self.mean);
    }

    /// How many there were.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Their mean; none of none.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0.0).then_some(self.mean)
    }

    /// Σ (x − mean)²
    pub fn squares(&self) -> f64 {
        self.squares
    }

    /// The sample variance Σ (x − mean)²/(n − 1); none of fewer than two.
    pub fn variance(&self) -> Option<f64> {
        (self.count > 1.0).then(|| self.squares / (self.count - 1.0))
    }

    /// The sample standard deviation; none of fewer than two.
    pub fn deviation(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }
}

/// The median, for which the values are put in another order; the mean of the two in the middle where their count is even.
/// None of none, or where one is NaN.
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() || values.iter().any(|value| value.is_nan()) {
        return None;
    }
    let middle = values.len() / 2;
    let odd = values.len() % 2 == 1;
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    if odd {
        return Some(upper);
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // infinities of both signs have no mean
    Some(0.5 * lower + 0.5 * upper).filter(|median| !median.is_nan())
}

/// The standard deviation that the median of absolute deviations from the median tells of normal numbers:
///
/// > s = 1.4826… median |x − median x|,  1.4826… = 1/Φ⁻¹(¾)
///
/// F. R. Hampel, J. Am. Stat. Assoc. 69 (1974), 383. None of none, or where one is not finite.
pub fn mad_scale(values: &[f64]) -> Option<f64> {
    if values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut values = values.to_vec();
    let centre = median(&mut values)?;
    values.iter_mut().for_each(|value| *value = (*value - centre).abs());
    norm_scale(&mut values, 1)
}

/// The standard deviation of each component that the median of the norms of normal residuals with m components tells:
///
/// > s = median ‖r‖ / √(χ²_m median)
///
/// For m = 1 this is 1.4826… median |r|. The norms are put in another order. None of none, where one is NaN, or m = 0.
pub fn norm_scale(norms: &mut [f64], m: usize) -> Option<f64> {
    Some(median(norms)? / chi_squared_quantile(Tail::Lower(0.5), m as f64)?.sqrt())
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;
    use crate::statistics::tests::{close, relatively_close};

    proptest! {
        #[test]
        fn moments_in_two_passes(values in vec(-1e3..1e3, 2..40usize), shift in -1e6..1e6) {
            let mut moments = Moments::default();
            values.iter().for_each(|value| moments.push(value + shift));
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
            close(moments.mean().unwrap(), mean + shift, 1e-12);
            close(moments.squares(), squares, 1e-6);
            close(moments.variance().unwrap(), squares / (n - 1.0), 1e-6);
        }

        #[test]
        fn the_median_has_as_many_below_as_above(mut values in vec(-9..9i32, 1..30usize)) {
            let mut numbers: Vec<f64> = values.iter().copied().map(f64::from).collect();
            let found = median(&mut numbers).unwrap();
            values.sort_unstable();
            let n = values.len();
            prop_assert_eq!(found, 0.5 * f64::from(values[(n - 1) / 2] + values[n / 2]));
        }
    }

    #[test]
    fn few_numbers_have_no_variance() {
        let mut moments = Moments::default();
        assert_eq!((moments.mean(), moments.variance()), (None, None));
        moments.push(3.0);
        assert_eq!((moments.mean(), moments.deviation(), moments.count()), (Some(3.0), None, 1.0));
    }

    #[test]
    fn medians_that_are_not_there() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [1.0, f64::NAN]), None);
        assert_eq!(median(&mut [f64::INFINITY, f64::NEG_INFINITY]), None);
        assert_eq!(median(&mut [f64::MAX, f64::MAX]), Some(f64::MAX));
        assert_eq!(mad_scale(&[]), None);
        assert_eq!(mad_scale(&[1.0, 2.0, f64::INFINITY]), None);
        assert_eq!(norm_scale(&mut [1.0], 0), None);
    }

    #[test]
    fn the_factor_of_hampel() {
        relatively_close(mad_scale(&[-1.0, 0.0, 1.0]).unwrap(), 1.482_602_218_505_602, 1e-14);
        relatively_close(mad_scale(&[9.0, 10.0, 11.0, 1e9, 10.0]).unwrap(), 1.482_602_218_505_602, 1e-14);
        // the median of χ² with two degrees of freedom is 2 ln 2
        relatively_close(norm_scale(&mut [3.0], 2).unwrap(), 3.0 / (2.0 * 2f64.ln()).sqrt(), 1e-14);
    }

    #[test]
    fn scales_of_normal_numbers() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let sigma = 3.0;
        for m in [1, 2, 3, 6] {
            let norm = |random: &mut ChaCha8Rng| {
                let square = (0..m).map(|_| random.sample::<f64, _>(StandardNormal).powi(2)).sum::<f64>();
                sigma * square.sqrt()
            };
            let mut norms: Vec<f64> = (0..40_000).map(|_| norm(&mut random)).collect();
            close(norm_scale(&mut norms, m).unwrap(), sigma, 0.02);
        }
        let values: Vec<f64> = (0..40_000).map(|_| 7.0 + sigma * random.sample::<f64, _>(StandardNormal)).collect();
        close(mad_scale(&values).unwrap(), sigma, 0.02);
    }
}
