//! A problem that knows how long its evaluation takes, and tells how far the search is.

use std::cell::Cell;
use std::time::{Duration, Instant};

use crate::data::Stage;
use crate::linalg::SquareRootInformation;
use crate::problem::Execution;
use crate::solve::{Constraint, LeastSquares, Stacked};

/// Measures the time spent in the functions of a problem, and tells of every linearisation.
pub struct Timed<'a, L> {
    problem: &'a L,
    spent: Cell<Duration>,
    linearised: Cell<usize>,
    cost: Cell<f64>,
    execution: &'a Execution,
}

impl<'a, L> Timed<'a, L> {
    /// Whoever `execution` tells is told of every linearisation.
    pub fn new(problem: &'a L, execution: &'a Execution) -> Self {
        Timed { problem, spent: Cell::default(), linearised: Cell::default(), cost: Cell::new(f64::NAN), execution }
    }

    /// The time spent in the problem's functions.
    pub fn spent(&self) -> Duration {
        self.spent.get()
    }

    /// How often it was linearised.
    pub fn linearised(&self) -> usize {
        self.linearised.get()
    }

    fn linearising(&self) {
        self.linearised.set(self.linearised.get() + 1);
        self.execution.tell(Stage::Search { linearised: self.linearised.get() as u64, cost: self.cost.get() });
    }

    fn timed<T>(&self, work: impl FnOnce() -> T) -> T {
        let begun = Instant::now();
        let result = work();
        self.spent.set(self.spent.get() + begun.elapsed());
        result
    }
}

impl<L: LeastSquares> LeastSquares for Timed<'_, L> {
    type Point = L::Point;
    type Error = L::Error;

    fn dimension(&self) -> usize {
        self.problem.dimension()
    }

    fn cost(&self, q: &L::Point) -> Result<f64, L::Error> {
        let cost = self.timed(|| self.problem.cost(q))?;
        self.cost.set(cost);
        Ok(cost)
    }

    fn linearise(&self, q: &L::Point) -> Result<SquareRootInformation, L::Error> {
        self.linearising();
        self.timed(|| self.problem.linearise(q))
    }

    fn evaluate(&self, q: &L::Point) -> Result<(f64, SquareRootInformation), L::Error> {
        self.linearising();
        let (cost, information) = self.timed(|| self.problem.evaluate(q))?;
        self.cost.set(cost);
        Ok((cost, information))
    }

    fn retract(&self, q: &L::Point, delta: &[f64]) -> L::Point {
        self.problem.retract(q, delta)
    }

    fn offset(&self, q: &L::Point) -> Vec<f64> {
        self.problem.offset(q)
    }

    fn scale(&self) -> &[f64] {
        self.problem.scale()
    }

    fn magnitude(&self, q: &L::Point) -> Vec<f64> {
        self.problem.magnitude(q)
    }

    fn bounds(&self, q: &L::Point) -> (Vec<f64>, Vec<f64>) {
        self.problem.bounds(q)
    }

    fn stopped(&self) -> bool {
        self.problem.stopped()
    }

    fn constraints(&self, q: &L::Point) -> Result<Vec<Constraint>, L::Error> {
        self.timed(|| self.problem.constraints(q))
    }

    fn stacked(&self, q: &L::Point) -> Result<Option<Stacked>, L::Error> {
        self.linearising();
        self.timed(|| self.problem.stacked(q))
    }

    fn invisible(&self, q: &L::Point, at: &SquareRootInformation) -> Result<Vec<Vec<f64>>, L::Error> {
        self.timed(|| self.problem.invisible(q, at))
    }
}
