//! What is known after some rows.

use super::Keep;
use super::rows::InRows;
use super::window::Window;
use crate::linalg::{LinalgError, Matrix, SquareRootInformation, dot, svd};
use crate::solve::region::visible;
use crate::solve::{Iteration, Settings, Solution, Solver, StartError, Suited};

/// The estimate may move by this share of its uncertainty, ‖R δ‖/√n in units of σ₀, before all is linearised anew.
const MOVED: f64 = 0.3;

/// Absorbed rows that witness what is visible, at least; they cost no more than one.
const WITNESSES: usize = 64;

/// Rows that leave together, so that this costs little for each.
const LEAVING: usize = 64;

/// Rows that are gone, as they were linearised.
#[derive(Debug, Clone, PartialEq)]
pub struct Absorbed<P> {
    /// Where.
    pub point: P,
    /// QR(\[J r\]) there, without priors.
    pub information: SquareRootInformation,
    /// What their cost was beyond ½‖r‖².
    pub beyond: f64,
}

impl<P> Absorbed<P> {
    /// None yet.
    pub fn new(point: P, n: usize) -> Self {
        Absorbed { point, information: SquareRootInformation::new(n), beyond: 0.0 }
    }

    /// What they add to the cost at δ from their point.
    pub fn cost_at(&self, delta: &[f64]) -> f64 {
        self.information.cost_at(delta) + self.beyond
    }
}

/// Why a state cannot be changed in some way.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SequentialError<E> {
    /// Two states have absorbed rows at different points.
    #[error("rows were absorbed at different points")]
    Points,
    /// A residual is undefined.
    #[error("a residual is undefined")]
    Undefined(E),
    /// A row cannot be taken out.
    #[error(transparent)]
    Linalg(LinalgError),
}

/// What is known after some rows: where they are linearised, which are kept, and what is left of the others.
#[derive(Debug, Clone)]
pub struct State<P, R> {
    keep: Keep,
    settings: Settings,
    start: P,
    /// the last estimate
    at: P,
    kept: Vec<R>,
    witnesses: Vec<R>,
    absorbed: Absorbed<P>,
    /// the rows seen, linearised at the last solution's point
    running: SquareRootInformation,
    solution: Option<Solution<P>>,
    /// whether rows came, went or changed since the last solution
    changed: bool,
    trace: Vec<Iteration>,
}

impl<P: Clone, R: Copy + Ord + std::fmt::Debug> State<P, R> {
    /// Before the first row.
    pub fn new<L: InRows<Point = P, Row = R>>(problem: &L, start: P, keep: Keep, settings: Settings) -> Self {
        let n = problem.dimension();
        State {
            keep,
            settings,
            kept: Vec::new(),
            witnesses: Vec::new(),
            absorbed: Absorbed::new(start.clone(), n),
            at: start.clone(),
            start,
            running: SquareRootInformation::new(n),
            solution: None,
            changed: true,
            trace: Vec::new(),
        }
    }

    /// From its parts, such as a file holds: where searches begin before and after rows determine the parameters, which rows
    /// are kept and which witness what is visible, and what is absorbed.
    pub fn from_parts(
        (start, at): (P, P),
        (keep, settings): (Keep, Settings),
        (kept, witnesses): (Vec<R>, Vec<R>),
        absorbed: Absorbed<P>,
    ) -> Self {
        let running = SquareRootInformation::new(absorbed.information.dimension());
        let trace = Vec::new();
        State { keep, settings, start, at, kept, witnesses, absorbed, running, solution: None, changed: true, trace }
    }

    /// The same among more parameters: each point, and each matrix, as told.
    ///
    /// # Errors
    /// Where `information` fails.
    pub fn embedded<E>(
        self,
        point: impl Fn(&P) -> P,
        information: impl Fn(&SquareRootInformation) -> Result<SquareRootInformation, E>,
    ) -> Result<Self, E> {
        let absorbed = Absorbed {
            point: point(&self.absorbed.point),
            information: information(&self.absorbed.information)?,
            beyond: self.absorbed.beyond,
        };
        let running = information(&self.running)?;
        let (start, at) = (point(&self.start), point(&self.at));
        Ok(State { start, at, absorbed, running, solution: None, changed: true, ..self })
    }

    /// Where the first search began.
    pub fn start(&self) -> &P {
        &self.start
    }

    /// The last estimate, or else the start.
    pub fn point(&self) -> &P {
        &self.at
    }

    /// The rows that are relinearised, in the order of their arrival.
    pub fn kept(&self) -> &[R] {
        &self.kept
    }

    /// Absorbed rows by which is judged what is visible.
    pub fn witnesses(&self) -> &[R] {
        &self.witnesses
    }

    /// What is left of the others.
    pub fn absorbed(&self) -> &Absorbed<P> {
        &self.absorbed
    }

    /// Which rows are relinearised.
    pub fn keep(&self) -> Keep {
        self.keep
    }

    /// Takes in rows.
    ///
    /// # Errors
    /// Where one is undefined where the estimate is, or a search cannot start; the state is as it was then.
    pub fn add<L: InRows<Point = P, Row = R>>(&mut self, problem: &L, rows: &[R]) -> Result<(), StartError<L::Error>> {
        if self.keep == Keep::AtStart {
            let found = problem.linearise_rows(rows, &self.absorbed.point).map_err(StartError::Undefined)?;
            self.changed = true;
            self.witness(problem, rows).map_err(StartError::Undefined)?;
            return self.take(found).map_err(|error| StartError::Undefined(error.into()));
        }
        let (_, information) = problem.linearise_rows(rows, self.point()).map_err(StartError::Undefined)?;
        self.kept.extend_from_slice(rows);
        self.changed = true;
        self.running.merge(&information).map_err(|error| StartError::Undefined(error.into()))?;
        if self.determined() && (self.solution.is_none() || self.has_moved(problem)) {
            self.search(problem)?;
        }
        match self.keep {
            Keep::Last(n) if self.determined() && self.kept.len().saturating_sub(n) >= LEAVING => {
                self.leave(problem, n).map_err(StartError::Undefined)
            }
            _ => Ok(()),
        }
    }

    /// Twice as many equations as parameters: before that, estimates lead nowhere near.
    fn determined(&self) -> bool {
        self.running.rows() >= 2 * self.running.dimension()
    }

    /// Whether the estimate is so far from where rows were linearised that they have to be again.
    fn has_moved<L: InRows<Point = P, Row = R>>(&self, problem: &L) -> bool {
        let (d, n) = (self.running.d(), self.running.dimension());
        let freedom = self.running.rows().saturating_sub(n).max(1);
        let allowed = MOVED * MOVED * n as f64 * 2.0 * self.running.cost() / freedom as f64;
        let invisible = self.solution.as_ref().map_or(&[][..], |solution| &solution.invisible);
        if invisible.is_empty() || dot(d, d) <= allowed {
            return dot(d, d) > allowed;
        }
        let seen = visible(&self.running, invisible, problem.scale());
        let Ok(found) = svd(&seen) else { return true };
        let along = found.u.transpose_mul_vec(d);
        let kept = &along[..n - invisible.len().min(n)];
        dot(kept, kept) > allowed
    }

    /// The estimate of the rows so far, where a search from the last one ends.
    ///
    /// # Errors
    /// Where the search cannot start.
    pub fn estimate<L: InRows<Point = P, Row = R>>(
        &mut self,
        problem: &L,
    ) -> Result<&Solution<P>, StartError<L::Error>> {
        if self.changed || self.solution.is_none() {
            self.search(problem)?;
        }
        self.solution.as_ref().ok_or(StartError::Problem("rows"))
    }

    fn search<L: InRows<Point = P, Row = R>>(&mut self, problem: &L) -> Result<(), StartError<L::Error>> {
        let judged: Vec<R> = self.witnesses.iter().chain(&self.kept).copied().collect();
        let window = Window { problem, kept: &self.kept, judged: &judged, absorbed: &self.absorbed };
        let from = if self.determined() { self.point().clone() } else { self.start.clone() };
        let mut solution = Suited { settings: self.settings.clone() }.solve(&window, from)?;
        let before = self.trace.last().map_or(0, |last| last.iteration);
        self.trace.extend(solution.trace.iter().map(|t| Iteration { iteration: before + t.iteration, ..t.clone() }));
        solution.iterations += before;
        solution.trace.clone_from(&self.trace);
        self.running = solution.information.clone();
        self.at = solution.point.clone();
        self.solution = Some(solution);
        self.changed = false;
        Ok(())
    }

    /// All but the last n rows are absorbed where the estimate is.
    fn leave<L: InRows<Point = P, Row = R>>(&mut self, problem: &L, n: usize) -> Result<(), L::Error> {
        let leaving: Vec<R> = self.kept[..self.kept.len() - n].to_vec();
        let point = self.point().clone();
        let found = problem.linearise_rows(&leaving, &point)?;
        self.bring(problem, point)?;
        self.witness(problem, &leaving)?;
        self.take(found)?;
        self.kept.drain(..leaving.len());
        Ok(())
    }

    fn take(&mut self, (cost, information): (f64, SquareRootInformation)) -> Result<(), LinalgError> {
        self.absorbed.information.merge(&information)?;
        self.absorbed.beyond += cost - information.cost();
        Ok(())
    }

    /// Brings what is absorbed to a point, without what it seems to see of directions that are invisible there.
    fn bring<L: InRows<Point = P, Row = R>>(&mut self, problem: &L, point: P) -> Result<(), L::Error> {
        if self.absorbed.information.rows() > 0 {
            let (delta, turn) = problem.between(&self.absorbed.point, &point);
            let mut there = self.absorbed.information.recentred(&delta, turn.as_ref())?;
            let blind = problem.invisible_to(&self.witnesses, false, &point, &there)?;
            if !blind.is_empty() {
                there = there.mapped(&across(&blind, problem.scale()))?;
            }
            self.absorbed.information = there;
        }
        self.absorbed.point = point;
        Ok(())
    }

    /// Keeps rows as witnesses where there are few, or where these see what the others do not.
    fn witness<L: InRows<Point = P, Row = R>>(&mut self, problem: &L, rows: &[R]) -> Result<(), L::Error> {
        let some = rows.len().min(WITNESSES.saturating_sub(self.witnesses.len()));
        self.witnesses.extend_from_slice(&rows[..some]);
        if some == rows.len() {
            return Ok(());
        }
        let blind = |of: &[R]| {
            let none = SquareRootInformation::new(problem.dimension());
            problem.invisible_to(of, false, self.point(), &none).map(|basis| basis.len())
        };
        let before = blind(&self.witnesses)?;
        if before > 0 {
            let all: Vec<R> = self.witnesses.iter().chain(&rows[some..]).copied().collect();
            if blind(&all)? < before {
                self.witnesses = all;
            }
        }
        Ok(())
    }

    /// Lets a row count so many times; zero times takes it out. A row that is absorbed must be one that was linearised where
    /// the absorbed ones are now.
    ///
    /// # Errors
    /// Where the row was never absorbed, or is undefined; the state is as it was then, and so is the row's weight.
    pub fn reweight<L: InRows<Point = P, Row = R>>(
        &mut self,
        problem: &mut L,
        row: R,
        (before, after): (f64, f64),
    ) -> Result<(), SequentialError<L::Error>> {
        let kept = self.kept.iter().position(|known| *known == row);
        let point = if kept.is_some() { self.point().clone() } else { self.absorbed.point.clone() };
        let undefined = SequentialError::Undefined;
        let old = problem.linearise_rows(&[row], &point).map_err(undefined)?;
        let mut left = if kept.is_some() { self.running.clone() } else { self.absorbed.information.clone() };
        let removed = left.remove(&old.1);
        // what is kept is linearised anew in any case
        if kept.is_none() {
            removed.map_err(SequentialError::Linalg)?;
        }
        problem.set_weight(row, after);
        let new = match after > 0.0 {
            true => problem.linearise_rows(&[row], &point),
            false => Ok((0.0, SquareRootInformation::new(problem.dimension()))),
        };
        let merged = new.map_err(undefined).and_then(|new| {
            left.merge(&new.1).map_err(SequentialError::Linalg)?;
            Ok(new)
        });
        let new = merged.inspect_err(|_| problem.set_weight(row, before))?;
        match kept {
            Some(at) => {
                self.running = left;
                if after == 0.0 {
                    self.kept.remove(at);
                }
            }
            None => {
                self.absorbed.information = left;
                self.absorbed.beyond += (new.0 - new.1.cost()) - (old.0 - old.1.cost());
            }
        }
        self.changed = true;
        Ok(())
    }

    /// Takes a row out, as if it had never come.
    ///
    /// # Errors
    /// As [`reweight`](Self::reweight).
    pub fn remove<L: InRows<Point = P, Row = R>>(
        &mut self,
        problem: &mut L,
        row: R,
    ) -> Result<(), SequentialError<L::Error>> {
        self.reweight(problem, row, (1.0, 0.0))
    }

    /// Takes in the rows of another state of the same problem: those that are kept, and those that were absorbed at the same
    /// point.
    ///
    /// # Errors
    /// Where both have absorbed rows, at different points.
    pub fn merge<L: InRows<Point = P, Row = R>>(
        &mut self,
        problem: &L,
        other: &Self,
    ) -> Result<(), SequentialError<L::Error>> {
        let same = || problem.between(&self.absorbed.point, &other.absorbed.point).0.iter().all(|&delta| delta == 0.0);
        if other.absorbed.information.rows() > 0 {
            if self.absorbed.information.rows() == 0 {
                self.absorbed = other.absorbed.clone();
            } else if same() {
                self.absorbed.information.merge(&other.absorbed.information).map_err(SequentialError::Linalg)?;
                self.absorbed.beyond += other.absorbed.beyond;
            } else {
                return Err(SequentialError::Points);
            }
        }
        self.kept.extend_from_slice(&other.kept);
        self.witnesses.extend_from_slice(&other.witnesses);
        self.solution = None;
        self.changed = true;
        Ok(())
    }
}

/// S (1 − N Nᵀ) S⁻¹, which leaves nothing along N, S = diag(scale).
fn across(basis: &[Vec<f64>], scale: &[f64]) -> Matrix {
    let n = scale.len();
    let mut m = Matrix::identity(n);
    for z in basis {
        for j in 0..n {
            for i in 0..n {
                m[(i, j)] -= scale[i] * z[i] * z[j] / scale[j];
            }
        }
    }
    m
}
