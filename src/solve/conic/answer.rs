//! The one file that calls Clarabel.

use crate::solve::Restriction;
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{NonnegativeConeT, SecondOrderConeT, ZeroConeT};
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus};

/// How a conic program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConicStatus {
    /// Solved.
    Solved,
    /// Solved to a lower accuracy.
    AlmostSolved,
    /// The conditions contradict each other.
    Infeasible,
    /// The cost falls without end.
    Unbounded,
    /// The limit of iterations was reached.
    Limit,
    /// Rounding stopped the progress.
    Numerical,
    /// The program was refused.
    Refused,
    /// There was nothing to solve: no coordinate is free.
    Empty,
}

impl ConicStatus {
    /// Whether there is a solution.
    #[must_use]
    pub fn solved(self) -> bool {
        matches!(self, Self::Solved | Self::AlmostSolved)
    }

    /// A stable lower-case name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Solved => "solved",
            Self::AlmostSolved => "almost_solved",
            Self::Infeasible => "infeasible",
            Self::Unbounded => "unbounded",
            Self::Limit => "limit",
            Self::Numerical => "numerical",
            Self::Refused => "refused",
            Self::Empty => "empty",
        }
    }
}

impl From<SolverStatus> for ConicStatus {
    fn from(status: SolverStatus) -> Self {
        match status {
            SolverStatus::Solved => Self::Solved,
            SolverStatus::AlmostSolved => Self::AlmostSolved,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Self::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Self::Unbounded,
            SolverStatus::MaxIterations | SolverStatus::MaxTime => Self::Limit,
            SolverStatus::NumericalError | SolverStatus::InsufficientProgress => Self::Numerical,
            SolverStatus::Unsolved | SolverStatus::CallbackTerminated => Self::Refused,
        }
    }
}

/// The conic program of one trial step.
#[derive(Debug, Clone, PartialEq)]
pub struct ConicStep {
    /// How Clarabel ended.
    pub status: ConicStatus,
    /// Its iterations.
    pub iterations: usize,
    /// What holds the step, with multipliers as in [`Solution`](crate::solve::Solution).
    pub active: Vec<(Restriction, f64)>,
}

/// Which cone a slack s = b − A x lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cone {
    /// s = 0
    Zero,
    /// s ≥ 0
    NonNegative,
    /// s₀ ≥ ‖(s₁, s₂, …)‖; so many rows.
    SecondOrder(usize),
}

/// minimise ½ Σ pⱼxⱼ² + qᵀx   subject to   b − A x in the cones.
#[derive(Debug, Clone, Default)]
pub(super) struct ConicProgram {
    pub(super) p: Vec<f64>,
    pub(super) q: Vec<f64>,
    /// A by columns, (row, entry).
    columns: Vec<Vec<(usize, f64)>>,
    b: Vec<f64>,
    cones: Vec<Cone>,
}

/// Where Clarabel ended.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    pub(super) status: ConicStatus,
    pub(super) iterations: usize,
    pub(super) x: Vec<f64>,
    pub(super) s: Vec<f64>,
    pub(super) z: Vec<f64>,
}

impl ConicProgram {
    pub(super) fn new(p: Vec<f64>, q: Vec<f64>) -> Self {
        let columns = vec![Vec::new(); q.len()];
        Self { p, q, columns, ..Self::default() }
    }

    /// Adds s = b − a x; its place.
    pub(super) fn row(&mut self, cone: Cone, a: impl IntoIterator<Item = (usize, f64)>, b: f64) -> usize {
        let place = self.entries(a, b);
        self.cones.push(cone);
        place
    }

    /// Adds (s₀, s₁, …) of one second-order cone, each s = b − a x; the place of s₀.
    pub(super) fn second_order(&mut self, rows: Vec<(Vec<(usize, f64)>, f64)>) -> usize {
        let place = self.b.len();
        self.cones.push(Cone::SecondOrder(rows.len()));
        for (a, b) in rows {
            self.entries(a, b);
        }
        place
    }

    fn entries(&mut self, a: impl IntoIterator<Item = (usize, f64)>, b: f64) -> usize {
        let place = self.b.len();
        for (j, entry) in a {
            if entry != 0.0 {
                self.columns[j].push((place, entry));
            }
        }
        self.b.push(b);
        place
    }

    /// Solves it to a relative gap of `tolerance`.
    pub(super) fn solve(&self, tolerance: f64) -> Answer {
        let n = self.q.len();
        let nothing = |status| Answer { status, iterations: 0, x: vec![0.0; n], s: vec![], z: vec![] };
        if n == 0 {
            return nothing(ConicStatus::Empty);
        }
        let diagonal = self.p.iter().enumerate().map(|(j, &p)| if p == 0.0 { vec![] } else { vec![(j, p)] });
        let p = compressed(n, diagonal);
        let a = compressed(self.b.len(), self.columns.iter().cloned());
        let mut cones = Vec::new();
        for cone in &self.cones {
            match (cone, cones.last_mut()) {
                (Cone::Zero, Some(ZeroConeT(count))) | (Cone::NonNegative, Some(NonnegativeConeT(count))) => {
                    *count += 1
                }
                (Cone::Zero, _) => cones.push(ZeroConeT(1)),
                (Cone::NonNegative, _) => cones.push(NonnegativeConeT(1)),
                (Cone::SecondOrder(count), _) => cones.push(SecondOrderConeT(*count)),
            }
        }
        let settings = DefaultSettings {
            verbose: false,
            presolve_enable: false,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            max_iter: 100,
            ..DefaultSettings::default()
        };
        let Ok(mut solver) = DefaultSolver::new(&p, &self.q, &a, &self.b, &cones, settings) else {
            return nothing(ConicStatus::Refused);
        };
        solver.solve();
        let found = solver.solution;
        if found.x.iter().chain(&found.s).chain(&found.z).any(|entry| !entry.is_finite()) {
            return nothing(ConicStatus::Numerical);
        }
        Answer {
            status: found.status.into(),
            iterations: usize::try_from(found.iterations).unwrap_or(usize::MAX),
            x: found.x,
            s: found.s,
            z: found.z,
        }
    }
}

/// Compressed columns.
fn compressed(rows: usize, columns: impl Iterator<Item = Vec<(usize, f64)>>) -> CscMatrix<f64> {
    let (mut starts, mut indices, mut entries) = (vec![0], Vec::new(), Vec::new());
    for column in columns {
        for (i, entry) in column {
            indices.push(i);
            entries.push(entry);
        }
        starts.push(indices.len());
    }
    CscMatrix::new(rows, starts.len() - 1, starts, indices, entries)
}
