//! The verdict on a matrix, entry by entry.

use super::layout::{Laid, lay};
use super::multiples::{Finding, Kind, Multiples, multiples};
use super::precision::{Precision, precision};
use super::quotients::{Errors, Quotient, quotient};
use super::read::Given;
use super::stack::Stack;
use crate::diag::Diagnostics;
use crate::problem::Problem;

/// What rounding allows, in units in the last place of the largest derivative of a kind: another program's products of frames lose
/// some hundreds.
const ROUNDING: f64 = 1e4;
/// Entries that are listed.
const WORST: usize = 12;
/// Digits that no comparison of doubles goes beyond.
const MOST_DIGITS: f64 = 16.0;

/// A matrix, compared.
#[derive(Clone, Debug)]
pub struct MatrixAudit {
    /// How many rows and columns it has.
    pub shape: (usize, usize),
    /// Whether every entry is the exact one, but for rounding, in the model's own conventions.
    pub agrees: bool,
    /// To how many digits of the largest of its kind, for the worst entry as it stands.
    pub digits: f64,
    /// The same once the findings are undone; of the entries that are not listed as wrong.
    pub digits_undone: f64,
    /// How the matrix lay in the file.
    pub notes: Vec<String>,
    /// What whole columns, residuals or blocks have in common.
    pub findings: Vec<Finding>,
    /// Whether it was written with few digits.
    pub precision: Option<Precision>,
    /// Whether small errors follow a difference quotient.
    pub quotient: Option<Quotient>,
    /// How many entries are off that none of this explains.
    pub wrong: usize,
    /// The worst of these.
    pub worst: Vec<Entry>,
    /// For each column the digits of its worst entry as it stands.
    pub by_column: Vec<(String, f64)>,
    /// For each residual the same.
    pub by_residual: Vec<(String, f64)>,
    pub(super) laid: Laid,
    pub(super) multiples: Multiples,
    /// what is left of each entry once the findings are undone, zero where that is rounding
    pub(super) left: Vec<Vec<f64>>,
}

/// An entry that is off.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The measurement.
    pub measurement: String,
    /// The row of data, from one.
    pub row: usize,
    /// The residual.
    pub residual: String,
    /// The parameter or input.
    pub by: String,
    /// As given.
    pub given: f64,
    /// As it is.
    pub exact: f64,
    /// Digits of the largest of its kind.
    pub digits: f64,
}

/// Compares a matrix with the exact one of a problem at a point.
///
/// # Errors
/// Where its columns or its shape do not fit.
pub fn audit_matrix(
    file: &str,
    given: &Given,
    problem: &Problem,
    point: &[f64],
    exact: &Stack,
) -> Result<MatrixAudit, Diagnostics> {
    let laid = lay(file, given, exact)?;
    let audit = compare(given, &laid, problem, point, exact, false);
    let unexplained = audit.wrong > 0 && audit.precision.is_none() && audit.quotient.is_none();
    Ok(if unexplained { compare(given, &laid, problem, point, exact, true) } else { audit })
}

/// The verdict on entries that are in order.
fn compare(given: &Given, laid: &Laid, problem: &Problem, point: &[f64], exact: &Stack, near_one: bool) -> MatrixAudit {
    let scales = exact.scales();
    let (multiples, findings) = multiples(laid, exact, &scales, near_one);
    let (rows, width) = (laid.entries.len(), laid.columns.len());
    let residual = |i: usize| exact.equations[i].residual;
    // the size of a kind in the exact matrix, and as the findings make it
    let scale = |i: usize, k: usize| scales[residual(i)][laid.columns[k]];
    let made = |i: usize, k: usize| {
        let factor = multiples.factor[residual(i)][k];
        factor.abs() * scales[multiples.residual[residual(i)]][multiples.column[k]]
    };
    let rounding = |i: usize, k: usize| ROUNDING * f64::EPSILON * made(i, k);
    let left: Vec<Vec<f64>> =
        (0..rows).map(|i| (0..width).map(|k| laid.entries[i][k] - multiples.entry(exact, i, k)).collect()).collect();
    let off = |i: usize, k: usize| left[i][k].abs() > rounding(i, k);
    let all = || (0..rows).flat_map(|i| (0..width).map(move |k| (i, k)));

    let mut explained = vec![vec![0.0; width]; rows];
    let (mut written, mut rule) = (None, None);
    if all().any(|(i, k)| off(i, k)) {
        let numbers: Vec<f64> = laid.entries.iter().flatten().copied().collect();
        let loses = |precision: &Precision| {
            let (mut right, mut count) = (0, 0);
            for (i, k) in all().filter(|&(i, k)| off(i, k)) {
                count += 1;
                right += usize::from(left[i][k].abs() <= rounding(i, k) + precision.error(laid.entries[i][k]));
            }
            // some entries may be wrong beside
            2 * right >= count
        };
        written = precision(&numbers).filter(loses);
        if let Some(precision) = written {
            all().for_each(|(i, k)| explained[i][k] = precision.error(laid.entries[i][k]));
        } else {
            let undone = |i: usize, k: usize| match multiples.factor[residual(i)][k] {
                0.0 => 0.0,
                factor => left[i][k] / factor,
            };
            let errors: Vec<Vec<f64>> = (0..rows).map(|i| (0..width).map(|k| undone(i, k)).collect()).collect();
            let allowed = |i: usize, k: usize| match multiples.factor[residual(i)][k] {
                0.0 => f64::INFINITY,
                factor => rounding(i, k) / factor.abs(),
            };
            let of = Errors { exact, columns: &multiples.column, errors: &errors, allowed: &allowed, scales: &scales };
            if let Some((found, allowed)) = quotient(problem, point, &of) {
                rule = Some(found);
                all().for_each(|(i, k)| explained[i][k] = allowed[i][k] * multiples.factor[residual(i)][k].abs());
            }
        }
    }
    let stands = |i: usize, k: usize| laid.entries[i][k] - exact.entries[i][laid.columns[k]];
    let digits_of = |i: usize, k: usize| digits(stands(i, k), scale(i, k));
    let is_wrong = |i: usize, k: usize| left[i][k].abs() > rounding(i, k) + explained[i][k];
    let mut wrong: Vec<(usize, usize)> = all().filter(|&(i, k)| is_wrong(i, k)).collect();
    let share = |&(i, k): &(usize, usize)| left[i][k].abs() / made(i, k).max(scale(i, k)).max(f64::MIN_POSITIVE);
    wrong.sort_by(|a, b| share(b).total_cmp(&share(a)));
    let entry = |&(i, k): &(usize, usize)| Entry {
        measurement: exact.measurements[exact.equations[i].measurement].clone(),
        row: exact.equations[i].row + 1,
        residual: exact.residuals[residual(i)].0.clone(),
        by: exact.columns[laid.columns[k]].0.clone(),
        given: laid.entries[i][k],
        exact: exact.entries[i][laid.columns[k]],
        digits: digits_of(i, k),
    };
    let least = |all: &mut dyn Iterator<Item = f64>| all.fold(MOST_DIGITS, f64::min);
    let undone = all().filter(|&(i, k)| !is_wrong(i, k)).map(|(i, k)| digits(left[i][k], made(i, k)));
    let straight = multiples.is_identity(&laid.columns);
    MatrixAudit {
        shape: (given.entries.len(), given.entries.first().map_or(0, Vec::len)),
        agrees: straight && !all().any(|(i, k)| off(i, k)),
        digits: least(&mut all().map(|(i, k)| digits_of(i, k))),
        digits_undone: least(&mut { undone }),
        notes: laid.notes.clone(),
        precision: written,
        quotient: rule,
        wrong: wrong.len(),
        worst: wrong.iter().take(WORST).map(entry).collect(),
        by_column: (0..width)
            .map(|k| (exact.columns[laid.columns[k]].0.clone(), least(&mut (0..rows).map(|i| digits_of(i, k)))))
            .collect(),
        by_residual: exact
            .residuals
            .iter()
            .enumerate()
            .map(|(r, (name, _))| {
                (name.clone(), least(&mut all().filter(|&(i, _)| residual(i) == r).map(|(i, k)| digits_of(i, k))))
            })
            .collect(),
        left: (0..rows).map(|i| (0..width).map(|k| if off(i, k) { left[i][k] } else { 0.0 }).collect()).collect(),
        findings: units_together(findings, exact, laid),
        laid: laid.clone(),
        multiples,
    }
}

/// To how many digits of a size two numbers agree that differ by so much.
fn digits(off: f64, size: f64) -> f64 {
    match off.abs() {
        0.0 => MOST_DIGITS,
        off if size > 0.0 => (size / off).log10().clamp(0.0, MOST_DIGITS),
        _ => 0.0,
    }
}

/// A finding of all columns of a unit, said of the unit.
fn units_together(findings: Vec<Finding>, exact: &Stack, laid: &Laid) -> Vec<Finding> {
    let unit = |name: &String| exact.columns.iter().find(|(known, _)| known == name).map(|(_, unit)| unit.clone());
    let together = |mut finding: Finding| {
        let units: Vec<Option<String>> = finding.columns.iter().map(unit).collect();
        let Some(Some(first)) = units.first() else { return finding };
        let alike = laid.columns.iter().filter(|&&column| exact.columns[column].1 == *first).count();
        let all = alike == units.len() && alike > 2 && units.iter().all(|unit| unit.as_ref() == Some(first));
        if all && matches!(finding.kind, Kind::Multiple(_)) {
            finding.unit = Some(first.clone());
        }
        finding
    };
    findings.into_iter().map(together).collect()
}
