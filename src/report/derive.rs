//! Formulas as text, LaTeX and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::abbreviate::abbreviated;
use crate::derive::{Derivation, Statement};
use crate::lang::{Expr, ExprKind, print};
use crate::symbolic::{escaped, latex, terms};

/// Longer formulas are broken at the signs of their sum, in LaTeX.
const LINE: usize = 110;

/// Formulas that are longer as text have names for their pieces, in LaTeX: no line may be wider than TeX can count.
const LONGEST: usize = 400;

/// Formulas in the language of models, section by section.
pub fn derivation_text(all: &[Derivation]) -> String {
    let mut out = String::new();
    for found in all {
        let _ = writeln!(out, "{}", found.measurement);
        for section in found.sections.iter().filter(|section| !section.statements.is_empty()) {
            let _ = writeln!(out, "\n  {}", section.title);
            for statement in &section.statements {
                let _ = writeln!(out, "    {}", statement.text());
            }
        }
        out.push('\n');
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

/// A LaTeX document of its own.
pub fn derivation_latex(all: &[Derivation], title: &str) -> String {
    let mut out = String::from(concat!(
        "\\documentclass{article}\n",
        "\\usepackage{amsmath}\n",
        "\\usepackage[margin=15mm,landscape]{geometry}\n",
        "\\allowdisplaybreaks\n",
        "\\setcounter{MaxMatrixCols}{12}\n",
        "\\begin{document}\n",
    ));
    let _ = writeln!(out, "\\section*{{{}}}", escaped(title));
    let mut pieces = 0;
    for found in all {
        let _ = writeln!(out, "\\subsection*{{{}}}", escaped(&found.measurement));
        for section in found.sections.iter().filter(|section| !section.statements.is_empty()) {
            let _ = writeln!(out, "\\paragraph{{{}}}", escaped(&section.title));
            let lines: Vec<String> =
                section.statements.iter().map(|one| statement_latex(one, found, &mut pieces)).collect();
            let _ = writeln!(out, "\\begin{{align*}}\n{}\n\\end{{align*}}", lines.join(" \\\\\n"));
        }
    }
    out.push_str("\\end{document}\n");
    out
}

/// A statement, and after it what the names of its pieces stand for; `pieces` counts those.
fn statement_latex(statement: &Statement, found: &Derivation, pieces: &mut usize) -> String {
    let mut out = latex(&statement.name, &found.frames);
    let mut named = Vec::new();
    let lines = |form: &Expr| {
        let whole = latex(form, &found.frames);
        let parts = if whole.len() > LINE { terms(form, &found.frames) } else { vec![whole] };
        parts.join(" \\\\\n  &\\quad ")
    };
    for form in &statement.forms {
        let short = abbreviated(form, LONGEST, || {
            *pieces += 1;
            format!("w_{pieces}")
        });
        named.extend(short.pieces);
        let _ = write!(out, " &= {}", lines(&short.formula));
        if !std::ptr::eq(form, statement.forms.last().unwrap_or(form)) {
            out.push_str(" \\\\\n ");
        }
    }
    for (name, piece) in named.iter().rev() {
        let name = latex(&Expr { kind: ExprKind::Name(name.clone()), span: 0..0 }, &found.frames);
        let _ = write!(out, " \\\\\n {name} &= {}", lines(piece));
    }
    out
}

/// Every statement: name, forms and LaTeX.
pub fn derivation_json(all: &[Derivation]) -> Value {
    let statement = |found: &Derivation, statement: &Statement| {
        json!({
            "name": print(&statement.name),
            "forms": statement.forms.iter().map(print).collect::<Vec<_>>(),
            "latex": statement_latex(statement, found, &mut 0),
        })
    };
    let section = |found: &Derivation, section: &crate::derive::Section| {
        let statements: Vec<Value> = section.statements.iter().map(|one| statement(found, one)).collect();
        json!({"title": section.title, "statements": statements})
    };
    let one = |found: &Derivation| {
        let sections: Vec<Value> = found.sections.iter().map(|one| section(found, one)).collect();
        json!({"measurement": found.measurement, "sections": sections})
    };
    json!({"measurements": all.iter().map(one).collect::<Vec<_>>()})
}
