//! Rust: no heap, no dependencies, warning-free under clippy.

use std::f64::consts;

use super::file::{File, array_name, doc, entry, reads};
use super::names::Case;
use super::point::Point;
use super::routine::{Array, Function, Kind, ROWS, Routine};
use super::rust_support::{UNDEFINED, helper, helper_name};
use super::syntax::{Fields, Part, Place, Shown, Syntax, body, indent};
use crate::graph::Operation;

struct Rust;

/// Operations beyond which a function is not made part of others.
const INLINED: usize = 200;

/// Constants that Rust has names for; clippy wants them.
const NAMED: &[(f64, &str)] = &[
    (consts::PI, "PI"),
    (consts::TAU, "TAU"),
    (consts::E, "E"),
    (consts::FRAC_PI_2, "FRAC_PI_2"),
    (consts::FRAC_PI_3, "FRAC_PI_3"),
    (consts::FRAC_PI_4, "FRAC_PI_4"),
    (consts::FRAC_PI_6, "FRAC_PI_6"),
    (consts::FRAC_PI_8, "FRAC_PI_8"),
    (consts::FRAC_1_PI, "FRAC_1_PI"),
    (consts::FRAC_2_PI, "FRAC_2_PI"),
    (consts::FRAC_2_SQRT_PI, "FRAC_2_SQRT_PI"),
    (consts::FRAC_1_SQRT_2, "FRAC_1_SQRT_2"),
    (consts::SQRT_2, "SQRT_2"),
    (consts::LN_2, "LN_2"),
    (consts::LN_10, "LN_10"),
    (consts::LOG2_10, "LOG2_10"),
    (consts::LOG2_E, "LOG2_E"),
    (consts::LOG10_2, "LOG10_2"),
    (consts::LOG10_E, "LOG10_E"),
    (1.618_033_988_749_895, "GOLDEN_RATIO"),
];

impl Syntax for Rust {
    fn case(&self) -> Case {
        Case::Snake
    }

    fn field(&self, name: &str) -> String {
        format!("p.{name}")
    }

    fn constant(&self, value: f64) -> String {
        let near = NAMED.iter().find(|(named, _)| (value - named).abs() < 0.01 * named);
        match near {
            Some((named, name)) if *named == value && *name != "GOLDEN_RATIO" => format!("std::f64::consts::{name}"),
            // one that only looks like it is no slip, which the linter takes it for however it is written
            Some(_) => format!("f64::from_bits({:#x})", value.to_bits()),
            None => format!("{value:?}"),
        }
    }

    /// Fused where that is one instruction.
    fn sum(&self, terms: &[Part]) -> String {
        let numbers: Vec<&Part> = terms.iter().filter(|(_, b)| b.is_none()).collect();
        let mut products: Vec<(&Shown, &Shown)> = terms.iter().filter_map(|(a, b)| Some((a, b.as_ref()?))).collect();
        let mut sum = String::new();
        for (a, _) in numbers {
            sum = match (sum.is_empty(), a.negative) {
                (true, _) => a.signed(),
                (false, true) => format!("{sum} - {}", a.text),
                (false, false) => format!("{sum} + {}", a.text),
            };
        }
        if sum.is_empty()
            && let Some((a, b)) = products.pop()
        {
            sum = format!("{} * {}", a.signed(), b.text);
        }
        for (a, b) in products.into_iter().rev() {
            sum = format!("fma({}, {}, {sum})", a.signed(), b.text);
        }
        sum
    }

    fn call(&self, operation: Operation, x: &Shown, y: &Shown) -> String {
        let method = |name: &str| format!("{}.{name}()", receiver(x));
        match operation {
            // a number by itself is one, or undefined
            Operation::Div if x.text == y.text => format!("{} * {}.recip()", x.signed(), receiver(y)),
            Operation::Div => format!("{} / {}", x.signed(), y.signed()),
            Operation::Sqrt => method("sqrt"),
            Operation::Exp => method("exp"),
            Operation::Log => method("ln"),
            Operation::Sin => method("sin"),
            Operation::Cos => method("cos"),
            Operation::Tan => method("tan"),
            Operation::Asin => method("asin"),
            Operation::Acos => method("acos"),
            Operation::Atan => method("atan"),
            Operation::Abs => method("abs"),
            Operation::Hypot => format!("{}.hypot({})", receiver(x), y.signed()),
            Operation::Atan2 => format!("angle({}, {})", x.signed(), y.signed()),
            Operation::Wrap => format!("wrap({})", x.signed()),
            Operation::AtLeast => format!("at_least({}, {})", x.signed(), y.signed()),
            Operation::Stumpff => format!("stumpff({}, {})", y.constant.unwrap_or(0.0) as u32, x.signed()),
            Operation::Atanc => format!("atanc({}, {})", y.constant.unwrap_or(0.0) as u32, x.signed()),
            // by themselves these are written as terms of a sum, and powers as products and exponentials
            Operation::Add => format!("{} + {}", x.signed(), y.signed()),
            Operation::Sub => format!("{} - {}", x.signed(), y.signed()),
            Operation::Mul => format!("{} * {}", x.signed(), y.signed()),
            Operation::Neg => format!("-{}", receiver(x)),
            Operation::PowInteger => format!("{}.powi({})", receiver(x), y.constant.unwrap_or(0.0) as i32),
            Operation::Pow => format!("{}.powf({})", receiver(x), y.signed()),
        }
    }

    fn define(&self, name: &str, value: &str) -> String {
        format!("let {name} = {value};")
    }

    fn sin_cos(&self, sin: Option<&str>, cos: Option<&str>, of: &Shown) -> Vec<String> {
        let of = receiver(of);
        vec![match (sin, cos) {
            (Some(sin), Some(cos)) => format!("let ({sin}, {cos}) = {of}.sin_cos();"),
            (Some(sin), None) => format!("let {sin} = {of}.sin();"),
            (None, Some(cos)) => format!("let {cos} = {of}.cos();"),
            (None, None) => return Vec::new(),
        }]
    }

    fn put_sin_cos(&self, sin: &str, cos: &str, of: &str) -> String {
        format!("({sin}, {cos}) = {of}.sin_cos();")
    }
}

/// As something that a method can be called on: the type of a plain number is said.
fn receiver(shown: &Shown) -> String {
    match shown.constant {
        Some(value) if shown.text.starts_with(|c: char| c.is_ascii_digit()) => {
            format!("({}{value:?}_f64)", if shown.negative { "-" } else { "" })
        }
        _ => shown.closed(),
    }
}

/// The whole file.
pub(super) fn file(file: &File) -> String {
    let mut out = String::new();
    for line in file.header("rustc --test FILE -o check && ./check") {
        out += format!("// {line}").trim_end();
        out.push('\n');
    }
    out.push('\n');
    out += UNDEFINED;
    for text in file.helpers(true).into_iter().map(helper).filter(|text| !text.is_empty()) {
        out.push('\n');
        out += text;
    }
    for (routine, name) in file.routines.iter().zip(file.names(Case::Snake)) {
        out.push('\n');
        out += &module(file, routine, &name);
    }
    out
}

fn module(file: &File, routine: &Routine, name: &str) -> String {
    let fields = Fields::new(routine, Case::Snake);
    let mut out = format!("/// The measurement `{name}`.\npub mod {name} {{\n");
    let used: Vec<&str> = file.helpers_of(routine, true).into_iter().filter_map(helper_name).collect();
    let used = match used.as_slice() {
        [] => "Undefined".to_owned(),
        used => format!("{{{}}}", [&["Undefined"], used].concat().join(", ")),
    };
    indent(&mut out, 1, [format!("use super::{used};"), String::new()]);

    indent(&mut out, 1, ["/// What depends on the parameters alone.", "#[derive(Clone, Copy, Debug)]"]);
    let all: Vec<&str> = fields.all(routine).collect();
    indent(&mut out, 1, ["pub struct Prepared {"]);
    indent(&mut out, 2, all.iter().map(|field| format!("{field}: f64,")));
    indent(&mut out, 2, ["/// not a number where a parameter is none, or a result above", "zero: f64,"]);
    indent(&mut out, 1, ["}", ""]);
    prepare(&mut out, routine, &fields, &all);
    for function in &routine.functions {
        out.push('\n');
        row(&mut out, routine, &fields, function);
    }
    if let Some(point) = &routine.point {
        out.push('\n');
        test(&mut out, routine, point);
    }
    out + "}\n"
}

fn prepare(out: &mut String, routine: &Routine, fields: &Fields, all: &[&str]) {
    let n = routine.parameters.len();
    indent(out, 1, ["/// Does once what all rows have in common. `q`: the parameters, in the order and units above."]);
    let argument = if n == 0 { String::new() } else { format!("q: &[f64; {n}]") };
    indent(out, 1, [format!("pub fn prepare({argument}) -> Prepared {{")]);
    if n > 0 && !reads(routine, &routine.prepare, "q") {
        indent(out, 2, ["let _ = q;"]);
    }
    let place = |at: usize, value: &str| format!("let {} = {value};", all[at]);
    let body = body(&Rust, routine, &routine.prepare, fields, Place::Prepare, &|at| all[at].to_owned(), &place);
    let zero = format!("let zero = {};", body.zero(None));
    // a parameter that rows read is there under its own name
    let lines = body.lines.into_iter().filter(|line| {
        let same =
            line.strip_prefix("let ").and_then(|rest| rest.strip_suffix(';')).and_then(|rest| rest.split_once(" = "));
        same.is_none_or(|(name, value)| name != value)
    });
    indent(out, 2, lines);
    indent(out, 2, [zero, format!("Prepared {{ {} }}", [all, &["zero"]].concat().join(", "))]);
    indent(out, 1, ["}"]);
}

fn row(out: &mut String, routine: &Routine, fields: &Fields, function: &Function) {
    let m = routine.residuals.len();
    let arrays: Vec<Array> = routine.arrays(function.kind).collect();
    let what: Vec<String> = arrays.iter().map(|&array| format!("`{}`", array_name(array))).collect();
    let doc = doc(function.kind);
    let rows = function.kind == Kind::JacobianRows;
    indent(
        out,
        1,
        [
            format!("/// {doc} Fills {}.", what.join(", ")),
            "///".into(),
            "/// # Errors".into(),
            "/// Where an argument is not finite, or an operation has no finite value, such as a division by zero."
                .into(),
        ],
    );
    let number = if rows { format!("[f64; {ROWS}]") } else { "f64".to_owned() };
    let mut arguments = vec!["p: &Prepared".to_owned()];
    for (array, numbers) in [("x", &routine.inputs), ("m", &routine.members)] {
        if !numbers.is_empty() {
            arguments.push(format!("{array}: &[{number}; {}]", numbers.len()));
        }
    }
    for &array in &arrays {
        let of = match array {
            Array::R => format!("[{number}; {m}]"),
            _ => format!("[[{number}; {}]; {m}]", routine.width(array)),
        };
        arguments.push(format!("{}: &mut {of}", array_name(array)));
    }
    if !rows && function.line.operations() > INLINED {
        // a call is nothing to so many operations, and compilers do worse where they have a loop around them
        indent(out, 1, ["#[inline(never)]"]);
    }
    indent(out, 1, [format!("pub fn {}(", function.kind.name())]);
    indent(out, 2, arguments.iter().map(|argument| format!("{argument},")));
    indent(out, 1, [") -> Result<(), Undefined> {"]);
    for (array, there) in [("x", !routine.inputs.is_empty()), ("m", !routine.members.is_empty())] {
        if there && !reads(routine, &function.line, array) {
            indent(out, 2, [format!("let _ = {array};")]);
        }
    }
    let entry = |at: usize| entry(routine, at, rows);
    let place = if rows { Place::Rows } else { Place::Row };
    let body =
        body(&Rust, routine, &function.line, fields, place, &entry, &|at, value| format!("{} = {value};", entry(at)));
    let depth = if rows { 3 } else { 2 };
    if !body.turns.is_empty() {
        indent(out, 2, [format!("let mut turns = [[0.0; {ROWS}]; {}];", 2 * body.turns.len())]);
        indent(out, 2, [format!("for k in 0..{ROWS} {{")]);
        indent(out, 3, &body.turns);
        indent(out, 2, ["}"]);
    }
    if rows {
        indent(out, 2, [format!("let mut zero = [0.0; {ROWS}];"), format!("for k in 0..{ROWS} {{")]);
    }
    indent(out, depth, &body.lines);
    let zero = body.zero(Some("p.zero"));
    indent(out, depth, [if rows { format!("zero[k] = {zero};") } else { format!("let zero = {zero};") }]);
    indent(out, depth, function.zeros.iter().map(|&at| format!("{} = 0.0;", entry(at))));
    if rows {
        indent(out, 2, ["}"]);
    }
    let found = if rows { "zero.iter().sum::<f64>()" } else { "zero" };
    indent(out, 2, [format!("if {found} == 0.0 {{ Ok(()) }} else {{ Err(Undefined) }}")]);
    indent(out, 1, ["}"]);
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|&value| number(value)).collect();
    format!("[{}]", all.join(", "))
}

fn number(value: f64) -> String {
    format!("{}{}", if value.is_sign_negative() { "-" } else { "" }, Rust.constant(value.abs()))
}

fn test(out: &mut String, routine: &Routine, point: &Point) {
    let m = routine.residuals.len();
    indent(out, 1, ["#[cfg(test)]", "mod tests {"]);
    indent(
        out,
        2,
        ["/// A made-up row, and what phical's own evaluation gives there.", "#[test]", "fn test_vector() {"],
    );
    let q = if routine.parameters.is_empty() { String::new() } else { format!("&{}", list(&point.q)) };
    indent(out, 3, [format!("let p = super::prepare({q});")]);
    let mut given = vec!["&p".to_owned()];
    for (name, values) in [("x", &point.x), ("m", &point.m)] {
        if !values.is_empty() {
            indent(out, 3, [format!("let {name} = {};", list(values))]);
            given.push(format!("&{name}"));
        }
    }
    indent(out, 3, [format!("let expected_r: [f64; {m}] = {};", list(&point.r))]);
    for (array, values) in
        [(Array::ByParameters, &point.dr_dq), (Array::ByMembers, &point.dr_dm), (Array::ByInputs, &point.dr_dx)]
    {
        let width = routine.width(array);
        if width > 0 && routine.functions.iter().any(|f| routine.arrays(f.kind).any(|a| a == array)) {
            indent(out, 3, [format!("let expected_{}: [[f64; {width}]; {m}] = [", array_name(array))]);
            indent(out, 4, values.iter().map(|row| format!("{},", list(row))));
            indent(out, 3, ["];"]);
        }
    }
    for function in &routine.functions {
        let rows = function.kind == Kind::JacobianRows;
        let each = |name: &String| if rows { format!("{name}.map(|v| [v; {ROWS}])") } else { name.clone() };
        let mut arguments: Vec<String> = given[..1].to_vec();
        arguments.extend(given[1..].iter().map(each));
        let number = if rows { format!("[0.0; {ROWS}]") } else { "0.0".to_owned() };
        let mut checks = Vec::new();
        for array in routine.arrays(function.kind) {
            let name = array_name(array);
            let zero = match array {
                Array::R => format!("[{number}; {m}]"),
                _ => format!("[[{number}; {}]; {m}]", routine.width(array)),
            };
            indent(out, 3, [format!("let mut {name} = {zero};")]);
            arguments.push(format!("&mut {name}"));
            let last = ROWS - 1;
            checks.push(match (array, rows) {
                (Array::R, false) => "close(&r, &expected_r);".to_owned(),
                (Array::R, true) => format!("close(&r.map(|of| of[{last}]), &expected_r);"),
                (_, false) => {
                    format!("{name}.iter().zip(&expected_{name}).for_each(|(row, expected)| close(row, expected));")
                }
                (_, true) => format!(
                    "{name}.iter().zip(&expected_{name}).for_each(|(row, expected)| close(&row.map(|of| of[{last}]), expected));"
                ),
            });
        }
        indent(out, 3, [format!("assert_eq!(super::{}({}), Ok(()));", function.kind.name(), arguments.join(", "))]);
        indent(out, 3, checks);
    }
    indent(
        out,
        2,
        [
            "}",
            "",
            "fn close(found: &[f64], expected: &[f64]) {",
            "    let largest = expected.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));",
            "    for (f, e) in found.iter().zip(expected) {",
            "        assert!((f - e).abs() <= 1e-9 * largest + 1e-12, \"{found:?} is not {expected:?}\");",
            "    }",
            "}",
        ],
    );
    indent(out, 1, ["}"]);
}
