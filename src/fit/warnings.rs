//! What to be careful about.

use super::estimate::Fit;
use crate::diag::{Code, Diagnostic, Diagnostics};

/// The warnings of a fit of `n` coordinates.
pub(super) fn warnings(fit: &Fit, n: usize, projected: bool) -> Diagnostics {
    let mut warnings = Diagnostics::new();
    if projected {
        warnings.push(Diagnostic::warning(Code::StartProjected, "the start was moved onto its bounds and constraints"));
    }
    if fit.equations + fit.priors < n {
        let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let (equations, priors) = (count(fit.equations, "equation"), count(fit.priors, "prior"));
        let message = format!("{equations} and {priors} cannot determine {}", count(n, "parameter"));
        warnings.push(
            Diagnostic::warning(Code::Underdetermined, message)
                .hint("measure more rows, or hold parameters with `--fix`"),
        );
    }
    let blind: Vec<&str> = fit.parameters.iter().filter(|p| !p.estimable).map(|p| p.name.as_str()).collect();
    if !blind.is_empty() {
        let message = format!("not estimable: {}", list(&blind));
        let hint = match fit.null_directions.len() {
            1 => "the data see only a combination of these: hold one of them with `--fix`, or measure more".to_owned(),
            n => format!("{n} combinations of these are not seen: hold one of each with `--fix`, or measure more"),
        };
        warnings.push(Diagnostic::warning(Code::NotEstimable, message).hint(hint));
    }
    if fit.redundant > 0 {
        let message = format!("{} equations say what others of their rows say already", fit.redundant);
        let found = Diagnostic::warning(Code::RedundantEquations, message);
        warnings.push(found.hint("they are left out; remove residuals that say nothing new"));
    }
    let weak: Vec<&str> = fit
        .parameters
        .iter()
        .filter(|p| p.sigma.is_some_and(|sigma| sigma > p.tolerance))
        .map(|p| p.name.as_str())
        .collect();
    if !weak.is_empty() {
        let message = format!("known less well than the declared tolerance: {}", list(&weak));
        warnings.push(Diagnostic::warning(Code::PracticallyWeak, message).hint("measure more, or elsewhere"));
    }
    warnings
}

fn list(names: &[&str]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    match names.len().checked_sub(MOST) {
        Some(more) if more > 0 => format!("{} and {more} more", shown.join(", ")),
        _ => shown.join(", "),
    }
}
