//! What every kernel needs and pulp has not.

use std::any::TypeId;

use pulp::Simd;

/// a b + c, fused where the instruction set has it. pulp's own forms are exact on the baseline too, at the price of a
/// library call for every number.
#[inline(always)]
pub(crate) fn mul_add<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
    // known when compiled: one branch is left
    if TypeId::of::<S>() == TypeId::of::<pulp::Scalar256b>() {
        simd.add_f64s(simd.mul_f64s(a, b), c)
    } else {
        simd.mul_add_e_f64s(a, b, c)
    }
}

/// c − a b, likewise.
#[inline(always)]
pub(crate) fn neg_mul_add<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
    if TypeId::of::<S>() == TypeId::of::<pulp::Scalar256b>() {
        simd.sub_f64s(c, simd.mul_f64s(a, b))
    } else {
        simd.negate_mul_add_e_f64s(a, b, c)
    }
}

/// max |xᵢ|; infinite where an entry is NaN.
pub(crate) fn largest_of(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |largest, x_i| if x_i.is_nan() { f64::INFINITY } else { x_i.abs().max(largest) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::InstructionSet;
    use pulp::WithSimd;

    struct Fused;

    impl WithSimd for Fused {
        type Output = f64;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> f64 {
            let a = simd.splat_f64s(1.0 + f64::EPSILON);
            simd.reduce_max_f64s(mul_add(simd, a, a, simd.splat_f64s(-1.0 - 2.0 * f64::EPSILON)))
        }
    }

    #[test]
    fn only_the_baseline_rounds_the_product() {
        for set in InstructionSet::available() {
            // (1 + ε)² = 1 + 2 ε + ε², of which a double holds all but ε²
            let left = if set == InstructionSet::Baseline { 0.0 } else { f64::EPSILON * f64::EPSILON };
            assert_eq!(set.run(Fused), left, "{}", set.name());
        }
    }

    #[test]
    fn the_largest_notices_what_is_no_number() {
        assert_eq!(largest_of(&[]), 0.0);
        assert_eq!(largest_of(&[1.0, -3.0, 2.0]), 3.0);
        assert_eq!(largest_of(&[1.0, f64::NAN, 2.0]), f64::INFINITY);
    }
}
