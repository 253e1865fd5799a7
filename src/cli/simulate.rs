//! `phical simulate MODEL`

use std::path::PathBuf;

use clap::Args;
use serde_json::{Map, Value, json};

use super::arguments::{rows, scenario_rows};
use super::progress::shown;
use super::{Format, Outcome, pretty};
use crate::data::{self, Output, Written, make_directory};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};
use crate::session::Session;
use crate::simulate::{Options, simulate_watched};

#[derive(Debug, Args)]
pub(super) struct Simulate {
    /// The model file
    model: PathBuf,
    /// Which scenario [default: the first]
    #[arg(long, value_name = "NAME")]
    scenario: Option<String>,
    /// How many rows a measurement gets
    #[arg(long, value_name = "M=N", value_parser = rows)]
    rows: Vec<(String, usize)>,
    /// The seed of the random numbers [default: the scenario's]
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Without the errors of the sensors
    #[arg(long)]
    exact: bool,
    /// Where the files go; made if need be
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
}

impl Simulate {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let session = Session::open(&self.model, &[])?;
        let program = &session.program;
        let mut mistakes = session.warnings.clone();
        let asked = scenario_rows(&session, self.scenario.as_deref(), &self.rows, &mut mistakes);
        let (scenario, rows) = match asked {
            Some(asked) if !mistakes.has_errors() => asked,
            _ => return Err(mistakes),
        };
        let options = Options { rows, seed: self.seed, exact: self.exact };
        let simulated = simulate_watched(program, scenario, &options, &shown());
        let simulated = simulated.map_err(|found| Diagnostics::from(*found))?;

        make_directory(&self.out).map_err(|found| Diagnostics::from(*found))?;
        let (mut files, mut written) = (Vec::new(), Vec::new());
        for (index, table) in &simulated.tables {
            let name = &program.measurement(*index).map_err(|found| Diagnostics::from(*found))?.name;
            let path = self.out.join(file_name(name).map_err(|found| Diagnostics::from(*found))?);
            written.push(data::write(program, *index, table, &path).map_err(|found| Diagnostics::from(*found))?);
            files.push((name.clone(), path.display().to_string(), table.rows()));
        }
        let truth: Map<String, Value> =
            simulated.truth.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        let truth = Value::Object(truth);
        let truth_file = self.out.join("truth.json");
        Output::open(&truth_file)
            .and_then(|out| out.write(|out| out.write_all(pretty(&truth).as_bytes())))
            .and_then(|truth| written.into_iter().chain([truth]).try_for_each(Written::put))
            .map_err(|found| Diagnostics::from(*found))?;

        let seed = options.seed.unwrap_or(scenario.seed);
        let exact = if self.exact { ", without errors" } else { "" };
        let text = || {
            let mut out = format!("Simulated `{}`, seed {seed}{exact}\n\n", scenario.name);
            for (_, file, rows) in &files {
                out.push_str(&format!("  {file}: {rows} rows\n"));
            }
            out.push_str(&format!("  {}: {} true values\n", truth_file.display(), simulated.truth.len()));
            out
        };
        let json = || {
            let files = files.iter().map(|(name, file, rows)| json!({"measurement": name, "file": file, "rows": rows}));
            json!({
                "scenario": scenario.name,
                "seed": seed,
                "exact": self.exact,
                "files": files.collect::<Vec<_>>(),
                "truth_file": truth_file.display().to_string(),
                "truth": truth,
            })
        };
        Ok(Outcome::new(format, text, json).warned(session.warnings.clone()))
    }
}

/// The file of a measurement, which must not lead out of the directory.
pub(super) fn file_name(measurement: &str) -> Result<String, Box<Diagnostic>> {
    let name = format!("{measurement}.csv");
    if measurement.contains(['/', '\\', ':', '\0']) {
        let message = format!("the measurement's name `{measurement}` cannot be the name of a file");
        let found = Diagnostic::error(Code::CannotWrite, message).at_data(DataPlace::file(name));
        return Err(Box::new(found.hint("rename the measurement")));
    }
    Ok(name)
}
