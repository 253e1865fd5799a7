//! Sine and cosine of many angles at a time.
//!
//! An angle is x = n π/2 + r + y with n whole, |r| ≤ π/4 and y what r leaves of the sum: Cody & Waite, Software Manual for
//! the Elementary Functions (1980), chapter 8, with π/2 in three parts. Two polynomials give sin(r + y) and cos(r + y):
//! the kernels of fdlibm (`k_sin.c`, `k_cos.c`; Sun Microsystems, 1993). n modulo 4 says which is which.

use pulp::{Simd, bytemuck};

use super::{mul_add, neg_mul_add};

/// Beyond this |x| the three parts of π/2 do not carry enough digits, and the standard library is asked.
const LIMIT: f64 = 1e5;

/// π/2 = P1 + P2 + P3 to 2⁻¹³⁰. P1 and P2 have 35 bits, so that n P1 and n P2 are exact: n ≤ 2/π `LIMIT` < 2¹⁶.
const P1: f64 = 1.570_796_326_792_333_3;
const P2: f64 = 2.563_344_151_583_955_8e-12;
const P3: f64 = 1.056_299_906_698_742_8e-23;

/// Added to a number below 2⁵¹, it leaves the nearest whole number in the last bits.
const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;

/// sin r ≈ r + r³ (S₀ + S₁ r² + …), |r| ≤ π/4.
const SIN: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// cos r ≈ 1 − r²/2 + r⁴ (C₀ + C₁ r² + …), |r| ≤ π/4.
const COS: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// (sin x, cos x), each within 1.5 units in the last place; NaN where x is not finite. sin(−x) = −sin x and
/// cos(−x) = cos x to the bit.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(simd: S, x: S::f64s) -> (S::f64s, S::f64s) {
    let (sin, cos) = near_sin_cos(simd, x);
    if near_all(simd, x) { (sin, cos) } else { far_sin_cos::<S>(x, sin, cos) }
}

/// Whether all |x| ≤ `LIMIT`, and none is NaN.
#[inline(always)]
pub(crate) fn near_all<S: Simd>(simd: S, x: S::f64s) -> bool {
    let near = simd.less_than_or_equal_f64s(simd.abs_f64s(x), simd.splat_f64s(LIMIT));
    simd.first_true_m64s(simd.not_m64s(near)) == S::F64_LANES
}

/// The same where |x| ≤ `LIMIT`, without a branch; it is for the caller to ask [`near_all`] before.
#[inline(always)]
pub(crate) fn near_sin_cos<S: Simd>(simd: S, x: S::f64s) -> (S::f64s, S::f64s) {
    near_by(simd, x, &SIN, &COS)
}

/// The same by polynomials with the given coefficients.
#[inline(always)]
fn near_by<S: Simd>(simd: S, x: S::f64s, sin: &[f64; 6], cos: &[f64; 6]) -> (S::f64s, S::f64s) {
    let splat = |value| simd.splat_f64s(value);
    let whole = mul_add(simd, x, splat(std::f64::consts::FRAC_2_PI), splat(WHOLE));
    let n = simd.sub_f64s(whole, splat(WHOLE));
    // exact: x and n P1 are multiples of the last bit of the difference, which is less than 1
    let first = neg_mul_add(simd, n, splat(P1), x);
    let high = neg_mul_add(simd, n, splat(P2), first);
    // what `high` rounded away, and the third part: r + y = high − low (Dekker's fast two-sum, whose condition holds
    // because every bit of `first` weighs more than the last bit of n P2)
    let rounded = neg_mul_add(simd, n, splat(P2), simd.sub_f64s(first, high));
    let low = simd.sub_f64s(simd.mul_f64s(n, splat(P3)), rounded);
    let r = simd.sub_f64s(high, low);
    let y = simd.sub_f64s(simd.sub_f64s(high, r), low);

    let (sin_r, cos_r) = (sin_kernel(simd, r, y, sin), cos_kernel(simd, r, y, cos));
    // n modulo 4 in the last two bits; 1 and 3 swap sine and cosine, 2 and 3 turn the sine's sign, 1 and 2 the cosine's
    let bits = simd.transmute_u64s_f64s(whole);
    let (one, two) = (simd.splat_u64s(1), simd.splat_u64s(2));
    let swapped = simd.equal_u64s(simd.and_u64s(bits, one), one);
    let sin_turned = simd.equal_u64s(simd.and_u64s(bits, two), two);
    let cos_turned = simd.equal_u64s(simd.and_u64s(simd.add_u64s(bits, one), two), two);
    let sin = simd.select_f64s(swapped, cos_r, sin_r);
    let cos = simd.select_f64s(swapped, sin_r, cos_r);
    (simd.select_f64s(sin_turned, simd.neg_f64s(sin), sin), simd.select_f64s(cos_turned, simd.neg_f64s(cos), cos))
}

/// sin(r + y) = r + (r³ S₀ + (y − r² (y/2 − r³ (S₁ + …)))).
#[inline(always)]
fn sin_kernel<S: Simd>(simd: S, r: S::f64s, y: S::f64s, c: &[f64; 6]) -> S::f64s {
    let square = simd.mul_f64s(r, r);
    let cube = simd.mul_f64s(square, r);
    let tail = polynomial(simd, square, &c[1..]);
    let inner = neg_mul_add(simd, cube, tail, simd.mul_f64s(simd.splat_f64s(0.5), y));
    let inner = neg_mul_add(simd, square, inner, y);
    let sine = simd.add_f64s(r, mul_add(simd, cube, simd.splat_f64s(c[0]), inner));
    // a sum of zeros forgets the sign of −0, which is that of r
    simd.or_f64s(sine, simd.and_f64s(r, simd.splat_f64s(-0.0)))
}

/// cos(r + y) = w + (((1 − w) − r²/2) + (r⁴ (C₀ + …) − r y)), w = 1 − r²/2 rounded.
#[inline(always)]
fn cos_kernel<S: Simd>(simd: S, r: S::f64s, y: S::f64s, c: &[f64; 6]) -> S::f64s {
    let one = simd.splat_f64s(1.0);
    let square = simd.mul_f64s(r, r);
    let tail = simd.mul_f64s(square, polynomial(simd, square, c));
    let half = simd.mul_f64s(simd.splat_f64s(0.5), square);
    let w = simd.sub_f64s(one, half);
    let rounded = simd.sub_f64s(simd.sub_f64s(one, w), half);
    let small = neg_mul_add(simd, r, y, simd.mul_f64s(square, tail));
    simd.add_f64s(w, simd.add_f64s(rounded, small))
}

/// c₀ + c₁ x + c₂ x² + …
#[inline(always)]
fn polynomial<S: Simd>(simd: S, x: S::f64s, c: &[f64]) -> S::f64s {
    let mut value = simd.splat_f64s(c[c.len() - 1]);
    for &c_i in c[..c.len() - 1].iter().rev() {
        value = mul_add(simd, value, x, simd.splat_f64s(c_i));
    }
    value
}

/// The standard library's values in the lanes beyond `LIMIT`.
#[cold]
#[inline(never)]
fn far_sin_cos<S: Simd>(x: S::f64s, mut sin: S::f64s, mut cos: S::f64s) -> (S::f64s, S::f64s) {
    let angles: &[f64] = bytemuck::cast_slice(std::slice::from_ref(&x));
    let sines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut sin));
    let cosines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut cos));
    for ((angle, sine), cosine) in angles.iter().zip(sines).zip(cosines) {
        if angle.is_nan() || angle.abs() > LIMIT {
            (*sine, *cosine) = angle.sin_cos();
        }
    }
    (sin, cos)
}

#[cfg(test)]
mod tests;
