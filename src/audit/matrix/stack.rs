//! All equations of a problem as the rows of one matrix.

use crate::evaluate::{Jacobian, jacobians};
use crate::problem::{Problem, Undefined};
use crate::solve::LeastSquares;

/// A row of the matrix: a residual of a row of data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Equation {
    /// The measurement, among those with data.
    pub measurement: usize,
    /// The row of data, from zero.
    pub row: usize,
    /// The residual, among those of all measurements.
    pub residual: usize,
}

/// The exact derivatives of all equations by all free parameters, one measurement's rows after the other's, and in each row its
/// residuals in declared order. In reported units, not weighted.
#[derive(Clone, Debug)]
pub struct Stack {
    /// The measurements with data.
    pub measurements: Vec<String>,
    /// What each row of the matrix is.
    pub equations: Vec<Equation>,
    /// The residuals of all measurements and their units; with the measurement's name where there are several.
    pub residuals: Vec<(String, String)>,
    /// The columns and their units: the free parameters, and the inputs where there is one measurement.
    pub columns: Vec<(String, String)>,
    /// How many of the columns are parameters.
    pub parameters: usize,
    /// The values of the free parameters.
    pub q: Vec<f64>,
    /// The matrix by rows.
    pub entries: Vec<Vec<f64>>,
    /// The residuals themselves.
    pub r: Vec<f64>,
}

impl Stack {
    /// The matrix at a point.
    ///
    /// # Errors
    /// Where a residual or a derivative is undefined.
    pub fn at(problem: &Problem, point: &[f64]) -> Result<Stack, Undefined> {
        Ok(Stack::of(&jacobians(problem, point)?))
    }

    /// The matrices of several measurements as one.
    pub fn of(all: &[Jacobian]) -> Stack {
        let alone = all.len() == 1;
        let mut stack = Stack {
            measurements: all.iter().map(|one| one.measurement.clone()).collect(),
            equations: Vec::new(),
            residuals: Vec::new(),
            columns: all.first().map(|one| one.parameters.clone()).unwrap_or_default(),
            parameters: all.first().map_or(0, |one| one.parameters.len()),
            q: all.first().map(|one| one.q.clone()).unwrap_or_default(),
            entries: Vec::new(),
            r: Vec::new(),
        };
        if let (true, Some(one)) = (alone, all.first()) {
            stack.columns.extend(one.inputs.iter().cloned());
        }
        for (measurement, one) in all.iter().enumerate() {
            let first = stack.residuals.len();
            stack.residuals.extend(one.residuals.iter().map(|(name, unit)| match alone {
                true => (name.clone(), unit.clone()),
                false => (format!("{} {name}", one.measurement), unit.clone()),
            }));
            for row in 0..one.rows.len() {
                for (i, by_parameters) in one.dr_dq[row].iter().enumerate() {
                    stack.equations.push(Equation { measurement, row, residual: first + i });
                    let inputs = if alone { one.dr_dx[row][i].as_slice() } else { &[] };
                    stack.entries.push([by_parameters.as_slice(), inputs].concat());
                    stack.r.push(one.r[row][i]);
                }
            }
        }
        stack
    }

    /// The largest derivative of each residual by anything in the unit of each column: what its digits count from.
    pub fn scales(&self) -> Vec<Vec<f64>> {
        let mut largest = vec![vec![0.0_f64; self.columns.len()]; self.residuals.len()];
        for (equation, entries) in self.equations.iter().zip(&self.entries) {
            for (most, entry) in largest[equation.residual].iter_mut().zip(entries) {
                *most = most.max(entry.abs());
            }
        }
        let of_unit = |row: &Vec<f64>, unit: &str| {
            self.columns
                .iter()
                .zip(row)
                .filter(|((_, other), _)| other == unit)
                .fold(0.0, |most: f64, (_, x)| most.max(*x))
        };
        largest.iter().map(|row| self.columns.iter().map(|(_, unit)| of_unit(row, unit)).collect()).collect()
    }

    /// `vo.x by L1.alpha`, and the row of data where there are several.
    pub fn name(&self, equation: usize, column: usize) -> String {
        let Equation { row, residual, .. } = self.equations[equation];
        format!("{} by {}, row {}", self.residuals[residual].0, self.columns[column].0, row + 1)
    }
}

/// Values and derivatives where one parameter is moved by δ, in its reported unit; none where something is undefined there.
pub(super) fn shifted(problem: &Problem, point: &[f64], column: usize, delta: f64) -> Option<Stack> {
    let units = &problem.program.units;
    let coordinate = &problem.layout.coordinates[*problem.free.get(column)?];
    let mut step = vec![0.0; problem.dimension()];
    step[column] = units.to_internal(delta, units.unit(coordinate.dimension));
    Stack::at(problem, &problem.retract(&point.to_vec(), &step)).ok()
}
