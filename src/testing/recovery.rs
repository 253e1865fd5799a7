//! Whether exact data are fitted back to the truth.

use std::ops::Range;

use super::{demand, said};
use crate::compile::{Distribution, Scenario};
use crate::identify::{Inputs, Probe};
use crate::problem::Problem;
use crate::session::{Procedure, fit_by};
use crate::simulate::{self, simulate};
use crate::solve::LeastSquares;

/// How near the estimates of exact data come to the truth, in tolerances.
const NEAR: f64 = 1e-3;
/// What the truth may leave of the cost at the start; a model whose truth does not make its residuals vanish leaves more.
const LEFT: f64 = 1e-12;

/// Asserts that data of the scenario without any errors, one set for each seed, are fitted back to the truth from the declared
/// start: whatever is estimable comes within a thousandth of its tolerance. What is held is held at its truth, and priors are
/// centred on it, so that they do not pull away from it. Where a scenario draws errors by itself, as auxiliary quantities, these are
/// set to their means.
///
/// # Panics
/// With the seed and what is not recovered, or that there is no scenario.
#[track_caller]
pub fn assert_recovers<'a>(model: impl Into<Probe<'a>>, seeds: Range<u64>) {
    demand(check_recovers(model, seeds));
}

/// The same for a property.
///
/// # Errors
/// With the seed and what is not recovered, or that there is no scenario.
pub fn check_recovers<'a>(model: impl Into<Probe<'a>>, seeds: Range<u64>) -> Result<(), String> {
    let probe = model.into();
    for seed in seeds {
        of_seed(&probe, seed).map_err(|why| format!("seed {seed}: {why}"))?;
    }
    Ok(())
}

fn of_seed(probe: &Probe, seed: u64) -> Result<(), String> {
    let Inputs::Scenario(scenario) = probe.inputs else {
        return Err("there is no scenario to make exact data of".into());
    };
    match of_scenario(probe, scenario, seed)? {
        Outcome::Recovered => Ok(()),
        // errors that the scenario draws by itself, which making exact data knows nothing of
        Outcome::Unexplained(_) => match of_scenario(probe, &without_errors(probe, scenario), seed)? {
            Outcome::Recovered => Ok(()),
            Outcome::Unexplained(why) => Err(why),
        },
    }
}

enum Outcome {
    Recovered,
    /// The truth leaves something of the residuals: how much.
    Unexplained(String),
}

/// The scenario with every auxiliary quantity that is drawn normally at its mean.
fn without_errors(probe: &Probe, scenario: &Scenario) -> Scenario {
    let mut quiet = scenario.clone();
    for simulation in &mut quiet.measurements {
        let inputs = probe.program.measurements[simulation.measurement].inputs.len();
        for (variable, drawn) in &mut simulation.draws {
            if let (true, Distribution::Normal(mean, _)) = (*variable >= inputs, &*drawn) {
                *drawn = Distribution::Constant(*mean);
            }
        }
    }
    quiet
}

fn of_scenario(probe: &Probe, scenario: &Scenario, seed: u64) -> Result<Outcome, String> {
    let options = simulate::Options { rows: probe.rows.clone(), seed: Some(seed), exact: true };
    let made = simulate(probe.program, scenario, &options).map_err(|found| said(&(*found).into()))?;
    let (mut problem, _) = Problem::bind(probe.program, made.tables, &probe.options).map_err(|found| said(&found))?;
    let units = &problem.program.units;
    let mut truth = problem.start.clone();
    for (name, value) in &made.truth {
        if let Some(c) = problem.layout.find(name) {
            truth[c] = units.to_internal(*value, units.unit(problem.layout.coordinates[c].dimension));
        }
    }
    for (c, coordinate) in problem.layout.coordinates.iter_mut().enumerate() {
        coordinate.nominal = truth[c];
        if !problem.free.contains(&c) {
            problem.start[c] = truth[c];
        }
    }
    let cost = |point: &Vec<f64>| problem.cost(point).map_err(|undefined| undefined.0.message);
    let (before, left) = (cost(&problem.start)?, cost(&truth)?);
    if left > LEFT * (before + 1.0) {
        let why = format!("the truth does not explain its exact data: cost {left:.3e}, and {before:.3e} at the start");
        return Ok(Outcome::Unexplained(why));
    }
    let fit = fit_by(&problem, &Procedure::default()).map_err(|found| found.message)?;
    let mut wrong = Vec::new();
    if !fit.status.converged() {
        wrong.push(format!("not converged: {}", fit.status));
    }
    let off = problem.difference(&truth, &fit.point);
    for (known, &c) in fit.parameters.iter().zip(&problem.free) {
        let (off, tolerance) = (off[c].abs(), problem.layout.coordinates[c].tolerance);
        let near = off <= NEAR * tolerance;
        if known.estimable && !near {
            let truth = units.to_reported(truth[c], problem.layout.coordinates[c].dimension);
            let unit = if known.unit == "1" { String::new() } else { format!(" {}", known.unit) };
            let tolerances = off / tolerance;
            wrong.push(format!(
                "`{}` came out as {}{unit}, its truth is {truth}{unit}: {tolerances:.2e} tolerances off",
                known.name, known.value
            ));
        }
    }
    if wrong.is_empty() {
        Ok(Outcome::Recovered)
    } else {
        Err(format!("the truth is not recovered\n  {}", wrong.join("\n  ")))
    }
}
