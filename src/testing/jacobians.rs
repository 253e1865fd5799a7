//! Whether a function that somebody wrote is the Jacobian of a declared measurement.

use std::fmt::Write;

use super::demand;
use crate::audit::{CheckedFunction, check_function};
use crate::diag::did_you_mean;
use crate::identify::Probe;
use crate::report::significant;

/// Wrong entries that are listed.
const SHOWN: usize = 12;

/// Asserts that `function(q, x)` is the Jacobian of the residuals of a measurement: derivatives by residual and then by free parameter,
/// at the nominal values and at so many random points. q are the free coordinates of the model in declared order, x the inputs of the
/// measurement, all numbers in the units that the model reports. A rotation's derivatives are by its right perturbation.
///
/// # Panics
/// Where an entry is wrong: with the residual, the parameter, what is given and what it is, what the mistake looks like, and the
/// simplest point at which it shows.
///
/// ```
/// use phical::testing::{assert_jacobian, check_jacobian, program};
///
/// let arm = program(r#"(name: "arm", parameters: {"a": Scalar(Free("400 mm")), "offset": Scalar(Free("0.1 rad"))},
///     measurements: {"tip": (
///         inputs: {"s": (unit: "rad"), "x": (unit: "mm"), "y": (unit: "mm")},
///         residuals: {"rx": "a*cos(s + offset) - x", "ry": "a*sin(s + offset) - y"},
///     )})"#);
/// let by_hand = |q: &[f64], x: &[f64]| {
///     let (a, angle) = (q[0], x[0] + q[1]);
///     vec![angle.cos(), -a * angle.sin(), angle.sin(), a * angle.cos()]
/// };
/// assert_jacobian(&arm, "tip", 20, by_hand);
///
/// let wrong = check_jacobian(&arm, "tip", 20, |q, x| {
///     let mut found = by_hand(q, x);
///     found[1] *= -1.0; // a sign
///     found
/// });
/// assert!(wrong.unwrap_err().contains("of rx by offset: it is the negative"));
/// ```
#[track_caller]
pub fn assert_jacobian<'a>(
    model: impl Into<Probe<'a>>,
    measurement: &str,
    points: usize,
    function: impl Fn(&[f64], &[f64]) -> Vec<f64>,
) {
    demand(check_jacobian(model, measurement, points, function));
}

/// The same for a property.
///
/// # Errors
/// With what is wrong.
pub fn check_jacobian<'a>(
    model: impl Into<Probe<'a>>,
    measurement: &str,
    points: usize,
    function: impl Fn(&[f64], &[f64]) -> Vec<f64>,
) -> Result<(), String> {
    let probe: Probe = model.into();
    let names: Vec<&str> = probe.program.measurements.iter().map(|one| one.name.as_str()).collect();
    let index = names.iter().position(|name| *name == measurement).ok_or_else(|| {
        let hint = did_you_mean(measurement, "measurements", &names).map(|hint| format!(": {hint}"));
        format!("there is no measurement `{measurement}`{}", hint.unwrap_or_default())
    })?;
    let found = check_function(probe.program, index, &probe.options.selection, points, probe.seed, &function)?;
    if found.wrong.is_empty() { Ok(()) } else { Err(message(&found)) }
}

fn message(found: &CheckedFunction) -> String {
    let mut out = format!(
        "the Jacobian of `{}` is wrong in {} of {} entries ({} residuals by {} parameters)",
        found.measurement,
        found.wrong.len(),
        found.residuals.len() * found.parameters.len(),
        found.residuals.len(),
        found.parameters.len()
    );
    for one in &found.blame {
        let _ = write!(out, "\n  {}: {}", one.of, one.sentence);
    }
    for one in found.wrong.iter().take(SHOWN) {
        let (given, exact) = (one.given, one.exact);
        let _ = write!(
            out,
            "\n  {} by {} is given as {given:e}, and is {exact:e}: {:.1} digits",
            one.residual, one.by, one.digits
        );
    }
    if found.wrong.len() > SHOWN {
        let _ = write!(out, "\n  and {} more", found.wrong.len() - SHOWN);
    }
    if let Some(example) = &found.counter_example {
        let number = |(name, value, unit): &(String, f64, String)| {
            format!("{name} = {} {unit}", significant(*value, 6)).trim_end().to_owned()
        };
        let at: Vec<String> = example.at.iter().map(number).collect();
        let at = if at.is_empty() { "the nominal values".to_owned() } else { at.join(", ") };
        let (given, exact) = (significant(example.given, 6), significant(example.exact, 6));
        let _ = write!(out, "\n  wrong already at {at}: {} is given as {given}, and is {exact}", example.entry);
    }
    out
}
