//! Numbers that were written with few digits.

/// How a matrix was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// With so many significant digits.
    Digits(usize),
    /// With so many places after the point.
    Decimals(usize),
    /// As single-precision numbers.
    Single,
}

/// Digits that are looked for.
const DIGITS: std::ops::RangeInclusive<usize> = 2..=14;

impl Precision {
    /// What that is called.
    pub fn sentence(self) -> String {
        match self {
            Precision::Digits(digits) => format!("it was written with {digits} significant digits"),
            Precision::Decimals(places) => format!("it was written with {places} places after the point"),
            Precision::Single => "it went through single-precision numbers".to_owned(),
        }
    }

    /// What of a number is lost, at most.
    pub(super) fn error(self, value: f64) -> f64 {
        match self {
            Precision::Digits(_) if value == 0.0 => 0.0,
            Precision::Digits(digits) => 0.51 * 10_f64.powi(value.abs().log10().floor() as i32 + 1 - digits as i32),
            Precision::Decimals(places) => 0.51 * 10_f64.powi(-(places as i32)),
            Precision::Single => 0.51 * f64::from(f32::EPSILON) * value.abs() + f64::from(f32::MIN_POSITIVE),
        }
    }
}

/// How numbers were written, if with fewer digits than they have.
pub(super) fn precision(all: &[f64]) -> Option<Precision> {
    if all.iter().all(|x| x.fract() == 0.0) {
        return None;
    }
    let written = |format: &dyn Fn(f64) -> String| all.iter().all(|&x| format(x).parse() == Ok(x));
    // single-precision numbers written out have few digits, but not as doubles
    if all.iter().all(|&x| f64::from(x as f32) == x) {
        return Some(Precision::Single);
    }
    DIGITS.into_iter().find_map(|digits| {
        if written(&|x| format!("{x:.*e}", digits - 1)) {
            Some(Precision::Digits(digits))
        } else if written(&|x| format!("{x:.digits$}")) {
            Some(Precision::Decimals(digits))
        } else {
            None
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_counted() {
        let numbers = [std::f64::consts::PI, -2_400.123_456_789, 0.000_123_456_789];
        let with = |format: &dyn Fn(f64) -> String| numbers.map(|x| format(x).parse::<f64>().unwrap());
        assert_eq!(precision(&numbers), None);
        assert_eq!(precision(&with(&|x| format!("{x:.4e}"))), Some(Precision::Digits(5)));
        assert_eq!(precision(&with(&|x| format!("{x:.5}"))), Some(Precision::Decimals(5)));
        assert_eq!(precision(&numbers.map(|x| f64::from(x as f32))), Some(Precision::Single));
        assert_eq!(precision(&[1.0, 0.0, -1.0]), None);
        for (given, exact) in with(&|x| format!("{x:.4e}")).iter().zip(numbers) {
            assert!((given - exact).abs() <= Precision::Digits(5).error(exact));
        }
    }
}
