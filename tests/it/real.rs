//! Real data with known answers.

use std::path::Path;
use std::process::Command;

use phical::compile::{Program, compile};
use phical::data;
use phical::diag::{Diagnostics, Source};
use phical::fit::{Fit, analyse, read_values};
use phical::model::{DataFile, DataRole, load};
use phical::problem::{Options, Problem, Quantities, Selection, Weights};
use phical::solve::{Settings, minimise};

use crate::shared::{project, shared};

fn program(path: &str) -> Program {
    let source = Source::read(&project(path)).expect("the model is there");
    let (model, _) = load(&source).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)));
    compile(&model, &source, &[]).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false))).0
}

/// Binds the files of a role.
fn bound<'p>(program: &'p Program, folder: &str, role: DataRole, options: &Options) -> Problem<'p> {
    let mut tables = Vec::new();
    for (index, measurement) in program.measurements.iter().enumerate() {
        let files: Vec<DataFile> = measurement.data.iter().filter(|file| file.role == role).cloned().collect();
        let mut found = Diagnostics::new();
        let table = data::read(program, index, &files, &project(folder), &mut found);
        tables.push((index, table.unwrap_or_else(|| panic!("{}", phical::diag::text(&found, false)))));
    }
    Problem::bind(program, tables, options).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false))).0
}

fn fitted(problem: &Problem) -> Fit {
    let solution = minimise(problem, problem.start.clone(), &Settings::default()).expect("it starts");
    analyse(problem, solution).expect("defined")
}

/// The root mean square of the length of the three residuals from `first` on.
fn rms(problem: &Problem, block: usize, point: &[f64], first: usize) -> f64 {
    let block = &problem.blocks[block];
    let mut sum = 0.0;
    block
        .values(Quantities::Residuals, &problem.layout, point, |_, values| {
            sum += values[first..first + 3].iter().map(|v| v * v).sum::<f64>();
        })
        .expect("defined");
    (sum / block.table.rows() as f64).sqrt()
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} within {tolerance}");
}

#[test]
fn ur5_with_the_controllers_own_numbers() {
    let Some(controller) = shared("data/ur5_controller/calibration.conf") else { return };
    let program = program("models/ur5_pendant/model.ron");
    let nominal = bound(&program, "models/ur5_pendant", DataRole::Calibrate, &Options::default());
    assert_eq!(nominal.blocks[0].table.rows(), 18);
    near(rms(&nominal, 0, &nominal.start, 0), 1.120, 0.001);

    let folder = controller.parent().expect("a folder");
    let converted = Command::new("python3")
        .arg(project("models/ur5_pendant/convert.py"))
        .arg(folder)
        .output()
        .expect("python3 runs");
    assert!(converted.status.success());
    let start = read_values("deltas.json", &String::from_utf8(converted.stdout).expect("text")).expect("values");
    let selection = Selection { start, ..Selection::default() };
    let problem =
        bound(&program, "models/ur5_pendant", DataRole::Calibrate, &Options { selection, ..Options::default() });
    near(rms(&problem, 0, &problem.start, 0), 0.048, 0.0005);
    let mut worst = 0.0f64;
    let block = &problem.blocks[0];
    block
        .values(Quantities::Residuals, &problem.layout, &problem.start, |_, values| {
            worst = worst.max(values[3..].iter().map(|v| v * v).sum::<f64>().sqrt());
        })
        .expect("defined");
    assert!(worst.to_degrees() <= 0.038, "{}", worst.to_degrees());
}

#[test]
fn the_positioner_and_its_camera() {
    let Some(yaml) = shared("data/positioner_camera/measurements.yaml") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let csv = folder.path().join("measurements.csv");
    let converted =
        Command::new("python3").arg(project("models/positioner_camera/convert.py")).arg(yaml).arg(&csv).status();
    assert!(converted.expect("python3 runs").success());
    let program = program("models/positioner_camera/model.ron");
    let file = DataFile { file: csv.to_str().expect("text").into(), ..DataFile::default() };
    let mut found = Diagnostics::new();
    let table = data::read(&program, 0, &[file], Path::new("."), &mut found).expect("it reads");
    let (problem, _) = Problem::bind(&program, vec![(0, table)], &Options::default()).expect("it binds");
    assert_eq!((problem.weights, problem.free.len(), problem.blocks[0].table.rows()), (Weights::Sigma, 14, 205));
    near(rms(&problem, 0, &problem.start, 0), 136.0, 0.5);
    near(rms(&problem, 0, &problem.start, 3), 0.190, 0.0005);
    let fit = fitted(&problem);
    assert!(fit.verdict().trustworthy(), "{:?}", fit.verdict());
    near(rms(&problem, 0, &fit.point, 0), 0.411, 0.001);
    near(rms(&problem, 0, &fit.point, 3), 0.919e-3, 0.001e-3);
    let value = |name: &str| fit.parameters.iter().find(|p| p.name == name).expect("a parameter").value;
    near(value("tilt.a"), 0.63, 0.005);
    near(value("tilt.alpha"), -1.57036, 1e-5);
}

#[test]
fn the_panda_and_its_sockets() {
    if shared("data/panda_sockets/panda.urdf").is_none() {
        return;
    }
    let program = program("models/panda_sockets/model.ron");
    let problem = bound(&program, "models/panda_sockets", DataRole::Calibrate, &Options::default());
    let fit = fitted(&problem);
    assert!(fit.status.converged());
    assert!(fit.parameters.iter().all(|p| p.estimable));
    assert!(rms(&problem, 0, &fit.point, 0) <= 0.21);

    // on the right, unseen: its socket points are estimated, nothing else
    let start = fit.parameters.iter().map(|p| (p.name.clone(), p.value)).collect();
    let selection = Selection { start, ..Selection::default() };
    let right = bound(&program, "models/panda_sockets", DataRole::Check, &Options { selection, ..Options::default() });
    let sockets: Vec<usize> =
        right.free.iter().copied().filter(|&c| right.layout.coordinates[c].name.starts_with("socket[")).collect();
    assert_eq!(sockets.len(), 6);
    let right = right.with_free(sockets);
    let unseen = fitted(&right);
    assert!(rms(&right, 0, &unseen.point, 0) <= 0.29);
}
