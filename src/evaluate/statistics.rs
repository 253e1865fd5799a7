//! Mean, standard deviation and largest of a stream of numbers.

use crate::statistics::Moments;

/// What is said of a residual over all rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation; none of a single row.
    pub sd: Option<f64>,
    /// Mean of the absolute value.
    pub mean_abs: f64,
    /// Sample standard deviation of the absolute value.
    pub sd_abs: Option<f64>,
    /// Root mean square.
    pub rms: f64,
    /// Largest absolute value.
    pub max_abs: f64,
    /// The row it is in, counted from one; the first of several.
    pub worst_row: usize,
}

/// Statistics in the making.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Running {
    plain: Moments,
    absolute: Moments,
    squares: f64,
    worst: Option<(f64, usize)>,
}

impl Running {
    pub(super) fn push(&mut self, row: usize, value: f64) {
        self.plain.push(value);
        self.absolute.push(value.abs());
        self.squares += value * value;
        let worse = |(largest, at): (f64, usize)| value.abs() > largest || (value.abs() == largest && row < at);
        if self.worst.is_none_or(worse) {
            self.worst = Some((value.abs(), row));
        }
    }

    /// In other units.
    pub(super) fn statistics(&self, convert: impl Fn(f64) -> f64) -> Statistics {
        let (largest, row) = self.worst.unwrap_or_default();
        Statistics {
            mean: convert(self.plain.mean().unwrap_or_default()),
            sd: self.plain.deviation().map(&convert),
            mean_abs: convert(self.absolute.mean().unwrap_or_default()),
            sd_abs: self.absolute.deviation().map(&convert),
            rms: convert((self.squares / self.plain.count().max(1.0)).sqrt()),
            max_abs: convert(largest),
            worst_row: row + 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_sample_by_hand() {
        let mut running = Running::default();
        for (row, value) in [-1.0, 2.0, -3.0, 3.0].into_iter().enumerate() {
            running.push(row, value);
        }
        let found = running.statistics(|value| 10.0 * value);
        assert_eq!((found.mean, found.mean_abs, found.max_abs, found.worst_row), (2.5, 22.5, 30.0, 3));
        assert!((found.sd.unwrap() - 10.0 * (22.75f64 / 3.0).sqrt()).abs() < 1e-13);
        assert!((found.sd_abs.unwrap() - 10.0 * (2.75f64 / 3.0).sqrt()).abs() < 1e-13);
        assert!((found.rms - 10.0 * 5.75f64.sqrt()).abs() < 1e-13);
    }

    #[test]
    fn a_single_row_has_no_deviation_and_a_large_mean_costs_no_digits() {
        let mut running = Running::default();
        running.push(0, 1e9);
        assert_eq!(running.statistics(|value| value).sd, None);
        running.push(1, 1e9 + 1.0);
        running.push(2, 1e9 + 2.0);
        assert_eq!(running.statistics(|value| value).sd, Some(1.0));
    }
}
