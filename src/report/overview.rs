//! Many models side by side: what is free, what the data see of it, and how well it is known.

use serde_json::{Value, json};

use super::number::significant;
use crate::fit::{Estimate, Fit};

/// A model and its fit, as a line among others.
#[derive(Clone, Debug)]
pub struct Overview {
    /// The model file.
    pub file: String,
    /// What the model is called.
    pub name: String,
    /// How many rows of data there are.
    pub rows: usize,
    /// The fit.
    pub fit: Fit,
    /// Nanoseconds from the text to the fit.
    pub ns: u64,
}

/// Of each unit in the order of the parameters, the one that is least known.
fn least_known(fit: &Fit) -> Vec<(&Estimate, f64)> {
    let mut worst: Vec<(&Estimate, f64)> = Vec::new();
    for (estimate, sigma) in fit.parameters.iter().filter_map(|p| Some((p, p.sigma?))) {
        match worst.iter_mut().find(|(known, _)| known.unit == estimate.unit) {
            Some(known) if known.1 < sigma => *known = (estimate, sigma),
            Some(_) => {}
            None => worst.push((estimate, sigma)),
        }
    }
    worst
}

/// A table in Markdown, a line for each model; a bar in a name would end its cell.
pub fn overview_text(all: &[Overview]) -> String {
    let mut out = String::from(
        "| model | free | rank | rows | equations | χ²/dof | least known | time |\n|---|---|---|---|---|---|---|---|\n",
    );
    for of in all {
        let fit = &of.fit;
        let chi = fit.chi_squared.map_or("–".into(), |chi| format!("{:.2}", chi.value / chi.dof.max(1) as f64));
        let known = |(p, sigma): &(&Estimate, f64)| {
            let unit = if p.unit == "1" { "" } else { &p.unit };
            format!("`{}` ± {}", p.name, format!("{} {unit}", significant(*sigma, 2)).trim_end())
        };
        let known: Vec<String> = least_known(fit).iter().map(known).collect();
        let doubt = if fit.verdict().trustworthy() { "" } else { " (not to be trusted)" };
        let cells = [
            format!("{}{doubt}", of.file),
            fit.parameters.len().to_string(),
            fit.rank.to_string(),
            of.rows.to_string(),
            fit.equations.to_string(),
            chi,
            known.join(", "),
            format!("{} ms", significant(of.ns as f64 / 1e6, 2)),
        ];
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        out.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
    out
}

/// The same for programs.
pub fn overview_json(all: &[Overview]) -> Value {
    let line = |of: &Overview| {
        let known = |(p, sigma): &(&Estimate, f64)| json!({"name": p.name, "sigma": sigma, "unit": p.unit});
        json!({
            "model": of.file, "name": of.name, "free": of.fit.parameters.len(), "rank": of.fit.rank, "rows": of.rows,
            "equations": of.fit.equations, "dof": of.fit.dof, "chi_squared": of.fit.chi_squared.map(|chi| chi.value),
            "least_known": least_known(&of.fit).iter().map(known).collect::<Vec<_>>(), "total_ns": of.ns,
            "trustworthy": of.fit.verdict().trustworthy(),
        })
    };
    json!({ "models": all.iter().map(line).collect::<Vec<_>>() })
}
