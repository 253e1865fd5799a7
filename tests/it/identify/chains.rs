//! Serial chains: the rank that counting gives, and joints where their convention breaks down.

use std::cell::Cell;
use std::fmt::Write;

use phical::diag::{Code, Source};
use phical::identify::{Convention, conventions};
use phical::model::load;
use phical::problem::Options;
use phical::testing::{Kinds, Measured, chains};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use super::{named, structure_of};
use crate::flagship::compiled;

/// Of so many cases, the same each time, unless `PROPTEST_RNG_SEED` says otherwise.
fn runner(cases: u32, seed: u64) -> TestRunner {
    let mut config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    if config.rng_seed == RngSeed::Random {
        config.rng_seed = RngSeed::Fixed(seed);
    }
    TestRunner::new(config)
}

/// `PHICAL_CASES` lengthens it: so many of each kind.
fn cases(few: u32) -> u32 {
    std::env::var("PHICAL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(few)
}

fn chains_have_the_rank_that_counting_gives(measured: Measured) {
    let strategy = chains(Kinds { measured: Some(measured), ..Kinds::default() });
    let (run, with_phi) = (Cell::new(0), Cell::new(0));
    let outcome = runner(cases(18), 6).run(&strategy, |chain| {
        let found = structure_of(&chain.program(), Options::default());
        prop_assert_eq!((found.rank, found.free.len()), (chain.rank(), chain.free()));
        prop_assert_eq!(found.invisible.len(), chain.free() - chain.rank());
        prop_assert!(found.invisible.iter().all(|one| one.walk.as_ref().is_some_and(|walk| walk.family)));
        run.set(run.get() + 1);
        with_phi.set(with_phi.get() + u32::from(chain.phi));
        Ok(())
    });
    eprintln!("{} chains measured by {measured:?}, {} of them with phi and d free", run.get(), with_phi.get());
    outcome.unwrap_or_else(|found| panic!("{found}"));
}

#[test]
fn chains_measured_by_pose_have_the_rank_that_counting_gives() {
    chains_have_the_rank_that_counting_gives(Measured::Pose);
}

#[test]
fn chains_measured_by_position_have_the_rank_that_counting_gives() {
    chains_have_the_rank_that_counting_gives(Measured::Position);
}

const UR: &str = r#"(name: "UR-like arm", chains: {"arm": [
    Rigid(name: "base", x: Free(100), y: Free(50), z: Free(20), rx: Free(0.01), ry: Free(0.02), rz: Free(0.3)),
    Dh(name: "J1", theta: Free(0), d: Free(89.2), a: Free(0), alpha: Free("pi/2")),
    Dh(name: "J2", theta: Free(0), d: Free(0), a: Free(-425), alpha: Free(0)),
    Dh(name: "J3", theta: Free(0), d: Free(0), a: Free(-392), alpha: Free(0)),
    Dh(name: "J4", theta: Free(0), d: Free(109.3), a: Free(0), alpha: Free("pi/2")),
    Dh(name: "J5", theta: Free(0), d: Free(94.75), a: Free(0), alpha: Free("-pi/2")),
    Dh(name: "J6", theta: Free(0), d: Free(82.5), a: Free(0), alpha: Free(0)),
    Rigid(name: "tool", x: Free(10), y: Free(20), z: Free(50)),
]}, measurements: {"point": (
    inputs: {"q1": (unit: "rad"), "q2": (unit: "rad"), "q3": (unit: "rad"), "q4": (unit: "rad"), "q5": (unit: "rad"), "q6": (unit: "rad"),
        "x": (unit: "mm", sigma: "0.05 mm"), "y": (unit: "mm", sigma: "0.05 mm"), "z": (unit: "mm", sigma: "0.05 mm")},
    define: {"f": "arm(q1, q2, q3, q4, q5, q6)"}, residuals: {"p": "f.o - vec(x, y, z)"},
)})"#;

#[test]
fn an_arm_measured_by_position_only() {
    let found = structure_of(&compiled(UR), Options::default());
    // six joints, position: 4·6 + 3
    assert_eq!((found.rank, found.free.len()), (27, 33));
    assert!(named(&found.invisible, &["base.rz", "J1.theta"]), "base and first joint turn together");
    assert!(found.invisible.iter().any(|one| one.sentence.starts_with("`J1.d` and `base.z`")), "and slide together");
    assert!(named(&found.invisible, &["J6.a", "tool.x"]), "last joint and tool");
    let of_tool = |name: &str| name.starts_with("J6") || name.starts_with("tool");
    let last = found.invisible.iter().filter(|one| one.terms.iter().all(|term| of_tool(&term.name)));
    assert_eq!(last.count(), 4);
    // axes 2, 3 and 4 are parallel: at the nominal values only the sum of their slides is seen
    assert_eq!(found.nominal_rank, Some(25));
    assert_eq!(found.stationary.len(), 2);
    let slides = |one: &phical::identify::Direction| {
        one.terms.iter().all(|term| ["J2.d", "J3.d", "J4.d"].contains(&term.name.as_str()))
    };
    assert!(
        found.stationary.iter().all(slides),
        "{:?}",
        found.stationary.iter().map(|one| &one.sentence).collect::<Vec<_>>()
    );
    // and the cure is named
    let source = Source::new("ur.ron", UR);
    let (model, _) = load(&source).expect("it is right");
    let near = conventions(&model, &compiled(UR));
    assert_eq!(near.iter().map(|one| one.joint.as_str()).collect::<Vec<_>>(), ["J2", "J3"]);
    assert!(near.iter().all(|one| one.parallel_axes && (one.instead[4].sin() - 1.0).abs() < 1e-12));
}

/// A Denavit–Hartenberg row: a, d, theta and alpha.
type Row = [f64; 4];

/// A chain of such rows with everything free, measured by position; a joint of another convention may stand for one of them.
fn arm(rows: &[Row], instead: &[(usize, &Convention)]) -> String {
    let (mut joints, mut inputs) = (String::new(), String::new());
    let mut carried = [0.0; 2];
    for (i, &[a, d, theta, alpha]) in rows.iter().enumerate() {
        let [turn, slide] = std::mem::take(&mut carried);
        match instead.iter().find(|(at, _)| *at == i) {
            Some((_, found)) => {
                let [phi, d, a, b, alpha, beta] = found.instead;
                let (phi, d) = (phi + turn, d + slide);
                let _ = write!(
                    joints,
                    "Revolute(name: \"J{i}\", phi: Free({phi:?}), d: Free({d:?}), a: Free({a:?}), b: Free({b:?}), alpha: Free({alpha:?}), beta: Free({beta:?})), "
                );
                carried = found.carried;
            }
            None => {
                let (theta, d) = (theta + turn, d + slide);
                let _ = write!(
                    joints,
                    "Dh(name: \"J{i}\", theta: Free({theta:?}), d: Free({d:?}), a: Free({a:?}), alpha: Free({alpha:?})), "
                );
            }
        }
        let _ = write!(inputs, "\"q{i}\": (unit: \"rad\"), ");
    }
    let arguments: Vec<String> = (0..rows.len()).map(|i| format!("q{i}")).collect();
    format!(
        r#"(name: "arm", chains: {{"arm": [
            Rigid(name: "base", x: Free(100), y: Free(50), z: Free(20), rx: Free(0.1), ry: Free(0.2), rz: Free(0.3)),
            {joints} Rigid(name: "tool", x: Free(30), y: Free(20), z: Free(50)),
        ]}}, measurements: {{"m": (
            inputs: {{{inputs}"x": (unit: "mm", sigma: "0.05 mm"), "y": (unit: "mm", sigma: "0.05 mm"), "z": (unit: "mm", sigma: "0.05 mm")}},
            define: {{"f": "arm({})"}}, residuals: {{"p": "f.o - vec(x, y, z)"}},
        )}})"#,
        arguments.join(", ")
    )
}

fn found_conventions(text: &str) -> Vec<Convention> {
    let (model, _) = load(&Source::new("arm.ron", text)).expect("it is right");
    conventions(&model, &compiled(text))
}

/// Parallel axes in plain Denavit–Hartenberg rows: one direction less is seen for each, W040 names the joint, and the joint that it
/// proposes sees it again.
#[test]
fn parallel_axes_are_found_and_what_is_proposed_cures_them() {
    let row = (50.0..300.0f64, -200.0..200.0f64, -1.0..1.0f64, 0.7..1.4f64);
    let tilt = prop::sample::select(vec![0.0, 0.0, 0.03, -0.02]);
    let arms = (prop::collection::vec(row, 3..=5), any::<prop::sample::Index>(), tilt);
    let outcome = runner(cases(12), 7).run(&arms, |(rows, at, tilt)| {
        let mut rows: Vec<Row> = rows.into_iter().map(|(a, d, theta, alpha)| [a, d, theta, alpha]).collect();
        // the tool has no axis that could be parallel to the last
        let at = at.index(rows.len() - 1);
        rows[at][3] = tilt;
        let text = arm(&rows, &[]);
        let near = found_conventions(&text);
        prop_assert_eq!(near.iter().map(|one| one.joint.clone()).collect::<Vec<_>>(), [format!("J{at}")]);
        let (program, expected) = (compiled(&text), 4 * rows.len() + 3);
        let said = near[0].diagnostic(&program);
        prop_assert_eq!((said.code, said.code.id()), (Code::NearConvention, "W040"));
        prop_assert!(said.message.contains("its axis and the next are parallel"), "{}", said.message);
        prop_assert!(said.hint.as_ref().is_some_and(|hint| hint.contains("phi =")));
        let found = structure_of(&program, Options::default());
        let missing = usize::from(tilt == 0.0);
        prop_assert_eq!((found.rank, found.nominal_rank), (expected, Some(expected - missing)));
        // two slides along one direction; a slide at an end of the arm may be told by base or tool
        let both = [format!("J{at}.d"), format!("J{}.d", at + 1)];
        let slides = |one: &phical::identify::Direction| one.terms.iter().any(|term| both.contains(&term.name));
        prop_assert!(found.stationary.len() == missing && found.stationary.iter().all(slides));
        let cured = arm(&rows, &[(at, &near[0])]);
        prop_assert!(found_conventions(&cured).is_empty());
        let found = structure_of(&compiled(&cured), Options::default());
        prop_assert_eq!((found.rank, found.nominal_rank, found.stationary.len()), (expected, Some(expected), 0));
        Ok(())
    });
    outcome.unwrap_or_else(|found| panic!("{found}"));
}
