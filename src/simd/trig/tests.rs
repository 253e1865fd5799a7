use super::*;
use crate::simd::InstructionSet;
use proptest::prelude::*;
use pulp::WithSimd;
use std::f64::consts::FRAC_PI_2;

/// (sin, cos) of every angle, by `sin_cos` or by polynomials with other coefficients.
struct Angles<'a>(&'a [f64], Option<(&'a [f64; 6], &'a [f64; 6])>);

impl WithSimd for Angles<'_> {
    type Output = Vec<(f64, f64)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut found = Vec::new();
        for chunk in self.0.chunks(S::F64_LANES) {
            let x = simd.partial_load_f64s(chunk);
            let (sin, cos) = match self.1 {
                None => sin_cos(simd, x),
                Some((sin, cos)) => near_by(simd, x, sin, cos),
            };
            let lanes = |v: &S::f64s| bytemuck::cast_slice::<S::f64s, f64>(std::slice::from_ref(v)).to_vec();
            found.extend(lanes(&sin).into_iter().zip(lanes(&cos)).take(chunk.len()));
        }
        found
    }
}

/// How many units in the last place lie between two numbers; none between two NaN.
fn apart(a: f64, b: f64) -> f64 {
    if a.is_nan() && b.is_nan() {
        return 0.0;
    }
    let unit = (b.abs().next_up() - b.abs()).max(f64::from_bits(1));
    // NaN is apart from every number
    let apart = (a - b).abs() / unit;
    if apart.is_nan() { f64::INFINITY } else { apart }
}

/// The largest distance from the standard library, whose own error is about half a unit.
fn worst(found: &[(f64, f64)], angles: &[f64]) -> f64 {
    found
        .iter()
        .zip(angles)
        .fold(0.0, |worst: f64, (&(sin, cos), x)| worst.max(apart(sin, x.sin())).max(apart(cos, x.cos())))
}

fn angle() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -4.0..4.0,
        4 => -LIMIT..LIMIT,
        // doubles next to multiples of π/2
        4 => (-63_662_i32..=63_662, -3_i64..=3).prop_map(|(n, steps)| {
            let x = f64::from(n) * FRAC_PI_2;
            if n == 0 { 0.0 } else { f64::from_bits(x.to_bits().wrapping_add_signed(steps)) }
        }),
        // halfway between them, where n turns
        2 => (-63_662_i32..=63_662).prop_map(|n| (f64::from(n) + 0.5) * FRAC_PI_2),
        1 => any::<f64>(),
        1 => prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        1 => prop::sample::select(vec![
            f64::NAN, f64::INFINITY, f64::NEG_INFINITY, LIMIT, -LIMIT, LIMIT.next_up(), f64::MAX, f64::MIN_POSITIVE, -0.0,
        ]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Within one unit of a value that is itself within half a unit: 1.5 units at most.
    #[test]
    fn agrees_with_the_standard_library(angles in prop::collection::vec(angle(), 1..20)) {
        let negative: Vec<f64> = angles.iter().map(|x| -x).collect();
        for set in InstructionSet::available() {
            let found = set.run(Angles(&angles, None));
            prop_assert!(worst(&found, &angles) <= 1.0, "{}: {angles:?} {found:?}", set.name());
            for (x, ((sin, cos), (mirrored_sin, mirrored_cos))) in
                angles.iter().zip(found.iter().zip(set.run(Angles(&negative, None))))
            {
                if x.is_finite() {
                    prop_assert_eq!(sin.to_bits(), (-mirrored_sin).to_bits());
                    prop_assert_eq!(cos.to_bits(), mirrored_cos.to_bits());
                } else {
                    prop_assert!(sin.is_nan() && cos.is_nan());
                }
            }
        }
    }
}

#[test]
fn next_to_every_multiple_of_a_quarter_turn() {
    let angles: Vec<f64> = (-63_661..=63_661)
        .flat_map(|n| {
            let x = f64::from(n) * FRAC_PI_2;
            [x.next_down(), x, x.next_up()]
        })
        .collect();
    for set in InstructionSet::available() {
        assert!(worst(&set.run(Angles(&angles, None)), &angles) <= 1.0, "{}", set.name());
    }
}

#[test]
fn zero_stays_zero_with_its_sign() {
    for set in InstructionSet::available() {
        let found = set.run(Angles(&[0.0, -0.0, 5e-324], None));
        let bits: Vec<u64> = found.iter().map(|(sin, _)| sin.to_bits()).collect();
        assert_eq!(bits, [0.0_f64.to_bits(), (-0.0_f64).to_bits(), 1], "{}", set.name());
        assert!(found.iter().all(|&(_, cos)| cos == 1.0));
    }
}

/// A mutant: with any coefficient off by a share that its term can show, the comparison fails.
#[test]
fn the_comparison_notices_a_wrong_coefficient() {
    let angles: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.001 - 1.0).collect();
    for set in InstructionSet::available() {
        assert!(worst(&set.run(Angles(&angles, Some((&SIN, &COS)))), &angles) <= 1.0);
        for k in 0..6 {
            // every term is some hundred times smaller than the one before
            let share = 1e-13 * 200.0_f64.powi(k);
            let (mut sin, mut cos) = (SIN, COS);
            let k = usize::try_from(k).unwrap();
            sin[k] *= 1.0 + share;
            assert!(worst(&set.run(Angles(&angles, Some((&sin, &COS)))), &angles) > 1.0, "sine, {k}");
            cos[k] *= 1.0 + share;
            assert!(worst(&set.run(Angles(&angles, Some((&SIN, &cos)))), &angles) > 1.0, "cosine, {k}");
        }
    }
}
