//! What data can see: known symmetries found and named, curves told from stationary points, cures that cure.

use std::process::ExitCode;

use phical::compile::Program;
use phical::diag::Source;
use phical::identify::{Inputs, Practice, Probe, Structure, conventions, practice, structure};
use phical::model::load;
use phical::problem::{Options, Problem, Selection, Weights};
use phical::simulate::{self, simulate};
use serde_json::Value;

use crate::flagship::{compiled, flagship};
use crate::shared::project;

fn freed(names: &[&str]) -> Options {
    let selection = Selection { free: names.iter().map(|name| (*name).to_owned()).collect(), ..Selection::default() };
    Options { selection, ..Options::default() }
}

fn probe<'a>(program: &'a Program, inputs: Inputs<'a>, options: Options) -> Probe<'a> {
    Probe { program, options, inputs, rows: Vec::new(), seed: 1 }
}

/// The scenario of a program where it has one, else drawn inputs.
fn structure_of(program: &Program, options: Options) -> Structure {
    let inputs = program.scenarios.first().map_or(Inputs::Drawn, Inputs::Scenario);
    structure(&probe(program, inputs, options)).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)))
}

fn blind(found: &Practice) -> Vec<&str> {
    found.parameters.iter().filter(|known| !known.estimable).map(|known| known.name.as_str()).collect()
}

/// Lengths in millimetres, angles in milliradians, of length one.
fn in_units(found: &phical::identify::Direction) -> Vec<(String, f64)> {
    let amount = |term: &phical::fit::Term| term.weight * term.tolerance * if term.unit == "rad" { 1e3 } else { 1.0 };
    let length = found.terms.iter().map(|term| amount(term).powi(2)).sum::<f64>().sqrt();
    found.terms.iter().map(|term| (term.name.clone(), amount(term) / length)).collect()
}

#[test]
fn the_flagship_is_one_short_in_every_weight_mode_on_clean_and_noisy_data() {
    let flagship = flagship();
    for (exact, weights) in
        [(true, Weights::Unit), (true, Weights::Propagated), (false, Weights::Unit), (false, Weights::Propagated)]
    {
        let options = simulate::Options { rows: vec![(0, 80)], seed: Some(3), exact };
        let tables = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates").tables;
        let options = Options { weights: Some(weights), ..freed(&["L1.b"]) };
        let (bound, _) = Problem::bind(&flagship.0, tables, &options).expect("it binds");
        let found = practice(&probe(&flagship.0, Inputs::Rows(&bound), options), None).expect("it runs");
        assert_eq!((found.rank, found.parameters.len(), found.left_out), (20, 21, 0), "{exact} {weights:?}");
        assert_eq!(blind(&found), ["L1.b", "R1.b"]);
        assert!(found.parameters.iter().all(|known| known.sigma.is_some() == (known.estimable && weights.are_real())));
        assert!(found.invisible.len() == 1 && found.invisible[0].walk.as_ref().expect("walked").family);
        assert_eq!((found.indices.o2, found.indices.o5), (0.0, 0.0));
        let choices: Vec<&[String]> = found.cures[0].iter().map(|cure| cure.fix.as_slice()).collect();
        assert_eq!(choices, [["L1.b"], ["R1.b"]]);
    }
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

fn small(parameters: &str, inputs: &str, residual: &str) -> Program {
    compiled(&format!(
        r#"(name: "small", parameters: {{{parameters}}}, measurements: {{"m": (inputs: {{{inputs}}}, residuals: {{"r": "{residual}"}})}})"#
    ))
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

/// Random numbers for chains.
struct Draw(u64);

impl Draw {
    /// splitmix64 (Steele, Lea & Flood 2014)
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    fn free(&mut self, names: &[&str], low: f64, high: f64) -> String {
        names.iter().map(|name| format!("{name}: Free({:.4}), ", self.between(low, high))).collect()
    }
}

/// A chain of φ-model joints with everything free, base and tool too, whose end is measured.
fn serial(kinds: &[bool], pose: bool, draw: &mut Draw) -> String {
    let mut joints = format!(
        "Rigid(name: \"base\", {}{}),",
        draw.free(&["x", "y", "z"], -300.0, 300.0),
        draw.free(&["rx", "ry", "rz"], -1.0, 1.0)
    );
    for (i, &turns) in kinds.iter().enumerate() {
        let kind = if turns { "Revolute" } else { "Prismatic" };
        joints += &format!(
            "{kind}(name: \"J{i}\", {}{}{}),",
            draw.free(&["phi", "beta"], -3.0, 3.0),
            draw.free(&["alpha"], 0.5, 2.6),
            draw.free(&["d", "a", "b"], -300.0, 300.0)
        );
    }
    let turned = if pose { draw.free(&["rx", "ry", "rz"], -1.0, 1.0) } else { String::new() };
    joints += &format!("Rigid(name: \"tool\", {}{turned}),", draw.free(&["x", "y", "z"], 20.0, 150.0));
    let mut inputs = String::new();
    for (i, &turns) in kinds.iter().enumerate() {
        inputs += &format!("\"q{i}\": (unit: \"{}\"), ", if turns { "rad" } else { "mm" });
    }
    inputs += "\"x\": (unit: \"mm\", sigma: \"0.05 mm\"), \"y\": (unit: \"mm\", sigma: \"0.05 mm\"), \"z\": (unit: \"mm\", sigma: \"0.05 mm\"), ";
    let mut residuals = "\"p\": \"f.o - vec(x, y, z)\", ".to_owned();
    if pose {
        for axis in ["u", "v"] {
            inputs += &["x", "y", "z"].map(|k| format!("\"{axis}{k}\": (sigma: 0.0001), ")).concat();
        }
        residuals += "\"u\": \"f.x - vec(ux, uy, uz)\", \"v\": \"f.y - vec(vx, vy, vz)\"";
    }
    let arguments: Vec<String> = (0..kinds.len()).map(|i| format!("q{i}")).collect();
    format!(
        r#"(name: "serial", chains: {{"arm": [{joints}]}}, measurements: {{"m": (inputs: {{{inputs}}},
            define: {{"f": "arm({})"}}, residuals: {{{residuals}}})}})"#,
        arguments.join(", ")
    )
}

/// `PHICAL_CASES` lengthens it.
#[test]
fn random_chains_have_the_rank_that_counting_gives() {
    let cases = std::env::var("PHICAL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(36);
    let mut draw = Draw(6);
    for case in 0..cases {
        let joints = 1 + (draw.share() * 6.0) as usize;
        let kinds: Vec<bool> = (0..joints).map(|_| draw.share() < 0.7).collect();
        let pose = case % 2 == 0;
        let found = structure_of(&compiled(&serial(&kinds, pose, &mut draw)), Options::default());
        let turning = kinds.iter().filter(|turns| **turns).count();
        let expected = 4 * turning + 2 * (joints - turning) + if pose { 6 } else { 3 };
        assert_eq!(found.rank, expected, "case {case}: {kinds:?}, pose {pose}");
        assert_eq!(found.invisible.len(), found.free.len() - expected);
        assert!(found.invisible.iter().all(|one| one.walk.as_ref().is_some_and(|walk| walk.family)), "case {case}");
    }
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

/// Whether some direction moves these and nothing else that counts.
fn named(found: &[phical::identify::Direction], names: &[&str]) -> bool {
    found.iter().any(|one| {
        let telling = one.terms.iter().filter(|term| term.weight.powi(2) > 0.01);
        telling.map(|term| term.name.as_str()).collect::<Vec<_>>() == names
    })
}

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
fn units_do_not_matter() {
    let mut draw = Draw(11);
    for _ in 0..8 {
        let numbers: Vec<f64> = (0..5).map(|_| draw.between(100.0, 900.0).round()).collect();
        let arm = |length: &str, angle: &str| {
            let l = |k: usize| numbers[k] * if length == "m" { 1e-3 } else { 1.0 };
            let quarter = if angle == "deg" { 90.0 } else { std::f64::consts::FRAC_PI_2 };
            compiled(&format!(
                r#"(name: "arm", units: (length: "{length}", angle: "{angle}"), chains: {{"arm": [
                    Revolute(name: "J1", a: Free({:?}), b: Free({:?}), alpha: Free({quarter:?}), beta: Free({quarter:?})),
                    Revolute(name: "J2", phi: Free({quarter:?}), a: Free({:?}), b: {:?}, alpha: {quarter:?}, beta: {quarter:?}),
                ]}}, measurements: {{"m": (inputs: {{"p": (unit: "rad"), "q": (unit: "rad"),
                    "x": (unit: "mm", sigma: "0.05 mm"), "y": (unit: "mm", sigma: "0.02 mm"), "z": (unit: "mm", sigma: "0.1 mm")}},
                    define: {{"f": "arm(p, q)"}}, residuals: {{"r": "f.o - vec(x, y, z)"}})}})"#,
                l(0),
                l(1),
                l(2),
                l(3)
            ))
        };
        let (one, other) = (arm("mm", "rad"), arm("m", "deg"));
        let predict = |program| practice(&probe(program, Inputs::Drawn, Options::default()), None).expect("it runs");
        let (one, other) = (predict(&one), predict(&other));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs();
        let (a, b) = (one.indices, other.indices);
        assert_eq!((one.rank, one.weights), (other.rank, Weights::Propagated));
        assert!(
            a.o1 > 0.0
                && near(a.o1, b.o1)
                && near(a.o2, b.o2)
                && near(a.o3, b.o3)
                && near(a.o4, b.o4)
                && near(a.o5, b.o5)
        );
        assert!(near(one.condition, other.condition));
        for (a, b) in one.parameters.iter().zip(&other.parameters) {
            let (a, b) = (a.sigma.expect("known") / a.tolerance, b.sigma.expect("known") / b.tolerance);
            assert!(near(a, b), "{a} {b}");
        }
        assert_eq!(
            one.clusters.iter().map(|c| &c.0).collect::<Vec<_>>(),
            other.clusters.iter().map(|c| &c.0).collect::<Vec<_>>()
        );
    }
}

/// The command's exit code and JSON.
fn run(arguments: &[&str]) -> (ExitCode, Value) {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let all = ["phical"].iter().chain(arguments).chain(&["--format", "json"]);
    let code = phical::cli::run(all, &mut out, &mut err);
    (code, serde_json::from_slice(&out).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&err))))
}

#[test]
fn a_change_of_datum_is_a_refit() {
    let model = project("models/two_theodolite/model.ron").display().to_string();
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("fit.json").display().to_string();
    run(&["calibrate", &model, "--free", "L1.b", "--out", &file]);
    for (datum, arguments) in [("L1.b=0.3 mm", ["--fix", "L1.b=0.3 mm"]), ("R1.b=-0.2 mm", ["--fix", "R1.b=-0.2 mm"])] {
        let refit = run(&["calibrate", &model, "--free", "L1.b", arguments[0], arguments[1]]).1;
        let (code, moved) = run(&["identify", &model, "--fit", &file, "--datum", datum]);
        assert_eq!(code, ExitCode::SUCCESS);
        assert_eq!(moved["family"], true);
        assert!(moved["residual"].as_f64().expect("a number") < 1e-9);
        let by_name = |all: &Value, name: &str| {
            all["parameters"].as_array().expect("parameters").iter().find(|p| p["name"] == name).cloned()
        };
        let mut compared = 0;
        for p in moved["parameters"].as_array().expect("parameters") {
            let Some(other) = by_name(&refit, p["name"].as_str().expect("a name")) else { continue };
            let number = |value: &Value| value.as_f64().expect("a number");
            let (sigma, expected) = (number(&p["sigma"]), number(&other["sigma"]));
            assert!((sigma / expected - 1.0).abs() < 1e-2, "{}: {sigma} {expected}", p["name"]);
            assert!((number(&p["value"]) - number(&other["value"])).abs() < 1e-4 * sigma, "{}: {p} {other}", p["name"]);
            compared += 1;
        }
        assert_eq!(compared, 20);
    }
}

#[test]
fn exit_codes_and_json() {
    let model = project("models/two_theodolite/model.ron").display().to_string();
    let (code, found) = run(&["identify", &model, "--scenario", "paper", "--rows", "vo_line=40"]);
    assert_eq!(code, ExitCode::SUCCESS);
    for key in ["rank", "free", "parameters", "invisible", "weak", "indices", "clusters", "cures", "condition"] {
        assert!(!found[key].is_null(), "{key}");
    }
    assert_eq!((found["rank"].as_u64(), found["rows"]["vo_line"].as_u64()), (Some(20), Some(40)));
    assert_eq!(found["next"]["measurement"], "vo_line");
    let (code, found) = run(&["identify", &model, "--free", "L1.b"]);
    assert_eq!(code, ExitCode::from(1));
    assert_eq!(found["invisible"][0]["family"], true);
    let sigma = found["cures"][0][0]["then"][0]["sigma"].as_f64().expect("a number");
    assert!((0.3..2.0).contains(&sigma), "{sigma}");
    assert_eq!(run(&["identify", &model, "--free", "L1.q"]).0, ExitCode::from(2));
}

/// Predicted without data, and what a calibration of simulated data then states.
#[test]
fn the_prediction_is_what_a_fit_states() {
    let flagship = flagship();
    let scenario = &flagship.0.scenarios[0];
    let predicted =
        practice(&probe(&flagship.0, Inputs::Scenario(scenario), Options::default()), None).expect("it runs");
    let simulated = simulate(&flagship.0, scenario, &simulate::Options::default()).expect("it simulates");
    let (bound, _) = Problem::bind(&flagship.0, simulated.tables, &Options::default()).expect("it binds");
    let solution = phical::solve::minimise(&bound, bound.start.clone(), &Default::default()).expect("it starts");
    let fit = phical::fit::analyse(&bound, solution).expect("defined");
    for (known, stated) in predicted.parameters.iter().zip(&fit.parameters) {
        let ratio = known.sigma.expect("known") / stated.sigma.expect("known");
        assert!((0.85..1.15).contains(&ratio), "{}: {ratio}", known.name);
    }
}
