//! Names for what is repeated in a formula that is too long to be set.

use std::collections::HashMap;

use crate::lang::{Expr, ExprKind, print};

/// What is shorter, written out, is not worth a name.
const SHORT: usize = 24;

/// A formula in which pieces have names, and what each name stands for, in terms of those before it.
#[derive(Clone, Debug)]
pub(super) struct Abbreviated {
    pub(super) formula: Expr,
    pub(super) pieces: Vec<(String, Expr)>,
}

/// Gives names to pieces until the formula and each of them are no longer than `most`, as far as that goes: first to what saves most by
/// being written once, then to the largest that fit. `name` makes names.
pub(super) fn abbreviated(formula: &Expr, most: usize, mut name: impl FnMut() -> String) -> Abbreviated {
    // the formula comes last, as the last of the pieces
    let mut pieces: Vec<(String, Expr)> = vec![(String::new(), formula.clone())];
    while let Some(long) = pieces.iter().position(|(_, piece)| print(piece).len() > most) {
        let Some(chosen) = worth(&pieces, long, most) else { break };
        let (text, name) = (print(&chosen), name());
        for (_, piece) in &mut pieces {
            *piece = replaced(piece, &text, &name);
        }
        // before the first that uses it
        let at = pieces.iter().position(|(_, piece)| uses(piece, &name)).unwrap_or(0);
        pieces.insert(at, (name, chosen));
    }
    let formula = pieces.pop().map_or_else(|| formula.clone(), |(_, formula)| formula);
    Abbreviated { formula, pieces }
}

/// The piece that should have a name, inside of one that is too long.
fn worth(pieces: &[(String, Expr)], long: usize, most: usize) -> Option<Expr> {
    let mut seen: HashMap<String, (usize, &Expr)> = HashMap::new();
    for (_, piece) in pieces {
        piece.visit(|part| {
            seen.entry(print(part)).or_insert((0, part)).0 += 1;
        });
    }
    let mut inside: Vec<String> = Vec::new();
    pieces.get(long)?.1.children().for_each(|child| child.visit(|part| inside.push(print(part))));
    inside.sort();
    inside.dedup();
    let saved = |text: &String| (seen.get(text).map_or(0, |(count, _)| count - 1)) * text.len();
    let fits = inside.iter().filter(|text| text.len() > SHORT);
    let repeated = fits.clone().filter(|text| saved(text) > 0).max_by_key(|text| saved(text));
    let largest = || fits.filter(|text| text.len() <= most).max_by_key(|text| text.len());
    let text = repeated.or_else(largest)?;
    seen.get(text).map(|(_, part)| (*part).clone())
}

/// With a name in the place of a piece, wherever it stands.
fn replaced(expr: &Expr, text: &str, name: &str) -> Expr {
    if print(expr) == text {
        return Expr { kind: ExprKind::Name(name.to_owned()), span: expr.span.clone() };
    }
    expr.with_children(expr.children().map(|child| replaced(child, text, name)).collect())
}

fn uses(expr: &Expr, name: &str) -> bool {
    let mut found = false;
    expr.visit(|part| found |= matches!(&part.kind, ExprKind::Name(known) if known == name));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::parse;

    #[test]
    fn pieces_put_back_are_the_formula() {
        let long = "sin(alpha + beta*gamma + delta)^2 / (1 + sin(alpha + beta*gamma + delta)) + cos(alpha + beta*gamma + delta)";
        let text = format!("({long}) * exp(-({long})) + sqrt(1 + ({long})^2 + epsilon*zeta*eta*theta*iota*kappa)");
        let formula = parse(&text).unwrap();
        for most in [30, 60, 200] {
            let mut count = 0;
            let found = abbreviated(&formula, most, || {
                count += 1;
                format!("w{count}")
            });
            assert!(!found.pieces.is_empty());
            let mut whole = found.formula.clone();
            for (name, piece) in found.pieces.iter().rev() {
                let text = name.clone();
                whole = put_back(&whole, &text, piece);
            }
            assert_eq!(print(&whole), print(&formula), "{most}");
            for (_, piece) in &found.pieces {
                assert!(print(piece).len() <= most.max(60), "{most}: {}", print(piece));
            }
        }
    }

    fn put_back(expr: &Expr, name: &str, piece: &Expr) -> Expr {
        match &expr.kind {
            ExprKind::Name(known) if known == name => piece.clone(),
            _ => expr.with_children(expr.children().map(|child| put_back(child, name, piece)).collect()),
        }
    }
}
