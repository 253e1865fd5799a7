//! Numbers as people write them: without the last digit that rounding has made, and angles as parts of π.

use std::f64::consts::PI;

/// A part of π this near is meant, in radians.
const NEAR: f64 = 5e-15;

/// Parts of a half turn that have a name.
const PARTS: f64 = 12.0;

/// Digits beyond which a number is written in full.
const FEW: usize = 12;

/// Whether a length is nothing but rounding, in a chain of some reach.
pub(super) fn nil(length: f64, reach: f64) -> bool {
    length.abs() <= 1e-15 * reach
}

/// Whether an angle is a multiple of π/12, but for rounding.
pub(super) fn is_nice(angle: f64) -> bool {
    (angle - nearest_part(angle) * (PI / PARTS)).abs() < NEAR
}

fn nearest_part(angle: f64) -> f64 {
    (angle / (PI / PARTS)).round()
}

/// The angle itself where it is no multiple of π/12, else the multiple.
pub(super) fn tidy_angle(angle: f64) -> f64 {
    if is_nice(angle) { nearest_part(angle) * PI / PARTS } else { angle }
}

/// `"-pi/2"` between quotes, or a number of radians.
pub(super) fn angle_text(angle: f64) -> String {
    if !is_nice(angle) {
        return number_text(angle, 1.0);
    }
    let part = nearest_part(angle);
    if part == 0.0 {
        return "0".into();
    }
    let (mut over, mut under) = (part.abs(), PARTS);
    for divisor in [2.0, 2.0, 3.0] {
        if over % divisor == 0.0 && under % divisor == 0.0 {
            (over, under) = (over / divisor, under / divisor);
        }
    }
    let sign = if part < 0.0 { "-" } else { "" };
    let times = if over == 1.0 { "pi".to_owned() } else { format!("{over:.0}*pi") };
    let slash = if under == 1.0 { String::new() } else { format!("/{under:.0}") };
    format!("\"{sign}{times}{slash}\"")
}

/// A number with few digits where those are meant, in units of some scale; else the shortest that reads back as the same.
pub(super) fn number_text(value: f64, scale: f64) -> String {
    if nil(value, scale) {
        return "0".into();
    }
    let shorter = format!("{value:.*e}", FEW - 1).parse::<f64>().unwrap_or(value);
    let meant = if (shorter - value).abs() <= 4e-16 * scale.max(value.abs()) { shorter } else { value };
    if meant.fract() == 0.0 && meant.abs() < 1e15 { format!("{meant:.0}") } else { format!("{meant:?}") }
}

/// A number of a cell or an attribute: decimal, or a part of π such as `-pi/2` or `2*pi/3`.
pub(super) fn read_number(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Ok(value) = text.parse::<f64>() {
        return Some(value);
    }
    let (sign, rest) = match text.strip_prefix(['-', '−']) {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let (before, after) = rest.split_once("pi").or_else(|| rest.split_once('π'))?;
    let positive = |text: &str| text.trim().parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
    let times = match before.trim() {
        "" => 1.0,
        before => positive(before.trim_end_matches('*'))?,
    };
    let over = match after.trim() {
        "" => 1.0,
        after => positive(after.strip_prefix('/')?)?,
    };
    Some(sign * times * PI / over)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_parts_of_pi() {
        for (angle, text) in [
            (PI / 2.0, "\"pi/2\""),
            (-PI, "\"-pi\""),
            (2.0 * PI / 3.0, "\"2*pi/3\""),
            (-5.0 * PI / 12.0, "\"-5*pi/12\""),
            (3e-16, "0"),
            (1.57, "1.57"),
            (0.1 + 0.2, "0.3"),
        ] {
            assert_eq!(angle_text(angle), text);
        }
    }

    #[test]
    fn what_rounding_made_is_left_out_and_nothing_else() {
        assert_eq!(number_text(0.089_459_000_000_000_01, 1.0), "0.089459");
        assert_eq!(number_text(0.089_459_000_001, 1.0), "0.089459000001");
        assert_eq!(number_text(1.0 / 3.0, 1.0), format!("{:?}", 1.0 / 3.0));
        assert_eq!(number_text(-425.0, 1000.0), "-425");
        assert_eq!(number_text(1e-17, 1.0), "0");
    }

    #[test]
    fn parts_of_pi_are_read() {
        assert_eq!(read_number(" -pi/2 "), Some(-PI / 2.0));
        assert_eq!(read_number("2*pi/3"), Some(2.0 * PI / 3.0));
        assert_eq!(read_number("1e-3"), Some(1e-3));
        for wrong in ["", "p", "pi2", "2pi*3", "pi/0", "--1", "1,5"] {
            assert_eq!(read_number(wrong), None, "{wrong}");
        }
    }
}
