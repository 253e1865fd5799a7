//! Fits that minimise something else than squares.

use super::estimate::Fit;

impl Fit {
    /// The same fit as that of another norm, of which only the estimates are known: it has no uncertainties, tests or criteria.
    #[must_use]
    pub fn of_norm(self, name: String) -> Fit {
        let mut fit = self;
        for parameter in &mut fit.parameters {
            (parameter.sigma, parameter.interval) = (None, None);
        }
        Fit {
            norm: Some(name),
            sigma0: None,
            covariance: None,
            cofactors: None,
            chi_squared: None,
            observations: None,
            lack_of_fit: None,
            criteria: None,
            ..fit
        }
    }
}
