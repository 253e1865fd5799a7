//! A fit as text: the verdict first, then what it rests on.

use std::fmt::Write;

use super::count;
use super::number::{rounded, significant, with_sigma};
use super::table::{Align, Grid};
use crate::fit::{Confidence, Estimate, Fit, Term, sentence};
use crate::problem::Weights;
use crate::session::{Bound, UsedFile};

/// One sentence: trust it, or why not.
pub fn verdict(fit: &Fit) -> String {
    let verdict = fit.verdict();
    if verdict.trustworthy() {
        let all = match fit.parameters.len() {
            0 => "nothing is free".to_owned(),
            1 => "the only parameter is estimable".to_owned(),
            n => format!("all {n} parameters estimable"),
        };
        let untested = match fit.weights {
            Weights::Unit if fit.dof > 0 => "; weights are unit, so the size of the residuals is not tested",
            _ => "",
        };
        format!("Trustworthy: converged, {all}{untested}")
    } else {
        format!("Not trustworthy: {}", verdict.reasons.join("; "))
    }
}

/// The report of a calibration.
pub fn fit_text(fit: &Fit, bound: &Bound) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}\n", verdict(fit));
    let _ = writeln!(out, "{} ({})", bound.session.program.name, bound.session.path.display());
    for used in &bound.files {
        let _ = writeln!(out, "  {}", rows(used));
    }
    let _ = writeln!(
        out,
        "  {}, {}, {}; rank of the data {}",
        count(fit.equations, "equation", "equations"),
        count(fit.parameters.len(), "free parameter", "free parameters"),
        count(fit.priors, "prior", "priors"),
        fit.rank
    );
    let _ = writeln!(out, "  {} ({})", fit.status, count(fit.iterations, "iteration", "iterations"));
    out.push_str(&super::starts::text(fit));
    let sigma0 = fit.sigma0.map_or("none".into(), |sigma0| significant(sigma0, 5));
    let _ = writeln!(
        out,
        "  weights {}, sum of squares {}, degrees of freedom {}, sigma0 {sigma0}",
        fit.weights.name(),
        significant(fit.sum_of_squares, 6),
        fit.dof
    );
    if let Some(chi) = &fit.chi_squared {
        let _ = writeln!(
            out,
            "  chi-squared {} at {} degrees of freedom, probability of more {}",
            significant(chi.value, 5),
            chi.dof,
            significant(chi.upper_tail, 2)
        );
    }
    if let Some(found) = &fit.lack_of_fit {
        let _ = writeln!(
            out,
            "  lack of fit: F {} against {} of repeated rows, probability of more {}",
            significant(found.test.statistic, 4),
            count(found.pure.dof, "degree of freedom", "degrees of freedom"),
            significant(found.test.upper_tail, 2)
        );
    }
    if let Some(robust) = &fit.robust {
        let rejected = count(fit.rejected, "row", "rows");
        let _ = writeln!(out, "  loss {robust}: {rejected} without weight");
    }
    if let Some(norm) = &fit.norm {
        let _ = writeln!(out, "  minimised: {norm}");
    }
    if fit.redundant > 0 {
        let equations = count(fit.redundant, "equation", "equations");
        let _ = writeln!(out, "  {equations} left out, for others of their rows say the same");
    }
    if !fit.parameters.is_empty() {
        let _ = writeln!(out, "\nParameters ({})", uncertainty(fit));
        out.push_str(&estimates(&fit.parameters, fit.norm.is_some()));
    }
    out.push_str(&super::restraints::text(fit));
    if !fit.null_directions.is_empty() {
        out.push_str("\nNot determined\n");
        for found in &fit.null_directions {
            let _ = writeln!(out, "  {}", direction(found, &fit.parameters));
        }
    }
    if !fit.held.is_empty() {
        out.push_str("\nHeld\n");
        let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left]);
        for held in &fit.held {
            grid.row([held.name.clone(), significant(held.value, 10), unit(&held.unit).to_owned()]);
        }
        out.push_str(&grid.text("  "));
    }
    out.push_str("\nResiduals, root mean square\n");
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left]);
    for (name, rms, symbol) in &fit.residual_rms {
        grid.row([name.clone(), rounded(*rms, 4), unit(symbol).to_owned()]);
    }
    out.push_str(&grid.text("  "));
    out.push_str(&super::observations::text(fit));
    out
}

/// What the sigmas are.
fn uncertainty(fit: &Fit) -> String {
    if fit.norm.is_some() {
        return "no uncertainties: those of squares do not hold".into();
    }
    let of = match fit.weights {
        Weights::Unit => "standard uncertainties from the scatter of the residuals",
        Weights::Sigma => "standard uncertainties from the declared sigmas",
        Weights::Propagated => "standard uncertainties from the declared sigmas of the readings",
    };
    let Confidence { level, factor, .. } = fit.confidence;
    match factor.is_finite() {
        true => format!("{of}; times {} for {} %", significant(factor, 3), significant(100.0 * level, 3)),
        false => of.to_owned(),
    }
}

/// A line for each estimate.
pub(super) fn estimates(parameters: &[Estimate], of_norm: bool) -> String {
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Left, Align::Left]);
    for p in parameters {
        let (value, sigma) = match p.sigma {
            Some(sigma) => {
                let (value, sigma) = with_sigma(p.value, sigma);
                (value, format!("± {sigma}"))
            }
            None => (significant(p.value, 7), String::new()),
        };
        let note = match (p.estimable, p.at_bound, p.sigma) {
            (false, ..) => "not estimable",
            (true, true, _) => "on its bound",
            (true, false, None) if of_norm => "",
            (true, false, None) => "no uncertainty: nothing tells the scale",
            (true, false, Some(_)) if p.at_datum => "at the datum: another would move it",
            (true, false, Some(sigma)) if sigma > p.tolerance => "weaker than its tolerance",
            _ => "",
        };
        grid.row([p.name.as_str(), &value, &sigma, unit(&p.unit), note]);
    }
    grid.text("  ")
}

/// A null direction in words.
pub fn direction(combination: &[(String, f64)], parameters: &[Estimate]) -> String {
    let term = |(name, weight): &(String, f64)| {
        let known = parameters.iter().find(|p| p.name == *name)?;
        Some(Term {
            name: name.clone(),
            weight: *weight,
            tolerance: known.tolerance,
            unit: known.unit.clone(),
            value: known.value,
        })
    };
    sentence(&combination.iter().filter_map(term).collect::<Vec<_>>())
}

pub(super) fn rows(used: &UsedFile) -> String {
    format!("{}: {} of {}", used.measurement, count(used.rows, "row", "rows"), used.file)
}

/// A plain number shows no unit.
pub(super) fn unit(symbol: &str) -> &str {
    if symbol == "1" { "" } else { symbol }
}
