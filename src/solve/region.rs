//! The step within a trust region: min ‖R δ + d‖ with ‖D δ‖ ≤ Δ, and within bounds.
//!
//! In coordinates w = D δ, with M = R D⁻¹ = U diag(σ) Vᵀ and c = Uᵀd, the minimiser of ‖M w + d‖² + λ‖w‖² is
//!
//! ```text
//! w(λ) = −V diag(σ/(σ² + λ)) c,     ‖w(λ)‖² = Σ (σᵢcᵢ/(σᵢ² + λ))²                                 (1)
//! ```
//!
//! and λ ≥ 0 is such that ‖w‖ = Δ, or zero where the Gauss–Newton step is inside (Moré, "The Levenberg–Marquardt
//! algorithm: implementation and theory", Lecture Notes in Mathematics 630 (1978), §5). Singular values at rounding level
//! are left out of (1), so that a singular R is survived. Where (1) leaves the bounds, the minimiser of the damped system
//! within them takes its place; its length falls with λ too, so the same λ can be searched.

use super::conic::ConicStep;
use crate::linalg::{
    Bound, LinalgError, Matrix, Row, SquareRootInformation, Start, Svd, bounded_least_squares, dot, norm, svd,
};

/// ‖w‖ may exceed the trust radius by this share; solving (1) more finely gains nothing.
const RADIUS_SLACK: f64 = 0.01;

/// A linearisation as the step sees it.
pub(super) struct Linear<'a> {
    /// R, without what it sees of invisible directions.
    pub(super) visible: &'a Matrix,
    /// R itself.
    pub(super) information: &'a SquareRootInformation,
    /// Dimension of the invisible space.
    pub(super) invisible: usize,
    /// Bounds of δ.
    pub(super) lower: &'a [f64],
    /// Bounds of δ.
    pub(super) upper: &'a [f64],
    /// Constraints of δ, each met by δ = 0.
    pub(super) rows: &'a [Row],
}

/// A trial step.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) delta: Vec<f64>,
    /// ‖D δ‖.
    pub(super) norm: f64,
    /// λ.
    pub(super) damping: f64,
    /// Fall of the linear model's cost.
    pub(super) predicted: f64,
    /// Whether no trust region shortened it.
    pub(super) full: bool,
    pub(super) active: Vec<Bound>,
    /// The conic program it came from.
    pub(super) conic: Option<ConicStep>,
}

impl Step {
    /// No step, of n coordinates.
    pub(super) fn none(n: usize) -> Self {
        let active = vec![Bound::Free; n];
        Self { delta: vec![], norm: 0.0, damping: 0.0, predicted: 0.0, full: true, active, conic: None }
    }
}

/// The trust-region problem at one linearisation, for any Δ.
pub(super) struct Region<'a> {
    linear: Linear<'a>,
    diagonal: &'a [f64],
    m: Matrix,
    svd: Svd,
    c: Vec<f64>,
    kept: usize,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// The Gauss–Newton step, within bounds.
    pub(super) full: Step,
    /// ‖r‖.
    pub(super) residual: f64,
    /// Largest cosine between r and a column of J that may move.
    pub(super) cosine: f64,
}

impl<'a> Region<'a> {
    pub(super) fn new(linear: Linear<'a>, diagonal: &'a [f64]) -> Result<Self, LinalgError> {
        let n = diagonal.len();
        let inverse: Vec<f64> = diagonal.iter().map(|d| 1.0 / d).collect();
        let m = linear.visible.scale_columns(&inverse);
        let svd = svd(&m)?;
        let c = svd.u.transpose_mul_vec(linear.information.d());
        let negligible = n as f64 * f64::EPSILON * svd.sigma.first().copied().unwrap_or(0.0);
        let kept = svd.sigma.iter().take(n - linear.invisible.min(n)).filter(|&&sigma| sigma > negligible).count();
        let in_w = |bounds: &[f64]| bounds.iter().zip(diagonal).map(|(bound, d)| bound * d).collect();
        let (lower, upper) = (in_w(linear.lower), in_w(linear.upper));
        let residual = (2.0 * linear.information.cost()).sqrt();
        let full = Step::none(n);
        let mut region = Self { linear, diagonal, m, svd, c, kept, lower, upper, full, residual, cosine: 0.0 };
        region.cosine = largest_cosine(&region.linear, n, residual);
        region.full = region.damped(0.0)?;
        Ok(region)
    }

    /// The step for trust radius Δ.
    pub(super) fn step(&self, radius: f64) -> Result<Step, LinalgError> {
        if self.full.norm <= radius * (1.0 + RADIUS_SLACK) {
            return Ok(self.full.clone());
        }
        let step = self.damped(self.damping(radius))?;
        if step.norm <= radius * (1.0 + 2.0 * RADIUS_SLACK) && step.active.iter().all(|&bound| bound == Bound::Free) {
            return Ok(step);
        }
        // Bounds shorten the step: some λ between 0 and ‖Mᵀd‖/Δ, searched by halving its logarithm.
        let gradient = norm(&self.m.transpose_mul_vec(self.linear.information.d()));
        let mut high = gradient / radius;
        let mut low = high * 1e-18;
        let mut best = self.damped(high)?;
        for _ in 0..30 {
            let middle = (low * high).sqrt();
            let trial = self.damped(middle)?;
            if trial.norm > radius * (1.0 + RADIUS_SLACK) {
                low = middle;
            } else {
                let enough = trial.norm >= 0.9 * radius;
                (high, best) = (middle, trial);
                if enough {
                    break;
                }
            }
        }
        Ok(best)
    }

    /// λ with ‖w(λ)‖ = Δ by (1): Newton on 1/Δ − 1/‖w(λ)‖, nearly linear in λ, within a bracket.
    fn damping(&self, radius: f64) -> f64 {
        let terms = || self.svd.sigma.iter().zip(&self.c).take(self.kept);
        let gradient = norm(&terms().map(|(sigma, c)| sigma * c).collect::<Vec<_>>());
        let (mut low, mut high) = (0.0, gradient / radius);
        let mut lambda = 1e-3 * high;
        for _ in 0..60 {
            let length = norm(&terms().map(|(sigma, c)| sigma * c / (sigma * sigma + lambda)).collect::<Vec<_>>());
            if (length - radius).abs() <= 0.5 * RADIUS_SLACK * radius {
                break;
            }
            if length > radius {
                low = lambda
            } else {
                high = lambda
            }
            // −½ d‖w‖²/dλ / ‖w‖²
            let slope: f64 = terms()
                .map(|(sigma, c)| {
                    let share = sigma * c / (sigma * sigma + lambda) / length;
                    share * share / (sigma * sigma + lambda)
                })
                .sum();
            let newton = lambda + (length / radius - 1.0) / slope;
            let inside = newton > low && newton < high;
            lambda = if inside { newton } else { (low * high).sqrt().max(1e-3 * high) };
        }
        lambda
    }

    /// The minimiser for a given λ, within bounds.
    fn damped(&self, lambda: f64) -> Result<Step, LinalgError> {
        let n = self.diagonal.len();
        let mut w = vec![0.0; n];
        for k in 0..self.kept {
            let sigma = self.svd.sigma[k];
            let factor = -sigma * self.c[k] / (sigma * sigma + lambda);
            for (w_j, v_j) in w.iter_mut().zip(self.svd.v.column(k)) {
                *w_j += factor * v_j;
            }
        }
        let mut active = vec![Bound::Free; n];
        let outside = (0..n).any(|j| w[j] < self.lower[j] || w[j] > self.upper[j]);
        if outside {
            let mut damped = SquareRootInformation::from_rows(&self.m, self.linear.information.d())?;
            if lambda > 0.0 {
                let root = vec![lambda.sqrt(); n];
                damped.merge(&SquareRootInformation::from_rows(
                    &Matrix::identity(n).scale_columns(&root),
                    &vec![0.0; n],
                )?)?;
            }
            let start = Start { delta: vec![0.0; n], active: self.full.active.clone() };
            let solution = bounded_least_squares(damped.r(), damped.d(), &self.lower, &self.upper, Some(&start))?;
            (w, active) = (solution.delta, solution.active);
        }
        if w.iter().any(|w_j| !w_j.is_finite()) {
            return Err(LinalgError::NotFinite);
        }
        let delta = (0..n)
            .map(|j| match active[j] {
                Bound::Free => (w[j] / self.diagonal[j]).clamp(self.linear.lower[j], self.linear.upper[j]),
                Bound::Lower => self.linear.lower[j],
                Bound::Upper => self.linear.upper[j],
            })
            .collect();
        // ½‖d‖² − ½‖M w + d‖² = ½‖M w‖² + λ‖w‖² without bounds (Moré 1978, §4), −dᵀM w − ½‖M w‖² with them.
        let moved = self.m.mul_vec(&w);
        let squares = dot(&moved, &moved);
        let length = norm(&w);
        let predicted = if outside {
            -dot(&moved, self.linear.information.d()) - 0.5 * squares
        } else {
            0.5 * squares + lambda * length * length
        };
        Ok(Step { delta, norm: length, damping: lambda, predicted, full: lambda == 0.0, active, conic: None })
    }
}

/// max |Jⱼᵀr| / (‖Jⱼ‖‖r‖) over the coordinates that are visible and not held by a bound.
pub(super) fn largest_cosine(linear: &Linear<'_>, n: usize, residual: f64) -> f64 {
    /// A column of which projection leaves less than this share is invisible by itself.
    const INVISIBLE: f64 = 1e-12;
    let Linear { visible, information, lower, upper, .. } = linear;
    let mut largest = 0.0_f64;
    for j in 0..n {
        let column = visible.column(j);
        let length = norm(column);
        if residual == 0.0 || length <= INVISIBLE * norm(information.r().column(j)) {
            continue;
        }
        let cosine = dot(column, information.d()) / length / residual;
        let blocked = if cosine > 0.0 { lower[j] == 0.0 } else { upper[j] == 0.0 };
        if !blocked {
            largest = largest.max(cosine.abs());
        }
    }
    largest
}

/// R S (1 − N Nᵀ) S⁻¹: R without what it sees of the directions in N, S = diag(scale). They are zero but for noise in the
/// inputs, and what noise shows of them must not be followed.
pub(super) fn visible(information: &SquareRootInformation, invisible: &[Vec<f64>], scale: &[f64]) -> Matrix {
    let mut visible = information.r().clone();
    for z in invisible {
        let direction: Vec<f64> = z.iter().zip(scale).map(|(z, scale)| z * scale).collect();
        let seen = information.r().mul_vec(&direction);
        for j in 0..scale.len() {
            let factor = z[j] / scale[j];
            for (entry, seen) in visible.column_mut(j).iter_mut().zip(&seen) {
                *entry -= seen * factor;
            }
        }
    }
    visible
}

#[cfg(test)]
mod tests {
    use super::*;

    const INFINITE: [f64; 2] = [f64::INFINITY; 2];

    fn region<'a>(
        information: &'a SquareRootInformation,
        bounds: (&'a [f64], &'a [f64]),
        diagonal: &'a [f64],
    ) -> Region<'a> {
        let linear =
            Linear { visible: information.r(), information, invisible: 0, lower: bounds.0, upper: bounds.1, rows: &[] };
        Region::new(linear, diagonal).unwrap()
    }

    fn information() -> SquareRootInformation {
        let a = Matrix::from_rows(2, &[[1.0, 2.0], [0.5, -1.0], [3.0, 1.0]]);
        SquareRootInformation::from_rows(&a, &[4.0, -2.0, 1.0]).unwrap()
    }

    #[test]
    fn steps_are_as_long_as_the_radius_and_predict_their_own_cost() {
        let information = information();
        for diagonal in [[1.0, 1.0], [1e-6, 1e5]] {
            let free = INFINITE.map(|b| -b);
            let region = region(&information, (&free, &INFINITE), &diagonal);
            for share in [2.0, 0.9, 0.3, 1e-3, 1e-9] {
                let radius = share * region.full.norm;
                let step = region.step(radius).unwrap();
                let length = (step.delta[0] * diagonal[0]).hypot(step.delta[1] * diagonal[1]);
                assert!((length / step.norm - 1.0).abs() < 1e-12);
                let expected = radius.min(region.full.norm);
                assert!((length / expected - 1.0).abs() < RADIUS_SLACK, "{share} {length} {expected}");
                let fall = information.cost() - information.cost_at(&step.delta);
                assert!((fall - step.predicted).abs() < 1e-14 * information.cost() + 1e-9 * fall);
            }
        }
    }

    #[test]
    fn bounds_are_met_exactly() {
        let information = information();
        let (lower, upper) = ([-0.1, -0.2], [0.1, f64::INFINITY]);
        let region = region(&information, (&lower, &upper), &[0.7, 1.3]);
        for radius in [10.0, 0.2, 0.1] {
            let step = region.step(radius).unwrap();
            assert!((0..2).all(|j| lower[j] <= step.delta[j] && step.delta[j] <= upper[j]));
            assert!(step.norm <= radius * 1.02 && step.norm > 0.0);
        }
        assert_eq!(region.full.delta[1], -0.2);
    }

    #[test]
    fn what_is_projected_out_is_not_followed() {
        let information = information();
        let z = vec![0.6, 0.8];
        let scale = [2.0, 0.5];
        let matrix = visible(&information, &[z], &scale);
        let seen = matrix.mul_vec(&[0.6 * 2.0, 0.8 * 0.5]);
        assert!(norm(&seen) < 1e-15);
        let across = [0.8 * 2.0, -0.6 * 0.5];
        for (a, b) in matrix.mul_vec(&across).iter().zip(information.r().mul_vec(&across)) {
            assert!((a - b).abs() < 1e-14);
        }
    }
}
