//! Every observation as a table: `calibrate --observations DIR`.

use std::io::Write;
use std::path::Path;

use crate::data::Output;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Fit, Observation, observations};
use crate::problem::{Problem, Undefined};

const HEADING: &str = "row,observation,unit,observed,adjusted,correction,sigma,redundancy,test,smallest_detectable,\
                       most_moved,moved_by_sigmas,inseparable";

/// Writes DIR/M.csv for each measurement: a line for each observation, rows counted from one.
pub(super) fn write_observations(directory: &Path, problem: &Problem, fit: &Fit) -> Result<(), Diagnostics> {
    let Some(declared) = &fit.cofactors else {
        let message = "there are no uncertainties to test observations by";
        return Err(Diagnostic::error(Code::Underdetermined, message).into());
    };
    let mut tables: Vec<(usize, Vec<u8>)> = problem.blocks.iter().map(|block| (block.index, heading())).collect();
    let mut write = |found: &Observation| {
        if let Some((_, table)) = tables.iter_mut().find(|(measurement, _)| *measurement == found.measurement) {
            line(table, found, fit);
        }
    };
    observations(problem, &fit.point, declared, fit.estimated_scale(), &mut write)
        .map_err(|Undefined(found)| Diagnostics::from(*found))?;
    let failed = |error: std::io::Error| {
        Diagnostic::error(Code::CannotWrite, format!("`{}` cannot be made: {error}", directory.display()))
    };
    std::fs::create_dir_all(directory).map_err(|error| Diagnostics::from(failed(error)))?;
    for (measurement, table) in tables {
        let name = &problem.program.measurements[measurement].name;
        let out = Output::open(&directory.join(format!("{name}.csv")));
        let written = out.and_then(|out| out.finish(|out| out.write_all(&table)));
        written.map_err(|found| Diagnostics::from(*found))?;
    }
    Ok(())
}

fn heading() -> Vec<u8> {
    format!("{HEADING}\n").into_bytes()
}

fn line(table: &mut Vec<u8>, o: &Observation, fit: &Fit) {
    let maybe = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let moved = o.effect.map_or("", |(parameter, _)| fit.parameters[parameter].name.as_str());
    let partners: Vec<String> = o.inseparable.iter().map(|(name, rho)| format!("{name} {rho:.3}")).collect();
    // writing to memory cannot fail
    let _ = writeln!(
        table,
        "{},{},{},{},{},{},{},{},{},{},{moved},{},{}",
        o.row + 1,
        o.name,
        o.unit,
        o.observed,
        o.adjusted,
        o.adjusted - o.observed,
        o.sigma,
        o.redundancy,
        maybe(o.test),
        maybe(o.smallest_detectable),
        maybe(o.effect.map(|(_, sigmas)| sigmas)),
        partners.join("; "),
    );
}
