//! A chain with its calibrated numbers, as a table or in its URDF.

use std::fmt::Write;

use super::chain::ChainValues;
use super::covariance::{Covariance, covariance, gradients};
use super::motion::{Motion, Real};
use super::number::{number_text, tidy_angle};
use super::origins::{ORIGIN_SYMBOLS, Origin, origins, with_origins};
use super::rows::{ANGLES, Convention, Near, Row, Rows, SYMBOLS, Style, rows};
use super::serial::Serial;
use super::urdf::{Urdf, UrdfJoint};
use crate::diag::{Code, Diagnostic, Diagnostics};
use crate::fit::JointUncertainty;
use crate::model::Reads;
use crate::unit::{Dimension, Unit, Units};

/// What an export has written.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The table, or the URDF.
    pub text: String,
    /// The name of each number, such as `J1.theta`.
    pub names: Vec<String>,
    /// Its unit.
    pub units: Vec<String>,
    /// Its value.
    pub values: Vec<f64>,
    /// How well they are known together, where a fit says so.
    pub covariance: Option<Covariance>,
    /// What is to be careful about.
    pub warnings: Diagnostics,
}

/// What a chain is written as.
#[derive(Clone, Copy, Debug)]
pub enum Target<'t> {
    /// A table, with `plain` one without β.
    Table {
        /// How its rows are multiplied.
        convention: Convention,
        /// Without β, however far the common normal of nearly parallel axes is.
        plain: bool,
    },
    /// A URDF, with the joints on the way between two of its links.
    Urdf {
        /// The original.
        urdf: &'t Urdf,
        /// The joints of the chain in it.
        path: &'t [&'t UrdfJoint],
    },
}

/// Writes a chain: its numbers as they are, and, where `known`, how well.
///
/// # Errors
/// Where the chain is not the one of the URDF.
pub fn export(
    chain: &ChainValues,
    units: &Units,
    target: Target,
    known: Option<&JointUncertainty>,
) -> Result<Exported, Diagnostics> {
    match target {
        Target::Table { convention, plain } => Ok(table(chain, units, convention, plain, known)),
        Target::Urdf { urdf, path } => in_urdf(chain, units, urdf, path, known),
    }
}

/// All rows of a style, and how well they are known.
struct Stated {
    rows: Vec<Row<f64>>,
    near: Vec<Near>,
    covered: Option<Covariance>,
    /// rows with something uncertain that they have no number for
    lost: Vec<usize>,
}

fn of_style(
    chain: &ChainValues,
    serial: &Serial<f64>,
    convention: Convention,
    style: Style,
    known: Option<&JointUncertainty>,
) -> Stated {
    let reach = serial.reach();
    let Rows { rows: stated, near, lost: of_lost } = rows(serial, convention, style, reach);
    let Some(known) = known else { return Stated { rows: stated, near, covered: None, lost: Vec::new() } };
    let all = gradients(chain, |serial| {
        let found = rows(serial, convention, style, reach);
        let lost = found.lost.iter().map(|(_, number)| *number);
        Some(flat(&found.rows).into_iter().chain(lost).collect())
    });
    let count = 5 * stated.len();
    let size = |at: usize| if at < count && ANGLES.get(at % 5) == Some(&false) { reach } else { 1.0 };
    let of_all = covariance(chain, known, &all.unwrap_or_default(), size);
    let is_lost = |(at, (row, _)): (usize, &(usize, f64))| {
        of_all.sigma(count + at).is_none_or(|sigma| sigma > 0.0).then_some(*row)
    };
    let mut lost: Vec<usize> = of_lost.iter().enumerate().filter_map(is_lost).collect();
    lost.dedup();
    Stated { rows: stated, near, covered: Some(of_all), lost }
}

/// Whether anything lies between the base and the first axis, but for quarter turns that cancel.
fn base_says(found: &Stated, convention: Convention, reach: f64) -> bool {
    let joints = found.rows.iter().position(|row| row.reads != Reads::Nothing).unwrap_or(0);
    let uncertain = |at: usize, k: usize| {
        found.covered.as_ref().is_some_and(|all| all.sigma(5 * at + k).is_none_or(|sigma| sigma > 0.0))
    };
    let says = |(at, row): (usize, &Row<f64>)| {
        let large = |k: usize, number: f64| !super::number::nil(number, if k == 2 { 10.0 * reach } else { 10.0 });
        row.numbers.iter().enumerate().skip(2).any(|(k, number)| uncertain(at, k) || large(k, *number))
    };
    // a modified row has the link before its joint
    let count = if convention == Convention::Dh { joints } else { joints + 1 };
    found.rows.iter().enumerate().take(count).any(says)
}

fn flat<D: Real>(rows: &[Row<D>]) -> Vec<D> {
    rows.iter().flat_map(|row| row.numbers).collect()
}

fn table(
    chain: &ChainValues,
    units: &Units,
    convention: Convention,
    plain: bool,
    known: Option<&JointUncertainty>,
) -> Exported {
    let serial = chain.serial();
    let reach = serial.reach();
    let found = |style| of_style(chain, &serial, convention, style, known);
    // a base that is the first axis exactly needs no rows; one that is nearly so has two
    let split = Style { plain, split: true };
    let whole = found(split);
    let Stated { rows: mut stated, near, covered, lost } = match base_says(&whole, convention, reach) {
        true => whole,
        false => found(Style { plain, split: false }),
    };
    let mut warnings = Diagnostics::new();
    // rows before and behind the joints that say nothing
    let uncertain = |row: usize, k: usize| {
        covered.as_ref().is_some_and(|all| all.sigma(5 * row + k).is_none_or(|sigma| sigma > 0.0))
    };
    let scale = |k: usize| if ANGLES.get(k) == Some(&true) { 1.0 } else { reach };
    let nothing = |row: &Row<f64>, at: usize| {
        let zero = |(k, number): (usize, &f64)| super::number::nil(*number, 10.0 * scale(k)) && !uncertain(at, k);
        row.reads == Reads::Nothing && row.numbers.iter().enumerate().all(zero)
    };
    let lost: Vec<String> = lost.iter().filter_map(|row| Some(stated.get(*row)?.name.clone())).collect();
    let kept: Vec<usize> =
        (0..stated.len()).filter(|&at| stated.get(at).is_some_and(|row| !nothing(row, at))).collect();
    let hayati = !plain
        && kept.iter().any(|&at| {
            uncertain(at, 4)
                || stated.get(at).is_some_and(|row| row.numbers.last().is_some_and(|beta| beta.abs() > 1e-13))
        });
    stated = kept.iter().filter_map(|at| stated.get(*at).cloned()).collect();
    unique(&mut stated);
    let covered = covered.map(|all| {
        let chosen: Vec<usize> = kept.iter().flat_map(|row| (0..5).map(move |k| 5 * row + k)).collect();
        chosen_of(&all, &chosen)
    });
    if plain {
        warnings.extend(near.iter().map(|near| nearly_parallel(near, units, &stated)));
    }
    if let Some(all) = &covered {
        warnings.extend(unstated(all, &lost));
    }

    let dimension = |k: usize| if ANGLES.get(k) == Some(&true) { Dimension::ANGLE } else { Dimension::LENGTH };
    let factors: Vec<f64> = (0..5).map(|k| units.to_reported(1.0, dimension(k))).collect();
    let mut exported = Exported {
        text: String::new(),
        names: stated.iter().flat_map(|row| SYMBOLS.map(|symbol| format!("{}.{symbol}", row.name))).collect(),
        units: stated.iter().flat_map(|_| (0..5).map(|k| units.symbol(dimension(k)))).collect(),
        values: Vec::new(),
        covariance: covered.map(|all| scaled(all, &factors)),
        warnings,
    };
    for row in &stated {
        let own = row.numbers.iter().enumerate().map(|(k, number)| {
            let number = if ANGLES.get(k) == Some(&true) { &tidy_angle(*number) } else { number };
            let text = number_text(
                units.to_reported(*number, dimension(k)),
                scale(k) * factors.get(k).copied().unwrap_or(1.0),
            );
            text.parse().unwrap_or(*number)
        });
        exported.values.extend(own);
    }
    exported.text = csv(&stated, &exported, convention, hayati);
    if !hayati {
        without_beta(&mut exported);
    }
    exported
}

/// A table as it is written.
fn csv(rows: &[Row<f64>], exported: &Exported, convention: Convention, hayati: bool) -> String {
    let count = if hayati { 5 } else { 4 };
    let unit = |k: usize| exported.units.get(k).map_or("", String::as_str);
    let mut out = format!("joint [{}],reads", convention.short());
    let symbols: Vec<(usize, &str)> = SYMBOLS.into_iter().enumerate().take(count).collect();
    symbols.iter().for_each(|(k, symbol)| out.push_str(&format!(",{symbol} [{}]", unit(*k))));
    if exported.covariance.is_some() {
        symbols.iter().for_each(|(k, symbol)| out.push_str(&format!(",sigma_{symbol} [{}]", unit(*k))));
    }
    out.push('\n');
    for (at, row) in rows.iter().enumerate() {
        let reads = match row.reads {
            Reads::Angle => "angle",
            Reads::Length => "length",
            Reads::Nothing => "nothing",
        };
        let _ = write!(out, "{},{reads}", cell(&row.name));
        for k in 0..count {
            let _ = write!(out, ",{}", exported.values.get(5 * at + k).map_or(String::new(), |x| plain_number(*x)));
        }
        if let Some(all) = &exported.covariance {
            for k in 0..count {
                let _ = write!(out, ",{}", all.sigma(5 * at + k).map_or(String::new(), |x| format!("{x:.6e}")));
            }
        }
        out.push('\n');
    }
    out
}

/// As many digits as read back the same.
fn plain_number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r', ';', '\t', '#']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// No two rows of one name, and those before the joints numbered as they are left.
fn unique(rows: &mut [Row<f64>]) {
    for (at, row) in rows.iter_mut().take_while(|row| row.reads == Reads::Nothing).enumerate() {
        row.name = if at == 0 { "base".to_owned() } else { format!("base_{}", at + 1) };
    }
    let joints: Vec<String> =
        rows.iter().filter(|row| row.reads != Reads::Nothing).map(|row| row.name.clone()).collect();
    for row in rows.iter_mut().filter(|row| row.reads == Reads::Nothing) {
        while joints.contains(&row.name) {
            row.name.push('_');
        }
    }
}

fn chosen_of(all: &Covariance, chosen: &[usize]) -> Covariance {
    let entry = |i: usize, j: usize| all.matrix.get(i)?.get(j).copied().flatten();
    let matrix = chosen.iter().map(|&i| chosen.iter().map(|&j| entry(i, j)).collect()).collect();
    Covariance { matrix, because: all.because.clone() }
}

/// In reported units; `factors` come round again and again.
fn scaled(mut all: Covariance, factors: &[f64]) -> Covariance {
    for (line, f) in all.matrix.iter_mut().zip(factors.iter().cycle()) {
        for (entry, g) in line.iter_mut().zip(factors.iter().cycle()) {
            *entry = entry.map(|entry| entry * f * g);
        }
    }
    all
}

fn without_beta(exported: &mut Exported) {
    let chosen: Vec<usize> = (0..exported.names.len()).filter(|k| k % 5 != 4).collect();
    exported.covariance = exported.covariance.as_ref().map(|all| chosen_of(all, &chosen));
    let mut at = 0..;
    let mut keep = || at.next().is_none_or(|k: usize| k % 5 != 4);
    exported.names.retain(|_| keep());
    let mut at = 0..;
    exported.units.retain(|_| at.next().is_none_or(|k: usize| k % 5 != 4));
    let mut at = 0..;
    exported.values.retain(|_| at.next().is_none_or(|k: usize| k % 5 != 4));
}

fn nearly_parallel(near: &Near, units: &Units, rows: &[Row<f64>]) -> Diagnostic {
    let row = rows.iter().find(|row| row.name == near.first);
    let d = row.and_then(|row| row.numbers.get(1)).copied().unwrap_or(0.0);
    let message = format!(
        "the axes of `{}` and `{}` are parallel within {:.3e} rad: their common normal, at d = {}, moves {:.0e} times as far as they do",
        near.first,
        near.second,
        near.angle,
        units.shown(d, Dimension::LENGTH),
        1.0 / near.angle
    );
    Diagnostic::warning(Code::NearlyParallel, message)
        .hint("a table with Hayati's `beta` has no such numbers, and keeps all digits: leave out `--plain`")
}

/// What has no uncertainty, and why.
fn unstated(all: &Covariance, lost: &[String]) -> Option<Diagnostic> {
    let missing = (0..all.matrix.len()).filter(|k| all.sigma(*k).is_none()).count();
    let message = match () {
        () if missing > 0 && !all.because.is_empty() => {
            format!("{missing} of the numbers have no uncertainty: they depend on {}", all.because.join(", "))
        }
        () if missing > 0 => format!("{missing} of the numbers have no uncertainty"),
        () if !lost.is_empty() => {
            format!("the covariance leaves out what the table has no number for, in the rows {}", lost.join(", "))
        }
        () => return None,
    };
    let hint = match missing {
        0 => "leave out `--plain`; where two axes are one, shift one of them a little",
        _ => "`phical identify` says what the fit does not determine, and what would",
    };
    Some(Diagnostic::warning(Code::NoUncertainty, message).hint(hint))
}

fn in_urdf(
    chain: &ChainValues,
    units: &Units,
    urdf: &Urdf,
    path: &[&UrdfJoint],
    known: Option<&JointUncertainty>,
) -> Result<Exported, Diagnostics> {
    let metre = units.from_internal(1.0, Unit { factor: 1.0, dimension: Dimension::LENGTH });
    let file = urdf.source.name();
    let serial = in_metres(&chain.serial(), metre);
    let reach = serial.reach();
    let refused = |found: Box<Diagnostic>| Diagnostics::from(*found);
    let new: Vec<Origin<f64>> = origins(&serial, path, reach, file).map_err(refused)?;
    let covariance = known.and_then(|known| {
        let all = gradients(chain, |serial| {
            let found = origins(&in_metres(serial, metre), path, reach, file).ok()?;
            Some(found.iter().flat_map(|origin| origin.numbers).collect())
        });
        Some(covariance(chain, known, &all?, |at| if at % 6 < 3 { reach } else { 1.0 }))
    });
    let names = new.iter().flat_map(|origin| ORIGIN_SYMBOLS.map(|symbol| format!("{}.{symbol}", origin.name)));
    let mut warnings = Diagnostics::new();
    warnings.extend(covariance.as_ref().and_then(|all| unstated(all, &[])));
    Ok(Exported {
        text: with_origins(urdf, &new, reach),
        names: names.collect(),
        units: new.iter().flat_map(|_| ["m", "m", "m", "rad", "rad", "rad"].map(str::to_owned)).collect(),
        values: new.iter().flat_map(|origin| origin.numbers).collect(),
        covariance,
        warnings,
    })
}

/// Lengths in metres; `metre` is one internal unit of length in metres.
fn in_metres<D: Real>(serial: &Serial<D>, metre: f64) -> Serial<D> {
    let scaled = |motion: &Motion<D>| Motion { origin: motion.origin.map(|x| x * D::from(metre)), ..*motion };
    Serial { joints: serial.joints.clone(), constants: serial.constants.iter().map(scaled).collect() }
}

impl Exported {
    /// The covariance as a table, names and units in its first line and its first column; none without one.
    pub fn covariance_csv(&self) -> Option<String> {
        let all = self.covariance.as_ref()?;
        let heading: Vec<String> =
            self.names.iter().zip(&self.units).map(|(name, unit)| cell(&format!("{name} [{unit}]"))).collect();
        let mut out = format!("number,{}\n", heading.join(","));
        for (line, name) in all.matrix.iter().zip(&heading) {
            let entries: Vec<String> =
                line.iter().map(|entry| entry.map_or(String::new(), |x| format!("{x:?}"))).collect();
            let _ = writeln!(out, "{name},{}", entries.join(","));
        }
        Some(out)
    }
}
