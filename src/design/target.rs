//! What the calibrated instrument shall tell: derived quantities in the rows of a volume.

use super::setup::Setup;
use crate::compile::Measurement;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::problem::{Problem, Undefined};
use crate::unit::{Dimension, Unit};

/// A quantity that is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// The name of an output (`p1` for all its components), or an expression that was compiled as one.
    pub expression: String,
    /// The standard uncertainty that is required, as text with its unit.
    pub required: Option<String>,
}

/// One number of a quantity over a volume.
#[derive(Clone, Debug)]
pub struct Target {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What it measures.
    pub dimension: Dimension,
    /// The standard uncertainty that is required, in its unit.
    pub required: Option<f64>,
    /// By block of the volume and output: where it is from.
    pub(super) places: Vec<(usize, usize)>,
    /// Its gradients over the volume by the coordinates of the experiment, row by row; internal units.
    pub(super) gradients: Vec<f64>,
    /// One internal unit, in its unit.
    pub(super) reported: f64,
    /// What counts as known well enough, or what is required, in internal units.
    pub(super) scale: f64,
}

impl Target {
    /// Rows whose squares are the mean variance over the volume, in squared `scale`.
    pub(super) fn mean_rows(&self, coordinates: usize) -> Vec<f64> {
        let points = (self.gradients.len() / coordinates.max(1)).max(1) as f64;
        self.gradients.iter().map(|g| g / (self.scale * points.sqrt())).collect()
    }
}

/// Whether an output belongs to an expression.
pub(super) fn belongs(output: &str, expression: &str) -> bool {
    output == expression || output.strip_prefix(expression).is_some_and(|rest| rest.starts_with('.'))
}

/// Whether a measurement puts out an expression.
pub fn puts_out(measurement: &Measurement, expression: &str) -> bool {
    measurement.outputs.iter().any(|output| belongs(&output.name, expression))
}

/// The targets that are asked for, over the rows of a volume.
pub(super) fn targets(setup: &Setup, volume: &Problem, asked: &[Asked]) -> Result<Vec<Target>, Diagnostics> {
    let mut mistakes = Diagnostics::new();
    let mut all: Vec<Target> = Vec::new();
    for asked in asked {
        let begin = all.len();
        for (number, block) in volume.blocks.iter().enumerate() {
            for (k, output) in block.measurement.outputs.iter().enumerate() {
                if !belongs(&output.name, &asked.expression) {
                    continue;
                }
                if let Some(known) = all[begin..].iter_mut().find(|target| target.name == output.name) {
                    known.places.push((number, k));
                    continue;
                }
                match target(volume, &output.name, output.dimension, asked.required.as_deref()) {
                    Ok(mut target) => {
                        target.places.push((number, k));
                        all.push(target);
                    }
                    Err(found) => {
                        mistakes.extend(found);
                        break;
                    }
                }
            }
        }
        if all.len() == begin && !mistakes.has_errors() {
            let names: Vec<String> = volume.blocks.iter().map(|b| format!("`{}`", b.measurement.name)).collect();
            let message = format!("no row of the volume puts out `{}`", asked.expression);
            let hint = format!("the volume has rows of {}; name another with `--over`", names.join(", "));
            mistakes.push(Diagnostic::error(Code::TargetNowhere, message).hint(hint));
        }
    }
    if mistakes.has_errors() {
        return Err(mistakes);
    }
    let gradients = Gradients::new(setup, volume)?;
    for target in &mut all {
        if let Err(found) = gradients.fill(setup, volume, target) {
            mistakes.push(*found);
        }
    }
    if mistakes.has_errors() { Err(mistakes) } else { Ok(all) }
}

fn target(volume: &Problem, name: &str, dimension: Dimension, required: Option<&str>) -> Result<Target, Diagnostics> {
    let units = &volume.program.units;
    let reported = units.to_reported(1.0, dimension);
    let required = match required {
        None => None,
        Some(text) => {
            let value = crate::compile::quantity(volume.program, &format!("required of {name}"), text, dimension)?;
            if !(value > 0.0 && value.is_finite()) {
                let message = format!("the uncertainty required of `{name}` is {}", text.trim());
                let found = Diagnostic::error(Code::BadRequirement, message);
                return Err(found.hint("a standard uncertainty is positive, such as `0.5 mm`").into());
            }
            Some(value)
        }
    };
    // as for parameters
    let tolerance = match dimension {
        Dimension::LENGTH => Unit::parse("mm").map_or(1.0, |mm| units.to_internal(0.1, mm)),
        Dimension::ANGLE => 5e-5,
        _ => 1.0 / reported,
    };
    Ok(Target {
        name: name.to_owned(),
        unit: units.symbol(dimension),
        dimension,
        required: required.map(|value| value * reported),
        places: Vec::new(),
        gradients: Vec::new(),
        reported,
        scale: required.unwrap_or(tolerance),
    })
}

/// The gradients of all outputs over a volume.
struct Gradients {
    /// the free coordinates of the volume, and their place among those of the candidates
    place: Vec<(usize, Option<usize>)>,
    /// by block: by row, the places of the columns and the numbers, by output and then by column
    blocks: Vec<Vec<(Vec<usize>, Vec<f64>)>>,
}

impl Gradients {
    fn new(setup: &Setup, volume: &Problem) -> Result<Gradients, Diagnostics> {
        let name = |&c: &usize| &setup.problem.layout.coordinates[c].name;
        let places: std::collections::HashMap<&String, usize> =
            setup.problem.free.iter().enumerate().map(|(j, c)| (name(c), j)).collect();
        let of = |&c: &usize| (c, places.get(&volume.layout.coordinates[c].name).copied());
        let place: Vec<(usize, Option<usize>)> = volume.free.iter().map(of).collect();
        let coordinates: Vec<usize> = place.iter().map(|(c, _)| *c).collect();
        let mut blocks = Vec::new();
        for block in 0..volume.blocks.len() {
            let mut rows = Vec::new();
            let visit = |found: &crate::problem::Sensitivity| {
                rows.push((found.columns.to_vec(), found.by_coordinates.to_vec()));
            };
            if !volume.blocks[block].measurement.outputs.is_empty() {
                volume
                    .sensitivities(block, &volume.start, &coordinates, visit)
                    .map_err(|Undefined(found)| Diagnostics::from(*found))?;
            }
            blocks.push(rows);
        }
        Ok(Gradients { place, blocks })
    }

    fn fill(&self, setup: &Setup, volume: &Problem, target: &mut Target) -> Result<(), Box<Diagnostic>> {
        let mut moved = false;
        let mut gradient = vec![0.0; setup.problem.free.len()];
        for &(block, output) in &target.places {
            for (row, (columns, numbers)) in self.blocks[block].iter().enumerate() {
                gradient.fill(0.0);
                for (&at, &value) in columns.iter().zip(&numbers[output * columns.len()..]) {
                    let (coordinate, place) = self.place[at];
                    if !value.is_finite() {
                        let of = &volume.blocks[block];
                        let message = format!(
                            "the target `{}` has no derivative in row {} of `{}`",
                            target.name,
                            row + 1,
                            of.measurement.name
                        );
                        let found = Diagnostic::error(Code::UndefinedAtStart, message);
                        return Err(Box::new(found.hint("take this row out of the volume")));
                    }
                    match place {
                        Some(place) => gradient[place] += value,
                        None if value == 0.0 => {}
                        None => {
                            let name = &volume.layout.coordinates[coordinate].name;
                            let message =
                                format!("the target `{}` depends on `{name}`, which no candidate has", target.name);
                            let hint =
                                "name the members of the candidates in the volume, or add candidates that have it";
                            return Err(Box::new(Diagnostic::error(Code::TargetUnseen, message).hint(hint)));
                        }
                    }
                }
                if let Some(blind) = setup.blind(&gradient) {
                    let message =
                        format!("no candidate sees all that the target `{}` depends on: {blind}", target.name);
                    let hint = "hold one of these parameters, add candidates of another kind, or choose a target that does not depend on it";
                    return Err(Box::new(Diagnostic::error(Code::TargetUnseen, message).hint(hint)));
                }
                moved |= gradient.iter().any(|g| *g != 0.0);
                target.gradients.extend(setup.onto(&gradient));
            }
        }
        if !moved {
            let message = format!("the target `{}` depends on no free parameter", target.name);
            let hint = "no choice of rows changes its uncertainty: choose another target, or free a parameter";
            return Err(Box::new(Diagnostic::error(Code::TargetUnseen, message).hint(hint)));
        }
        Ok(())
    }
}
