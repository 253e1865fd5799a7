//! Errors that many rows share, as families with priors: `models/shared_errors`, made up with many seeds; and bars out of
//! plumb, of which each row has its own.

use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::Source;
use phical::fit::Fit;
use phical::model::load;
use phical::problem::{Selection, Weights};
use phical::simulate::{Options, simulate};

use crate::fitting::{bound, estimate, fit};
use crate::shared::project;

fn program(path: &str, edit: impl Fn(String) -> String) -> Program {
    let text = std::fs::read_to_string(project(path)).expect("the model is there");
    let source = Source::new("model.ron", edit(text));
    let (model, _) = load(&source).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)));
    compile(&model, &source, &[]).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false))).0
}

/// The true values and the rows of a scenario with a seed.
fn made(program: &Program, seed: u64, rows: usize) -> (Vec<(String, f64)>, Table) {
    let options = Options { rows: vec![(0, rows)], seed: Some(seed), ..Options::default() };
    let mut simulated = simulate(program, &program.scenarios[0], &options).expect("it simulates");
    (simulated.truth, simulated.tables.remove(0).1)
}

fn fitted(program: &Program, table: &Table, fix: &[&str]) -> Fit {
    let fix = fix.iter().map(|name| ((*name).into(), None)).collect();
    let selection = Selection { fix, ..Selection::default() };
    fit(&bound(program, std::slice::from_ref(table), selection, Some(Weights::Propagated)))
}

/// (estimate − truth)/σ
fn pull(fit: &Fit, truth: &[(String, f64)], name: &str) -> f64 {
    let (value, sigma) = estimate(fit, name);
    let (_, truth) = truth.iter().find(|(known, _)| known == name).expect("a true value");
    (value - truth) / sigma.unwrap_or_else(|| panic!("`{name}` has no sigma"))
}

const SHARED: [&str; 2] = ["index[*]", "stretch[*]"];

#[test]
fn members_with_priors_have_sigmas_and_the_fit_is_trustworthy() {
    let program = program("models/shared_errors/model.ron", |text| text);
    let (truth, table) = made(&program, 1, 120);
    let fit = fitted(&program, &table, &[]);
    assert!(fit.verdict().trustworthy(), "{:?}", fit.verdict());
    // without priors a longer staff is a theodolite further away
    assert_eq!((fit.rank, fit.parameters.len(), fit.dof), (8, 9, 118));
    // in arcsec and in parts
    for (family, prior, members) in [("index", 10.0, 3), ("stretch", 20e-6, 4)] {
        let all: Vec<_> = fit.parameters.iter().filter(|p| p.name.starts_with(family)).collect();
        assert_eq!(all.len(), members);
        for of in all {
            let sigma = of.sigma.expect("a prior gives a sigma");
            assert!(of.estimable && sigma < prior, "{}: {sigma}, prior {prior}", of.name);
            assert!(pull(&fit, &truth, &of.name).abs() < 4.0, "{}: {}", of.name, of.value);
        }
    }
}

/// Over many seeds errors are as large as they are said to be; without the families they are not.
#[test]
fn uncertainties_hold_what_they_say() {
    let program = program("models/shared_errors/model.ron", |text| text);
    let (mut honest, mut naive, mut chi, mut dof) = (0.0, 0.0, 0.0, 0);
    const SEEDS: u64 = 60;
    for seed in 0..SEEDS {
        let (truth, table) = made(&program, 100 + seed, 120);
        let fit = fitted(&program, &table, &[]);
        assert!(fit.verdict().trustworthy(), "{seed}: {:?}", fit.verdict());
        honest += pull(&fit, &truth, "away").powi(2);
        (chi, dof) = (chi + 2.0 * fit.cost, dof + fit.dof);
        let fit = fitted(&program, &table, &SHARED);
        assert!(!fit.verdict().trustworthy());
        naive += pull(&fit, &truth, "away").powi(2);
    }
    let n = SEEDS as f64;
    // the variance of the mean of n squares is 2/n: four standard errors
    assert!((honest / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", honest / n);
    assert!(naive / n > 4.0, "{}", naive / n);
    assert!(chi / dof as f64 > 0.9 && chi / (dof as f64) < 1.1, "{chi} of {dof}");
}

#[test]
fn more_rows_do_not_outdo_the_staffs() {
    let program = program("models/shared_errors/model.ron", |text| text);
    let sigma = |rows: usize, fix: &[&str]| {
        let fit = fitted(&program, &made(&program, 1, rows).1, fix);
        estimate(&fit, "away").1.expect("a sigma")
    };
    // 5012 mm of four staffs of 20 ppm each
    let floor = 5012.0 * 20e-6 / 2.0;
    assert!(sigma(6_000, &[]) > 0.98 * floor && sigma(6_000, &[]) < 1.05 * floor);
    assert!(sigma(6_000, &SHARED) < 0.15 * floor);
}

/// Bars that hang out of plumb: with sigmas of the tilts the fit is trusted, and taken for exact they show.
#[test]
fn tilts_without_a_sigma_show() {
    let path = "models/two_theodolite/plumb_line.ron";
    let declared = program(path, |text| text);
    let exact = program(path, |text| text.replace("sigma: \"20 arcsec\", default", "default"));
    let table = made(&declared, 1, 300).1;
    assert!((0..300).all(|row| table.row(row)[9..] == [0.0, 0.0]), "the tilts are not read");
    let fit = fitted(&declared, &table, &[]);
    assert!(fit.verdict().trustworthy(), "{:?}", fit.verdict());
    assert_eq!((fit.rank, fit.dof), (20, 1480));
    let fit = fitted(&exact, &table, &[]);
    assert!(fit.status.converged() && !fit.verdict().trustworthy(), "{:?}", fit.verdict());
    assert!(fit.sum_of_squares > 1.4 * fit.dof as f64, "{}", fit.sum_of_squares);
}
