//! The only comparison of two numbers.

/// Whether a number is the expected one, within a tolerance that is absolute. What is not a number, or is infinite, is so
/// exactly; zero has no sign.
pub(super) fn agree(found: f64, expected: f64, tolerance: f64) -> bool {
    if expected.is_nan() {
        return found.is_nan();
    }
    if expected.is_infinite() || found.is_infinite() {
        return found == expected;
    }
    (found - expected).abs() <= tolerance
}

/// So many units in the last place of x.
pub(super) fn ulps(x: f64, n: f64) -> f64 {
    let x = x.abs().min(f64::MAX.next_down());
    n * (x.next_up() - x)
}

#[test]
fn the_comparison_tells_right_from_wrong() {
    let (inf, nan) = (f64::INFINITY, f64::NAN);
    for (found, expected, tolerance, same) in [
        (1.0, 1.0, 0.0, true),
        (0.0, -0.0, 0.0, true),
        (1.0 + 2.0 * f64::EPSILON, 1.0, f64::EPSILON, false),
        (1.0 - 2.0 * f64::EPSILON, 1.0, f64::EPSILON, false),
        (1.0 + f64::EPSILON, 1.0, f64::EPSILON, true),
        (-1.0, 1.0, 1.0, false),
        (nan, nan, 0.0, true),
        (nan, 1.0, 1.0, false),
        (1.0, nan, 1.0, false),
        (1.0, nan, inf, false),
        (inf, nan, inf, false),
        (nan, inf, inf, false),
        (inf, inf, 0.0, true),
        (-inf, inf, inf, false),
        (inf, f64::MAX, 1.0, false),
        (f64::MAX, inf, 1.0, false),
        (1.0, 1.0, nan, false),
    ] {
        assert_eq!(agree(found, expected, tolerance), same, "{found} {expected} {tolerance}");
    }
}

#[test]
fn a_unit_in_the_last_place_is_the_distance_to_the_next_number() {
    assert_eq!(ulps(1.0, 1.5), 1.5 * f64::EPSILON);
    assert_eq!(ulps(-1.0, 1.0), f64::EPSILON);
    assert_eq!(ulps(0.0, 1.0), 5e-324);
    assert!(ulps(f64::MAX, 1.0).is_finite() && ulps(f64::INFINITY, 1.0).is_finite());
}
