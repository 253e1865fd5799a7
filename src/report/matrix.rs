//! Audited matrices as text and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::count;
use super::number::significant;
use super::table::{Align, Grid};
use crate::audit::{Ended, MatrixAudit, Precision, Quotient, Refit, Rule, Steps};
use crate::session::Compared;

/// Parameters and residuals whose digits are listed.
const LISTED: usize = 8;

/// Digits are known no better than to tenths.
pub(super) fn tenths(digits: f64) -> String {
    format!("{digits:.1}")
}

/// What became of another program's matrices.
pub fn matrix_text(file: &str, all: &[Compared]) -> String {
    let mut out = String::new();
    for (k, one) in all.iter().enumerate() {
        if k > 0 {
            out.push('\n');
        }
        of_one(&mut out, file, one);
    }
    out
}

fn of_one(out: &mut String, file: &str, one: &Compared) {
    let audit = &one.audit;
    let shape = format!("{} by {}", count(audit.shape.0, "row", "rows"), count(audit.shape.1, "column", "columns"));
    let _ = match (audit.agrees, audit.wrong) {
        (true, _) => writeln!(out, "{file} at {}, {shape}: agrees to {} digits", one.point, tenths(audit.digits)),
        (false, 0) => writeln!(
            out,
            "{file} at {}, {shape}: agrees to {} digits once it is said that",
            one.point,
            tenths(audit.digits_undone)
        ),
        (false, wrong) => writeln!(
            out,
            "{file} at {}, {shape}: {} wrong",
            one.point,
            if wrong == 1 { "1 entry is".to_owned() } else { format!("{wrong} entries are") }
        ),
    };
    for note in &audit.notes {
        let _ = writeln!(out, "  {note}");
    }
    for finding in &audit.findings {
        let _ = writeln!(out, "  {}", finding.sentence());
    }
    if let Some(precision) = audit.precision {
        let _ = writeln!(out, "  {}", precision.sentence());
    }
    if let Some(quotient) = &audit.quotient {
        let _ = writeln!(out, "  {}: {} digits", quotient.sentence(), tenths(audit.digits_undone));
    }
    if audit.wrong > 0 {
        let mut grid = Grid::new(&[Align::Left, Align::Right, Align::Left, Align::Right, Align::Right, Align::Right]);
        grid.row(["residual", "row", "by", "given", "exact", "digits"].map(str::to_owned));
        for entry in &audit.worst {
            grid.row([
                entry.residual.clone(),
                entry.row.to_string(),
                entry.by.clone(),
                significant(entry.given, 9),
                significant(entry.exact, 9),
                tenths(entry.digits),
            ]);
        }
        let _ = writeln!(out, "\n  Worst entries");
        out.push_str(&grid.text("    "));
        let more = audit.wrong - audit.worst.len();
        if more > 0 {
            let _ = writeln!(out, "    and {more} more");
        }
    }
    if !audit.agrees {
        let mut worst = audit.by_column.clone();
        worst.sort_by(|a, b| a.1.total_cmp(&b.1));
        let list = |all: &[(String, f64)]| {
            let one = |(name, digits): &(String, f64)| format!("{name} {}", tenths(*digits));
            all.iter().take(LISTED).map(one).collect::<Vec<_>>().join(", ")
        };
        let _ = writeln!(out, "\n  Digits as it stands, the worst first");
        let _ = writeln!(out, "    by parameter: {}", list(&worst));
        let mut worst = audit.by_residual.clone();
        worst.sort_by(|a, b| a.1.total_cmp(&b.1));
        let _ = writeln!(out, "    by residual: {}", list(&worst));
    }
    if let Some(refit) = &one.refit {
        refit_text(out, refit);
    }
}

fn refit_text(out: &mut String, refit: &Refit) {
    let _ = writeln!(out, "\n  With this Jacobian {}", refit.sentence());
    let _ = writeln!(
        out,
        "    its first step turns by {} degrees and is {} times as long",
        significant(refit.angle.to_degrees(), 3),
        significant(refit.length, 4)
    );
    let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Right, Align::Right, Align::Right]);
    grid.row(["", "ended by", "steps", "cost", "gradient"].map(str::to_owned));
    for (name, end) in [("exact", &refit.exact), ("audited", &refit.audited)] {
        grid.row([
            name.to_owned(),
            end.status.name().to_owned(),
            end.iterations.to_string(),
            significant(end.cost, 9),
            format!("{:.1e}", end.gradient),
        ]);
    }
    out.push_str(&grid.text("    "));
}

/// Every matrix.
pub fn matrix_json(file: &str, all: &[Compared]) -> Value {
    let one = |one: &Compared| {
        let audit = &one.audit;
        json!({
            "point": one.point, "rows": audit.shape.0, "columns": audit.shape.1, "agrees": audit.agrees,
            "digits": audit.digits, "digits_undone": audit.digits_undone, "notes": audit.notes,
            "findings": findings(audit), "precision": audit.precision.map(precision),
            "differences": audit.quotient.as_ref().map(quotient), "wrong": audit.wrong,
            "worst": audit.worst.iter().map(|entry| json!({
                "measurement": entry.measurement, "row": entry.row, "residual": entry.residual, "by": entry.by,
                "given": entry.given, "exact": entry.exact, "digits": entry.digits,
            })).collect::<Vec<_>>(),
            "by_parameter": digits(&audit.by_column), "by_residual": digits(&audit.by_residual),
            "refit": one.refit.as_ref().map(refit_json),
        })
    };
    json!({"against": file, "agrees": all.iter().all(|one| one.audit.agrees), "audits": all.iter().map(one).collect::<Vec<_>>()})
}

fn digits(all: &[(String, f64)]) -> Value {
    all.iter().map(|(name, digits)| (name.clone(), json!(digits))).collect::<serde_json::Map<String, Value>>().into()
}

fn findings(audit: &MatrixAudit) -> Vec<Value> {
    use crate::audit::{Cause, Kind};
    let one = |finding: &crate::audit::Finding| {
        let (kind, factor, other) = match &finding.kind {
            Kind::Multiple(Cause::Negative) => ("negative", Some(-1.0), None),
            Kind::Multiple(Cause::Zero) => ("zero", Some(0.0), None),
            Kind::Multiple(Cause::Factor(factor)) => ("factor", Some(*factor), None),
            Kind::Multiple(Cause::Scale(factor, _)) => ("scale", Some(*factor), None),
            Kind::Multiple(Cause::Undefined) => ("undefined", None, None),
            Kind::Column(other, factor) => ("column_of", Some(*factor), Some(other)),
            Kind::Swapped => ("swapped_columns", None, None),
            Kind::Residual(other, factor) => ("residual_of", Some(*factor), Some(other)),
            Kind::SwappedResiduals => ("swapped_residuals", None, None),
        };
        json!({"kind": kind, "columns": finding.columns, "residuals": finding.residuals, "factor": factor, "of": other,
            "sentence": finding.sentence()})
    };
    audit.findings.iter().map(one).collect()
}

fn precision(found: Precision) -> Value {
    let (kind, digits) = match found {
        Precision::Digits(digits) => ("significant_digits", Some(digits)),
        Precision::Decimals(places) => ("decimals", Some(places)),
        Precision::Single => ("single", None),
    };
    json!({"kind": kind, "digits": digits, "sentence": found.sentence()})
}

fn quotient(found: &Quotient) -> Value {
    let rule = match found.rule {
        Rule::Forward => "forward",
        Rule::Backward => "backward",
        Rule::Central => "central",
        Rule::Rounding => "rounding",
    };
    let (kind, step) = match &found.steps {
        Steps::Same(h) => ("same", json!(h)),
        Steps::ByUnit(all) => (
            "by_unit",
            all.iter().map(|(unit, h)| (unit.clone(), json!(h))).collect::<serde_json::Map<String, Value>>().into(),
        ),
        Steps::Relative(share) => ("relative", json!(share)),
        Steps::About(h) => ("about", json!(h)),
    };
    json!({"rule": rule, "steps": kind, "step": step, "sentence": found.sentence()})
}

fn refit_json(refit: &Refit) -> Value {
    let ended = |end: &Ended| {
        json!({"status": end.status.name(), "converged": end.status.converged(), "iterations": end.iterations, "cost": end.cost,
            "gradient": end.gradient})
    };
    json!({
        "exact": ended(&refit.exact), "audited": ended(&refit.audited), "angle": refit.angle, "length": refit.length,
        "same": refit.same(), "farthest": refit.farthest.as_ref().map(|(name, far)| json!({"name": name, "tolerances": far})),
        "sentence": refit.sentence(),
    })
}
