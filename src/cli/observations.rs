//! Every observation as a table: `calibrate --observations DIR`.

use std::io::Write;
use std::path::Path;

use super::simulate::file_name;
use crate::data::{Output, Written, make_directory};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Fit, Observation, observations};
use crate::problem::{Problem, Undefined};

const HEADING: &str = "row,observation,unit,observed,adjusted,correction,sigma,redundancy,test,smallest_detectable,\
                       most_moved,moved_by_sigmas,inseparable";

/// Writes what is to be DIR/M.csv for each measurement: a line for each observation, rows counted from one.
pub(super) fn write_observations(directory: &Path, problem: &Problem, fit: &Fit) -> Result<Vec<Written>, Diagnostics> {
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
    let written = make_directory(directory).and_then(|()| {
        let one = |(measurement, table): (usize, Vec<u8>)| {
            let name = file_name(&problem.program.measurement(measurement)?.name)?;
            Output::open(&directory.join(name))?.write(|out| out.write_all(&table))
        };
        tables.into_iter().map(one).collect()
    });
    written.map_err(|found| Diagnostics::from(*found))
}

fn heading() -> Vec<u8> {
    format!("{HEADING}\n").into_bytes()
}

fn line(table: &mut Vec<u8>, o: &Observation, fit: &Fit) {
    let maybe = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    let moved = o.effect.and_then(|(parameter, _)| fit.parameters.get(parameter)).map_or("", |of| of.name.as_str());
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
