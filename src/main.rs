//! The command `phical`: see [`phical::cli`].

use std::io::{stderr, stdout};
use std::process::ExitCode;

fn main() -> ExitCode {
    // neither is locked: progress is drawn on standard error meanwhile
    phical::cli::run(std::env::args_os(), &mut stdout(), &mut stderr())
}
