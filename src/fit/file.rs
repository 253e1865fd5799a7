//! A fit as a JSON file, and values read back from one.

use serde_json::{Map, Value, json};

use super::estimate::Fit;
use super::observations::{ALPHA, Observation, Observations, POWER};
use super::uncertainty::JointUncertainty;
use crate::diag::{Code, DataPlace, Diagnostic, json as diagnostics_json};
use crate::solve::{ConicStep, Restriction};

/// What a fit file holds beside the fit itself.
#[derive(Clone, Debug, Default)]
pub struct FitFile {
    /// Version, fingerprints, options.
    pub provenance: Map<String, Value>,
    /// Nanoseconds by stage.
    pub timings: Map<String, Value>,
    /// How well rows were predicted that took no part, where asked for.
    pub hold_out: Value,
}

impl FitFile {
    /// The JSON of a fit. Numbers round-trip exactly.
    pub fn json(&self, fit: &Fit) -> Value {
        let verdict = fit.verdict();
        let parameters: Vec<Value> = fit
            .parameters
            .iter()
            .map(|p| {
                json!({
                    "name": p.name, "value": p.value, "unit": p.unit, "sigma": p.sigma, "interval": p.interval,
                    "estimable": p.estimable, "at_datum": p.at_datum,
                    "at_bound": p.at_bound, "nominal": p.nominal, "prior": p.prior, "tolerance": p.tolerance,
                })
            })
            .collect();
        let held: Vec<Value> =
            fit.held.iter().map(|p| json!({"name": p.name, "value": p.value, "unit": p.unit})).collect();
        let directions: Vec<Value> = fit
            .null_directions
            .iter()
            .map(|direction| {
                let combination: Map<String, Value> =
                    direction.iter().map(|(name, w)| (name.clone(), json!(w))).collect();
                json!({ "combination": combination })
            })
            .collect();
        let trace: Vec<Value> = fit
            .trace
            .iter()
            .map(|t| {
                json!({
                    "iteration": t.iteration, "kind": t.kind.name(), "cost": t.cost, "trial_cost": t.trial_cost,
                    "predicted": t.predicted, "gain": t.gain, "damping": t.damping, "radius": t.radius,
                    "rounding": t.rounding, "step_norm": t.step_norm, "gradient": t.gradient, "accepted": t.accepted,
                    "conic": t.conic.as_ref().map(|step| conic(fit, step)),
                })
            })
            .collect();
        let component =
            |c: &super::observations::Component| json!({"group": c.group, "factor": c.factor, "sigma": c.sigma});
        let components: Vec<Value> = fit.components.iter().map(component).collect();
        let rms: Map<String, Value> =
            fit.residual_rms.iter().map(|(name, rms, _)| (name.clone(), json!(rms))).collect();
        let units: Map<String, Value> =
            fit.residual_rms.iter().map(|(name, _, unit)| (name.clone(), json!(unit))).collect();
        let mut all = json!({
            "status": fit.status.name(),
            "converged": fit.status.converged(),
            "trustworthy": verdict.trustworthy(),
            "verdict": verdict.reasons,
            "cost": fit.cost,
            "sum_of_squares": fit.sum_of_squares,
            "equations": fit.equations,
            "priors": fit.priors,
            "dof": fit.dof,
            "sigma0": fit.sigma0,
            "chi_squared": fit.chi_squared.map(|c| json!({"value": c.value, "dof": c.dof, "upper_tail": c.upper_tail})),
            "confidence": {"level": fit.confidence.level, "factor": fit.confidence.factor, "dof": fit.confidence.dof},
            "lack_of_fit": fit.lack_of_fit.map(|l| json!({
                "groups": l.pure.groups, "pure_error": l.pure.squares, "dof": l.pure.dof, "f": l.test.statistic,
                "upper_tail": l.test.upper_tail,
            })),
            "criteria": fit.criteria.map(|c| json!({"aic": c.aic, "aicc": c.aicc, "bic": c.bic})),
            "weights": fit.weights.name(),
            "robust": fit.robust,
            "rejected_rows": fit.rejected,
            "redundant_equations": fit.redundant,
            "unsettled_rows": fit.unsettled,
            "iterations": fit.iterations,
            "rank": fit.rank,
            "parameters": parameters,
            "held": held,
            "null_directions": directions,
            "correlations": correlations(fit),
            "covariance": covariance(fit),
            "observations": fit.observations.as_ref().map(|o| observations_json(fit, o)),
            "singular_values": fit.singular_values,
            "residual_rms": rms,
            "residual_units": units,
            "trace": trace,
            "timings_ns": self.timings,
            "hold_out": self.hold_out,
            "starts": fit.starts.as_ref().map(super::Starts::json),
            "continuation": fit.continuation.map(|c| c.json()),
            "variance_components": components,
            "removed": fit.removed.iter().map(|o| observation_json(fit, o)).collect::<Vec<_>>(),
            "warnings": diagnostics_json(&fit.warnings),
            "provenance": self.provenance,
        });
        all["restraints"] = fit.restraints.iter().map(super::Restraint::json).collect();
        all["kkt"] = json!(fit.kkt);
        all["norm"] = json!(fit.norm);
        all
    }
}

/// The conic program of a step: how it ended, and what held it.
fn conic(fit: &Fit, step: &ConicStep) -> Value {
    let constraints: Vec<&super::Restraint> = fit.restraints.iter().filter(|r| !r.bound).collect();
    let name = |restriction: &Restriction| match *restriction {
        Restriction::Lower(j) => json!({"parameter": fit.parameters[j].name, "bound": "lower"}),
        Restriction::Upper(j) => json!({"parameter": fit.parameters[j].name, "bound": "upper"}),
        Restriction::Constraint(i) => json!({"constraint": constraints.get(i).map(|r| &r.name)}),
    };
    let active = step.active.iter().map(|(restriction, multiplier)| {
        let mut active = name(restriction);
        active["multiplier"] = json!(multiplier);
        active
    });
    json!({"status": step.status.name(), "iterations": step.iterations, "active": active.collect::<Vec<_>>()})
}

/// Names and matrix of the correlations; null where a coordinate has no variance or is not estimable.
fn correlations(fit: &Fit) -> Value {
    let Some(covariance) = &fit.covariance else { return Value::Null };
    let names: Vec<&str> = fit.parameters.iter().map(|p| p.name.as_str()).collect();
    let known = |i: usize| fit.parameters[i].sigma.is_some();
    let entry = |i: usize, j: usize| covariance.correlation(i, j).filter(|_| known(i) && known(j));
    let matrix: Vec<Vec<Option<f64>>> =
        (0..names.len()).map(|i| (0..names.len()).map(|j| entry(i, j)).collect()).collect();
    json!({ "names": names, "matrix": matrix })
}

/// Names, and the covariance of the free parameters in reported units: that of the minimum-norm datum where not all are
/// estimable, so it is for quantities that change along no null direction.
fn covariance(fit: &Fit) -> Value {
    let all = JointUncertainty::of(fit);
    all.covariance.map_or(Value::Null, |matrix| json!({ "names": all.names, "matrix": matrix }))
}

fn observation_json(fit: &Fit, o: &Observation) -> Value {
    let name = |p: usize| fit.parameters.get(p).map(|p| p.name.as_str());
    let effect = o.effect.map(|(p, sigmas)| json!({"parameter": name(p), "sigmas": sigmas}));
    let partner = |(name, rho): &(String, f64)| json!({"name": name, "correlation": rho});
    let (file, line) = o.place.as_ref().map_or((None, None), |place| (Some(&place.file), place.line));
    json!({
        "measurement": o.measurement_name, "row": o.row + 1, "file": file, "line": line, "name": o.name, "unit": o.unit,
        "observed": o.observed,
        "adjusted": o.adjusted, "sigma": o.sigma, "redundancy": o.redundancy, "test": o.test,
        "smallest_detectable": o.smallest_detectable, "effect": effect,
        "inseparable": o.inseparable.iter().map(partner).collect::<Vec<_>>(),
    })
}

/// What the tests of all observations say.
fn observations_json(fit: &Fit, all: &Observations) -> Value {
    let suspects = all.suspects.iter().map(|o| observation_json(fit, o));
    let groups = all.groups.iter().map(|g| {
        json!({
            "name": g.name, "observations": g.observations, "redundancy": g.redundancy,
            "variance_factor": g.variance_factor(),
        })
    });
    json!({
        "count": all.count, "critical": all.critical, "alpha": ALPHA, "power": POWER,
        "noncentrality": all.noncentrality, "redundancy": all.redundancy, "uncontrolled": all.uncontrolled,
        "suspected": all.suspected, "suspects": suspects.collect::<Vec<_>>(), "groups": groups.collect::<Vec<_>>(),
    })
}

/// A file that is no fit.
pub(super) fn wrong(file: &str, why: String) -> Box<Diagnostic> {
    let hint = "write a fit with `calibrate --out FILE`, or an object such as {\"L1.alpha\": 1.5707}";
    Box::new(Diagnostic::error(Code::BadFitFile, why).at_data(DataPlace::file(file)).hint(hint))
}

/// The values of a fit file, or of a JSON object of name → value.
///
/// # Errors
/// Where the text is neither.
pub fn read_values(file: &str, text: &str) -> Result<Vec<(String, f64)>, Box<Diagnostic>> {
    let wrong = |why: String| wrong(file, why);
    let value: Value = serde_json::from_str(text).map_err(|error| wrong(format!("`{file}` is not JSON: {error}")))?;
    let Value::Object(object) = value else { return Err(wrong(format!("`{file}` is not a JSON object"))) };
    let number = |name: &str, value: Option<&Value>| match value.and_then(Value::as_f64) {
        Some(number) if number.is_finite() => Ok((name.to_owned(), number)),
        _ => Err(wrong(format!("the value of `{name}` is not a number"))),
    };
    let Some(Value::Array(parameters)) = object.get("parameters") else {
        return object.iter().map(|(name, value)| number(name, Some(value))).collect();
    };
    let held = object.get("held").and_then(Value::as_array).into_iter().flatten();
    parameters
        .iter()
        .chain(held)
        .map(|entry| {
            let name =
                entry.get("name").and_then(Value::as_str).ok_or_else(|| wrong("a parameter has no name".into()))?;
            number(name, entry.get("value"))
        })
        .collect()
}
