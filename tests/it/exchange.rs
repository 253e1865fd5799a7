//! Robots from tables and URDF files, and back: every statement of a chain gives the same poses.
//!
//! Poses are those of the engine (compiled models), of two other libraries (`fk_reference`), and of a reading of URDF files that is written
//! here, with nalgebra.

use std::fmt::Write;

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use phical::data::Table;
use phical::diag::Source;
use phical::evaluate::{evaluate, point};
use phical::exchange::{
    ChainValues, Convention, Exported, Motion, Serial, TableUnits, Target, Urdf, chain_name, export, model_text,
    read_table, robot_of,
};
use phical::problem::{Options, Problem, Selection};
use phical::session::Session;
use phical::testing::program;
use proptest::prelude::*;
use serde_json::Value;

use crate::shared::{numbers, shared, shared_json};

/// A model of a file, opened.
pub fn session(text: &str) -> Session {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("model.ron");
    std::fs::write(&path, text).unwrap();
    Session::open(&path, &[]).unwrap_or_else(|found| panic!("{}\n{text}", phical::diag::text(&found, false)))
}

/// The flange where a model has it, by the engine; the first inputs are the readings.
pub fn poses(text: &str, given: &[(String, f64)], readings: &[Vec<f64>]) -> Vec<Motion<f64>> {
    let program = program(text);
    let width = program.measurements[0].inputs.len();
    let mut table = Table::new(0, width);
    for row in readings {
        let mut row = row.clone();
        row.resize(width, 0.0);
        table.push(&[], &row, None).unwrap();
    }
    let selection = Selection { start: given.to_vec(), ..Selection::default() };
    let options = Options { selection, unconstrained: true, ..Options::default() };
    let (problem, _) = Problem::bind(&program, vec![(0, table)], &options).unwrap();
    let found = evaluate(&problem, &point(&problem, given)).unwrap();
    let outputs = &found.measurements[0].outputs;
    let of_row = |row: usize| {
        let [o, x, z]: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|i| outputs[3 * k + i].values[row]));
        let y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]];
        Motion { rotation: std::array::from_fn(|i| [x[i], y[i], z[i]]), origin: o }
    };
    (0..readings.len()).map(of_row).collect()
}

#[track_caller]
fn same(found: &Motion<f64>, expected: &Motion<f64>, within: f64, what: &str) {
    let apart = found.apart(expected);
    assert!(apart <= within, "{what}: {apart:e} apart\n{found:?}\n{expected:?}");
}

fn table(text: &str) -> Serial<f64> {
    let source = Source::new("table.csv", text);
    let read = read_table(&source, None, &TableUnits::default());
    read.unwrap_or_else(|found| panic!("{}\n{text}", phical::diag::text(&found, false))).serial
}

fn exported(session: &Session, given: &[(String, f64)], target: Target) -> Exported {
    let chain = ChainValues::of(session, &chain_name(session, None).unwrap(), None, given).unwrap();
    export(&chain, &session.program.units, target, None).unwrap()
}

const BOTH: [Convention; 2] = [Convention::Dh, Convention::ModifiedDh];

/// A robot of `fk_reference` as the table that somebody would have.
fn csv(robot: &Value) -> String {
    let links = robot["links"].as_array().unwrap();
    let modified = links[0]["convention"] == "modified";
    let mut text = format!("alpha,reads,joint [{}],offset,a,theta,d\n", if modified { "mdh" } else { "dh" });
    for (i, link) in links.iter().enumerate() {
        let number = |name: &str| link[name].as_f64().unwrap();
        let row = [number("offset"), number("a"), number("theta"), number("d")].map(|x| format!("{x:?}")).join(",");
        writeln!(text, "{:?},r,J{},{row}", number("alpha"), i + 1).unwrap();
    }
    let at = |i: usize, j: usize| robot["tool"][i][j].as_f64().unwrap();
    assert_eq!((at(2, 2), at(0, 3), at(1, 3)), (1.0, 0.0, 0.0), "a tool along z, turned about it");
    writeln!(text, "0,nothing,hand,,0,{:?},{:?}", at(1, 0).atan2(at(0, 0)), at(2, 3)).unwrap();
    text
}

#[test]
fn published_robots_keep_their_poses_through_every_form() {
    let mut worst = [0.0f64; 4];
    for name in ["Puma560", "UR5", "UR10", "Panda"] {
        let Some(robot) = shared_json(&format!("data/fk_reference/dh_{name}.json")) else { return };
        let samples = robot["samples"].as_array().unwrap();
        assert_eq!(samples.len(), 40);
        let readings: Vec<Vec<f64>> = samples.iter().map(|sample| numbers(&sample["q"])).collect();
        let expected: Vec<Motion<f64>> = samples
            .iter()
            .map(|sample| {
                let at = |i: usize, j: usize| sample["T"][i][j].as_f64().unwrap();
                Motion {
                    rotation: std::array::from_fn(|i| std::array::from_fn(|j| at(i, j))),
                    origin: std::array::from_fn(|i| at(i, 3)),
                }
            })
            .collect();
        let text = csv(&robot);
        let source = Source::new("robot.csv", text.clone());
        let read = read_table(&source, None, &TableUnits::default()).unwrap();
        let imported = model_text(&read, "robot.csv");
        let lines = imported.text.lines().count();
        assert!(lines < 100 && imported.free == 4 * readings[0].len() + 3, "{lines}\n{}", imported.text);
        let of_model = poses(&imported.text, &[], &readings);
        let session = session(&imported.text);
        assert!(session.warnings.is_empty(), "{:?}", session.warnings);
        let back = BOTH.map(|convention| {
            let target = Target::Table { convention, plain: false };
            let exported = exported(&session, &[], target);
            // the numbers of the data sheet are there again, and no more of them than needed
            assert!(!exported.text.contains("beta") && !exported.text.contains("base"), "{}", exported.text);
            (
                table(&exported.text),
                poses(
                    &model_text(
                        &read_table(&Source::new("a.csv", exported.text), None, &TableUnits::default()).unwrap(),
                        "a",
                    )
                    .text,
                    &[],
                    &readings,
                ),
            )
        });
        for (k, (q, expected)) in readings.iter().zip(&expected).enumerate() {
            let found = [of_model[k], back[0].0.pose(q), back[1].0.pose(q), back[0].1[k]];
            for (worst, found) in worst.iter_mut().zip(found) {
                *worst = worst.max(found.apart(expected));
                same(&found, expected, 1e-12, name);
            }
        }
    }
    eprintln!("fk_reference: model, dh, mdh, dh and model again are off by {worst:?}");
}

/// A joint of any kind: its text, and what it reads.
fn joint(kind: usize, at: usize, n: &[f64; 6]) -> (String, Option<&'static str>) {
    let [a, b, c, d, e, f] = n;
    let lengths = [0.3 * a, 0.3 * b];
    let phi = format!(
        "name: \"J{at}\", phi: {c:?}, d: {:?}, a: Held({:?}), b: {:?}, alpha: Held({d:?}), beta: Held({e:?})",
        0.1 * f,
        lengths[0],
        lengths[1]
    );
    let row = |reads: &str| {
        format!(
            "name: \"J{at}\", theta: Held({c:?}), d: Held({:?}), a: Held({:?}), alpha: Held({d:?}), beta: {:?}, reads: {reads}",
            lengths[0],
            lengths[1],
            0.01 * f
        )
    };
    match kind {
        0 => (format!("Revolute({phi})"), Some("rad")),
        1 => (format!("Prismatic({phi})"), Some("m")),
        2 => (format!("Fixed({phi})"), None),
        3 => (
            format!(
                "Rigid(name: \"J{at}\", x: Held({:?}), y: {:?}, rx: {c:?}, ry: {d:?}, rz: Held({e:?}))",
                lengths[0], lengths[1]
            ),
            None,
        ),
        4 => (format!("Dh({})", row("Angle")), Some("rad")),
        5 => (format!("Dh({})", row("Length")), Some("m")),
        6 => (format!("Dh({})", row("Nothing")), None),
        7 => (format!("ModifiedDh({})", row("Angle")), Some("rad")),
        8 => (format!("ModifiedDh({})", row("Length")), Some("m")),
        _ => (format!("Rigid(name: \"J{at}\", pose: \"{}\")", if *a > 0.0 { "place" } else { "turn" }), None),
    }
}

fn random_model(joints: &[(usize, [f64; 6])]) -> (String, usize) {
    let all: Vec<_> = joints.iter().enumerate().map(|(at, (kind, n))| joint(*kind, at, n)).collect();
    let chain: Vec<&str> = all.iter().map(|(text, _)| text.as_str()).collect();
    let units: Vec<&str> = all.iter().filter_map(|(_, unit)| *unit).collect();
    let inputs: String = units.iter().enumerate().map(|(k, unit)| format!("\"q{k}\": (unit: \"{unit}\"), ")).collect();
    let arguments: Vec<String> = (0..units.len()).map(|k| format!("q{k}")).collect();
    let text = format!(
        r#"(name: "any", units: (length: "m"),
            parameters: {{ "place": Pose(Held((0.1, -0.2, 0.3, 0.4, -0.5, 0.6))), "turn": Rotation(Held((0.3, 0.2, -0.1))) }},
            chains: {{"arm": [{}]}},
            measurements: {{"pose": (inputs: {{{inputs}"t": (unit: "m")}}, define: {{"f": "arm({})"}},
                residuals: {{"r": "f.o - vec(t, t, t)"}}, outputs: {{"o": "f.o", "x": "f.x", "z": "f.z"}})}})"#,
        chain.join(", "),
        arguments.join(", ")
    );
    (text, units.len())
}

/// Angles that chains have, angles near them as calibrations find, and any others.
fn angle() -> impl Strategy<Value = f64> {
    let part = (-6..=6i32).prop_map(|k| f64::from(k) * std::f64::consts::PI / 6.0);
    let near = ((-4..=4i32), -6..-2i32, -1.0..1.0f64)
        .prop_map(|(k, power, x)| f64::from(k) * std::f64::consts::FRAC_PI_2 + x * 10f64.powi(power));
    prop_oneof![3 => part, 3 => near, 1 => -3.0..3.0f64]
}

fn any_joint() -> impl Strategy<Value = (usize, [f64; 6])> {
    let length = || prop_oneof![Just(0.0), -1.0..1.0f64];
    (0usize..10, length(), length(), angle(), angle(), angle(), length())
        .prop_map(|(kind, a, b, c, d, e, f)| (kind, [a, b, c, d, e, f]))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(120) })]

    #[test]
    fn any_chain_of_any_joints_keeps_its_poses(
        joints in prop::collection::vec(any_joint(), 1..8),
        readings in prop::collection::vec(prop::collection::vec(-3.0..3.0f64, 8), 3),
    ) {
        let (text, moving) = random_model(&joints);
        prop_assume!(moving > 0);
        let readings: Vec<Vec<f64>> = readings.into_iter().map(|row| row[..moving].to_vec()).collect();
        let expected = poses(&text, &[], &readings);
        let session = session(&text);
        for convention in BOTH {
            let exported = exported(&session, &[], Target::Table { convention, plain: false });
            let source = Source::new("back.csv", exported.text.clone());
            let read = read_table(&source, None, &TableUnits::default()).unwrap();
            let again = poses(&model_text(&read, "back.csv").text, &[], &readings);
            for (k, q) in readings.iter().enumerate() {
                let found = read.serial.pose(q);
                prop_assert!(found.apart(&expected[k]) < 1e-12, "{:e}\n{}", found.apart(&expected[k]), exported.text);
                prop_assert!(again[k].apart(&expected[k]) < 1e-12, "{:e}\n{}", again[k].apart(&expected[k]), exported.text);
            }
        }
    }

    #[test]
    fn nothing_that_is_read_panics(text in "[ -~\n]{0,200}", table in "(joint|theta|d|a|alpha|min|[0-9,;.\n\"-]|pi|rad|[)(\\[]){0,60}") {
        for text in [text, format!("joint [dh],reads,theta,d,a,alpha\n{table}"), table] {
            let source = Source::new("any", text);
            let _ = read_table(&source, Some(Convention::Dh), &TableUnits::default());
            let _ = Urdf::read(&source);
        }
    }
}

/// The pose of a link, read from a URDF as plainly as can be.
fn urdf_pose(text: &str, tip: &str, reading: &dyn Fn(&str) -> f64) -> Motion<f64> {
    let document = roxmltree::Document::parse(text).unwrap();
    let joints: Vec<_> = document.root_element().children().filter(|node| node.has_tag_name("joint")).collect();
    let of = |node: &roxmltree::Node, child: &str, attribute: &str| {
        let child = node.children().find(|inside| inside.has_tag_name(child));
        child.and_then(|child| child.attribute(attribute).map(str::to_owned))
    };
    let three = |text: Option<String>, default: [f64; 3]| {
        let numbers = text.map(|text| text.split_whitespace().map(|x| x.parse().unwrap()).collect::<Vec<f64>>());
        numbers.map_or(Vector3::from(default), |all| Vector3::new(all[0], all[1], all[2]))
    };
    let mut pose = Isometry3::identity();
    let mut link = tip.to_owned();
    while let Some(joint) = joints.iter().find(|joint| of(joint, "child", "link").as_deref() == Some(&link)) {
        let rpy = three(of(joint, "origin", "rpy"), [0.0; 3]);
        let turned = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
        let origin = Isometry3::from_parts(Translation3::from(three(of(joint, "origin", "xyz"), [0.0; 3])), turned);
        let axis = Unit::new_normalize(three(of(joint, "axis", "xyz"), [1.0, 0.0, 0.0]));
        let name = joint.attribute("name").unwrap();
        let mimic = |attribute: &str| of(joint, "mimic", attribute).map(|x| x.parse::<f64>().unwrap());
        let q = match of(joint, "mimic", "joint") {
            Some(other) => mimic("multiplier").unwrap_or(1.0) * reading(&other) + mimic("offset").unwrap_or(0.0),
            None => reading(name),
        };
        let moved = match joint.attribute("type").unwrap() {
            "fixed" => Isometry3::identity(),
            "prismatic" => Isometry3::from_parts(Translation3::from(axis.into_inner() * q), UnitQuaternion::identity()),
            _ => Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(&axis, q)),
        };
        pose = origin * moved * pose;
        link = of(joint, "parent", "link").unwrap();
    }
    let r = pose.rotation.to_rotation_matrix();
    Motion {
        rotation: std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)])),
        origin: pose.translation.vector.into(),
    }
}

/// Axes of all directions, a joint that slides, one that goes along with another, a joint without an origin, and one fixed in between.
const ODD: &str = r#"<?xml version="1.0"?>
<robot name="odd arm"><link name="root"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/><link name="tip"/>
  <joint name="one" type="continuous"><parent link="root"/><child link="a"/><origin xyz="0.1 0.2 0.3" rpy="0.1 -0.2 0.3"/></joint>
  <joint name="two" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 0 -2"/><limit lower="-0.1" upper="0.4" effort="1" velocity="1"/></joint>
  <joint name="glue" type="fixed"><parent link="b"/><child link="c"/><origin rpy="0 1.5707963267948966 0"/></joint>
  <joint name="three" type="revolute"><parent link="c"/><child link="d"/><origin xyz='0 0 0.5' rpy='0.3 1.5707963267948966 0.2'/>
    <axis xyz="0.3 -0.4 0.5"/><limit upper="2"/></joint>
  <joint name="four" type="revolute"><parent link="d"/><child link="e"/><axis xyz="0 -1 0"/><mimic joint="two" multiplier="-3" offset="0.25"/></joint>
  <joint name="five" type="revolute"><parent link="e"/><child link="tip"/><origin xyz="0.2 0 0"/><axis xyz="0 -1 0"/></joint>
</robot>
"#;

/// A URDF through model and export: as it is, and with every free number a little off. Gives the worst difference of a pose.
fn there_and_back(text: &str, tip: &str, inputs: &[&str], ranges: f64) -> f64 {
    let source = Source::new("robot.urdf", text);
    let urdf = Urdf::read(&source).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)));
    let path = urdf.path(None, Some(tip)).unwrap();
    let imported = model_text(&robot_of(&urdf, &path), "robot.urdf");
    let session = session(&imported.text);
    assert!(session.warnings.is_empty(), "{:?}", session.warnings);
    let readings: Vec<Vec<f64>> = (0..20)
        .map(|row| (0..inputs.len()).map(|k| ranges * f64::from(row * 7 + 3).sin() * (k as f64 + 1.3).cos()).collect())
        .collect();
    let read = |q: &Vec<f64>, text: &str| {
        urdf_pose(text, tip, &|name| inputs.iter().position(|input| *input == name).map_or(0.0, |at| q[at]))
    };
    let off = |(k, p): (usize, &phical::compile::Parameter)| {
        (p.name.clone(), p.setting.nominal[0] + 1e-3 * (k as f64 * 1.7).sin())
    };
    let parameters = session.program.parameters.iter().filter(|p| p.dimensions.len() == 1 && p.setting.has_free());
    let given: Vec<(String, f64)> = parameters.enumerate().map(off).collect();
    let mut worst = 0.0f64;
    for given in [Vec::new(), given] {
        let exported = exported(&session, &given, Target::Urdf { urdf: &urdf, path: &path });
        // all but the values of origins stays
        let blank = |text: &str| {
            let mut rest = text.replace("\n    <origin ", "<origin ");
            for mark in ["xyz=\"", "rpy=\"", "xyz='", "rpy='"] {
                let parts: Vec<String> = rest
                    .split(mark)
                    .enumerate()
                    .map(|(k, part)| match (k, part.find(['"', '\''])) {
                        (0, _) | (_, None) => part.to_owned(),
                        (_, Some(end)) => part[end..].to_owned(),
                    })
                    .collect();
                rest = parts.concat();
            }
            rest.replace("<origin\"", "<origin").replace([' ', '"', '\''], "").replace("<origin/>", "")
        };
        assert_eq!(blank(&exported.text), blank(text));
        if given.is_empty() {
            assert_eq!(exported.text, text, "nothing was calibrated, and nothing is changed");
        }
        let again = Urdf::read(&Source::new("again.urdf", exported.text.clone())).unwrap();
        let robot = robot_of(&again, &again.path(None, Some(tip)).unwrap());
        let reimported = poses(&model_text(&robot, "again.urdf").text, &[], &readings);
        for ((q, expected), again) in readings.iter().zip(poses(&imported.text, &given, &readings)).zip(reimported) {
            let found = read(q, &exported.text);
            worst = worst.max(found.apart(&expected)).max(again.apart(&expected));
            same(&found, &expected, 1e-12, tip);
            same(&again, &expected, 1e-12, tip);
        }
    }
    worst
}

#[test]
fn urdf_files_keep_their_poses_there_and_back() {
    // a turn that follows a slide by a factor and an offset, by a factor of one; a slide that follows a turn
    let plainly = ODD.replace(r#" multiplier="-3" offset="0.25""#, "");
    let turned = plainly.replace(r#"type="revolute"><parent link="d""#, r#"type="prismatic"><parent link="d""#);
    let turned = turned.replace(r#"<mimic joint="two""#, r#"<mimic joint="one""#);
    for text in [ODD, &plainly, &turned] {
        let off = there_and_back(text, "tip", &["one", "two", "three", "five"], 1.5);
        eprintln!("odd arm: off by {off:e}");
    }
    let Some(file) = shared("data/panda_sockets/panda.urdf") else { return };
    let text = std::fs::read_to_string(file).unwrap();
    let joints: Vec<String> = (1..=7).map(|k| format!("panda_joint{k}")).collect();
    let mut inputs: Vec<&str> = joints.iter().map(String::as_str).collect();
    for tip in ["panda_link7", "panda_link8", "ball_link"] {
        eprintln!("panda to {tip}: off by {:e}", there_and_back(&text, tip, &inputs, 2.5));
    }
    inputs.push("panda_finger_joint1");
    eprintln!("panda to a finger: off by {:e}", there_and_back(&text, "panda_rightfinger", &inputs, 2.5));
}

#[test]
fn offsets_reversed_readings_and_units_mean_what_they_say() {
    let text = "name;type;theta (deg);d [mm];a (mm);alpha [deg];offset;sign;min;max\n\
                # a comment\n\
                base joint;R;0;300;50;-90;10;-1;-170;170\n\
                rail;P;90;0;0;0;25;-1;0;500\n\
                sin;R;pi/2;0;100;180;;;;\n";
    let source = Source::new("mixed.csv", text);
    let robot = read_table(&source, Some(Convention::Dh), &TableUnits::default()).unwrap();
    let imported = model_text(&robot, "mixed.csv");
    assert_eq!(imported.joints, ["base_joint", "rail", "sin_2"]);
    assert!(
        imported.text.contains("\"q1\": Uniform(\"-170 deg\", \"170 deg\"), \"q2\": Uniform(0, 500)"),
        "{}",
        imported.text
    );
    // the same by hand
    let d = f64::to_radians;
    let row =
        |theta: f64, along: f64, a: f64, alpha: f64| Motion::screw(2, theta, along).then(&Motion::screw(0, alpha, a));
    let readings = [[30.0, 40.0, -70.0], [-110.0, 1.0, 5.0]];
    // tables hold radians
    let held: Vec<Vec<f64>> = readings.iter().map(|q| vec![d(q[0]), q[1], d(q[2])]).collect();
    for (q, found) in readings.iter().zip(poses(&imported.text, &[], &held)) {
        let expected = row(d(10.0 - q[0]), 300.0, 50.0, d(-90.0))
            .then(&row(d(90.0), 25.0 - q[1], 0.0, 0.0))
            .then(&row(d(90.0 + q[2]), 0.0, 100.0, d(180.0)));
        same(&found, &expected, 1e-12 * 1000.0, "by hand");
    }
}
