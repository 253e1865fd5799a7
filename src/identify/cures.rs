//! What to hold so that the rest can be known.
//!
//! A k-dimensional invisible space needs k conditions. A set of k coordinates will do where the space's rows for them are
//! independent: then nothing invisible is left when they are held, and with fewer something is. Each part of the space, which
//! shares no coordinate with the others, is cured by itself. Choices are ranked by the smallest singular value of those rows of
//! an orthonormal basis (1 where the datum takes up the direction alone, small where the others must move far), those
//! without prior knowledge first among equals.

use crate::fit::{Covariance, NOT_ESTIMABLE};
use crate::linalg::{Matrix, choices, dot, each_choice, norm, orthonormalise, separate, sparsest, svd};
use crate::problem::Problem;

/// Choices that are looked at, of each part.
const MOST_CHOICES: usize = 5_000;
/// Choices that are told, of each part.
const TOLD: usize = 5;
/// Parameters that a sentence names beside those to hold.
const NAMED: usize = 6;
/// A choice that leaves less than this is none.
const LEAST: f64 = 1e-3;

/// One choice of what to hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Cure {
    /// The parameters to hold.
    pub fix: Vec<String>,
    /// From 0 to 1, the larger the better.
    pub conditioning: f64,
    /// What becomes of the others that were not estimable: name, standard uncertainty where it is known, unit.
    pub then: Vec<(String, Option<f64>, String)>,
}

impl Cure {
    /// What to do and what it means.
    pub fn sentence(&self) -> String {
        let names = |all: &[String]| {
            let quoted: Vec<String> = all.iter().map(|name| format!("`{name}`")).collect();
            match &quoted[..] {
                [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
                _ => quoted.concat(),
            }
        };
        let known: Vec<String> = self
            .then
            .iter()
            .map(|(name, sigma, unit)| match sigma {
                Some(sigma) if unit == "1" => format!("`{name}` ± {sigma:.2}"),
                Some(sigma) if *sigma < 0.01 => format!("`{name}` ± {sigma:.1e} {unit}"),
                Some(sigma) => format!("`{name}` ± {sigma:.2} {unit}"),
                None => format!("`{name}`"),
            })
            .collect();
        let more = known.len().saturating_sub(NAMED);
        if more > 0 {
            let shown = known[..NAMED].join(", ");
            return format!("hold {}: {shown} and {more} more are then known relative to it", names(&self.fix));
        }
        match &known[..] {
            [] => format!("hold {}", names(&self.fix)),
            [one] => format!("hold {}: {one} is then known relative to it", names(&self.fix)),
            [first @ .., last] => {
                format!("hold {}: {} and {last} are then known relative to it", names(&self.fix), first.join(", "))
            }
        }
    }
}

/// The best choices for each part of the invisible space that `basis` (orthonormal, in tolerances) spans, the best first.
pub fn cures(problem: &Problem, basis: &[Vec<f64>], covariance: Option<&Covariance>) -> Vec<Vec<Cure>> {
    let all = sparsest(basis);
    separate(basis).iter().map(|part| of_part(problem, &all, part, covariance)).collect()
}

/// The coordinates that take up an invisible space best: each the one that most is left of.
pub(super) fn best_datum(basis: &[Vec<f64>]) -> Vec<usize> {
    let n = basis.first().map_or(0, Vec::len);
    let mut rows: Vec<Vec<f64>> = (0..n).map(|j| basis.iter().map(|vector| vector[j]).collect()).collect();
    let mut chosen = Vec::new();
    for _ in 0..basis.len() {
        let best = (0..n).filter(|j| !chosen.contains(j)).max_by(|&a, &b| {
            // the first of equals
            norm(&rows[a]).total_cmp(&(norm(&rows[b]) * (1.0 + 1e-9))).then(b.cmp(&a))
        });
        let Some(best) = best else { break };
        let length = norm(&rows[best]).max(f64::MIN_POSITIVE);
        let own: Vec<f64> = rows[best].iter().map(|x| x / length).collect();
        for row in &mut rows {
            let share = dot(row, &own);
            row.iter_mut().zip(&own).for_each(|(x, own)| *x -= share * own);
        }
        chosen.push(best);
    }
    chosen
}

fn of_part(problem: &Problem, all: &[Vec<f64>], part: &[usize], covariance: Option<&Covariance>) -> Vec<Cure> {
    let inside = |vector: &&Vec<f64>| part.iter().any(|&j| vector[j] != 0.0);
    let vectors: Vec<Vec<f64>> = all.iter().filter(inside).cloned().collect();
    let mut basis = vectors.clone();
    orthonormalise(&mut basis);
    let k = basis.len();
    let share = |j: usize| basis.iter().map(|vector| vector[j] * vector[j]).sum::<f64>();
    let telling: Vec<usize> = part.iter().copied().filter(|&j| share(j) > NOT_ESTIMABLE).collect();
    let conditioning = |chosen: &[usize]| {
        let rows: Vec<Vec<f64>> = chosen.iter().map(|&j| basis.iter().map(|vector| vector[j]).collect()).collect();
        svd(&Matrix::from_columns(k, &rows)).ok().and_then(|found| found.sigma.last().copied()).unwrap_or(0.0)
    };
    let mut found: Vec<(f64, usize, Vec<usize>)> = Vec::new();
    let mut add = |chosen: Vec<usize>| {
        let quality = conditioning(&chosen);
        let priors = chosen.iter().filter(|&&j| problem.layout.coordinates[problem.free[j]].sigma.is_some()).count();
        if quality > LEAST {
            found.push((quality, priors, chosen));
        }
    };
    if choices(telling.len(), k) <= MOST_CHOICES {
        each_choice(telling.len(), k, |chosen| add(chosen.iter().map(|&i| telling[i]).collect()));
    }
    let mut best = best_datum(&basis);
    best.sort_unstable();
    add(best);
    // two digits of the quality are worth ranking by
    found.sort_by_key(|(quality, priors, chosen)| {
        (std::cmp::Reverse((quality * 100.0).round() as i64), *priors, chosen.clone())
    });
    found.dedup_by(|a, b| a.2 == b.2);
    let name = |j: usize| problem.layout.coordinates[problem.free[j]].name.clone();
    let told = found.into_iter().take(TOLD).map(|(conditioning, _, chosen)| {
        let after = covariance.and_then(|covariance| super::held_datum(problem, covariance, &basis, &chosen).ok());
        let then = telling.iter().filter(|j| !chosen.contains(j)).map(|&j| {
            let dimension = problem.layout.coordinates[problem.free[j]].dimension;
            let units = &problem.program.units;
            let sigma = after.as_ref().map(|after| units.to_reported(after.sigma(j), dimension));
            (name(j), sigma, units.symbol(dimension))
        });
        Cure { then: then.collect(), fix: chosen.iter().map(|&j| name(j)).collect(), conditioning }
    });
    told.collect()
}
