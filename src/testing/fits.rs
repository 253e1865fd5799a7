//! Whether two fits say the same.

use super::demand;
use crate::fit::{Estimate, Fit};

/// Differences that are told.
const TOLD: usize = 8;
/// What rounding makes of a cost, as a share of it.
const ROUNDING: f64 = 1e-10;
/// What is left for each equation where everything fits, but for rounding.
const NOTHING: f64 = 1e-18;

/// Asserts that two fits say the same, whatever the order of their parameters: the same are free, not estimable, and on a bound;
/// estimates and standard uncertainties differ by no more than a `share` of the larger uncertainty (of the tolerance, where there is
/// none), and costs by no more than that share of σ₀², which is 1 where weights are real. Estimates of what is not estimable
/// depend on the datum and are not compared. What exact data leave is rounding: there the tolerance counts, too.
///
/// # Panics
/// With what differs, and by how much.
///
/// ```
/// use phical::problem::{Options, Problem};
/// use phical::session::{Procedure, fit_by};
/// use phical::simulate::simulate;
/// use phical::testing::{assert_same_fit, check_same_fit, program};
///
/// let program = program(r#"(name: "mean", parameters: {"a": Scalar(Free(1))},
///     measurements: {"m": (inputs: {"x": (sigma: 0.1)}, residuals: {"r": "x - a"})},
///     scenarios: {"s": (measurements: {"m": (rows: 9, set: {"x": "a"}, noise: {"x": (sigma: 0.1)})})},
/// )"#);
/// let fit = |seed| {
///     let options = phical::simulate::Options { seed: Some(seed), ..Default::default() };
///     let made = simulate(&program, &program.scenarios[0], &options).expect("it simulates");
///     let (problem, _) = Problem::bind(&program, made.tables, &Options::default()).expect("it binds");
///     fit_by(&problem, &Procedure::default()).expect("a fit")
/// };
/// assert_same_fit(&fit(1), &fit(1), 0.0);
/// assert!(check_same_fit(&fit(1), &fit(2), 0.01).unwrap_err().contains("`a` is"));
/// ```
#[track_caller]
pub fn assert_same_fit(one: &Fit, other: &Fit, share: f64) {
    demand(check_same_fit(one, other, share));
}

/// The same for a property.
///
/// # Errors
/// With what differs, and by how much.
pub fn check_same_fit(one: &Fit, other: &Fit, share: f64) -> Result<(), String> {
    let mut wrong = Vec::new();
    let variance = if one.weights.are_real() { 1.0 } else { one.sigma0.map_or(0.0, |sigma0| sigma0 * sigma0) };
    let rounding = ROUNDING * one.cost.abs() + NOTHING * one.equations as f64;
    let allowed = share * variance + if share > 0.0 { rounding } else { 0.0 };
    // what is not a number is like nothing
    let alike = (one.cost - other.cost).abs() <= allowed;
    if !alike {
        wrong.push(format!("the cost is {:e} in one and {:e} in the other", one.cost, other.cost));
    }
    let same = |what: &str, a: Vec<&str>, b: Vec<&str>| {
        let missing = |of: &[&str], from: &[&str], which: &str| {
            let all: Vec<String> =
                of.iter().filter(|name| !from.contains(name)).map(|name| format!("`{name}`")).collect();
            (!all.is_empty()).then(|| format!("{what} in the {which} fit alone: {}", all.join(", ")))
        };
        [missing(&a, &b, "first"), missing(&b, &a, "second")].into_iter().flatten().collect::<Vec<String>>()
    };
    fn names(fit: &Fit, which: impl Fn(&Estimate) -> bool) -> Vec<&str> {
        fit.parameters.iter().filter(|p| which(p)).map(|p| p.name.as_str()).collect()
    }
    wrong.extend(same("free", names(one, |_| true), names(other, |_| true)));
    wrong.extend(same("not estimable", names(one, |p| !p.estimable), names(other, |p| !p.estimable)));
    wrong.extend(same("on a bound", names(one, |p| p.at_bound), names(other, |p| p.at_bound)));
    for a in &one.parameters {
        let Some(b) = other.parameters.iter().find(|b| b.name == a.name) else { continue };
        if a.estimable && b.estimable {
            wrong.extend(apart(a, b, share));
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    let more = wrong.len().saturating_sub(TOLD);
    wrong.truncate(TOLD);
    if more > 0 {
        wrong.push(format!("and {more} more differences"));
    }
    Err(format!("the fits differ:\n  {}", wrong.join("\n  ")))
}

fn apart(a: &Estimate, b: &Estimate, share: f64) -> Vec<String> {
    let unit = if a.unit == "1" { String::new() } else { format!(" {}", a.unit) };
    let (sigma, of) = match (a.sigma, b.sigma) {
        (Some(one), Some(other)) => (one.max(other), "standard uncertainty"),
        _ => (a.tolerance, "tolerance"),
    };
    let rounding = if share > 0.0 { ROUNDING * (a.value.abs() + a.tolerance) } else { 0.0 };
    let mut wrong = Vec::new();
    let mut differs = |what: &str, one: f64, other: f64| {
        let off = (one - other).abs();
        let alike = off <= share * sigma + rounding;
        if !alike {
            wrong.push(format!(
                "{what} {one}{unit} in one and {other}{unit} in the other, {:.2e} of its {of} apart, {share:.0e} is allowed",
                off / sigma
            ));
        }
    };
    differs(&format!("`{}` is", a.name), a.value, b.value);
    match (a.sigma, b.sigma) {
        (Some(one), Some(other)) => differs(&format!("the standard uncertainty of `{}` is", a.name), one, other),
        (None, None) => {}
        _ => wrong.push(format!("only one fit knows the standard uncertainty of `{}`", a.name)),
    }
    wrong
}
