//! Two fits of the same data by models one of which contains the other.

use serde_json::Value;

use crate::session::Values;
use crate::statistics::{Criteria, Noise, Summary, Test, f_test, likelihood_ratio};

/// What is said of two fits of the same data.
#[derive(Clone, Debug, PartialEq)]
pub struct Nested {
    /// Which of the two has fewer parameters: 0 or 1.
    pub smaller: usize,
    /// Parameters between them.
    pub between: usize,
    /// F, where the scale of the errors is estimated.
    pub f: Option<Test>,
    /// The test of the likelihood ratio.
    pub likelihood_ratio: Option<Test>,
    /// The information criteria of both.
    pub criteria: [Option<Criteria>; 2],
}

impl Nested {
    /// The probability, were the smaller model right, that the larger one fits so much better by chance.
    pub fn by_chance(&self) -> Option<f64> {
        self.f.or(self.likelihood_ratio).map(|test| test.upper_tail)
    }
}

/// What is needed of a fit.
struct Fitted {
    summary: Summary,
    real: bool,
}

fn fitted(values: &Values) -> Result<Fitted, String> {
    let file = &values.file;
    let member = |name: &str| values.member(name);
    let count = |name: &str| member(name).and_then(Value::as_u64).map(|n| n as usize);
    if member("converged").and_then(Value::as_bool) != Some(true) {
        return Err(format!("{file} has not converged"));
    }
    if member("robust").is_some_and(|robust| !robust.is_null()) {
        return Err(format!("{file} has a loss, under which sums of squares are not compared"));
    }
    let cost = member("cost").and_then(Value::as_f64);
    let (Some(cost), Some(equations), Some(priors), Some(dof)) =
        (cost, count("equations"), count("priors"), count("dof"))
    else {
        return Err(format!("{file} is not a fit"));
    };
    let all = equations + priors;
    let summary = Summary { sum_of_squares: 2.0 * cost, equations: all, parameters: all.saturating_sub(dof) };
    Ok(Fitted { summary, real: member("weights").and_then(Value::as_str) != Some("unit") })
}

/// Compares two fits of the same data.
///
/// # Errors
/// In words, why they cannot be compared: other data, other weights, a loss, as many parameters.
pub fn nested(one: &Values, other: &Values) -> Result<Nested, String> {
    let fits = [fitted(one)?, fitted(other)?];
    let data = |values: &Values| {
        let files = values.member("provenance").and_then(|p| p.get("data")).and_then(Value::as_array);
        let prints = files.into_iter().flatten().map(|file| file.get("fingerprint").cloned());
        prints.collect::<Vec<_>>()
    };
    if data(one) != data(other) {
        return Err("the fits are of different data".into());
    }
    if one.member("weights") != other.member("weights") || one.member("removed") != other.member("removed") {
        return Err("the fits weigh the data differently".into());
    }
    let [a, b] = [&fits[0].summary, &fits[1].summary];
    if a.equations != b.equations {
        return Err("the fits have other priors or equations".into());
    }
    let smaller = usize::from(a.parameters > b.parameters);
    let (small, large) = if smaller == 0 { (a, b) } else { (b, a) };
    if small.parameters == large.parameters {
        return Err("the fits have as many parameters".into());
    }
    let noise = if fits[0].real { Noise::Known } else { Noise::Unknown };
    Ok(Nested {
        smaller,
        between: large.parameters - small.parameters,
        f: f_test(small, large).filter(|_| noise == Noise::Unknown),
        likelihood_ratio: likelihood_ratio(small, large, noise),
        criteria: [Criteria::new(a, noise), Criteria::new(b, noise)],
    })
}
