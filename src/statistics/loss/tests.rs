use proptest::prelude::*;

use super::*;
use crate::statistics::tests::{close, relatively_close};

fn losses() -> impl Iterator<Item = Loss> {
    let tunings = [None, Some(1e-6), Some(0.1), Some(1.0), Some(7.3), Some(1e6)];
    Kernel::ALL.into_iter().flat_map(move |kernel| tunings.map(|tuning| Loss::new(kernel, tuning).unwrap()))
}

#[test]
fn the_table_is_in_the_order_of_the_kernels() {
    for (kernel, row) in Kernel::ALL.iter().zip(&TABLE) {
        assert_eq!(*kernel, row.kernel);
        assert_eq!(kernel.row().name, row.name);
        assert_eq!(Kernel::from_name(row.name), Some(*kernel));
        assert!(row.name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-'));
    }
    assert_eq!(Kernel::from_name("Huber"), None);
}

#[test]
fn small_residuals_cost_their_square() {
    for loss in losses() {
        assert_eq!((loss.rho(0.0), loss.weight(0.0)), (0.0, 1.0), "{loss:?}");
        let s = (1e-6 * loss.tuning).powi(2);
        relatively_close(loss.rho(s), s, 1e-6);
        close(loss.weight(s), 1.0, 2e-6);
    }
}

#[test]
fn the_weight_is_the_derivative_of_the_loss() {
    for loss in losses() {
        for step in -60..60 {
            // u/c from 10⁻³ to 10³, off the kinks
            let s = (loss.tuning * 1.1234 * 10f64.powf(f64::from(step) / 20.0)).powi(2);
            let h = 1e-4 * s;
            // of fourth order
            let near = loss.rho(s + h) - loss.rho(s - h);
            let far = loss.rho(s + 2.0 * h) - loss.rho(s - 2.0 * h);
            let difference = (8.0 * near - far) / (12.0 * h);
            let rounding = 1e-15 * loss.rho(s) / h;
            let error = (difference - loss.weight(s)).abs();
            assert!(error <= 1e-9 * loss.weight(s) + 10.0 * rounding, "{loss:?} at {s:e}: {error:e}");
        }
    }
}

#[test]
fn a_wrong_weight_would_be_found() {
    // the weight of Fair is not the derivative of L1L2
    let (fair, l1l2) = (Loss::new(Kernel::Fair, Some(1.0)).unwrap(), Loss::new(Kernel::L1L2, Some(1.0)).unwrap());
    assert!(((fair.rho(1.001) - fair.rho(0.999)) / 0.002 - l1l2.weight(1.0)).abs() > 0.1);
}

#[test]
fn redescending_is_what_the_table_says() {
    for kernel in Kernel::ALL {
        let loss = Loss::new(kernel, None).unwrap();
        let influence = |u: f64| u * loss.weight(u * u);
        assert_eq!(influence(1e9) < 1e-6, kernel.redescending(), "{kernel}");
    }
}

#[test]
fn efficiencies_are_what_the_table_says() {
    for kernel in Kernel::ALL {
        let found = Loss::new(kernel, None).unwrap().efficiency(1);
        assert!((found - kernel.efficiency()).abs() < 1e-4, "{kernel}: {found}");
    }
}

#[test]
fn losses_by_hand() {
    let of = |kernel, tuning, s: f64| {
        let loss = Loss::new(kernel, Some(tuning)).unwrap();
        (loss.rho(s), loss.weight(s), loss.rejects(s))
    };
    assert_eq!(of(Kernel::Huber, 1.0, 9.0), (5.0, 1.0 / 3.0, false));
    assert_eq!(of(Kernel::L1L2, 1.0, 8.0), (4.0, 1.0 / 3.0, false));
    assert_eq!(of(Kernel::GemanMcClure, 1.0, 1.0), (0.5, 0.25, false));
    assert_eq!(of(Kernel::Tukey, 3.0, 9.0), (3.0, 0.0, true));
    assert_eq!(of(Kernel::Andrews, 1.0, 10.0), (4.0, 0.0, true));
    assert_eq!(of(Kernel::Hampel, 2.0, 256.0), (4.0 * (8.25 + 6.75), 0.0, true));
    assert_eq!(of(Kernel::Danish, 2.0, 4.0), (4.0, 1.0, false));
    close(of(Kernel::Danish, 1.0, 3.0).0, 2.0 - f64::exp(-2.0), 1e-15);
    close(of(Kernel::Cauchy, 1.0, 3.0).0, 4f64.ln(), 1e-15);
    close(of(Kernel::Welsch, 1.0, 2.0).0, 1.0 - f64::exp(-2.0), 1e-15);
    close(of(Kernel::Fair, 1.0, 1.0).0, 2.0 - 2.0 * 2f64.ln(), 1e-15);
}

#[test]
fn constants_that_are_none() {
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
        assert!(matches!(Loss::new(Kernel::Huber, Some(wrong)), Err(LossError::Tuning(_))));
    }
}

#[test]
fn only_nan_gives_nan() {
    for loss in losses() {
        for s in [0.0, f64::MIN_POSITIVE, 1e300, f64::MAX, f64::INFINITY, -1.0, f64::NEG_INFINITY] {
            assert!(loss.rho(s) >= 0.0 && loss.rho(s) < f64::INFINITY, "{loss:?} at {s:e}: {}", loss.rho(s));
            assert!((0.0..=1.0).contains(&loss.weight(s)), "{loss:?} at {s:e}");
        }
        assert!(loss.rho(f64::NAN).is_nan() && loss.weight(f64::NAN).is_nan() && !loss.rejects(f64::NAN));
    }
}

proptest! {
    /// ρ rises, its slope falls, and its tangent bounds it from above: what makes reweighting descend.
    #[test]
    fn losses_are_concave(kernel in 0..10usize, log_c in -3.0..3.0, log_s in -12.0..8.0, log_t in -12.0..8.0) {
        let loss = Loss::new(Kernel::ALL[kernel], Some(f64::powf(10.0, log_c))).unwrap();
        let (s, t) = (f64::powf(10.0, log_s), f64::powf(10.0, log_t));
        let (s, t) = (s.min(t), s.max(t));
        let rounding = 1e-12;
        prop_assert!(loss.weight(t) <= loss.weight(s) * (1.0 + rounding));
        prop_assert!(loss.rho(s) <= loss.rho(t) * (1.0 + rounding));
        prop_assert!(loss.rho(t) <= t * (1.0 + rounding));
        let tangent = |at: f64, to: f64| loss.rho(at) + loss.weight(at) * (to - at);
        prop_assert!(loss.rho(t) <= tangent(s, t) + rounding * t);
        prop_assert!(loss.rho(s) <= tangent(t, s) + rounding * t);
    }

    /// ρ(k² s; k c) = k² ρ(s; c): a loss has no other scale than its constant.
    #[test]
    fn the_constant_is_the_only_scale(kernel in 0..10usize, c in 0.1..10.0, k in 0.1..10.0, s in 0.0..1e3) {
        let [loss, scaled] = [c, k * c].map(|c| Loss::new(Kernel::ALL[kernel], Some(c)).unwrap());
        close(scaled.rho(k * k * s), k * k * loss.rho(s), 1e-12);
        close(scaled.weight(k * k * s), loss.weight(s), 1e-12);
    }
}
