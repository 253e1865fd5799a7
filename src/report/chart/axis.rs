//! Where numbers stand on an axis, and which of them are written beside it.

use crate::report::number::significant;
use crate::survey::Span;

/// Ticks that there should be about.
const TICKS: f64 = 5.0;

/// An axis: from where to where, by the number or by its logarithm.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    span: Span,
    logarithmic: bool,
    /// what it shows
    pub(super) label: String,
}

impl Axis {
    /// By the number.
    pub(super) fn linear(span: Span, label: impl Into<String>) -> Axis {
        Axis { span: span.widened(), logarithmic: false, label: label.into() }
    }

    /// By the logarithm of positive numbers.
    pub(super) fn logarithmic(span: Span, label: impl Into<String>) -> Axis {
        let span = Span { low: span.low.log10(), high: span.high.log10() };
        // whole decades, so that there are at least two ticks
        let span = Span { low: span.low.floor(), high: span.high.ceil().max(span.low.floor() + 1.0) };
        Axis { span, logarithmic: true, label: label.into() }
    }

    /// The same with a little room at both ends.
    pub(super) fn roomy(mut self) -> Axis {
        let room = 0.04 * (self.span.high - self.span.low);
        self.span = Span { low: self.span.low - room, high: self.span.high + room };
        self
    }

    /// Where a number is: 0 at the low end, 1 at the high; none where it is not a number of the axis.
    pub(super) fn place(&self, value: f64) -> Option<f64> {
        let value = if self.logarithmic { value.log10() } else { value };
        let share = self.span.share(value);
        share.is_finite().then_some(share)
    }

    /// Round numbers on the axis, where they are, and how they are written.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        match self.logarithmic {
            true => self.decades(),
            false => self.steps(),
        }
    }

    fn decades(&self) -> Vec<(f64, String)> {
        let (low, high) = (self.span.low.ceil() as i64, self.span.high.floor() as i64);
        let every = ((high - low) / 6 + 1).max(1);
        let tick = |power: i64| (self.span.share(power as f64), format!("1e{power}"));
        (low..=high).filter(|power| (power - low) % every == 0).map(tick).collect()
    }

    fn steps(&self) -> Vec<(f64, String)> {
        let range = self.span.high - self.span.low;
        let rough = range / TICKS;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|k| k * power).find(|step| *step >= rough * 0.999);
        let step = step.unwrap_or(range);
        if !(step.is_normal() && self.span.low.abs().max(self.span.high.abs()) / step < 1e12) {
            return Vec::new();
        }
        let (first, last) = ((self.span.low / step).ceil() as i64, (self.span.high / step).floor() as i64);
        let tick = |k: i64| {
            let value = k as f64 * step;
            // as many digits as tell one tick from the next
            let digits = (value.abs() / step).log10().max(0.0) as usize + 2;
            (self.span.share(value), significant(value, digits.min(15)))
        };
        (first..=last).map(tick).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(labels(&Axis::linear(Span { low: -0.31, high: 0.42 }, "")), ["-0.2", "0", "0.2", "0.4"]);
        assert_eq!(labels(&Axis::linear(Span { low: 2400.001, high: 2400.0035 }, "")).first().unwrap(), "2400.001");
        assert_eq!(
            labels(&Axis::logarithmic(Span { low: 0.02, high: 30.0 }, "")),
            ["1e-2", "1e-1", "1e0", "1e1", "1e2"]
        );
    }

    proptest! {
        /// A few ticks, in order, on the axis, told apart by what is written.
        #[test]
        fn ticks_are_few_and_differ(low in -1e9..1e9f64, width in 1e-3..1e9f64) {
            let axis = Axis::linear(Span { low, high: low + width }, "");
            let ticks = axis.ticks();
            prop_assert!((2..=12).contains(&ticks.len()), "{ticks:?}");
            for (one, next) in ticks.iter().zip(ticks.iter().skip(1)) {
                prop_assert!(one.0 < next.0 && one.1 != next.1, "{ticks:?}");
            }
            prop_assert!(ticks.iter().all(|(share, _)| (-1e-6..=1.0 + 1e-6).contains(share)));
            for (share, label) in &ticks {
                let said: f64 = label.parse().unwrap();
                prop_assert!((axis.place(said).unwrap() - share).abs() < 0.05);
            }
        }
    }
}
