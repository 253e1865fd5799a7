//! Which number of a given matrix is which derivative.

#![deny(clippy::indexing_slicing, reason = "what a file says is only ever looked up")]

use std::collections::HashMap;

use super::read::Given;
use super::stack::{Equation, Stack};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics, nearest};

/// Ratios to the exact derivatives within this share of each other count for an order of rows.
const ALIKE: f64 = 0.01;
/// Numbers below this share of the largest say nothing of it.
const TELLING: f64 = 1e-6;

/// A matrix in the order of the exact one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Laid {
    /// the columns of the exact matrix that it has
    pub(super) columns: Vec<usize>,
    /// by the exact matrix's rows and these columns
    pub(super) entries: Vec<Vec<f64>>,
    /// how it lay, where that is worth a word
    pub(super) notes: Vec<String>,
}

/// Puts a matrix in the order of the exact one, by names where it has any, else by the order that fits best.
pub(super) fn lay(file: &str, given: &Given, exact: &Stack) -> Result<Laid, Diagnostics> {
    let mut notes = Vec::new();
    let columns = match &given.names {
        Some(names) => named(file, names, exact)?,
        None => Vec::new(),
    };
    let (m, width) = (exact.equations.len(), given.entries.first().map_or(0, Vec::len));
    let rows = given.entries.len();
    let fits = |count: usize| [exact.parameters, exact.columns.len()].contains(&count);
    let turned = given.names.is_none() && rows != m && width == m && fits(rows);
    let entries: Vec<Vec<f64>> = match turned {
        true => transposed(&given.entries),
        false => given.entries.clone(),
    };
    if turned {
        notes.push("it is transposed: its rows are the parameters".to_owned());
    }
    let width = entries.first().map_or(0, Vec::len);
    let columns = if given.names.is_some() { columns } else { (0..width).collect() };
    if entries.len() != m || given.names.is_none() && !fits(width) {
        return Err(wrong_shape(file, given, exact).into());
    }
    let orders = if turned { orders(exact, None)? } else { orders(exact, Some((file, given)))? };
    let best = orders.into_iter().map(|(words, order)| (agreement(&entries, &order, &columns, exact), words, order));
    // the first of those that fit best
    let best = best.reduce(|best, other| if other.0 > best.0 { other } else { best });
    let (_, words, order) = best.unwrap_or_default();
    notes.extend(words.map(str::to_owned));
    let square = given.names.is_none() && !turned && width == m && fits(m);
    if square {
        let across = transposed(&entries);
        let straight: Vec<usize> = (0..m).collect();
        if agreement(&across, &straight, &columns, exact) > 2 * agreement(&entries, &order, &columns, exact) {
            notes = vec!["it is transposed: its rows are the parameters".to_owned()];
            return Ok(Laid { columns, entries: across, notes });
        }
    }
    let parameters = exact.columns.iter().take(exact.parameters).enumerate();
    let left_out: Vec<&str> =
        parameters.filter(|(j, _)| !columns.contains(j)).map(|(_, (name, _))| name.as_str()).collect();
    if !left_out.is_empty() {
        notes.push(format!("it has no column for {}", left_out.join(", ")));
    }
    Ok(Laid { columns, entries: order.iter().filter_map(|&row| entries.get(row)).cloned().collect(), notes })
}

/// Columns as rows; rows that are shorter than the first have no numbers there.
fn transposed(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let width = rows.first().map_or(0, Vec::len);
    (0..width).map(|k| rows.iter().map(|row| row.get(k).copied().unwrap_or(f64::NAN)).collect()).collect()
}

/// The exact matrix's number of each named column.
fn named(file: &str, names: &[String], exact: &Stack) -> Result<Vec<usize>, Diagnostics> {
    let mut found = Diagnostics::new();
    let place = |name: &str| DataPlace { column: Some(name.to_owned()), ..DataPlace::file(file) };
    let mut seen: HashMap<&str, usize> = HashMap::new();
    let mut columns = Vec::new();
    for (k, name) in names.iter().enumerate() {
        if seen.insert(name, k).is_some() {
            let message = format!("the column `{name}` stands twice");
            found.push(Diagnostic::error(Code::ColumnTwice, message).at_data(place(name)));
        }
        match exact.columns.iter().position(|(known, _)| known == name) {
            Some(column) => columns.push(column),
            None => {
                let message = format!("`{name}` is neither a free parameter nor an input");
                let near = nearest(name, exact.columns.iter().map(|(known, _)| known.as_str()));
                let hint = near
                    .map_or("`--free` frees a parameter that is held".into(), |near| format!("did you mean `{near}`?"));
                found.push(Diagnostic::error(Code::ColumnUnknown, message).at_data(place(name)).hint(hint));
            }
        }
    }
    if found.has_errors() { Err(found) } else { Ok(columns) }
}

fn wrong_shape(file: &str, given: &Given, exact: &Stack) -> Diagnostic {
    let count = |n: usize, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
    let (rows, width) = (given.entries.len(), given.entries.first().map_or(0, Vec::len));
    let message = format!(
        "the matrix has {} and {}, and there are {} and {}",
        count(rows, "row"),
        count(width, "column"),
        count(exact.equations.len(), "equation"),
        count(exact.parameters, "free parameter")
    );
    let residuals = exact.residuals.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ");
    let hint = format!(
        "for each row of data one row for each of {residuals}; `--free` and `--fix` choose the columns, `--data` the rows, \
         and a heading of names allows for some columns only"
    );
    Diagnostic::error(Code::BadMatrix, message).at_data(DataPlace::file(file)).hint(hint)
}

/// An order of rows, and the words for it where it is not the expected one.
type Order = (Option<&'static str>, Vec<usize>);

/// The orders in which rows may stand: for each of the exact matrix's, the given one.
fn orders(exact: &Stack, given: Option<(&str, &Given)>) -> Result<Vec<Order>, Diagnostics> {
    let m = exact.equations.len();
    let labelled =
        given.filter(|(_, given)| given.labels.iter().all(|(row, residual)| row.is_some() && residual.is_some()));
    if let Some((file, given)) = labelled {
        return by_labels(file, given, exact).map(|order| vec![(None, order)]);
    }
    let mut orders = vec![(None, (0..m).collect::<Vec<usize>>())];
    if exact.residuals.len() > 1 && m > exact.residuals.len() {
        // where each equation stands if all rows of the first residual come first
        let mut sorted: Vec<(usize, &Equation)> = exact.equations.iter().enumerate().collect();
        sorted.sort_by_key(|(_, equation)| (equation.measurement, equation.residual, equation.row));
        let mut order: Vec<(usize, usize)> = sorted.into_iter().map(|(k, _)| k).zip(0..).collect();
        order.sort_unstable();
        let order = order.into_iter().map(|(_, stands)| stands).collect();
        orders.push((Some("it is ordered by residuals: all rows of data of the first come first"), order));
    }
    Ok(orders)
}

fn by_labels(file: &str, given: &Given, exact: &Stack) -> Result<Vec<usize>, Diagnostics> {
    let mut found = Diagnostics::new();
    let mut order = vec![None; exact.equations.len()];
    let place_of = |(k, equation): (usize, &Equation)| {
        let (name, _) = exact.residuals.get(equation.residual)?;
        Some(((equation.row, name.as_str()), k))
    };
    let known: HashMap<(usize, &str), usize> = exact.equations.iter().enumerate().filter_map(place_of).collect();
    for (at, (row, residual)) in given.labels.iter().enumerate() {
        let (Some(row), Some(residual)) = (row, residual) else { continue };
        match known.get(&(*row, residual.as_str())).and_then(|&k| order.get_mut(k)) {
            Some(free) if free.is_none() => *free = Some(at),
            taken => {
                let words = if taken.is_some() { "stands twice" } else { "is not among the equations" };
                let message = format!("the residual `{residual}` of row {} {words}", row + 1);
                let near = nearest(residual, exact.residuals.iter().map(|(name, _)| name.as_str()));
                let near = near.filter(|near| near != residual).map(|near| format!("did you mean `{near}`?"));
                let place = DataPlace { row: Some(at + 1), ..DataPlace::file(file) };
                found.push(Diagnostic::error(Code::BadMatrix, message).at_data(place).maybe_hint(near));
            }
        }
    }
    match order.into_iter().collect::<Option<Vec<usize>>>() {
        Some(order) if !found.has_errors() => Ok(order),
        _ => Err(found),
    }
}

/// How many entries are alike in size in an order of rows, but for one factor of each residual and column.
fn agreement(entries: &[Vec<f64>], order: &[usize], columns: &[usize], exact: &Stack) -> usize {
    let scales = exact.scales();
    // by residual and given column
    let mut ratios = vec![vec![Vec::new(); columns.len()]; exact.residuals.len()];
    for ((equation, exact), &row) in exact.equations.iter().zip(&exact.entries).zip(order) {
        let (of, given) = (equation.residual, entries.get(row));
        let (Some(scales), Some(ratios), Some(given)) = (scales.get(of), ratios.get_mut(of), given) else { continue };
        for ((given, &column), ratios) in given.iter().zip(columns).zip(ratios) {
            let (Some(size), Some(scale)) = (exact.get(column).map(|size| size.abs()), scales.get(column)) else {
                continue;
            };
            if size > TELLING * scale {
                ratios.push(given.abs() / size);
            }
        }
    }
    let alike = |block: &mut Vec<f64>| {
        block.sort_by(f64::total_cmp);
        let middle = block.get(block.len() / 2).copied().unwrap_or(0.0);
        block.iter().filter(|ratio| (*ratio - middle).abs() <= ALIKE * middle && middle > 0.0).count()
    };
    ratios.iter_mut().flatten().map(alike).sum()
}
