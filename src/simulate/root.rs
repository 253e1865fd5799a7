//! Inputs that make expressions vanish: inverse kinematics and the like, for a handful of unknowns.

#![allow(
    clippy::indexing_slicing,
    reason = "a system has as many rows as it was begun with, and variables are numbered by the scenario"
)]

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use crate::eval::{Evaluator, Leaf};
use crate::graph::{Tape, Undefined};

/// Steps of one search.
const MOST_STEPS: usize = 60;
/// Dampings tried before a search ends.
const MOST_DAMPINGS: usize = 14;
/// What is left of a vanished residual, as a share of the size of its terms.
const VANISHED: f64 = 1e-10;
/// Further starts that are tried where a solution is known, and where none is.
const CHECKED: usize = 24;
const TRIED: usize = 200;
/// A search that comes so near to a known solution, in radians, is taken to end there.
const SAME: f64 = 0.1;

/// Why there is no solution: the nearest that was reached.
#[derive(Clone, Debug)]
pub(super) struct Unsolved {
    /// the unknowns there
    pub(super) reached: Vec<f64>,
    /// ‖zero‖ there
    pub(super) left: f64,
    /// the operation without a value, where that is the reason
    pub(super) undefined: Option<Undefined>,
}

/// A system of equations, solved anew for each row.
///
/// From the start it runs Levenberg–Marquardt: δ minimises ‖J δ + r‖² + λ‖D δ‖² by Householder reflections, with D the norms of
/// J's columns; λ is nearly zero as long as steps lower ‖r‖. A point counts as a solution where steps have ended and
/// ‖r‖ ≤ 1e-10 s, with s the size of the terms: what the unknowns do by their own size, Σ |Jᵢⱼ| max(|xⱼ|, 1 for angles), or ‖r‖ at
/// the start. Then further starts follow, the unknown angles moved by multiples of 45°, nearest first: where a
/// solution is known only those that are nearer than it, else all of a list. The solution nearest to the start is taken.
pub(super) struct Root<'t> {
    evaluator: Evaluator<'t>,
    unknowns: &'t [usize],
    start: Vec<f64>,
    angles: &'t [bool],
    /// offsets from the start, the nearest first, each with its length
    further: Vec<(f64, Vec<f64>)>,
    equations: usize,
    work: Work,
}

/// Room for one search, so that none is asked for in it.
#[derive(Default)]
struct Work {
    x: Vec<f64>,
    r: Vec<f64>,
    jacobian: Vec<f64>,
    trial: Vec<f64>,
    trial_r: Vec<f64>,
    scale: Vec<f64>,
    /// [J r] over [√λ D 0], column after column
    matrix: Vec<f64>,
    delta: Vec<f64>,
    best: Vec<f64>,
}

impl<'t> Root<'t> {
    pub(super) fn new(tape: &'t Tape, unknowns: &'t [usize], start: &'t [f64], angles: &'t [bool]) -> Self {
        let leaves = unknowns.iter().map(|&unknown| Leaf::Input(unknown)).collect();
        let further = further(start, angles);
        let (n, m) = (unknowns.len(), tape.outputs());
        let work = Work {
            r: vec![0.0; m],
            trial_r: vec![0.0; m],
            jacobian: vec![0.0; m * n],
            scale: vec![1.0; n],
            matrix: vec![0.0; (m + n) * (n + 1)],
            delta: vec![0.0; n],
            ..Work::default()
        };
        Root {
            evaluator: Evaluator::new(tape, leaves),
            unknowns,
            start: start.to_vec(),
            angles,
            further,
            equations: m,
            work,
        }
    }

    /// Where to start.
    pub(super) fn start(&mut self) -> &mut [f64] {
        &mut self.start
    }

    /// Sets the parameters.
    pub(super) fn begin(&mut self, leaves: &[f64]) {
        self.evaluator.begin(leaves);
    }

    /// Puts the solution nearest to the start into `variables`.
    pub(super) fn solve(&mut self, variables: &mut [f64]) -> Result<(), Unsolved> {
        let mut left = f64::INFINITY;
        let mut reached = self.start.clone();
        let mut distance = f64::INFINITY;
        for at in 0..=self.further.len() {
            let most = if distance.is_finite() { CHECKED } else { TRIED };
            if at > most || at > 0 && self.further[at - 1].0 >= distance {
                break;
            }
            self.work.x.clear();
            self.work.x.extend_from_slice(&self.start);
            if at > 0 {
                self.work.x.iter_mut().zip(&self.further[at - 1].1).for_each(|(x, offset)| *x += offset);
            }
            let Some((found, vanished)) = self.search(variables, distance.is_finite()) else { continue };
            let own = self.distance();
            if vanished && own < distance {
                distance = own;
                self.work.best.clone_from(&self.work.x);
            } else if !vanished && found < left {
                left = found;
                reached.clone_from(&self.work.x);
            }
        }
        if !distance.is_finite() {
            put(self.unknowns, &reached, variables);
            let undefined = self.evaluator.undefined(variables, true);
            return Err(Unsolved { reached, left, undefined });
        }
        put(self.unknowns, &self.work.best, variables);
        Ok(())
    }

    /// Searches from `work.x`: ‖r‖ at the end and whether it has vanished. Nothing where the search has ended at a
    /// solution that is known already, if one is, or the start is undefined.
    fn search(&mut self, variables: &mut [f64], known: bool) -> Option<(f64, bool)> {
        let n = self.unknowns.len();
        let work = &mut self.work;
        put(self.unknowns, &work.x, variables);
        self.evaluator.row(variables, &mut work.r, &mut work.jacobian);
        let mut square = squares(&work.r);
        let first = square.sqrt();
        if !square.is_finite() || work.jacobian.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let mut damping = 1e-12;
        let mut step = 0;
        'steps: while square > 0.0 && step < MOST_STEPS {
            step += 1;
            for j in 0..n {
                let norm = squares_of((0..self.equations).map(|i| work.jacobian[i * n + j])).sqrt();
                work.scale[j] = if norm > 0.0 { norm } else { 1.0 };
            }
            for _ in 0..MOST_DAMPINGS {
                work.step(self.equations, n, damping);
                work.shorten(self.angles);
                work.trial.clear();
                work.trial.extend(work.x.iter().zip(&work.delta).map(|(x, delta)| x + delta));
                if work.trial == work.x {
                    break 'steps;
                }
                put(self.unknowns, &work.trial, variables);
                self.evaluator.values(variables, &mut work.trial_r);
                // a value that is not a number is no improvement
                if squares(&work.trial_r) < square {
                    damping = (damping / 100.0).max(1e-12);
                    std::mem::swap(&mut work.x, &mut work.trial);
                    put(self.unknowns, &work.x, variables);
                    self.evaluator.row(variables, &mut work.r, &mut work.jacobian);
                    square = squares(&work.r);
                    if work.jacobian.iter().any(|entry| !entry.is_finite()) {
                        break 'steps;
                    }
                    if known && near(&work.x, &work.best, self.angles) {
                        return None;
                    }
                    continue 'steps;
                }
                // near the end a step of rounding's size lowers nothing: then this is the end
                let size = work.size(self.equations, n, self.angles).max(first);
                if square.sqrt() <= 1e-2 * VANISHED * size {
                    break 'steps;
                }
                damping = (damping * 100.0).max(1e-8);
            }
            break;
        }
        for (x, angle) in work.x.iter_mut().zip(self.angles) {
            if *angle {
                *x = wrapped(*x);
            }
        }
        // of the wrapped angles: a turn of a million radians is no size
        let size = work.size(self.equations, n, self.angles).max(first);
        put(self.unknowns, &work.x, variables);
        self.evaluator.values(variables, &mut work.r);
        let left = squares(&work.r).sqrt();
        let vanished = left <= VANISHED * size && self.evaluator.undefined(variables, false).is_none();
        Some((left, vanished))
    }

    /// How far `work.x` is from the start: angles in radians, others by their own size.
    fn distance(&self) -> f64 {
        let part = |((&x, &start), &angle): ((&f64, &f64), &bool)| match angle {
            true => wrapped(x - start),
            false if x == start => 0.0,
            false => (x - start) / x.abs().max(start.abs()),
        };
        squares_of(self.work.x.iter().zip(&self.start).zip(self.angles).map(part)).sqrt()
    }
}

impl Work {
    /// Solves for δ by QR of [J; √λ D] (Golub & Van Loan, Matrix Computations, 4th ed., §5.2.2).
    fn step(&mut self, m: usize, n: usize, damping: f64) {
        let rows = m + n;
        let matrix = &mut self.matrix;
        matrix.fill(0.0);
        for i in 0..m {
            for j in 0..n {
                matrix[j * rows + i] = self.jacobian[i * n + j];
            }
            matrix[n * rows + i] = -self.r[i];
        }
        for j in 0..n {
            matrix[j * rows + m + j] = damping.sqrt() * self.scale[j];
        }
        for k in 0..n {
            let (before, after) = matrix.split_at_mut((k + 1) * rows);
            let v = &mut before[k * rows + k..];
            let norm = squares(v).sqrt();
            if norm == 0.0 {
                continue;
            }
            let beta = -norm.copysign(v[0]);
            let first = v[0] - beta;
            let tau = -first / beta;
            for entry in &mut v[1..] {
                *entry /= first;
            }
            for column in after.chunks_mut(rows) {
                let column = &mut column[k..];
                let dot: f64 = column[0] + v[1..].iter().zip(&column[1..]).map(|(v, c)| v * c).sum::<f64>();
                column[0] -= tau * dot;
                for (c, v) in column[1..].iter_mut().zip(&v[1..]) {
                    *c -= tau * dot * v;
                }
            }
            v[0] = beta;
        }
        for k in (0..n).rev() {
            let known: f64 = (k + 1..n).map(|j| matrix[j * rows + k] * self.delta[j]).sum();
            let pivot = matrix[k * rows + k];
            let value = (matrix[n * rows + k] - known) / pivot;
            self.delta[k] = if value.is_finite() { value } else { 0.0 };
        }
    }

    /// No angle moves by more than half a turn at once: where a start is singular, δ can be of any length.
    fn shorten(&mut self, angles: &[bool]) {
        let turns = self.delta.iter().zip(angles).filter(|(_, angle)| **angle).map(|(delta, _)| delta.abs());
        let longest = turns.fold(0.0, f64::max);
        if longest > PI {
            self.delta.iter_mut().for_each(|delta| *delta *= PI / longest);
        }
    }

    /// The size of the terms that the residual is the difference of.
    fn size(&self, m: usize, n: usize, angles: &[bool]) -> f64 {
        let row = |i: usize| -> f64 {
            let size = |j: usize| self.x[j].abs().max(if angles[j] { 1.0 } else { 0.0 });
            (0..n).map(|j| self.jacobian[i * n + j].abs() * size(j)).sum()
        };
        squares_of((0..m).map(row)).sqrt()
    }
}

/// Multiples of 45° for the angles, nearest first; of more than two angles two at a time.
fn further(start: &[f64], angles: &[bool]) -> Vec<(f64, Vec<f64>)> {
    let turns: Vec<f64> = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0].iter().map(|i| i * FRAC_PI_4).collect();
    let all: Vec<usize> = (0..angles.len()).filter(|&j| angles[j]).collect();
    let mut offsets = Vec::new();
    for (i, &j) in all.iter().enumerate() {
        for &one in &turns {
            let mut offset = vec![0.0; start.len()];
            offset[j] = one;
            offsets.push(offset.clone());
            for &k in &all[i + 1..] {
                for &other in &turns {
                    offset[k] = other;
                    offsets.push(offset.clone());
                }
                offset[k] = 0.0;
            }
        }
    }
    let mut offsets: Vec<(f64, Vec<f64>)> =
        offsets.into_iter().map(|offset| (squares(&offset).sqrt(), offset)).collect();
    // stable, so that equally long ones stay in the order of their making
    offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
    // lengths and numbers, by their own size, where nothing else is left
    for j in (0..angles.len()).filter(|&j| !angles[j]) {
        let size = start[j].abs().max(1.0);
        for factor in [1.0, -1.0, 10.0, -10.0, 100.0, -100.0, 1000.0, -1000.0] {
            let mut offset = vec![0.0; start.len()];
            offset[j] = factor * size;
            offsets.push((f64::MAX, offset));
        }
    }
    offsets
}

fn put(unknowns: &[usize], values: &[f64], variables: &mut [f64]) {
    for (&unknown, &value) in unknowns.iter().zip(values) {
        variables[unknown] = value;
    }
}

/// Whether two points are nearly the same, in all angles and, by their size, in all else.
fn near(one: &[f64], other: &[f64], angles: &[bool]) -> bool {
    one.iter().zip(other).zip(angles).all(|((one, other), &angle)| match angle {
        true => wrapped(one - other).abs() < SAME,
        false => (one - other).abs() <= 1e-3 * one.abs().max(other.abs()),
    })
}

/// An angle in (−π, π].
fn wrapped(angle: f64) -> f64 {
    if angle > -PI && angle <= PI { angle } else { angle - ((angle - PI) / TAU).ceil() * TAU }
}

fn squares(all: &[f64]) -> f64 {
    squares_of(all.iter().copied())
}

fn squares_of(all: impl Iterator<Item = f64>) -> f64 {
    all.map(|x| x * x).sum()
}
