//! Files and tables, in the user's language.

mod mistakes;
mod reading;
mod round_trip;
mod spill;

use std::sync::Arc;

use super::csv::read_from;
use super::heading::Reading;
use super::*;
use crate::compile::{Program, compile};
use crate::diag::{Diagnostics, Source};
use crate::model::{DataFile, load};

/// A measurement with everything that a column can be.
pub(super) const MODEL: &str = r#"(
    name: "columns",
    parameters: { "a": Scalar(Free("1 mm")), "o": Vec3(value: Free((0, 0, 0)), family: true) },
    measurements: { "m": (
        keys: ["place", "hole"],
        inputs: {
            "hz": (unit: "deg"),
            "v": (unit: "d-m-s"),
            "length": (unit: "mm", bias: "0.5 mm"),
            "t": (unit: "K", default: "293 K"),
            "n": (),
        },
        residuals: { "r": "length - a + hz*a + v*a + n*a + o[place, hole].x + t/(1 K)*a" },
    ) },
)"#;

/// The same with `data: …` for the measurement.
pub(super) fn program(data: &str) -> (Program, Vec<DataFile>) {
    let text = MODEL.replacen("keys:", &format!("data: [{data}], keys:"), 1);
    let source = Source::new("m.ron", text);
    let (model, _) = load(&source).unwrap();
    let (program, _) = compile(&model, &source, &[]).unwrap();
    let files = model.measurements.get("m").unwrap().data.0.clone();
    (program, files)
}

/// What comes of a text as the only file.
pub(super) fn table(data: &str, text: &[u8]) -> Result<Table, (Diagnostics, Arc<Source>)> {
    let (program, files) = program(data);
    let mut found = Diagnostics::new();
    let measurement = &program.measurements[0];
    let mut table = Table::new(measurement.keys.len(), measurement.inputs.len());
    let reading = Reading { program: &program, measurement, file: &files[0], name: "d.csv" };
    read_from(&reading, text, &mut table, &mut found);
    if found.has_errors() { Err((found, Arc::clone(&program.source))) } else { Ok(table) }
}
