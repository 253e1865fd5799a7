//! Tails and quantiles of the normal, χ², t and F distributions.
//!
//! Abramowitz & Stegun, Handbook of Mathematical Functions (1964), 26.2–26.7, over the incomplete gamma and beta functions:
//!
//! ```text
//! χ²   P(χ² > x) = Q(ν/2, x/2)
//! F    P(F > f)  = 1 − I(m/2, n/2) at the odds m f/n
//! t    P(t > x)  = ½ P(F > x²), F with 1 and ν degrees of freedom;   x > 0
//! z    P(z > x)  = ½ Q(½, x²/2);   x > 0
//! ```

use statrs::function::erf::erfc_inv;

use super::special::{Tails, beta_tails, gamma_tails, invert};

/// More degrees of freedom than this are infinitely many where that makes sense, and too many where not.
pub const MOST_DOF: f64 = 1e12;

/// A probability, and on which side of a quantile it lies: `Upper(0.05)` is the 95 % point, and `Upper(1e-20)` has all its
/// digits, which `Lower(1.0 - 1e-20)` has not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tail {
    /// This much lies below.
    Lower(f64),
    /// This much lies above.
    Upper(f64),
}

impl Tail {
    /// What lies below and what above, both within (0, 1).
    fn both(self) -> Option<(f64, f64)> {
        let (lower, upper) = match self {
            Tail::Lower(p) => (p, 1.0 - p),
            Tail::Upper(p) => (1.0 - p, p),
        };
        (lower > 0.0 && upper > 0.0).then_some((lower, upper))
    }

    /// The same on the other side.
    fn mirrored(self) -> Tail {
        match self {
            Tail::Lower(p) => Tail::Upper(p),
            Tail::Upper(p) => Tail::Lower(p),
        }
    }
}

/// Whether ν is positive, and not too large to be computed with.
fn countable(dof: f64) -> bool {
    dof > 0.0 && dof <= MOST_DOF
}

/// P(z > x) of the standard normal distribution; none where x is NaN.
pub fn normal_upper_tail(x: f64) -> Option<f64> {
    normal_tails(x).map(|(_, upper)| upper)
}

/// P(z < x) and P(z > x).
pub(super) fn normal_tails(x: f64) -> Option<(f64, f64)> {
    let half_square = 0.5 * x * x;
    let beyond = match half_square {
        _ if x.is_nan() => return None,
        0.0 => 1.0,
        f64::INFINITY => 0.0,
        _ => gamma_tails(0.5, half_square)?.upper,
    };
    let (smaller, larger) = (0.5 * beyond, 1.0 - 0.5 * beyond);
    Some(if x < 0.0 { (smaller, larger) } else { (larger, smaller) })
}

/// The x of which the standard normal distribution has so much below or above; none where it is not within (0, 1).
pub fn normal_quantile(tail: Tail) -> Option<f64> {
    let (lower, upper) = tail.both()?;
    let size = std::f64::consts::SQRT_2 * erfc_inv(2.0 * lower.min(upper));
    Some(if lower < upper { -size } else { size })
}

/// P(χ² > x) with `dof` degrees of freedom; none where x < 0 or `dof` is not within (0, [`MOST_DOF`]].
pub fn chi_squared_upper_tail(x: f64, dof: f64) -> Option<f64> {
    match x {
        _ if !countable(dof) => None,
        0.0 => Some(1.0),
        f64::INFINITY => Some(0.0),
        _ => Some(gamma_tails(0.5 * dof, 0.5 * x)?.upper),
    }
}

/// The χ² of which `dof` degrees of freedom have so much below or above; none where that is not within (0, 1), or `dof` not
/// within (0, [`MOST_DOF`]].
pub fn chi_squared_quantile(tail: Tail, dof: f64) -> Option<f64> {
    let (lower, upper) = tail.both()?;
    if !countable(dof) {
        return None;
    }
    // Wilson & Hilferty (1931)
    let spread = 2.0 / (9.0 * dof);
    let start = dof * (1.0 - spread + normal_quantile(tail)? * spread.sqrt()).max(0.0).powi(3);
    Some(2.0 * invert(lower, upper, 0.5 * start, |x| gamma_tails(0.5 * dof, x))?)
}

/// P(F > f) with `m` degrees of freedom above and `n` below, which may be infinite: then m F is χ² distributed. None where
/// f < 0, or a number is not positive.
pub fn f_upper_tail(f: f64, m: f64, n: f64) -> Option<f64> {
    match f {
        _ if !(countable(m) && n > 0.0 && f >= 0.0) => None,
        0.0 => Some(1.0),
        f64::INFINITY => Some(0.0),
        _ => Some(f_tails(f, m, n)?.upper),
    }
}

/// The F of which `m` over `n` degrees of freedom have so much below or above; `n` may be infinite. None where the
/// probability is not within (0, 1), or a number not positive.
pub fn f_quantile(tail: Tail, m: f64, n: f64) -> Option<f64> {
    let (lower, upper) = tail.both()?;
    (countable(m) && n > 0.0).then_some(())?;
    invert(lower, upper, 1.0, |f| f_tails(f, m, n))
}

fn f_tails(f: f64, m: f64, n: f64) -> Option<Tails> {
    if n > MOST_DOF {
        return gamma_tails(0.5 * m, 0.5 * (m * f));
    }
    // of very unequal numbers the product may be beyond the numbers, and then nothing is left above, or below
    let odds = (m / n * f).clamp(f64::MIN_POSITIVE, f64::MAX);
    beta_tails(0.5 * m, 0.5 * n, odds)
}

/// P(t > x) with `dof` degrees of freedom, which may be infinite: then t is normal. None where x is NaN or `dof` ≤ 0.
pub fn t_upper_tail(x: f64, dof: f64) -> Option<f64> {
    if x.is_nan() || dof.is_nan() || dof <= 0.0 {
        return None;
    }
    if dof > MOST_DOF {
        return normal_upper_tail(x);
    }
    let beyond = f_upper_tail(x * x, 1.0, dof)?;
    Some(if x < 0.0 { 1.0 - 0.5 * beyond } else { 0.5 * beyond })
}

/// The t of which `dof` degrees of freedom have so much below or above; they may be infinite: then t is normal. None where
/// the probability is not within (0, 1), or `dof` ≤ 0.
pub fn t_quantile(tail: Tail, dof: f64) -> Option<f64> {
    let (lower, upper) = tail.both()?;
    if lower < upper {
        return t_quantile(tail.mirrored(), dof).map(|t| -t);
    }
    if dof > MOST_DOF {
        return normal_quantile(tail);
    }
    let (between, beyond) = (1.0 - 2.0 * upper, 2.0 * upper);
    if between <= 0.0 {
        return (dof > 0.0).then_some(0.0);
    }
    countable(dof).then_some(())?;
    Some(invert(between, beyond, 1.0, |f| f_tails(f, 1.0, dof))?.sqrt())
}

/// The x of which the beta distribution with shapes `a` and `b` has so much below or above.
pub(super) fn beta_quantile(tail: Tail, a: f64, b: f64) -> Option<f64> {
    let (lower, upper) = tail.both()?;
    // of the two odds the one that is small has all its digits
    let odds = invert(lower, upper, a / b, |odds| beta_tails(a, b, odds))?;
    Some(odds / (1.0 + odds))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::statistics::tests::relatively_close;

    // References are by mpmath 1.3 with 40 digits; rounded, they are what A&S print in Tables 26.1 and 26.8 to 26.10, where
    // these have them. Quantiles of statrs fail at several of them.

    #[test]
    fn normal_tails_and_quantiles() {
        for (x, upper) in [
            (0.1, 0.460_172_162_722_971),
            (1.0, 0.15865525393145705),
            (2.0, 0.022_750_131_948_179_21),
            (3.0, 0.0013498980316300945),
            (6.0, 9.865_876_450_376_98e-10),
            (-1.5, 0.933_192_798_731_141_9),
            (20.0, 2.7536241186062337e-89),
            (37.0, 5.725_571_222_524_577e-300),
            (0.0, 0.5),
        ] {
            relatively_close(normal_upper_tail(x).unwrap(), upper, 1e-13);
            assert_eq!(normal_tails(-x).unwrap().0, normal_upper_tail(x).unwrap());
        }
        for (upper, x) in [
            (0.025, 1.9599639845400542),
            (0.0005, 3.290_526_731_491_895),
            (1e-10, 6.361_340_902_404_057),
            (0.4, 0.2533471031357998),
            (1e-300, 37.047_096_299_361_2),
            (0.8, -0.841_621_233_572_914_2),
        ] {
            relatively_close(normal_quantile(Tail::Upper(upper)).unwrap(), x, 1e-14);
            relatively_close(normal_quantile(Tail::Lower(upper)).unwrap(), -x, 1e-14);
        }
        assert_eq!(normal_quantile(Tail::Upper(0.5)), Some(0.0));
    }

    #[test]
    fn quantiles_of_t() {
        for (dof, upper, t) in [
            (1.0, 0.025, 12.706204736174705),
            (2.0, 0.005, 9.924_843_200_918_293),
            (5.0, 0.0005, 6.868_826_625_881_11),
            (10.0, 0.025, 2.228_138_851_986_275),
            (30.0, 0.05, 1.6972608865939578),
            (1000.0, 0.025, 1.9623390808264085),
            (1e5, 0.0005, 3.2906240314118827),
            (1e7, 0.025, 1.9599642217672055),
            (2.5, 0.1, 1.7302509288071766),
            (1.0, 1e-10, 3_183_098_861.837_907),
            (3.0, 0.4999, 0.00027206990911050335),
            (f64::INFINITY, 0.025, 1.9599639845400542),
        ] {
            relatively_close(t_quantile(Tail::Upper(upper), dof).unwrap(), t, 2e-12);
            relatively_close(t_quantile(Tail::Lower(upper), dof).unwrap(), -t, 2e-12);
            relatively_close(t_upper_tail(t, dof).unwrap(), upper, 2e-12);
            relatively_close(t_upper_tail(-t, dof).unwrap(), 1.0 - upper, 2e-12);
        }
        assert_eq!(t_quantile(Tail::Upper(0.5), 3.0), Some(0.0));
    }

    #[test]
    fn quantiles_of_t_in_closed_form() {
        for p in [0.501, 0.6, 0.75, 0.9, 0.975, 0.9995] {
            let cauchy = (std::f64::consts::PI * (p - 0.5)).tan();
            relatively_close(t_quantile(Tail::Lower(p), 1.0).unwrap(), cauchy, 1e-12);
            let two = (2.0 * p - 1.0) / (2.0 * p * (1.0 - p)).sqrt();
            relatively_close(t_quantile(Tail::Lower(p), 2.0).unwrap(), two, 1e-12);
        }
    }

    #[test]
    fn quantiles_of_chi_squared() {
        for (dof, upper, x) in [
            (1.0, 0.05, 3.841458820694126),
            (2.0, 0.01, 9.210_340_371_976_182),
            (3.0, 0.5, 2.365_973_884_375_338),
            (10.0, 0.95, 3.94029913611906),
            (100.0, 0.001, 149.44925277903871),
            (1e4, 0.05, 10233.748897677936),
            (0.7, 0.3, 0.653_661_465_538_586_1),
            (5.0, 1e-30, 150.58968413567666),
        ] {
            relatively_close(chi_squared_quantile(Tail::Upper(upper), dof).unwrap(), x, 1e-13);
            relatively_close(chi_squared_upper_tail(x, dof).unwrap(), upper, 1e-12);
        }
    }

    #[test]
    fn quantiles_of_f() {
        for (m, n, upper, f) in [
            (1.0, 1.0, 0.05, 161.4476387975885),
            (5.0, 2.0, 0.01, 99.299_296_477_864_12),
            (3.0, 10.0, 0.001, 12.552745388943728),
            (1.0, 1000.0, 0.6, 0.27517127955165874),
            (30.0, 1000.0, 0.05, 1.4705935071882187),
            (5.0, 1.0, 0.0005, 2305619.4233278535),
            (2.5, 7.5, 0.9, 0.15134504115747264),
            (200.0, 300.0, 0.025, 1.2845279177246845),
        ] {
            relatively_close(f_quantile(Tail::Upper(upper), m, n).unwrap(), f, 1e-12);
            relatively_close(f_quantile(Tail::Lower(upper), n, m).unwrap(), 1.0 / f, 1e-12);
            relatively_close(f_upper_tail(f, m, n).unwrap(), upper, 1e-12);
        }
    }

    #[test]
    fn f_of_one_is_t_squared_and_of_infinitely_many_chi_squared() {
        for p in [1e-6, 0.01, 0.2] {
            for n in [0.5, 3.0, 77.0, 1e9, f64::INFINITY] {
                let t = t_quantile(Tail::Upper(p), n).unwrap();
                relatively_close(f_quantile(Tail::Upper(2.0 * p), 1.0, n).unwrap(), t * t, 1e-11);
            }
            for m in [0.5, 4.0, 1e3] {
                let x = chi_squared_quantile(Tail::Upper(p), m).unwrap();
                relatively_close(f_quantile(Tail::Upper(p), m, f64::INFINITY).unwrap(), x / m, 1e-12);
                relatively_close(f_quantile(Tail::Upper(p), m, 0.9 * MOST_DOF).unwrap(), x / m, 1e-8);
            }
        }
    }

    /// Fisher's expansion (A&S 26.7.5), which is good where the fraction is slow.
    #[test]
    fn many_degrees_of_freedom() {
        for dof in [1e6, 1e9, 0.99 * MOST_DOF, 1.01 * MOST_DOF] {
            for upper in [1e-6, 0.025, 0.3] {
                let z = normal_quantile(Tail::Upper(upper)).unwrap();
                let first = (z.powi(3) + z) / 4.0;
                let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
                let t = z + first / dof + second / (dof * dof);
                relatively_close(t_quantile(Tail::Upper(upper), dof).unwrap(), t, 1e-11);
            }
        }
        // χ² of many is nearly normal: A&S 26.4.17 with its first correction left out
        let dof = 1e10f64;
        let z = normal_quantile(Tail::Upper(0.05)).unwrap();
        let wilson_hilferty = dof * (1.0 - 2.0 / (9.0 * dof) + z * (2.0 / (9.0 * dof)).sqrt()).powi(3);
        relatively_close(chi_squared_quantile(Tail::Upper(0.05), dof).unwrap(), wilson_hilferty, 1e-12);
    }

    /// The χ² of ν + 2 has more above x than that of ν, by twice its density (A&S 26.4.8); two normals squared are one of them.
    #[test]
    fn chi_squared_is_a_sum_of_squared_normals() {
        for x in [0.3, 2.0, 9.0, 50.0f64] {
            let mut upper = 2.0 * normal_upper_tail(x.sqrt()).unwrap();
            let mut density = (-0.5 * x).exp() / (2.0 * std::f64::consts::PI * x).sqrt();
            for k in 1..40 {
                let dof = f64::from(2 * k - 1);
                relatively_close(chi_squared_upper_tail(x, dof).unwrap(), upper, 1e-12);
                density *= x / dof;
                upper += 2.0 * density;
            }
        }
    }

    #[test]
    fn what_is_not_defined_is_none() {
        for p in [0.0, 1.0, -0.1, 1.1, f64::NAN] {
            for tail in [Tail::Lower(p), Tail::Upper(p)] {
                assert_eq!(normal_quantile(tail), None);
                assert_eq!(t_quantile(tail, 3.0), None);
                assert_eq!(chi_squared_quantile(tail, 3.0), None);
                assert_eq!(f_quantile(tail, 3.0, 3.0), None);
            }
        }
        for dof in [0.0, -1.0, f64::NAN] {
            for p in [0.01, 0.5, 0.7] {
                assert_eq!(t_quantile(Tail::Upper(p), dof), None);
                assert_eq!(chi_squared_quantile(Tail::Upper(p), dof), None);
                assert_eq!(f_quantile(Tail::Upper(p), dof, 1.0), None);
                assert_eq!(f_quantile(Tail::Upper(p), 1.0, dof), None);
            }
            assert_eq!(t_upper_tail(1.0, dof), None);
            assert_eq!(chi_squared_upper_tail(1.0, dof), None);
            assert_eq!(f_upper_tail(1.0, dof, 1.0), None);
            assert_eq!(f_upper_tail(1.0, 1.0, dof), None);
        }
        for x in [-1.0, f64::NAN] {
            assert_eq!(chi_squared_upper_tail(x, 1.0), None);
        }
        assert_eq!(normal_upper_tail(f64::NAN), None);
        assert_eq!(f_upper_tail(f64::NAN, 1.0, 1.0), None);
        assert_eq!(f_upper_tail(-1.0, 1.0, 1.0), None);
        assert_eq!(t_upper_tail(f64::NAN, 1.0), None);
        assert_eq!(chi_squared_upper_tail(1.0, f64::INFINITY), None);
    }

    #[test]
    fn far_out_is_a_limit() {
        assert_eq!(normal_upper_tail(f64::INFINITY), Some(0.0));
        assert_eq!(normal_upper_tail(-1e200), Some(1.0));
        assert_eq!(chi_squared_upper_tail(0.0, 3.0), Some(1.0));
        assert_eq!(chi_squared_upper_tail(f64::INFINITY, 3.0), Some(0.0));
        assert_eq!(t_upper_tail(f64::NEG_INFINITY, 3.0), Some(1.0));
        assert_eq!(t_upper_tail(0.0, 3.0), Some(0.5));
        assert_eq!(f_upper_tail(0.0, 3.0, 2.0), Some(1.0));
        assert_eq!(f_upper_tail(f64::INFINITY, 3.0, 2.0), Some(0.0));
    }

    proptest! {
        /// Whatever is asked, the answer is a probability, and a quantile has the tail that was asked for.
        #[test]
        fn tails_are_probabilities(x in -30.0..30.0, m in -6.0..12.0, n in -6.0..12.0, p in 1e-9..0.999) {
            let [x, m, n] = [x, m, n].map(|exponent: f64| 10f64.powf(exponent));
            for found in [f_upper_tail(x, m, n), t_upper_tail(x, m), chi_squared_upper_tail(x, m)] {
                prop_assert!((0.0..=1.0).contains(&found.unwrap()));
            }
            let tail = Tail::Upper(p);
            // the quantile may be beyond the numbers, and with many degrees of freedom one bit of it tells in the tail
            let near = |found: Option<f64>| (found.unwrap() / p - 1.0).abs() < 1e-7;
            if let Some(f) = f_quantile(tail, m, n) {
                prop_assert!(near(f_upper_tail(f, m, n)));
            }
            if let Some(x) = chi_squared_quantile(tail, m) {
                prop_assert!(near(chi_squared_upper_tail(x, m)));
            }
            if let Some(t) = t_quantile(tail, m).filter(|t| t.abs() < 1e150) {
                prop_assert!(near(t_upper_tail(t, m)));
            }
            if m > 0.1 && n > 0.1 {
                prop_assert!(f_quantile(tail, m, n).is_some() && chi_squared_quantile(tail, m).is_some());
            }
        }
    }
}
