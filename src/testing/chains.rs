//! Random serial chains, and what can be known of them.

use std::fmt::Write;
use std::ops::RangeInclusive;

use proptest::prelude::*;

use crate::compile::Program;

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// It turns.
    Revolute,
    /// It slides.
    Prismatic,
}

/// What is measured of a chain's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// Where it is and how it is turned.
    Pose,
    /// Where it is.
    Position,
}

/// Which chains a strategy makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Kinds {
    /// How many joints.
    pub joints: RangeInclusive<usize>,
    /// The probability that a joint slides.
    pub prismatic: f64,
    /// Whether φ and d of the joints are free, too; by default either.
    pub phi: Option<bool>,
    /// What is measured; by default either.
    pub measured: Option<Measured>,
}

/// One to six joints, three in ten of them prismatic.
impl Default for Kinds {
    fn default() -> Self {
        Kinds { joints: 1..=6, prismatic: 0.3, phi: None, measured: None }
    }
}

/// A chain of φ-model joints between an unknown base and an unknown tool, with everything free.
#[derive(Clone, Debug)]
pub struct Serial {
    /// Its joints, from the base on.
    pub joints: Vec<JointKind>,
    /// Whether φ and d of the joints are free; else they are zero.
    pub phi: bool,
    /// What is measured.
    pub measured: Measured,
    /// The model, with the measurement `m` of inputs `q0`, `q1`, …; lengths are in mm.
    pub text: String,
}

impl Serial {
    /// The model, compiled.
    pub fn program(&self) -> Program {
        super::program(&self.text)
    }

    /// What can be known: 4R + 2P + 6 for R revolute and P prismatic joints, a line and a direction each, and the tool's pose
    /// where all readings are zero; of which 3 are its turn, which the position of one point does not show (Everett, Driels & Mooring,
    /// Kinematic modelling for robot calibration, ICRA 1987).
    pub fn rank(&self) -> usize {
        let revolute = self.joints.iter().filter(|kind| **kind == JointKind::Revolute).count();
        4 * revolute + 2 * (self.joints.len() - revolute) + if self.measured == Measured::Pose { 6 } else { 3 }
    }

    /// How many numbers are free.
    pub fn free(&self) -> usize {
        let ends = if self.measured == Measured::Pose { 12 } else { 9 };
        ends + self.joints.len() * if self.phi { 6 } else { 4 }
    }
}

/// Serial chains. They shrink to fewer joints, to revolute ones, to zero lengths and right angles.
///
/// ```
/// use phical::testing::{Kinds, assert_rank, chains};
/// use proptest::prelude::*;
/// proptest!(ProptestConfig::with_cases(3), |(chain in chains(Kinds { joints: 1..=2, ..Kinds::default() }))| {
///     assert_rank(&chain.program(), chain.rank());
/// });
/// ```
pub fn chains(kinds: Kinds) -> impl Strategy<Value = Serial> {
    let either = |fixed: Option<bool>| match fixed {
        Some(fixed) => Just(fixed).boxed(),
        None => any::<bool>().boxed(),
    };
    let numbers = || prop::array::uniform6(-1.0..1.0f64);
    let joint = (prop::bool::weighted(kinds.prismatic), numbers());
    let phi = either(kinds.phi);
    let pose = either(kinds.measured.map(|measured| measured == Measured::Pose));
    (prop::collection::vec(joint, kinds.joints), phi, pose, numbers(), numbers())
        .prop_map(|(joints, phi, pose, base, tool)| serial(&joints, phi, pose, &base, &tool))
}

fn free(text: &mut String, names: &[&str], shares: &[f64], middle: f64, reach: f64) {
    for (name, share) in names.iter().zip(shares) {
        let _ = write!(text, "{name}: Free({:.4}), ", middle + share * reach);
    }
}

fn serial(joints: &[(bool, [f64; 6])], phi: bool, pose: bool, base: &[f64; 6], tool: &[f64; 6]) -> Serial {
    const TURNS: [&str; 3] = ["rx", "ry", "rz"];
    const PLACES: [&str; 3] = ["x", "y", "z"];
    let mut chain = String::from("Rigid(name: \"base\", ");
    free(&mut chain, &PLACES, &base[..3], 0.0, 300.0);
    free(&mut chain, &TURNS, &base[3..], 0.0, 1.0);
    chain += "), ";
    let mut inputs = String::new();
    for (i, (slides, numbers)) in joints.iter().enumerate() {
        let (kind, unit) = if *slides { ("Prismatic", "mm") } else { ("Revolute", "rad") };
        let _ = write!(chain, "{kind}(name: \"J{i}\", ");
        free(&mut chain, &["beta"], &numbers[..1], 0.0, 3.0);
        // not near the parallel, where the convention breaks down
        free(&mut chain, &["alpha"], &numbers[1..2], std::f64::consts::FRAC_PI_2, 1.05);
        free(&mut chain, &["a", "b"], &numbers[2..4], 0.0, 300.0);
        if phi {
            free(&mut chain, &["phi"], &numbers[4..5], 0.0, 3.0);
            free(&mut chain, &["d"], &numbers[5..], 0.0, 300.0);
        }
        chain += "), ";
        let _ = write!(inputs, "\"q{i}\": (unit: \"{unit}\"), ");
    }
    chain += "Rigid(name: \"tool\", ";
    // a point on the last axis would not show how this turns
    free(&mut chain, &PLACES, &tool[..3], 85.0, 65.0);
    if pose {
        free(&mut chain, &TURNS, &tool[3..], 0.0, 1.0);
    }
    chain += ")";
    for name in PLACES {
        let _ = write!(inputs, "\"{name}\": (unit: \"mm\", sigma: \"0.05 mm\"), ");
    }
    let mut residuals = String::from("\"p\": \"f.o - vec(x, y, z)\", ");
    if pose {
        for axis in ["u", "v"] {
            PLACES.iter().for_each(|k| {
                let _ = write!(inputs, "\"{axis}{k}\": (sigma: 0.0001), ");
            });
        }
        residuals += "\"u\": \"f.x - vec(ux, uy, uz)\", \"v\": \"f.y - vec(vx, vy, vz)\"";
    }
    let arguments: Vec<String> = (0..joints.len()).map(|i| format!("q{i}")).collect();
    let text = format!(
        r#"(name: "serial", chains: {{"arm": [{chain}]}}, measurements: {{"m": (inputs: {{{inputs}}},
            define: {{"f": "arm({})"}}, residuals: {{{residuals}}})}})"#,
        arguments.join(", ")
    );
    let kind = |slides: bool| if slides { JointKind::Prismatic } else { JointKind::Revolute };
    Serial {
        joints: joints.iter().map(|(slides, _)| kind(*slides)).collect(),
        phi,
        measured: if pose { Measured::Pose } else { Measured::Position },
        text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::strategy::ValueTree;
    use proptest::test_runner::{Config, TestError, TestRunner};

    #[test]
    fn what_fails_shrinks_to_few_joints() {
        let config = Config { failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRunner::deterministic().rng().clone());
        let found = runner.run(&chains(Kinds::default()), |chain| {
            prop_assert!(chain.joints.len() < 3);
            Ok(())
        });
        let Err(TestError::Fail(_, least)) = found else { panic!("{found:?}") };
        assert_eq!(least.joints, [JointKind::Revolute; 3]);
        assert!(!least.phi && least.measured == Measured::Position, "{least:?}");
        assert!(least.text.contains("alpha: Free(1.5708), a: Free(0.0000)"), "{}", least.text);
    }

    #[test]
    fn numbers_are_counted() {
        let mut runner = TestRunner::deterministic();
        for _ in 0..20 {
            let chain = chains(Kinds::default()).new_tree(&mut runner).unwrap().current();
            let program = chain.program();
            assert_eq!(program.parameters.iter().map(|p| p.dimensions.len()).sum::<usize>(), chain.free());
        }
    }
}
