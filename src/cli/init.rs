//! `phical init DIR`

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Format, Outcome};
use crate::data::{Output, make_directory};
use crate::diag::{Code, DataPlace, Diagnostic, Diagnostics};

/// A small instrument with a comment for everything that it says.
const STARTER: &str = include_str!("starter.ron");

#[derive(Debug, Args)]
pub(super) struct Init {
    /// The folder of the new model; made if need be
    #[arg(default_value = ".")]
    directory: PathBuf,
}

impl Init {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
        let path = self.directory.join("model.ron");
        let name = path.display().to_string();
        if path.exists() {
            let found = Diagnostic::error(Code::CannotWrite, format!("`{name}` is there already"));
            return Err(found.at_data(DataPlace::file(name)).hint("name another folder: `phical init FOLDER`").into());
        }
        make_directory(&self.directory).map_err(refused)?;
        Output::open(&path).and_then(|out| out.finish(|out| out.write_all(STARTER.as_bytes()))).map_err(refused)?;
        let folder = self.directory.display();
        let next = [
            (format!("phical check {name}"), "what the model is, and what is wrong with it"),
            (format!("phical identify {name} --structural"), "what can be known at all"),
            (format!("phical simulate {name} --out {folder}"), "made-up data, with the truth beside them"),
            (format!("phical calibrate {name} --report {folder}/report.html"), "the fit, and a page to look at"),
        ];
        let text = || {
            let mut grid = crate::report::Grid::new(&[crate::report::Align::Left, crate::report::Align::Left]);
            next.iter().for_each(|(command, what)| grid.row([command.as_str(), what]));
            format!(
                "{name} written: a pan-tilt distance meter, to be changed into your instrument. Next:\n\n{}",
                grid.text("  ")
            )
        };
        let commands: Vec<&str> = next.iter().map(|(command, _)| command.as_str()).collect();
        Ok(Outcome::new(format, text, || json!({"model": name, "next": commands})))
    }
}
