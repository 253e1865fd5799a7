//! What the flagship reaches, over many seeds: the columns of the table in the design, and the paper's figures before
//! calibration.

use phical::fit::{Fit, analyse};
use phical::problem::{Options, Problem, Quantities, Selection, Weights};
use phical::simulate::{self, simulate};
use phical::solve::{Settings, minimise};

use crate::flagship::{Flagship, flagship};

/// Seeds of the quick test; `PHICAL_SEEDS=200 cargo test --release accuracy` runs a campaign.
pub fn seeds() -> u64 {
    std::env::var("PHICAL_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(40)
}

/// Absolute errors of vo.x, vo.y, vo.z on lines, at given values of the coordinates: (mean, standard deviation) each.
pub fn errors(flagship: &Flagship, point: &[f64], lines: usize, seed: u64) -> [(f64, f64); 3] {
    let options = simulate::Options { rows: vec![(0, lines)], seed: Some(seed), exact: true };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let (problem, _) = Problem::bind(&flagship.0, simulated.tables, &Options::default()).expect("it binds");
    let mut all = vec![Vec::new(); 3];
    let block = &problem.blocks[0];
    block
        .values(Quantities::Residuals, &problem.layout, point, |_, values| {
            for (errors, value) in all.iter_mut().zip(values) {
                errors.push(value.abs());
            }
        })
        .expect("defined");
    let statistics = |errors: &Vec<f64>| {
        let n = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / n;
        (mean, (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
    };
    [0, 1, 2].map(|i| statistics(&all[i]))
}

/// a and b of L1, L2, R1 and R2.
pub const OFFSETS: [&str; 8] = ["L1.a", "L1.b", "L2.a", "L2.b", "R1.a", "R1.b", "R2.a", "R2.b"];

/// The flagship with a prior of 0.5 mm on its offsets.
pub fn with_prior() -> Flagship {
    let mut flagship = flagship();
    for parameter in &mut flagship.0.parameters {
        if OFFSETS.contains(&parameter.name.as_str()) {
            parameter.setting.sigma[0] = Some(0.5);
        }
    }
    flagship
}

fn calibrated(flagship: &Flagship, weights: Weights, lines: usize, seed: u64) -> Fit {
    let options = simulate::Options { rows: vec![(0, lines)], seed: Some(seed), exact: false };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let options = Options { weights: Some(weights), selection: Selection::default(), ..Options::default() };
    let (problem, _) = Problem::bind(&flagship.0, simulated.tables, &options).expect("it binds");
    let solution = minimise(&problem, problem.start.clone(), &Settings::default()).expect("it starts");
    analyse(&problem, solution).expect("defined")
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (values[(n - 1) / 2] + values[n / 2]) / 2.0
}

#[test]
fn uncalibrated_errors_are_the_papers() {
    let flagship = flagship();
    let nominal: Vec<f64> = flagship.0.parameters.iter().map(|p| p.setting.nominal[0]).collect();
    let found = errors(&flagship, &nominal, 5000, 99);
    let paper = [(14.19, 6.37), (9.7, 6.38), (10.3, 5.51)];
    for ((mean, sd), (paper_mean, paper_sd)) in found.iter().zip(paper) {
        assert!((mean / paper_mean - 1.0).abs() < 0.1, "mean {mean} against {paper_mean}");
        assert!((sd / paper_sd - 1.0).abs() < 0.1, "sd {sd} against {paper_sd}");
    }
}

/// Medians over the seeds of the mean errors on 500 lines, and of χ² by its degrees of freedom.
fn medians(flagship: &Flagship, weights: Weights, lines: usize, seeds: u64) -> ([f64; 3], f64) {
    let mut means = vec![Vec::new(); 3];
    let mut ratios = Vec::new();
    for seed in 0..seeds {
        let fit = calibrated(flagship, weights, lines, 1000 + seed);
        assert!(fit.status.converged());
        assert_eq!((fit.rank, fit.equations, fit.unsettled, fit.redundant), (20, 5 * lines, 0, 0));
        ratios.push(2.0 * fit.cost / fit.dof as f64);
        for (means, (mean, _)) in means.iter_mut().zip(errors(flagship, &fit.point, 500, 77)) {
            means.push(mean);
        }
    }
    let mut means = means.into_iter().map(median);
    ([0; 3].map(|_| means.next().unwrap_or(f64::NAN)), median(ratios))
}

#[test]
fn calibrated_errors_are_those_of_the_table() {
    // lines, then the columns `unit`, `propagated`, and `propagated` with the prior
    let table = [
        (100, [[0.064, 0.035, 0.059], [0.047, 0.029, 0.044], [0.043, 0.026, 0.037]]),
        (300, [[0.038, 0.021, 0.034], [0.030, 0.016, 0.024], [0.029, 0.016, 0.021]]),
    ];
    let (plain, prior) = (flagship(), with_prior());
    for (lines, columns) in table {
        let kinds = [(&plain, Weights::Unit), (&plain, Weights::Propagated), (&prior, Weights::Propagated)];
        for (k, ((flagship, weights), expected)) in kinds.into_iter().zip(columns).enumerate() {
            let (found, ratio) = medians(flagship, weights, lines, seeds());
            eprintln!("{lines} lines, column {k}: {found:.3?}, chi-squared by dof {ratio:.3}");
            for (found, expected) in found.iter().zip(expected) {
                assert!(*found <= 1.25 * expected, "{lines} lines, column {k}: {found:?} against {expected:?}");
            }
            if weights.are_real() && lines == 300 {
                assert!((0.95..1.05).contains(&ratio), "{ratio}");
            }
        }
    }
}

#[test]
fn the_papers_21_parameters_are_one_too_many() {
    let flagship = flagship();
    let options = simulate::Options { rows: vec![(0, 100)], seed: Some(5), exact: false };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let selection = Selection { free: vec!["L1.b".into()], ..Selection::default() };
    let options = Options { weights: Some(Weights::Unit), selection, ..Options::default() };
    let (problem, _) = Problem::bind(&flagship.0, simulated.tables, &options).expect("it binds");
    let solution = minimise(&problem, problem.start.clone(), &Settings::default()).expect("it starts");
    let fit = analyse(&problem, solution).expect("defined");
    assert_eq!((fit.rank, fit.parameters.len(), fit.null_directions.len()), (20, 21, 1));
    assert!(fit.status.converged());
    assert!(!fit.verdict().trustworthy());
    let blind: Vec<&str> = fit.parameters.iter().filter(|p| !p.estimable).map(|p| p.name.as_str()).collect();
    assert_eq!(blind, ["L1.b", "R1.b"]);
    assert!(fit.parameters.iter().all(|p| p.estimable == p.sigma.is_some()));
}

#[test]
fn the_invisible_direction_is_the_known_one() {
    use phical::solve::LeastSquares;
    let flagship = flagship();
    let options = simulate::Options { rows: vec![(0, 60)], seed: Some(5), exact: true };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let truth = simulated.truth.clone();
    let selection = Selection { free: vec!["L1.b".into()], start: truth, ..Selection::default() };
    let options = Options { weights: Some(Weights::Unit), selection, ..Options::default() };
    let (problem, _) = Problem::bind(&flagship.0, simulated.tables, &options).expect("it binds");
    let information = problem.linearise(&problem.start).expect("defined");
    let found = problem.invisible(&problem.start, &information).expect("defined");
    assert_eq!(found.len(), 1);
    let scale = problem.scale();
    // lengths in mm, angles in mrad, unit length
    let mut direction: Vec<f64> = found[0].iter().zip(scale).map(|(z, s)| z * s).collect();
    for (value, &c) in direction.iter_mut().zip(&problem.free) {
        if problem.layout.coordinates[c].dimension == phical::unit::Dimension::ANGLE {
            *value *= 1e3;
        }
    }
    let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    // at table 2; turning the base about the vertical, by the tilt of the right axis over the distance between the
    // axes, turns both trunnion axes in their frames
    let turn = 2.35e-3;
    let known = [
        ("L1.b", 0.707),
        ("R1.b", 0.706),
        ("R2.b", 0.0375),
        ("L2.b", 0.0076),
        ("R1.a", -0.0005),
        ("L1.a", 0.0002),
        ("L1.alpha", turn),
        ("R1.alpha", turn),
    ];
    let sign = direction.iter().sum::<f64>().signum();
    for (v, &c) in direction.iter().zip(&problem.free) {
        let name = &problem.layout.coordinates[c].name;
        let expected = known.iter().find(|(known, _)| known == name).map_or(0.0, |(_, value)| *value);
        assert!((sign * v / norm - expected).abs() < 1e-3, "{name}: {}", v / norm);
    }
}
