//! The mathematics of statistics: no data, no model, only numbers.
//!
//! | file | what it is |
//! |---|---|
//! | `special` | incomplete gamma and beta functions, and their inverses |
//! | `distributions` | tails and quantiles: normal, χ², Student's t, F |
//! | `hypothesis` | tests: Baarda, Pope, nested fits, lack of fit; information criteria |
//! | `propagation` | effective degrees of freedom and coverage factors |
//! | `binomial` | intervals of a proportion |
//! | `moments` | running mean and variance; median and its scale |
//! | `loss` | robust losses, one table |
//! | `efficiency` | what a loss costs where the errors are normal |
//!
//! Degrees of freedom are numbers, as they need not be whole, and may be infinite where that makes sense. A function that
//! is asked for something that does not exist returns `None`; none of them returns NaN.
//!
//! `statrs` is not used for what depends on degrees of freedom. Its version 0.19 stops the continued fraction of the
//! incomplete beta function after 140 terms, so that the 97.5 % point of t comes out as 1.827 at 10⁷ degrees of freedom
//! (1.960 is right) and as 1.959981 at 10⁵ (1.959988), and subtracts logarithms of gamma functions that grow with them; its
//! `erfc` is right to 10⁻¹⁰ only. What is here is right to 10⁻¹², or as far as
//! the digits of its arguments go, up to [`MOST_DOF`].

mod binomial;
mod distributions;
mod efficiency;
mod hypothesis;
mod loss;
mod moments;
mod propagation;
mod special;

pub use binomial::{Interval, clopper_pearson, wilson};
pub use distributions::{
    MOST_DOF, Tail, chi_squared_quantile, chi_squared_upper_tail, f_quantile, f_upper_tail, normal_quantile,
    normal_upper_tail, t_quantile, t_upper_tail,
};
pub use hypothesis::{
    Baarda, Criteria, Noise, Summary, Test, f_test, lack_of_fit, likelihood_ratio, pope_tau, variance_ratio,
};
pub use loss::{Kernel, Loss, LossError};
pub use moments::{Moments, mad_scale, median, norm_scale};
pub use propagation::{coverage_factor, effective_dof};

#[cfg(test)]
mod tests {
    /// Fails where `found` is not within `tolerance` of `expected`, relative to it where it exceeds one.
    #[track_caller]
    pub(super) fn close(found: f64, expected: f64, tolerance: f64) {
        let error = (found - expected).abs() / expected.abs().max(1.0);
        assert!(error <= tolerance, "{found:e} instead of {expected:e}: {error:e} away");
    }

    /// Fails where `found` is not within `tolerance` of `expected`, relative to it.
    #[track_caller]
    pub(super) fn relatively_close(found: f64, expected: f64, tolerance: f64) {
        let error = ((found - expected) / expected).abs();
        assert!(error <= tolerance, "{found:e} instead of {expected:e}: {error:e} away");
    }

    #[test]
    #[should_panic(expected = "away")]
    fn what_is_not_close_is_found() {
        close(1.0, 1.1, 0.05);
    }

    #[test]
    #[should_panic(expected = "away")]
    fn nan_is_not_close() {
        close(f64::NAN, 1.0, 0.05);
    }

    #[test]
    #[should_panic(expected = "away")]
    fn small_numbers_are_compared_by_their_own_size() {
        relatively_close(1e-20, 1.1e-20, 0.05);
    }
}
