//! Units leave what can be known, and how well.

use std::cell::Cell;

use phical::compile::Program;
use phical::identify::{Inputs, practice};
use phical::problem::{Options, Weights};
use proptest::prelude::*;

use super::{probe, structure_of};
use crate::flagship::compiled;

/// How many of each are one metre, or one radian.
const LENGTHS: [(&str, f64); 4] = [("mm", 1e3), ("m", 1.0), ("cm", 1e2), ("um", 1e6)];
const ANGLES: [(&str, f64); 4] =
    [("rad", 1.0), ("deg", 180.0 / std::f64::consts::PI), ("gon", 200.0 / std::f64::consts::PI), ("mrad", 1e3)];

/// A unit for each number of a model, used up one after the other; the first of its kind when none are left.
struct Units(Vec<usize>, Cell<usize>);

impl Units {
    fn next(&self) -> usize {
        let at = self.1.replace(self.1.get() + 1);
        self.0.get(at).copied().unwrap_or(0)
    }

    fn length(&self, metres: f64) -> String {
        let (unit, per_metre) = LENGTHS[self.next()];
        format!("\"{:?} {unit}\"", metres * per_metre)
    }

    fn angle(&self, radians: f64) -> String {
        let (unit, per_radian) = ANGLES[self.next()];
        format!("\"{:?} {unit}\"", radians * per_radian)
    }

    fn free_length(&self, metres: f64) -> String {
        format!("Free(nominal: {}, tolerance: {})", self.length(metres), self.length(2e-4))
    }

    fn free_angle(&self, radians: f64) -> String {
        format!("Free(nominal: {}, tolerance: {})", self.angle(radians), self.angle(1e-4))
    }
}

/// An arm of two joints whose tip and whose inclination are measured; with everything free the second joint and the tool cannot be
/// told apart.
fn arm(units: &Units, l: &[f64; 5], t: &[f64; 3], everything: bool) -> Program {
    let more = if everything { format!("d: {}, ", units.free_length(l[3])) } else { String::new() };
    let tool = if everything { units.free_length(l[4]) } else { units.length(l[4]) };
    let text = format!(
        r#"(name: "arm", units: (length: "{}", angle: "{}"), chains: {{"arm": [
            Revolute(name: "J1", a: {}, b: {}, alpha: {}, beta: {}),
            Revolute(name: "J2", {more}a: {}, alpha: {}),
            Rigid(name: "tool", x: {}, z: {tool}),
        ]}}, measurements: {{"m": (inputs: {{
                "p": (unit: "{}"), "q": (unit: "{}"),
                "x": (unit: "{}", sigma: {}), "y": (unit: "{}", sigma: {}), "z": (unit: "{}", sigma: {}), "v": (unit: "{}", sigma: {}),
            }}, define: {{"f": "arm(p, q)"}}, residuals: {{"r": "f.o - vec(x, y, z)", "v": "asin(0.9*f.x.z) - v"}})}})"#,
        LENGTHS[units.next()].0,
        ANGLES[units.next() % 3].0,
        units.free_length(l[0]),
        units.free_length(l[1]),
        units.free_angle(1.3 + 0.3 * t[0]),
        units.free_angle(1.5 + 0.3 * t[1]),
        units.free_length(l[2]),
        units.free_angle(1.4 + 0.3 * t[2]),
        units.length(0.2),
        ANGLES[units.next()].0,
        ANGLES[units.next()].0,
        LENGTHS[units.next()].0,
        units.length(5e-5),
        LENGTHS[units.next()].0,
        units.length(2e-5),
        LENGTHS[units.next()].0,
        units.length(1e-4),
        ANGLES[units.next()].0,
        units.angle(2e-4),
    );
    compiled(&text)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// A unit of its own for the model, and for every nominal value, tolerance, input and sigma.
    #[test]
    fn units_leave_indices_and_verdict(
        l in prop::array::uniform5(0.1..0.9f64), t in prop::array::uniform3(-1.0..1.0f64),
        choices in prop::collection::vec(0usize..4, 40), everything in any::<bool>(),
    ) {
        let (one, other) = (Units(Vec::new(), Cell::new(0)), Units(choices, Cell::new(0)));
        let (one, other) = (arm(&one, &l, &t, everything), arm(&other, &l, &t, everything));
        let of = |program| {
            let found = structure_of(program, Options::default());
            let told: Vec<Vec<String>> = found.invisible.iter().map(|one| one.terms.iter().map(|term| term.name.clone()).collect()).collect();
            (found.rank, found.nominal_rank, found.free, found.estimable, told)
        };
        prop_assert_eq!(of(&one), of(&other));
        prop_assert_eq!(of(&one).4.is_empty(), !everything);
        let predict = |program| practice(&probe(program, Inputs::Drawn, Options::default()), None).expect("it runs");
        let (one, other) = (predict(&one), predict(&other));
        prop_assert_eq!((one.rank, one.weights), (other.rank, Weights::Propagated));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-8 * a.abs();
        let all = |found: &phical::identify::Practice| { let o = found.indices; [o.o1, o.o2, o.o3, o.o4, o.o5] };
        for (name, (a, b)) in ["O1", "O2", "O3", "O4", "O5"].iter().zip(all(&one).into_iter().zip(all(&other))) {
            prop_assert!(near(a, b) && (a > 0.0) != everything, "{} {} {}", name, a, b);
        }
        prop_assert!(near(one.condition, other.condition), "{} {}", one.condition, other.condition);
        for (a, b) in one.parameters.iter().zip(&other.parameters) {
            prop_assert_eq!((&a.name, a.estimable), (&b.name, b.estimable));
            if let (Some(a_sigma), Some(b_sigma)) = (a.sigma, b.sigma) {
                prop_assert!(near(a_sigma / a.tolerance, b_sigma / b.tolerance), "{}: {} {}", a.name, a_sigma, b_sigma);
            }
        }
        let groups = |found: &phical::identify::Practice| found.clusters.iter().map(|c| c.0.clone()).collect::<Vec<_>>();
        prop_assert_eq!(groups(&one), groups(&other));
        // columns of unit length have no units
        for (a, b) in one.collinearity.indices.iter().zip(&other.collinearity.indices) {
            prop_assert!(near(*a, *b), "{} {}", a, b);
        }
    }
}
