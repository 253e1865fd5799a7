//! The fit of rows that arrive one at a time: the Kalman technique in square-root information form, iterated.
//!
//! What is known after some rows is (R, d) with ‖J δ + r‖² = ‖R δ + d‖² + rest; a row more is QR of the stack (Bierman,
//! "Factorization Methods for Discrete Sequential Estimation", 1977, ch. V), and the estimate is the δ that makes R δ + d
//! vanish. That holds as far as the linearisation does. Relinearised at the estimate until it stands still, the iterated
//! filter is Gauss–Newton on the rows seen so far (Bell & Cathey, IEEE Trans. Automatic Control 38, 1993, 294), and with all
//! rows kept the estimate is that of the batch fit. As in iSAM (Kaess, Ranganathan & Dellaert, IEEE Trans. Robotics 24, 2008,
//! 1365) this is done when the estimate has moved by a share of its uncertainty, which happens ever more rarely, and when
//! somebody asks.
//!
//! (R, d) of different rows merge only at one point. So a [`State`] keeps rows, all of them or the last ones, which are
//! relinearised together; a row that leaves is *absorbed* at the estimate of that time, and from then on is known by its (R, d):
//! a fixed-lag smoother. For linear problems nothing is lost by that; otherwise what is left of the row's curvature, which is
//! small where the estimate was near its end when the row left.
//!
//! What no row sees at one point, rows that were linearised at several seem to see: the direction turns, and each point has
//! its own. So absorbed rows are looked at through the projection across what is invisible at the current point, R S (1 − N Nᵀ) S⁻¹,
//! whenever they are brought there. N is judged by *witnesses*: a few of the absorbed rows that are kept for this alone.

mod rows;
mod state;
mod window;

pub use rows::InRows;
pub use state::{Absorbed, SequentialError, State};

use super::{Settings, Solution, Solver, StartError};

/// Which rows are relinearised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Keep {
    /// All: the estimate is that of the batch fit.
    #[default]
    All,
    /// At least so many that came last; those before are absorbed where the estimate was when they left. No row leaves before
    /// there are twice as many equations as parameters.
    Last(usize),
    /// None: all are linearised at the start and absorbed there, so that parts made at one start merge to the same answer.
    AtStart,
}

impl Keep {
    /// `all`, a number, or `start`.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Keep::All => "all".to_owned(),
            Keep::Last(rows) => rows.to_string(),
            Keep::AtStart => "start".to_owned(),
        }
    }
}

/// One row after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sequential {
    /// Which rows are relinearised.
    pub keep: Keep,
    /// When each search ends.
    pub settings: Settings,
}

/// Rows that are taken in together where nobody looks in between.
const TOGETHER: usize = 64;

impl<L: InRows> Solver<L> for Sequential {
    fn name(&self) -> &'static str {
        "sequential"
    }

    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>> {
        let mut state = State::new(problem, start, self.keep, self.settings.clone());
        for rows in problem.rows().chunks(TOGETHER) {
            state.add(problem, rows)?;
        }
        state.estimate(problem).cloned()
    }
}
