//! What to be careful about.

use super::estimate::Fit;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::problem::{Block, Problem};

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

/// Residuals that no free parameter changes.
pub(super) fn constant(problem: &Problem) -> Diagnostics {
    let mut warnings = Diagnostics::new();
    if problem.free.is_empty() {
        return warnings;
    }
    for block in &problem.blocks {
        let free = free_leaves(problem, block);
        for (i, residual) in block.measurement.residuals.iter().enumerate() {
            let (leaves, _) = block.measurement.tape.dependencies(i);
            if leaves.iter().zip(&free).all(|(depends, free)| !(depends & free)) {
                let message =
                    format!("`{}` of `{}` depends on no free parameter", residual.name, block.measurement.name);
                let found = Diagnostic::warning(Code::ConstantResidual, message);
                let hint = "it determines nothing: make it an output, or free what it is meant to tell";
                warnings.push(found.at(&problem.program.source, residual.span).hint(hint));
            }
        }
    }
    warnings
}

/// Which of the numbers on a measurement's tape belong to parameters of which anything is free.
fn free_leaves(problem: &Problem, block: &Block) -> Vec<bool> {
    let layout = &problem.layout;
    let parameter = |c: &usize| {
        let group = layout.coordinates.get(*c).and_then(|of| layout.groups.get(of.group));
        group.map(|group| group.parameter)
    };
    let free: Vec<usize> = problem.free.iter().filter_map(parameter).collect();
    let mut leaves = vec![false; block.measurement.leaves];
    for slot in &block.measurement.slots {
        let count = problem.program.parameters.get(slot.parameter).map_or(0, |of| of.shape.leaves());
        let here = leaves.iter_mut().skip(slot.first_leaf).take(count);
        here.for_each(|leaf| *leaf = free.contains(&slot.parameter));
    }
    leaves
}

fn list(names: &[&str]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    match names.len().checked_sub(MOST) {
        Some(more) if more > 0 => format!("{} and {more} more", shown.join(", ")),
        _ => shown.join(", "),
    }
}
