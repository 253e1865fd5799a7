//! Two fits side by side, as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::count;
use super::fit::unit;
use super::number::{rounded, significant, with_sigma};
use super::table::{Align, Grid};
use crate::compare::{Agreement, Nested};

/// Differences by more than so many of their standard uncertainties are marked.
const MARKED: f64 = 3.0;
/// Below this probability a better fit is not chance.
const CHANCE: f64 = 0.05;

/// As text: whether the larger model pays, then how the two differ.
pub fn comparison_text(files: [&str; 2], agreement: &Agreement, nested: &Result<Nested, String>) -> String {
    let mut out = String::new();
    match nested {
        Ok(found) => out.push_str(&nested_text(files, found)),
        Err(why) => {
            let _ = writeln!(out, "Not nested: {why}");
        }
    }
    let _ = writeln!(out, "\n{} less {}, without what another datum would change", files[1], files[0]);
    if agreement.invisible > 0 {
        let directions = count(agreement.invisible, "direction", "directions");
        let _ = writeln!(out, "  {directions} that no data see left out");
    }
    if let Some(test) = agreement.test {
        let _ = writeln!(
            out,
            "  were the data independent: chi-squared {} at {} degrees of freedom, probability of more {}",
            significant(test.statistic, 5),
            agreement.dof,
            significant(test.upper_tail, 2)
        );
    }
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Left, Align::Left]);
    for d in &agreement.differences {
        match d.sigma.filter(|sigma| *sigma > 0.0) {
            Some(sigma) => {
                let (value, text) = with_sigma(d.value, sigma);
                let mark = if d.value.abs() > MARKED * sigma { "differs" } else { "" };
                grid.row([d.name.as_str(), &value, &format!("± {text}"), unit(&d.unit), mark]);
            }
            None => grid.row([d.name.as_str(), &significant(d.value, 4), "", unit(&d.unit), ""]),
        }
    }
    out + &grid.text("  ")
}

fn smaller_first<'f>([one, other]: [&'f str; 2], found: &Nested) -> [&'f str; 2] {
    if found.smaller == 0 { [one, other] } else { [other, one] }
}

fn nested_text(files: [&str; 2], found: &Nested) -> String {
    let mut out = String::new();
    let [small, large] = smaller_first(files, found);
    let more = count(found.between, "parameter", "parameters");
    let verdict = match found.by_chance() {
        Some(chance) if chance < CHANCE => {
            format!("pays: {large} has {more} more than {small}, and fits better than by chance")
        }
        Some(_) => format!("does not pay: {large} has {more} more than {small}, and fits no better than by chance"),
        None => format!("cannot be judged: {large} has {more} more than {small}"),
    };
    let _ = writeln!(out, "The larger model {verdict}");
    let mut test = |name: &str, test: Option<crate::statistics::Test>| {
        if let Some(test) = test {
            let (statistic, tail) = (significant(test.statistic, 5), significant(test.upper_tail, 2));
            let _ = writeln!(out, "  {name} {statistic}, probability of more {tail}");
        }
    };
    test("F", found.f);
    test("likelihood ratio", found.likelihood_ratio);
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Right, Align::Right]);
    grid.row(["criteria, less is better", "AIC", "AICc", "BIC"]);
    for (file, criteria) in files.iter().zip(&found.criteria) {
        let Some(c) = criteria else { continue };
        let corrected = c.aicc.map_or("-".into(), |aicc| rounded(aicc, 6));
        grid.row([(*file).to_owned(), rounded(c.aic, 6), corrected, rounded(c.bic, 6)]);
    }
    out + &grid.text("  ")
}

/// As JSON.
pub fn comparison_json(files: [&str; 2], agreement: &Agreement, nested: &Result<Nested, String>) -> Value {
    let test = |test: Option<crate::statistics::Test>| {
        test.map(|t| json!({"statistic": t.statistic, "upper_tail": t.upper_tail}))
    };
    let nested = match nested {
        Err(why) => json!({ "comparable": false, "why": why }),
        Ok(found) => json!({
            "comparable": true,
            "smaller": smaller_first(files, found)[0],
            "parameters_between": found.between,
            "f": test(found.f),
            "likelihood_ratio": test(found.likelihood_ratio),
            "pays": found.by_chance().map(|chance| chance < CHANCE),
            "criteria": found.criteria.map(|c| c.map(|c| json!({"aic": c.aic, "aicc": c.aicc, "bic": c.bic}))),
        }),
    };
    let differences = agreement.differences.iter();
    let differences = differences.map(|d| json!({"name": d.name, "unit": d.unit, "value": d.value, "sigma": d.sigma}));
    json!({
        "fits": files,
        "nested": nested,
        "agreement": {
            "invisible": agreement.invisible,
            "dof": agreement.dof,
            "test": test(agreement.test),
            "differences": differences.collect::<Vec<_>>(),
        },
    })
}
