//! The way that people go: import, measure, calibrate, export with the covariance.

use std::fs;

use phical::diag::Source;
use phical::exchange::{
    Convention, Motion, Row, Serial, TableUnits, Urdf, model_text, read_table, robot_of, serial_of,
};
use phical::model::Reads;
use serde_json::Value;
use tempfile::TempDir;

use crate::cli::{ends, json, path};
use crate::close::close;
use crate::shared::numbers;

/// A small arm whose axes 1 and 2 cross, 2 and 3 are parallel, and the last slides.
const ARM: &str = "joint,reads,theta,d,a,alpha,min,max\n\
                   J1,angle,0,0.4,0.05,-pi/2,-2.5,2.5\n\
                   J2,angle,0,0,0.5,0,-2,2\n\
                   J3,angle,0,0.1,0.4,pi/2,-2,2\n\
                   J4,length,0,0.2,0,0,0,0.3\n";

struct Flow {
    directory: TempDir,
    fit: Value,
}

impl Flow {
    fn path(&self, name: &str) -> String {
        path(&self.directory, name)
    }

    /// Standard uncertainties and values of the flange, row by row: its origin and two axes.
    fn evaluated(&self) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let found = json(0, &["evaluate", &self.path("model.ron"), "--fit", &self.path("fit.json")]);
        let outputs = found["measurements"]["pose"]["outputs"].as_array().unwrap().clone();
        assert_eq!(outputs.len(), 9);
        let column = |at: &str| outputs.iter().map(|output| numbers(output.pointer(at).unwrap())).collect();
        (column("/values"), column("/uncertainty/sigma"))
    }

    /// The readings of the rows.
    fn readings(&self) -> Vec<Vec<f64>> {
        let text = fs::read_to_string(self.path("pose.csv")).unwrap();
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let heading: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let count = heading.iter().filter(|name| name.starts_with('q')).count();
        lines.map(|line| line.split(',').take(count).map(|x| x.parse().unwrap()).collect()).collect()
    }
}

fn flow(file: &str, text: &str, import: &[&str]) -> Flow {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join(file), text).unwrap();
    let (from, model, fit) = (path(&directory, file), path(&directory, "model.ron"), path(&directory, "fit.json"));
    let mut arguments = vec!["import", &from, "--out", &model];
    arguments.extend(import);
    assert!(ends(0, &arguments).contains("written: chain"));
    assert_eq!(json(0, &["check", &model])["ok"], true);
    assert!(ends(0, &["identify", &model, "--structural"]).starts_with("All "));
    ends(0, &["simulate", &model, "--out", &directory.path().display().to_string()]);
    let fit = json(0, &["calibrate", &model, "--out", &fit]);
    Flow { directory, fit }
}

fn nine(pose: &Motion<f64>) -> Vec<f64> {
    [pose.origin, pose.axis(0), pose.axis(2)].concat()
}

/// The covariance beside an export: names without units, and the matrix.
fn covariance(file: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let name = |cell: &str| cell.split(" [").next().unwrap().to_owned();
    let names: Vec<String> = lines.next().unwrap().split(',').skip(1).map(name).collect();
    let rows = lines.map(|line| line.split(',').skip(1).map(|x| x.parse().unwrap()).collect()).collect();
    (names, rows)
}

/// What exported numbers and their covariance say of the poses is what the fit says.
fn predicts_alike(flow: &Flow, values: &[f64], matrix: &[Vec<f64>], pose: impl Fn(&[f64], &[f64]) -> Motion<f64>) {
    let (expected, sigma) = flow.evaluated();
    for (row, q) in flow.readings().iter().enumerate().step_by(9) {
        let at = |values: &[f64]| nine(&pose(values, q));
        let by: Vec<Vec<f64>> = (0..values.len())
            .map(|k| {
                let moved = |step: f64| {
                    let mut moved = values.to_vec();
                    moved[k] += step;
                    at(&moved)
                };
                let step = 1e-6;
                moved(step).iter().zip(moved(-step)).map(|(p, m)| (p - m) / (2.0 * step)).collect()
            })
            .collect();
        let found = at(values);
        let wanted: Vec<f64> = expected.iter().map(|column| column[row]).collect();
        close(&found, &wanted, 1e-12, "the pose");
        let deviation = |i: usize| {
            let sum = |k: usize| (0..values.len()).map(|l| by[k][i] * matrix[k][l] * by[l][i]).sum::<f64>();
            (0..values.len()).map(sum).sum::<f64>().max(0.0).sqrt()
        };
        let found: Vec<f64> = (0..9).map(deviation).collect();
        let wanted: Vec<f64> = sigma.iter().map(|column| column[row]).collect();
        // places in metres and directions are of one size here
        close(&found, &wanted, 2e-5, "its standard uncertainty");
    }
}

fn rows_of(text: &str) -> Vec<Row<f64>> {
    let mut lines = text.lines();
    let heading: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| heading.iter().position(|cell| cell.split(" [").next() == Some(name));
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |name: &str| column(name).map_or(0.0, |at| cells[at].parse().unwrap());
        let reads = match cells[1] {
            "angle" => Reads::Angle,
            "length" => Reads::Length,
            _ => Reads::Nothing,
        };
        Row { name: cells[0].to_owned(), reads, numbers: ["theta", "d", "a", "alpha", "beta"].map(number) }
    };
    lines.map(row).collect()
}

/// A table's numbers put in place of those that it has, by their names.
fn with(rows: &[Row<f64>], names: &[String], values: &[f64], convention: Convention) -> Serial<f64> {
    let mut rows = rows.to_vec();
    for (name, value) in names.iter().zip(values) {
        let (row, symbol) = name.rsplit_once('.').unwrap();
        let k = ["theta", "d", "a", "alpha", "beta"].iter().position(|known| *known == symbol).unwrap();
        rows.iter_mut().find(|known| known.name == row).unwrap().numbers[k] = *value;
    }
    serial_of(&rows, convention)
}

#[test]
fn calibrated_tables_have_the_poses_and_the_uncertainties_of_the_fit() {
    let flow = flow("arm.csv", ARM, &["--as", "dh"]);
    for (to, convention) in [("dh", Convention::Dh), ("mdh", Convention::ModifiedDh)] {
        let out = flow.path(&format!("out.{to}.csv"));
        let arguments = ["export", &flow.path("model.ron"), "--to", to, "--fit", &flow.path("fit.json"), "--out", &out];
        assert_eq!(
            json(0, &arguments)["numbers"].as_array().unwrap().iter().filter(|n| n["sigma"].is_null()).count(),
            0
        );
        let text = fs::read_to_string(&out).unwrap();
        // read again as any other table; sigmas are passed over
        let robot = read_table(&Source::new("out.csv", text.clone()), None, &TableUnits::default()).unwrap();
        let (expected, _) = flow.evaluated();
        for (row, q) in flow.readings().iter().enumerate() {
            let wanted: Vec<f64> = expected.iter().map(|column| column[row]).collect();
            close(&nine(&robot.serial.pose(q)), &wanted, 1e-12, to);
        }
        let (names, matrix) = covariance(&format!("{out}.covariance.csv"));
        let rows = rows_of(&text);
        let stated: Vec<f64> = names
            .iter()
            .map(|name| {
                let (row, symbol) = name.rsplit_once('.').unwrap();
                let k = ["theta", "d", "a", "alpha", "beta"].iter().position(|known| *known == symbol).unwrap();
                rows.iter().find(|known| known.name == row).unwrap().numbers[k]
            })
            .collect();
        predicts_alike(&flow, &stated, &matrix, |values, q| with(&rows, &names, values, convention).pose(q));
        derivatives_are_those_of_differences(&flow, to, &matrix);
    }
}

/// G C Gᵀ with G by central differences of whole exports, and by drawing from the fit.
fn derivatives_are_those_of_differences(flow: &Flow, to: &str, matrix: &[Vec<f64>]) {
    let names: Vec<String> =
        flow.fit["covariance"]["names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap().to_owned()).collect();
    let of_fit: Vec<Vec<f64>> = flow.fit["covariance"]["matrix"].as_array().unwrap().iter().map(numbers).collect();
    let value = |name: &String| {
        let found = flow.fit["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name.as_str());
        found.unwrap()["value"].as_f64().unwrap()
    };
    let nominal: Vec<f64> = names.iter().map(value).collect();
    let session = phical::session::Session::open(flow.path("model.ron").as_ref(), &[]).unwrap();
    let convention = if to == "dh" { Convention::Dh } else { Convention::ModifiedDh };
    let exported = |values: &[f64]| {
        let given: Vec<(String, f64)> = names.iter().cloned().zip(values.iter().copied()).collect();
        let chain = phical::exchange::ChainValues::of(&session, "arm", None, &given).unwrap();
        // as with a fit: whether the base has rows of its own
        let known = phical::fit::JointUncertainty {
            names: names.clone(),
            covariance: Some(of_fit.clone()),
            tolerances: vec![1e-4; names.len()],
            on_bound: vec![false; names.len()],
            null_directions: Vec::new(),
            dof: f64::INFINITY,
        };
        let target = phical::exchange::Target::Table { convention, plain: false };
        phical::exchange::export(&chain, &session.program.units, target, Some(&known)).unwrap().values
    };
    let m = matrix.len();
    let by: Vec<Vec<f64>> = (0..names.len())
        .map(|k| {
            let moved = |step: f64| {
                let mut moved = nominal.clone();
                moved[k] += step;
                exported(&moved)
            };
            moved(1e-6).iter().zip(moved(-1e-6)).map(|(p, n)| (p - n) / 2e-6).collect()
        })
        .collect();
    let product = |i: usize, j: usize| {
        (0..names.len()).map(|k| (0..names.len()).map(|l| by[k][i] * of_fit[k][l] * by[l][j]).sum::<f64>()).sum::<f64>()
    };
    let scale = |i: usize| matrix[i][i].sqrt();
    for (i, line) in matrix.iter().enumerate() {
        for (j, entry) in line.iter().enumerate().take(i + 1) {
            let found = product(i, j);
            assert!((found - entry).abs() <= 1e-5 * scale(i) * scale(j) + 1e-18, "{to} {i} {j}: {found} {entry}");
        }
    }
    // by drawing: a triangular root of the fit's covariance times normal numbers
    let n = names.len();
    let mut root = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| root[i][k] * root[j][k]).sum();
            root[i][j] = if i == j { (of_fit[i][i] - sum).max(0.0).sqrt() } else { (of_fit[i][j] - sum) / root[j][j] };
        }
    }
    let mut state = 7u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    };
    let draws = 200;
    let centre = exported(&nominal);
    let mut squares = vec![0.0; m];
    for _ in 0..draws {
        let z: Vec<f64> =
            (0..n).map(|_| (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect();
        let drawn: Vec<f64> = (0..n).map(|i| nominal[i] + (0..=i).map(|k| root[i][k] * z[k]).sum::<f64>()).collect();
        for (sum, (value, centre)) in squares.iter_mut().zip(exported(&drawn).iter().zip(&centre)) {
            *sum += (value - centre) * (value - centre) / f64::from(draws);
        }
    }
    for (k, square) in squares.iter().enumerate().filter(|(k, _)| scale(*k) > 1e-9) {
        // five standard deviations of a standard deviation of 200 draws
        assert!((square.sqrt() / scale(k) - 1.0).abs() < 0.25, "{to} {k}: {} {}", square.sqrt(), scale(k));
    }
}

const URDF: &str = r#"<robot name="arm"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="tip"/>
  <joint name="one" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5"/></joint>
  <joint name="two" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.05 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
  <joint name="three" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.5 0.1 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
  <joint name="flange" type="fixed"><parent link="c"/><child link="tip"/><origin xyz="0.3 0 0" rpy="0 1.2 0"/></joint>
</robot>
"#;

#[test]
fn a_calibrated_urdf_has_the_poses_and_the_uncertainties_of_the_fit() {
    let flow = flow("arm.urdf", URDF, &[]);
    let (original, out) = (flow.path("arm.urdf"), flow.path("new.urdf"));
    let arguments = [
        "export",
        &flow.path("model.ron"),
        "--to",
        "urdf",
        "--urdf",
        &original,
        "--fit",
        &flow.path("fit.json"),
        "--out",
        &out,
    ];
    let exported = json(0, &arguments);
    let text = fs::read_to_string(&out).unwrap();
    let urdf = Urdf::read(&Source::new("new.urdf", text)).unwrap();
    let path = urdf.path(None, None).unwrap();
    let robot = robot_of(&urdf, &path);
    assert_eq!(model_text(&robot, "new.urdf").free, 15);
    let (names, matrix) = covariance(&format!("{out}.covariance.csv"));
    let values: Vec<f64> =
        exported["numbers"].as_array().unwrap().iter().map(|n| n["value"].as_f64().unwrap()).collect();
    predicts_alike(&flow, &values, &matrix, |values, q| {
        let mut joints: Vec<_> = path.iter().map(|joint| (*joint).clone()).collect();
        for (name, value) in names.iter().zip(values) {
            let (joint, symbol) = name.rsplit_once('.').unwrap();
            let joint = joints.iter_mut().find(|known| known.name == joint).unwrap();
            match ["x", "y", "z", "roll", "pitch", "yaw"].iter().position(|known| *known == symbol).unwrap() {
                k @ 0..3 => joint.xyz[k] = *value,
                k => joint.rpy[k - 3] = *value,
            }
        }
        robot_of(&urdf, &joints.iter().collect::<Vec<_>>()).serial.pose(q)
    });
}

#[test]
fn what_stands_before_the_robot_can_be_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let (table, model) = (path(&directory, "arm.csv"), path(&directory, "model.ron"));
    fs::write(&table, ARM).unwrap();
    ends(0, &["import", &table, "--as", "dh", "--name", "my arm", "--out", &model]);
    let plain = ends(0, &["export", &model, "--to", "dh"]);
    let text = fs::read_to_string(&model).unwrap();
    let placed = text.replacen("Fixed(", "Rigid(name: \"tracker\", x: 2, rz: 0.3),\n            Fixed(", 1);
    fs::write(&model, placed).unwrap();
    assert!(text.contains("\"my_arm\": ["));
    assert_ne!(ends(0, &["export", &model, "--to", "dh"]), plain);
    assert_eq!(ends(0, &["export", &model, "--to", "dh", "--after", "tracker"]), plain);
    assert_eq!(crate::cli::refused(&["export", &model, "--to", "urdf"]), ["E042"]);
    assert_eq!(crate::cli::refused(&["export", &model, "--to", "dh", "--tip", "hand"]), ["E042"]);
    // nothing is written where anything cannot be
    let out = path(&directory, "no/out.csv");
    assert_eq!(crate::cli::refused(&["export", &model, "--to", "dh", "--out", &out]), ["E043"]);
}
