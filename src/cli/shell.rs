//! `phical completions SHELL` and `phical man`

use std::path::PathBuf;

use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;
use serde_json::json;

use super::{Cli, Format, Outcome};
use crate::data::{Output, make_directory};
use crate::diag::Diagnostics;

#[derive(Debug, Args)]
pub(super) struct Completions {
    /// For which shell
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self, format: Format) -> Outcome {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "phical", &mut script);
        let script = String::from_utf8_lossy(&script).into_owned();
        Outcome::new(format, || script.clone(), || json!({"shell": self.shell.to_string(), "script": script}))
    }
}

#[derive(Debug, Args)]
pub(super) struct Man {
    /// Write a page for each command into a folder, instead of the main page to standard output
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Man {
    pub(super) fn run(self, format: Format) -> Result<Outcome, Diagnostics> {
        let page = |command: Command| {
            let mut roff = Vec::new();
            // nothing fails that writes into memory
            let _ = clap_mangen::Man::new(command).render(&mut roff);
            String::from_utf8_lossy(&roff).into_owned()
        };
        let mut main = Cli::command();
        main.build();
        let Some(directory) = &self.out else {
            let page = page(main);
            return Ok(Outcome::new(format, || page.clone(), || json!({"page": page})));
        };
        let refused = |found: Box<crate::diag::Diagnostic>| Diagnostics::from(*found);
        make_directory(directory).map_err(refused)?;
        let all = main.get_subcommands().filter(|command| command.get_name() != "help").cloned().map(|command| {
            let name = format!("phical-{}", command.get_name());
            command.name(name)
        });
        let all: Vec<Command> = all.collect();
        let mut written = Vec::new();
        for command in [main].into_iter().chain(all) {
            let path = directory.join(format!("{}.1", command.get_name()));
            let page = page(command);
            Output::open(&path).and_then(|out| out.finish(|out| out.write_all(page.as_bytes()))).map_err(refused)?;
            written.push(path.display().to_string());
        }
        let text = || written.iter().map(|path| format!("{path}\n")).collect();
        Ok(Outcome::new(format, text, || json!({"pages": written})))
    }
}
