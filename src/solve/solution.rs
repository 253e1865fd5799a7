//! What a solver hands back: always a point, a status that names the test that fired, and the trace of every trial.

use super::Relation;
use super::conic::ConicStep;
use crate::linalg::{Bound, SquareRootInformation};
use std::fmt;

/// Which test ended the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Converged: the residual is perpendicular to all that the parameters can do.
    Gradient,
    /// Converged: a full Gauss–Newton step moves no coordinate beyond rounding.
    Step,
    /// Converged: the gradient is so small that the cost, computed to rounding, can no longer show a reduction.
    Cost,
    /// Converged: nothing is left of the residual, or only rounding of the parameters.
    NothingLeft,
    /// Failed: the limit of trial steps was reached.
    MaxTrials,
    /// Failed: no step lowers the cost although the gradient says that one should (a wrong derivative, a kink).
    Stalled,
    /// Failed: every step, however short, leads to where the residuals are undefined.
    Undefined,
    /// Failed: a decomposition did not converge.
    Breakdown,
    /// Failed: somebody asked to stop. The point is the best so far.
    Interrupted,
}

impl Status {
    /// Every status.
    pub const ALL: [Self; 9] = [
        Self::Gradient,
        Self::Step,
        Self::Cost,
        Self::NothingLeft,
        Self::MaxTrials,
        Self::Stalled,
        Self::Undefined,
        Self::Breakdown,
        Self::Interrupted,
    ];

    /// Whether the point is a minimum, as far as first derivatives tell.
    #[must_use]
    pub fn converged(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Cost | Self::NothingLeft)
    }

    /// A stable lower-case name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().0
    }

    fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Gradient => {
                ("gradient", "converged: the residual is perpendicular to all that the parameters can do")
            }
            Self::Step => ("step", "converged: a full Gauss-Newton step no longer moves any parameter"),
            Self::Cost => ("cost", "converged: the gradient is too small for the cost to show any further reduction"),
            Self::NothingLeft => ("nothing_left", "converged: nothing is left of the residuals"),
            Self::MaxTrials => ("max_trials", "not converged: the limit of trial steps was reached"),
            Self::Stalled => {
                ("stalled", "not converged: no step lowers the cost although the gradient says that one should")
            }
            Self::Undefined => ("undefined", "not converged: every step leads to where the residuals are undefined"),
            Self::Breakdown => ("breakdown", "not converged: a matrix decomposition failed"),
            Self::Interrupted => ("interrupted", "not converged: interrupted, and these are the best values so far"),
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.row().1)
    }
}

/// What a trial step was for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// To lower the cost.
    Step,
    /// Along invisible directions, towards the nominal values. Accepted or not together with its corrections.
    Datum,
    /// To lower the cost again after a datum step. Marked not accepted when the datum step was taken back.
    Correction,
}

impl Kind {
    /// A stable lower-case name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Datum => "datum",
            Self::Correction => "correction",
        }
    }
}

/// One trial step.
#[derive(Debug, Clone, PartialEq)]
pub struct Iteration {
    /// How many linearisations had been made when the step was chosen.
    pub iteration: usize,
    /// What the step was for.
    pub kind: Kind,
    /// Cost where the step starts.
    pub cost: f64,
    /// Cost where it leads; `None` where a residual is undefined there.
    pub trial_cost: Option<f64>,
    /// What may be rounding of `cost`: where the gradient falls, a step may be taken whose cost is higher by no more.
    pub rounding: f64,
    /// By how much the linear model says that the cost falls.
    pub predicted: f64,
    /// (cost − trial cost) / predicted.
    pub gain: Option<f64>,
    /// Damping λ; zero is a Gauss–Newton step.
    pub damping: f64,
    /// Trust radius Δ.
    pub radius: f64,
    /// ‖D δ‖.
    pub step_norm: f64,
    /// Largest cosine between the residual and a column of J that may still move.
    pub gradient: f64,
    /// Whether the step was taken.
    pub accepted: bool,
    /// The conic program of the step, where it came from one.
    pub conic: Option<ConicStep>,
}

/// How the position along invisible directions was settled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Datum {
    /// Every direction is visible.
    NotNeeded,
    /// At the point nearest to the nominal values, within bounds.
    Nearest,
    /// The Jacobian is singular at this point but not beside it: there is no family of equally good points.
    Isolated,
    /// Not settled: no step towards the nominal values could be taken.
    Unsettled,
}

/// A constraint at the point where a search ended.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstraintState {
    /// What is asked of g.
    pub relation: Relation,
    /// g at the point.
    pub value: f64,
    /// ∂g/∂δ at the point.
    pub gradient: Vec<f64>,
    /// μ of [`Solution::multipliers`]; 0 where it is not active.
    pub multiplier: f64,
    /// Whether it holds the point: an equation, or an inequality met as one.
    pub active: bool,
}

/// What a solver found.
#[derive(Debug, Clone)]
pub struct Solution<P> {
    /// The best point.
    pub point: P,
    /// Which test fired.
    pub status: Status,
    /// The true cost at the point.
    pub cost: f64,
    /// Linearisations at which a step was chosen.
    pub iterations: usize,
    /// Every trial step, in order.
    pub trace: Vec<Iteration>,
    /// QR(\[J r\]) at the point.
    pub information: SquareRootInformation,
    /// Orthonormal basis of the invisible directions at the point, in tolerance-scaled coordinates: what neither a
    /// residual nor an equation among the constraints sees.
    pub invisible: Vec<Vec<f64>>,
    /// How the position along the invisible directions was settled.
    pub datum: Datum,
    /// Which coordinates are on a bound.
    pub active: Vec<Bound>,
    /// Whether the start was outside its bounds or constraints and was moved onto them.
    pub projected: bool,
    /// ν, for each coordinate, of ∇cost + Σ μᵢ∇gᵢ = ν: how fast the cost falls when its bound moves outwards, ≥ 0 on a
    /// lower and ≤ 0 on an upper bound, 0 where free. μ, of the constraints, is ≥ 0 for g ≤ 0.
    pub multipliers: Vec<f64>,
    /// The constraints at the point.
    pub constraints: Vec<ConstraintState>,
    /// ‖∇cost + Σ μᵢ∇gᵢ − ν‖ / ‖r‖, in units of columns of J of length one, with the μ and ν that leave least.
    /// Not a number where it could not be computed.
    pub kkt: f64,
    /// What was evaluated.
    pub evaluations: Evaluations,
}

/// How often a problem was evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Evaluations {
    /// Costs.
    pub costs: usize,
    /// Linearisations.
    pub linearisations: usize,
    /// Judgements of the rank.
    pub ranks: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_distinct_and_sentences_say_whether_it_converged() {
        for (i, status) in Status::ALL.into_iter().enumerate() {
            assert!(Status::ALL[..i].iter().all(|other| other.name() != status.name()));
            assert_eq!(status.to_string().starts_with("converged: "), status.converged());
            assert!(status.name().chars().all(|c| c.is_ascii_lowercase() || c == '_'));
        }
    }
}
