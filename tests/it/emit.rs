//! Emitted code against the engine: compiled, run, and compared at random points, in every language.
//!
//! All models of a test are one program in each language, so that compilers run once.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use phical::compile::Program;
use phical::data::Table;
use phical::emit::{Language, ROWS, Routine, emit};
use phical::evaluate::jacobians;
use phical::graph::{Graph, OPERATIONS, Operation, Scalar, Tape};
use phical::problem::{Options, Problem, Selection, Weights};
use phical::session::Session;
use phical::unit::Dimension;
use proptest::strategy::{Strategy, ValueTree};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

use crate::close::relative_error;
use crate::flagship::compiled;
use crate::random::models;
use crate::shared::project;

/// Off by at most this share of the largest entry of a row.
const NEAR: f64 = 1e-11;

/// By how much a last digit of the arguments may change what is compared.
const STEADY: f64 = 2e-13;

/// Arguments, and what the engine gives: r, ∂r/∂q, ∂r/∂m and ∂r/∂x by residual; none where something is undefined.
struct Point {
    q: Vec<f64>,
    x: Vec<f64>,
    m: Vec<f64>,
    expected: Option<Expected>,
}

struct Expected {
    r: Vec<f64>,
    by: [Vec<Vec<f64>>; 3],
}

impl Expected {
    /// The largest of all numbers, or 1.
    fn largest(&self) -> f64 {
        let all = self.by.iter().flatten().flatten().chain(&self.r);
        all.fold(1.0, |largest: f64, value| largest.max(value.abs()))
    }
}

/// One measurement of a model, written in a language, and where it is looked at.
struct Case {
    name: String,
    program: Program,
    measurement: usize,
    selection: Selection,
    points: Vec<Point>,
}

/// Numbers that look random, evenly from −1 to 1.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

impl Case {
    fn new(name: &str, program: &Program, measurement: usize, selection: Selection) -> Case {
        let mut case =
            Case { name: name.to_owned(), program: program.clone(), measurement, selection, points: Vec::new() };
        let routine = case.emitted(Language::Rust).1;
        let mut draws = Draws(name.len() as u64 + 7);
        for attempt in 0..80 {
            case.points.extend(case.point(&routine, &mut draws, 0.92f64.powi(attempt)));
            if case.points.len() == 3 {
                break;
            }
        }
        assert!(!case.points.is_empty(), "{name} is defined nowhere");
        case
    }

    fn emitted(&self, language: Language) -> (String, Routine) {
        let mut emitted = emit(&self.program, &[self.measurement], &self.selection, language)
            .unwrap_or_else(|found| panic!("{}: {}", self.name, phical::diag::text(&found, false)));
        (emitted.code, emitted.routines.remove(0))
    }

    /// A row at random numbers, each near its nominal value by a share of what it may be.
    fn point(&self, routine: &Routine, draws: &mut Draws, reach: f64) -> Option<Point> {
        let measurement = &self.program.measurements[self.measurement];
        let units = &self.program.units;
        let keys: Vec<String> = (1..=measurement.keys.len()).map(|k| format!("m{k}")).collect();
        let largest = |dimension: Dimension| {
            let all = self.program.parameters.iter().flat_map(|p| p.dimensions.iter().zip(&p.setting.nominal));
            let most = all.filter(|(d, _)| **d == dimension).fold(0.0, |most: f64, (_, v)| most.max(v.abs()));
            if most > 0.0 { 1.5 * most } else { 1.0 }
        };
        let readings: Vec<f64> = measurement
            .inputs
            .iter()
            .map(|input| match (input.default, input.unit.dimension) {
                (Some(default), _) => default + 0.1 * reach * draws.next(),
                (None, Dimension::ANGLE) => 3.0 * reach * draws.next(),
                (None, dimension) => largest(dimension) * reach * draws.next(),
            })
            .collect();
        let mut table = Table::new(keys.len(), readings.len());
        table.push(&keys.iter().map(String::as_str).collect::<Vec<_>>(), &readings, None).expect("a row of the table");
        let selection = self.selection.clone();
        let options = Options { weights: Some(Weights::Unit), selection, unconstrained: true, ..Options::default() };
        let problem = Problem::bind(&self.program, vec![(self.measurement, table)], &options).expect("it binds").0;
        let mut point = problem.start.clone();
        for (value, coordinate) in point.iter_mut().zip(&problem.layout.coordinates) {
            let moves = routine.parameters.iter().any(|p| p.name == coordinate.name) || coordinate.name.contains('[');
            let step = reach * (0.02 * value.abs() + 10.0 * coordinate.tolerance + 0.01) * draws.next();
            *value = if moves { (*value + step).clamp(coordinate.min, coordinate.max) } else { *value };
        }
        let jacobian = jacobians(&problem, &point).ok()?.remove(0);
        // the same but for rounding of all arguments: where that shows, there is nothing to compare
        let mut moved = Table::new(keys.len(), readings.len());
        let mut rounded = |value: f64| value * (1.0 + 4.0 * f64::EPSILON * draws.next());
        let beside: Vec<f64> = readings.iter().map(|&value| rounded(value)).collect();
        moved.push(&keys.iter().map(String::as_str).collect::<Vec<_>>(), &beside, None).expect("a row of the table");
        let near = Problem::bind(&self.program, vec![(self.measurement, moved)], &options).expect("it binds").0;
        let beside: Vec<f64> = point.iter().map(|&value| rounded(value)).collect();
        let beside = jacobians(&near, &beside).ok()?.remove(0);
        let all = |of: &phical::evaluate::Jacobian| -> Vec<Vec<f64>> {
            let rows = of.dr_dq[0].iter().zip(&of.dr_dx[0]).map(|(q, x)| [&q[..], x].concat());
            rows.chain([of.r[0].clone()]).collect()
        };
        let steady =
            |(a, b): (&Vec<f64>, &Vec<f64>)| relative_error(a, b) <= STEADY || a.iter().all(|v| v.abs() < 1e-13);
        if !all(&jacobian).iter().zip(&all(&beside)).all(steady) {
            return None;
        }
        let coordinate = |name: &str| problem.layout.find(name).unwrap_or_else(|| panic!("no {name}"));
        let value = |name: &str| {
            let c = coordinate(name);
            units.to_reported(point[c], problem.layout.coordinates[c].dimension)
        };
        // `socket[hole].x` in the row whose hole is m1 is `socket[m1].x`
        let member = |name: &str| {
            let (family, rest) = name.split_once('[').expect("a member");
            let (columns, suffix) = rest.rsplit_once(']').expect("a member");
            let of = |column: &str| keys[measurement.keys.iter().position(|key| key == column).expect("a key")].clone();
            format!("{family}[{}]{suffix}", columns.split('/').map(of).collect::<Vec<_>>().join("/"))
        };
        let members: Vec<String> = routine.members.iter().map(|number| member(&number.name)).collect();
        let place = |name: &str| jacobian.parameters.iter().position(|(known, _)| known == name).expect("a column");
        let columns = |names: &mut dyn Iterator<Item = &str>| {
            let places: Vec<usize> = names.map(place).collect();
            let row = |row: &Vec<f64>| places.iter().map(|&k| row[k]).collect::<Vec<f64>>();
            jacobian.dr_dq[0].iter().map(row).collect::<Vec<_>>()
        };
        let by_q = columns(&mut routine.columns.iter().map(|&k| routine.parameters[k].name.as_str()));
        let by_m = columns(&mut routine.member_columns.iter().map(|&k| members[k].as_str()));
        let expected = Expected { r: jacobian.r[0].clone(), by: [by_q, by_m, jacobian.dr_dx[0].clone()] };
        let small = |v: &f64| v.abs() < 1e12;
        if !expected.r.iter().all(small) || !expected.by.iter().flatten().flatten().all(small) {
            return None;
        }
        Some(Point {
            q: routine.parameters.iter().map(|p| value(&p.name)).collect(),
            x: jacobian.rows[0].clone(),
            m: members.iter().map(|name| value(name)).collect(),
            expected: Some(expected),
        })
    }

    /// Compares what functions gave, by point, with what the engine gave.
    fn compare(&self, found: &[Option<Vec<f64>>]) -> Result<(), String> {
        let routine = self.emitted(Language::Rust).1;
        for (k, (point, found)) in self.points.iter().zip(found).enumerate() {
            let what = format!("{}, point {k}", self.name);
            let (found, expected) = match (found, &point.expected) {
                (Some(found), Some(expected)) => (found, expected),
                (None, None) => continue,
                (found, _) => {
                    return Err(format!(
                        "{what}: defined by {}",
                        ["the engine", "the code"][usize::from(found.is_some())]
                    ));
                }
            };
            let mut found = found.as_slice();
            let mut take = |count: usize| {
                let (first, rest) = found.split_at(count.min(found.len()));
                found = rest;
                first.to_vec()
            };
            for (function, arrays) in functions(&routine) {
                let error = relative_error(&take(expected.r.len()), &expected.r);
                if error > NEAR {
                    return Err(format!("{what}, {function}: r is off by {error:e}"));
                }
                let given: Vec<Vec<Vec<f64>>> = arrays
                    .iter()
                    .map(|&array| expected.by[array].iter().map(|row| take(row.len())).collect())
                    .collect();
                for i in 0..expected.r.len() {
                    let row: Vec<f64> = given.iter().flat_map(|array| array[i].clone()).collect();
                    let wanted: Vec<f64> = arrays.iter().flat_map(|&array| expected.by[array][i].clone()).collect();
                    let error = relative_error(&row, &wanted);
                    // what is zero by mathematics may be so but for rounding
                    let rounding = row.iter().zip(&wanted).all(|(f, e)| (f - e).abs() <= 1e-15 * expected.largest());
                    if error > NEAR && !rounding {
                        let name = &routine.residuals[i].name;
                        return Err(format!(
                            "{what}, {function}: derivatives of {name} are off by {error:e}\n{row:?}\n{wanted:?}"
                        ));
                    }
                }
            }
            if !found.is_empty() {
                return Err(format!("{what}: more than was wanted"));
            }
        }
        Ok(())
    }

    /// The points for a program, a line each.
    fn lines(&self, index: usize) -> String {
        let line = |point: &Point| {
            let all = point.q.iter().chain(&point.x).chain(&point.m);
            format!("{index}{}\n", all.map(|value| format!(" {value:?}")).collect::<String>())
        };
        self.points.iter().map(line).collect()
    }
}

/// Functions that have derivatives, each with the arrays that it fills: by parameters, members, inputs.
fn functions(routine: &Routine) -> Vec<(&'static str, Vec<usize>)> {
    let sizes = [routine.columns.len(), routine.member_columns.len(), routine.inputs.len()];
    let arrays = |of: std::ops::Range<usize>| of.filter(|&array| sizes[array] > 0).collect::<Vec<_>>();
    let mut all = vec![("residuals", Vec::new())];
    if !arrays(0..2).is_empty() && sizes[2] > 0 {
        all.push(("jacobian", arrays(0..2)));
        all.push(("jacobian_rows", arrays(0..2)));
    }
    if !arrays(0..3).is_empty() {
        all.push(("derivatives", arrays(0..3)));
    }
    all
}

const NAMES: [&str; 3] = ["dr_dq", "dr_dm", "dr_dx"];

/// How many numbers an argument or a row of results has.
fn width(routine: &Routine, array: usize) -> usize {
    [routine.columns.len(), routine.member_columns.len(), routine.inputs.len()][array]
}

/// A tool, or none with a loud line.
fn tool(name: &str) -> Option<String> {
    let found = Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    if !found {
        eprintln!("SKIPPED: {name} is not present");
    }
    found.then(|| name.to_owned())
}

fn succeeded(what: &str, output: Output) -> String {
    let say = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{what}\n{}\n{}", say(&output.stdout), say(&output.stderr));
    say(&output.stdout)
}

/// The word that stands between two texts, first.
fn between<'t>(text: &'t str, before: &str, after: &str) -> &'t str {
    text.split(before)
        .nth(1)
        .and_then(|rest| rest.split(after).next())
        .unwrap_or_else(|| panic!("no {before} in {text}"))
}

/// A Rust program of all cases: modules, and a test that runs them beside their own tests.
fn rust_program(codes: &[(String, Routine)]) -> String {
    let mut all = String::new();
    for (i, (code, _)) in codes.iter().enumerate() {
        write!(all, "pub mod c{i} {{\n{code}\n}}\n").expect("a string");
    }
    all + "#[cfg(test)] mod driver;\n"
}

fn rust_driver(codes: &[(String, Routine)]) -> String {
    let mut out = String::from(
        "#[test]\nfn drive() {\n    let text = std::fs::read_to_string(\"points\").unwrap();\n    let mut out = String::new();\n    \
         for line in text.lines() {\n        let (case, rest) = line.split_once(' ').unwrap_or((line, \"\"));\n        \
         let v: Vec<f64> = rest.split_whitespace().map(|v| v.parse().unwrap()).collect();\n        \
         let found = match case {\n",
    );
    for i in 0..codes.len() {
        writeln!(out, "            \"{i}\" => case{i}(&v),").expect("a string");
    }
    out += "            _ => panic!(),\n        };\n        match found {\n            None => out += \"undefined\\n\",\n            \
            Some(all) => out += &(all.iter().map(|v| format!(\"{v:?} \")).collect::<String>() + \"\\n\"),\n        }\n    }\n    \
            std::fs::write(\"found\", out).unwrap();\n}\n";
    for (i, (code, routine)) in codes.iter().enumerate() {
        let module = between(code, "pub mod ", " {");
        let (n, k, m) = (routine.parameters.len(), routine.inputs.len(), routine.residuals.len());
        writeln!(out, "#[allow(unused)]\nfn case{i}(v: &[f64]) -> Option<Vec<f64>> {{\n    use crate::c{i}::{module}::*;\n    let mut out = Vec::new();").expect("a string");
        let q = if n > 0 { format!("v[..{n}].try_into().unwrap()") } else { String::new() };
        writeln!(out, "    let p = prepare({q});").expect("a string");
        for (function, arrays) in functions(routine) {
            let rows = function == "jacobian_rows";
            let mut call = String::from("&p");
            for (first, count) in [(n, k), (n + k, routine.members.len())] {
                if count > 0 && rows {
                    write!(call, ", &std::array::from_fn::<_, {count}, _>(|k| [v[{first} + k]; {ROWS}])")
                        .expect("a string");
                } else if count > 0 {
                    write!(call, ", v[{first}..{}].try_into().unwrap()", first + count).expect("a string");
                }
            }
            let zero = if rows { format!("[9.0; {ROWS}]") } else { "9.0".to_owned() };
            writeln!(out, "    let mut r = [{zero}; {m}];").expect("a string");
            call += ", &mut r";
            for &array in &arrays {
                writeln!(out, "    let mut {} = [[{zero}; {}]; {m}];", NAMES[array], width(routine, array))
                    .expect("a string");
                write!(call, ", &mut {}", NAMES[array]).expect("a string");
            }
            writeln!(out, "    {function}({call}).ok()?;").expect("a string");
            let last = if rows { format!(".map(|v| v[{}])", ROWS - 1) } else { ".copied()".to_owned() };
            writeln!(out, "    out.extend(r.iter(){last});").expect("a string");
            for &array in &arrays {
                writeln!(out, "    out.extend({}.as_flattened().iter(){last});", NAMES[array]).expect("a string");
            }
        }
        out += "    Some(out)\n}\n";
    }
    out
}

fn c_program(codes: &[(String, Routine)]) -> String {
    let mut out = String::new();
    let mut cases = String::new();
    for (i, (code, routine)) in codes.iter().enumerate() {
        let name = code.split("_residuals(").next().and_then(|before| before.rsplit(' ').next()).expect("a name");
        // several models may have a measurement of one name
        out += &code.replace(&format!("{name}_"), &format!("c{i}_{name}_"));
        let name = format!("c{i}_{name}");
        let (n, k, m) = (routine.parameters.len(), routine.inputs.len(), routine.residuals.len());
        writeln!(cases, "static int case{i}(const double *v)\n{{\n    struct {name}_prepared p;\n    (void)v;\n    {name}_prepare({}&p);", if n > 0 { "v, " } else { "" }).expect("a string");
        let mut print = String::new();
        for (function, arrays) in functions(routine) {
            let rows = function == "jacobian_rows";
            let last = if rows { format!("[{}]", ROWS - 1) } else { String::new() };
            let lanes = if rows { format!("[{ROWS}]") } else { String::new() };
            let mut call = String::from("&p");
            for (what, first, count) in [("x", n, k), ("m", n + k, routine.members.len())] {
                if count > 0 && rows {
                    writeln!(cases, "    double {what}_{function}[{count}][{ROWS}];\n    for (int i = 0; i < {count}; i++)\n        for (int k = 0; k < {ROWS}; k++)\n            {what}_{function}[i][k] = v[{first} + i];").expect("a string");
                    write!(call, ", {what}_{function}").expect("a string");
                } else if count > 0 {
                    write!(call, ", v + {first}").expect("a string");
                }
            }
            writeln!(cases, "    double r_{function}[{m}]{lanes};").expect("a string");
            write!(call, ", r_{function}").expect("a string");
            writeln!(print, "    for (int i = 0; i < {m}; i++)\n        printf(\"%.17g \", r_{function}[i]{last});")
                .expect("a string");
            for &array in &arrays {
                let (name, width) = (NAMES[array], width(routine, array));
                writeln!(cases, "    double {name}_{function}[{m}][{width}]{lanes};").expect("a string");
                write!(call, ", {name}_{function}").expect("a string");
                writeln!(print, "    for (int i = 0; i < {m}; i++)\n        for (int j = 0; j < {width}; j++)\n            printf(\"%.17g \", {name}_{function}[i][j]{last});").expect("a string");
            }
            writeln!(cases, "    if ({name}_{function}({call}))\n        return 1;").expect("a string");
        }
        cases += &print;
        cases += "    return 0;\n}\n";
    }
    out += "#include <stdio.h>\n#include <stdlib.h>\n";
    out += &cases;
    out += "int main(void)\n{\n    static char line[1 << 20];\n    static double v[1 << 14];\n    while (fgets(line, sizeof line, stdin)) {\n        \
            char *at = line;\n        int n = 0, undefined = 1;\n        const long which = strtol(at, &at, 10);\n        for (;;) {\n            \
            char *end;\n            const double next = strtod(at, &end);\n            if (end == at)\n                break;\n            \
            v[n++] = next;\n            at = end;\n        }\n        switch (which) {\n";
    for i in 0..codes.len() {
        writeln!(out, "        case {i}: undefined = case{i}(v); break;").expect("a string");
    }
    out + "        }\n        puts(undefined ? \"undefined\" : \"\");\n    }\n    return 0;\n}\n"
}

fn python_program(codes: &[(String, Routine)]) -> String {
    let mut out = String::from(
        "import sys\n\ndef load(name):\n    space = {'__name__': name}\n    with open(name + '.py') as file:\n        \
         exec(compile(file.read(), name, 'exec'), space)\n    space['check']()\n    return space\n\ndef flat(found):\n    \
         for one in found:\n        if isinstance(one, (list, tuple)):\n            yield from flat(one)\n        else:\n            yield one\n\n",
    );
    for (i, (code, routine)) in codes.iter().enumerate() {
        let name = code.split("_residuals(").next().and_then(|before| before.rsplit(' ').next()).expect("a name");
        let (n, k) = (routine.parameters.len(), routine.inputs.len());
        writeln!(
            out,
            "c{i} = load('c{i}')\n\ndef case{i}(v):\n    p = c{i}['{name}_prepare']({})\n    out = []",
            if n > 0 { format!("v[:{n}]") } else { String::new() }
        )
        .expect("a string");
        let mut call = String::from("p");
        for (first, count) in [(n, k), (n + k, routine.members.len())] {
            if count > 0 {
                write!(call, ", v[{first}:{}]", first + count).expect("a string");
            }
        }
        for (function, _) in functions(routine) {
            // Python has no function of several rows
            let function = if function == "jacobian_rows" { "jacobian" } else { function };
            writeln!(out, "    out.extend(flat(c{i}['{name}_{function}']({call})))").expect("a string");
        }
        out += "    return out\n\n";
    }
    out += "for line in sys.stdin:\n    which, *v = line.split()\n    try:\n        \
            print(*map(repr, globals()['case' + which]([float(value) for value in v])))\n    except ValueError:\n        print('undefined')\n";
    out
}

/// Results by case and point, or none where a tool is absent.
fn run(language: Language, cases: &[Case], change: &dyn Fn(String) -> String) -> Option<Vec<Vec<Option<Vec<f64>>>>> {
    let codes: Vec<(String, Routine)> = cases
        .iter()
        .map(|case| {
            let (code, routine) = case.emitted(language);
            (change(code), routine)
        })
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    let points: String = cases.iter().enumerate().map(|(i, case)| case.lines(i)).collect();
    file("points", &points);
    let here = |command: &str| {
        let mut command = Command::new(command);
        command.current_dir(folder.path());
        command
    };
    let stdin = || std::fs::File::open(folder.path().join("points")).expect("points");
    let text = match language {
        Language::Rust => {
            let rustc = tool("rustc")?;
            file("all.rs", &rust_program(&codes));
            file("driver.rs", &rust_driver(&codes));
            let arguments = ["--edition", "2021", "--test", "-C", "debuginfo=0", "all.rs", "-o", "all"];
            succeeded("rustc", here(&rustc).args(arguments).output().expect("it runs"));
            succeeded("the Rust program", here("./all").output().expect("it runs"));
            std::fs::read_to_string(folder.path().join("found")).expect("results")
        }
        Language::C => {
            let cc = tool("cc")?;
            file("all.c", &c_program(&codes));
            let arguments = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "all.c", "-lm", "-o", "all"];
            succeeded("cc", here(&cc).args(arguments).output().expect("it runs"));
            succeeded("the C program", here("./all").stdin(stdin()).output().expect("it runs"))
        }
        Language::Python => {
            let python = tool("python3")?;
            for (i, (code, _)) in codes.iter().enumerate() {
                file(&format!("c{i}.py"), code);
            }
            file("all.py", &python_program(&codes));
            succeeded("python", here(&python).args(["-W", "error", "all.py"]).stdin(stdin()).output().expect("it runs"))
        }
    };
    let parsed = |line: &str| {
        let numbers = line.split_whitespace().map(|v| v.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        (!line.ends_with("undefined")).then_some(numbers)
    };
    let mut lines = text.lines().map(parsed);
    Some(cases.iter().map(|case| lines.by_ref().take(case.points.len()).collect()).collect())
}

/// Runs cases in a language and compares; what is wrong.
fn wrong(language: Language, cases: &[Case]) -> Vec<String> {
    let Some(found) = run(language, cases, &|code| code) else { return Vec::new() };
    let compared = cases.iter().zip(&found).filter_map(|(case, found)| case.compare(found).err());
    compared.map(|error| format!("{}: {error}", language.name())).collect()
}

fn files(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        match entry.path() {
            path if path.is_dir() => files(&path, found),
            path if path.extension().is_some_and(|ending| ending == "ron") => found.push(path),
            _ => {}
        }
    }
    found.sort();
}

fn of_program(name: &str, program: &Program, selection: &Selection) -> Vec<Case> {
    let has = |m: &usize| !program.measurements[*m].residuals.is_empty();
    let all = (0..program.measurements.len()).filter(has);
    all.map(|m| Case::new(&format!("{name} {}", program.measurements[m].name), program, m, selection.clone())).collect()
}

/// Every shipped model, a few random ones, and some for what those do not have.
fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let mut paths = Vec::new();
    files(&project("models"), &mut paths);
    for path in paths {
        let session = Session::open(&path, &[]).expect("it compiles");
        all.extend(of_program(&path.display().to_string(), &session.program, &Selection::default()));
    }
    assert!(all.len() > 25, "{}", all.len());
    let free = Selection { free: vec!["L1.b".into()], ..Selection::default() };
    let flagship = compiled(&std::fs::read_to_string(project("models/two_theodolite/model.ron")).expect("a model"));
    all.extend(of_program("all 21", &flagship, &free));
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(Config::default(), rng);
    for k in 0..10 {
        let text = models().new_tree(&mut runner).expect("a model").current().text;
        all.extend(of_program(&format!("random {k}"), &compiled(&text), &Selection::default()));
    }
    let text = r#"(name: "degrees", units: (length: "m", angle: "deg"), parameters: {
            "zero": Scalar(Free("3 deg")), "arm": Scalar(Free("2 m")), "tilt": Rotation(Free((1, 2, 3))),
            "mark": Vec3(value: Free((0.1, 0.2, 0.3)), family: true), "turn": Rotation(value: Free((1, 2, 3)), family: true),
        }, measurements: { "m": (keys: ["from", "to"], inputs: { "angle": (unit: "gon"), "speed": (unit: "mm/s") },
            residuals: {
                "a": "arm*cos(angle + zero) - speed*1 s", "b": "wrap(3*angle - zero)",
                "c": "rotate(tilt*turn[from], mark[from]) - rotate(turn[to], mark[to])",
            },
        )})"#;
    let program = compiled(text);
    all.extend(of_program("degrees", &program, &Selection::default()));
    let part = Selection { fix: vec![("tilt.rz".into(), None), ("mark[*].y".into(), None)], ..Selection::default() };
    all.extend(of_program("part of a rotation", &program, &part));
    let nothing = Selection {
        fix: ["zero", "arm", "tilt", "mark[*]", "turn[*]"].map(|name| (name.into(), None)).into(),
        ..Selection::default()
    };
    all.extend(of_program("nothing free", &program, &nothing));
    all.extend(of_program("names", &compiled(WORDS), &Selection::default()));
    all.push(table());
    all.push(undefined());
    all
}

/// Words of the languages, and letters that they do not have.
const WORDS: &str = r#"(name: "*/ // \\ \"\"\" names", parameters: {
        "lambda": Scalar(Free(1)), "fn": Scalar(Free(2)), "double": Scalar(Free(3)), "struct": Scalar(Free(0.5)),
        "Double": Scalar(Free(3)), "α": Scalar(Free(1.5)), "alpha": Scalar(Free(2.5)), "p": Scalar(Free(3.14)),
    }, measurements: { "in": (inputs: { "def": (), "x": (), "r": () }, residuals: {
        "while": "lambda*def + fn*x - double*r", "int": "struct*sin(α*x) + Double*alpha^3/3.14 + p^p - pi*2.718",
    })})"#;

/// Every row of the table of operations is a residual.
fn table() -> Case {
    let text = r#"(name: "table", parameters: { "a": Scalar(Free(0.5)) },
        measurements: { "m": (inputs: { "x": (), "y": () }, residuals: { "r": "a + x + y" }) })"#;
    let mut program = compiled(text);
    let mut g = Graph::new();
    let (a, x, y) = (g.parameter(0), g.input(0), g.input(1));
    let (half, part, two) = (g.constant(0.5), g.constant(0.3), g.constant(2.0));
    let mut inside = |of: Scalar| {
        let sine = g.unary(Operation::Sin, of);
        let part = g.mul(part, sine);
        g.add(half, part)
    };
    // from 0.2 to 0.8
    let (s, t) = (inside(x), inside(y));
    let s = {
        let both = g.mul(a, s);
        g.add(both, part)
    };
    let mut equations: Vec<(String, Scalar)> = Vec::new();
    for row in OPERATIONS {
        let mut push = |x: Scalar, y: Scalar, g: &mut Graph| {
            let found = g.apply(row.operation, x, y);
            equations.push((format!("{:?}{}", row.operation, equations.len()), found));
        };
        match row.operation {
            Operation::PowInteger => {
                for n in [-5.0, -1.0, 3.0, 6.0] {
                    let n = g.constant(n);
                    push(s, n, &mut g);
                }
            }
            Operation::Stumpff | Operation::Atanc => {
                // the series and the closed form
                let wide = g.constant(9.0);
                let wide = g.mul(wide, s);
                let small = g.constant(0.01);
                let narrow = g.mul(small, s);
                for k in 0..4 {
                    let k = g.constant(f64::from(k));
                    push(wide, k, &mut g);
                    push(narrow, k, &mut g);
                }
            }
            Operation::Wrap => {
                let wide = g.constant(20.0);
                let wide = g.mul(wide, s);
                push(wide, wide, &mut g);
            }
            Operation::AtLeast => {
                let above = g.add(two, s);
                push(above, t, &mut g);
            }
            Operation::Div => {
                push(s, t, &mut g);
                push(s, s, &mut g);
            }
            _ => {
                let minus = g.neg(s);
                push(s, t, &mut g);
                if (row.operation.row().defined)(-0.5, 0.5) {
                    push(minus, t, &mut g);
                }
            }
        }
    }
    let measurement = &mut program.measurements[0];
    let of: Vec<Scalar> = equations.iter().map(|(_, s)| *s).collect();
    measurement.tape = Tape::lower(&g, &of);
    measurement.graph = Arc::new(g);
    let residual = measurement.residuals[0].clone();
    measurement.residuals = equations
        .iter()
        .map(|(name, _)| phical::compile::Residual { name: name.clone(), ..residual.clone() })
        .collect();
    measurement.equations = of;
    Case::new("table", &program, 0, Selection::default())
}

/// Points outside the domains: code says so, and gives no numbers.
fn undefined() -> Case {
    let text = r#"(name: "edges", parameters: { "a": Scalar(Free(1)) }, measurements: { "m": (
        inputs: { "x": (), "y": (), "z": () },
        residuals: { "r": "a*sqrt(x) + log(y) + at_least(z, 0.5) + 1/(z - 0.75)" },
    )})"#;
    let program = compiled(text);
    let mut case =
        Case::new("edges", &program, 0, Selection { start: vec![("a".into(), 1.0)], ..Selection::default() });
    for x in [[-1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 0.25], [1.0, 1.0, 0.75], [0.0, 1.0, 1.0]]
    {
        case.points.push(Point { q: vec![1.0], x: x.to_vec(), m: Vec::new(), expected: None });
    }
    case
}

#[test]
fn emitted_code_is_the_engine() {
    let cases = cases();
    let points: usize = cases.iter().map(|case| case.points.len()).sum();
    eprintln!("{} measurements, {points} points", cases.len());
    let wrong: Vec<String> = Language::ALL.iter().flat_map(|&language| wrong(language, &cases)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // compilers of Rust have taken it; so does its linter
    let Some(clippy) = tool("clippy-driver") else { return };
    let codes: Vec<(String, Routine)> = cases.iter().map(|case| case.emitted(Language::Rust)).collect();
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("all.rs"), rust_program(&codes).replace("#[cfg(test)] mod driver;", ""))
        .expect("written");
    let arguments = ["--edition", "2021", "--crate-type", "lib", "--emit", "metadata", "-D", "warnings", "all.rs"];
    let output = Command::new(clippy).current_dir(folder.path()).args(arguments).output().expect("it runs");
    succeeded("clippy", output);
}

#[test]
fn a_wrong_line_is_found_in_every_language() {
    let text = r#"(name: "m", parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(2)) }, measurements: { "m": (
        inputs: { "x": (), "y": () }, residuals: { "r": "y - a*x^3 + b*sin(x*a)" } ) })"#;
    let cases = of_program("m", &compiled(text), &Selection::default());
    let swapped = |code: String| {
        code.replace("dr_dq[0][0]", "dr_dq[0][9]")
            .replace("dr_dq[0][1]", "dr_dq[0][0]")
            .replace("dr_dq[0][9]", "dr_dq[0][1]")
    };
    let changes: [(&str, &dyn Fn(String) -> String); 3] = [
        ("columns are swapped", &swapped),
        ("a factor is wrong", &|code| code.replace("3.0", "2.0")),
        ("a residual is wrong", &|code| {
            let (heading, functions) = code.split_once("residuals(").expect("residuals");
            format!("{heading}residuals({}", functions.replacen("r[0] = ", "r[0] = 2.0 * ", 1))
        }),
    ];
    for language in Language::ALL {
        // without its own test vector, which finds it too
        let alone = |code: String| code.replace("#[test]", "").replace("def check():\n", "def check():\n    return\n");
        for (what, change) in &changes {
            let changed = |code: String| {
                let changed = change(code.clone());
                assert_ne!(changed, code, "{what}");
                alone(changed)
            };
            let Some(found) = run(language, &cases, &changed) else { break };
            assert!(cases[0].compare(&found[0]).is_err(), "{}: {what}", language.name());
        }
        let Some(found) = run(language, &cases, &|code| code) else { continue };
        cases[0].compare(&found[0]).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// The same of what stands beside the functions, which only the table of operations sees whole.
#[test]
fn a_wrong_helper_is_found_in_every_language() {
    let cases = [table()];
    let alone = |code: String| code.replace("#[test]", "").replace("def check():\n", "def check():\n    return\n");
    for language in Language::ALL {
        for (right, wrong) in [("k + 2 * i", "k + i"), ("2 * i + 2 * n + 1", "2 * i + n + 1")] {
            let changed = |code: String| {
                assert!(code.contains(right), "{}: {right}", language.name());
                alone(code.replace(right, wrong))
            };
            let Some(found) = run(language, &cases, &changed) else { break };
            assert!(cases[0].compare(&found[0]).is_err(), "{}: {wrong}", language.name());
        }
    }
}

#[test]
fn test_vectors_of_c_run_by_themselves() {
    let Some(cc) = tool("cc") else { return };
    for model in ["two_theodolite", "panda_sockets", "nist/Kirby2"] {
        let folder = tempfile::tempdir().expect("a folder");
        let arguments = ["derive", &format!("models/{model}/model.ron"), "--to", "c", "--out"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
        command.current_dir(project("")).args(arguments).arg(folder.path().join("emitted.c"));
        let said = succeeded("phical", command.output().expect("it runs"));
        assert!(said.is_empty(), "{said}");
        let mut command = Command::new(&cc);
        command.current_dir(folder.path());
        command.args(["-Wall", "-Wextra", "-Werror", "-DPHICAL_CHECK", "emitted.c", "-lm", "-o", "check"]);
        succeeded("cc", command.output().expect("it runs"));
        let said = succeeded(model, Command::new(folder.path().join("check")).output().expect("it runs"));
        assert!(said.contains("as expected"), "{said}");
    }
}

#[test]
fn the_json_says_what_the_arguments_mean() {
    let derive = |arguments: &[&str]| -> serde_json::Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
        command.current_dir(project("")).args(["derive", "models/two_theodolite/model.ron", "--format", "json"]);
        let said = succeeded("phical", command.args(arguments).output().expect("it runs"));
        serde_json::from_str(&said).expect("JSON")
    };
    let one = derive(&["--to", "c", "--measurement", "vo_line", "--free", "L1.b", "--fix", "R0.a=2405 mm"]);
    assert_eq!((one["language"].as_str(), one["measurement"].as_str()), (Some("c"), Some("vo_line")));
    let names: Vec<&str> =
        one["parameters"].as_array().expect("a list").iter().map(|p| p["name"].as_str().expect("a name")).collect();
    assert!(names.contains(&"L1.b") && !names.contains(&"R0.a") && names.len() == 20, "{names:?}");
    assert_eq!((one["inputs"][8]["name"].as_str(), one["inputs"][8]["unit"].as_str()), (Some("length"), Some("mm")));
    assert!(one["operations"]["per_row"]["jacobian"].as_u64().expect("a number") <= 1_150, "{}", one["operations"]);
    let code = one["code"].as_str().expect("code");
    assert!(code.contains("R0.a = 2405.0 [mm]"));
    // quarter turns are exact, so that products with them vanish
    assert!(!code.contains("e-17"));
    let both = derive(&["--to", "python"]);
    assert_eq!(both["measurements"]["sighting"]["residuals"][0]["name"], "kci");
}

/// `PHICAL_UPDATE=1 cargo test emit` writes the file anew.
#[test]
fn the_code_that_is_timed_is_what_is_emitted() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
    let arguments = "derive models/two_theodolite/model.ron --measurement vo_line --free L1.b --to";
    for (language, file) in [("rust", "benches/peers/emitted.rs"), ("c", "benches/peers/emitted.c")] {
        command = Command::new(command.get_program());
        command.current_dir(project("")).args(arguments.split(' ')).arg(language);
        let found = succeeded("phical", command.output().expect("it runs"));
        let file = project(file);
        if std::env::var_os("PHICAL_UPDATE").is_some() {
            std::fs::write(&file, &found).expect("written");
        }
        assert!(std::fs::read_to_string(&file).unwrap_or_default() == found, "{} is of yesterday", file.display());
    }
}
