//! How well rows are predicted that took no part in the fit: k-fold hold-out.

use super::calibrate::fit_by;
use super::procedure::Procedure;
use crate::data::Stage;
use crate::diag::{Code, Diagnostic};
use crate::problem::{Problem, Quantities, Undefined};
use crate::solve::Status;

/// What the rows held out say.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// How many fits were made, each without a share of the rows.
    pub folds: usize,
    /// Of these, how many did not converge, or could not estimate a parameter.
    pub failed: usize,
    /// Σ of the squares of whitened residuals of the rows held out, by their equations: about one where weights are real and
    /// the model is right, and no more than within the fit where parameters are known well.
    pub per_equation: f64,
    /// The same within the fit of all rows.
    pub within: f64,
    /// Root mean square of each residual of the rows held out, in reported units: measurement, residual, value, unit.
    pub rms: Vec<(String, String, f64, String)>,
}

/// Fits `folds` times without every `folds`-th row, and predicts those; none where it was stopped.
///
/// # Errors
/// Fewer than two folds, or fewer rows than folds; where a search cannot start or a residual is undefined.
pub fn hold_out(
    problem: &Problem,
    procedure: &Procedure,
    folds: usize,
    fitted: &[f64],
) -> Result<Option<HeldOut>, Box<Diagnostic>> {
    let rows: usize = problem.blocks.iter().map(|block| block.table.rows()).sum();
    if folds < 2 || folds > rows {
        let message = format!("{rows} rows cannot be held out in {folds} shares");
        return Err(Box::new(
            Diagnostic::error(Code::NoRows, message).hint("ask for two to as many as there are rows"),
        ));
    }
    let undefined = |Undefined(found): Undefined| found;
    let within = problem.without_loss().sums(fitted).map_err(undefined)?;
    let (mut squares, mut equations, mut failed) = (0.0, 0, 0);
    let mut sums: Vec<Vec<f64>> = problem.blocks.iter().map(|b| vec![0.0; b.measurement.residuals.len()]).collect();
    let mut counts = vec![0usize; problem.blocks.len()];
    for fold in 0..folds {
        if problem.execution.stopped() {
            return Ok(None);
        }
        // rows are counted through all measurements, so that small ones lose rows in turn
        let mut first = 0;
        let (mut held, mut kept) = (Vec::new(), Vec::new());
        for block in &problem.blocks {
            let (out, rest): (Vec<usize>, Vec<usize>) =
                (0..block.table.rows()).partition(|row| (first + row) % folds == fold);
            first += block.table.rows();
            held.push(out);
            kept.push(rest);
        }
        let mut training = problem.without_rows(&held);
        training.start.clone_from(&problem.start);
        training.execution = problem.execution.silent();
        problem.execution.tell(Stage::Of { what: "folds", done: fold as u64, all: folds as u64 });
        let fit = fit_by(&training, procedure)?;
        if fit.status == Status::Interrupted {
            return Ok(None);
        }
        if !fit.status.converged() || fit.parameters.iter().any(|p| !p.estimable) {
            failed += 1;
            continue;
        }
        let test = problem.without_rows(&kept).without_loss();
        let found = test.sums(&fit.point).map_err(undefined)?;
        squares += found.squares;
        equations += found.equations;
        for ((block, sums), (count, kept)) in test.blocks.iter().zip(&mut sums).zip(counts.iter_mut().zip(&held)) {
            let wanted = |row: usize| kept.binary_search(&row).is_ok();
            block
                .values(Quantities::Residuals, &test.layout, &fit.point, |row, values| {
                    if wanted(row) {
                        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * value);
                        *count += 1;
                    }
                })
                .map_err(undefined)?;
        }
    }
    let mut rms = Vec::new();
    for ((block, sums), count) in problem.blocks.iter().zip(sums).zip(counts).filter(|(_, count)| *count > 0) {
        for (residual, sum) in block.measurement.residuals.iter().zip(sums) {
            let units = &problem.program.units;
            let value = units.to_reported((sum / count as f64).sqrt(), residual.dimension);
            let name = (block.measurement.name.clone(), residual.name.clone());
            rms.push((name.0, name.1, value, units.symbol(residual.dimension)));
        }
    }
    let ratio = |squares: f64, equations: usize| squares / equations.max(1) as f64;
    Ok(Some(HeldOut {
        folds,
        failed,
        per_equation: ratio(squares, equations),
        within: ratio(within.squares, within.equations),
        rms,
    }))
}
