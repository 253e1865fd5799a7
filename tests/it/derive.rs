//! Formulas that people read: what they say is what the engine computes, and they can be read back.

use std::collections::BTreeSet;
use std::sync::Arc;

use num_dual::{Dual64, HyperDual64};
use phical::compile::{Measurement, Program, compile};
use phical::derive::{Asked, Statement, derive};
use phical::diag::Source;
use phical::graph::{Number, Tape};
use phical::lang::print;
use phical::model::{Model, load};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::close::close;
use crate::shared::project;

/// Every model file of the project.
fn shipped() -> Vec<(String, Arc<Source>)> {
    fn files(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("readable").flatten() {
            let path = entry.path();
            if path.is_dir() {
                files(&path, found);
            } else if path.extension().is_some_and(|ending| ending == "ron") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    files(&project("models"), &mut found);
    found.sort();
    let read = |path: &std::path::PathBuf| std::fs::read_to_string(path).expect("readable");
    found.iter().map(|path| (path.display().to_string(), Source::new(path.display().to_string(), read(path)))).collect()
}

fn compiled(source: &Arc<Source>, extra: &[String]) -> Option<(Model, Program)> {
    let (model, _) = load(source).ok()?;
    let program = compile(&model, source, extra).ok()?.0;
    Some((model, program))
}

/// A random point about the nominal one: leaves and inputs.
fn point(program: &Program, measurement: &Measurement, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut share = || 2.0 * random.random::<f64>() - 1.0;
    let mut leaves = vec![0.0; measurement.leaves];
    let mut largest = 1.0_f64;
    for slot in &measurement.slots {
        let setting = &program.parameters[slot.parameter].setting;
        for (i, nominal) in setting.nominal.iter().enumerate() {
            leaves[slot.first_leaf + i] = nominal + share() * (0.05 * nominal.abs() + 100.0 * setting.tolerance[i]);
            largest = largest.max(nominal.abs());
        }
    }
    let input =
        |input: &phical::compile::Input, share: f64| match input.unit.dimension == phical::unit::Dimension::ANGLE {
            true => 2.0 * share,
            false => share * largest,
        };
    let inputs = measurement.inputs.iter().map(|one| one.default.unwrap_or_else(|| input(one, share()))).collect();
    (leaves, inputs)
}

/// Coordinates of the free parameters that a measurement uses, with the leaves by which to differentiate.
fn coordinates(program: &Program, measurement: &Measurement) -> Vec<(String, usize)> {
    let mut all = Vec::new();
    for slot in &measurement.slots {
        let parameter = &program.parameters[slot.parameter];
        if !parameter.setting.has_free() && !parameter.family {
            continue;
        }
        let settings = parameter.members.iter().map(|(_, setting)| setting).chain([&parameter.setting]);
        // of some that are free, those that are held may move nothing, but for rounding
        let none = !settings.clone().any(phical::compile::Setting::has_free);
        let free = |i: usize| none || settings.clone().any(|setting| setting.is_free(i));
        let keys: Vec<&str> = slot.keys.iter().map(|&key| measurement.keys[key].as_str()).collect();
        let name =
            if keys.is_empty() { parameter.name.clone() } else { format!("{}[{}]", parameter.name, keys.join(", ")) };
        for (i, suffix) in parameter.shape.suffixes().iter().enumerate().filter(|(i, _)| free(*i)) {
            all.push((format!("{name}{suffix}"), slot.first_leaf + parameter.shape.tangent_leaf(i)));
        }
    }
    all
}

fn whole(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((base, "x" | "y" | "z")) => base,
        _ => name,
    }
}

fn numbers<T: Number>(values: &[f64], at_least: usize) -> Vec<T> {
    let mut all: Vec<T> = values.iter().map(|&value| T::from(value)).collect();
    all.resize(values.len().max(at_least), T::from(0.0));
    all
}

fn values(tape: &Tape, leaves: &[f64], inputs: &[f64]) -> Vec<f64> {
    tape.evaluate(&numbers::<f64>(leaves, tape.parameters()), &numbers(inputs, tape.inputs()))
}

/// What changes nothing, as a turn about the axis itself, does so but for rounding of the numbers it is made of.
fn zero(expected: &[f64], found: &[f64], leaves: &[f64], inputs: &[f64]) -> bool {
    let size = leaves.iter().chain(inputs).fold(1.0_f64, |most, x| most.max(x.abs()));
    expected.iter().all(|x| *x == 0.0) && found.iter().all(|x| x.abs() <= 1e-14 * size)
}

/// `derivative(x, q)` of every residual of every shipped model, by every coordinate.
#[test]
fn derivatives_in_the_language_are_those_of_dual_numbers() {
    let mut compared = 0;
    for (file, source) in shipped() {
        let Some((_, plain)) = compiled(&source, &[]) else { panic!("{file} does not compile") };
        for (m, measurement) in plain.measurements.iter().enumerate().filter(|(_, m)| !m.residuals.is_empty()) {
            let coordinates = coordinates(&plain, measurement);
            let names: BTreeSet<&str> = measurement.residuals.iter().map(|r| whole(&r.name)).collect();
            let said: Vec<String> = names
                .iter()
                .flat_map(|name| coordinates.iter().map(move |(by, _)| format!("derivative({name}, {by})")))
                .collect();
            let Some((_, program)) = compiled(&source, &said) else { panic!("{file}: {said:?}") };
            let with = &program.measurements[m];
            for seed in 0..3 {
                let (leaves, inputs) = point(&program, with, seed);
                let found = values(&with.output_tape, &leaves, &inputs);
                for (by, leaf) in &coordinates {
                    let mut duals: Vec<Dual64> = numbers(&leaves, with.tape.parameters());
                    duals[*leaf].eps = 1.0;
                    let exact = with.tape.evaluate(&duals, &numbers(&inputs, with.tape.inputs()));
                    let (mut expected, mut here) = (Vec::new(), Vec::new());
                    for (residual, exact) in with.residuals.iter().zip(&exact) {
                        let suffix = &residual.name[whole(&residual.name).len()..];
                        let wanted = format!("derivative({}, {by}){suffix}", whole(&residual.name));
                        let k = with.outputs.iter().position(|output| output.name == wanted).expect(&wanted);
                        if exact.eps.is_finite() {
                            expected.push(exact.eps);
                            here.push(found[k]);
                        }
                    }
                    compared += expected.len();
                    if zero(&expected, &here, &leaves, &inputs) {
                        continue;
                    }
                    close(&here, &expected, 1e-9, &format!("{file}: {by}, seed {seed}"));
                }
            }
        }
    }
    assert!(compared > 1000, "{compared}");
}

/// What `derive` prints is read back as what it says it is.
#[test]
fn printed_formulas_are_true() {
    let (mut read, mut refused) = (0, Vec::new());
    for (file, source) in shipped() {
        let Some((_, plain)) = compiled(&source, &[]) else { panic!("{file} does not compile") };
        for (m, measurement) in plain.measurements.iter().enumerate().filter(|(_, m)| !m.residuals.is_empty()) {
            let by: Vec<String> = coordinates(&plain, measurement).into_iter().map(|(name, _)| name).collect();
            let derivation = derive(&plain, m, &Asked::default()).expect("derives");
            let mut all = derivation.sections;
            // what is said of any parameter is not an expression by itself
            all.retain(|section| !section.title.contains("any parameter"));
            all.extend(derive(&plain, m, &Asked { by, ..Asked::default() }).expect("derives").sections);
            let mut pairs: Vec<[String; 2]> = Vec::new();
            // a frame is put out by numbers that have the names of its axes
            let of_numbers = |statement: &&Statement| !derivation.frames.contains(&print(&statement.name));
            for statement in all.iter().flat_map(|section| &section.statements).filter(of_numbers) {
                pairs.extend(statement.forms.iter().map(|form| [print(&statement.name), print(form)]));
            }
            pairs.sort();
            pairs.dedup();
            for chunk in pairs.chunks(40) {
                let all_at_once = compiled(&source, &chunk.concat());
                let one_by_one = || chunk.iter().filter_map(|pair| Some((pair.to_vec(), compiled(&source, pair)?.1)));
                let programs: Vec<(Vec<String>, Program)> = match all_at_once {
                    Some((_, program)) => vec![(chunk.concat(), program)],
                    None => one_by_one().collect(),
                };
                let understood: usize = programs.iter().map(|(texts, _)| texts.len() / 2).sum();
                if understood < chunk.len() {
                    let known: BTreeSet<&String> = programs.iter().flat_map(|(texts, _)| texts).collect();
                    refused.extend(chunk.iter().filter(|pair| !known.contains(&pair[1])).map(|pair| pair[1].clone()));
                }
                for (texts, program) in &programs {
                    let with = &program.measurements[m];
                    let (leaves, inputs) = point(program, with, 7);
                    let found = values(&with.output_tape, &leaves, &inputs);
                    let of = |text: &String| -> Vec<f64> {
                        let own = |name: &str| {
                            name.strip_prefix(text.as_str()).is_some_and(|rest| matches!(rest, "" | ".x" | ".y" | ".z"))
                        };
                        // a name that was said twice is put out twice
                        let mut seen = BTreeSet::new();
                        let outputs = with.outputs.iter().zip(&found);
                        outputs.filter(|(o, _)| own(&o.name) && seen.insert(&o.name)).map(|(_, value)| *value).collect()
                    };
                    for pair in texts.chunks(2) {
                        let (name, form) = (of(&pair[0]), of(&pair[1]));
                        if name.iter().all(|value| value.is_finite()) && !name.is_empty() {
                            read += 1;
                            if zero(&name, &form, &leaves, &inputs) {
                                continue;
                            }
                            close(&form, &name, 1e-9, &format!("{file}: {} = {}", pair[0], pair[1]));
                        }
                    }
                }
            }
        }
    }
    eprintln!("{read} formulas read back, {} refused: {refused:?}", refused.len());
    assert!(read > 500 && refused.len() * 20 < read, "{read} read, refused: {refused:?}");
}

/// Second derivatives of the flagship by pairs of parameters and inputs, against hyper-dual numbers.
#[test]
fn second_derivatives_are_those_of_hyper_dual_numbers() {
    let source = Source::new("model.ron", std::fs::read_to_string(project("models/two_theodolite/model.ron")).unwrap());
    let (_, plain) = compiled(&source, &[]).expect("compiles");
    let names = ["L0.alpha", "L1.beta", "L2.alpha", "R0.a", "R1.b", "R2.beta"];
    let pairs: Vec<(&str, &str)> = names.iter().flat_map(|a| names.iter().map(move |b| (*a, *b))).collect();
    let said: Vec<String> = pairs
        .iter()
        .flat_map(|(a, b)| ["vo", "kci1"].map(|r| format!("derivative(derivative({r}, {a}), {b})")))
        .collect();
    let (_, program) = compiled(&source, &said).expect("compiles");
    let with = &program.measurements[0];
    let leaves_of = coordinates(&plain, &plain.measurements[0]);
    let leaf = |name: &str| leaves_of.iter().find(|(known, _)| known == name).expect("known").1;
    let (leaves, inputs) = point(&program, with, 3);
    let found = values(&with.output_tape, &leaves, &inputs);
    for (a, b) in pairs {
        let mut duals: Vec<HyperDual64> = numbers(&leaves, with.tape.parameters());
        duals[leaf(a)].eps1 = 1.0;
        duals[leaf(b)].eps2 = 1.0;
        let exact = with.tape.evaluate(&duals, &numbers(&inputs, with.tape.inputs()));
        let output = |name: &str| found[with.outputs.iter().position(|output| output.name == name).expect(name)];
        let of = |r: &str| format!("derivative(derivative({r}, {a}), {b})");
        let here = [".x", ".y", ".z"].map(|suffix| output(&format!("{}{suffix}", of("vo"))));
        close(&here, &[exact[0].eps1eps2, exact[1].eps1eps2, exact[2].eps1eps2], 1e-10, &of("vo"));
        close(&[output(&of("kci1"))], &[exact[3].eps1eps2], 1e-10, &of("kci1"));
    }
}

/// Brackets and environments of LaTeX close; it compiles where there is a compiler.
#[test]
fn latex_is_well_formed() {
    let engine = ["pdflatex", "tectonic", "lualatex"]
        .into_iter()
        .find(|name| std::process::Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success()));
    if engine.is_none() {
        eprintln!("SKIPPED: no LaTeX compiler here: its documents are looked at for brackets and commands alone");
    }
    for (file, source) in shipped() {
        let (_, program) = compiled(&source, &[]).expect("compiles");
        let all: Vec<_> = (0..program.measurements.len())
            .filter(|&m| !program.measurements[m].residuals.is_empty())
            .map(|m| derive(&program, m, &Asked::default()).expect("derives"))
            .collect();
        let document = phical::report::derivation_latex(&all, &program.name);
        let mut open = Vec::new();
        let mut escaped = false;
        for c in document.chars() {
            match c {
                '{' | '}' if escaped => {}
                '{' => open.push('{'),
                '}' => assert_eq!(open.pop(), Some('{'), "{file}"),
                _ => {}
            }
            escaped = c == '\\' && !escaped;
        }
        assert!(open.is_empty(), "{file}");
        for environment in ["align*", "pmatrix", "document"] {
            let count = |what: &str| document.matches(&format!("\\{what}{{{environment}}}")).count();
            assert_eq!(count("begin"), count("end"), "{file}: {environment}");
        }
        // nothing that LaTeX would take for something else
        assert!(!document.contains("__") && document.is_ascii(), "{file}: {document}");
        if let Some(engine) = engine {
            let folder = tempfile::tempdir().expect("a folder");
            std::fs::write(folder.path().join("formulas.tex"), &document).expect("written");
            let mut command = std::process::Command::new(engine);
            if engine != "tectonic" {
                command.arg("-interaction=nonstopmode").arg("-halt-on-error");
            }
            let out = command.arg("formulas.tex").current_dir(folder.path()).output().expect("runs");
            assert!(out.status.success(), "{file}: {}", String::from_utf8_lossy(&out.stdout));
        }
    }
}
