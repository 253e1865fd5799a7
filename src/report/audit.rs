//! Audits as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::count;
use super::matrix::tenths;
use super::number::significant;
use crate::audit::CheckedFormula;

/// Formulas that are listed one by one.
const SHOWN: usize = 12;

/// What became of hand-derived formulas.
pub fn formulas_text(all: &[CheckedFormula]) -> String {
    let mut out = String::new();
    let wrong: Vec<&CheckedFormula> = all.iter().filter(|one| !one.agrees).collect();
    let least = all.iter().filter(|one| one.agrees).map(|one| one.digits).fold(f64::INFINITY, f64::min);
    let _ = match (wrong.len(), all.len()) {
        (0, n) => writeln!(
            out,
            "{} written by hand agree to {} digits or more",
            count(n, "derivative", "derivatives"),
            tenths(least)
        ),
        (k, n) => writeln!(out, "{k} of {} written by hand are wrong", count(n, "derivative", "derivatives")),
    };
    for one in wrong.iter().take(SHOWN) {
        let _ = writeln!(out, "\n  {}", entry(one));
        if let Some((given, exact)) = one.worst {
            let _ =
                writeln!(out, "    {} = {given:e}, and it is {exact:e}: {} digits", one.component, tenths(one.digits));
        }
        if one.points == 0 {
            let _ = writeln!(out, "    no point was found at which it can be compared");
        }
        if let Some(cause) = &one.cause {
            let _ = writeln!(out, "    {}", cause.sentence());
        }
        if let Some(repair) = &one.repair {
            let _ = writeln!(out, "    {}", repair.sentence());
        }
        if let Some(found) = &one.counter_example {
            let at: Vec<String> =
                found.at.iter().map(|(name, value)| format!("{name} = {}", significant(*value, 6))).collect();
            let at = if at.is_empty() { "the nominal values".to_owned() } else { at.join(", ") };
            let _ = writeln!(
                out,
                "    wrong already at {at}: {} instead of {}",
                significant(found.given, 6),
                significant(found.exact, 6)
            );
        }
    }
    if wrong.len() > SHOWN {
        let _ = writeln!(out, "\n  and {} more", wrong.len() - SHOWN);
    }
    out
}

fn entry(one: &CheckedFormula) -> String {
    match &one.by {
        Some(by) => format!("{}: derivative of {} by {by}", one.measurement, one.of),
        None => format!("{}: another form of {}", one.measurement, one.of),
    }
}

/// Every formula.
pub fn formulas_json(all: &[CheckedFormula]) -> Value {
    let one = |one: &CheckedFormula| {
        let repair = one.repair.as_ref().map(|found| {
            json!({"instead_of": found.instead_of, "write": found.write, "function": found.within,
                "from": found.span.start, "to": found.span.end, "sentence": found.sentence()})
        });
        let example = one.counter_example.as_ref().map(|found| {
            let at: serde_json::Map<String, Value> =
                found.at.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
            json!({"at": at, "component": found.component, "given": found.given, "exact": found.exact})
        });
        json!({
            "measurement": one.measurement, "of": one.of, "component": one.component, "by": one.by,
            "agrees": one.agrees, "digits": one.digits, "points": one.points,
            "given": one.worst.map(|(given, _)| given), "exact": one.worst.map(|(_, exact)| exact),
            "cause": one.cause.as_ref().map(|cause| cause.sentence()), "repair": repair, "counter_example": example,
            "formula": one.text,
        })
    };
    all.iter().map(one).collect()
}
