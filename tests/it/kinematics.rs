//! Poses and Jacobians of published robots, from two other libraries.

use std::fmt::Write;

use phical::eval::{Evaluator, Leaf};
use serde_json::Value;

use crate::close::close;
use crate::flagship::compiled;
use crate::shared::{numbers, shared_json};

/// A robot of `fk_reference` as a model: its table in its own convention, base and tool as rigid joints.
fn model(robot: &Value) -> String {
    let rigid = |name: &str, m: &Value| {
        let at = |i: usize, j: usize| m[i][j].as_f64().unwrap();
        assert_eq!(at(2, 2), 1.0, "base and tool turn about z only");
        format!(
            "Rigid(name: {name:?}, x: {:?}, y: {:?}, z: {:?}, rz: {:?}),",
            at(0, 3),
            at(1, 3),
            at(2, 3),
            at(1, 0).atan2(at(0, 0))
        )
    };
    let links = robot["links"].as_array().unwrap();
    let mut joints = rigid("base", &robot["base"]);
    for (i, link) in links.iter().enumerate() {
        let number = |name: &str| link[name].as_f64().unwrap();
        let kind = if link["convention"] == "modified" { "ModifiedDh" } else { "Dh" };
        assert_eq!(link["joint"], "R");
        let theta = number("theta") + number("offset");
        write!(
            joints,
            "{kind}(name: \"J{i}\", theta: {theta:?}, d: {:?}, a: {:?}, alpha: {:?}),",
            number("d"),
            number("a"),
            number("alpha")
        )
        .unwrap();
    }
    joints += &rigid("tool", &robot["tool"]);
    let names: Vec<String> = (0..links.len()).map(|i| format!("q{i}")).collect();
    let inputs: String = names.iter().map(|name| format!("{name:?}: (unit: \"rad\"),")).collect();
    format!(
        r#"(name: "robot", units: (length: "m"), chains: {{"arm": [{joints}]}}, measurements: {{"pose": (
            inputs: {{{inputs}}}, define: {{"f": "arm({})"}}, residuals: {{"o": "f.o"}},
            outputs: {{"x": "f.x", "y": "f.y", "z": "f.z", "o": "f.o"}},
        )}})"#,
        names.join(", ")
    )
}

#[test]
fn poses_and_jacobians_of_four_robots() {
    for name in ["Puma560", "UR5", "UR10", "Panda"] {
        let Some(robot) = shared_json(&format!("data/fk_reference/dh_{name}.json")) else { return };
        let program = compiled(&model(&robot));
        let tape = &program.measurements[0].output_tape;
        let samples = robot["samples"].as_array().unwrap();
        assert_eq!(samples.len(), 40);
        for sample in samples {
            let q = numbers(&sample["q"]);
            let n = q.len();
            let mut evaluator = Evaluator::new(tape, (0..n).map(Leaf::Input).collect());
            evaluator.begin(&[]);
            let (mut pose, mut derivatives) = (vec![0.0; 12], vec![0.0; 12 * n]);
            evaluator.row(&q, &mut pose, &mut derivatives);
            let expected: Vec<f64> = (0..4)
                .flat_map(|j| (0..3).map(move |i| (i, j)))
                .map(|(i, j)| sample["T"][i][j].as_f64().unwrap())
                .collect();
            close(&pose, &expected, 1e-12, &format!("{name} T"));
            // dT/dqₖ: the columns turn with ω, the origin moves with v
            for k in 0..n {
                let twist: Vec<f64> = (0..6).map(|i| sample["J0"][i][k].as_f64().unwrap()).collect();
                let (v, w) = (&twist[..3], &twist[3..]);
                let mut moved = Vec::new();
                for column in expected[..9].chunks(3) {
                    moved.extend([
                        w[1] * column[2] - w[2] * column[1],
                        w[2] * column[0] - w[0] * column[2],
                        w[0] * column[1] - w[1] * column[0],
                    ]);
                }
                moved.extend(v);
                let found: Vec<f64> = (0..12).map(|i| derivatives[i * n + k]).collect();
                close(&found, &moved, 1e-9, &format!("{name} dT/dq{k}"));
            }
        }
    }
}
