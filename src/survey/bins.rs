//! Numbers counted in bins, so that a figure does not grow with their number.

use crate::statistics::{Moments, mad_scale, median};

/// Numbers farther from the median than so many standard deviations (by the median of deviations) are beyond an axis, where they would
/// leave no room for the others.
const FAR: f64 = 8.0;

/// From where to where an axis goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// where it begins
    pub low: f64,
    /// where it ends, above `low`
    pub high: f64,
}

impl Span {
    /// An axis for numbers; what lies very far from most of them may be beyond it. None where none is finite.
    pub fn of<'v>(values: impl IntoIterator<Item = &'v f64>) -> Option<Span> {
        let mut values: Vec<f64> = values.into_iter().copied().filter(|value| value.is_finite()).collect();
        let scale = mad_scale(&values)?;
        let middle = median(&mut values)?;
        let (low, high) = values.iter().fold((middle, middle), |(low, high), &x| (low.min(x), high.max(x)));
        let (low, high) = match scale > 0.0 {
            true => (low.max(middle - FAR * scale), high.min(middle + FAR * scale)),
            false => (low, high),
        };
        Some(Span { low, high }.widened())
    }

    /// The same, or around the one number that it is.
    #[must_use]
    pub fn widened(self) -> Span {
        let Span { low, high } = self;
        if high - low > 1e-12 * low.abs().max(high.abs()) && (high - low).is_normal() {
            return self;
        }
        let half = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
        Span { low: low - half, high: high + half }
    }

    /// The smallest that has both.
    #[must_use]
    pub fn with(self, other: Span) -> Span {
        Span { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Where a number is: 0 at `low`, 1 at `high`.
    pub fn share(self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// The bin of so many in which a number is; the upper end belongs to the last.
    pub fn bin(self, value: f64, bins: usize) -> Option<usize> {
        let share = self.share(value);
        let inside = (0.0..=1.0).contains(&share) && bins > 0;
        inside.then(|| ((share * bins as f64) as usize).min(bins - 1))
    }
}

/// How many numbers are in each of some equal bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// from where to where
    pub span: Span,
    /// by bin
    pub counts: Vec<usize>,
    /// how many lie beyond
    pub beyond: usize,
    /// of all numbers
    pub moments: Moments,
}

impl Histogram {
    /// Of some numbers; none of none. √n bins, from 8 to 40.
    ///
    /// ```
    /// use phical::survey::Histogram;
    /// let h = Histogram::of(&[0.0, 1.0, 1.0, 2.0]).unwrap();
    /// assert_eq!((h.counts, h.beyond), (vec![1, 0, 0, 0, 2, 0, 0, 1], 0));
    /// ```
    pub fn of(values: &[f64]) -> Option<Histogram> {
        let span = Span::of(values)?;
        let bins = ((values.len() as f64).sqrt() as usize).clamp(8, 40);
        let mut counts = vec![0; bins];
        let (mut beyond, mut moments) = (0, Moments::default());
        for &value in values.iter().filter(|value| value.is_finite()) {
            moments.push(value);
            match span.bin(value, bins).and_then(|bin| counts.get_mut(bin)) {
                Some(count) => *count += 1,
                None => beyond += 1,
            }
        }
        Some(Histogram { span, counts, beyond, moments })
    }

    /// The width of a bin.
    pub fn width(&self) -> f64 {
        (self.span.high - self.span.low) / self.counts.len() as f64
    }
}

/// How many points are in each cell of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Density {
    /// columns of cells
    pub across: usize,
    /// by row of cells from below, then by column
    pub counts: Vec<usize>,
    /// how many lie beyond
    pub beyond: usize,
}

impl Density {
    /// Of points within two spans.
    pub fn of(points: impl Iterator<Item = (f64, f64)>, x: Span, y: Span, across: usize, up: usize) -> Density {
        let (mut counts, mut beyond) = (vec![0; across * up], 0);
        for (px, py) in points {
            let cell = x.bin(px, across).zip(y.bin(py, up)).map(|(i, j)| j * across + i);
            match cell.and_then(|cell| counts.get_mut(cell)) {
                Some(count) => *count += 1,
                None => beyond += 1,
            }
        }
        Density { across, counts, beyond }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every number is in one bin or beyond, and the bins are where they say.
        #[test]
        fn nothing_is_lost(values in prop::collection::vec(prop::num::f64::ANY, 1..200)) {
            let finite = values.iter().filter(|value| value.is_finite()).count();
            match Histogram::of(&values) {
                None => prop_assert_eq!(finite, 0),
                Some(found) => {
                    prop_assert_eq!(found.counts.iter().sum::<usize>() + found.beyond, finite);
                    prop_assert!(found.span.low < found.span.high || !(found.span.high - found.span.low).is_finite());
                }
            }
        }

        #[test]
        fn a_bin_holds_what_is_between_its_ends(value in -10.0..10.0, low in -10.0..0.0, width in 0.1..10.0, bins in 1usize..50) {
            let span = Span { low, high: low + width };
            match span.bin(value, bins) {
                None => prop_assert!(value < span.low || value > span.high),
                Some(bin) => {
                    let (from, to) = (low + width * bin as f64 / bins as f64, low + width * (bin + 1) as f64 / bins as f64);
                    prop_assert!(from - 1e-12 <= value && value <= to + 1e-12);
                }
            }
        }
    }

    #[test]
    fn one_wild_number_does_not_flatten_the_others() {
        let mut values: Vec<f64> = (0..100).map(|i| f64::from(i) / 100.0).collect();
        values.push(1e9);
        let found = Histogram::of(&values).unwrap();
        assert_eq!((found.beyond, found.span.high < 10.0), (1, true));
    }
}
