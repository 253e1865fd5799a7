//! The continuous relaxation: weights 0 ≤ wᵢ ≤ 1 that sum to N and minimise φ.
//!
//! A Newton method on a working set: where w is best, most weights are 0 or 1 and few (n(n+1)/2 suffice) lie between. Each
//! round takes those between and the ones whose gradient says that they should leave their end, models φ by its gradient −d and Hessian
//! H on them, solves
//!
//! > min ½ δᵀH δ − dᵀδ,  Σδ = 0,  −w ≤ δ ≤ 1 − w
//!
//! by steps along the pair that violates optimality most (Platt 1998, Keerthi et al. 2001, for support vector machines: the same
//! program), and goes as far along δ as φ falls. It ends where what a linear model could still gain,
//! Σ of the N largest dᵢ − Σ wᵢdᵢ ≥ φ(w) − φ* (Frank & Wolfe 1956), is a small share of φ. What is certified does not rest on this, but
//! on [`bound()`].

use super::bound::bound;
use super::criterion::{Goal, Pull};
use super::experiment::{Experiment, Inverse, products};
use crate::linalg::dot;

/// The share of φ (or of n, for D) that a linear model could still gain at the end.
const ENOUGH: f64 = 1e-5;
/// Rounds for each power.
const ROUNDS: usize = 60;
/// The largest working set.
const WORKING: usize = 300;
/// Powers that lead to the largest of several, one after the other.
const POWERS: [f64; 6] = [2.0, 6.0, 16.0, 48.0, 144.0, 432.0];

/// Weights, and what they are worth.
#[derive(Clone, Debug)]
pub(super) struct Relaxed {
    pub(super) weights: Vec<f64>,
    pub(super) value: f64,
    /// φ of any N candidates is this or more
    pub(super) bound: f64,
    /// what each candidate would gain at the weights
    pub(super) gains: Vec<f64>,
}

struct Local {
    inverse: Inverse,
    pull: Pull,
    gains: Vec<f64>,
}

fn local(experiment: &Experiment, goal: &Goal, weights: &[f64]) -> Option<Local> {
    let inverse = experiment.weighted(weights).inverse()?;
    let pull = goal.at(&inverse)?;
    let gains = experiment.seen(&pull.directions);
    Some(Local { inverse, pull, gains })
}

/// From weights that see everything; none where they do not.
pub(super) fn relax(experiment: &Experiment, goal: &Goal, count: usize, start: &[f64]) -> Option<Relaxed> {
    let powers: &[f64] = if goal.is_smooth() { &[1.0] } else { &POWERS };
    let mut best: Option<Relaxed> = None;
    let mut weights = start.to_vec();
    for &power in powers {
        let found = minimise(experiment, &goal.with_power(power), count, weights)?;
        weights = found.weights.clone();
        best = Some(match best {
            None => found,
            Some(known) => {
                let bound = known.bound.max(found.bound);
                let better = if found.value <= known.value { found } else { known };
                Relaxed { bound, ..better }
            }
        });
        // what remains is not worth a sharper power
        if best.as_ref().is_some_and(|found| found.value - found.bound <= 1e-3 * found.value) {
            break;
        }
    }
    best
}

fn minimise(experiment: &Experiment, goal: &Goal, count: usize, mut weights: Vec<f64>) -> Option<Relaxed> {
    let mut at = local(experiment, goal, &weights)?;
    let mut best = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        best = best.max(bound(experiment, goal, &at.inverse, &at.pull, &at.gains, count));
        if promised(&at.gains, &weights, count) <= ENOUGH * size(goal, &at.pull, experiment) {
            break;
        }
        let working = working_set(&at.gains, &weights, count);
        let hessian = hessian(experiment, goal, &at, &working);
        let step = pairs(&hessian, &working, &at.gains, &weights);
        let Some((next, moved)) = along(experiment, goal, &at, &weights, &working, &step) else { break };
        (at, weights) = (next, moved);
    }
    best = best.max(bound(experiment, goal, &at.inverse, &at.pull, &at.gains, count));
    Some(Relaxed { weights, value: at.pull.value, bound: best, gains: at.gains })
}

fn size(goal: &Goal, pull: &Pull, experiment: &Experiment) -> f64 {
    if let Goal::Determinant(_) = goal { experiment.coordinates() as f64 } else { pull.smooth }
}

/// What a linear model of φ could gain.
fn promised(gains: &[f64], weights: &[f64], count: usize) -> f64 {
    let mut most = gains.to_vec();
    most.sort_by(|a, b| b.total_cmp(a));
    most.iter().take(count).sum::<f64>() - gains.iter().zip(weights).map(|(d, w)| d * w).sum::<f64>()
}

/// Weights between their ends, and those at an end that should leave it most.
fn working_set(gains: &[f64], weights: &[f64], count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..gains.len()).collect();
    order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]).then(a.cmp(&b)));
    // the level that divides those to be taken from those to be left
    let level = gains[order[count.clamp(1, order.len()) - 1]];
    let urgency = |&i: &usize| match weights[i] {
        0.0 => gains[i] - level,
        1.0 => level - gains[i],
        _ => f64::INFINITY,
    };
    order.sort_by(|a, b| urgency(b).total_cmp(&urgency(a)).then(a.cmp(b)));
    let between = weights.iter().filter(|w| **w > 0.0 && **w < 1.0).count();
    // some that are content are taken in: they may be wanted after the step
    order.truncate((between + count.min(60) + 60).min(WORKING));
    order.sort_unstable();
    order
}

/// ∂²φₚ/∂wᵢ∂wⱼ over the working set, row by row. For a trace it is 2 Σ (Aᵢ M⁻¹ Aⱼᵀ) ∘ (Aᵢ Y Yᵀ Aⱼᵀ) with Y = M⁻¹T_Zᵀ, for D ‖Aᵢ M⁻¹ Aⱼᵀ‖²; what
/// Z adds is the second derivative of the norm by what it is of.
fn hessian(experiment: &Experiment, goal: &Goal, at: &Local, working: &[usize]) -> Vec<f64> {
    let n = experiment.coordinates();
    let count = working.len();
    struct Seen {
        rows: usize,
        /// Aᵢ L⁻ᵀ and Aᵢ Y
        by: (Vec<f64>, Vec<f64>),
        features: Vec<f64>,
    }
    let width = at.pull.directions.len() / n;
    let seen: Vec<Seen> = working
        .iter()
        .map(|&i| {
            let rows = experiment.rows(i);
            let by = (products(n, rows, &at.inverse.root), products(n, rows, &at.pull.directions));
            Seen { rows: rows.len() / n, by, features: features(n, goal, &at.pull, rows) }
        })
        .collect();
    let outer = match goal {
        Goal::Determinant(_) => 0.0,
        Goal::Parts { power, .. } | Goal::Eigenvalues { power, .. } => (power - 1.0) / at.pull.smooth,
    };
    let determinant = matches!(goal, Goal::Determinant(_));
    let entry = |i: usize, j: usize| {
        let (a, b) = (&seen[i], &seen[j]);
        let mut sum = 0.0;
        for r in 0..a.rows {
            for s in 0..b.rows {
                let x = dot(&a.by.0[r * n..(r + 1) * n], &b.by.0[s * n..(s + 1) * n]);
                let y = match determinant {
                    true => x,
                    false => 2.0 * dot(&a.by.1[r * width..(r + 1) * width], &b.by.1[s * width..(s + 1) * width]),
                };
                sum += x * y;
            }
        }
        sum + dot(&a.features, &b.features) - outer * at.gains[working[i]] * at.gains[working[j]]
    };
    let mut all = vec![0.0; count * count];
    for i in 0..count {
        for j in 0..=i {
            let found = entry(i, j);
            (all[i * count + j], all[j * count + i]) = (found, found);
        }
    }
    all
}

/// Numbers of a candidate whose products are what Z adds to the Hessian, but for the product of the gradients.
fn features(n: usize, goal: &Goal, pull: &Pull, rows: &[f64]) -> Vec<f64> {
    match goal {
        Goal::Parts { ends, power, .. } if *power > 1.0 => {
            let mut begin = 0;
            let part = |(&end, share): (&usize, &f64)| {
                let d: f64 = products(n, rows, &pull.plain[begin..end]).iter().map(|x| x * x).sum();
                begin = end;
                ((power - 1.0) / pull.smooth * share.powf(power - 2.0)).sqrt() * d
            };
            ends.iter().zip(&pull.shares).map(part).collect()
        }
        Goal::Eigenvalues { power, .. } if *power > 1.0 => {
            let count = pull.shares.len();
            let width = pull.plain.len() / n;
            let seen = products(n, rows, &pull.plain);
            let mut all = Vec::with_capacity(width * (width + 1) / 2);
            for a in 0..width.min(count) {
                for b in 0..=a {
                    let d: f64 = seen.chunks_exact(width).map(|row| row[a] * row[b]).sum();
                    let (x, y) = (pull.shares[a], pull.shares[b]);
                    // the divided difference of λ^(p−1)
                    let slope = match (x - y).abs() > 1e-6 * x.max(y) {
                        true => (x.powf(power - 1.0) - y.powf(power - 1.0)) / (x - y),
                        false => (power - 1.0) * x.max(y).powf(power - 2.0),
                    };
                    let times = if a == b { 1.0 } else { 2.0 };
                    all.push((times * slope.max(0.0) / pull.smooth).sqrt() * d);
                }
            }
            all
        }
        _ => Vec::new(),
    }
}

/// The step δ of the working set.
fn pairs(hessian: &[f64], working: &[usize], gains: &[f64], weights: &[f64]) -> Vec<f64> {
    let n = working.len();
    let mut delta = vec![0.0; n];
    let mut slope: Vec<f64> = working.iter().map(|&i| -gains[i]).collect();
    let (low, high): (Vec<f64>, Vec<f64>) = working.iter().map(|&i| (-weights[i], 1.0 - weights[i])).unzip();
    let ridge = 1e-12 * (0..n).map(|i| hessian[i * n + i]).fold(0.0, f64::max) + f64::MIN_POSITIVE;
    let mut first = None;
    for _ in 0..200 * n {
        let (mut up, mut down) = (None::<usize>, None::<usize>);
        for k in 0..n {
            if delta[k] < high[k] && up.is_none_or(|best| slope[k] < slope[best]) {
                up = Some(k);
            }
            if delta[k] > low[k] && down.is_none_or(|best| slope[k] > slope[best]) {
                down = Some(k);
            }
        }
        let (Some(up), Some(down)) = (up, down) else { break };
        let violation = slope[down] - slope[up];
        // the model itself is no better than that
        if violation <= 1e-3 * *first.get_or_insert(violation) || violation <= 0.0 {
            break;
        }
        let curvature = hessian[up * n + up] + hessian[down * n + down] - 2.0 * hessian[up * n + down];
        let room = (high[up] - delta[up]).min(delta[down] - low[down]);
        let step = (violation / curvature.max(ridge)).min(room);
        if step <= 0.0 {
            break;
        }
        // at an end exactly, so that it counts as one
        delta[up] = if step >= high[up] - delta[up] { high[up] } else { delta[up] + step };
        delta[down] = if step >= delta[down] - low[down] { low[down] } else { delta[down] - step };
        let (a, b) = (&hessian[up * n..(up + 1) * n], &hessian[down * n..(down + 1) * n]);
        slope.iter_mut().zip(a.iter().zip(b)).for_each(|(slope, (a, b))| *slope += step * (a - b));
    }
    delta
}

/// As far along δ as φ falls by a share of what the gradient promises.
fn along(
    experiment: &Experiment,
    goal: &Goal,
    at: &Local,
    weights: &[f64],
    working: &[usize],
    step: &[f64],
) -> Option<(Local, Vec<f64>)> {
    const SHARE: f64 = 1e-4;
    const HALVINGS: i32 = 30;
    let promised: f64 = working.iter().zip(step).map(|(&i, delta)| at.gains[i] * delta).sum();
    if promised <= 0.0 {
        return None;
    }
    for halvings in 0..HALVINGS {
        let length = 0.5_f64.powi(halvings);
        let mut moved = weights.to_vec();
        for (&i, delta) in working.iter().zip(step) {
            moved[i] = match length {
                1.0 if *delta == -weights[i] => 0.0,
                1.0 if *delta == 1.0 - weights[i] => 1.0,
                _ => (weights[i] + length * delta).clamp(0.0, 1.0),
            };
        }
        let Some(inverse) = experiment.weighted(&moved).inverse() else { continue };
        if at.pull.smooth - goal.smooth(&inverse) < SHARE * length * promised {
            continue;
        }
        return Some((local(experiment, goal, &moved)?, moved));
    }
    None
}
