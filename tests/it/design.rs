//! What to measure: designs known on paper, all choices of small problems, bounds by other formulas, and the flagship.

use std::path::Path;
use std::process::{Command, Output};

use nalgebra::{DMatrix, DVector};
use phical::compile::Program;
use phical::design::{Aim, Asked, Confirmation, Criterion, Design, Experiment, Request, confirm, design, pick};
use phical::fit::Tested;
use phical::identify::{Inputs, Probe, practice};
use phical::problem::{Execution, Options, Problem};
use phical::session::fit_once;
use phical::simulate::{self, simulate_again};
use proptest::prelude::*;
use serde_json::Value;
use tempfile::TempDir;

use crate::accuracy::{errors, median, seeds};
use crate::close::close;
use crate::flagship::{compiled, flagship};
use crate::shared::project;

/// So many copies of the polynomials 1, x, … of so many places from −1 to 1.
fn places(terms: i32, count: usize, copies: usize) -> Vec<Vec<f64>> {
    let place = |k: usize| -1.0 + 2.0 * k as f64 / (count - 1) as f64;
    let row = |k: usize| (0..terms).map(|power| place(k).powi(power)).collect::<Vec<f64>>();
    (0..count * copies).map(|at| row(at / copies)).collect()
}

fn experiment(n: usize, candidates: &[Vec<f64>], prior: &[f64]) -> Experiment {
    Experiment::new(n, candidates, prior, &Execution::default()).expect("it sees everything")
}

/// How many were chosen at each place.
fn counts(chosen: &[usize], count: usize, copies: usize) -> Vec<usize> {
    (0..count).map(|place| chosen.iter().filter(|&&at| at / copies == place).count()).collect()
}

/// The optimal designs of a straight line and a parabola on [−1, 1] (Fedorov 1972, 2.2; Pukelsheim 1993, 9.6 and ch. 6): shares of ½ ½ at
/// the ends; D ⅓ ⅓ ⅓, A ¼ ½ ¼ and E ⅕ ⅗ ⅕ at −1, 0, 1. Values follow from M by hand.
#[test]
fn designs_that_are_known_on_paper() {
    let middle = |low: usize, mid: usize, high: usize| {
        let mut all = vec![0; 21];
        (all[0], all[10], all[20]) = (low, mid, high);
        all
    };
    let d = Criterion::d;
    for (terms, criterion, rows, wanted, worth) in [
        (2, d(), 10, middle(5, 0, 5), -(100f64.ln())),
        (2, Criterion::a(2), 10, middle(5, 0, 5), 0.2),
        (2, Criterion::e(2), 10, middle(5, 0, 5), 0.1),
        (3, d(), 12, middle(4, 4, 4), -(256f64.ln())),
        (3, Criterion::a(3), 8, middle(2, 4, 2), 1.0),
        (3, Criterion::e(3), 10, middle(2, 6, 2), 0.5),
    ] {
        let experiment = experiment(terms as usize, &places(terms, 21, 6), &[]);
        let found = pick(&experiment, &criterion, rows).expect("it fits").expect("it sees");
        assert_eq!(counts(&found.chosen, 21, 6), wanted, "{terms} {criterion:?}");
        close(&[found.value], &[worth], 1e-9, "the value");
        assert!(found.excess() < 2e-3, "{terms} {criterion:?} {}", found.excess());
    }
}

/// A prior takes the place of measurements: with the slope known, the line's constant alone is measured, anywhere.
#[test]
fn what_is_known_beforehand_counts() {
    let candidates: Vec<Vec<f64>> = vec![vec![1.0, 0.0], vec![1.0, 1.0], vec![0.0, 1.0]];
    let chosen = |prior: &[f64]| pick(&experiment(2, &candidates, prior), &Criterion::a(2), 1).unwrap();
    assert!(chosen(&[]).is_none());
    assert_eq!(chosen(&[0.0, 10.0, 0.1, 0.0]).unwrap().chosen, [0]);
    assert_eq!(chosen(&[10.0, 0.0, 0.0, 0.1]).unwrap().chosen, [2]);
}

fn indicator(chosen: &[usize], count: usize) -> Vec<f64> {
    (0..count).map(|i| if chosen.contains(&i) { 1.0 } else { 0.0 }).collect()
}

/// M₀ + Σ wᵢ Mᵢ, in another library.
fn information(n: usize, candidates: &[Vec<f64>], prior: &[f64], weights: &[f64]) -> DMatrix<f64> {
    let of = |rows: &[f64]| {
        let a = DMatrix::from_row_slice(rows.len() / n, n, rows);
        a.transpose() * a
    };
    let mut all = of(prior);
    candidates.iter().zip(weights).for_each(|(rows, weight)| all += of(rows) * *weight);
    all
}

/// A criterion by its definition, and its gradient by the weights of the candidates; infinite where M is singular.
fn by_definition(n: usize, criterion: &Criterion, m: &DMatrix<f64>) -> f64 {
    let Some(inverse) = m.clone().cholesky().map(|factor| factor.inverse()) else { return f64::INFINITY };
    let covariance = |rows: &[f64]| {
        let t = DMatrix::from_row_slice(rows.len() / n, n, rows);
        &t * &inverse * t.transpose()
    };
    match criterion {
        Criterion::Determinant => -m.determinant().ln(),
        Criterion::Trace(rows) => covariance(rows).trace(),
        Criterion::Eigenvalue(rows) => covariance(rows).symmetric_eigenvalues().max(),
        Criterion::Largest(parts) => parts.iter().map(|rows| covariance(rows).trace()).fold(0.0, f64::max),
    }
}

/// All choices of so many.
fn choices(all: usize, count: usize) -> Vec<Vec<usize>> {
    match count {
        0 => vec![Vec::new()],
        _ => (count - 1..all)
            .flat_map(|last| {
                choices(last, count - 1).into_iter().map(move |mut some| {
                    some.push(last);
                    some
                })
            })
            .collect(),
    }
}

#[derive(Clone, Debug)]
struct Small {
    n: usize,
    candidates: Vec<Vec<f64>>,
    prior: Vec<f64>,
    criterion: Criterion,
    count: usize,
}

fn small(candidates: std::ops::Range<usize>) -> impl Strategy<Value = Small> {
    let shape = (2usize..4, 1usize..3, candidates, 0u8..4, any::<bool>(), 0usize..3);
    shape.prop_flat_map(|(n, m, all, kind, prior, more)| {
        let rows = prop::collection::vec(prop::collection::vec(-1.0..1.0f64, n * m), all);
        let targets = prop::collection::vec(-1.0..1.0f64, 2 * n);
        (rows, targets).prop_map(move |(candidates, targets)| {
            let identity = DMatrix::<f64>::identity(n, n).as_slice().to_vec();
            let criterion = match kind {
                0 => Criterion::Determinant,
                1 => Criterion::Trace(targets),
                2 => Criterion::Eigenvalue(identity.clone()),
                _ => Criterion::Largest(vec![targets[..n].to_vec(), targets[n..].to_vec()]),
            };
            let prior = if prior { identity.iter().map(|x| 0.7 * x).collect() } else { Vec::new() };
            Small { n, candidates, prior, criterion, count: n.div_ceil(m) + more }
        })
    })
}

proptest! {
    /// No choice of all is better than the bound, and what is found is close to the best of all.
    #[test]
    fn all_choices_of_small_problems(small in small(7..10)) {
        let Small { n, candidates, prior, criterion, count } = small;
        let Ok(experiment) = Experiment::new(n, &candidates, &prior, &Execution::default()) else { return Ok(()) };
        let of = |chosen: &Vec<usize>| {
            let weights = indicator(chosen, candidates.len());
            by_definition(n, &criterion, &information(n, &candidates, &prior, &weights))
        };
        let best = choices(candidates.len(), count).iter().map(of).fold(f64::INFINITY, f64::min);
        let Some(found) = pick(&experiment, &criterion, count).expect("it fits") else {
            prop_assert!(best > 1e6, "{best} was not found");
            return Ok(());
        };
        prop_assume!(best < 1e6);
        let value = of(&found.chosen);
        let scale = best.abs().max(1e-3);
        prop_assert!((found.value - value).abs() <= 1e-7 * scale, "{} {value}", found.value);
        prop_assert!(found.bound <= best + 1e-9 * scale, "{} {best}", found.bound);
        // where choices are so few it is the best of all
        let excess = if criterion == Criterion::Determinant { (value - best) / n as f64 } else { (value / best).ln() };
        prop_assert!(excess <= 1e-9, "{value} {best}");
    }

    /// No weights of the relaxation are better than the bound.
    #[test]
    fn no_weights_are_better_than_the_bound(small in small(12..30), order in prop::collection::vec(0.0..1.0f64, 30), cut in 0.0..1.0f64) {
        let Small { n, candidates, prior, criterion, count } = small;
        let Ok(experiment) = Experiment::new(n, &candidates, &prior, &Execution::default()) else { return Ok(()) };
        let Some(found) = pick(&experiment, &criterion, count).expect("it fits") else { return Ok(()) };
        // between even weights and a random design, and between the best ones and that
        let mut random: Vec<usize> = (0..candidates.len()).collect();
        random.sort_by(|&a, &b| order[a].total_cmp(&order[b]));
        let random = indicator(&random[..count], candidates.len());
        let even = vec![count as f64 / candidates.len() as f64; candidates.len()];
        for (a, b) in [(&even, &random), (&found.weights, &random), (&found.weights, &even)] {
            for cut in [0.0, 0.01, 0.1, cut, 1.0] {
                let weights: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * (1.0 - cut) + b * cut).collect();
                let value = by_definition(n, &criterion, &information(n, &candidates, &prior, &weights));
                prop_assert!(value >= found.bound - 1e-9 * value.abs().max(1e-3), "{value} {}", found.bound);
            }
        }
    }
}

/// The relaxation by a method of its own, Frank and Wolfe's, ends where the bound is: it is as high as it can be.
#[test]
fn the_bound_is_tight_by_another_method() {
    let (n, all, count) = (3, 40, 7);
    let candidates: Vec<Vec<f64>> = (0..all)
        .map(|i| {
            let t = 0.37 * f64::from(i);
            vec![1.0, t.sin(), (2.3 * t).cos(), 0.2, (0.7 * t).cos(), (1.9 * t).sin()]
        })
        .collect();
    let prior = [0.5, 0.0, 0.0, 0.0, 0.5, 0.2, 0.0, 0.0, 0.5];
    let experiment = experiment(n, &candidates, &prior);
    for criterion in [Criterion::d(), Criterion::a(n)] {
        let found = pick(&experiment, &criterion, count).unwrap().unwrap();
        let mut weights = vec![count as f64 / f64::from(all); all as usize];
        for step in 0..20_000 {
            let inverse = information(n, &candidates, &prior, &weights).try_inverse().unwrap();
            // ∂φ/∂w = −tr(M⁻¹ Mᵢ), −tr(M⁻¹ Mᵢ M⁻¹)
            let squared = if criterion == Criterion::Determinant { inverse.clone() } else { &inverse * &inverse };
            let gain = |rows: &Vec<f64>| -> f64 {
                rows.chunks(n).map(DVector::from_row_slice).map(|a| (a.transpose() * &squared * &a)[0]).sum()
            };
            let gains: Vec<f64> = candidates.iter().map(gain).collect();
            let mut order: Vec<usize> = (0..gains.len()).collect();
            order.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
            let to = indicator(&order[..count], gains.len());
            let length = 2.0 / (f64::from(step) + 3.0);
            weights.iter_mut().zip(to).for_each(|(w, to)| *w += length * (to - *w));
        }
        let relaxed = by_definition(n, &criterion, &information(n, &candidates, &prior, &weights));
        assert!(relaxed >= found.bound, "{relaxed} {}", found.bound);
        assert!(relaxed - found.bound <= 5e-4 * relaxed.abs().max(1.0), "{relaxed} {}", found.bound);
    }
}

/// The flagship's file with a prior of 0.5 mm on its offsets.
fn text_with_prior() -> String {
    let text = std::fs::read_to_string(project("models/two_theodolite/model.ron")).expect("the model is there");
    let (head, tail) = text.split_at(text.find("functions:").expect("chains come first"));
    let prior = "(nominal: 0, sigma: 0.5)";
    let head = head.replace("a: Free(0)", &format!("a: Free{prior}")).replace("b: Free(0)", &format!("b: Free{prior}"));
    head + tail
}

/// Bars up to 1500 mm, from the floor to 2000 mm.
fn with_long_bars(text: &str) -> String {
    text.replace("\"pz\": Uniform(\"0 mm\", \"1500 mm\")", "\"up\": Uniform(0, 1)")
        .replace("\"length\": Uniform(\"200 mm\", \"500 mm\")", "\"length\": Uniform(\"200 mm\", \"1500 mm\")")
        .replace("vec(px, py, pz)", "vec(px, py, up * (2000 mm - length))")
}

fn probe(program: &Program, rows: usize, seed: u64) -> Probe<'_> {
    let inputs = Inputs::Scenario(&program.scenarios[0]);
    Probe { program, options: Options::default(), inputs, rows: vec![(0, rows)], seed }
}

/// Rows of the first scenario as a volume.
fn volume(program: &Program, rows: usize, seed: u64) -> Problem<'_> {
    let probe = probe(program, rows, seed);
    let (like, _) = probe.bound().expect("it binds");
    probe.at(&like, &like.start, 0).expect("consistent").problem
}

fn asked(expression: &str) -> Asked {
    Asked { expression: expression.into(), required: None }
}

fn designed<'a>(request: &Request<'a>) -> Design<'a> {
    design(request).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)))
}

/// Seed of the candidates.
const CANDIDATES: u64 = 11;

/// Thirty lines for the place of a point in the paper's volume.
fn thirty<'a>(candidates: &'a Program, paper: &'a Program) -> Design<'a> {
    designed(&Request {
        candidates: probe(candidates, 2000, CANDIDATES),
        aim: Aim::Targets,
        targets: vec![asked("p1")],
        volume: Some(volume(paper, 300, 77)),
        rows: Some(30),
    })
}

fn drawn() -> simulate::Options {
    simulate::Options { rows: Vec::new(), seed: Some(CANDIDATES), exact: false }
}

fn confirmed(found: &Design, program: &Program, runs: u64) -> Confirmation {
    confirm(found, Some((&program.scenarios[0], &drawn())), &Options::default(), runs, 5).expect("it simulates")
}

#[test]
fn thirty_lines_of_the_flagship_are_those_of_the_table() {
    let paper = compiled(&text_with_prior());
    let long = compiled(&with_long_bars(&text_with_prior()));
    let plain = flagship();
    for (candidates, limit) in [(&paper, [0.052, 0.034, 0.045]), (&long, [0.027, 0.015, 0.026])] {
        let found = thirty(candidates, &paper);
        assert_eq!((found.picked.chosen.len(), found.left_out), (30, 0));
        assert!(found.picked.excess() < 0.01, "{}", found.picked.excess());
        assert!(found.picked.value / found.picked.bound < 1.01);
        let rows = found.chosen().swap_remove(0).2;
        let mut all = vec![Vec::new(); 3];
        for seed in 0..seeds() {
            let rows = [(0, rows.clone())];
            let made = simulate_again(candidates, &candidates.scenarios[0], &drawn(), &rows, 1000 + seed).unwrap();
            let (problem, _) = Problem::bind(candidates, made.tables, &Options::default()).expect("it binds");
            let fit = fit_once(&problem, Tested::None).expect("it is defined");
            assert!(fit.status.converged());
            for (all, (mean, _)) in all.iter_mut().zip(errors(&plain, &fit.point, 500, 77)) {
                all.push(mean);
            }
        }
        let medians: Vec<f64> = all.into_iter().map(median).collect();
        eprintln!(
            "excess {:.5}, random {:.3}, medians {medians:.4?}",
            found.picked.excess(),
            found.random_excess.unwrap_or(f64::NAN)
        );
        for (found, limit) in medians.iter().zip(limit) {
            assert!(*found <= limit, "{medians:?}");
        }
    }
}

/// The point's uncertainty over the volume, predicted at the nominal geometry and found at the true one, with the scenario's noise.
#[test]
fn predicted_and_simulated_agree() {
    let paper = compiled(&text_with_prior());
    let long = compiled(&with_long_bars(&text_with_prior()));
    for (candidates, runs) in [(&paper, 3 * seeds()), (&long, 3 * seeds())] {
        let found = thirty(candidates, &paper);
        let told = confirmed(&found, candidates, runs);
        assert_eq!((told.failed, told.compared.len()), (0, 3));
        for one in &told.compared {
            eprintln!("{} {:.3}, {:.3?} by chance", one.name, one.ratio(), one.range);
            assert!((one.ratio() - 1.0).abs() < 0.15 && one.agrees(), "{one:?}");
        }
    }
}

/// What a design predicts is what `identify` predicts of its rows: by another road, from the triangular factor of these rows alone.
#[test]
fn predictions_are_those_of_identify() {
    let paper = compiled(&text_with_prior());
    let found = designed(&Request {
        candidates: probe(&paper, 300, 4),
        aim: Aim::A,
        targets: Vec::new(),
        volume: None,
        rows: Some(25),
    });
    assert!(found.picked.excess() < 0.02 && found.random_excess.is_some_and(|excess| excess > 0.2));
    let block = &found.problem.blocks[0];
    let mut table = phical::data::Table::new(0, block.table.width());
    found.chosen()[0]
        .1
        .iter()
        .for_each(|&row| table.push(&[], &block.table.row(row), None).expect("a row of the table"));
    let (rows, _) = Problem::bind(&paper, vec![(0, table)], &Options::default()).expect("it binds");
    let probe = Probe { inputs: Inputs::Rows(&rows), rows: Vec::new(), ..probe(&paper, 0, 4) };
    let known = practice(&probe, None).expect("it runs");
    let sigma = |all: Vec<Option<f64>>| all.into_iter().map(|sigma| sigma.expect("estimable")).collect::<Vec<f64>>();
    for (found, known) in sigma(found.parameters.iter().map(|p| p.sigma).collect())
        .iter()
        .zip(sigma(known.parameters.iter().map(|p| p.sigma).collect()))
    {
        close(&[*found], &[known], 1e-7, "sigma");
    }
    let mean: f64 = found.parameters.iter().map(|p| (p.sigma.unwrap() / p.tolerance).powi(2)).sum();
    close(&[found.picked.value], &[mean], 1e-9, "the criterion");
}

/// A line with errors of 0.1 mm, at its ends or anywhere, and one whose sensors are worse than it says.
const LINE: &str = r#"(
    name: "line",
    parameters: { "a": Scalar(Free("0 mm")), "b": Scalar(Free("0 mm")) },
    measurements: { "point": (
        inputs: { "x": (), "y": (unit: "mm", sigma: "0.1 mm") }, residuals: { "r": "y - (a + b*x)" }, outputs: { "line": "a + b*x" },
    ) },
    scenarios: {
        "ends": (seed: 1, truth: {"b": "2 mm"}, measurements: { "point": (
            rows: 40, draw: {"x": Cycle([-1, 1])}, set: {"y": "a + b*x"},
        ) }),
        "worse": (seed: 1, truth: {"b": "2 mm"}, measurements: { "point": (
            rows: 40, draw: {"x": Uniform(-1, 1)}, set: {"y": "a + b*x"}, noise: {"y": (mean: 0, sigma: "0.2 mm")},
        ) }),
    },
)"#;

fn line() -> TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join("model.ron"), LINE).expect("writable");
    directory
}

fn phical(directory: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_phical"));
    command.current_dir(directory).args(arguments).output().expect("phical runs")
}

/// The JSON of a run that ends with `code`.
fn json(code: i32, directory: &Path, arguments: &[&str]) -> Value {
    let output = phical(directory, &[arguments, &["--format", "json"]].concat());
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{said}");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    serde_json::from_str(&text).expect("JSON")
}

/// With N of the ends the mean variance of the line there is 2 σ²/N for even N and more for odd: 0.051 mm takes 8, and the relaxation knows
/// that 7 are too few.
#[test]
fn how_many_rows_reach_a_requirement() {
    let directory = line();
    let found = json(0, directory.path(), &["design", "model.ron", "--require", "line=0.051 mm"]);
    assert_eq!((found["picked"].as_u64(), found["required"]["least"].as_u64()), (Some(8), Some(8)));
    assert_eq!(found["required"]["reached"], true);
    close(&[found["targets"][0]["rms"].as_f64().unwrap()], &[0.05], 1e-9, "the uncertainty");
    // weights could do it with nine: 2 σ²/9 is less than the square of 0.04728 mm, and 18 σ²/80 is more
    let found = json(0, directory.path(), &["design", "model.ron", "--require", "line=0.04728 mm"]);
    assert_eq!((found["picked"].as_u64(), found["required"]["least"].as_u64()), (Some(10), Some(9)));
    // 40 rows give 0.0224 mm at best
    let found = json(1, directory.path(), &["design", "model.ron", "--require", "line=0.02 mm"]);
    assert_eq!((found["required"]["reached"].as_bool(), found["picked"].as_u64()), (Some(false), Some(40)));
    close(&[found["targets"][0]["rms"].as_f64().unwrap()], &[0.0005f64.sqrt()], 1e-9, "the best");
    let text = phical(directory.path(), &["design", "model.ron", "--require", "line=0.02 mm"]).stdout;
    assert!(String::from_utf8_lossy(&text).starts_with("Not reached: all 40 candidates"));
    // two requirements: the harder one counts
    let both = ["design", "model.ron", "--require", "line=1 mm", "--require", "a=0.034 mm"];
    let found = json(0, directory.path(), &both);
    assert_eq!((found["picked"].as_u64(), found["required"]["least"].as_u64()), (Some(9), Some(9)));
}

#[test]
fn candidates_of_a_file_and_rows_for_the_field() {
    let directory = line();
    let rows: String = (0..21).map(|k| format!("{},{}\n", f64::from(k) / 10.0 - 1.0, 0)).collect();
    std::fs::write(directory.path().join("planned.csv"), format!("x,y\n{rows}")).unwrap();
    let from = ["design", "model.ron", "--candidates", "point=planned.csv", "--pick", "2"];
    let found = json(0, directory.path(), &[&from[..], &["--out", "field", "--confirm", "200"]].concat());
    let chosen = found["measurements"]["point"]["chosen"].as_array().unwrap();
    let chosen: Vec<u64> = chosen.iter().map(|one| one["row"].as_u64().unwrap()).collect();
    assert_eq!(chosen, [1, 21]);
    assert!(found["confirmed"]["agrees"].as_bool().unwrap(), "{}", found["confirmed"]);
    assert_eq!(std::fs::read_to_string(directory.path().join("field/point.csv")).unwrap(), "x,y\n-1,0\n1,0\n");
    let known = json(0, directory.path(), &["identify", "model.ron", "--data", "point=field/point.csv"]);
    for (found, known) in found["parameters"].as_array().unwrap().iter().zip(known["parameters"].as_array().unwrap()) {
        close(&[found["sigma"].as_f64().unwrap()], &[known["sigma"].as_f64().unwrap()], 1e-12, "sigma");
    }
}

#[test]
fn sensors_that_are_worse_than_declared_are_noticed() {
    let directory = line();
    let of = |scenario| {
        ["design", "model.ron", "--pick", "10", "--target", "line", "--confirm", "100", "--scenario", scenario]
    };
    let found = json(1, directory.path(), &of("worse"));
    let ratio = found["confirmed"]["compared"][0]["ratio"].as_f64().unwrap();
    assert!((ratio - 2.0).abs() < 0.3, "{ratio}");
    let found = json(0, directory.path(), &of("ends"));
    let ratio = found["confirmed"]["compared"][0]["ratio"].as_f64().unwrap();
    assert!((ratio - 1.0).abs() < 0.15, "{ratio}");
}

#[test]
fn threads_do_not_matter() {
    let model = project("models/two_theodolite/model.ron").display().to_string();
    let of = |threads| {
        let arguments = ["design", &model, "--rows", "vo_line=400", "--pick", "12", "--target", "p1", "--confirm", "3"];
        let output = phical(Path::new("."), &[&arguments[..], &["--format", "json", "--threads", threads]].concat());
        assert_ne!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let one = of("1");
    assert!(one == of("2") && one == of("3"));
}

#[test]
fn unit_weights_compare_but_promise_nothing() {
    let directory = line();
    let arguments = ["design", "model.ron", "--weights", "unit", "--scenario", "worse", "--pick", "2"];
    let found = json(0, directory.path(), &[&arguments[..], &["--target", "line"]].concat());
    assert!(found["targets"][0]["rms"].is_null() && found["parameters"][0]["sigma"].is_null());
    assert!(found["excess"].as_f64().unwrap() < 0.05);
    let refused = ["design", "model.ron", "--weights", "unit", "--require", "line=1 mm"];
    assert_eq!(json(2, directory.path(), &refused)["errors"][0]["code"], "E085");
}
