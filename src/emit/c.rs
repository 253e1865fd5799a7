//! C99: no heap, no warnings under -Wall -Wextra.

use super::file::{File, Helper, array_name, doc, entry, reads};
use super::names::Case;
use super::routine::{Array, Function, Kind, ROWS, Routine};
use super::syntax::{Fields, Part, Place, Shown, Syntax, body, indent, infix};
use crate::graph::Operation;

struct C;

impl Syntax for C {
    fn case(&self) -> Case {
        Case::Kept
    }

    fn field(&self, name: &str) -> String {
        format!("p->{name}")
    }

    fn sum(&self, terms: &[Part]) -> String {
        infix(terms)
    }

    fn call(&self, operation: Operation, x: &Shown, y: &Shown) -> String {
        let whole = || y.constant.unwrap_or(0.0) as u32;
        match operation {
            Operation::Div => format!("{} / {}", x.signed(), y.signed()),
            Operation::Log => format!("log({})", x.signed()),
            Operation::Abs => format!("fabs({})", x.signed()),
            Operation::Hypot => format!("hypot({}, {})", x.signed(), y.signed()),
            Operation::Atan2 => format!("phical_angle({}, {})", x.signed(), y.signed()),
            Operation::AtLeast => format!("phical_at_least({}, {})", x.signed(), y.signed()),
            Operation::Wrap => format!("phical_wrap({})", x.signed()),
            Operation::Stumpff => format!("phical_stumpff({}, {})", whole(), x.signed()),
            Operation::Atanc => format!("phical_atanc({}, {})", whole(), x.signed()),
            // the others have the names that the table gives them
            _ => format!("{}({})", operation.row().name, x.signed()),
        }
    }

    fn define(&self, name: &str, value: &str) -> String {
        format!("const double {name} = {value};")
    }

    fn sin_cos(&self, sin: Option<&str>, cos: Option<&str>, of: &Shown) -> Vec<String> {
        let both = [("sin", sin), ("cos", cos)].into_iter();
        both.filter_map(|(f, name)| Some(self.define(name?, &format!("{f}({})", of.signed())))).collect()
    }

    fn put_sin_cos(&self, sin: &str, cos: &str, of: &str) -> String {
        format!("{sin} = sin({of}), {cos} = cos({of});")
    }
}

/// The name and the text of a helper.
fn helper(helper: Helper) -> Option<(&'static str, &'static str)> {
    Some(match helper {
        Helper::MultiplyAdd => return None,
        Helper::Operation(Operation::Atan2) => (
            "ANGLE",
            "/* The angle of the point (y, x), which the origin has not. */
static inline double phical_angle(double y, double x)
{
    return y == 0.0 && x == 0.0 ? NAN : atan2(y, x);
}
",
        ),
        Helper::Operation(Operation::Wrap) => (
            "WRAP",
            "/* x brought into (-pi, pi] by whole turns. */
static inline double phical_wrap(double x)
{
    const double turn = 6.283185307179586;
    return x - ceil((x - 0.5 * turn) / turn) * turn;
}
",
        ),
        Helper::Operation(Operation::AtLeast) => (
            "AT_LEAST",
            "/* x, and not a number below the least. */
static inline double phical_at_least(double x, double least)
{
    return x >= least ? x : NAN;
}
",
        ),
        Helper::Operation(Operation::Stumpff) => (
            "STUMPFF",
            "/* Stumpff's function: the sum over i of (-x)^i/(k + 2 i)!, for x >= 0. */
static inline double phical_stumpff(int k, double x)
{
    if (x < 0.5) {
        double sum = 1.0;
        for (int i = 11; i > 0; i--) {
            const double n = k + 2 * i;
            sum = 1.0 - sum * x / (n * (n - 1.0));
        }
        for (int j = 2; j <= k; j++)
            sum /= j;
        return sum;
    }
    const double angle = sqrt(x);
    double c = k % 2 == 0 ? cos(angle) : sin(angle) / angle;
    double factorial = 1.0;
    for (int j = k % 2; j < k; j += 2) {
        c = (1.0 / factorial - c) / x;
        factorial *= (j + 1.0) * (j + 2.0);
    }
    return c;
}
",
        ),
        Helper::Operation(Operation::Atanc) => (
            "ATANC",
            "/* The sum over i of (-x)^i/(2 i + 2 n + 1), for x >= 0. */
static inline double phical_atanc(int n, double x)
{
    if (x < 0.01) {
        double sum = 0.0;
        for (int i = 9; i >= 0; i--)
            sum = 1.0 / (2 * i + 2 * n + 1) - sum * x;
        return sum;
    }
    const double root = sqrt(x);
    double g = atan(root) / root;
    for (int j = 0; j < n; j++)
        g = (1.0 / (2 * j + 1) - g) / x;
    return g;
}
",
        ),
        Helper::Operation(_) => return None,
    })
}

const CLOSE: &str = "#include <stdio.h>

static int phical_close(const double *found, const double *expected, int n, const char *what)
{
    double largest = 0.0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(expected[i]));
    for (int i = 0; i < n; i++) {
        if (!(fabs(found[i] - expected[i]) <= 1e-9 * largest + 1e-12)) {
            printf(\"%s: entry %d is %.17g, not %.17g\\n\", what, i, found[i], expected[i]);
            return 0;
        }
    }
    return 1;
}
";

/// The whole file.
pub(super) fn file(file: &File) -> String {
    let mut out = String::new();
    let names = file.names(Case::Kept);
    for line in file.header("cc -DPHICAL_CHECK FILE.c -lm -o check && ./check") {
        out += format!("// {line}").trim_end();
        out.push('\n');
    }
    out += "//\n// Functions return 0, or 1 where an argument is not finite, or an operation has no finite value, such as a division by\n\
            // zero. They are fastest with -O3 -march=native -fno-math-errno -fno-trapping-math -fno-tree-slp-vectorize, which\n\
            // change no result; under -ffast-math they do not notice what is not finite.\n\n";
    out += "#include <math.h>\n";
    for (name, text) in file.helpers(false).into_iter().filter_map(helper) {
        out += &format!("\n#ifndef PHICAL_{name}\n#define PHICAL_{name}\n{text}#endif\n");
    }
    for (routine, name) in file.routines.iter().zip(&names) {
        out.push('\n');
        out += &functions(routine, name);
    }
    let checked: Vec<(&Routine, &String)> =
        file.routines.iter().zip(&names).filter(|(routine, _)| routine.point.is_some()).collect();
    if !checked.is_empty() {
        out += "\n#ifdef PHICAL_CHECK\n";
        out += CLOSE;
        for (routine, name) in &checked {
            out.push('\n');
            check(&mut out, routine, name);
        }
        out += "\nint main(void)\n{\n    int good = 1;\n";
        for (_, name) in &checked {
            out += &format!("    good &= {name}_check();\n");
        }
        out += "    puts(good ? \"as expected\" : \"not as expected\");\n    return !good;\n}\n#endif\n";
    }
    out
}

fn functions(routine: &Routine, name: &str) -> String {
    let fields = Fields::new(routine, Case::Kept);
    let all: Vec<&str> = fields.all(routine).collect();
    let mut out = format!("// What {name} needs that depends on the parameters alone.\nstruct {name}_prepared {{\n");
    indent(&mut out, 1, all.iter().map(|field| format!("double {field};")));
    indent(&mut out, 1, ["double zero; // not a number where a parameter is none, or a result above"]);
    out += "};\n\n// Does once what all rows have in common. q: the parameters, in the order and units above.\n";
    let q = match routine.parameters.len() {
        0 => String::new(),
        n => format!("const double q[restrict {n}], "),
    };
    out += &format!("void {name}_prepare({q}struct {name}_prepared *restrict p)\n{{\n");
    let unused = [("q", !routine.parameters.is_empty() && !reads(routine, &routine.prepare, "q"))];
    indent(&mut out, 1, unused.iter().filter(|(_, unused)| *unused).map(|(array, _)| format!("(void){array};")));
    let store = |at: usize, value: &str| format!("p->{} = {value};", all[at]);
    let output = |at: usize| format!("p->{}", all[at]);
    let body = body(&C, routine, &routine.prepare, &fields, Place::Prepare, &output, &store);
    indent(&mut out, 1, &body.lines);
    indent(&mut out, 1, [format!("p->zero = {};", body.zero(None))]);
    out += "}\n";
    for function in &routine.functions {
        out.push('\n');
        row(&mut out, routine, name, &fields, function);
    }
    out
}

fn row(out: &mut String, routine: &Routine, name: &str, fields: &Fields, function: &Function) {
    let m = routine.residuals.len();
    let rows = function.kind == Kind::JacobianRows;
    let arrays: Vec<Array> = routine.arrays(function.kind).collect();
    let k = if rows { format!("[{ROWS}]") } else { String::new() };
    let what: Vec<&str> = arrays.iter().map(|&array| array_name(array)).collect();
    *out += &format!("// {} Fills {}.\n", doc(function.kind), what.join(", "));
    let mut arguments = vec![format!("const struct {name}_prepared *restrict p")];
    for (array, numbers) in [("x", &routine.inputs), ("m", &routine.members)] {
        if !numbers.is_empty() {
            // an array of arrays is not one of constants to a caller whose numbers may change
            let constant = if rows { "" } else { "const " };
            arguments.push(format!("{constant}double {array}[restrict {}]{k}", numbers.len()));
        }
    }
    for &array in &arrays {
        let columns = if array == Array::R { String::new() } else { format!("[{}]", routine.width(array)) };
        arguments.push(format!("double {}[restrict {m}]{columns}{k}", array_name(array)));
    }
    *out += &format!("int {name}_{}({})\n{{\n", function.kind.name(), arguments.join(", "));
    for (array, there) in [("x", !routine.inputs.is_empty()), ("m", !routine.members.is_empty())] {
        if there && !reads(routine, &function.line, array) {
            indent(out, 1, [format!("(void){array};")]);
        }
    }
    let place = if rows { Place::Rows } else { Place::Row };
    let output = |at: usize| entry(routine, at, rows);
    let store = |at: usize, value: &str| format!("{} = {value};", output(at));
    let body = body(&C, routine, &function.line, fields, place, &output, &store);
    if !body.turns.is_empty() {
        indent(out, 1, [format!("double turns[{}][{ROWS}];", 2 * body.turns.len())]);
        indent(out, 1, [format!("for (int k = 0; k < {ROWS}; k++) {{")]);
        indent(out, 2, &body.turns);
        indent(out, 1, ["}"]);
    }
    let depth = if rows { 2 } else { 1 };
    if rows {
        indent(out, 1, [format!("double zero[{ROWS}];"), format!("for (int k = 0; k < {ROWS}; k++) {{")]);
    }
    indent(out, depth, &body.lines);
    let zero = body.zero(Some("p->zero"));
    indent(out, depth, [if rows { format!("zero[k] = {zero};") } else { format!("const double zero = {zero};") }]);
    indent(out, depth, function.zeros.iter().map(|&at| format!("{} = 0.0;", entry(routine, at, rows))));
    if rows {
        indent(out, 1, ["}"]);
    }
    if rows {
        indent(out, 1, [format!("for (int k = 1; k < {ROWS}; k++)")]);
        indent(out, 2, ["zero[0] += zero[k];"]);
    }
    indent(out, 1, [format!("return !({} == 0.0);", if rows { "zero[0]" } else { "zero" })]);
    *out += "}\n";
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    format!("{{{}}}", all.join(", "))
}

fn check(out: &mut String, routine: &Routine, name: &str) {
    let Some(point) = &routine.point else { return };
    let m = routine.residuals.len();
    *out += &format!(
        "// A made-up row, and what phical's own evaluation gives there.\nstatic int {name}_check(void)\n{{\n"
    );
    let mut given = vec!["&p".to_owned()];
    indent(out, 1, [format!("struct {name}_prepared p;"), "int good = 1;".into()]);
    let q = if point.q.is_empty() { "" } else { "q, " };
    for (array, values) in [("q", &point.q), ("x", &point.x), ("m", &point.m)] {
        if !values.is_empty() {
            indent(out, 1, [format!("const double {array}[{}] = {};", values.len(), list(values))]);
            if array != "q" {
                given.push(array.to_owned());
            }
        }
    }
    indent(out, 1, [format!("const double expected_r[{m}] = {};", list(&point.r))]);
    indent(out, 1, [format!("double r[{m}];")]);
    let used = |array: Array| routine.functions.iter().any(|f| routine.arrays(f.kind).any(|a| a == array));
    for (array, values) in
        [(Array::ByParameters, &point.dr_dq), (Array::ByMembers, &point.dr_dm), (Array::ByInputs, &point.dr_dx)]
    {
        let (width, of) = (routine.width(array), array_name(array));
        if width > 0 && used(array) {
            indent(out, 1, [format!("const double expected_{of}[{m}][{width}] = {{")]);
            indent(out, 2, values.iter().map(|row| format!("{},", list(row))));
            indent(out, 1, ["};".to_owned(), format!("double {of}[{m}][{width}];")]);
        }
    }
    indent(out, 1, [format!("{name}_prepare({q}&p);")]);
    for function in routine.functions.iter().filter(|function| function.kind != Kind::JacobianRows) {
        let mut arguments = given.clone();
        arguments.extend(routine.arrays(function.kind).map(|array| array_name(array).to_owned()));
        let call = format!("{name}_{}({})", function.kind.name(), arguments.join(", "));
        indent(out, 1, [format!("good &= {call} == 0;")]);
        for array in routine.arrays(function.kind) {
            let (width, of, what) = (routine.width(array), array_name(array), function.kind.name());
            indent(
                out,
                1,
                [match array {
                    Array::R => format!("good &= phical_close(r, expected_r, {m}, \"{name}_{what} r\");"),
                    _ => format!(
                        "for (int i = 0; i < {m}; i++) good &= phical_close({of}[i], expected_{of}[i], {width}, \"{name}_{what} {of}\");"
                    ),
                }],
            );
        }
    }
    indent(out, 1, ["return good;"]);
    *out += "}\n";
}
