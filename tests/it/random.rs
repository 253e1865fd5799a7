//! Random models in the model language: chains of joints of all kinds, and expressions of all shapes over them.

use std::cell::Cell;
use std::fmt::Write;

use proptest::prelude::*;

/// Random choices, used up one after the other; when none are left each choice is the first, which is the simplest.
#[derive(Debug)]
struct Choices {
    numbers: Vec<u32>,
    next: Cell<usize>,
}

impl Choices {
    fn next(&self) -> u32 {
        let at = self.next.replace(self.next.get() + 1);
        self.numbers.get(at).copied().unwrap_or(0)
    }

    fn of(&self, count: usize) -> usize {
        self.next() as usize % count
    }

    fn among<'a>(&self, all: &[&'a str]) -> &'a str {
        all[self.of(all.len())]
    }

    /// A number, exactly zero in a third of all cases.
    fn number(&self) -> f64 {
        match self.of(3) {
            0 => 0.0,
            _ => f64::from(self.next()) / f64::from(u32::MAX) * 3.0 - 1.5,
        }
    }
}

/// A model, and rows of readings for its only measurement.
#[derive(Debug)]
pub struct Random {
    pub text: String,
    pub rows: Vec<Vec<f64>>,
    /// Numbers to choose derivatives by.
    pub picks: Vec<u32>,
}

pub fn models() -> impl Strategy<Value = Random> {
    (prop::collection::vec(any::<u32>(), 0..250), prop::collection::vec(any::<u32>(), 40))
        .prop_map(|(numbers, picks)| model(&Choices { numbers, next: Cell::new(0) }, picks))
}

/// The value of a joint's field: absent, zero, a constant, held, free, or a tie.
fn field(choices: &Choices, name: &str, length: bool) -> String {
    let number = choices.number();
    match choices.of(7) {
        0 => String::new(),
        1 => format!("{name}: 0, "),
        2 => format!("{name}: {number:?}, "),
        3 => format!("{name}: Held({number:?}), "),
        4 => format!("{name}: {:?}, ", if length { "0.5*len" } else { "pi/2 - 0.5*fac" }),
        _ => format!("{name}: Free({number:?}), "),
    }
}

/// A joint and the unit of what it reads.
fn joint(choices: &Choices, i: usize) -> (String, Option<&'static str>) {
    let kind = choices.of(8);
    let fields = |lengths: &[&str], angles: &[&str]| {
        let lengths: String = lengths.iter().map(|name| field(choices, name, true)).collect();
        lengths + &angles.iter().map(|name| field(choices, name, false)).collect::<String>()
    };
    match kind {
        0..=2 => {
            let (word, unit) = [("Revolute", Some("rad")), ("Prismatic", Some("m")), ("Fixed", None)][kind];
            (format!("{word}(name: \"J{i}\", {}), ", fields(&["d", "a", "b"], &["phi", "alpha", "beta"])), unit)
        }
        3 => (format!("Rigid(name: \"J{i}\", {}), ", fields(&["x", "y", "z"], &["rx", "ry", "rz"])), None),
        4 => (format!("Rigid(name: \"J{i}\", pose: \"base\"), "), None),
        5 => (format!("Rigid(name: \"J{i}\", pose: \"tilt\"), "), None),
        _ => {
            let word = if kind == 6 { "Dh" } else { "ModifiedDh" };
            let (reads, unit) = [("Angle", Some("rad")), ("Length", Some("m")), ("Nothing", None)][choices.of(3)];
            let fields = fields(&["d", "a"], &["theta", "alpha", "beta"]);
            (format!("{word}(name: \"J{i}\", {fields}reads: {reads}), "), unit)
        }
    }
}

/// What an expression is.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Number,
    Angle,
    Length,
    /// a vector of lengths
    Point,
    /// a vector of numbers
    Direction,
    Rotation,
    Frame,
}

use Kind::{Angle, Direction, Frame, Length, Number, Point, Rotation};

/// Templates of each kind: a letter in braces is replaced by an expression of its kind.
fn templates(kind: Kind, leaf: bool) -> &'static [&'static str] {
    match (kind, leaf) {
        (Number, true) => &["fac", "f.z.x", "f.o.y/len"],
        (Number, false) => &[
            "dot({D}, {D})",
            "{D}.y",
            "sin({A})",
            "cos({A})*{N}",
            "exp(sin({A}))",
            "log(3 + {N}^2)",
            "sqrt(1 + {N}^2)",
            "(2 + sin({A}))^-1.5",
            "{N}^3 - {N}",
            "tan(0.4*sin({A}))",
            "{L}/(1 m + abs({L} + 0.1 m))",
        ],
        (Angle, true) => &["angle", "pi/3"],
        (Angle, false) => &[
            "atan2({L}, {L})",
            "atan2({N}, 2 + {N})",
            "asin(0.7*sin({A}))",
            "acos(0.7*cos({A}))",
            "atan({N})",
            "wrap({A} + {A})",
        ],
        (Length, true) => &["length", "len", "f.o.z"],
        (Length, false) => {
            &["dot({P}, {D})", "{P}.x", "norm({P})", "distance({P}, {P})", "abs({L} + 0.1 m)", "at_least({L}, -1 km)"]
        }
        (Point, true) => &["f.o", "target"],
        (Point, false) => &[
            "transform({F}, {P})",
            "rotate({R}, {P})",
            "{P} + {P}",
            "{P} - {N}*{P}",
            "vec({L}, {L}, {L})",
            "cross({P}, {D})",
            "{F}*{P}",
            "-{P}/2",
            "midpoint({F}, {F})",
        ],
        (Direction, true) => &["f.x", "tilt.y"],
        (Direction, false) => &[
            "{F}.z",
            "{R}.x",
            "unit({P} + vec(3 m, 0, 1 m))",
            "cross({D}, {D})",
            "{R}*{D}",
            "log_rotation({R})",
            "vec({N}, {N}, {N})",
        ],
        (Rotation, true) => &["tilt", "f.r"],
        (Rotation, false) => &[
            "{F}.r",
            "rotation_vector({D})",
            "rotation_x({A})",
            "rotation_y({A})",
            "rotation_z({A})",
            "{R}*{R}",
            "inverse({R})",
            "quaternion(2 + {N}^2, {N}, {N}, {N})",
        ],
        (Frame, true) => &["f", "base"],
        (Frame, false) => &["{F}*{F}", "inverse({F})", "frame({P}, {R})"],
    }
}

fn expression(choices: &Choices, kind: Kind, depth: usize) -> String {
    let leaf = depth == 0 || choices.of(4) == 0;
    let template = choices.among(templates(kind, leaf));
    let mut text = String::from("(");
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('{') {
        let inner = match &after[..1] {
            "N" => Number,
            "A" => Angle,
            "L" => Length,
            "P" => Point,
            "D" => Direction,
            "R" => Rotation,
            _ => Frame,
        };
        text += before;
        text += &expression(choices, inner, depth.saturating_sub(1));
        rest = &after[2..];
    }
    text + rest + ")"
}

fn model(choices: &Choices, picks: Vec<u32>) -> Random {
    let (mut chain, mut inputs, mut names) = (String::new(), String::new(), Vec::new());
    for i in 0..=choices.of(5) {
        let (text, reads) = joint(choices, i);
        chain += &text;
        if let Some(unit) = reads {
            write!(inputs, "\"q{i}\": (unit: {unit:?}), ").expect("a string");
            names.push(format!("q{i}"));
        }
    }
    let six: Vec<String> = (0..12).map(|_| format!("{:?}", choices.number())).collect();
    // everything is used: a free parameter that nothing depends on is refused
    let all = ["f.o", "f.x", "f.z", "target", "tilt.x", "tilt.y", "base.o", "base.x", "base.y", "fac", "len"];
    let mut residuals: String = all.iter().enumerate().map(|(i, text)| format!("\"all{i}\": {text:?}, ")).collect();
    for i in 0..=choices.of(4) {
        let kind = [Number, Angle, Length, Point, Direction][choices.of(5)];
        write!(residuals, "\"r{i}\": {:?}, ", expression(choices, kind, 3)).expect("a string");
    }
    let text = format!(
        r#"(name: "random", units: (length: "m"), chains: {{"c": [{chain}]}}, parameters: {{
            "len": Scalar(Free("1.25 m")), "fac": Scalar(Free(0.75)), "target": Vec3(Free(({}))),
            "tilt": Rotation(Free(({}))), "base": Pose(Free(({}))),
        }}, measurements: {{"m": (
            inputs: {{{inputs}"angle": (unit: "rad"), "length": (unit: "m")}},
            define: {{"f": "c({})"}}, residuals: {{{residuals}}},
        )}})"#,
        six[..3].join(", "),
        six[3..6].join(", "),
        six[6..12].join(", "),
        names.join(", "),
    );
    let random = (0..names.len() + 2).map(|_| choices.number()).collect();
    Random { text, rows: vec![random, vec![0.0; names.len() + 2]], picks }
}
