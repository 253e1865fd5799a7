//! The command `phical`: see [`phical::cli`].

use std::io::{stderr, stdout};
use std::process::ExitCode;

use anstream::{AutoStream, ColorChoice};
use phical::cli::{Interrupt, Surroundings, run_in};

fn main() -> ExitCode {
    // without handlers a signal ends it at once
    let interrupt = Interrupt::by_signals().unwrap_or_default();
    // neither is locked: progress is drawn on standard error meanwhile
    let coloured = |choice: ColorChoice| choice != ColorChoice::Never;
    let surroundings = Surroundings {
        interrupt,
        stdout_coloured: coloured(AutoStream::choice(&stdout())),
        stderr_coloured: coloured(AutoStream::choice(&stderr())),
    };
    run_in(&surroundings, std::env::args_os(), &mut stdout(), &mut stderr())
}
