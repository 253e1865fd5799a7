//! Python: the math module and nothing else.

use super::file::{File, Helper, array_name, doc, entry};
use super::names::Case;
use super::point::Point;
use super::routine::{Array, Function, Kind, Routine};
use super::syntax::{Fields, Part, Place, Shown, Syntax, body, indent, infix};
use crate::graph::Operation;

struct Python;

impl Syntax for Python {
    fn case(&self) -> Case {
        Case::Kept
    }

    fn field(&self, name: &str) -> String {
        name.to_owned()
    }

    fn sum(&self, terms: &[Part]) -> String {
        infix(terms)
    }

    fn call(&self, operation: Operation, x: &Shown, y: &Shown) -> String {
        let whole = || y.constant.unwrap_or(0.0) as u32;
        match operation {
            Operation::Div => format!("{} / {}", x.signed(), y.signed()),
            Operation::Abs => format!("abs({})", x.signed()),
            Operation::Hypot => format!("math.hypot({}, {})", x.signed(), y.signed()),
            Operation::Atan2 => format!("_angle({}, {})", x.signed(), y.signed()),
            Operation::AtLeast => format!("_at_least({}, {})", x.signed(), y.signed()),
            Operation::Wrap => format!("_wrap({})", x.signed()),
            Operation::Stumpff => format!("_stumpff({}, {})", whole(), x.signed()),
            Operation::Atanc => format!("_atanc({}, {})", whole(), x.signed()),
            // the others have the names that the table gives them
            _ => format!("math.{}({})", operation.row().name, x.signed()),
        }
    }

    fn define(&self, name: &str, value: &str) -> String {
        format!("{name} = {value}")
    }

    fn sin_cos(&self, sin: Option<&str>, cos: Option<&str>, of: &Shown) -> Vec<String> {
        let both = [("sin", sin), ("cos", cos)].into_iter();
        both.filter_map(|(f, name)| Some(self.define(name?, &format!("math.{f}({})", of.signed())))).collect()
    }

    fn put_sin_cos(&self, sin: &str, cos: &str, of: &str) -> String {
        format!("{sin}, {cos} = math.sin({of}), math.cos({of})")
    }
}

/// What every function is wrapped in.
const DEFINED: &str = "
def _finite(found):
    if isinstance(found, (list, tuple)):
        return all(_finite(value) for value in found)
    return math.isfinite(found)


def _defined(function):
    \"\"\"The function, which raises ValueError where any result is not a finite number.\"\"\"

    def checked(*arguments):
        try:
            found = function(*arguments)
        except (ArithmeticError, ValueError) as error:
            raise ValueError(\"a residual or a derivative is undefined\") from error
        if not _finite(found):
            raise ValueError(\"a residual or a derivative is undefined\")
        return found

    checked.__doc__ = function.__doc__
    return checked
";

fn helper(helper: Helper) -> &'static str {
    match helper {
        Helper::MultiplyAdd => "",
        Helper::Operation(Operation::Atan2) => {
            "
def _angle(y, x):
    \"\"\"The angle of the point (y, x), which the origin has not.\"\"\"
    if y == 0.0 and x == 0.0:
        raise ValueError(\"the origin has no angle\")
    return math.atan2(y, x)
"
        }
        Helper::Operation(Operation::Wrap) => {
            "
def _wrap(x):
    \"\"\"x brought into (-pi, pi] by whole turns.\"\"\"
    return x - math.ceil((x - math.pi) / math.tau) * math.tau
"
        }
        Helper::Operation(Operation::AtLeast) => {
            "
def _at_least(x, least):
    \"\"\"x, and an error below the least.\"\"\"
    if not x >= least:
        raise ValueError(\"below the least\")
    return x
"
        }
        Helper::Operation(Operation::Stumpff) => {
            "
def _stumpff(k, x):
    \"\"\"Stumpff's function: the sum over i of (-x)^i/(k + 2 i)!, for x >= 0.\"\"\"
    if x < 0.5:
        total = 1.0
        for i in range(11, 0, -1):
            n = k + 2 * i
            total = 1.0 - total * x / (n * (n - 1))
        return total / math.factorial(k)
    angle = math.sqrt(x)
    c = math.cos(angle) if k % 2 == 0 else math.sin(angle) / angle
    for j in range(k % 2, k, 2):
        c = (1.0 / math.factorial(j) - c) / x
    return c
"
        }
        Helper::Operation(Operation::Atanc) => {
            "
def _atanc(n, x):
    \"\"\"The sum over i of (-x)^i/(2 i + 2 n + 1), for x >= 0.\"\"\"
    if x < 0.01:
        total = 0.0
        for i in range(9, -1, -1):
            total = 1.0 / (2 * i + 2 * n + 1) - total * x
        return total
    root = math.sqrt(x)
    g = math.atan(root) / root
    for j in range(n):
        g = (1.0 / (2 * j + 1) - g) / x
    return g
"
        }
        Helper::Operation(_) => "",
    }
}

/// The whole file.
pub(super) fn file(file: &File) -> String {
    let mut out = String::new();
    let names = file.names(Case::Kept);
    for line in file.header("python3 FILE.py") {
        out += format!("# {line}").trim_end();
        out.push('\n');
    }
    out += "\nimport math\n\n";
    out += DEFINED;
    for found in file.helpers(false) {
        let text = helper(found);
        if !text.is_empty() {
            out.push('\n');
            out += text;
        }
    }
    for (routine, name) in file.routines.iter().zip(&names) {
        functions(&mut out, routine, name);
    }
    out += "\n\ndef _close(found, expected):\n    largest = max((abs(value) for value in expected), default=0.0)\n    \
            assert len(found) == len(expected)\n    for f, e in zip(found, expected):\n        \
            assert abs(f - e) <= 1e-9 * largest + 1e-12, f\"{f} is not {e}\"\n";
    out += "\n\ndef check():\n    \"\"\"Made-up rows, and what phical's own evaluation gives there.\"\"\"\n";
    let mut none = true;
    for (routine, name) in file.routines.iter().zip(&names) {
        if let Some(point) = &routine.point {
            none = false;
            check(&mut out, routine, name, point);
        }
    }
    if none {
        indent(&mut out, 1, ["pass"]);
    }
    out += "\n\nif __name__ == \"__main__\":\n    check()\n    print(\"as expected\")\n";
    out
}

fn functions(out: &mut String, routine: &Routine, name: &str) {
    let fields = Fields::new(routine, Case::Kept);
    let all: Vec<&str> = fields.all(routine).collect();
    let q = if routine.parameters.is_empty() { "" } else { "q" };
    *out += &format!("\n\n@_defined\ndef {name}_prepare({q}):\n");
    indent(
        out,
        1,
        ["\"\"\"Does once what all rows have in common. q: the parameters, in the order and units above.\"\"\""],
    );
    let store = |at: usize, value: &str| format!("{} = {value}", all[at]);
    let lines =
        body(&Python, routine, &routine.prepare, &fields, Place::Prepare, &|at| all[at].to_owned(), &store).lines;
    indent(out, 1, lines.iter().filter(|line| line.split_once(" = ").is_none_or(|(name, value)| name != value)));
    let made: Vec<String> = all.iter().map(|field| format!("{field}, ")).collect();
    indent(out, 1, [format!("return ({})", made.concat().trim_end())]);
    for function in routine.functions.iter().filter(|function| function.kind != Kind::JacobianRows) {
        row(out, routine, name, &all, &fields, function);
    }
}

fn row(out: &mut String, routine: &Routine, name: &str, all: &[&str], fields: &Fields, function: &Function) {
    let m = routine.residuals.len();
    let arrays: Vec<Array> = routine.arrays(function.kind).collect();
    let what: Vec<&str> = arrays.iter().map(|&array| array_name(array)).collect();
    let arguments: Vec<&str> = [("p", true), ("x", !routine.inputs.is_empty()), ("m", !routine.members.is_empty())]
        .into_iter()
        .filter_map(|(array, there)| there.then_some(array))
        .collect();
    *out += &format!("\n\n@_defined\ndef {name}_{}({}):\n", function.kind.name(), arguments.join(", "));
    indent(out, 1, [format!("\"\"\"{} Returns {}.\"\"\"", doc(function.kind), what.join(", "))]);
    if !all.is_empty() {
        let fields: Vec<String> = all.iter().map(|field| format!("{field}, ")).collect();
        indent(out, 1, [format!("({}) = p", fields.concat().trim_end())]);
    }
    for &array in &arrays {
        indent(
            out,
            1,
            [match array {
                Array::R => format!("r = [0.0] * {m}"),
                _ => format!("{} = [[0.0] * {} for _ in range({m})]", array_name(array), routine.width(array)),
            }],
        );
    }
    let output = |at: usize| entry(routine, at, false);
    let store = |at: usize, value: &str| format!("{} = {value}", output(at));
    indent(out, 1, body(&Python, routine, &function.line, fields, Place::Row, &output, &store).lines);
    indent(out, 1, [format!("return {}", what.join(", "))]);
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    format!("[{}]", all.join(", "))
}

fn check(out: &mut String, routine: &Routine, name: &str, point: &Point) {
    let q = if point.q.is_empty() { String::new() } else { list(&point.q) };
    indent(out, 1, [format!("p = {name}_prepare({q})")]);
    let mut given = vec!["p".to_owned()];
    for (array, values) in [("x", &point.x), ("m", &point.m)] {
        if !values.is_empty() {
            indent(out, 1, [format!("{array} = {}", list(values))]);
            given.push(array.to_owned());
        }
    }
    for function in routine.functions.iter().filter(|function| function.kind != Kind::JacobianRows) {
        let call = format!("{name}_{}({})", function.kind.name(), given.join(", "));
        let arrays: Vec<Array> = routine.arrays(function.kind).collect();
        if let [_] = arrays[..] {
            indent(out, 1, [format!("_close({call}, {})", list(&point.r))]);
            continue;
        }
        let names: Vec<&str> = arrays.iter().map(|&array| array_name(array)).collect();
        indent(out, 1, [format!("{} = {call}", names.join(", "))]);
        for array in arrays {
            let rows = match array {
                Array::R => {
                    indent(out, 1, [format!("_close(r, {})", list(&point.r))]);
                    continue;
                }
                Array::ByParameters => &point.dr_dq,
                Array::ByMembers => &point.dr_dm,
                Array::ByInputs => &point.dr_dx,
            };
            let of = array_name(array);
            indent(out, 1, rows.iter().enumerate().map(|(i, row)| format!("_close({of}[{i}], {})", list(row))));
        }
    }
}
