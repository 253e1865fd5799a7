//! Errors that follow the rule of a difference quotient.
//!
//! With a step h, (r(q+h) − r(q))/h is off by h/2 r″, (r(q+h) − r(q−h))/2h by h²/6 r‴, and either by the rounding of r over h
//! (Nocedal & Wright 2006, *Numerical Optimization*, section 8.1). r″ and r‴ come from exact derivatives beside the point, and h
//! from the regression of the errors on them, column by column.

use super::stack::{Stack, shifted};
use crate::linalg::dot;
use crate::problem::Problem;

/// A column whose errors follow a rule leaves no more than this share of their squares.
const LEFT: f64 = 0.1;
/// Such a share of the columns with errors has to follow it.
const FOLLOW: f64 = 0.3;
/// Steps that differ by less than this share are the same.
const SAME: f64 = 0.1;
/// Second derivatives are looked at so far beside the point, as a share of the largest parameter of a unit.
const BESIDE: f64 = 1e-3;
/// Errors beyond this share of the largest derivative of their kind are those of something else.
const SMALL: f64 = 0.05;
/// The next term of an error, as a share of the largest of a column.
const NEXT: f64 = 1e-3;
/// Rounding of a residual in a quotient, at most and as a rule, in units in the last place of what it is made of.
const ROUNDING: (f64, f64) = (100.0, 0.1);

/// A rule of differences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// (r(q+h) − r(q))/h
    Forward,
    /// (r(q) − r(q−h))/h
    Backward,
    /// (r(q+h) − r(q−h))/2h
    Central,
    /// Of whatever rule: nothing but rounding is seen.
    Rounding,
}

/// The step of a quotient.
#[derive(Clone, Debug, PartialEq)]
pub enum Steps {
    /// The same number for each parameter in its unit.
    Same(f64),
    /// One for each unit.
    ByUnit(Vec<(String, f64)>),
    /// A share of each parameter's value.
    Relative(f64),
    /// About that much.
    About(f64),
}

/// What a difference quotient looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Quotient {
    /// Its rule.
    pub rule: Rule,
    /// Its step.
    pub steps: Steps,
}

impl Quotient {
    /// What it looks like, in words.
    pub fn sentence(&self) -> String {
        let rule = match self.rule {
            Rule::Forward => "forward differences",
            Rule::Backward => "backward differences",
            Rule::Central => "central differences",
            Rule::Rounding => "differences, of which rounding is all that is seen,",
        };
        let steps = match &self.steps {
            Steps::Same(h) => format!("with a step of {h:.1e}"),
            Steps::ByUnit(all) => {
                let one = |(unit, h): &(String, f64)| format!("{h:.1e} {unit}").trim_end().to_owned();
                format!("with a step of {}", all.iter().map(one).collect::<Vec<_>>().join(" or "))
            }
            Steps::Relative(share) => format!("with a step of {share:.1e} of each value"),
            Steps::About(h) => format!("with a step of about {h:.0e}"),
        };
        format!("this looks like {rule} {steps}")
    }
}

/// Errors of a matrix from which conventions were taken: by equation and column.
pub(super) struct Errors<'a> {
    pub(super) exact: &'a Stack,
    /// the exact column that each of the given ones holds
    pub(super) columns: &'a [usize],
    pub(super) errors: &'a [Vec<f64>],
    pub(super) allowed: &'a dyn Fn(usize, usize) -> f64,
    pub(super) scales: &'a [Vec<f64>],
}

/// What one column says of a rule.
struct Regression {
    k: usize,
    /// the step, of either sign, and the share of the squares that is left
    first: (f64, f64),
    second: (f64, f64),
    f2: Vec<f64>,
    f3: Vec<f64>,
}

/// Looks for a rule that the errors follow; with it, how large each error may be.
pub(super) fn quotient(problem: &Problem, point: &[f64], of: &Errors) -> Option<(Quotient, Vec<Vec<f64>>)> {
    let significant: Vec<usize> =
        (0..of.columns.len()).filter(|&k| of.columns[k] < of.exact.parameters && of.loud(k)).collect();
    if significant.is_empty() {
        return None;
    }
    let all: Vec<Regression> = significant.iter().filter_map(|&k| of.regression(problem, point, k)).collect();
    let follow = |left: &dyn Fn(&Regression) -> (f64, f64)| {
        all.iter().filter(|one| left(one).1 < LEFT).map(|one| (one.k, left(one).0)).collect::<Vec<(usize, f64)>>()
    };
    let (first, second) = (follow(&|one| one.first), follow(&|one| one.second));
    let enough = |steps: &[(usize, f64)]| !steps.is_empty() && steps.len() as f64 >= FOLLOW * significant.len() as f64;
    let central = second.len() > first.len();
    let steps = if central { second } else { first };
    let size = of.sizes();
    let noise = |i: usize, h: f64| ROUNDING.0 * f64::EPSILON * size[i] / h.abs();
    if enough(&steps) {
        let rule = match (central, steps.iter().filter(|(_, h)| *h > 0.0).count() * 2 >= steps.len()) {
            (true, _) => Rule::Central,
            (false, true) => Rule::Forward,
            (false, false) => Rule::Backward,
        };
        let steps: Vec<(usize, f64)> = steps.into_iter().map(|(k, h)| (k, h.abs())).collect();
        let quotient = Quotient { rule, steps: of.pattern(&steps) };
        let mut explained = vec![vec![0.0; of.columns.len()]; of.errors.len()];
        let middle = median(steps.iter().map(|(_, h)| *h).collect());
        for k in 0..of.columns.len() {
            let h = steps.iter().find(|(of, _)| *of == k).map_or(middle, |(_, h)| *h);
            let bent = |i: usize| {
                let one = all.iter().find(|one| one.k == k)?;
                let (first, second) = (h / 2.0 * one.f2[i], h * h / 6.0 * one.f3[i]);
                Some(if central { second.abs() } else { first.abs() + second.abs() })
            };
            let most = (0..of.errors.len()).filter_map(bent).fold(0.0, f64::max);
            for (i, row) in explained.iter_mut().enumerate() {
                // where a term vanishes the next one is left
                row[k] = 1.5 * bent(i).unwrap_or(0.0) + NEXT * most + noise(i, h);
            }
        }
        return Some((quotient, explained));
    }
    // errors everywhere that follow nothing: rounding over the step
    let guesses: Vec<f64> = (0..of.errors.len())
        .flat_map(|i| significant.iter().map(move |&k| (i, k)))
        .filter(|&(i, k)| of.errors[i][k].abs() > (of.allowed)(i, k))
        .map(|(i, k)| ROUNDING.1 * f64::EPSILON * size[i] / of.errors[i][k].abs())
        .collect();
    let h = 10_f64.powf(median(guesses).log10().round());
    let entries = of.errors.len() * of.columns.len();
    let off = (0..of.errors.len()).flat_map(|i| (0..of.columns.len()).map(move |k| (i, k)));
    let off = off.filter(|&(i, k)| of.errors[i][k].abs() > (of.allowed)(i, k)).count();
    let everywhere = off as f64 > FOLLOW * entries as f64;
    (everywhere && (1e-13..1e-5).contains(&h)).then(|| {
        let of_row = |i: usize| vec![noise(i, h); of.columns.len()];
        (Quotient { rule: Rule::Rounding, steps: Steps::About(h) }, (0..of.errors.len()).map(of_row).collect())
    })
}

impl Errors<'_> {
    fn scale(&self, i: usize, k: usize) -> f64 {
        self.scales[self.exact.equations[i].residual][self.columns[k]]
    }

    /// Whether a column has errors that are not rounding, and small ones.
    fn loud(&self, k: usize) -> bool {
        let error = |i: usize| self.errors[i][k].abs();
        (0..self.errors.len()).any(|i| error(i) > (self.allowed)(i, k) && error(i) < SMALL * self.scale(i, k))
    }

    fn regression(&self, problem: &Problem, point: &[f64], k: usize) -> Option<Regression> {
        let column = self.columns[k];
        let unit = &self.exact.columns[column].1;
        let alike = self.exact.q.iter().zip(&self.exact.columns).filter(|(_, (_, other))| other == unit);
        let size = alike.fold(0.0, |most: f64, (q, _)| most.max(q.abs()));
        let h = BESIDE * if size > 0.0 { size } else { 1.0 };
        let (above, below) = (shifted(problem, point, column, h)?, shifted(problem, point, column, -h)?);
        let of = |stack: &Stack, i: usize| stack.entries[i][column];
        let rows = 0..self.errors.len();
        let f2: Vec<f64> = rows.clone().map(|i| (of(&above, i) - of(&below, i)) / (2.0 * h)).collect();
        let bend = |i: usize| (of(&above, i) - 2.0 * of(self.exact, i) + of(&below, i)) / (h * h);
        let f3: Vec<f64> = rows.clone().map(bend).collect();
        let used: Vec<usize> = rows.filter(|&i| self.errors[i][k].abs() < SMALL * self.scale(i, k)).collect();
        let only = |all: &dyn Fn(usize) -> f64| used.iter().map(|&i| all(i)).collect::<Vec<f64>>();
        let e = only(&|i| self.errors[i][k]);
        let on = |f: &[f64]| {
            let f = only(&|i| f[i]);
            let (ef, ff, ee) = (dot(&e, &f), dot(&f, &f), dot(&e, &e));
            let slope = if ff > 0.0 { ef / ff } else { 0.0 };
            (slope, if ee > 0.0 && used.len() > 1 { 1.0 - slope * ef / ee } else { 1.0 })
        };
        let (first, second) = (on(&f2), on(&f3));
        let square = 6.0 * second.0;
        let second = if square > 0.0 { (square.sqrt(), second.1) } else { (0.0, 1.0) };
        Some(Regression { k, first: (2.0 * first.0, first.1), second, f2, f3 })
    }

    /// The size of what each equation is made of.
    fn sizes(&self) -> Vec<f64> {
        let scale = |i: usize, j: usize| self.scales[self.exact.equations[i].residual][j];
        let made_of = |i: usize| {
            let terms = (0..self.exact.parameters).map(|j| scale(i, j) * self.exact.q[j].abs());
            terms.fold(0.0, f64::max)
        };
        (0..self.errors.len()).map(|i| self.exact.r[i].abs() + made_of(i)).collect()
    }

    /// What steps have in common.
    fn pattern(&self, steps: &[(usize, f64)]) -> Steps {
        let same = |all: &[f64]| {
            let middle = median(all.to_vec());
            all.iter().all(|h| (h / middle - 1.0).abs() < SAME).then_some(middle)
        };
        let all: Vec<f64> = steps.iter().map(|(_, h)| *h).collect();
        if let Some(h) = same(&all) {
            return Steps::Same(h);
        }
        let value = |k: usize| self.exact.q[self.columns[k]].abs();
        let shares: Vec<f64> = steps.iter().filter(|(k, _)| value(*k) > 0.0).map(|(k, h)| h / value(*k)).collect();
        if let Some(share) = same(&shares).filter(|_| shares.len() == steps.len()) {
            return Steps::Relative(share);
        }
        let unit = |k: usize| self.exact.columns[self.columns[k]].1.as_str();
        let mut units: Vec<&str> = steps.iter().map(|(k, _)| unit(*k)).collect();
        units.sort_unstable();
        units.dedup();
        let of_unit = |name: &&str| {
            let own: Vec<f64> = steps.iter().filter(|(k, _)| unit(*k) == *name).map(|(_, h)| *h).collect();
            same(&own).map(|h| ((*name).to_owned(), h))
        };
        let by_unit: Option<Vec<(String, f64)>> = units.iter().map(of_unit).collect();
        by_unit.map_or_else(|| Steps::About(median(all)), Steps::ByUnit)
    }
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}
