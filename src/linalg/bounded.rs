//! Least squares within a box, solved exactly by an active-set loop.
//!
//! ```text
//! minimise ½‖A δ + d‖²   subject to   lower ≤ δ ≤ upper
//! ```
//!
//! The loop is that of Stark & Parker, "Bounded-variable least-squares: an algorithm and applications", Computational
//! Statistics 10 (1995): some coordinates are *active*, held on a bound; the others are *free*. Minimise over the free
//! ones; if that leaves the box, stop at the first bound and make it active; otherwise free the active coordinate whose
//! multiplier has the wrong sign and weighs most; when there is none, the Karush–Kuhn–Tucker conditions hold,
//!
//! ```text
//! gⱼ = (Aᵀ(A δ + d))ⱼ   is   0 where free,   ≥ 0 on a lower bound,   ≤ 0 on an upper bound,       (1)
//! ```
//!
//! and for a convex problem they are sufficient. The cost falls with every step that moves, so no active set comes twice;
//! where a step cannot move (a corner where several bounds meet, or a multiplier that is rounding), a coordinate that had
//! to be taken back is not tried again before something has moved. The result says how well (1) holds, from δ itself.

use super::matrix::add_scaled;
use super::{
    LinalgError, Matrix, SquareRootInformation, dot, norm, orthonormalise, reciprocal_condition, same_size,
    solve_upper, svd,
};

/// Where a coordinate is with respect to its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bound {
    /// Between its bounds.
    #[default]
    Free,
    /// On its lower bound.
    Lower,
    /// On its upper bound.
    Upper,
}

/// Where the active-set loop starts, when something better is known than δ = 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// A point; it is moved into the box.
    pub delta: Vec<f64>,
    /// Coordinates that start on a bound.
    pub active: Vec<Bound>,
}

/// What [`bounded_least_squares`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundedSolution {
    /// The minimiser; an active coordinate is exactly its bound.
    pub delta: Vec<f64>,
    /// Which coordinates are held on a bound.
    pub active: Vec<Bound>,
    /// gⱼ of (1) where active (how fast the cost falls when the bound is moved outwards), 0 where free.
    pub multipliers: Vec<f64>,
    /// By how much (1) fails at worst, as a share of ‖Aⱼ‖(‖d‖ + Σₖ‖Aₖ‖|δₖ|).
    pub violation: f64,
    /// Whether (1) holds to rounding. False says that the loop ended without it: δ is in the box and the best point seen.
    pub settled: bool,
    /// Least-squares problems solved.
    pub iterations: usize,
}

/// A violation of (1) up to this is rounding; a QR solution is good for a few n ε.
const SETTLED: f64 = 1e-12;

/// Solves min ½‖A δ + d‖² within lower ≤ δ ≤ upper, to rounding. Where A does not determine the free coordinates, every
/// step is the shortest one, so a direction that A does not see is left where the start has it.
///
/// # Errors
/// Where sizes differ, an entry is not finite, or bounds leave nothing between them. A bound may be infinite.
pub fn bounded_least_squares(
    a: &Matrix,
    d: &[f64],
    lower: &[f64],
    upper: &[f64],
    start: Option<&Start>,
) -> Result<BoundedSolution, LinalgError> {
    let n = a.columns();
    same_size(a.rows(), d.len())?;
    same_size(n, lower.len())?;
    same_size(n, upper.len())?;
    if !a.is_finite() || d.iter().any(|entry| !entry.is_finite()) {
        return Err(LinalgError::NotFinite);
    }
    for j in 0..n {
        // Written so that a NaN fails too.
        let sensible = lower[j] <= upper[j] && lower[j] < f64::INFINITY && upper[j] > f64::NEG_INFINITY;
        if !sensible {
            return Err(LinalgError::EmptyBox(j));
        }
    }
    let mut search = ActiveSet { a, d, lower, upper, norms: a.column_norms(), delta: vec![0.0; n], active: vec![] };
    search.begin(start)?;
    search.run()
}

struct ActiveSet<'a> {
    a: &'a Matrix,
    d: &'a [f64],
    lower: &'a [f64],
    upper: &'a [f64],
    norms: Vec<f64>,
    delta: Vec<f64>,
    active: Vec<Bound>,
}

impl ActiveSet<'_> {
    fn begin(&mut self, start: Option<&Start>) -> Result<(), LinalgError> {
        let n = self.delta.len();
        self.active = vec![Bound::Free; n];
        if let Some(start) = start {
            same_size(n, start.delta.len())?;
            same_size(n, start.active.len())?;
            if start.delta.iter().any(|entry| !entry.is_finite()) {
                return Err(LinalgError::NotFinite);
            }
            self.delta.copy_from_slice(&start.delta);
            self.active.copy_from_slice(&start.active);
        }
        for j in 0..n {
            let (lower, upper) = (self.lower[j], self.upper[j]);
            self.delta[j] = self.delta[j].clamp(lower, upper);
            match self.active[j] {
                _ if lower == upper => self.hold(j, Bound::Lower),
                Bound::Lower if lower.is_finite() => self.hold(j, Bound::Lower),
                Bound::Upper if upper.is_finite() => self.hold(j, Bound::Upper),
                _ => self.active[j] = Bound::Free,
            }
        }
        Ok(())
    }

    fn hold(&mut self, j: usize, bound: Bound) {
        self.active[j] = bound;
        self.delta[j] = if bound == Bound::Upper { self.upper[j] } else { self.lower[j] };
    }

    fn run(mut self) -> Result<BoundedSolution, LinalgError> {
        let n = self.delta.len();
        let cap = 50 * (n + 1);
        // Freed, or taken back after being freed, since something last moved.
        let (mut freed, mut barred) = (vec![false; n], vec![false; n]);
        let mut iterations = 0;
        while iterations < cap {
            iterations += 1;
            let residual = self.residual();
            let step = self.free_step(&residual)?;
            let (alpha, blocking) = self.first_bound(&step);
            let before = self.delta.clone();
            for (j, step_j) in step.iter().enumerate() {
                if self.active[j] == Bound::Free {
                    self.delta[j] = (self.delta[j] + alpha * step_j).clamp(self.lower[j], self.upper[j]);
                }
            }
            if self.has_moved(&before) {
                freed.fill(false);
                barred.fill(false);
            }
            if let Some((j, bound)) = blocking {
                self.hold(j, bound);
                barred[j] = freed[j];
                continue;
            }
            // A minimiser over the free coordinates: which active one should be freed?
            let multipliers = self.gradient();
            let worst = (0..n)
                .filter(|&j| !barred[j] && self.wrong_side(j, multipliers[j]) > f64::EPSILON * (8 + n) as f64)
                .max_by(|&i, &j| self.wrong_side(i, multipliers[i]).total_cmp(&self.wrong_side(j, multipliers[j])));
            match worst {
                Some(j) => {
                    self.active[j] = Bound::Free;
                    freed[j] = true;
                }
                None => break,
            }
        }
        let gradient = self.gradient();
        let violation = (0..n).fold(0.0_f64, |worst, j| worst.max(self.wrong_side(j, gradient[j])));
        let multipliers = (0..n).map(|j| if self.active[j] == Bound::Free { 0.0 } else { gradient[j] }).collect();
        Ok(BoundedSolution {
            delta: self.delta,
            active: self.active,
            multipliers,
            violation,
            settled: violation <= SETTLED,
            iterations,
        })
    }

    /// Whether δ differs from `before` by more than rounding of A δ + d.
    fn has_moved(&self, before: &[f64]) -> bool {
        let rounding = f64::EPSILON * self.terms();
        (0..before.len()).any(|j| (self.delta[j] - before[j]).abs() * self.norms[j] > rounding)
    }

    /// ‖d‖ + Σₖ‖Aₖ‖|δₖ|: what A δ + d could add up to.
    fn terms(&self) -> f64 {
        norm(self.d) + self.delta.iter().zip(&self.norms).map(|(x, norm)| x.abs() * norm).sum::<f64>()
    }

    /// A δ + d.
    fn residual(&self) -> Vec<f64> {
        let mut residual = self.a.mul_vec(&self.delta);
        add_scaled(&mut residual, 1.0, self.d);
        residual
    }

    /// Aᵀ(A δ + d).
    fn gradient(&self) -> Vec<f64> {
        self.a.transpose_mul_vec(&self.residual())
    }

    /// How much gⱼ breaks (1), as a share of what its terms could add up to.
    fn wrong_side(&self, j: usize, g: f64) -> f64 {
        let wrong = match self.active[j] {
            Bound::Free => g.abs(),
            _ if self.lower[j] == self.upper[j] => 0.0,
            Bound::Lower => (-g).max(0.0),
            Bound::Upper => g.max(0.0),
        };
        if wrong == 0.0 {
            return 0.0;
        }
        wrong / (self.norms[j] * self.terms())
    }

    /// How far along `step` the box lets us go, at most 1, and which bound stops us.
    fn first_bound(&self, step: &[f64]) -> (f64, Option<(usize, Bound)>) {
        let (mut alpha, mut blocking) = (1.0, None);
        for (j, &step_j) in step.iter().enumerate() {
            if self.active[j] != Bound::Free || step_j == 0.0 {
                continue;
            }
            let (bound, room) = if step_j < 0.0 {
                (Bound::Lower, self.lower[j] - self.delta[j])
            } else {
                (Bound::Upper, self.upper[j] - self.delta[j])
            };
            let reach = room / step_j;
            if reach < alpha {
                (alpha, blocking) = (reach.max(0.0), Some((j, bound)));
            }
        }
        (alpha, blocking)
    }

    /// The shortest s over the free coordinates that minimises ‖A s + residual‖.
    fn free_step(&self, residual: &[f64]) -> Result<Vec<f64>, LinalgError> {
        let free: Vec<usize> =
            (0..self.delta.len()).filter(|&j| self.active[j] == Bound::Free && self.norms[j] > 0.0).collect();
        let p = free.len();
        let mut step = vec![0.0; self.delta.len()];
        if p == 0 {
            return Ok(step);
        }
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(p + 1);
        columns.extend(free.iter().map(|&j| self.a.column(j).iter().map(|entry| entry / self.norms[j]).collect()));
        columns.push(residual.to_vec());
        let mut information = SquareRootInformation::new(p);
        information.absorb(&mut Matrix::from_columns(residual.len(), &columns))?;
        let norms: Vec<f64> = free.iter().map(|&j| self.norms[j]).collect();
        let solution = shortest(&information, &norms)?;
        for (&j, s) in free.iter().zip(solution) {
            step[j] = s;
        }
        Ok(step)
    }
}

/// The shortest s that minimises ‖R C s + d‖, where C = diag(norms) and R has unit columns.
fn shortest(information: &SquareRootInformation, norms: &[f64]) -> Result<Vec<f64>, LinalgError> {
    let p = norms.len();
    // Singular values below this share of the largest are rounding of the columns.
    let negligible = 10.0 * p as f64 * f64::EPSILON;
    let negative: Vec<f64> = information.d().iter().map(|d| -d).collect();
    if reciprocal_condition(information.r()) > negligible {
        let x = solve_upper(information.r(), &negative)?;
        return Ok(x.iter().zip(norms).map(|(x, norm)| x / norm).collect());
    }
    let decomposition = svd(information.r())?;
    let (mut step, mut unseen) = (vec![0.0; p], Vec::new());
    for (k, &sigma) in decomposition.sigma.iter().enumerate() {
        let v: Vec<f64> = decomposition.v.column(k).iter().zip(norms).map(|(v, norm)| v / norm).collect();
        if sigma > negligible * decomposition.sigma[0] {
            add_scaled(&mut step, dot(decomposition.u.column(k), &negative) / sigma, &v);
        } else {
            unseen.push(v);
        }
    }
    // Shortest in x = C s; the part along what is unseen makes it longer than need be in s.
    orthonormalise(&mut unseen);
    for v in &unseen {
        let along = dot(v, &step);
        add_scaled(&mut step, -along, v);
    }
    Ok(step)
}

#[cfg(test)]
mod tests;
