//! Candidates of a model: their rows at consistent inputs, in the directions that they see together.

use super::experiment::Experiment;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Held, NOT_ESTIMABLE};
use crate::identify::{At, Direction, Probe};
use crate::linalg::{LinalgError, SquareRootInformation, dot, norm, orthonormalise};
use crate::problem::{Problem, Rows, Undefined};
use crate::solve::{LeastSquares, null_space};

/// A quantity whose tolerance-scaled gradient has a larger share than this along what is invisible depends on it.
const DEPENDS: f64 = 1e-6;

/// What can be chosen from, at the start of a problem.
#[derive(Clone, Debug)]
pub(super) struct Setup<'a> {
    /// Rows at consistent inputs, without losses.
    pub(super) problem: Problem<'a>,
    pub(super) left_out: usize,
    /// By candidate: its block, its row there, and its row among those that there were.
    pub(super) origin: Vec<(usize, usize, usize)>,
    /// Columns of S B: a movement δ of the free coordinates by one unit of each coordinate of the experiment.
    pub(super) basis: Vec<Vec<f64>>,
    /// Orthonormal, in tolerances.
    pub(super) invisible: Vec<Vec<f64>>,
    pub(super) experiment: Experiment,
}

pub(super) fn stop(error: LinalgError) -> Diagnostics {
    Diagnostics::from(*Undefined::from(error).0)
}

impl<'a> Setup<'a> {
    pub(super) fn new(probe: &Probe<'a>) -> Result<Setup<'a>, Diagnostics> {
        let undefined = |Undefined(found): Undefined| Diagnostics::from(*found);
        let (like, _) = probe.bound()?;
        let At { problem, left_out, kept } =
            probe.at(&like, &like.start, 0).map_err(|found| Diagnostics::from(*found))?;
        let problem = problem.without_loss();
        let (q, scale) = (problem.start.clone(), problem.scale().to_vec());
        let n = problem.free.len();
        let seen = problem.at_consistent_inputs(&q, Rows::All).map_err(undefined)?;
        let seen = problem.with_equations(problem.with_priors(seen, &q).map_err(undefined)?, &q).map_err(undefined)?;
        let invisible = null_space(&seen, &scale).map_err(stop)?.basis;
        let held = Held::by_equations(&problem, &q).map_err(undefined)?;
        let basis = basis(&scale, &invisible, &held);

        let onto = |row: &[f64]| basis.iter().map(|column| dot(row, column)).collect::<Vec<f64>>();
        let (mut blocks, mut origin) = (Vec::new(), Vec::new());
        let mut row = vec![0.0; n];
        problem
            .inspect(&q, |seen| {
                let width = seen.columns.len();
                let mut rows = Vec::new();
                for equation in seen.derivatives.chunks(width.max(1)) {
                    row.fill(0.0);
                    seen.columns.iter().zip(equation).for_each(|(&column, value)| row[column] += value);
                    rows.extend(onto(&row));
                }
                blocks.push(rows);
                origin.push((seen.block, seen.row, kept[seen.block][seen.row]));
            })
            .map_err(undefined)?;
        let priors = problem.with_priors(SquareRootInformation::new(n), &q).map_err(undefined)?;
        let prior_row = |i: usize| (0..n).map(|j| if j >= i { priors.r()[(i, j)] } else { 0.0 }).collect::<Vec<f64>>();
        let prior: Vec<f64> = (0..n).map(prior_row).filter(|row| norm(row) > 0.0).flat_map(|row| onto(&row)).collect();
        if basis.is_empty() {
            let found = Diagnostic::error(Code::TargetUnseen, "nothing is free that the candidates could tell of");
            return Err(found.hint("free a parameter with `--free`").into());
        }
        let experiment = Experiment::new(basis.len(), &blocks, &prior, &problem.execution).map_err(stop)?;
        Ok(Setup { problem, left_out, origin, basis, invisible, experiment })
    }

    /// A gradient by the free coordinates as one by those of the experiment.
    pub(super) fn onto(&self, gradient: &[f64]) -> Vec<f64> {
        self.basis.iter().map(|column| dot(gradient, column)).collect()
    }

    /// The gradient of each free coordinate in its tolerances, row by row.
    pub(super) fn in_tolerances(&self) -> Vec<f64> {
        let scale = self.problem.scale();
        (0..scale.len()).flat_map(|j| self.basis.iter().map(move |column| column[j] / scale[j])).collect()
    }

    /// Whether each free coordinate can be told at all.
    pub(super) fn estimable(&self) -> Vec<bool> {
        let share = |j: usize| self.invisible.iter().map(|z| z[j] * z[j]).sum::<f64>();
        (0..self.problem.free.len()).map(|j| share(j) <= NOT_ESTIMABLE).collect()
    }

    /// The direction that a quantity with this gradient changes along and that no candidate sees, in words.
    pub(super) fn blind(&self, gradient: &[f64]) -> Option<String> {
        let seen: Vec<f64> = gradient.iter().zip(self.problem.scale()).map(|(g, s)| g * s).collect();
        let along: Vec<f64> = self.invisible.iter().map(|z| dot(z, &seen)).collect();
        if norm(&along) <= DEPENDS * norm(&seen) {
            return None;
        }
        let mut direction = vec![0.0; seen.len()];
        for (weight, z) in along.iter().zip(&self.invisible) {
            direction.iter_mut().zip(z).for_each(|(x, z)| *x += weight / norm(&along) * z);
        }
        let largest = direction.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() + 1e-9 { b } else { a });
        direction.iter_mut().for_each(|x| *x *= largest.signum());
        Some(Direction::new(&self.problem, &direction).sentence)
    }

    /// The first direction that no candidate sees, in words.
    pub(super) fn first_blind(&self) -> Option<String> {
        let first = crate::linalg::sparsest(&self.invisible).into_iter().next()?;
        Some(Direction::new(&self.problem, &first).sentence)
    }
}

/// Movements of the free coordinates that are visible and keep the equations; as in the covariance of a fit.
fn basis(scale: &[f64], invisible: &[Vec<f64>], held: &Held) -> Vec<Vec<f64>> {
    let n = scale.len();
    let unit = |j: usize| (0..n).map(|k| if k == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    let scaled = |z: &[f64]| z.iter().zip(scale).map(|(z, s)| z * s).collect::<Vec<f64>>();
    if invisible.is_empty() && held.gradients.is_empty() {
        return (0..n).map(|j| scaled(&unit(j))).collect();
    }
    let mut hidden = invisible.to_vec();
    hidden.extend(held.gradients.iter().map(|gradient| scaled(gradient)));
    orthonormalise(&mut hidden);
    let fixed = hidden.len();
    hidden.extend((0..n).map(unit));
    orthonormalise(&mut hidden);
    hidden[fixed..].iter().map(|z| scaled(z)).collect()
}
