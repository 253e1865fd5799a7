//! The problem of one step at one linearisation, by the method of the search.

use super::conic::program::Program;
use super::region::{Linear, Region, Step};
use crate::linalg::LinalgError;

/// How steps are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// Levenberg–Marquardt, within bounds.
    Damped,
    /// A conic program, within bounds and constraints.
    Conic,
}

/// The step for any trust radius, and what the linearisation alone tells.
pub(super) enum Local<'a> {
    Damped(Box<Region<'a>>),
    Conic(Box<Program<'a>>),
}

impl<'a> Local<'a> {
    /// `curvature` is what the constraints bend the cost by, per ‖D δ‖²; see [`Program`].
    pub(super) fn new(
        method: Method,
        linear: Linear<'a>,
        diagonal: &'a [f64],
        curvature: f64,
    ) -> Result<Self, LinalgError> {
        Ok(match method {
            Method::Damped => Self::Damped(Box::new(Region::new(linear, diagonal)?)),
            Method::Conic => Self::Conic(Box::new(Program::new(linear, diagonal, curvature)?)),
        })
    }

    pub(super) fn step(&self, radius: f64) -> Result<Step, LinalgError> {
        match self {
            Self::Damped(region) => region.step(radius),
            Self::Conic(program) => program.step(radius),
        }
    }

    /// The step without a trust region.
    pub(super) fn full(&self) -> &Step {
        match self {
            Self::Damped(region) => &region.full,
            Self::Conic(program) => &program.full,
        }
    }

    /// ‖r‖.
    pub(super) fn residual(&self) -> f64 {
        match self {
            Self::Damped(region) => region.residual,
            Self::Conic(program) => program.residual,
        }
    }

    /// Largest cosine between r and what a coordinate that may move does to it.
    pub(super) fn cosine(&self) -> f64 {
        match self {
            Self::Damped(region) => region.cosine,
            Self::Conic(program) => program.cosine,
        }
    }

    /// By how much the linear model's cost can fall at all.
    pub(super) fn fall(&self) -> f64 {
        match self {
            Self::Damped(region) => region.full.predicted,
            Self::Conic(program) => program.fall,
        }
    }

    /// ‖Qᵀr‖ / ‖r‖, where Q spans what can be seen and may move.
    pub(super) fn share(&self) -> f64 {
        let residual = self.residual();
        if residual > 0.0 { (2.0 * self.fall().max(0.0)).sqrt() / residual } else { 0.0 }
    }
}
