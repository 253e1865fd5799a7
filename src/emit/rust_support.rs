//! What stands beside the functions in a Rust file.

use super::file::Helper;
use crate::graph::Operation;

/// The text of a helper.
pub(super) fn helper(helper: Helper) -> &'static str {
    match helper {
        Helper::MultiplyAdd => {
            "/// a b + c, fused where that is one instruction.
#[inline(always)]
fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = \"fma\") { a.mul_add(b, c) } else { a * b + c }
}
"
        }
        Helper::Operation(Operation::Atan2) => {
            "/// The angle of the point (y, x), which the origin has not.
fn angle(y: f64, x: f64) -> f64 {
    if y == 0.0 && x == 0.0 { f64::NAN } else { y.atan2(x) }
}
"
        }
        Helper::Operation(Operation::Wrap) => {
            "/// x brought into (-pi, pi] by whole turns.
fn wrap(x: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    x - ((x - PI) / TAU).ceil() * TAU
}
"
        }
        Helper::Operation(Operation::AtLeast) => {
            "/// x, and not a number below the least.
fn at_least(x: f64, least: f64) -> f64 {
    if x >= least { x } else { f64::NAN }
}
"
        }
        Helper::Operation(Operation::Stumpff) => {
            "/// Stumpff's function: the sum over i of (-x)^i/(k + 2 i)!, for x >= 0.
fn stumpff(k: u32, x: f64) -> f64 {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    if x < 0.5 {
        let mut sum = 1.0;
        for i in (1..12).rev() {
            let n = f64::from(k + 2 * i);
            sum = 1.0 - sum * x / (n * (n - 1.0));
        }
        return sum / factorial(k);
    }
    let angle = x.sqrt();
    let (mut c, first) = if k & 1 == 0 { (angle.cos(), 0) } else { (angle.sin() / angle, 1) };
    for j in (first..k).step_by(2) {
        c = (1.0 / factorial(j) - c) / x;
    }
    c
}
"
        }
        Helper::Operation(Operation::Atanc) => {
            "/// The sum over i of (-x)^i/(2 i + 2 n + 1), for x >= 0.
fn atanc(n: u32, x: f64) -> f64 {
    if x < 0.01 {
        let terms = (0..10).rev().map(|i| 1.0 / f64::from(2 * i + 2 * n + 1));
        return terms.fold(0.0, |sum, term| term - sum * x);
    }
    let root = x.sqrt();
    (0..n).fold(root.atan() / root, |g, j| (1.0 / f64::from(2 * j + 1) - g) / x)
}
"
        }
        Helper::Operation(_) => "",
    }
}

/// The name of a helper.
pub(super) fn helper_name(helper: Helper) -> Option<&'static str> {
    match helper {
        Helper::MultiplyAdd => Some("fma"),
        Helper::Operation(Operation::Atan2) => Some("angle"),
        Helper::Operation(Operation::Wrap) => Some("wrap"),
        Helper::Operation(Operation::AtLeast) => Some("at_least"),
        Helper::Operation(Operation::Stumpff) => Some("stumpff"),
        Helper::Operation(Operation::Atanc) => Some("atanc"),
        Helper::Operation(_) => None,
    }
}

/// What functions fail with.
pub(super) const UNDEFINED: &str =
    "/// A residual or a derivative has no value: a division by zero, the root of a negative number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Undefined;

impl std::fmt::Display for Undefined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(\"a residual or a derivative is undefined\")
    }
}

impl std::error::Error for Undefined {}
";
