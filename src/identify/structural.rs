//! What no data of the declared kind can see.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::cures::{Cure, cures};
use super::direction::{Direction, RANDOM_SPREAD, WEAK, spectrum};
use super::inputs::{At, Probe, places, unit_options};
use super::walk::walk;
use crate::diag::{Diagnostic, Diagnostics};
use crate::fit::NOT_ESTIMABLE;
use crate::linalg::{SquareRootInformation, dot, orthonormalise, sparsest};
use crate::problem::{Problem, Rows, Undefined};
use crate::solve::{LeastSquares, NullSpace, null_space};

/// Random points beside the nominal one.
pub const POINTS: usize = 4;
/// How far from the nominal point the generic null space is looked at, as shares of the way to a random one: as near as it can be
/// told from that of the nominal point itself.
const BESIDE: [f64; 4] = [1e-3, 1e-2, 0.1, 1.0];
/// Points that are tried to have so many.
const TRIED: usize = 12;

/// What can be seen at all.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Names of the free coordinates.
    pub free: Vec<String>,
    /// The generic rank: the largest at any point.
    pub rank: usize,
    /// The rank at the nominal values, where these have consistent inputs.
    pub nominal_rank: Option<usize>,
    /// The points that were looked at, and those that had no consistent inputs.
    pub points: usize,
    /// Points without consistent inputs, or where a residual is undefined.
    pub skipped: usize,
    /// Singular values at the point that sees best, columns normalised, as shares of the largest.
    pub singular_values: Vec<f64>,
    /// What is invisible everywhere, at the nominal values where the rank there is the generic one, else at a random point.
    pub invisible: Vec<Direction>,
    /// Whether the directions are those at the nominal values.
    pub told_at_nominal: bool,
    /// What is invisible at the nominal values and nowhere else; empty where the rank is the same.
    pub stationary: Vec<Direction>,
    /// What is visible everywhere, but next to nothing.
    pub weak: Vec<Direction>,
    /// What to hold, by parts of the invisible space.
    pub cures: Vec<Vec<Cure>>,
    /// Whether each free coordinate can be known.
    pub estimable: Vec<bool>,
    /// Why a point was skipped, the first of them.
    pub reason: Option<Box<Diagnostic>>,
}

impl Structure {
    /// Whether every free parameter can be determined, from the nominal values on.
    pub fn sound(&self) -> bool {
        self.estimable.iter().all(|estimable| *estimable) && self.stationary.is_empty()
    }
}

/// One point, judged.
struct Judged<'a> {
    at: At<'a>,
    information: SquareRootInformation,
    seen: NullSpace,
    nominal: bool,
}

fn judge<'a>(probe: &Probe<'a>, like: &Problem<'a>, point: &[f64], salt: u64) -> Result<Judged<'a>, Box<Diagnostic>> {
    let undefined = |Undefined(found): Undefined| found;
    let at = probe.at(like, point, salt)?;
    let information = at.problem.at_consistent_inputs(&at.problem.start, Rows::All).map_err(undefined)?;
    let information = at.problem.with_equations(information, &at.problem.start).map_err(undefined)?;
    let seen = null_space(&information, at.problem.scale()).map_err(|error| undefined(error.into()))?;
    Ok(Judged { at, information, seen, nominal: salt == 0 })
}

/// The generic rank of a model for inputs of a kind, and what is invisible.
///
/// # Errors
/// Mistakes of names and scenarios; no point at all with consistent inputs.
pub fn structure(probe: &Probe) -> Result<Structure, Diagnostics> {
    let probe = Probe { options: unit_options(&probe.options), ..probe.clone() };
    let (like, _) = probe.bound()?;
    let mut like = like.without_loss();
    like.weights = crate::problem::Weights::Unit;
    let (mut judged, mut skipped, mut reason) = (Vec::new(), 0, None);
    for salt in 0..=TRIED as u64 {
        if judged.iter().filter(|one: &&Judged| !one.nominal).count() == POINTS {
            break;
        }
        let point = if salt == 0 { like.start.clone() } else { random_point(&like, probe.seed.wrapping_add(salt)) };
        match judge(&probe, &like, &point, salt) {
            Ok(one) => judged.push(one),
            Err(why) => {
                skipped += 1;
                reason.get_or_insert(why);
            }
        }
    }
    let better = |a: &&Judged, b: &&Judged| {
        let least = |one: &Judged| one.seen.singular_values.get(one.seen.rank.wrapping_sub(1)).copied().unwrap_or(0.0);
        a.seen.rank.cmp(&b.seen.rank).then(least(a).total_cmp(&least(b)))
    };
    let Some(best) = judged.iter().max_by(better) else {
        return Err(reason.map_or_else(Diagnostics::new, |why| Diagnostics::from(*why)));
    };
    let rank = best.seen.rank;
    let nominal = judged.iter().find(|one| one.nominal);
    // told where the user's numbers are, if what is seen there is what is seen anywhere
    let told = nominal.filter(|one| one.seen.rank == rank).unwrap_or(best);
    let followed = |one: &Judged, directions: &[Vec<f64>]| -> Vec<Direction> {
        let follow = |z: &Vec<f64>| {
            let mut found = Direction::new(&one.at.problem, z);
            found.walk = walk(&one.at.problem, &one.seen.basis, z).ok();
            found
        };
        directions.iter().map(follow).collect()
    };
    let invisible = followed(told, &sparsest(&told.seen.basis));
    let stationary = match nominal.filter(|one| one.seen.rank < rank) {
        Some(one) => {
            // what is invisible beside the nominal values as well, as it is there
            let far = random_point(&like, probe.seed.wrapping_add(1));
            let beside = |share: &f64| judge(&probe, &like, &between(&like.start, &far, *share), 1).ok();
            let generic = BESIDE.iter().filter_map(beside).find(|near| near.seen.rank == rank);
            let generic = generic.map_or_else(Vec::new, |near| near.seen.basis);
            followed(one, &only_here(&one.seen.basis, generic, rank - one.seen.rank))
        }
        None => Vec::new(),
    };
    let problem = &told.at.problem;
    let share = |j: usize| told.seen.basis.iter().map(|z| z[j] * z[j]).sum::<f64>();
    let undefined = |error: crate::linalg::LinalgError| Diagnostics::from(*Undefined::from(error).0);
    let spectrum = spectrum(&best.information, best.at.problem.scale()).map_err(undefined)?;
    let weak = spectrum[..rank.min(spectrum.len())].iter().filter(|(seen, _)| *seen < WEAK);
    let weak = weak.map(|(seen, z)| Direction::weak(&best.at.problem, z, *seen, None)).collect();
    let mut free: Vec<(usize, String)> = places(problem).into_iter().map(|(name, j)| (j, name)).collect();
    free.sort_unstable();
    Ok(Structure {
        free: free.into_iter().map(|(_, name)| name).collect(),
        rank,
        nominal_rank: nominal.map(|one| one.seen.rank),
        points: judged.len(),
        skipped,
        singular_values: spectrum.iter().map(|(seen, _)| *seen).collect(),
        invisible,
        told_at_nominal: told.nominal,
        stationary,
        weak,
        cures: cures(problem, &told.seen.basis, None),
        estimable: (0..problem.free.len()).map(|j| share(j) <= NOT_ESTIMABLE).collect(),
        reason,
    })
}

/// So many sparse directions of a basis that differ most from what is invisible nearby.
fn only_here(basis: &[Vec<f64>], mut nearby: Vec<Vec<f64>>, wanted: usize) -> Vec<Vec<f64>> {
    let mut all = sparsest(basis);
    let mut chosen = Vec::new();
    while chosen.len() < wanted {
        let rest = |z: &[f64]| 1.0 - nearby.iter().map(|known| dot(known, z).powi(2)).sum::<f64>();
        // the first of those that differ as much
        let share = |z: &[f64]| (rest(z) * 1e3).round() as i64;
        let Some(best) = (0..all.len()).rev().max_by_key(|&i| share(&all[i])) else { break };
        let z = all.remove(best);
        nearby.push(z.clone());
        orthonormalise(&mut nearby);
        chosen.push(z);
    }
    chosen
}

/// So much of the way from one point to another.
fn between(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect()
}

/// A point with its free coordinates evenly drawn about the start, as far as [`RANDOM_SPREAD`] says and bounds allow.
fn random_point(problem: &Problem, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (of_size, of_tolerance) = RANDOM_SPREAD;
    let mut point = problem.start.clone();
    for &c in &problem.free {
        let known = &problem.layout.coordinates[c];
        let spread = of_size * point[c].abs() + of_tolerance * known.tolerance;
        let share = 2.0 * random.random::<f64>() - 1.0;
        point[c] = (point[c] + share * spread).clamp(known.min, known.max);
    }
    point
}
