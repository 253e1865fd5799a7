//! What files of all languages have in common: the heading, and which helpers are needed.

use super::line::Line;
use super::names::{Case, Names};
use super::routine::{Array, Kind, ROWS, Routine};
use crate::graph::{Node, OPERATIONS, Operation};

/// A small function beside the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Helper {
    /// a b + c
    MultiplyAdd,
    /// an operation that the language does not have
    Operation(Operation),
}

/// All that goes into a file.
pub(super) struct File<'a> {
    /// The model's name and file.
    pub(super) model: &'a str,
    pub(super) source: &'a str,
    pub(super) routines: &'a [Routine],
}

/// What an array of results is called.
pub(super) fn array_name(array: Array) -> &'static str {
    match array {
        Array::R => "r",
        Array::ByParameters => "dr_dq",
        Array::ByMembers => "dr_dm",
        Array::ByInputs => "dr_dx",
    }
}

/// What a function does.
pub(super) fn doc(kind: Kind) -> String {
    match kind {
        Kind::Residuals => "The residuals of a row.".to_owned(),
        Kind::Jacobian => "The residuals of a row and their derivatives by what is estimated.".to_owned(),
        Kind::JacobianRows => {
            format!("The same of {ROWS} rows at a time, row by row in the last index: faster, for it becomes vectors.")
        }
        Kind::Derivatives => "The residuals of a row and all their derivatives.".to_owned(),
    }
}

/// Where an output goes, in languages whose indices stand in brackets.
pub(super) fn entry(routine: &Routine, output: usize, rows: bool) -> String {
    let Some((array, i, j)) = routine.place(output) else { return String::new() };
    let column = if array == Array::R { String::new() } else { format!("[{j}]") };
    format!("{}[{i}]{column}{}", array_name(array), if rows { "[k]" } else { "" })
}

/// Whether a line reads an argument: q in what is prepared, p, x or m in rows.
pub(super) fn reads(routine: &Routine, line: &Line, array: &str) -> bool {
    let mut found = false;
    line.reads(|id| {
        found |= match routine.graph.node(id) {
            Node::Input(index) => array == if (index as usize) < routine.inputs.len() { "x" } else { "m" },
            Node::Parameter(_) => array == "q" || array == "p",
            _ => array == "p",
        };
    });
    found
}

impl File<'_> {
    /// Names of the measurements.
    pub(super) fn names(&self, case: Case) -> Vec<String> {
        let mut names = Names::default();
        self.routines.iter().map(|routine| names.alone(&routine.measurement, case)).collect()
    }

    /// Helpers that any routine needs.
    pub(super) fn helpers(&self, fused: bool) -> Vec<Helper> {
        let of: Vec<Vec<Helper>> = self.routines.iter().map(|routine| self.helpers_of(routine, fused)).collect();
        all().filter(|helper| of.iter().any(|of| of.contains(helper))).collect()
    }

    /// Helpers that a routine needs. `fused` says whether sums of products are written by one.
    pub(super) fn helpers_of(&self, routine: &Routine, fused: bool) -> Vec<Helper> {
        let mut found = Vec::new();
        for line in routine.functions.iter().map(|function| &function.line).chain([&routine.prepare]) {
            line.calls(|operation| found.push(Helper::Operation(operation)));
            if fused && line.multiplies_and_adds() {
                found.push(Helper::MultiplyAdd);
            }
        }
        all().filter(|helper| found.contains(helper)).collect()
    }

    /// The heading, line by line. `check` says how the test vector is run.
    pub(super) fn header(&self, check: &str) -> Vec<String> {
        let mut lines = vec![
            format!("{}: residuals and their derivatives.", clean(self.model)),
            format!("Written by phical {} from {}; not to be edited.", env!("CARGO_PKG_VERSION"), clean(self.source)),
            format!("Test vectors: {check}"),
        ];
        for routine in self.routines {
            lines.push(String::new());
            lines.extend(of_routine(routine));
        }
        lines
    }
}

fn all() -> impl Iterator<Item = Helper> {
    std::iter::once(Helper::MultiplyAdd).chain(OPERATIONS.iter().map(|row| Helper::Operation(row.operation)))
}

/// Text for a comment: on one line, without what compilers take amiss there.
fn clean(text: &str) -> String {
    let kept = |c: char| {
        if c.is_control() || matches!(c, '\u{200e}'..='\u{202e}' | '\u{2066}'..='\u{2069}') { ' ' } else { c }
    };
    let words: String = text.chars().map(kept).collect();
    let line = words.split_whitespace().collect::<Vec<_>>().join(" ");
    // a backslash at the end would take in the next line, and so would its old spelling
    if line.ends_with('\\') || line.ends_with("??/") { line + " ." } else { line }
}

fn of_routine(routine: &Routine) -> Vec<String> {
    let mut lines = vec![format!("Measurement {}", clean(&routine.measurement)), "  what should vanish".to_owned()];
    lines.extend(routine.formulas.iter().map(|(name, text)| format!("    {} = {}", clean(name), clean(text))));
    let unit = |unit: &str| if unit == "1" { String::new() } else { format!(" [{}]", clean(unit)) };
    let mut list = |title: &str, array: &str, numbers: &[super::routine::Number]| {
        if !numbers.is_empty() {
            lines.push(format!("  {title}"));
        }
        let shown = |(k, number): (usize, &super::routine::Number)| {
            format!("    {array}[{k}] = {}{}", clean(&number.name), unit(&number.unit))
        };
        lines.extend(numbers.iter().enumerate().map(shown));
    };
    list("parameters", "q", &routine.parameters);
    list("inputs of a row", "x", &routine.inputs);
    list("members of families that the row names, their values as they are gathered", "m", &routine.members);
    list("residuals of a row", "r", &routine.residuals);
    lines.push("  derivatives, in the units of a residual by those of what it is differentiated by".to_owned());
    for (array, of, columns, all) in [
        (Array::ByParameters, "q", &routine.columns, routine.parameters.len()),
        (Array::ByMembers, "m", &routine.member_columns, routine.members.len()),
        (Array::ByInputs, "x", &Vec::new(), routine.inputs.len()),
    ] {
        let name = array_name(array);
        let width = routine.width(array);
        if width == 0 {
            continue;
        }
        if array == Array::ByInputs || width == all {
            lines.push(format!("    {name}[i][j] = dr[i]/d{of}[j]"));
        } else {
            let each: Vec<String> = columns.iter().enumerate().map(|(j, k)| format!("{j}: {of}[{k}]")).collect();
            lines.push(format!("    {name}[i][j] = dr[i]/d{of}[k], with j: {of}[k] = {}", each.join(", ")));
        }
    }
    let turned = routine.parameters.iter().chain(&routine.members).any(|number| number.name.ends_with(".rx"));
    if turned {
        lines.push("    .rx .ry .rz: a rotation vector; derivatives are by w of R exp(w) at w = 0".to_owned());
    }
    if !routine.held.is_empty() {
        lines.push("  held, and constants here".to_owned());
        let shown =
            |(name, value, symbol): &(String, f64, String)| format!("    {} = {value:?}{}", clean(name), unit(symbol));
        lines.extend(routine.held.iter().map(shown));
    }
    let (prepare, functions) = routine.operations();
    let each: Vec<String> = functions.iter().map(|(name, count)| format!("{name} {count}")).collect();
    lines.push(format!("  operations, a fused product and sum as one: prepare {prepare}, {}", each.join(", ")));
    lines
}
