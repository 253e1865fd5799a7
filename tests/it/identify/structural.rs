//! What no data can see: directions, curves and stationary points, and what cures them.

use phical::identify::Inputs;
use phical::identify::{Probe, structure};
use phical::problem::Options;
use phical::simulate::{self, simulate};

use super::{freed, named, probe, small, structure_of};
use crate::flagship::{compiled, flagship};
use crate::shared::project;

/// Lengths in millimetres, angles in milliradians, of length one.
fn in_units(found: &phical::identify::Direction) -> Vec<(String, f64)> {
    let amount = |term: &phical::fit::Term| term.weight * term.tolerance * if term.unit == "rad" { 1e3 } else { 1.0 };
    let length = found.terms.iter().map(|term| amount(term).powi(2)).sum::<f64>().sqrt();
    found.terms.iter().map(|term| (term.name.clone(), amount(term) / length)).collect()
}

#[test]
fn the_flagships_direction_is_the_known_one_and_a_curve() {
    let flagship = flagship();
    let scenario = &flagship.0.scenarios[0];
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turn = 2.35e-3;
    let at_1 = vec![("L1.b", half), ("R1.b", half)];
    let at_2 = vec![
        ("L1.b", 0.707),
        ("R1.b", 0.706),
        ("R2.b", 0.0375),
        ("L2.b", 0.0076),
        ("R1.a", -0.0005),
        ("L1.a", 0.0002),
        ("L1.alpha", turn),
        ("R1.alpha", turn),
    ];
    let exact = simulate::Options { rows: vec![(0, 60)], seed: Some(5), exact: true };
    let truth = simulate(&flagship.0, scenario, &exact).expect("it simulates").truth;
    for (start, known) in [(Vec::new(), at_1), (truth, at_2)] {
        let table = if start.is_empty() { 1 } else { 2 };
        let mut options = freed(&["L1.b"]);
        options.selection.start = start;
        let probe = Probe { rows: vec![(0, 60)], ..probe(&flagship.0, Inputs::Scenario(scenario), options) };
        let found = structure(&probe).expect("it runs");
        assert_eq!((found.rank, found.free.len(), found.skipped, found.told_at_nominal), (20, 21, 0, true));
        assert!(found.weak.is_empty() && found.stationary.is_empty() && !found.sound());
        let direction = &found.invisible[0];
        assert!(
            direction.sentence.starts_with("`L1.b` and `R1.b` can only be known in difference: moving both by 1 mm")
        );
        let mut all = in_units(direction);
        for (name, expected) in &known {
            let at = all.iter().position(|(known, _)| known == name).unwrap_or_else(|| panic!("{name}"));
            let (_, value) = all.remove(at);
            assert!((value - expected).abs() < 1e-3, "table {table}, {name}: {value}");
        }
        assert!(all.iter().all(|(_, value)| value.abs() < 1e-3), "{all:?}");
        // all vo-line residuals are lengths, and so are those of the kci
        let walk = direction.walk.as_ref().expect("walked");
        assert!(walk.family && walk.length == 16.0 && walk.residual < 1e-9, "{walk:?}");
        // vo.z by 0.014 mm per mm along the straight line at table 2
        assert!(table == 1 || walk.straight > 1e3 * walk.residual, "{walk:?}");
    }
}

#[test]
fn variants_of_the_flagship() {
    let text = std::fs::read_to_string(project("models/two_theodolite/model.ron")).expect("the model");
    let renamed =
        text.replace("L1", "Turn").replace("hzTurn", "hzL1").replace("vTurn", "vL1").replace("\"R2", "\"Sight");
    let tilted = text
        .replace("L0\", phi: \"pi/2\"", "L0\", phi: \"pi/2 + 0.2\"")
        .replace("R0\", phi: \"pi/2\"", "R0\", phi: 1.7");
    let other_phi = text.replace("phi: 0,", "phi: \"20 deg\",");
    let slides = text
        .replace("\"L0\", phi: \"pi/2\",", "\"L0\", phi: \"pi/2\", a: Held(0), b: Held(0),")
        .replace("a: Free(2400),", "a: Free(2400), b: Held(0),");
    for (name, text, free, rank, invisible) in [
        ("as it is", &text, &[][..], 20, 0),
        ("renamed", &renamed, &["Turn.b"][..], 20, 1),
        ("tilted", &tilted, &["L1.b"][..], 20, 1),
        ("other phi", &other_phi, &["L1.b"][..], 20, 1),
        ("base along y", &slides, &["L1.b", "L0.a"][..], 20, 2),
        ("base along x and y, which turns it", &slides, &["L1.b", "L0.a", "L0.b"][..], 20, 3),
        ("and its direction", &slides, &["L1.b", "L0.a", "L0.b", "R0.b"][..], 20, 4),
    ] {
        let program = compiled(text);
        let found = structure_of(&program, freed(free));
        let n = rank + invisible;
        assert_eq!((found.rank, found.free.len(), found.invisible.len()), (rank, n, invisible), "{name}");
        assert!(found.invisible.iter().all(|one| one.walk.as_ref().is_some_and(|walk| walk.family)), "{name}");
        // every choice of what to hold leaves nothing invisible
        let best: Vec<(String, Option<String>)> =
            found.cures.iter().flat_map(|choices| &choices[0].fix).map(|name| (name.clone(), None)).collect();
        assert_eq!(best.len(), invisible, "{name}");
        let mut options = freed(free);
        options.selection.fix = best;
        let cured = structure_of(&program, options);
        assert!(cured.sound() && cured.rank == rank && cured.cures.is_empty(), "{name}");
    }
}

#[test]
fn weak_is_not_invisible() {
    let both = r#""a": Scalar(Free(nominal: 1, tolerance: 0.01)), "b": Scalar(Free(nominal: 2, tolerance: 0.01))"#;
    for (power, weak, invisible) in [(1e-3, 0, 0), (2e-6, 1, 0), (1e-8, 1, 0), (1e-16, 0, 1)] {
        let program = small(both, r#""x": (), "y": (sigma: 0.1)"#, &format!("y - a*x - b*(x + {power:?}*x^2)"));
        let found = structure_of(&program, Options::default());
        assert_eq!((found.weak.len(), found.invisible.len(), found.rank), (weak, invisible, 2 - invisible), "{power}");
        if weak == 1 {
            assert!(found.weak[0].seen.is_some_and(|seen| (power / 100.0..power * 100.0).contains(&seen)));
            assert!(found.sound());
        }
    }
}

#[test]
fn a_stationary_point_is_no_family() {
    let one = r#""a": Scalar(Free(nominal: 0, tolerance: 0.001)), "b": Scalar(Free(nominal: 1, tolerance: 0.001))"#;
    let program = small(one, r#""x": (), "y": (sigma: 0.1)"#, "y - a^2*x - b");
    let found = structure_of(&program, Options::default());
    assert_eq!((found.rank, found.nominal_rank, found.invisible.len()), (2, Some(1), 0));
    assert_eq!(found.stationary.len(), 1);
    let walk = found.stationary[0].walk.as_ref().expect("walked");
    assert!(!walk.family && walk.residual > 1e-9, "{walk:?}");
    assert!(!found.sound());
    // a circle is a family, and a curved one
    let program = small(one, r#""x": (), "y": (sigma: 0.1)"#, "y - (a^2 + b^2)*x");
    let found = structure_of(&program, Options::default());
    assert_eq!((found.rank, found.free.len()), (1, 2));
    let walk = found.invisible[0].walk.as_ref().expect("walked");
    assert!(walk.family && walk.residual < 1e-9 * walk.straight, "{walk:?}");
}

#[test]
fn the_panda_with_everything_free() {
    let text = std::fs::read_to_string(project("models/panda_sockets/model.ron")).expect("the model");
    let program = compiled(&text);
    let options = freed(&["J1.a", "J1.alpha", "J1.d", "J1.theta", "J7.d", "J7.theta"]);
    let found = structure_of(&program, options);
    assert_eq!((found.rank, found.free.len()), (37, 43));
    assert!(named(&found.invisible, &["J7.d", "ball.z"]));
    let others = |one: &phical::identify::Direction, own: &str, with: &str| {
        one.terms.iter().all(|term| term.name.starts_with(own) || term.name.starts_with(with))
    };
    assert_eq!(found.invisible.iter().filter(|one| others(one, "J1.", "socket")).count(), 4);
    assert_eq!(found.invisible.iter().filter(|one| others(one, "J7.", "ball")).count(), 2);
    assert!(structure_of(&program, Options::default()).sound());
}

#[test]
fn what_has_outputs_only_tells_nothing_and_hides_nothing() {
    let residual = r#""x": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - a - b*x"})"#;
    let outputs = r#""p": (inputs: {"x": ()}, outputs: {"line": "a + b*x"})"#;
    let draw = r#"draw: {"x": Uniform(0, 1)}"#;
    let program = compiled(&format!(
        r#"(name: "both", parameters: {{"a": Scalar(Free(0)), "b": Scalar(Free(1))}}, measurements: {{{outputs}, {residual}}},
            scenarios: {{"s": (measurements: {{"p": (rows: 9, {draw}), "x": (rows: 9, {draw}, set: {{"y": "a + b*x"}})}})}})"#
    ));
    let found = structure_of(&program, Options::default());
    assert_eq!((found.rank, found.free.len(), found.invisible.len()), (2, 2, 0));
}

#[test]
fn a_scale_that_nothing_sees_is_called_so() {
    let text = std::fs::read_to_string(project("models/epipolar_pair/model.ron")).expect("a model");
    let found = structure_of(&compiled(&text), freed(&["base.x"]));
    let words: Vec<&str> = found.invisible.iter().map(|direction| direction.sentence.as_str()).collect();
    let scale = "`base.x`, `base.y` and `base.z` can only be known in proportion: moving all by 0.1 % of themselves changes no residual";
    assert_eq!(words, [scale]);
}
