//! What a search hands back.

use super::minimise::Search;
use super::multipliers::{Multipliers, multipliers};
use super::solution::{Datum, Solution, Status};
use super::state::State;
use super::{Constraint, LeastSquares};

impl<L: LeastSquares> Search<'_, L> {
    pub(super) fn conclude(
        self,
        state: State<L::Point>,
        status: Status,
        datum: Datum,
        projected: bool,
    ) -> Solution<L::Point> {
        let active: Vec<_> = (0..self.problem.dimension()).map(|j| state.on_bound(j)).collect();
        let constraints: Vec<(Constraint, bool)> = state.constraints.iter().cloned().zip(state.held()).collect();
        let gradient = state.visible.transpose_mul_vec(state.information.d());
        let lengths = lengths(&state.information.r().column_norms(), self.problem.scale());
        let residual = (2.0 * state.information.cost()).sqrt();
        let held = multipliers(&gradient, &lengths, residual, &active, constraints).unwrap_or(Multipliers {
            bounds: vec![f64::NAN; active.len()],
            constraints: vec![],
            kkt: f64::NAN,
        });
        Solution {
            point: state.point,
            status,
            cost: state.cost,
            iterations: self.iteration,
            trace: self.trace,
            information: state.information,
            invisible: state.invisible,
            datum,
            active,
            projected,
            multipliers: held.bounds,
            constraints: held.constraints,
            kkt: held.kkt,
            evaluations: self.evaluations,
        }
    }
}

/// The lengths of columns; a column that is zero is as long as the longest, in tolerances.
pub(super) fn lengths(norms: &[f64], scale: &[f64]) -> Vec<f64> {
    let longest = norms.iter().zip(scale).fold(0.0_f64, |longest, (norm, scale)| longest.max(norm * scale));
    let longest = if longest > 0.0 { longest } else { 1.0 };
    let pick = |(&norm, scale): (&f64, &f64)| if norm > 0.0 { norm } else { longest / scale };
    norms.iter().zip(scale).map(pick).collect()
}
