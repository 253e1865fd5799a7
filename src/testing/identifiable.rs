//! What can be known: checks of rank and of who is not estimable.

use crate::identify::{Probe, Structure, structure};

use super::{demand, said};

/// Asserts that no free parameter is out of reach of measurements of this kind, whatever their number and quality, from the nominal
/// values on.
///
/// # Panics
/// With who cannot be known, the movement that shows it, and what to hold.
///
/// ```
/// use phical::testing::{assert_identifiable, check_identifiable, program};
/// let line = |residual| program(&format!(r#"(name: "line", parameters: {{"a": Scalar(Free(1)), "b": Scalar(Free(2))}},
///     measurements: {{"m": (inputs: {{"x": (), "y": (sigma: 0.1)}}, residuals: {{"r": "{residual}"}})}})"#));
/// assert_identifiable(&line("y - a - b*x"));
/// let message = check_identifiable(&line("y - (a + b)*x")).unwrap_err();
/// assert!(message.contains("`a` and `b` can only be known in sum"), "{message}");
/// ```
#[track_caller]
pub fn assert_identifiable<'a>(model: impl Into<Probe<'a>>) {
    demand(check_identifiable(model));
}

/// The same for a property: `check_identifiable(&program).map_err(TestCaseError::fail)?`.
///
/// # Errors
/// With who cannot be known, the movement that shows it, and what to hold.
pub fn check_identifiable<'a>(model: impl Into<Probe<'a>>) -> Result<(), String> {
    let found = look(model.into())?;
    if found.sound() { Ok(()) } else { Err(told("not all can be known", &found)) }
}

/// Asserts how many independent directions of the free parameters measurements of this kind see: the generic rank of the residuals'
/// derivatives. Priors do not count.
///
/// # Panics
/// With the rank that was found, and what is invisible.
#[track_caller]
pub fn assert_rank<'a>(model: impl Into<Probe<'a>>, expected: usize) {
    demand(check_rank(model, expected));
}

/// The same for a property.
///
/// # Errors
/// With the rank that was found, and what is invisible.
pub fn check_rank<'a>(model: impl Into<Probe<'a>>, expected: usize) -> Result<(), String> {
    let found = look(model.into())?;
    if found.rank == expected {
        return Ok(());
    }
    Err(told(&format!("the rank is {}, not {expected}", found.rank), &found))
}

/// Asserts that exactly these parameters are not estimable, in any order.
///
/// # Panics
/// With who is wrongly among them, who is missing, and what is invisible.
#[track_caller]
pub fn assert_invisible<'a>(model: impl Into<Probe<'a>>, names: &[&str]) {
    demand(check_invisible(model, names));
}

/// The same for a property.
///
/// # Errors
/// With who is wrongly among them, who is missing, and what is invisible.
pub fn check_invisible<'a>(model: impl Into<Probe<'a>>, names: &[&str]) -> Result<(), String> {
    let found = look(model.into())?;
    let of = |estimable: bool| {
        let all = found.free.iter().zip(&found.estimable).filter(move |(_, known)| **known == estimable);
        all.map(|(name, _)| name.as_str()).collect::<Vec<_>>()
    };
    let blind = of(false);
    let mut wrong = Vec::new();
    for name in blind.iter().filter(|name| !names.contains(name)) {
        wrong.push(format!("`{name}` is not estimable, either"));
    }
    for name in names.iter().filter(|name| !blind.contains(name)) {
        wrong.push(match of(true).contains(name) {
            true => format!("`{name}` is estimable"),
            false => format!("`{name}` is not free"),
        });
    }
    if wrong.is_empty() { Ok(()) } else { Err(told(&wrong.join("; "), &found)) }
}

fn look(probe: Probe) -> Result<Structure, String> {
    structure(&probe).map_err(|mistakes| said(&mistakes))
}

/// What is wrong, and all there is to know about it.
fn told(what: &str, found: &Structure) -> String {
    let mut lines = vec![format!("{what}: rank {} of {} free parameters", found.rank, found.free.len())];
    if let Some(rank) = found.nominal_rank.filter(|rank| *rank < found.rank) {
        lines.push(format!("rank {rank} at the nominal values"));
    }
    lines.extend(found.invisible.iter().chain(&found.stationary).map(|direction| direction.sentence.clone()));
    lines.extend(found.cures.iter().filter_map(|choices| choices.first()).map(|best| best.sentence()));
    lines.join("\n  ")
}
