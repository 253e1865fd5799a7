//! Trust it or not, and why.

use super::estimate::Fit;

/// Below this upper tail of χ² the residuals contradict the declared sigmas.
pub(super) const SUSPICIOUS: f64 = 0.001;

/// Whether a fit is done and trustworthy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// What speaks against it; nothing where it can be trusted.
    pub reasons: Vec<String>,
}

impl Verdict {
    /// Judges a fit: converged, every free parameter estimable, corrections settled, something left by a loss, and, where
    /// weights are real, χ² not too large.
    pub(super) fn of(fit: &Fit) -> Self {
        let mut reasons = Vec::new();
        if !fit.status.converged() {
            reasons.push(fit.status.to_string());
        }
        let blind = fit.parameters.iter().filter(|p| !p.estimable).count();
        if blind > 0 {
            let plural = if blind == 1 { "one parameter is" } else { &format!("{blind} parameters are") };
            reasons.push(format!("{plural} not estimable"));
        }
        if fit.unsettled > 0 {
            let rows = if fit.unsettled == 1 { "one row" } else { &format!("{} rows", fit.unsettled) };
            reasons.push(format!("the corrections of {rows} did not settle"));
        }
        if fit.robust.is_some() && fit.covariance.is_none() && !fit.parameters.is_empty() {
            reasons.push("the loss leaves too few rows to tell how certain anything is".into());
        }
        if let Some(chi) = fit.chi_squared
            && chi.upper_tail <= SUSPICIOUS
        {
            let ratio = chi.value / chi.dof as f64;
            reasons.push(format!("the residuals are larger than the declared sigmas allow: chi-squared per degree of freedom is {ratio:.3}"));
        }
        Verdict { reasons }
    }

    /// Whether nothing speaks against it.
    pub fn trustworthy(&self) -> bool {
        self.reasons.is_empty()
    }
}
