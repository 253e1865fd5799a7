//! What a measurement says of its errors: standard deviations, correlations, and what large residuals count.

use std::collections::HashMap;
use std::sync::Arc;

use super::program::{Input, LossOf, Robust, Sigma};
use super::quantity::Quantities;
use super::scope::Scope;
use super::snippet::Snippet;
use super::value::Value;
use crate::diag::{Code, Diagnostic, Diagnostics, did_you_mean};
use crate::graph::Node;
use crate::linalg::{Matrix, cholesky};
use crate::model::{self, Map, Quantity, Text};
use crate::statistics::{Kernel, Loss};
use crate::unit::{Dimension, Unit};

/// A standard deviation: a constant, or an expression of inputs, whose names the scope has.
pub(crate) fn sigma(
    scope: &mut Scope,
    quantity: &Quantity,
    wanted: Dimension,
    bare: Option<Unit>,
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> Option<Sigma> {
    let text = match quantity {
        Quantity::Text(text) if quantities.is_tie(quantity) => text,
        _ => return quantities.positive(quantity, wanted, bare, diagnostics).map(Sigma::Constant),
    };
    let snippet = Snippet::new(text, &scope.declarations.source);
    let (node, dimension) = match scope.value(&snippet)? {
        Value::Scalar(node, dimension) => (node, dimension),
        other => {
            let message = format!("a standard deviation is a number, and this is {}", other.shape());
            diagnostics.push(snippet.whole(Code::WrongShape, message));
            return None;
        }
    };
    if dimension != wanted && !dimension.compatible(wanted) {
        let message = format!("{} is wanted here, and this is {}", wanted.noun(), dimension.noun());
        diagnostics.push(snippet.whole(Code::WrongUnit, message));
        return None;
    }
    let needed = scope.graph.needed(&[node]);
    let mut nodes = needed.iter().enumerate().filter(|(_, needed)| **needed).map(|(id, _)| scope.graph.node(id as u32));
    if nodes.any(|node| matches!(node, Node::Parameter(_))) {
        let message = "a standard deviation depends on a parameter";
        let hint = "it may depend on inputs; factors of groups of errors are estimated by `--variance-components`";
        diagnostics.push(snippet.whole(Code::SigmaOfParameter, message).hint(hint));
        return None;
    }
    match scope.graph.value(node) {
        Some(value) if value > 0.0 => Some(Sigma::Constant(value)),
        Some(_) => {
            diagnostics.push(snippet.whole(Code::NotPositive, "a standard deviation is positive"));
            None
        }
        None => Some(Sigma::PerRow(node)),
    }
}

/// The correlation matrix of the inputs that have a sigma, where any correlation is declared.
pub(crate) fn correlations(
    declared: &Map<Quantity>,
    inputs: &[Input],
    quantities: &Quantities,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<Vec<f64>>> {
    if declared.is_empty() {
        return None;
    }
    let source = Arc::clone(&quantities.source);
    let measured: Vec<&str> = inputs.iter().filter(|i| i.sigma.is_some()).map(|i| i.name.as_str()).collect();
    // of two of the measured, the first one first
    let mut known: HashMap<(usize, usize), f64> = HashMap::new();
    let mut whole = true;
    for (pair, value) in declared.iter() {
        let mut report = |found: Diagnostic| {
            diagnostics.push(found);
            whole = false;
        };
        let at = Snippet::new(pair, &source);
        let names: Vec<&str> = pair.value.split(',').map(str::trim).collect();
        let [one, other] = names[..] else {
            let message = format!("`{}` is not a pair of inputs", pair.value);
            report(at.whole(Code::BadExpression, message).hint("write the two names, as in {\"x, y\": 0.5}"));
            continue;
        };
        let place = |name: &str| measured.iter().position(|known| *known == name);
        let (Some(i), Some(j)) = (place(one), place(other)) else {
            let missing = if place(one).is_none() { one } else { other };
            let message = format!("there is no input `{missing}` that has a sigma");
            let hint = did_you_mean(missing, "inputs with a sigma", &measured);
            report(at.whole(Code::UnknownName, message).maybe_hint(hint));
            continue;
        };
        let Some(value) = quantities.constant(value, Dimension::NUMBER, None, diagnostics) else {
            whole = false;
            continue;
        };
        if i == j || value.abs() >= 1.0 {
            let message = format!("a correlation of {value} between `{one}` and `{other}` makes no sense");
            let hint = "correlations are between two inputs, above −1 and below 1";
            diagnostics.push(at.whole(Code::BadCovariance, message).hint(hint));
            whole = false;
            continue;
        }
        known.insert((i.min(j), i.max(j)), value);
    }
    let entry =
        |i: usize, j: usize| if i == j { 1.0 } else { known.get(&(i.min(j), i.max(j))).copied().unwrap_or(0.0) };
    let all = 0..measured.len();
    let matrix: Vec<Vec<f64>> = all.clone().map(|i| all.clone().map(|j| entry(i, j)).collect()).collect();
    if whole && cholesky(&Matrix::from_rows(measured.len(), &matrix)).is_none() {
        let at = declared.iter().next().map(|(pair, _)| Snippet::new(pair, &source));
        let message = "the correlations contradict each other: no errors are correlated so";
        let found = Diagnostic::error(Code::BadCovariance, message);
        let found = at.map_or(found, |at| at.whole(Code::BadCovariance, message));
        diagnostics.push(found.hint("the matrix of all correlations has to be positive definite"));
        whole = false;
    }
    whole.then_some(matrix)
}

/// What large residuals count.
pub(crate) fn robust(declared: &model::Loss, quantities: &Quantities, diagnostics: &mut Diagnostics) -> Option<Robust> {
    let source = Arc::clone(&quantities.source);
    let names: Vec<&str> = Kernel::ALL.iter().map(|kernel| kernel.name()).collect();
    let kernel =
        choice(&declared.kernel, "loss", &names, &source, diagnostics).and_then(|k| Kernel::ALL.get(k).copied());
    let tuning = match &declared.tuning {
        Some(tuning) => quantities.positive(tuning, Dimension::NUMBER, None, diagnostics).map(Some),
        None => Some(None),
    };
    let mut chosen = |text: &Option<Text>, what: &str, legal: &[&str]| match text {
        Some(text) => choice(text, what, legal, &source, diagnostics),
        None => Some(0),
    };
    let of = chosen(&declared.of, "loss of", &["row", "input"]);
    let scale = chosen(&declared.scale, "scale", &["declared", "estimated"]);
    let loss = Loss::new(kernel?, tuning?).ok()?;
    let of = if of? == 0 { LossOf::Row } else { LossOf::Input };
    Some(Robust { loss, of, estimated: scale? == 1 })
}

/// Which of some words a text is.
fn choice(
    text: &Text,
    what: &str,
    legal: &[&str],
    source: &Arc<crate::diag::Source>,
    diagnostics: &mut Diagnostics,
) -> Option<usize> {
    let found = legal.iter().position(|word| *word == text.value);
    if found.is_none() {
        let message = format!("there is no {what} `{}`", text.value);
        let hint = did_you_mean(&text.value, "known", legal);
        diagnostics.push(Snippet::new(text, source).whole(Code::UnknownVariant, message).maybe_hint(hint));
    }
    found
}
