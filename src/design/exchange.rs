//! Designs of whole candidates: greedy, then by exchange.
//!
//! What a candidate j adds to M, with K = M⁻¹, is known exactly without a new inverse (Woodbury):
//!
//! > tr(T M⁻¹ Tᵀ) falls by ‖L_B⁻¹ Aⱼ K Tᵀ‖²,  log det M rises by log det B,  B = L_B L_Bᵀ = 1 + Aⱼ K Aⱼᵀ
//!
//! and the first is at most ‖Aⱼ K Tᵀ‖², the second at most tr(B − 1): candidates are tried in the order of these, until the next cannot be
//! better than the best so far. An exchange (Fedorov 1972, 3.2) takes one candidate out and the best of all in, and is made where the
//! true criterion falls; it ends where no exchange of one against one helps.

use super::criterion::{Goal, Pull};
use super::experiment::{Experiment, Information, Inverse, products};
use crate::linalg::{Matrix, cholesky, dot};

/// What stands in for what is not seen yet, beside 1 for all candidates.
const UNSEEN: f64 = 1e-9;
/// An exchange is made where it pays this share.
const PAYS: f64 = 1e-9;
/// Sweeps over all chosen.
const SWEEPS: usize = 100;
/// Exchanges that are tried in earnest for each chosen, where the criterion is not what orders them.
const TRIED: usize = 3;

/// The best candidates to be added, at most so many, best first; none twice. `taken` are left out.
fn best_additions(
    experiment: &Experiment,
    goal: &Goal,
    (inverse, directions): (&Inverse, &[f64]),
    allowed: &[usize],
    taken: &[bool],
    most: usize,
) -> Vec<usize> {
    let n = experiment.coordinates();
    let determinant = matches!(goal, Goal::Determinant(_));
    let seen: Vec<f64> = if allowed.len() == experiment.candidates() {
        experiment.seen(directions)
    } else {
        let of = |&i: &usize| products(n, experiment.rows(i), directions).iter().map(|x| x * x).sum();
        allowed.iter().map(of).collect()
    };
    let mut order: Vec<usize> = (0..allowed.len()).filter(|&k| !taken[allowed[k]]).collect();
    order.sort_by(|&a, &b| seen[b].total_cmp(&seen[a]).then(a.cmp(&b)));
    let mut best: Vec<(f64, usize)> = Vec::new();
    for k in order {
        if best.len() == most && seen[k] <= best[most - 1].0 {
            break;
        }
        let rows = experiment.rows(allowed[k]);
        let m = rows.len() / n;
        let half = inverse.times(rows);
        let mut b = products(n, &half, rows);
        (0..m).for_each(|r| b[r * m + r] += 1.0);
        let columns: Vec<&[f64]> = b.chunks_exact(m.max(1)).collect();
        let Some(l) = cholesky(&Matrix::from_columns(m, &columns)) else { continue };
        let gain = if determinant {
            2.0 * (0..m).map(|r| l[(r, r)].ln()).sum::<f64>()
        } else {
            let c = products(n, rows, directions);
            let width = directions.len() / n;
            let mut solved: Vec<Vec<f64>> = Vec::with_capacity(m);
            for r in 0..m {
                let mut row = c[r * width..(r + 1) * width].to_vec();
                for (s, above) in solved.iter().enumerate() {
                    row.iter_mut().zip(above).for_each(|(x, y)| *x -= l[(r, s)] * y);
                }
                row.iter_mut().for_each(|x| *x /= l[(r, r)]);
                solved.push(row);
            }
            solved.iter().map(|row| dot(row, row)).sum()
        };
        let place = best.partition_point(|(known, _)| *known >= gain);
        if place < most {
            best.insert(place, (gain, allowed[k]));
            best.truncate(most);
        }
    }
    best.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Rows of Y for an inverse, with Z as it is at `pull`.
fn directions(goal: &Goal, inverse: &Inverse, pull: &Pull) -> Vec<f64> {
    if let Goal::Determinant(_) = goal { inverse.root.clone() } else { inverse.times(&pull.wanted) }
}

/// Adds the best candidate, one after the other, until there are so many.
pub(super) fn greedy(experiment: &Experiment, goal: &Goal, chosen: &mut Vec<usize>, count: usize) {
    let all: Vec<usize> = (0..experiment.candidates()).collect();
    let mut taken = vec![false; experiment.candidates()];
    chosen.iter().for_each(|&i| taken[i] = true);
    let mut information = experiment.of(chosen).shifted(UNSEEN);
    while chosen.len() < count {
        let found = information.inverse().and_then(|inverse| goal.at(&inverse).map(|pull| (inverse, pull)));
        let best = found.and_then(|(inverse, pull)| {
            best_additions(experiment, goal, (&inverse, &pull.directions), &all, &taken, 1).first().copied()
        });
        // what is left is as good as anything where numbers have run out
        let Some(next) = best.or_else(|| taken.iter().position(|taken| !taken)) else { return };
        taken[next] = true;
        chosen.push(next);
        experiment.tell("rows chosen", chosen.len(), count);
        information.add(experiment.rows(next), 1.0);
    }
}

/// φₚ of a design; infinite where it does not see everything.
pub(super) fn worth(experiment: &Experiment, goal: &Goal, chosen: &[usize]) -> f64 {
    experiment.of(chosen).inverse().map_or(f64::INFINITY, |inverse| goal.smooth(&inverse))
}

/// Exchanges one against one of `allowed` until nothing helps; gives φₚ.
pub(super) fn exchange(experiment: &Experiment, goal: &Goal, chosen: &mut [usize], allowed: &[usize]) -> f64 {
    let mut taken = vec![false; experiment.candidates()];
    chosen.iter().for_each(|&i| taken[i] = true);
    let tried = if goal.is_smooth() { 1 } else { TRIED };
    let mut current = worth(experiment, goal, chosen);
    let mut total = experiment.of(chosen);
    let mut pull = shifted_inverse(&total).and_then(|inverse| goal.at(&inverse));
    for _ in 0..SWEEPS {
        let mut improved = false;
        for slot in 0..chosen.len() {
            experiment.tell("exchanges tried", slot, chosen.len());
            let out = chosen[slot];
            let mut without = total.clone();
            without.add(experiment.rows(out), -1.0);
            let Some((pull_here, inverse)) = pull.as_ref().zip(shifted_inverse(&without)) else { continue };
            let ordered = directions(goal, &inverse, pull_here);
            let found = best_additions(experiment, goal, (&inverse, &ordered), allowed, &taken, tried);
            let value = |candidate: usize| {
                let mut with = without.clone();
                with.add(experiment.rows(candidate), 1.0);
                with.inverse().map_or(f64::INFINITY, |inverse| goal.smooth(&inverse))
            };
            let best = found.into_iter().map(|candidate| (value(candidate), candidate));
            let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((value, into)) = best else { continue };
            if value < current && (current.is_infinite() || value < current - PAYS * current.abs()) {
                (taken[out], taken[into]) = (false, true);
                chosen[slot] = into;
                current = value;
                improved = true;
                total = experiment.of(chosen);
                pull = shifted_inverse(&total).and_then(|inverse| goal.at(&inverse));
            }
        }
        if !improved {
            break;
        }
    }
    current
}

fn shifted_inverse(information: &Information) -> Option<Inverse> {
    information.clone().shifted(UNSEEN).inverse()
}
