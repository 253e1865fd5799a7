//! What a search from several starts, or along a path, found besides the fit itself.

use serde_json::{Map, Value, json};

/// What the search from several starts found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Starts {
    /// How many there were, the declared one among them.
    pub total: usize,
    /// Of these, how many converged.
    pub converged: usize,
    /// Of the others, how many could not begin: something is undefined there.
    pub undefined: usize,
    /// How many ended in the minimum that counts.
    pub agreed: usize,
    /// Free coordinates with neither bounds nor a prior: all starts have the same value.
    pub not_varied: Vec<String>,
    /// The different minima, lowest cost first.
    pub minima: Vec<Minimum>,
}

/// Where starts ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Minimum {
    /// ½ of all that is minimised.
    pub cost: f64,
    /// How many starts ended here.
    pub count: usize,
    /// Whether the declared start did.
    pub declared: bool,
    /// Whether the data cannot tell it from the best.
    pub as_good: bool,
    /// In reported units: the free coordinates by which the minima differ; all of them where there is only one.
    pub at: Vec<(String, f64)>,
}

/// How far the path of a continuation was followed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Continuation {
    /// Stages that were solved, those that were tried with too long a step among them.
    pub steps: usize,
    /// λ of the last stage, 1 at the end.
    pub reached: f64,
}

impl Starts {
    /// Starts that ended nowhere.
    pub fn failed(&self) -> usize {
        self.total.saturating_sub(self.converged)
    }

    pub(super) fn json(&self) -> Value {
        let minimum = |m: &Minimum| {
            let at: Map<String, Value> = m.at.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
            json!({"cost": m.cost, "count": m.count, "declared_start": m.declared, "as_good": m.as_good, "at": at})
        };
        json!({
            "total": self.total, "converged": self.converged, "undefined": self.undefined, "agreed": self.agreed,
            "not_varied": self.not_varied, "minima": self.minima.iter().map(minimum).collect::<Vec<_>>(),
        })
    }
}

impl Continuation {
    pub(super) fn json(&self) -> Value {
        json!({"steps": self.steps, "reached": self.reached})
    }
}
