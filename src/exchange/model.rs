//! A robot as the text of a model: joints of the φ-model, a measurement, a scenario.

use std::fmt::Write;

use super::motion::Motion;
use super::number::{angle_text, nil, number_text};
use super::phi::{NO_LINK, PhiLink, phi_links};
use super::robot::{Reading, Robot};
use super::serial::Kind;
use crate::lang::is_name;
use crate::unit::Unit;

/// Names that the model uses for itself.
const TAKEN: [&str; 9] = ["flange", "tool", "base", "end", "point", "x", "y", "z", "pose"];

/// An imported robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The text of the model.
    pub text: String,
    /// The name of its chain.
    pub chain: String,
    /// The joints as they are called in it, in order, without base and end.
    pub joints: Vec<String>,
    /// How many numbers are free.
    pub free: usize,
}

/// The model of a robot. `file` is where it comes from.
pub fn model_text(robot: &Robot, file: &str) -> Imported {
    let reach = robot.serial.reach();
    let (links, end) = phi_links(&robot.serial);
    let chain = identifier(&robot.name, &TAKEN.map(str::to_owned));
    let mut names: Vec<String> = Vec::new();
    for joint in &robot.serial.joints {
        let taken: Vec<String> = names.iter().cloned().chain(TAKEN.map(str::to_owned)).chain([chain.clone()]).collect();
        names.push(identifier(&joint.name, &taken));
    }
    let inputs = inputs(robot);
    let mut out = String::new();
    head(&mut out, robot, file);
    let _ = writeln!(
        out,
        "Model(\n    name: {},\n    source: {},\n    units: (length: {:?}, angle: \"rad\"),\n",
        quoted(&robot.name),
        quoted(&format!("{file}, {}", robot.source)),
        robot.length
    );
    let size = tenth(reach);
    let _ = writeln!(
        out,
        "    parameters: {{\n        \
         // The point that is measured, in the flange: off the last axis, or nothing tells how that lies. Write where yours is, roughly.\n        \
         \"tool\": Vec3(Free(({}, 0, {}))),\n    }},\n",
        number_text(size, reach),
        number_text(size, reach)
    );
    let free = chain_text(&mut out, robot, &chain, &names, &links, &end);
    measurement_text(&mut out, robot, &chain, &inputs);
    scenario_text(&mut out, robot, &inputs, reach);
    out.push_str(")\n");
    Imported { text: out, chain, joints: names, free: free + 3 }
}

fn head(out: &mut String, robot: &Robot, file: &str) {
    let version = env!("CARGO_PKG_VERSION");
    let source = one_line(&robot.source);
    let _ = write!(
        out,
        "// Made by phical {version} from {}: {source}.\n\
         // A joint turns (or slides) about z and then states where the next joint's axis is, by phi, d, a, b, alpha, beta. What is Free is\n\
         // complete and nothing twice: four numbers for the axis of a turning joint, two for a sliding one's direction, in the frame of x, y, z.\n\
         // Held is what such measurements cannot tell from the rest. If x, y, z are in another frame than the robot's base, put a `Rigid` first.\n",
        one_line(file)
    );
}

/// A text as a comment can have it.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in one_line(text).chars() {
        if matches!(c, '"' | '\\') {
            out.push('\\');
        }
        out.push(c);
    }
    out.push('"');
    out
}

/// A name made of another: letters, digits and underscores, and none of those taken.
fn identifier(text: &str, taken: &[String]) -> String {
    let mut name: String = text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    name = name.trim_matches('_').to_owned();
    if name.is_empty() {
        name = "joint".into();
    }
    // digits first, words of the language, and inputs
    let of_input = |name: &str| name.strip_prefix('q').is_some_and(|rest| rest.chars().all(|c| c.is_ascii_digit()));
    if name.starts_with(|c: char| c.is_ascii_digit()) {
        name.insert(0, 'J');
    }
    let in_language = |name: &str| crate::compile::is_taken(name);
    let mut number = 1;
    let whole = name.clone();
    while !is_name(&name) || of_input(&name) || in_language(&name) || taken.contains(&name) {
        number += 1;
        name = format!("{whole}_{number}");
    }
    name
}

/// A tenth of the robot's size, as a round number.
fn tenth(reach: f64) -> f64 {
    let power = 10f64.powf((reach / 10.0).log10().floor());
    let round = [1.0, 2.0, 5.0].into_iter().rev().find(|round| round * power <= reach / 10.0);
    format!("{:.3e}", round.unwrap_or(1.0) * power).parse().unwrap_or(power)
}

/// The joints whose readings are asked for, in order.
fn inputs(robot: &Robot) -> Vec<&Reading> {
    let mut all: Vec<&Reading> = Vec::new();
    for reading in &robot.readings {
        if !all.iter().any(|known| known.of == reading.of) {
            all.push(reading);
        }
    }
    all
}

/// Writes the chain, gives how many of its numbers are free.
fn chain_text(
    out: &mut String,
    robot: &Robot,
    chain: &str,
    names: &[String],
    links: &[PhiLink],
    end: &Motion<f64>,
) -> usize {
    let reach = robot.serial.reach();
    let mut free = 0;
    let mut rows: Vec<Vec<String>> = Vec::new();
    let before = std::iter::once("base").chain(names.iter().map(String::as_str));
    let kinds = || robot.serial.joints.iter().map(|joint| joint.kind);
    let own = std::iter::once("Fixed").chain(kinds().map(|kind| match kind {
        Kind::Revolute => "Revolute",
        Kind::Prismatic => "Prismatic",
    }));
    let mut heads = own.zip(before);
    for ((kind, link), (word, name)) in kinds().zip(links).zip(&mut heads) {
        // where a sliding joint's axis is does not matter, only where it points
        let place = if kind == Kind::Revolute { "Free" } else { "Held" };
        free += if kind == Kind::Revolute { 4 } else { 2 };
        let lengths = [("a", link.a), ("b", link.b)];
        let angles = [("alpha", link.alpha), ("beta", link.beta)];
        let mut row = vec![format!("{word}("), format!("name: \"{name}\",")];
        row.push(if nil(link.phi, 1.0) { String::new() } else { format!("phi: {},", angle_text(link.phi)) });
        row.extend(lengths.map(|(symbol, value)| format!("{symbol}: {place}({}),", number_text(value, reach))));
        row.extend(angles.map(|(symbol, value)| format!("{symbol}: Free({}),", angle_text(value))));
        rows.push(row);
    }
    let _ = writeln!(out, "    chains: {{\n        \"{chain}\": [");
    for line in aligned(&rows) {
        let _ = writeln!(out, "            {}),", line.trim_end().trim_end_matches(','));
    }
    for (word, name) in heads {
        // the axis is stated already: what is behind it is the end's
        let none = angle_text(NO_LINK);
        let _ = writeln!(out, "            {word}(name: \"{name}\", phi: {none}, alpha: {none}),");
    }
    let held =
        |(symbol, text): (&str, String)| if text == "0" { String::new() } else { format!(", {symbol}: Held({text})") };
    let [rx, ry, rz] = end.xyz_angles();
    let places = ["x", "y", "z"].into_iter().zip(end.origin.map(|value| number_text(value, reach)));
    let turns = ["rx", "ry", "rz"].into_iter().zip([rx, ry, rz].map(angle_text));
    let numbers: String = places.chain(turns).map(held).collect();
    let _ = writeln!(out, "            Rigid(name: \"end\"{numbers}),\n        ],\n    }},\n");
    free
}

/// Cells of rows, each column as wide as its widest; the first two belong together.
fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |k: usize| rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let mut line = String::new();
        for (k, (cell, width)) in row.iter().zip(&widths).enumerate() {
            if *width > 0 {
                let gap = if k == 0 { "" } else { " " };
                let _ = write!(line, "{cell:<width$}{gap}");
            }
        }
        line
    };
    rows.iter().map(line).collect()
}

fn measurement_text(out: &mut String, robot: &Robot, chain: &str, inputs: &[&Reading]) {
    let unit = |kind: Kind| if kind == Kind::Revolute { robot.angle.as_str() } else { robot.length.as_str() };
    let quantities: Vec<String> = inputs
        .iter()
        .enumerate()
        .map(|(k, input)| format!("\"q{}\": (unit: \"{}\"),", k + 1, unit(input.kind)))
        .collect();
    let mut lines: Vec<String> = quantities.chunks(4).map(|some| some.join(" ")).collect();
    // a tenth of a millimetre is what trackers and photogrammetry do in a robot's cell
    let sigma = ["x", "y", "z"].map(|name| format!("\"{name}\": (unit: \"{}\", sigma: \"0.05 mm\"),", robot.length));
    lines.push(sigma.join(" "));
    let arguments: Vec<String> = robot.readings.iter().map(|reading| argument(robot, reading, inputs)).collect();
    let _ = writeln!(
        out,
        "    measurements: {{\n        \
         // One row: the joints' readings, and where the point was measured. The sigma is that of your measuring instrument.\n        \
         \"pose\": (\n            data: \"pose.csv\",\n            inputs: {{\n                {}\n            }},\n            \
         define: {{ \"flange\": \"{chain}({})\", \"point\": \"flange * tool\" }},\n            \
         residuals: {{ \"miss\": \"point - vec(x, y, z)\" }},\n            \
         // origin and axes: a rotation vector would jump where the flange points straight down\n            \
         outputs: {{ \"o\": \"flange.o\", \"ex\": \"flange.x\", \"ez\": \"flange.z\" }},\n        ),\n    }},\n",
        lines.join("\n                "),
        arguments.join(", ")
    );
}

/// What a joint reads, as an expression.
fn argument(robot: &Robot, reading: &Reading, inputs: &[&Reading]) -> String {
    let number = inputs.iter().position(|input| input.of == reading.of).unwrap_or(0) + 1;
    let input = format!("q{number}");
    let own = robot.readings.iter().position(|known| std::ptr::eq(known, reading));
    let own = own.and_then(|at| robot.serial.joints.get(at)).map_or(reading.kind, |joint| joint.kind);
    // what a length is to an angle and the other way about has a unit
    let length = &robot.length;
    let times = match (own, reading.kind) {
        (Kind::Revolute, Kind::Prismatic) => format!("{:?} rad/{length}", reading.multiplier),
        (Kind::Prismatic, Kind::Revolute) => format!("{:?} {length}", reading.multiplier),
        _ => format!("{:?}", reading.multiplier),
    };
    let product = match reading.multiplier {
        1.0 if own == reading.kind => input,
        _ => format!("({times}) * {input}"),
    };
    let unit = if own == Kind::Revolute { "rad" } else { length.as_str() };
    match reading.offset {
        0.0 => product,
        offset if offset < 0.0 => format!("{product} - {:?} {unit}", -offset),
        offset => format!("{product} + {offset:?} {unit}"),
    }
}

fn scenario_text(out: &mut String, robot: &Robot, inputs: &[&Reading], reach: f64) {
    let degree = Unit::parse(&robot.angle).map_or(1.0, |unit| unit.factor);
    let draws = inputs.iter().enumerate().map(|(k, input)| {
        let (min, max) = (input.limits.min, input.limits.max);
        let (min, max) = match input.kind {
            Kind::Revolute if (max - min - std::f64::consts::TAU).abs() < 1e-12 && min == -max => {
                ("\"-pi\"".to_owned(), "\"pi\"".to_owned())
            }
            Kind::Revolute if robot.angle == "rad" => (number_text(min, 1.0), number_text(max, 1.0)),
            Kind::Revolute => {
                let own = |x: f64| format!("\"{} {}\"", number_text(x / degree, 1.0), robot.angle);
                (own(min), own(max))
            }
            // as far as it is large, where nothing is said
            Kind::Prismatic if min >= max => ("0".to_owned(), number_text(2.0 * tenth(reach), reach)),
            Kind::Prismatic => (number_text(min, reach), number_text(max, reach)),
        };
        format!("\"q{}\": Uniform({min}, {max}),", k + 1)
    });
    let draws: Vec<String> = draws.collect();
    let lines: Vec<String> = draws.chunks(3).map(|some| some.join(" ")).collect();
    let _ = writeln!(
        out,
        "    scenarios: {{\n        \
         // Postures between the joints' limits, and a point measured where the nominal robot has it.\n        \
         \"postures\": (\n            seed: 1,\n            measurements: {{\n                \"pose\": (\n                    \
         rows: 100,\n                    draw: {{\n                        {}\n                    }},\n                    \
         set: {{ \"x\": \"point.x\", \"y\": \"point.y\", \"z\": \"point.z\" }},\n                ),\n            }},\n        ),\n    }},",
        lines.join("\n                        ")
    );
}
