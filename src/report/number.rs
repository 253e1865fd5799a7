//! Numbers with as many digits as they deserve.

/// Beyond so many decimals, a power of ten is written.
const MOST_DECIMALS: i32 = 9;

/// The power of ten of the first digit.
fn exponent(value: f64) -> i32 {
    if value == 0.0 || !value.is_finite() {
        return 0;
    }
    // the digits as printed decide, so that 0.0999… counts as 0.1
    let text = format!("{value:e}");
    text.split_once('e').and_then(|(_, power)| power.parse().ok()).unwrap_or(0)
}

/// A value and its standard uncertainty: two significant digits of the uncertainty, and the value to the same place.
///
/// ```
/// use phical::report::with_sigma;
/// assert_eq!(with_sigma(2405.00134, 0.00417), ("2405.0013".into(), "0.0042".into()));
/// assert_eq!(with_sigma(5.5e-12, 7.31e-14), ("5.500e-12".into(), "0.073e-12".into()));
/// ```
pub fn with_sigma(value: f64, sigma: f64) -> (String, String) {
    if !(sigma > 0.0 && sigma.is_finite()) {
        return (significant(value, 9), significant(sigma, 2));
    }
    let rounded: f64 = format!("{sigma:.1e}").parse().unwrap_or(sigma);
    let last = exponent(rounded) - 1;
    let largest = exponent(value.abs().max(rounded));
    if -last > MOST_DECIMALS || last > 0 {
        let (scale, decimals) = (10f64.powi(largest), usize::try_from(largest - last).unwrap_or(0).min(17));
        let power = if largest == 0 { String::new() } else { format!("e{largest}") };
        return (
            format!("{}{power}", fixed(value / scale, decimals)),
            format!("{}{power}", fixed(rounded / scale, decimals)),
        );
    }
    let decimals = usize::try_from(-last).unwrap_or(0);
    (fixed(value, decimals), fixed(rounded, decimals))
}

/// More digits say nothing of a double: with so many, each has a text of its own.
const MOST_DIGITS: usize = 17;

/// At most so many significant digits, and seventeen, without trailing zeros; a power of ten where the number is very large or small.
///
/// ```
/// use phical::report::significant;
/// assert_eq!(significant(0.0482713, 3), "0.0483");
/// assert_eq!(significant(2400.0, 6), "2400");
/// assert_eq!(significant(-1.25e-9, 6), "-1.25e-9");
/// ```
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let digits = digits.min(MOST_DIGITS);
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    let (mantissa, written) = text.split_once('e').unwrap_or((&text, "0"));
    let power: i32 = written.parse().unwrap_or(0);
    let digits = i32::try_from(digits).unwrap_or(i32::MAX);
    if power < -4 || power >= digits.max(6) {
        return format!("{}e{power}", trimmed(mantissa));
    }
    let rounded: f64 = text.parse().unwrap_or(value);
    let decimals = usize::try_from(digits - 1 - power).unwrap_or(0);
    trimmed(&fixed(rounded, decimals)).to_owned()
}

/// So many significant digits, at most seventeen, zeros at the end too: for what was measured, where they mean something.
///
/// ```
/// use phical::report::rounded;
/// assert_eq!((rounded(0.525, 4), rounded(0.0, 4)), ("0.5250".into(), "0".into()));
/// ```
pub fn rounded(value: f64, digits: usize) -> String {
    let digits = digits.min(MOST_DIGITS);
    let short = significant(value, digits);
    let places = short.bytes().filter(u8::is_ascii_digit).count();
    let leading = short.trim_start_matches('-').bytes().take_while(|byte| matches!(byte, b'0' | b'.'));
    let known = places - leading.filter(|byte| *byte == b'0').count();
    if value == 0.0 || !value.is_finite() || short.contains('e') || known >= digits {
        return short;
    }
    let zeros = "0".repeat(digits - known);
    if short.contains('.') { short + &zeros } else { format!("{short}.{zeros}") }
}

/// Decimals, but no minus before nothing.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|byte| byte == b'0' || byte == b'.') => rest.to_owned(),
        _ => text,
    }
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigma_has_two_digits_and_the_value_ends_where_it_does() {
        for (value, sigma, wanted) in [
            (1.5807963, 0.0000123, ("1.580796", "0.000012")),
            (-0.00002, 0.00123, ("0.0000", "0.0012")),
            (238.94212918, 2.7070075, ("238.9", "2.7")),
            (5.5e-4, 7.27e-6, ("0.0005500", "0.0000073")),
            (1.0, 0.0996, ("1.00", "0.10")),
            (12345.6, 12.3, ("12346", "12")),
            (1.23456e7, 4321.0, ("1.23456e7", "0.00043e7")),
            (0.0, 3e-14, ("0.0e-14", "3.0e-14")),
        ] {
            let (found, uncertainty) = with_sigma(value, sigma);
            assert_eq!((found.as_str(), uncertainty.as_str()), wanted);
        }
    }

    #[test]
    fn significant_digits_at_the_edges() {
        for (value, digits, wanted) in [
            (999_999.7, 6, "1e6"),
            (99_999.97, 6, "100000"),
            (1e-5, 3, "1e-5"),
            (0.00012345, 3, "0.000123"),
            (-3.0, 9, "-3"),
            (1234567.0, 9, "1234567"),
            (f64::MAX, 3, "1.8e308"),
        ] {
            assert_eq!(significant(value, digits), wanted);
        }
        for hostile in [f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, f64::EPSILON, -0.0] {
            let _ = (significant(hostile, 1), with_sigma(hostile, hostile), with_sigma(1.0, hostile));
        }
    }
}
