//! Conditions on the parameters beside their bounds, as a solver sees them at one point.

/// What a constraint asks of its value g.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// g = 0
    Equal,
    /// g ≤ 0
    AtMost,
}

/// One of the conditions that hold a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Restriction {
    /// The lower bound of a coordinate.
    Lower(usize),
    /// The upper bound of a coordinate.
    Upper(usize),
    /// A constraint, by its place in [`LeastSquares::constraints`](super::LeastSquares::constraints).
    Constraint(usize),
}

/// A condition g(q) = 0 or g(q) ≤ 0, linearised: g(q ⊕ δ) ≈ value + gradientᵀ δ.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// What is asked of g.
    pub relation: Relation,
    /// g at the point.
    pub value: f64,
    /// ∂g/∂δ at the point, one entry for each free coordinate.
    pub gradient: Vec<f64>,
    /// The size of the terms that g is the sum of, > 0: rounding of g is a share of it.
    pub magnitude: f64,
}

impl Constraint {
    /// By how much it is broken: |g| or max(g, 0).
    #[must_use]
    pub fn violation(&self) -> f64 {
        match self.relation {
            Relation::Equal => self.value.abs(),
            Relation::AtMost => self.value.max(0.0),
        }
    }
}
