//! Outputs at a fit, with what the uncertainties of its parameters and of the readings make of them.

#![allow(
    clippy::indexing_slicing,
    reason = "slots, groups and columns are numbered by the problem; a row and a fit of another one are refused first"
)]

use crate::compile::{Measurement, Sigma, Slot};
use crate::eval::{Evaluator, Leaf};
use crate::fit::Fit;
use crate::problem::{Layout, Problem};

/// A predicted output, in internal units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Its value.
    pub value: f64,
    /// Its standard uncertainty, where the fit has any.
    pub sigma: Option<f64>,
}

/// All outputs of a measurement, for a row with these names and readings, predicted from a fit:
///
/// > σ² = g_q C g_qᵀ + g_x Σ g_xᵀ,  g the output's derivatives by the free coordinates and by the readings
///
/// with Σ the declared errors of the readings. None where the row names a family member that the fit does not know, has not a
/// reading for each input, or the fit is of another problem.
pub fn predicted(
    problem: &Problem,
    fit: &Fit,
    measurement: &Measurement,
    names: &[&str],
    readings: &[f64],
) -> Option<Vec<Predicted>> {
    let layout = &problem.layout;
    let groups = groups(layout, measurement, names)?;
    if readings.len() != measurement.inputs.len() || problem.fits(&fit.point).is_err() {
        return None;
    }
    let places = problem.places();
    let (mut leaves, mut columns) = (Vec::new(), Vec::new());
    for (slot, &group) in measurement.slots.iter().zip(&groups) {
        let group = &layout.groups[group];
        for k in 0..group.shape.dimension() {
            if let Some(column) = places[group.first + k] {
                leaves.push(Leaf::Parameter(slot.first_leaf + group.shape.tangent_leaf(k)));
                columns.push(column);
            }
        }
    }
    let own = columns.len();
    leaves.extend((0..readings.len()).map(Leaf::Input));
    let (outputs, width) = (measurement.outputs.len(), leaves.len());
    let (mut values, mut derivatives) = (vec![0.0; outputs], vec![0.0; outputs * width]);
    let mut evaluator = Evaluator::new(&measurement.output_tape, leaves);
    evaluator.begin(&filled(layout, measurement, &groups, &fit.point));
    evaluator.row(readings, &mut values, &mut derivatives);

    let errors = errors(measurement, readings);
    let sigma = |output: usize| {
        let (by_parameters, by_readings) = derivatives[output * width..(output + 1) * width].split_at(own);
        let mut gradient = vec![0.0; problem.free.len()];
        for (&column, derivative) in columns.iter().zip(by_parameters) {
            gradient[column] += derivative;
        }
        let told =
            if gradient.iter().all(|g| *g == 0.0) { 0.0 } else { fit.covariance.as_ref()?.variance_of(&gradient) };
        Some((told + variance(measurement, &errors, by_readings)).sqrt()).filter(|sigma| sigma.is_finite())
    };
    Some(values.iter().enumerate().map(|(output, &value)| Predicted { value, sigma: sigma(output) }).collect())
}

/// All outputs of a measurement at a point, in internal units; none where the row names a member that is not in the layout.
pub(super) fn at(
    layout: &Layout,
    measurement: &Measurement,
    point: &[f64],
    names: &[&str],
    readings: &[f64],
) -> Option<Vec<f64>> {
    let groups = groups(layout, measurement, names)?;
    let mut values = vec![0.0; measurement.outputs.len()];
    let mut evaluator = Evaluator::new(&measurement.output_tape, Vec::new());
    evaluator.begin(&filled(layout, measurement, &groups, point));
    evaluator.values(readings, &mut values);
    Some(values)
}

/// The group of each slot.
fn groups(layout: &Layout, measurement: &Measurement, names: &[&str]) -> Option<Vec<usize>> {
    let of = |slot: &Slot| {
        let names: Vec<&str> = slot.keys.iter().map(|&key| names.get(key).copied().unwrap_or("")).collect();
        let wanted = if slot.keys.is_empty() { None } else { Some(names.join("/")) };
        layout.groups.iter().position(|group| group.parameter == slot.parameter && group.member == wanted)
    };
    measurement.slots.iter().map(of).collect()
}

fn filled(layout: &Layout, measurement: &Measurement, groups: &[usize], point: &[f64]) -> Vec<f64> {
    let mut leaves = vec![0.0; measurement.leaves];
    for (slot, &group) in measurement.slots.iter().zip(groups) {
        let group = &layout.groups[group];
        let n = group.shape.dimension();
        leaves[slot.first_leaf..slot.first_leaf + n].copy_from_slice(&point[group.first..group.first + n]);
    }
    leaves
}

/// The declared standard deviation of each reading, where it is measured.
fn errors(measurement: &Measurement, readings: &[f64]) -> Vec<Option<f64>> {
    let tape = &measurement.sigma_tape;
    let varying = if tape.outputs() > 0 { tape.evaluate(&[], readings) } else { Vec::new() };
    let mut varying = varying.into_iter();
    let mut of = |sigma: Sigma| match sigma {
        Sigma::Constant(sigma) => sigma,
        Sigma::PerRow(_) => varying.next().unwrap_or(f64::NAN),
    };
    let declared = measurement.inputs.iter().map(|input| input.sigma);
    declared.map(|sigma| sigma.map(&mut of)).collect()
}

/// g Σ gᵀ
fn variance(measurement: &Measurement, errors: &[Option<f64>], gradient: &[f64]) -> f64 {
    let with = errors.iter().zip(gradient).filter_map(|(sigma, g)| Some(sigma.as_ref()? * g));
    let effects: Vec<f64> = with.collect();
    match &measurement.correlations {
        None => effects.iter().map(|effect| effect * effect).sum(),
        Some(rows) => {
            let row = |(row, a): (&Vec<f64>, &f64)| a * row.iter().zip(&effects).map(|(rho, b)| rho * b).sum::<f64>();
            rows.iter().zip(&effects).map(row).sum()
        }
    }
}
