//! Uncertainties of outputs as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::count;
use super::fit::unit;
use super::number::{rounded, significant};
use super::table::{Align, Grid};
use crate::evaluate::{COVERAGE, Evaluated, Gap, Uncertainties, Uncertainty, Why};
use crate::fit::Stated;

/// Parameters that a line names.
const MOST_NAMES: usize = 6;

/// What outputs are known to, and from what.
#[derive(Clone, Debug, Default)]
pub struct Predicted {
    /// What the file of values says of them; none where they are nominal.
    pub stated: Option<Stated>,
    /// By measurement, in the order of the evaluation.
    pub measurements: Vec<Uncertainties>,
}

impl Predicted {
    /// What is to be said before any number.
    pub(super) fn note(&self) -> Option<String> {
        if self.measurements.iter().all(|all| all.outputs.is_empty()) {
            return None;
        }
        match &self.stated {
            None => {
                Some("uncertainties of outputs are those of the readings alone: nominal values count as exact".into())
            }
            Some(Stated::Unknown(why)) => Some(format!("no uncertainty of what depends on parameters: {why}")),
            Some(Stated::Known(_)) => None,
        }
    }
}

/// The budget of each output, and why some have no uncertainty.
pub(super) fn text(measured: &Evaluated, all: &Uncertainties) -> String {
    let mut out = String::new();
    let with: Vec<(&str, &str, &Uncertainty)> = measured
        .outputs
        .iter()
        .zip(&all.outputs)
        .filter(|(_, uncertainty)| uncertainty.rms.is_some())
        .map(|(column, uncertainty)| (column.name.as_str(), unit(&column.unit), uncertainty))
        .collect();
    if let Some((_, _, first)) = with.first() {
        let heading = if measured.rows > 1 {
            "Standard uncertainties, root mean square over the rows, and whose errors they are"
        } else {
            "Standard uncertainties, and whose errors they are"
        };
        let _ = writeln!(out, "  {heading}");
        let mut align = vec![Align::Left, Align::Right, Align::Left];
        align.extend(first.budget.iter().map(|_| Align::Right));
        align.extend([Align::Right, Align::Right]);
        let mut grid = Grid::new(&align);
        let level = format!("for {} %", significant(100.0 * COVERAGE, 3));
        let groups = first.budget.iter().map(|(name, _)| name.clone());
        grid.row(["", "", ""].map(str::to_owned).into_iter().chain(groups).chain(["dof".into(), level]));
        for (name, symbol, uncertainty) in with {
            let sigma = uncertainty.rms.map_or(String::new(), |sigma| rounded(sigma, 2));
            let shares = uncertainty.budget.iter().map(|(_, share)| percent(*share));
            let dof = uncertainty.effective_dof.map_or(String::new(), freedom);
            let factor = uncertainty.coverage_factor.map_or(String::new(), |k| format!("× {k:.2}"));
            grid.row([name.to_owned(), sigma, symbol.to_owned()].into_iter().chain(shares).chain([dof, factor]));
        }
        out.push_str(&grid.text("  "));
    }
    out.push_str(&gaps(measured, all));
    out
}

/// Why some outputs have no uncertainty: a line for all that have the same reason.
fn gaps(measured: &Evaluated, all: &Uncertainties) -> String {
    let mut found: Vec<(&Gap, Vec<String>)> = Vec::new();
    for (column, uncertainty) in measured.outputs.iter().zip(&all.outputs) {
        for gap in &uncertainty.gaps {
            match found.iter_mut().find(|(known, _)| *known == gap) {
                Some((_, names)) => names.push(column.name.clone()),
                None => found.push((gap, vec![column.name.clone()])),
            }
        }
    }
    let mut out = String::new();
    for (gap, names) in found {
        let rows = match gap.rows == measured.rows {
            true => String::new(),
            false => format!(" in {}", count(gap.rows, "row", "rows")),
        };
        let (has, it) = if names.len() == 1 { ("has", "it depends") } else { ("have", "they depend") };
        let _ = writeln!(out, "  {} {has} no uncertainty{rows}: {}", list(&names), reason(gap, it));
    }
    out
}

/// Degrees of freedom as they count: the next lower integer.
fn freedom(dof: f64) -> String {
    const MANY: f64 = 1e6;
    match dof {
        dof if dof.is_infinite() => "∞".into(),
        dof if dof >= MANY => "> 1e6".into(),
        dof if dof >= 1.0 => significant(dof.floor(), 6),
        dof => significant(dof, 2),
    }
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share + 0.0)
}

/// Why, in words. `it` depends on something.
fn reason(gap: &Gap, it: &str) -> String {
    let names = list(&gap.parameters);
    match gap.why {
        Why::NotEstimable if names.is_empty() => format!("{it} on what is not estimable"),
        Why::NotEstimable => format!("{it} on what is not estimable, {names}"),
        Why::OnBound => format!("{it} on {names} on a bound, and what is known is conditional on that"),
        Why::Unstated => format!("{it} on parameters of which nothing says how well they are known"),
        Why::NoDerivative => "there is no derivative".into(),
        Why::Nothing => format!("{it} on nothing that has one"),
        Why::Rounding => "it is lost in rounding".into(),
    }
}

fn list(names: &[String]) -> String {
    let (shown, more) = names.split_at(names.len().min(MOST_NAMES));
    match (more.len(), names) {
        (0, []) => String::new(),
        (0, [alone]) => alone.clone(),
        (0, [first @ .., last]) => format!("{} and {last}", first.join(", ")),
        (more, _) => format!("{} and {more} more", shown.join(", ")),
    }
}

/// One output's uncertainty.
pub(super) fn json(of: &Uncertainty) -> Value {
    let budget = of.budget.iter().map(|(group, share)| json!({ "group": group, "share": share }));
    let gaps = of.gaps.iter().map(|gap| {
        json!({
            "why": gap.why.name(), "message": reason(gap, "it depends"), "parameters": gap.parameters, "rows": gap.rows,
        })
    });
    json!({
        "sigma": of.sigma,
        "rms": of.rms,
        "budget": budget.collect::<Vec<_>>(),
        "effective_dof": of.effective_dof.filter(|dof| dof.is_finite()),
        "coverage": COVERAGE,
        "coverage_factor": of.coverage_factor,
        "gaps": gaps.collect::<Vec<_>>(),
    })
}
