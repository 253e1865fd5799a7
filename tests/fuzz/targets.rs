//! What is done with bytes that may be anything: six ways into the program, each with what has to hold behind it.
//!
//! The fuzzer's targets and `tests/it/fuzz.rs` both run these.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use phical::compare::{agreement, nested};
use phical::compile::compile;
use phical::data::{Table, read_input, write_to};
use phical::diag::{self, Diagnostics, Source};
use phical::evaluate::point;
use phical::exchange::{Convention, TableUnits, Urdf, model_text, read_table, robot_of};
use phical::lang;
use phical::model::{self, DataFile};
use phical::problem::{Execution, Options, Problem, Selection, Weights};
use phical::session::{Against, Choice, Running, Sequence, Session, Values};
use phical::simd::InstructionSet;
use phical::solve::LeastSquares;

/// A target and its name.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: [Target; 6] =
    [("model", model), ("expression", expression), ("csv", csv), ("fit", fit), ("matrix", matrix), ("import", import)];

/// Diagnostics can be shown, whatever they say.
fn shown(found: &Diagnostics) {
    let _ = diag::text(found, false);
    let _ = diag::json(found);
}

/// One thread: the fuzzer has its own.
fn alone() -> Options {
    let execution = Execution::new(InstructionSet::detect(), 1);
    Options { weights: Some(Weights::Unit), execution, ..Options::default() }
}

/// A model is read or refused; what is read is printed and read again as the same; what compiles has values and derivatives, or
/// says where it has none.
pub fn model(data: &[u8]) {
    /// Operations of which the values are worth waiting for.
    const MOST_OPERATIONS: usize = 20_000;
    let Ok(text) = std::str::from_utf8(data) else { return };
    let source = Source::new("model.ron", text);
    let model = match model::load(&source) {
        Ok((model, warnings)) => {
            shown(&warnings);
            model
        }
        Err(found) => return shown(&found),
    };
    let printed = model::print(&model);
    match model::load(&Source::new("printed.ron", printed.as_str())) {
        Ok((again, _)) => assert!(again == model, "another model is printed:\n{printed}"),
        Err(found) => panic!("what is printed cannot be read:\n{printed}\n{}", diag::text(&found, false)),
    }
    let program = match compile(&model, &source, &[]) {
        Ok((program, warnings)) => {
            shown(&warnings);
            program
        }
        Err(found) => return shown(&found),
    };
    let operations: usize = program.measurements.iter().map(|m| phical::problem::operations(&program, m).per_row).sum();
    if operations > MOST_OPERATIONS {
        return;
    }
    let made = |(index, measurement): (usize, &phical::compile::Measurement)| {
        let (keys, inputs) = (measurement.keys.len(), measurement.inputs.len());
        let mut table = Table::new(keys, inputs);
        table.begin("rows");
        for row in 0..3 {
            let readings: Vec<f64> = (0..inputs).map(|input| 0.3 + 0.1 * (row * 7 + input * 3) as f64).collect();
            let names = vec![["a", "b", "a"][row]; keys];
            table.push(&names, &readings, None).expect("a row of the table");
        }
        (index, table)
    };
    let with_residuals = program.measurements.iter().enumerate().filter(|(_, m)| !m.residuals.is_empty());
    match Problem::bind(&program, with_residuals.map(made).collect(), &alone()) {
        Ok((problem, warnings)) => {
            shown(&warnings);
            if let Ok((cost, information)) = problem.evaluate(&problem.start) {
                assert!(!cost.is_nan() && information.r().is_finite() || !cost.is_finite(), "a silent NaN: {text}");
            }
        }
        Err(found) => shown(&found),
    }
}

/// A session of a model that is right.
fn session(text: &str) -> Session {
    let source = Source::new("model.ron", text);
    let (model, warnings) = model::load(&source).expect("a model");
    let (program, _) = compile(&model, &source, &[]).expect("a program");
    let fingerprint = phical::data::fingerprint(text.as_bytes());
    // in a directory that is not there
    let path = PathBuf::from("/nowhere/model.ron");
    Session { path, model, program, warnings, fingerprint, read_ns: 0, compile_ns: 0 }
}

/// An expression is read or refused; what is read is printed and read again as the same; in a model it is compiled or refused.
pub fn expression(data: &[u8]) {
    static SCOPE: OnceLock<(model::Model, Arc<Source>)> = OnceLock::new();
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Ok(parsed) = lang::parse(text) {
        let printed = lang::print(&parsed);
        let again = lang::parse(&printed).unwrap_or_else(|error| panic!("`{text}` is printed as `{printed}`: {error}"));
        assert!(parsed.same(&again), "`{text}` is printed as `{printed}`");
    }
    let _ = lang::parse_relation(text);
    let _ = lang::parse_signature(text);
    let (model, source) = SCOPE.get_or_init(|| {
        let source = Source::new("model.ron", include_str!("expression.ron"));
        (model::load(&source).expect("a model").0, source)
    });
    match compile(model, source, &[text.to_owned()]) {
        Ok((_, found)) | Err(found) => shown(&found),
    }
}

/// A table is read or refused; what is read is finite, and written and read again as the same. The first byte says how the columns
/// are declared.
pub fn csv(data: &[u8]) {
    static TABLES: OnceLock<Session> = OnceLock::new();
    let Some((&first, text)) = data.split_first() else { return };
    let session = TABLES.get_or_init(|| session(include_str!("csv.ron")));
    let program = &session.program;
    let measurements = &session.model.measurements;
    let index = usize::from(first) % program.measurements.len();
    let declared = measurements.get(&program.measurements[index].name).expect("the same measurements");
    let file = &declared.data.0[0];
    let mut found = Diagnostics::new();
    let table = read_input(program, index, file, text, &mut found);
    shown(&found);
    let Some(table) = table else { return };
    assert!((0..table.rows()).all(|row| table.row(row).iter().all(|reading| reading.is_finite())));
    let mut written = Vec::new();
    // a reading that is finite in radians may not be in the unit of its column
    if write_to(program, index, &table, &mut written).is_err() {
        return;
    }
    let headed = DataFile { file: "written.csv".into(), ..DataFile::default() };
    let again = read_input(program, index, &headed, &written[..], &mut found);
    let again = again.unwrap_or_else(|| panic!("what is written cannot be read: {}", diag::text(&found, false)));
    assert_eq!(table.rows(), again.rows());
    for row in 0..table.rows() {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-15 * a.abs().max(f64::MIN_POSITIVE / f64::EPSILON);
        assert!(table.row(row).iter().zip(again.row(row).iter()).all(near), "{}", String::from_utf8_lossy(&written));
        assert!((0..program.measurements[index].keys.len()).all(|key| table.key(row, key) == again.key(row, key)));
    }
}

/// The model that fits, states and matrices are held against, with its rows.
fn line() -> &'static (Session, Table) {
    static LINE: OnceLock<(Session, Table)> = OnceLock::new();
    LINE.get_or_init(|| {
        let session = session(include_str!("line.ron"));
        let mut found = Diagnostics::new();
        let file = DataFile { file: "line.csv".into(), ..DataFile::default() };
        let table = read_input(&session.program, 0, &file, &include_bytes!("line.csv")[..], &mut found).expect("rows");
        (session, table)
    })
}

/// Something that can only be read from a file.
fn in_a_file<T>(data: &[u8], ending: &str, read: impl FnOnce(&str) -> T) -> T {
    let memory = PathBuf::from("/dev/shm");
    let directory = if memory.is_dir() { memory } else { std::env::temp_dir() };
    let file = tempfile::Builder::new().suffix(ending).tempfile_in(directory).expect("a file");
    std::fs::write(file.path(), data).expect("written");
    read(&file.path().display().to_string())
}

/// A fit, an object of values, or a state is read or refused; what is read can be started from, compared with itself, and gone on from.
pub fn fit(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (session, table) = line();
    if text.contains("phical state") {
        let sequence = Sequence { resume: Vec::new(), ..Sequence::default() };
        return in_a_file(data, ".json", |file| {
            let sequence = Sequence { resume: vec![file.to_owned()], ..sequence };
            let mut tell = |_: usize, _: &phical::fit::Fit| ();
            let mut running = Running::new(session, alone(), sequence, &mut tell);
            let read = running.read(&Choice { given_only: true, ..Choice::default() });
            match read.and_then(|coming| running.take_in(coming)).and_then(|()| running.finish()) {
                Ok(bound) => shown(&bound.warnings),
                Err(found) => shown(&found),
            }
        });
    }
    let values = match phical::fit::read_values("fit.json", text) {
        Ok(values) => values,
        Err(found) => return shown(&Diagnostics::from(*found)),
    };
    let json = serde_json::from_str(text).unwrap_or_default();
    let values = Values { file: "fit.json".to_owned(), values, json };
    let stated = match values.uncertainty(session) {
        Ok(stated) => stated,
        Err(found) => return shown(&Diagnostics::from(*found)),
    };
    let selection = Selection { start: values.values.clone(), ..Selection::default() };
    match Problem::bind(&session.program, vec![(0, table.clone())], &Options { selection, ..alone() }) {
        Ok((problem, warnings)) => {
            shown(&warnings);
            let _ = problem.evaluate(&problem.start);
            let there = point(&problem, &values.values);
            let _ = agreement(&problem, [&there, &problem.start], [&stated, &stated]);
        }
        Err(found) => shown(&found),
    }
    let _ = nested(&values, &values);
}

/// A matrix is read or refused; what is read is judged against the model.
pub fn matrix(data: &[u8]) {
    let (session, _) = line();
    let ending = if data.first().is_some_and(|first| matches!(first, b'{' | b'[')) { ".json" } else { ".csv" };
    in_a_file(data, ending, |file| {
        let at = data_file();
        let against = Against { file: file.to_owned(), data: vec![("m".to_owned(), at)], ..Against::default() };
        match against.run(session) {
            Ok((_, found)) | Err(found) => shown(&found),
        }
    });
}

/// A robot of another program is read or refused; what is read is a model that compiles.
pub fn import(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let source = Source::new("robot", text);
    let read = if text.trim_start().starts_with('<') {
        Urdf::read(&source).and_then(|urdf| urdf.path(None, None).map(|path| robot_of(&urdf, &path)))
    } else {
        read_table(&source, Some(Convention::Dh), &TableUnits::default())
    };
    let robot = match read {
        Ok(robot) => robot,
        Err(found) => return shown(&found),
    };
    let imported = model_text(&robot, "robot");
    let source = Source::new("model.ron", imported.text.as_str());
    let compiled = model::load(&source).and_then(|(model, _)| compile(&model, &source, &[]));
    if let Err(found) = compiled {
        panic!("what is imported is no model:\n{}\n{}", imported.text, diag::text(&found, false));
    }
}

/// The rows of the matrices' model, whether this is compiled by the fuzzer's package or by the crate's tests.
fn data_file() -> String {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let own = package.join("line.csv");
    let file = if own.exists() { own } else { package.join("tests/fuzz/line.csv") };
    file.display().to_string()
}
