//! What can be set.

use crate::linalg::SquareRootInformation;

/// Settings of [`minimise`](super::minimise()).
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Trial steps at most, accepted or not. Default 1000.
    pub max_trials: usize,
    /// Converged when the residual is perpendicular to all that the parameters can do: ‖Qᵀr‖ / ‖r‖ at most this, where Q
    /// spans the columns of J. Default 1e-13.
    pub gradient: f64,
    /// Likewise when a full Gauss–Newton step is at most this share of the standard uncertainties that the residuals give:
    /// ‖Qᵀr‖ at most this share of σ₀ = ‖r‖/√(rows − n). Default 1e-9.
    pub uncertainty: f64,
    /// Converged when a full Gauss–Newton step moves no coordinate by more than this share of its magnitude.
    /// Default 1e-12.
    pub step: f64,
    /// Converged when ‖r‖ has fallen to this share of its value at the start: far below rounding of ordinary
    /// residuals, so that a minimum at which the Jacobian is singular is approached until that shows. Default ε² = 4.9e-32.
    pub vanished: f64,
    /// Nearest to the nominal values when the way along the invisible directions is at most this, in tolerances.
    /// Default 1e-10.
    pub datum: f64,
    /// First trust radius, as a share of ‖D m‖ with m the magnitudes of the coordinates at the start. Default 1.
    pub radius: f64,
    /// A step is accepted when the cost falls by at least this share of what the linear model predicts. Default 1e-4.
    pub gain: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_trials: 1000,
            gradient: 1e-13,
            uncertainty: 1e-9,
            step: 1e-12,
            vanished: f64::EPSILON * f64::EPSILON,
            datum: 1e-10,
            radius: 1.0,
            gain: 1e-4,
        }
    }
}

/// A setting that makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("setting `{name}` is {value}; it must be {wanted}")]
pub struct SettingsError {
    /// Which setting.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// What it should be.
    pub wanted: &'static str,
}

impl Settings {
    /// How perpendicular the residual must be, ‖Qᵀr‖ / ‖r‖, for as many rows as have been absorbed.
    pub(super) fn perpendicular(&self, information: &SquareRootInformation) -> f64 {
        match information.rows().checked_sub(information.dimension()) {
            Some(freedom) if freedom > 0 => self.gradient.max(self.uncertainty / (freedom as f64).sqrt()),
            _ => self.gradient,
        }
    }

    /// `Ok` if every setting makes sense.
    ///
    /// # Errors
    /// Names the first that does not.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let share = |name, value: f64| (name, value, (0.0..1.0).contains(&value), "at least 0 and less than 1");
        let positive = |name, value: f64| (name, value, value > 0.0 && value.is_finite(), "positive and finite");
        let checks = [
            positive("max_trials", self.max_trials as f64),
            share("gradient", self.gradient),
            share("uncertainty", self.uncertainty),
            share("step", self.step),
            share("vanished", self.vanished),
            positive("datum", self.datum),
            positive("radius", self.radius),
            ("gain", self.gain, self.gain > 0.0 && self.gain < 0.5, "positive and less than 0.5"),
        ];
        match checks.into_iter().find(|(_, _, good, _)| !good) {
            Some((name, value, _, wanted)) => Err(SettingsError { name, value, wanted }),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_named() {
        let good = Settings::default();
        assert_eq!(good.validate(), Ok(()));
        for (name, bad) in [
            ("max_trials", Settings { max_trials: 0, ..good.clone() }),
            ("gradient", Settings { gradient: f64::NAN, ..good.clone() }),
            ("uncertainty", Settings { uncertainty: -1e-9, ..good.clone() }),
            ("step", Settings { step: -1.0, ..good.clone() }),
            ("vanished", Settings { vanished: 1.0, ..good.clone() }),
            ("datum", Settings { datum: 0.0, ..good.clone() }),
            ("radius", Settings { radius: f64::INFINITY, ..good.clone() }),
            ("gain", Settings { gain: 0.5, ..good.clone() }),
        ] {
            assert_eq!(bad.validate().unwrap_err().name, name);
        }
    }
}
