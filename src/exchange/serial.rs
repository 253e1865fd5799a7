//! A serial chain without any convention: motions about and along z, and what is constant between them.

use super::motion::{Motion, Real, Screw};

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It turns about its z.
    Revolute,
    /// It slides along its z.
    Prismatic,
}

/// A joint that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// How it moves.
    pub kind: Kind,
}

/// *C₀·Z₁(q₁)·C₁·…·Zₙ(qₙ)·Cₙ* with Zᵢ a turn about z or a slide along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Serial<D> {
    /// The moving joints, from the base on.
    pub joints: Vec<Joint>,
    /// What is constant: one more than there are joints.
    pub constants: Vec<Motion<D>>,
}

impl<D: Real> Default for Serial<D> {
    fn default() -> Self {
        Serial { joints: Vec::new(), constants: vec![Motion::none()] }
    }
}

impl<D: Real> Serial<D> {
    /// Adds what is constant at the end.
    pub fn push(&mut self, motion: &Motion<D>) {
        if let Some(last) = self.constants.last_mut() {
            *last = last.then(motion);
        }
    }

    /// Adds a joint at the end.
    pub fn joint(&mut self, name: &str, kind: Kind) {
        self.joints.push(Joint { name: name.to_owned(), kind });
        self.constants.push(Motion::none());
    }

    /// The frame at the end. Readings that are missing count as zero.
    pub fn pose(&self, readings: &[f64]) -> Motion<D> {
        let readings = readings.iter().copied().chain(std::iter::repeat(0.0));
        let mut pose = Motion::none();
        for ((constant, joint), reading) in self.constants.iter().zip(&self.joints).zip(readings) {
            let (reading, zero) = (D::from(reading), D::from(0.0));
            let screw = match joint.kind {
                Kind::Revolute => Screw { turn: reading, slide: zero },
                Kind::Prismatic => Screw { turn: zero, slide: reading },
            };
            pose = pose.then(constant).then(&Motion::about_z(screw));
        }
        self.constants.last().map_or(pose, |last| pose.then(last))
    }
}

impl Serial<f64> {
    /// A length of its size: how far its parts reach when added up.
    pub fn reach(&self) -> f64 {
        let length = |[x, y, z]: [f64; 3]| x.hypot(y).hypot(z);
        let sum: f64 = self.constants.iter().map(|constant| length(constant.origin)).sum();
        if sum > 0.0 { sum } else { 1.0 }
    }
}
