//! The only comparison of numbers in these tests, itself tested.

/// The largest |found − expected| over the largest |expected|; infinite where the lengths differ or anything is not finite.
pub fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    if found.len() != expected.len() || found.iter().chain(expected).any(|value| !value.is_finite()) {
        return f64::INFINITY;
    }
    let largest = expected.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
    let worst = found.iter().zip(expected).fold(0.0f64, |worst, (f, e)| worst.max((f - e).abs()));
    if worst == 0.0 { 0.0 } else { worst / largest }
}

/// Asserts that two lists agree to a share of the largest expected entry.
#[track_caller]
pub fn close(found: &[f64], expected: &[f64], relative: f64, what: &str) {
    let error = relative_error(found, expected);
    assert!(
        error <= relative,
        "{what}: off by {error:e} of the largest, {relative:e} is allowed\nfound    {found:?}\nexpected {expected:?}"
    );
}

/// How many decimal digits agree: the logarithm of the relative error.
pub fn digits(found: f64, expected: f64) -> f64 {
    -relative_error(&[found], &[expected]).max(1e-17).log10()
}

#[test]
fn the_comparison_can_fail() {
    assert_eq!(relative_error(&[1.0, 2.0], &[1.0, 2.0]), 0.0);
    assert!((relative_error(&[1.0, -2.1], &[1.0, -2.0]) - 0.05).abs() < 1e-15);
    assert!((relative_error(&[1.0, -1.9], &[1.0, -2.0]) - 0.05).abs() < 1e-15);
    assert_eq!(relative_error(&[1.0], &[1.0, 2.0]), f64::INFINITY);
    assert_eq!(relative_error(&[f64::NAN], &[f64::NAN]), f64::INFINITY);
    assert_eq!(relative_error(&[1e-9], &[0.0]), f64::INFINITY);
    assert!(std::panic::catch_unwind(|| close(&[1.0], &[1.1], 1e-3, "test")).is_err());
    assert!((digits(1.0001, 1.0) - 4.0).abs() < 1e-3);
}
