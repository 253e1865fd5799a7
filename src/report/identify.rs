//! What data can see, as text and JSON.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::count;
use super::fit::unit;
use super::number::{rounded, significant};
use super::table::{Align, Grid};
use crate::identify::{
    CONDITION_INDEX, Candidate, Collinearity, Cure, Dependency, Direction, Known, Practice, Structure,
};
use crate::session::Session;

/// Names of a cluster that are shown.
const MOST_NAMES: usize = 8;

fn head(session: &Session, inputs: &str) -> String {
    format!("{} ({})\n  inputs: {inputs}\n", session.program.name, session.path.display())
}

fn verdict(blind: usize, free: usize, stationary: usize) -> String {
    match (blind, stationary) {
        (0, 0) if free == 0 => "Nothing is free".into(),
        (0, 0) if free == 1 => "The only parameter can be known".into(),
        (0, 0) => format!("All {free} parameters can be known"),
        (0, _) => {
            "Not all can be known from the nominal values: some directions are invisible there, to first order".into()
        }
        (1, _) => "Not all can be known: one parameter is not estimable".into(),
        _ => format!("Not all can be known: {blind} parameters are not estimable"),
    }
}

fn directions(out: &mut String, title: &str, all: &[Direction]) {
    if all.is_empty() {
        return;
    }
    let _ = writeln!(out, "\n{title}");
    for found in all {
        let _ = writeln!(out, "  {}", found.sentence);
        let Some(walk) = &found.walk else { continue };
        let _ = match walk.family {
            true => writeln!(
                out,
                "    followed for {} tolerances, the residuals stay zero to rounding ({}; {} along the straight line)",
                walk.length,
                significant(walk.residual, 2),
                significant(walk.straight, 2)
            ),
            false => writeln!(
                out,
                "    invisible to first order only: {} tolerances along it the residuals are {}",
                walk.length,
                significant(walk.residual, 2)
            ),
        };
    }
}

fn cures(out: &mut String, parts: &[Vec<Cure>]) {
    for choices in parts.iter().filter(|choices| !choices.is_empty()) {
        out.push_str("\nWhat to hold, the best choice first\n");
        for cure in choices {
            let _ = writeln!(out, "  {} (conditioning {})", cure.sentence(), significant(cure.conditioning, 2));
        }
    }
}

/// The report of what any data of a kind can see.
pub fn structure_text(found: &Structure, session: &Session, inputs: &str) -> String {
    let blind = found.estimable.iter().filter(|estimable| !**estimable).count();
    let mut out = format!("{}\n\n", verdict(blind, found.free.len(), found.stationary.len()));
    out.push_str(&head(session, inputs));
    let _ = writeln!(
        out,
        "  rank {} of {}, the largest at {}",
        found.rank,
        count(found.free.len(), "free parameter", "free parameters"),
        count(found.points, "point", "points")
    );
    if found.skipped > 0 {
        let _ = writeln!(out, "  {} without consistent inputs passed over", count(found.skipped, "point", "points"));
    }
    if let Some(rank) = found.nominal_rank.filter(|rank| *rank < found.rank) {
        let _ = writeln!(out, "  rank {rank} at the nominal values");
    }
    if !found.told_at_nominal && !found.invisible.is_empty() {
        out.push_str("  weights of directions are those at a random point\n");
    }
    directions(&mut out, "Invisible, whatever is measured in this way", &found.invisible);
    directions(&mut out, "Invisible at the nominal values, and only there", &found.stationary);
    directions(&mut out, "Weak: seen, but next to not at all", &found.weak);
    cures(&mut out, &found.cures);
    out
}

/// The report of what some measurements would tell.
pub fn practice_text(found: &Practice, session: &Session, inputs: &str) -> String {
    let blind = found.parameters.iter().filter(|known| !known.estimable).count();
    let mut out = format!("{}\n\n", verdict(blind, found.parameters.len(), 0));
    out.push_str(&head(session, inputs));
    for (measurement, rows) in &found.rows {
        let _ = writeln!(out, "  {measurement}: {}", count(*rows, "row", "rows"));
    }
    if found.left_out > 0 {
        let _ = writeln!(out, "  {} without consistent inputs left out", count(found.left_out, "row", "rows"));
    }
    let _ = writeln!(
        out,
        "  {}, {}, {}; weights {}; rank of the data {}",
        count(found.equations, "equation", "equations"),
        count(found.parameters.len(), "free parameter", "free parameters"),
        count(found.priors, "prior", "priors"),
        found.weights.name(),
        found.rank
    );
    let o = &found.indices;
    let _ = writeln!(
        out,
        "  scaled condition {}; O1 {}, O2 {}, O3 {}, O4 {}, O5 {}",
        significant(found.condition, 3),
        significant(o.o1, 3),
        significant(o.o2, 3),
        significant(o.o3, 3),
        significant(o.o4, 3),
        significant(o.o5, 3)
    );
    parameters(&mut out, found);
    directions(&mut out, "Invisible to these measurements", &found.invisible);
    directions(&mut out, "Known from priors or equations alone", &found.prior_only);
    directions(&mut out, "Known worst", &found.weak);
    if !found.clusters.is_empty() {
        out.push_str("\nHard to tell apart (correlations beyond 0.9)\n");
        for (names, strongest) in &found.clusters {
            let shown = names.iter().take(MOST_NAMES).cloned().collect::<Vec<_>>().join(", ");
            let more = names.len().saturating_sub(MOST_NAMES);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let _ = writeln!(out, "  {shown}{more} (up to {})", rounded(*strongest, 3));
        }
    }
    let near = found.collinearity.dependencies();
    if !near.is_empty() {
        let _ = writeln!(out, "\nNearly dependent columns (condition indices beyond {CONDITION_INDEX})");
    }
    for dependency in near {
        let _ = writeln!(out, "  {}", dependency.sentence());
    }
    cures(&mut out, &found.cures);
    if found.asked {
        let of = if found.invisible.is_empty() { "what is known worst" } else { "what is invisible" };
        let _ = match &found.next {
            Some(next) => writeln!(out, "\nWhat to measure next for {of}\n  {}", candidate(next)),
            None => writeln!(out, "\nNo row of the scenario sees {of}"),
        };
    }
    out
}

fn candidate(next: &Candidate) -> String {
    let inputs = next.inputs.iter().map(|(name, value, symbol)| match unit(symbol) {
        "" => format!("{name} = {value}"),
        symbol => format!("{name} = {value} {symbol}"),
    });
    let inputs = inputs.collect::<Vec<_>>().join(", ");
    format!("{} at {inputs} tells most, of {} rows", next.measurement, next.among)
}

fn parameters(out: &mut String, found: &Practice) {
    if found.parameters.is_empty() {
        return;
    }
    out.push_str(match found.weights.are_real() {
        true => "\nParameters, predicted standard uncertainty against tolerance\n",
        false => "\nParameters (weights are unit, so nothing tells how large errors are)\n",
    });
    let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Right, Align::Left, Align::Left]);
    for known in &found.parameters {
        let sigma = known.sigma.map_or(String::new(), |sigma| format!("± {}", significant(sigma, 2)));
        let squared = known.collinearity.map_or(String::new(), |r| format!("R² {}", rounded(r, 4)));
        let tolerance = format!("of {}", significant(known.tolerance, 2));
        grid.row([known.name.as_str(), &sigma, &tolerance, unit(&known.unit), &squared, note(known)]);
    }
    out.push_str(&grid.text("  "));
}

fn note(known: &Known) -> &'static str {
    match known.sigma {
        _ if !known.estimable => "not estimable",
        Some(sigma) if sigma > known.tolerance => "weaker than its tolerance",
        _ => "",
    }
}

fn direction_json(found: &Direction) -> Value {
    let combination: Map<String, Value> =
        found.terms.iter().map(|term| (term.name.clone(), json!(term.weight))).collect();
    let walk = found.walk.as_ref();
    json!({
        "combination": combination,
        "sentence": found.sentence,
        "family": walk.map(|walk| walk.family),
        "walked": walk.map(|walk| json!({"tolerances": walk.length, "residual": walk.residual, "straight": walk.straight})),
        "seen": found.seen,
        "sigma_in_tolerances": found.sigma,
    })
}

fn all_json(all: &[Direction]) -> Value {
    all.iter().map(direction_json).collect()
}

fn cures_json(parts: &[Vec<Cure>]) -> Value {
    let then = |cure: &Cure| -> Value {
        cure.then.iter().map(|(name, sigma, unit)| json!({"name": name, "sigma": sigma, "unit": unit})).collect()
    };
    let one = |cure: &Cure| json!({"fix": cure.fix, "conditioning": cure.conditioning, "then": then(cure), "sentence": cure.sentence()});
    parts.iter().map(|choices| choices.iter().map(one).collect::<Value>()).collect()
}

fn collinearity_json(found: &Collinearity) -> Value {
    let named = |all: &[(String, f64)]| -> Map<String, Value> {
        all.iter().map(|(name, proportion)| (name.clone(), json!(proportion))).collect()
    };
    let dependency = |found: &Dependency| json!({"condition_index": found.index, "proportions": named(&found.members), "sentence": found.sentence()});
    json!({
        "parameters": found.names,
        "condition_indices": found.indices,
        "proportions": found.proportions,
        "dependencies": found.dependencies().iter().map(dependency).collect::<Vec<_>>(),
    })
}

/// What any data of a kind can see, as JSON.
pub fn structure_json(found: &Structure, inputs: &str) -> Value {
    let parameters = found.free.iter().zip(&found.estimable);
    let parameters: Vec<Value> =
        parameters.map(|(name, estimable)| json!({"name": name, "sigma": null, "estimable": estimable})).collect();
    json!({
        "kind": "structural",
        "inputs": inputs,
        "rank": found.rank,
        "free": found.free.len(),
        "nominal_rank": found.nominal_rank,
        "points": found.points,
        "skipped": found.skipped,
        "parameters": parameters,
        "null_directions": all_json(&found.invisible),
        "at_nominal": found.told_at_nominal,
        "stationary": all_json(&found.stationary),
        "weak": all_json(&found.weak),
        "singular_values": found.singular_values,
        "cures": cures_json(&found.cures),
    })
}

/// What some measurements would tell, as JSON.
pub fn practice_json(found: &Practice, inputs: &str) -> Value {
    let parameters: Vec<Value> = found
        .parameters
        .iter()
        .map(|known| {
            json!({
                "name": known.name, "unit": known.unit, "value": known.value, "sigma": known.sigma,
                "tolerance": known.tolerance, "estimable": known.estimable, "collinearity": known.collinearity,
            })
        })
        .collect();
    let o = &found.indices;
    let next = found.next.as_ref().map(|next| {
        let inputs: Map<String, Value> =
            next.inputs.iter().map(|(name, value, _)| (name.clone(), json!(value))).collect();
        json!({"measurement": next.measurement, "inputs": inputs, "information": next.information, "among": next.among})
    });
    let clusters = found.clusters.iter().map(|(names, strongest)| json!({"parameters": names, "strongest": strongest}));
    json!({
        "kind": "practical",
        "inputs": inputs,
        "weights": found.weights.name(),
        "rows": found.rows.iter().map(|(name, rows)| (name.clone(), json!(rows))).collect::<Map<_, _>>(),
        "left_out": found.left_out,
        "equations": found.equations,
        "priors": found.priors,
        "rank": found.rank,
        "free": found.parameters.len(),
        "parameters": parameters,
        "null_directions": all_json(&found.invisible),
        "prior_only": all_json(&found.prior_only),
        "weak": all_json(&found.weak),
        "condition": found.condition,
        "singular_values": found.singular_values,
        "indices": {"o1": o.o1, "o2": o.o2, "o3": o.o3, "o4": o.o4, "o5": o.o5},
        "clusters": clusters.collect::<Vec<_>>(),
        "collinearity": collinearity_json(&found.collinearity),
        "cures": cures_json(&found.cures),
        "next": next,
    })
}
