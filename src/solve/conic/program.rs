//! The conic program of one linearisation, and its exact solution.
//!
//! Clarabel sees whitened variables: with M = U diag(σ) Vᵀ it is y = diag(σ̃) Vᵀ w, σ̃² = σ² + κ + φ², so that the cost is
//! ½‖y‖² + qᵀy. A small φ keeps what is hardly seen finite; it only blurs the active set, which the exact loop puts right.
//! Where the trust region holds, its multiplier z₀ says with which damping λ = κ + φ² + z₀/Δ
//!
//! ```text
//! minimise ½‖M w + d‖² + ½λ‖w‖²   within bounds and constraints                                           (1)
//! ```
//!
//! has the same solution, and (1) is solved exactly. Where Clarabel fails, λ is searched by halving its logarithm.
//!
//! κ ≥ 0 is the curvature of the constraints: a step along a curved constraint ends beside it, and what the way back costs
//! is ½κ‖w‖², with κ measured at the last trial. It stands for the part Σ μᵢ∇²gᵢ of the Lagrangian's second derivative,
//! without which Gauss–Newton steps on a strongly bent constraint overshoot for ever.

use super::answer::{Answer, Cone, ConicProgram, ConicStatus, ConicStep};
use crate::linalg::{
    Bound, Conditions, ConstrainedStart, LinalgError, Matrix, Row, SquareRootInformation, Svd,
    constrained_least_squares, norm, svd,
};
use crate::solve::Restriction;
use crate::solve::region::{Linear, Step, largest_cosine};

/// ‖w‖ may exceed the trust radius by this share.
const RADIUS_SLACK: f64 = 0.01;

/// Clarabel's gap; finer than it reaches in general.
const TOLERANCE: f64 = 1e-13;

pub(in crate::solve) struct Program<'a> {
    linear: Linear<'a>,
    diagonal: &'a [f64],
    svd: Svd,
    c: Vec<f64>,
    /// R and d of M without what is rounding in it.
    information: SquareRootInformation,
    /// In w.
    lower: Vec<f64>,
    upper: Vec<f64>,
    rows: Vec<Row>,
    curvature: f64,
    pub(in crate::solve) full: Step,
    pub(in crate::solve) residual: f64,
    pub(in crate::solve) cosine: f64,
    pub(in crate::solve) fall: f64,
}

/// What Clarabel says of (1): a start, and λ.
struct Hint {
    start: Option<ConstrainedStart>,
    damping: f64,
    status: ConicStatus,
    iterations: usize,
}

impl<'a> Program<'a> {
    pub(in crate::solve) fn new(linear: Linear<'a>, diagonal: &'a [f64], curvature: f64) -> Result<Self, LinalgError> {
        let n = diagonal.len();
        let inverse: Vec<f64> = diagonal.iter().map(|d| 1.0 / d).collect();
        let svd = svd(&linear.visible.scale_columns(&inverse))?;
        let mut c = svd.u.transpose_mul_vec(linear.information.d());
        let largest = svd.sigma.first().copied().unwrap_or(0.0);
        let negligible = n as f64 * f64::EPSILON * largest;
        let kept = svd.sigma.iter().take(n - linear.invisible.min(n)).filter(|&&sigma| sigma > negligible).count();
        c.truncate(kept);
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let column: Vec<f64> = (0..kept).map(|k| svd.sigma[k] * svd.v[(j, k)]).collect();
                // a column that is rounding would be taken for a direction
                if norm(&column) > negligible { column } else { vec![0.0; kept] }
            })
            .collect();
        let information = SquareRootInformation::from_rows(&Matrix::from_columns(kept, &columns), &c)?;
        let in_w = |bounds: &[f64]| bounds.iter().zip(diagonal).map(|(bound, d)| bound * d).collect();
        let scaled = |row: &Row| Row {
            coefficients: row.coefficients.iter().zip(diagonal).map(|(a, d)| a / d).collect(),
            right: row.right,
            equal: row.equal,
        };
        let residual = (2.0 * linear.information.cost()).sqrt();
        let mut program = Self {
            lower: in_w(linear.lower),
            upper: in_w(linear.upper),
            rows: linear.rows.iter().map(scaled).collect(),
            diagonal,
            svd,
            c,
            information,
            curvature,
            full: Step::none(n),
            residual,
            cosine: 0.0,
            fall: 0.0,
            linear,
        };
        program.full = program.solved(None)?;
        program.full.full = true;
        program.fall = match curvature > 0.0 {
            true => program.exact(0.0, None, None)?.predicted,
            false => program.full.predicted,
        };
        program.cosine = match (program.rows.is_empty(), residual > 0.0) {
            (true, _) => largest_cosine(&program.linear, diagonal.len(), residual),
            (_, true) => (2.0 * program.fall.max(0.0)).sqrt() / residual,
            (_, false) => 0.0,
        };
        Ok(program)
    }

    /// The step for trust radius Δ.
    pub(in crate::solve) fn step(&self, radius: f64) -> Result<Step, LinalgError> {
        if self.full.norm <= radius * (1.0 + RADIUS_SLACK) { Ok(self.full.clone()) } else { self.solved(Some(radius)) }
    }

    /// Clarabel's solution made exact, without or with a trust region.
    fn solved(&self, radius: Option<f64>) -> Result<Step, LinalgError> {
        let hint = self.hint(radius);
        let Some(radius) = radius else {
            return self.exact(self.curvature, hint.start.as_ref(), Some(&hint));
        };
        if hint.start.is_some() {
            let step = self.exact(hint.damping, hint.start.as_ref(), Some(&hint))?;
            if step.norm <= radius * (1.0 + 2.0 * RADIUS_SLACK) && step.norm >= 0.5 * radius {
                return Ok(step);
            }
        }
        let gradient = norm(&self.information.gradient());
        let mut high = self.curvature + gradient / radius;
        let mut low = high * 1e-18 + self.curvature;
        let mut best = self.exact(high, None, Some(&hint))?;
        for _ in 0..40 {
            if best.norm >= 0.9 * radius {
                break;
            }
            let middle = (low * high).sqrt();
            let trial = self.exact(middle, None, Some(&hint))?;
            if trial.norm > radius * (1.0 + RADIUS_SLACK) {
                low = middle;
            } else {
                (high, best) = (middle, trial);
            }
        }
        Ok(best)
    }

    /// (1) solved exactly.
    fn exact(&self, damping: f64, start: Option<&ConstrainedStart>, hint: Option<&Hint>) -> Result<Step, LinalgError> {
        let n = self.diagonal.len();
        let conditions = Conditions { lower: &self.lower, upper: &self.upper, rows: &self.rows };
        let mut information = self.information.clone();
        if damping > 0.0 {
            let root = Matrix::identity(n).scale_columns(&vec![damping.sqrt(); n]);
            information.merge(&SquareRootInformation::from_rows(&root, &vec![0.0; n])?)?;
        }
        let solve = |start| constrained_least_squares(information.r(), information.d(), &conditions, start);
        // No step at all meets every condition: where the hint leads astray, the loop begins there.
        let rest =
            ConstrainedStart { delta: vec![0.0; n], active: vec![Bound::Free; n], rows: vec![false; self.rows.len()] };
        let found = match start.map(|start| solve(Some(start))) {
            Some(Ok(found)) if found.settled => found,
            _ => solve(Some(&rest))?,
        };
        let w = &found.delta;
        let delta: Vec<f64> = (0..n)
            .map(|j| match found.active[j] {
                Bound::Free => (w[j] / self.diagonal[j]).clamp(self.linear.lower[j], self.linear.upper[j]),
                Bound::Lower => self.linear.lower[j],
                Bound::Upper => self.linear.upper[j],
            })
            .collect();
        if delta.iter().any(|delta| !delta.is_finite()) {
            return Err(LinalgError::NotFinite);
        }
        // −dᵀM w − ½‖M w‖² − ½κ‖w‖², by the Karush–Kuhn–Tucker conditions of (1): a sum of what is not negative.
        let moved = norm(&self.information.r().mul_vec(w));
        let length = norm(w);
        let held: f64 = found.bound_multipliers.iter().zip(w).map(|(nu, w)| -nu * w).sum();
        let pressed: f64 = found.row_multipliers.iter().zip(&self.rows).map(|(mu, row)| mu * row.right).sum();
        let bent = damping - 0.5 * self.curvature.min(damping);
        let predicted = 0.5 * moved * moved + bent * length * length + held + pressed;
        let mut active = Vec::new();
        for j in 0..n {
            let nu = found.bound_multipliers[j] * self.diagonal[j];
            match found.active[j] {
                Bound::Free => {}
                Bound::Lower => active.push((Restriction::Lower(j), nu)),
                Bound::Upper => active.push((Restriction::Upper(j), nu)),
            }
        }
        for (i, &mu) in found.row_multipliers.iter().enumerate().filter(|(i, _)| found.rows[*i]) {
            active.push((Restriction::Constraint(i), mu));
        }
        let conic = hint.map(|hint| ConicStep { status: hint.status, iterations: hint.iterations, active });
        Ok(Step { delta, norm: length, damping, predicted, full: false, active: found.active, conic })
    }

    /// Clarabel's answer to the program of this linearisation.
    fn hint(&self, radius: Option<f64>) -> Hint {
        /// φ as a share of the largest σ.
        const BLUR: f64 = 1e-6;
        let n = self.diagonal.len();
        let largest = self.svd.sigma.first().copied().unwrap_or(0.0);
        let blur = if largest > 0.0 { (BLUR * largest).powi(2) } else { 1.0 };
        let white: Vec<f64> = (0..n).map(|k| (self.svd.sigma[k].powi(2) + self.curvature + blur).sqrt()).collect();
        let mut q: Vec<f64> = (0..n).map(|k| self.c.get(k).map_or(0.0, |c| self.svd.sigma[k] * c / white[k])).collect();
        let unit = norm(&q);
        let unit = if unit > 0.0 { unit } else { 1.0 };
        q.iter_mut().for_each(|q| *q /= unit);
        let mut program = ConicProgram::new(vec![1.0; n], q);
        // w = V diag(1/σ̃) y: a row over w as a row over y.
        let over_y = |a: &[f64]| -> Vec<f64> {
            let along = self.svd.v.transpose_mul_vec(a);
            along.iter().zip(&white).map(|(along, white)| along / white).collect()
        };
        let unit_row = |j: usize, sign: f64| {
            let mut row = vec![0.0; n];
            row[j] = sign;
            row
        };
        // Everything one-sided: its cone, its row over w and its right side, and what it stands for.
        let mut one_sided: Vec<(Cone, Vec<f64>, f64, Restriction)> = Vec::new();
        for (i, row) in self.rows.iter().enumerate() {
            let cone = if row.equal { Cone::Zero } else { Cone::NonNegative };
            one_sided.push((cone, row.coefficients.clone(), row.right, Restriction::Constraint(i)));
        }
        for j in 0..n {
            let (lower, upper) = (self.lower[j], self.upper[j]);
            if lower == upper {
                one_sided.push((Cone::Zero, unit_row(j, 1.0), upper, Restriction::Lower(j)));
                continue;
            }
            if upper.is_finite() {
                one_sided.push((Cone::NonNegative, unit_row(j, 1.0), upper, Restriction::Upper(j)));
            }
            if lower.is_finite() {
                one_sided.push((Cone::NonNegative, unit_row(j, -1.0), -lower, Restriction::Lower(j)));
            }
        }
        let mut places = Vec::new();
        for (cone, row, right, what) in one_sided {
            let row = over_y(&row);
            let length = norm(&row);
            if length > 0.0 {
                let entries = row.into_iter().map(|entry| entry / length).enumerate();
                places.push((program.row(cone, entries, right / length / unit), cone, what));
            }
        }
        let ball = radius.map(|radius| {
            let mut rows = vec![(vec![], radius / unit)];
            rows.extend((0..n).map(|j| (over_y(&unit_row(j, -1.0)).into_iter().enumerate().collect(), 0.0)));
            program.second_order(rows)
        });
        let Answer { status, iterations, x, s, z } = program.solve(TOLERANCE);
        let mut hint = Hint { start: None, damping: 0.0, status, iterations };
        if !status.solved() {
            return hint;
        }
        hint.damping = self.curvature;
        if let (Some(ball), Some(radius)) = (ball, radius) {
            hint.damping += blur + (z[ball] * unit / radius).max(0.0);
        }
        let y: Vec<f64> = x.iter().zip(&white).map(|(y, white)| y * unit / white).collect();
        let mut start = ConstrainedStart {
            delta: self.svd.v.mul_vec(&y),
            active: vec![Bound::Free; n],
            rows: vec![false; self.rows.len()],
        };
        for (place, cone, what) in places {
            let on = cone == Cone::Zero || z[place] > s[place];
            match what {
                Restriction::Constraint(i) => start.rows[i] = on,
                Restriction::Lower(j) if on => start.active[j] = Bound::Lower,
                Restriction::Upper(j) if on => start.active[j] = Bound::Upper,
                _ => {}
            }
        }
        hint.start = Some(start);
        hint
    }
}
