//! What all solvers are.

use super::{Conic, LeastSquares, Settings, Solution, StartError, minimise};

/// A way to the minimum of a problem. What it needs to know of the problem is the bound on `L`.
///
/// ```
/// use phical::solve::{LeastSquares, LevenbergMarquardt, Solver};
/// fn cost<L: LeastSquares>(solver: &dyn Solver<L>, problem: &L, start: L::Point) -> Option<f64> {
///     solver.solve(problem, start).ok().map(|solution| solution.cost)
/// }
/// ```
pub trait Solver<L: LeastSquares> {
    /// A stable lower-case name.
    fn name(&self) -> &'static str;

    /// Searches from `start`.
    ///
    /// # Errors
    /// Only where the search cannot start. Whatever happens later is told by [`Solution::status`].
    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>>;
}

/// Levenberg–Marquardt in trust-region form, [`minimise`](minimise()).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LevenbergMarquardt {
    /// When it ends.
    pub settings: Settings,
}

impl<L: LeastSquares> Solver<L> for LevenbergMarquardt {
    fn name(&self) -> &'static str {
        "lm"
    }

    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>> {
        minimise(problem, start, &self.settings)
    }
}

/// Levenberg–Marquardt where there are bounds at most, conic steps where there are constraints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Suited {
    /// When it ends.
    pub settings: Settings,
}

impl<L: LeastSquares> Solver<L> for Suited {
    fn name(&self) -> &'static str {
        "suited"
    }

    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>> {
        let settings = self.settings.clone();
        match problem.constraints(&start).map_err(StartError::Undefined)?.is_empty() {
            true => LevenbergMarquardt { settings }.solve(problem, start),
            false => Conic { settings, ..Conic::default() }.solve(problem, start),
        }
    }
}
