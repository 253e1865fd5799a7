//! Errors in variables: against published digits, against the same estimate with every true reading as a parameter, against
//! a dense solution by dual numbers, and what happens where conditions are redundant or errors make no sense.

use phical::compile::Program;
use phical::data::Table;
use phical::diag::Code;
use phical::fit::Fit;
use phical::linalg::{Matrix, SquareRootInformation};
use phical::problem::{Execution, Options, Problem, Selection, Weights};
use phical::simd::InstructionSet;
use phical::simulate::{self, simulate};
use phical::solve::LeastSquares;

use crate::close::close;
use crate::engine::normal;
use crate::fitting::{bound, estimate, fit, fitted, table};
use crate::flagship::{compiled, flagship};

const X: [f64; 10] = [0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4];
const Y: [f64; 10] = [5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5];
const WX: [f64; 10] = [1000.0, 1000.0, 500.0, 800.0, 200.0, 80.0, 60.0, 20.0, 1.8, 1.0];
const WY: [f64; 10] = [1.0, 1.8, 4.0, 8.0, 20.0, 20.0, 70.0, 70.0, 100.0, 500.0];

fn york(more: &str) -> Program {
    compiled(&format!(
        r#"(
        name: "line",
        parameters: {{ "a": Scalar(Free(5)), "b": Scalar(Free(0)) }},
        measurements: {{ "point": (
            inputs: {{ "x": (sigma: "1/sqrt(wx)"), "y": (sigma: "1/sqrt(wy)"), "wx": (), "wy": () }},
            residuals: {{ "r": "y - a - b*x"{more} }},
        ) }},
    )"#
    ))
}

fn pearson() -> Table {
    table(&(0..10).map(|i| vec![X[i], Y[i], WX[i], WY[i]]).collect::<Vec<_>>())
}

#[test]
fn pearsons_data_with_yorks_weights() {
    let found = fitted(&york(""), &[pearson()]);
    assert!((estimate(&found, "a").0 - 5.479_910_224).abs() < 5e-10);
    assert!((estimate(&found, "b").0 + 0.480_533_407).abs() < 5e-10);
    assert!((found.sum_of_squares - 11.866_353).abs() < 5e-7);
    let chi = found.chi_squared.expect("weights are real");
    assert!((chi.value - 11.866_353).abs() < 5e-7 && chi.dof == 8);
}

/// The same estimate as an ordinary one: each true x is a parameter, and x and y are measured.
#[test]
fn true_readings_as_parameters_give_the_same_estimate() {
    let text = r#"(
        name: "line",
        parameters: { "a": Scalar(Free(5)), "b": Scalar(Free(0)), "true": Scalar(value: Free(4), family: true) },
        measurements: { "point": (
            keys: ["point"],
            inputs: { "x": (), "y": (), "sx": (), "sy": () },
            residuals: { "x": (value: "x - true[point]", sigma: "sx"), "y": (value: "y - a - b*true[point]", sigma: "sy") },
        ) },
    )"#;
    let mut rows = Table::new(1, 4);
    for i in 0..10 {
        let sigma = |weight: f64| 1.0 / weight.sqrt();
        rows.push(&[&format!("p{i}")], &[X[i], Y[i], sigma(WX[i]), sigma(WY[i])], None).expect("a row of the table");
    }
    let model = compiled(text);
    let problem = bound(&model, &[rows], Selection::default(), Some(Weights::Sigma));
    let (all, line) = (fit(&problem), fitted(&york(""), &[pearson()]));
    let of = |fit: &Fit| ["a", "b"].map(|name| estimate(fit, name).0);
    close(&of(&line), &of(&all), 1e-9, "the line");
    close(&[line.sum_of_squares], &[all.sum_of_squares], 1e-12, "the sum of squares");
    assert_eq!(line.dof, all.dof);
    // corrected readings are the estimates of the true ones
    let problem = bound(&york(""), &[pearson()], Selection::default(), None).start.clone();
    drop(problem);
    let program = york("");
    let problem = bound(&program, &[pearson()], Selection::default(), None);
    let mut corrected = Vec::new();
    problem.inspect(&line.point, |row| corrected.push(row.corrected[0])).expect("defined");
    let truth: Vec<f64> = (0..10).map(|i| estimate(&all, &format!("true[p{i}]")).0).collect();
    close(&corrected, &truth, 1e-8, "corrected readings");
}

/// The minimum over the corrections by dense algebra, from derivatives by dual numbers: [J r] of the whitened equations.
fn dense(problem: &Problem, point: &[f64], sigma: &[f64]) -> SquareRootInformation {
    let (block, n) = (&problem.blocks[0], problem.free.len());
    let (m, width) = (block.measurement.residuals.len(), sigma.len());
    let mut corrected: Vec<Vec<f64>> = Vec::new();
    let mut whitenings = Vec::new();
    block
        .input_jacobians(&problem.layout, point, |row, evaluate| {
            let read = block.table.row(row).to_vec();
            let mut x = read.clone();
            let (mut f, mut b) = (vec![0.0; m], vec![0.0; m * width]);
            let mut found = None;
            for _ in 0..30 {
                evaluate(&x, &mut f, &mut b);
                let b = nalgebra::DMatrix::from_row_slice(m, width, &b);
                let v = nalgebra::DVector::from_fn(width, |k, _| x[k] - read[k]);
                let variance =
                    nalgebra::DMatrix::from_fn(width, width, |i, j| if i == j { sigma[i] * sigma[i] } else { 0.0 });
                let w = nalgebra::DVector::from_column_slice(&f) - &b * &v;
                let covariance = &b * &variance * b.transpose();
                let cholesky = covariance.clone().cholesky().expect("positive definite");
                let next = -(&variance * b.transpose() * cholesky.solve(&w));
                (0..width).for_each(|k| x[k] = read[k] + next[k]);
                found = Some((w, cholesky.l()));
            }
            corrected.push(x);
            whitenings.push(found.expect("iterated"));
        })
        .expect("a point of the problem");
    let mut at = Table::new(0, width);
    corrected.iter().for_each(|row| at.push(&[], row, None).expect("a row of the table"));
    let options = Options { weights: Some(Weights::Unit), ..Options::default() };
    let (moved, _) = Problem::bind(problem.program, vec![(0, at)], &options).expect("it binds");
    let mut information = SquareRootInformation::new(n);
    let visited = moved.blocks[0].jacobians(&moved.layout, point, &moved.places(), |row| {
        let (w, l) = &whitenings[row.row];
        let a = nalgebra::DMatrix::from_fn(m, row.columns.len(), |i, j| {
            row.derivatives[i * row.columns.len() + j] / moved.blocks[0].weights[i]
        });
        let whitened = l.solve_lower_triangular(&a).expect("regular");
        let residual = l.solve_lower_triangular(w).expect("regular");
        let mut rows = Matrix::zeros(m, n + 1);
        for i in 0..m {
            for (j, &column) in row.columns.iter().enumerate() {
                rows[(i, column)] = whitened[(i, j)];
            }
            rows[(i, n)] = residual[i];
        }
        information.absorb(&mut rows).expect("finite");
        Ok(())
    });
    visited.expect("defined");
    information
}

#[test]
fn whitened_equations_are_those_of_dense_algebra_on_dual_numbers() {
    let flagship = flagship();
    let options = simulate::Options { rows: vec![(0, 70)], seed: Some(3), exact: false };
    let tables = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates").tables;
    let arcsec = std::f64::consts::PI / 648_000.0;
    let mut sigma = vec![17.59 * arcsec; 8];
    sigma.push(0.01);
    sigma.resize(flagship.0.measurements[0].inputs.len(), 0.0);
    for set in InstructionSet::available() {
        let execution = Execution::new(set, 1);
        let options = Options { weights: Some(Weights::Propagated), execution, ..Options::default() };
        let (problem, _) = Problem::bind(&flagship.0, tables.clone(), &options).expect("it binds");
        for far in [0.0, 300.0] {
            let step: Vec<f64> = problem.scale().iter().enumerate().map(|(k, s)| far * s * (k as f64).sin()).collect();
            let point = problem.retract(&problem.start, &step);
            let found = problem.linearised(&point).expect("defined");
            let expected = dense(&problem, &point, &sigma);
            close(&normal(&found.information), &normal(&expected), 1e-9, &format!("{}, {far} away", set.name()));
            let sums = problem.sums(&point).expect("defined");
            close(&[sums.squares], &[2.0 * expected.cost()], 1e-11, "the cost alone");
            close(&[found.sums.cost], &[expected.cost()], 1e-11, "the cost beside");
        }
    }
}

#[test]
fn the_gradient_is_that_of_the_cost() {
    let flagship = flagship();
    let options = simulate::Options { rows: vec![(0, 30)], seed: Some(8), exact: false };
    let tables = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates").tables;
    for loss in [None, Some(("huber", 0)), Some(("tukey", 0)), Some(("cauchy", 1))] {
        let robust = loss.map(|(name, of)| phical::compile::Robust {
            loss: phical::statistics::Loss::new(phical::statistics::Kernel::from_name(name).expect("known"), None)
                .expect("valid"),
            of: [phical::compile::LossOf::Row, phical::compile::LossOf::Input][of],
            estimated: false,
        });
        let options = Options { weights: Some(Weights::Propagated), robust, ..Options::default() };
        let (problem, _) = Problem::bind(&flagship.0, tables.clone(), &options).expect("it binds");
        // where the residuals are a few standard deviations
        let step: Vec<f64> =
            problem.scale().iter().enumerate().map(|(k, s)| 3.0 * s * (1.0 + k as f64).sin()).collect();
        let truth: Vec<f64> = fit(&problem).point;
        let point = problem.retract(&truth, &step);
        let gradient = problem.linearise(&point).expect("defined").gradient();
        let numeric: Vec<f64> = (0..problem.free.len())
            .map(|k| {
                let mut step = vec![0.0; problem.free.len()];
                let h = 0.02 * problem.scale()[k];
                let mut at = |h: f64| {
                    step[k] = h;
                    problem.cost(&problem.retract(&point, &step)).expect("defined")
                };
                (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
            })
            .collect();
        let scaled = |g: &[f64]| g.iter().zip(problem.scale()).map(|(g, s)| g * s).collect::<Vec<_>>();
        close(&scaled(&gradient), &scaled(&numeric), 1e-5, &format!("{loss:?}"));
    }
}

#[test]
fn an_equation_said_twice_counts_once() {
    let (once, twice) = (york(""), york(r#", "again": "2*(y - a - b*x)""#));
    let (one, two) = (fitted(&once, &[pearson()]), fitted(&twice, &[pearson()]));
    let of = |fit: &Fit| ["a", "b"].map(|name| estimate(fit, name).0);
    close(&of(&two), &of(&one), 1e-7, "the line");
    close(&[two.sum_of_squares], &[one.sum_of_squares], 1e-9, "the sum of squares");
    assert_eq!((two.equations, two.redundant, two.dof), (10, 10, 8));
    let sigmas = |fit: &Fit| ["a", "b"].map(|name| estimate(fit, name).1.expect("known"));
    close(&sigmas(&two), &sigmas(&one), 1e-6, "the sigmas");
}

#[test]
fn correlated_errors_are_those_of_their_sum_and_difference() {
    let correlated = compiled(
        r#"(
        name: "line",
        parameters: { "a": Scalar(Free(5)), "b": Scalar(Free(0)) },
        measurements: { "point": (
            inputs: { "x": (sigma: 0.2), "y": (sigma: 0.3) },
            correlations: { "x, y": 0.6 },
            residuals: { "r": "y - a - b*x" },
        ) },
    )"#,
    );
    // x = 0.2 u, y = 0.3 (0.6 u + 0.8 w) with independent u and w of sigma one
    let independent = compiled(
        r#"(
        name: "line",
        parameters: { "a": Scalar(Free(5)), "b": Scalar(Free(0)) },
        measurements: { "point": (
            inputs: { "u": (sigma: 1), "w": (sigma: 1) },
            residuals: { "r": "0.3*(0.6*u + 0.8*w) - a - b*0.2*u" },
        ) },
    )"#,
    );
    let mixed: Vec<Vec<f64>> = (0..10)
        .map(|i| {
            let u = X[i] / 0.2;
            vec![u, (Y[i] / 0.3 - 0.6 * u) / 0.8]
        })
        .collect();
    let plain: Vec<Vec<f64>> = (0..10).map(|i| vec![X[i], Y[i]]).collect();
    let (one, other) = (fitted(&correlated, &[table(&plain)]), fitted(&independent, &[table(&mixed)]));
    let all = |fit: &Fit| {
        let mut all: Vec<f64> =
            ["a", "b"].iter().flat_map(|n| [estimate(fit, n).0, estimate(fit, n).1.unwrap()]).collect();
        all.push(fit.sum_of_squares);
        let tests = fit.observations.as_ref().expect("tested");
        all.push(tests.redundancy);
        all
    };
    close(&all(&one), &all(&other), 1e-9, "correlated");
    assert!((one.observations.as_ref().expect("tested").redundancy - 8.0).abs() < 1e-9);
}

#[test]
fn redundancy_numbers_sum_to_the_degrees_of_freedom() {
    let flagship = flagship();
    let options = simulate::Options { rows: vec![(0, 60)], seed: Some(11), exact: false };
    let tables = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates").tables;
    for weights in [Weights::Unit, Weights::Propagated] {
        let options = Options { weights: Some(weights), ..Options::default() };
        let (problem, _) = Problem::bind(&flagship.0, tables.clone(), &options).expect("it binds");
        let found = fit(&problem);
        let tests = found.observations.expect("tested");
        assert!((tests.redundancy - found.dof as f64).abs() < 1e-6, "{} of {}", tests.redundancy, found.dof);
        // what groups add to chi-squared is all of it
        let squares: f64 = tests.groups.iter().map(|group| group.squares).sum();
        assert!((squares / found.sum_of_squares - 1.0).abs() < 1e-9, "{squares} of {}", found.sum_of_squares);
    }
}

#[test]
fn a_gross_error_is_named_with_what_cannot_be_told_from_it() {
    let flagship = flagship();
    let seeds = std::env::var("PHICAL_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(40);
    let arcsec = std::f64::consts::PI / 648_000.0;
    let mut named = 0;
    for seed in 0..seeds {
        let options = simulate::Options { rows: vec![(0, 100)], seed: Some(500 + seed), exact: false };
        let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
        let (line, angle) = ((seed * 37 % 100) as usize, (seed % 8) as usize);
        let width = flagship.0.measurements[0].inputs.len();
        let mut spoilt = Table::new(0, width);
        for row in 0..100 {
            let mut readings = simulated.tables[0].1.row(row).to_vec();
            if row == line {
                readings[angle] += if seed % 2 == 0 { 8.0 } else { -8.0 } * 17.59 * arcsec;
            }
            spoilt.push(&[], &readings, None).expect("a row of the table");
        }
        let (problem, _) = Problem::bind(&flagship.0, vec![(0, spoilt)], &Options::default()).expect("it binds");
        let found = fit(&problem);
        let tests = found.observations.expect("tested");
        let name = &flagship.0.measurements[0].inputs[angle].name;
        let is = |o: &phical::fit::Observation| {
            o.row == line && (o.name == *name || o.inseparable.iter().any(|(partner, _)| partner == name))
        };
        named += u64::from(tests.suspects.iter().any(is));
    }
    eprintln!("{named} of {seeds} gross errors named");
    assert!(named * 100 >= 95 * seeds, "{named} of {seeds}");
}

#[test]
fn a_robust_loss_stays_near_the_clean_estimate() {
    let flagship = flagship();
    let arcsec = std::f64::consts::PI / 648_000.0;
    let width = flagship.0.measurements[0].inputs.len();
    let loss = phical::statistics::Loss::new(phical::statistics::Kernel::Tukey, None).expect("valid");
    let robust = phical::compile::Robust { loss, of: phical::compile::LossOf::Row, estimated: false };
    let (mut clean, mut spoilt) = (Vec::new(), Vec::new());
    for seed in 0..12u64 {
        let options = simulate::Options { rows: vec![(0, 200)], seed: Some(900 + seed), exact: false };
        let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
        let truth = &simulated.truth;
        let mut bad = Table::new(0, width);
        for row in 0..200usize {
            let mut readings = simulated.tables[0].1.row(row).to_vec();
            if row % 20 == 7 {
                let sigmas = 20.0 + 80.0 * ((row as f64 + seed as f64) * 0.618).fract();
                readings[(row + seed as usize) % 8] += sigmas * 17.59 * arcsec * if row % 40 == 7 { 1.0 } else { -1.0 };
            }
            bad.push(&[], &readings, None).expect("a row of the table");
        }
        // errors in standard uncertainties of the clean fit
        let run = |tables, robust| {
            let options = Options { robust, ..Options::default() };
            let (problem, _) = Problem::bind(&flagship.0, tables, &options).expect("it binds");
            let procedure = phical::session::Procedure::default();
            phical::session::fit_by(&problem, &procedure).expect("it fits")
        };
        let (one, other) = (run(simulated.tables.clone(), None), run(vec![(0, bad)], Some(robust)));
        let errors = |fit: &Fit| {
            let each = fit.parameters.iter().zip(&one.parameters).map(|(p, clean)| {
                let truth = truth.iter().find(|(name, _)| *name == p.name).expect("known").1;
                ((p.value - truth) / clean.sigma.expect("known")).powi(2)
            });
            (each.sum::<f64>() / 20.0).sqrt()
        };
        clean.push(errors(&one));
        spoilt.push(errors(&other));
        assert!(other.rejected >= 9, "{} rejected", other.rejected);
    }
    let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
    eprintln!("errors in sigmas: {:.3} clean, {:.3} robust", mean(&clean), mean(&spoilt));
    assert!(mean(&spoilt) <= 1.5 * mean(&clean));
}

#[test]
fn errors_that_make_no_sense_are_refused() {
    let of = |text: &str| {
        let source = phical::diag::Source::new("m", text);
        let found = match phical::model::load(&source) {
            Ok((model, _)) => phical::compile::compile(&model, &source, &[]).expect_err("refused"),
            Err(found) => found,
        };
        found.0.iter().map(|d| d.code).collect::<Vec<_>>()
    };
    let line = |inputs: &str, more: &str| {
        format!(
            r#"(name: "m", parameters: {{"a": Scalar(Free(1))}}, measurements: {{"p": (inputs: {{{inputs}}}, {more}
            residuals: {{"r": "y - a*x"}})}})"#
        )
    };
    assert_eq!(of(&line(r#""x": (sigma: 0), "y": ()"#, "")), [Code::NotPositive]);
    assert_eq!(of(&line(r#""x": (sigma: -1), "y": ()"#, "")), [Code::NotPositive]);
    assert_eq!(of(&line(r#""x": (sigma: NaN), "y": ()"#, "")), [Code::NotFinite]);
    assert_eq!(of(&line(r#""x": (sigma: "0*y"), "y": ()"#, "")), [Code::NotPositive]);
    assert_eq!(of(&line(r#""x": (sigma: "a"), "y": ()"#, "")), [Code::SigmaOfParameter]);
    let two = r#""x": (sigma: 1), "y": (sigma: 1)"#;
    assert_eq!(of(&line(two, r#"correlations: {"x, y": 1},"#)), [Code::BadCovariance]);
    assert_eq!(of(&line(two, r#"correlations: {"x, z": 0.5},"#)), [Code::UnknownName]);
    assert_eq!(of(&line(two, r#"correlations: {"x": 0.5},"#)), [Code::BadExpression]);
    let three = r#""x": (sigma: 1), "y": (sigma: 1), "z": (sigma: 1)"#;
    let contradiction = r#"correlations: {"x, y": 0.9, "y, z": 0.9, "x, z": -0.9},"#;
    assert_eq!(of(&line(three, contradiction)), [Code::BadCovariance]);
    assert_eq!(of(&line(two, r#"loss: "hubr","#)), [Code::UnknownVariant]);
    assert_eq!(of(&line(two, r#"loss: (kernel: "huber", tuning: -1),"#)), [Code::NotPositive]);
}
