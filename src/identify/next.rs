//! What to measure next: the row of a scenario that tells most of one direction.

use super::inputs::{At, Inputs, Probe};
use crate::compile::Scenario;
use crate::problem::Problem;
use crate::solve::LeastSquares;

/// Rows of each measurement that are compared.
const ROWS: usize = 200;
/// Candidates are made with random numbers of their own.
const SALT: u64 = 0x6e65_7874;
/// A row that sees less than this share of what it sees of all parameters sees nothing of a direction.
const NOTHING: f64 = 1e-9;

/// A row that is worth measuring.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Of which measurement.
    pub measurement: String,
    /// Its keys and inputs: name, value as text, unit.
    pub inputs: Vec<(String, String, String)>,
    /// What it tells of the direction: 1/σ² in squared tolerances.
    pub information: f64,
    /// How many such rows there were to choose from.
    pub among: usize,
}

/// The row of a scenario, simulated at the start of `like`, that tells most of a direction (a unit vector in tolerances); none
/// where no row sees it, or the scenario has other family members.
pub fn next<'a>(probe: &Probe<'a>, like: &Problem<'a>, scenario: &'a Scenario, direction: &[f64]) -> Option<Candidate> {
    let rows = scenario.measurements.iter().map(|simulation| (simulation.measurement, ROWS)).collect();
    let probe = Probe { inputs: Inputs::Scenario(scenario), rows, ..probe.clone() };
    let At { problem, .. } = probe.at(like, &like.start, SALT).ok()?;
    let problem = problem.without_loss();
    let delta: Vec<f64> = direction.iter().zip(problem.scale()).map(|(z, scale)| z * scale).collect();
    let mut best: Option<(f64, usize, usize)> = None;
    let mut among = 0;
    problem
        .inspect(&problem.start, |row| {
            among += 1;
            let width = row.columns.len().max(1);
            let (mut seen, mut size) = (0.0, 0.0);
            for equation in row.derivatives.chunks(width) {
                let terms = || equation.iter().zip(row.columns).map(|(d, &column)| d * delta[column]);
                seen += terms().sum::<f64>().powi(2);
                size += terms().map(f64::abs).sum::<f64>().powi(2);
            }
            if seen > NOTHING * NOTHING * size && best.is_none_or(|(most, ..)| seen > most) {
                best = Some((seen, row.block, row.row));
            }
        })
        .ok()?;
    let (information, block, row) = best?;
    let block = &problem.blocks[block];
    let units = &problem.program.units;
    let keys = block.measurement.keys.iter().enumerate();
    let keys = keys.map(|(k, key)| (key.clone(), block.table.key(row, k).to_owned(), "1".to_owned()));
    let readings = block.table.row(row);
    let inputs = block.measurement.inputs.iter().zip(readings.iter()).map(|(input, value)| {
        let dimension = input.unit.dimension;
        (input.name.clone(), format!("{:.4}", units.to_reported(*value, dimension)), units.symbol(dimension))
    });
    Some(Candidate {
        measurement: block.measurement.name.clone(),
        inputs: keys.chain(inputs).collect(),
        information,
        among,
    })
}
