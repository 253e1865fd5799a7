//! Observability indices of a scaled Jacobian: one number for how well a set of measurements determines the parameters.

use crate::linalg::{LinalgError, Matrix, svd};

/// The five indices of robot calibration, of the singular values σ₁ ≥ … ≥ σₙ of a Jacobian whose rows are in standard deviations and
/// whose columns are in tolerances, so that units do not matter. All are zero where a direction is invisible; the larger the
/// better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observability {
    /// (σ₁ σ₂ … σₙ)^(1/n) / √m for m equations (Borm & Menq 1989, 1991): the volume of what is seen.
    pub o1: f64,
    /// σₙ/σ₁ (Driels & Pathre 1990): the inverse of the condition number.
    pub o2: f64,
    /// σₙ (Nahvi, Hollerbach & Hayward 1994): how well the worst direction is seen.
    pub o3: f64,
    /// σₙ²/σ₁ (Nahvi & Hollerbach 1996): the noise amplification index.
    pub o4: f64,
    /// 1/(1/σ₁ + … + 1/σₙ) (Sun & Hollerbach 2008).
    pub o5: f64,
}

impl Observability {
    /// Of singular values, largest first, for so many equations; of the first `rank` of these where the others are rounding.
    pub fn new(sigma: &[f64], rank: usize, equations: usize) -> Observability {
        let (Some(&first), Some(&last)) = (sigma.first(), sigma.last()) else {
            return Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 };
        };
        if rank < sigma.len() || last <= 0.0 {
            return Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 };
        }
        let mean_of_logarithms = sigma.iter().map(|sigma| sigma.ln()).sum::<f64>() / sigma.len() as f64;
        Observability {
            o1: mean_of_logarithms.exp() / (equations.max(1) as f64).sqrt(),
            o2: last / first,
            o3: last,
            o4: last * (last / first),
            o5: 1.0 / sigma.iter().map(|sigma| 1.0 / sigma).sum::<f64>(),
        }
    }

    /// Of a factor R with its columns in tolerances.
    ///
    /// # Errors
    /// Where an entry is not finite.
    pub fn of(r: &Matrix, scale: &[f64], rank: usize, equations: usize) -> Result<Observability, LinalgError> {
        Ok(Self::new(&svd(&r.scale_columns(scale))?.sigma, rank, equations))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms() {
        // diag(8, 4, 2) of 16 equations
        let found = Observability::new(&[8.0, 4.0, 2.0], 3, 16);
        assert!((found.o1 - 1.0).abs() < 1e-15);
        assert_eq!((found.o2, found.o3, found.o4), (0.25, 2.0, 0.5));
        assert!((found.o5 - 8.0 / 7.0).abs() < 1e-15);
        // orthogonal columns of one length s: O1 = s/√m, O2 = 1, O3 = O4 = s, O5 = s/n
        let found = Observability::new(&[3.0; 4], 4, 9);
        assert!((found.o1 - 1.0).abs() < 1e-15);
        assert_eq!((found.o2, found.o3, found.o4, found.o5), (1.0, 3.0, 3.0, 0.75));
    }

    #[test]
    fn what_is_invisible_makes_all_zero() {
        let zero = Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 };
        assert_eq!(Observability::new(&[3.0, 1e-16], 1, 9), zero);
        assert_eq!(Observability::new(&[], 0, 0), zero);
    }

    #[test]
    fn from_a_factor() {
        let r = Matrix::from_rows(2, &[[2.0, 0.0], [0.0, 300.0]]);
        let found = Observability::of(&r, &[1.0, 0.01], 2, 4).unwrap();
        assert!((found.o3 - 2.0).abs() < 1e-15 && (found.o2 - 2.0 / 3.0).abs() < 1e-15);
    }
}
