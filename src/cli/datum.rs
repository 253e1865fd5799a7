//! `phical identify MODEL --fit FIT.json --datum P`: the fit at another datum.

use super::identify::Identify;
use super::progress::shown;
use super::{Format, Outcome};
use crate::compile::quantity;
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::{Covariance, Held};
use crate::identify::{Inputs, Probe, change_datum, held_datum};
use crate::problem::{Options, Problem, Rows, Selection, Undefined, Weights};
use crate::report::{AtDatum, datum_json, datum_text};
use crate::session::{Choice, Session, Values};
use crate::solve::{LeastSquares, null_space};

pub(super) fn change(asked: &Identify, session: &Session, file: &str, format: Format) -> Result<Outcome, Diagnostics> {
    let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
    let undefined = |Undefined(found): Undefined| Diagnostics::from(*found);
    let bad = |why: String, hint: &str| Diagnostics::from(Diagnostic::error(Code::BadDatum, why).hint(hint));
    let values = Values::read(file).map_err(refused)?;
    let names = |list: &str| -> Vec<String> {
        let all = values.json.get(list).and_then(|all| all.as_array()).into_iter().flatten();
        all.filter_map(|one| one.get("name")?.as_str().map(str::to_owned)).collect()
    };
    let weights = values.json.get("weights").and_then(|name| name.as_str());
    let weights = weights.and_then(|name| Weights::ALL.into_iter().find(|weights| weights.name() == name));
    let selection = Selection {
        free: names("parameters"),
        fix: names("held").into_iter().map(|name| (name, None)).collect(),
        start: values.values.clone(),
    };
    let options = Options { weights, selection, ..Options::default() };
    let bound = session.bind(
        &Choice { files: asked.data.clone(), without: asked.without.clone(), watch: shown(), ..Choice::default() },
        &options,
    )?;
    let fitted = &bound.problem;

    let basis = at(fitted, fitted, &fitted.start)?.1;
    let (datum, wanted) = chosen(fitted, &asked.datum)?;
    if datum.len() != basis.len() {
        let directions = match basis.len() {
            1 => "one direction is invisible".to_owned(),
            n => format!("{n} directions are invisible"),
        };
        return Err(bad(format!("{directions}, and the datum has {} parameters", datum.len()), "give as many"));
    }
    let probe = Probe {
        program: &session.program,
        options: Options { weights: Some(Weights::Unit), ..options.clone() },
        inputs: Inputs::Rows(fitted),
        rows: Vec::new(),
        seed: 0,
    };
    let (like, _) = probe.bound()?;
    let alike = probe.consistent(&like, &fitted.start, Weights::Unit).map_err(refused)?;
    let moved = change_datum(&alike, &datum, &wanted).map_err(undefined)?;

    // what the data see has not changed, so neither has its covariance: it is taken where the values now are
    let weighted = probe.consistent(&like, &fitted.start, fitted.weights).map_err(refused)?;
    let (information, basis) = at(&alike, &weighted, &moved.point)?;
    let held = Held::by_equations(&weighted, &moved.point).map_err(undefined)?;
    let hint = "take parameters that move along the invisible directions";
    let covariance = Covariance::new(&information, fitted.scale(), &basis, &held)
        .and_then(|covariance| held_datum(fitted, &covariance, &basis, &datum))
        .map_err(|_| bad("these parameters do not fix the invisible directions".into(), hint))?;
    let factor = match fitted.weights.are_real() {
        true => Some(1.0),
        false => values.json.get("sigma0").and_then(|sigma0| sigma0.as_f64()),
    };
    let units = &session.program.units;
    let values = fitted.of_free(&fitted.start).into_iter().zip(fitted.of_free(&moved.point));
    let told = fitted.free_coordinates().zip(values).enumerate().map(|(j, (coordinate, (before, value)))| {
        let reported = |value: f64| units.to_reported(value, coordinate.dimension);
        let held = datum.contains(&j);
        let sigma = factor.filter(|_| moved.family && !held).map(|factor| reported(factor * covariance.sigma(j)));
        AtDatum {
            name: coordinate.name.clone(),
            before: reported(before),
            value: reported(value),
            sigma,
            unit: units.symbol(coordinate.dimension),
            held,
        }
    });
    let told: Vec<AtDatum> = told.collect();
    let text = || datum_text(&told, moved.residual, moved.family);
    let outcome = Outcome::new(format, text, || datum_json(&told, moved.residual, moved.family));
    Ok(outcome.trusted(moved.family).warned(bound.warnings.clone()))
}

/// The weighted information at a point, priors in, and what is invisible there.
fn at(
    alike: &Problem,
    weighted: &Problem,
    point: &[f64],
) -> Result<(crate::linalg::SquareRootInformation, Vec<Vec<f64>>), Diagnostics> {
    let undefined = |Undefined(found): Undefined| Diagnostics::from(*found);
    let consistent = alike.at_consistent_inputs(point, Rows::All).map_err(undefined)?;
    let seen = alike.with_priors(consistent, point).map_err(undefined)?;
    let seen = alike.with_equations(seen, point).map_err(undefined)?;
    let seen = null_space(&seen, alike.scale()).map_err(|error| undefined(error.into()))?;
    let information = weighted.without_loss().linearised(point).map_err(undefined)?.information;
    Ok((weighted.with_priors(information, point).map_err(undefined)?, seen.basis))
}

/// The free coordinates of the datum, and the values that they are to have.
fn chosen(problem: &Problem, datum: &[(String, Option<String>)]) -> Result<(Vec<usize>, Vec<f64>), Diagnostics> {
    let mut found = (Vec::new(), Vec::new());
    for (name, value) in datum {
        let all = problem.layout.matching(problem.program, name);
        let free = || problem.free.iter().zip(problem.free_coordinates()).enumerate();
        let place = |c: &usize| free().find(|(_, (free, _))| *free == c).map(|(j, (_, coordinate))| (j, coordinate));
        let places: Vec<_> = all.iter().filter_map(place).collect();
        if places.is_empty() {
            let message = format!("`{name}` is no free parameter of the fit");
            let hint = "a datum is chosen among those that were estimated";
            return Err(Diagnostics::from(Diagnostic::error(Code::BadDatum, message).hint(hint)));
        }
        for (j, coordinate) in places {
            found.0.push(j);
            found.1.push(match value {
                Some(text) => quantity(problem.program, &format!("value of {name}"), text, coordinate.dimension)?,
                None => coordinate.nominal,
            });
        }
    }
    Ok(found)
}
