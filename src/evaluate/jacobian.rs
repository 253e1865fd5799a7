//! Residuals and their derivatives by parameters and by inputs, neither weighted nor scaled, in reported units.

use crate::diag::{Code, Diagnostic};
use crate::problem::{Block, Problem, Undefined};

/// The matrices of one measurement, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Jacobian {
    /// The measurement.
    pub measurement: String,
    /// The free coordinates and their units, in declared order.
    pub parameters: Vec<(String, String)>,
    /// The inputs and their units.
    pub inputs: Vec<(String, String)>,
    /// The residuals and their units.
    pub residuals: Vec<(String, String)>,
    /// The readings of each row.
    pub rows: Vec<Vec<f64>>,
    /// The free coordinates' values.
    pub q: Vec<f64>,
    /// By row and residual.
    pub r: Vec<Vec<f64>>,
    /// By row, residual and parameter.
    pub dr_dq: Vec<Vec<Vec<f64>>>,
    /// By row, residual and input.
    pub dr_dx: Vec<Vec<Vec<f64>>>,
}

/// The matrices of every measurement that has data. A rotation's columns are by its right perturbation.
///
/// # Errors
/// The first row where a residual or a derivative is undefined.
pub fn jacobians(problem: &Problem, point: &[f64]) -> Result<Vec<Jacobian>, Undefined> {
    problem.fits(point)?;
    problem.blocks.iter().map(|block| of_block(problem, block, point)).collect()
}

fn of_block(problem: &Problem, block: &Block, point: &[f64]) -> Result<Jacobian, Undefined> {
    let (measurement, units) = (block.measurement, &problem.program.units);
    let free: Vec<_> = problem.free.iter().map(|&c| &problem.layout.coordinates[c]).collect();
    let (m, n, width) = (measurement.residuals.len(), free.len(), measurement.inputs.len());
    let rows = block.table.rows();
    // one internal unit of each, in reported units
    let residual: Vec<f64> = measurement.residuals.iter().map(|r| units.to_reported(1.0, r.dimension)).collect();
    let column: Vec<f64> = free.iter().map(|c| units.to_reported(1.0, c.dimension)).collect();
    let input: Vec<f64> = measurement.inputs.iter().map(|i| units.to_reported(1.0, i.unit.dimension)).collect();

    let mut jacobian = Jacobian {
        measurement: measurement.name.clone(),
        parameters: free.iter().map(|c| (c.name.clone(), units.symbol(c.dimension))).collect(),
        inputs: measurement.inputs.iter().map(|i| (i.name.clone(), units.symbol(i.unit.dimension))).collect(),
        residuals: measurement.residuals.iter().map(|r| (r.name.clone(), units.symbol(r.dimension))).collect(),
        rows: Vec::with_capacity(rows),
        q: problem.free.iter().zip(&free).map(|(&c, known)| units.to_reported(point[c], known.dimension)).collect(),
        r: vec![vec![0.0; m]; rows],
        dr_dq: vec![vec![vec![0.0; n]; m]; rows],
        dr_dx: vec![vec![vec![0.0; width]; m]; rows],
    };
    for row in 0..rows {
        let readings = block.table.row(row);
        let readings = readings.iter().zip(&measurement.inputs);
        jacobian.rows.push(readings.map(|(&value, i)| units.to_reported(value, i.unit.dimension)).collect());
    }
    block.jacobians(&problem.layout, point, &problem.places(), |found| {
        for (i, (residual, weight)) in residual.iter().zip(&block.weights).enumerate() {
            let factor = residual / weight;
            jacobian.r[found.row][i] = found.residuals[i] * factor;
            let derivatives = &found.derivatives[i * found.columns.len()..];
            for (&place, &derivative) in found.columns.iter().zip(derivatives) {
                jacobian.dr_dq[found.row][i][place] += derivative * factor / column[place];
            }
        }
        Ok(())
    })?;
    let used = measurement.tape.inputs();
    let (mut values, mut derivatives) = (vec![0.0; m], vec![0.0; m * used]);
    let mut undefined = None;
    block.input_jacobians(&problem.layout, point, |row, evaluate| {
        evaluate(&block.table.row(row), &mut values, &mut derivatives);
        for i in 0..m {
            for k in 0..used {
                let derivative = derivatives[i * used + k] * residual[i] / input[k];
                if !derivative.is_finite() {
                    undefined.get_or_insert((row, i, k));
                }
                jacobian.dr_dx[row][i][k] = derivative;
            }
        }
    })?;
    match undefined {
        None => Ok(jacobian),
        Some((row, i, k)) => {
            let (r, x) = (&measurement.residuals[i].name, &measurement.inputs[k].name);
            let message = format!(
                "measurement `{}`, row {}: the residual `{r}` has no derivative by `{x}`",
                measurement.name,
                row + 1
            );
            let found = Diagnostic::error(Code::UndefinedAtStart, message).at_data(block.table.place(row));
            Err(Undefined(Box::new(found)))
        }
    }
}
