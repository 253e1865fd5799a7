//! What data can see: known symmetries found and named, curves told from stationary points, cures that cure.

mod chains;
mod practical;
mod structural;
mod units;

use phical::compile::Program;
use phical::identify::{Inputs, Probe, Structure, structure};
use phical::problem::{Options, Selection};

use crate::flagship::compiled;

pub fn freed(names: &[&str]) -> Options {
    let selection = Selection { free: names.iter().map(|name| (*name).to_owned()).collect(), ..Selection::default() };
    Options { selection, ..Options::default() }
}

pub fn probe<'a>(program: &'a Program, inputs: Inputs<'a>, options: Options) -> Probe<'a> {
    Probe { program, options, inputs, rows: Vec::new(), seed: 1 }
}

/// The scenario of a program where it has one, else drawn inputs.
pub fn structure_of(program: &Program, options: Options) -> Structure {
    let inputs = program.scenarios.first().map_or(Inputs::Drawn, Inputs::Scenario);
    structure(&probe(program, inputs, options)).unwrap_or_else(|found| panic!("{}", phical::diag::text(&found, false)))
}

/// Whether some direction moves these and nothing else that counts.
pub fn named(found: &[phical::identify::Direction], names: &[&str]) -> bool {
    found.iter().any(|one| {
        let telling = one.terms.iter().filter(|term| term.weight.powi(2) > 0.01);
        telling.map(|term| term.name.as_str()).collect::<Vec<_>>() == names
    })
}

pub fn small(parameters: &str, inputs: &str, residual: &str) -> Program {
    compiled(&format!(
        r#"(name: "small", parameters: {{{parameters}}}, measurements: {{"m": (inputs: {{{inputs}}}, residuals: {{"r": "{residual}"}})}})"#
    ))
}
