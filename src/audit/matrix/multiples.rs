//! What whole blocks of a matrix have in common: a sign, a unit, another column's numbers.
//!
//! The entries of residual i by column j are a block, Gᵢⱼ ≈ fᵢⱼ Eᵢⱼ for all rows of data. fᵢⱼ is the median of the ratios, so a row that
//! is wrong by itself does not hide what the others say. The factors are told as few as possible: f for everything, dᵢ for residuals,
//! cⱼ for columns, each the factor that most blocks have, and what then is left by block.

use std::collections::BTreeSet;

use super::super::cause::{Cause, named_factor};
use super::layout::Laid;
use super::stack::Stack;

/// Blocks whose entries are off by more than this share of themselves are no multiples.
const LIKE: f64 = 0.02;
/// So large a share of a block's entries has to follow the median.
const MOST: f64 = 0.6;
/// Entries below this share of the largest of their kind say nothing of a factor.
const TELLING: f64 = 1e-7;
/// A factor without a name has to be seen in so many entries, and as exactly as this.
const UNNAMED: (usize, f64) = (3, 1e-7);

/// What was found of a part of the matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Its kind.
    pub kind: Kind,
    /// The columns; none where all.
    pub columns: Vec<String>,
    /// The unit, where the columns are all of one.
    pub unit: Option<String>,
    /// The residuals; none where all.
    pub residuals: Vec<String>,
}

/// What a part of a matrix looks like.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A multiple of the exact one.
    Multiple(Cause),
    /// It holds the derivatives by another column, perhaps with the other sign.
    Column(String, f64),
    /// The columns stand in each other's place.
    Swapped,
    /// It holds the derivatives of another residual.
    Residual(String, f64),
    /// The residuals stand in each other's place.
    SwappedResiduals,
}

impl Finding {
    /// What it is, in words.
    pub fn sentence(&self) -> String {
        let list = |names: &[String], one: &str, many: &str| match names {
            [only] => format!("{one} `{only}`"),
            names => format!("{many} {}", names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")),
        };
        let columns = || match &self.unit {
            Some(unit) => format!("all columns of parameters in {unit}"),
            None => list(&self.columns, "the column", "the columns"),
        };
        let rows = || list(&self.residuals, "the rows of", "the rows of");
        let (subject, many) = match (self.columns.is_empty(), self.residuals.is_empty()) {
            (true, true) => ("the whole matrix".to_owned(), false),
            (false, true) => (columns(), self.columns.len() > 1),
            (true, false) => (rows(), true),
            (false, false) => (format!("{} by {}", rows(), list(&self.columns, "", "").trim()), true),
        };
        let sign = |factor: f64| if factor < 0.0 { " with the other sign" } else { "" };
        match &self.kind {
            Kind::Multiple(cause) => format!("{subject} {}", cause.predicate(many)),
            Kind::Column(other, factor) => format!("{subject} holds the derivatives by `{other}`{}", sign(*factor)),
            Kind::Swapped => format!("{subject} stand in each other's place"),
            Kind::Residual(other, factor) => format!("{subject} hold the derivatives of `{other}`{}", sign(*factor)),
            Kind::SwappedResiduals => format!("{subject} stand in each other's place"),
        }
    }
}

/// What makes a matrix of the exact one but for errors in single entries: of which residual and column each block is, and how many
/// times.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Multiples {
    /// by residual: the residual whose derivatives its rows hold
    pub(super) residual: Vec<usize>,
    /// by column of the given matrix: the exact column that it holds
    pub(super) column: Vec<usize>,
    /// by residual and column
    pub(super) factor: Vec<Vec<f64>>,
}

impl Multiples {
    /// What the matrix would be, had it no other error; `equation_of` finds another residual of the same row of data.
    pub(super) fn entry(&self, exact: &Stack, equation: usize, k: usize) -> f64 {
        let residual = exact.equations[equation].residual;
        // residuals of a row of data stand side by side, in declared order
        let other = (equation + self.residual[residual]).wrapping_sub(residual);
        let value = exact.entries.get(other).map_or(0.0, |row| row[self.column[k]]);
        self.factor[residual][k] * value
    }

    /// Whether nothing has to be undone.
    pub(super) fn is_identity(&self, columns: &[usize]) -> bool {
        let straight = self.residual.iter().enumerate().all(|(i, &of)| i == of) && self.column == columns;
        straight && self.factor.iter().flatten().all(|&f| f == 1.0)
    }
}

/// A block beside the exact one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Block {
    /// both are zero
    Silent,
    /// so many times
    Times(f64),
    /// nothing of that kind
    Off,
}

/// Looks for what blocks have in common. A factor near one that has no name may be an error of the other program's rule, such as
/// sin h/h of a difference quotient, and is one of its own only where `near_one` says so.
pub(super) fn multiples(laid: &Laid, exact: &Stack, scales: &[Vec<f64>], near_one: bool) -> (Multiples, Vec<Finding>) {
    let residuals = exact.residuals.len();
    let rows: Vec<Vec<usize>> = (0..residuals)
        .map(|i| (0..exact.equations.len()).filter(|&k| exact.equations[k].residual == i).collect())
        .collect();
    let blocks = Blocks { laid, exact, scales, rows, near_one };
    let width = laid.columns.len();
    let mut found = Multiples {
        residual: (0..residuals).collect(),
        column: laid.columns.clone(),
        factor: vec![vec![1.0; width]; residuals],
    };
    let mut findings = Vec::new();
    let seen: Vec<Vec<Block>> =
        (0..residuals).map(|i| (0..width).map(|k| blocks.times(&[i], |i| i, k, laid.columns[k])).collect()).collect();
    let known = |i: usize, k: usize| if let Block::Times(f) = seen[i][k] { Some(f) } else { None };

    let unit = |k: usize| exact.columns[laid.columns[k]].1.as_str();
    // a factor of the columns of some units and of no others is one of columns, however many they are
    let of_units = |i: usize, factor: f64| {
        let units = |same: bool| {
            let all = (0..width).filter(|&k| known(i, k).is_some_and(|f| same_factor(f, factor) == same));
            all.map(unit).collect::<BTreeSet<&str>>()
        };
        !units(false).is_empty() && units(true).is_disjoint(&units(false))
    };
    let of_residual = |i: usize| {
        let factor = common((0..width).filter_map(|k| known(i, k)));
        if of_units(i, factor) { 1.0 } else { factor }
    };
    let d: Vec<f64> = (0..residuals).map(of_residual).collect();
    let all = d[0];
    let same = all != 1.0
        && d.iter().enumerate().all(|(i, &f)| same_factor(f, all) || (0..width).all(|k| known(i, k).is_none()));
    if same {
        findings.push(finding(all, Vec::new(), Vec::new()));
    }
    let d: Vec<f64> = if same { vec![all; residuals] } else { d };
    let c: Vec<f64> = (0..width)
        .map(|k| {
            common((0..residuals).filter_map(|i| known(i, k).map(|f| if d[i] == 0.0 { 1.0 } else { tidy(f / d[i]) })))
        })
        .collect();
    let name = |k: usize| exact.columns[laid.columns[k]].0.clone();
    let residual = |i: usize| exact.residuals[i].0.clone();
    if !same {
        grouped(&d, residual, |factor, residuals| findings.push(finding(factor, Vec::new(), residuals)));
    }
    grouped(&c, name, |factor, columns| findings.push(finding(factor, columns, Vec::new())));
    for (i, &d) in d.iter().enumerate() {
        for (k, &c) in c.iter().enumerate() {
            let made = d * c;
            found.factor[i][k] = made;
            let Some(f) = known(i, k) else { continue };
            if !same_factor(f, made) {
                found.factor[i][k] = f;
                let own = if made == 0.0 { f } else { tidy(f / made) };
                findings.push(finding(own, vec![name(k)], vec![residual(i)]));
            } else if [d, c].iter().any(|&factor| named_factor(factor, 0.0).is_none()) {
                // a factor without a name is known from the block's own entries best
                found.factor[i][k] = f;
            }
        }
    }
    blocks.columns_elsewhere(&seen, &mut found, &mut findings);
    blocks.residuals_elsewhere(&seen, &mut found, &mut findings);
    (found, findings)
}

fn finding(factor: f64, columns: Vec<String>, residuals: Vec<String>) -> Finding {
    Finding { kind: Kind::Multiple(Cause::of_factor(factor)), columns, unit: None, residuals }
}

/// Calls with each factor but one, and who has it.
fn grouped(factors: &[f64], name: impl Fn(usize) -> String, mut each: impl FnMut(f64, Vec<String>)) {
    let mut told: Vec<f64> = vec![1.0];
    for &factor in factors {
        if !told.iter().any(|&other| same_factor(factor, other)) {
            told.push(factor);
            each(factor, (0..factors.len()).filter(|&k| same_factor(factors[k], factor)).map(&name).collect());
        }
    }
}

/// The factor that most have, one where there is no such; where two are as frequent, one.
fn common(all: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = all.collect();
    let count = |f: f64| all.iter().filter(|&&other| same_factor(f, other)).count();
    let best = all.iter().copied().max_by_key(|&f| (count(f), f == 1.0)).unwrap_or(1.0);
    if 2 * count(best) >= all.len() { best } else { 1.0 }
}

/// A quotient of named factors, named again.
fn tidy(factor: f64) -> f64 {
    named_factor(factor, UNNAMED.1).unwrap_or(factor)
}

/// Whether two factors are the same one.
fn same_factor(a: f64, b: f64) -> bool {
    (a - b).abs() <= UNNAMED.1 * a.abs().max(b.abs())
}

struct Blocks<'a> {
    laid: &'a Laid,
    exact: &'a Stack,
    scales: &'a [Vec<f64>],
    /// of each residual
    rows: Vec<Vec<usize>>,
    near_one: bool,
}

impl Blocks<'_> {
    /// Column k of some residuals beside an exact column, of the residuals that `of` says.
    fn times(&self, residuals: &[usize], of: impl Fn(usize) -> usize, k: usize, column: usize) -> Block {
        let mut pairs = Vec::new();
        let (mut most, mut loud) = (0.0_f64, false);
        for &i in residuals {
            let scale = self.scales[of(i)][column].max(self.scales[i][self.laid.columns[k]]);
            for &row in &self.rows[i] {
                let Some(exact) = self.exact.entries.get((row + of(i)).wrapping_sub(i)) else { continue };
                let (given, exact) = (self.laid.entries[row][k], exact[column]);
                loud |= given.abs() > TELLING * scale;
                if exact.abs() > TELLING * scale {
                    pairs.push((given, exact));
                    most = most.max(exact.abs());
                }
            }
        }
        if pairs.is_empty() {
            return if loud { Block::Off } else { Block::Silent };
        }
        let mut ratios: Vec<f64> = pairs.iter().map(|(given, exact)| given / exact).collect();
        ratios.sort_by(f64::total_cmp);
        let middle = ratios[ratios.len() / 2];
        if middle == 0.0 {
            let zero = pairs.iter().filter(|(given, _)| *given == 0.0).count();
            return if zero as f64 >= MOST * pairs.len() as f64 { Block::Times(0.0) } else { Block::Off };
        }
        let mut misfits: Vec<f64> = ratios.iter().map(|ratio| (ratio / middle - 1.0).abs()).collect();
        misfits.sort_by(f64::total_cmp);
        let misfit = misfits[((misfits.len() as f64 * MOST) as usize).min(misfits.len() - 1)];
        if misfit > LIKE {
            return Block::Off;
        }
        match named_factor(middle, 3.0 * misfit + 1e-9) {
            Some(named) => Block::Times(named),
            // near one it is an error, else a factor of which nobody knows why, if it is seen often and well
            None if (middle - 1.0).abs() < LIKE && !(self.near_one && misfit < UNNAMED.1) => Block::Times(1.0),
            None if pairs.len() >= UNNAMED.0 && misfit < UNNAMED.1 => Block::Times(middle),
            None => Block::Off,
        }
    }

    /// Columns that hold the derivatives by another parameter.
    fn columns_elsewhere(&self, seen: &[Vec<Block>], found: &mut Multiples, findings: &mut Vec<Finding>) {
        let width = self.laid.columns.len();
        let residuals: Vec<usize> = (0..seen.len()).collect();
        let lost: Vec<usize> = (0..width).filter(|&k| seen.iter().any(|row| row[k] == Block::Off)).collect();
        let name = |column: usize| self.exact.columns[column].0.clone();
        let mut elsewhere: Vec<(usize, usize, f64)> = Vec::new();
        for &k in &lost {
            let others = (0..self.exact.parameters).filter(|&column| column != self.laid.columns[k]);
            let mut told = others.filter_map(|column| match self.times(&residuals, |i| i, k, column) {
                Block::Times(f) if f.abs() == 1.0 => Some((k, column, f)),
                _ => None,
            });
            elsewhere.extend(told.next());
        }
        let mut told = Vec::new();
        for &(k, column, factor) in &elsewhere {
            found.column[k] = column;
            (0..seen.len()).for_each(|i| found.factor[i][k] = factor);
            let own = self.laid.columns[k];
            let back = |other: &&(usize, usize, f64)| self.laid.columns[other.0] == column && other.1 == own;
            match elsewhere.iter().find(back) {
                Some(other) if factor == 1.0 && other.2 == 1.0 => {
                    if !told.contains(&own) {
                        told.extend([own, column]);
                        let columns = vec![name(own), name(column)];
                        findings.push(Finding { kind: Kind::Swapped, columns, unit: None, residuals: Vec::new() });
                    }
                }
                _ => findings.push(Finding {
                    kind: Kind::Column(name(column), factor),
                    columns: vec![name(own)],
                    unit: None,
                    residuals: Vec::new(),
                }),
            }
        }
    }

    /// Residuals whose rows hold the derivatives of another one.
    fn residuals_elsewhere(&self, seen: &[Vec<Block>], found: &mut Multiples, findings: &mut Vec<Finding>) {
        let width = self.laid.columns.len();
        let loud = |i: usize| seen[i].iter().filter(|&&block| block != Block::Silent).count();
        let off = |i: usize| {
            (0..width).filter(|&k| seen[i][k] == Block::Off && found.column[k] == self.laid.columns[k]).count()
        };
        let lost: Vec<usize> = (0..seen.len()).filter(|&i| 2 * off(i) > loud(i)).collect();
        let measurement = |i: usize| self.rows[i].first().map(|&row| self.exact.equations[row].measurement);
        let fits = |i: usize, of: usize, sign: f64| {
            let blocks: Vec<Block> = (0..width).map(|k| self.times(&[i], |_| of, k, self.laid.columns[k])).collect();
            let right = blocks.iter().filter(|&&block| block == Block::Times(sign)).count();
            right > 0 && blocks.iter().all(|&block| block == Block::Silent || block == Block::Times(sign))
        };
        let mut elsewhere: Vec<(usize, usize, f64)> = Vec::new();
        for &i in &lost {
            let others = (0..seen.len()).filter(|&of| of != i && measurement(of) == measurement(i));
            let mut told =
                others.flat_map(|of| [(i, of, 1.0), (i, of, -1.0)]).filter(|&(i, of, sign)| fits(i, of, sign));
            elsewhere.extend(told.next());
        }
        let name = |i: usize| self.exact.residuals[i].0.clone();
        let mut told = Vec::new();
        for &(i, of, factor) in &elsewhere {
            found.residual[i] = of;
            found.factor[i].iter_mut().for_each(|f| *f = factor);
            match elsewhere.iter().find(|other| other.0 == of && other.1 == i) {
                Some(other) if factor == 1.0 && other.2 == 1.0 => {
                    if !told.contains(&i) {
                        told.extend([i, of]);
                        let residuals = vec![name(i), name(of)];
                        findings.push(Finding {
                            kind: Kind::SwappedResiduals,
                            columns: Vec::new(),
                            unit: None,
                            residuals,
                        });
                    }
                }
                _ => findings.push(Finding {
                    kind: Kind::Residual(name(of), factor),
                    columns: Vec::new(),
                    unit: None,
                    residuals: vec![name(i)],
                }),
            }
        }
    }
}
