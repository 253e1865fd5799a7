//! Expressions of the model language in LaTeX.

use std::collections::HashSet;

use crate::lang::{Expr, ExprKind, Op};

/// How tightly a piece binds.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Level {
    Sum,
    Product,
    Atom,
}

/// A formula for LaTeX's mathematical mode (amsmath). `frames` are names and functions whose values are frames or rotations:
/// their `.x .y .z .o` are vectors, set bold.
///
/// ```
/// use phical::{lang::parse, symbolic::latex};
/// let expr = parse("-dot(l1.o - r1.o, cross(r1.z, l1.z)) / sqrt(2*x)")?;
/// let frames = ["l1".to_owned(), "r1".to_owned()].into();
/// assert_eq!(
///     latex(&expr, &frames),
///     r"\frac{-(\mathbf{o}_{l_{1}} - \mathbf{o}_{r_{1}}) \cdot (\mathbf{z}_{r_{1}} \times \mathbf{z}_{l_{1}})}{\sqrt{2\,x}}"
/// );
/// # Ok::<(), phical::lang::ParseError>(())
/// ```
pub fn latex(expr: &Expr, frames: &HashSet<String>) -> String {
    Typesetter { frames }.write(expr).0
}

/// The terms of a sum, each with its sign, for formulas longer than a line.
pub(crate) fn terms<'e>(expr: &'e Expr, frames: &HashSet<String>) -> Vec<String> {
    let mut found = Vec::new();
    let mut waiting: Vec<(&'e Expr, bool)> = vec![(expr, false)];
    while let Some((part, minus)) = waiting.pop() {
        match &part.kind {
            ExprKind::Binary { op: op @ (Op::Add | Op::Sub), left, right } => {
                waiting.push((right, minus != (*op == Op::Sub)));
                waiting.push((left, minus));
            }
            ExprKind::Negate(inner) => waiting.push((inner, !minus)),
            _ => {
                let text = Typesetter { frames }.at(part, Level::Product);
                let sign = if minus { "- " } else { "+ " };
                found.push(if found.is_empty() && !minus { text } else { format!("{sign}{text}") });
            }
        }
    }
    found
}

struct Typesetter<'f> {
    frames: &'f HashSet<String>,
}

impl Typesetter<'_> {
    /// In brackets where it binds more loosely than wanted.
    fn at(&self, expr: &Expr, least: Level) -> String {
        let (text, level) = self.write(expr);
        if level < least { format!("({text})") } else { text }
    }

    fn write(&self, expr: &Expr) -> (String, Level) {
        match &expr.kind {
            ExprKind::Number { value, unit } => {
                let unit =
                    unit.as_ref().map_or(String::new(), |(symbol, _)| format!(r"\,\mathrm{{{}}}", escaped(symbol)));
                (format!("{}{unit}", number(*value)), if unit.is_empty() { Level::Atom } else { Level::Product })
            }
            ExprKind::Name(name) => (symbol(name), Level::Atom),
            ExprKind::Field(base, field) => (self.field(base, field), Level::Atom),
            ExprKind::Index { family, keys } => {
                let keys: Vec<String> = keys.iter().map(|key| escaped(&key.name)).collect();
                (format!(r"\mathrm{{{}}}_{{\mathrm{{{}}}}}", escaped(family), keys.join(", ")), Level::Atom)
            }
            ExprKind::Call { function, arguments, .. } => self.call(function, arguments),
            ExprKind::Negate(operand) => (format!("-{}", self.at(operand, Level::Product)), Level::Sum),
            ExprKind::Binary { op, left, right } => match op {
                Op::Add => (format!("{} + {}", self.at(left, Level::Sum), self.at(right, Level::Sum)), Level::Sum),
                Op::Sub => (format!("{} - {}", self.at(left, Level::Sum), self.at(right, Level::Product)), Level::Sum),
                Op::Mul => (format!(r"{}\,{}", self.factor(left), self.factor(right)), Level::Product),
                Op::Div => (format!(r"\frac{{{}}}{{{}}}", self.write(left).0, self.write(right).0), Level::Atom),
                Op::Pow => {
                    let base = match left.kind {
                        ExprKind::Name(_) | ExprKind::Number { .. } => self.at(left, Level::Atom),
                        _ => format!("({})", self.write(left).0),
                    };
                    (format!("{base}^{{{}}}", self.write(right).0), Level::Atom)
                }
            },
        }
    }

    /// A factor: dot and cross products beside others are in brackets.
    fn factor(&self, expr: &Expr) -> String {
        match &expr.kind {
            ExprKind::Binary { op: Op::Mul, .. } => self.write(expr).0,
            _ => self.at(expr, Level::Atom),
        }
    }

    fn call(&self, function: &str, arguments: &[Expr]) -> (String, Level) {
        let all = || arguments.iter().map(|argument| self.write(argument).0).collect::<Vec<_>>();
        let applied = |name: &str| (format!(r"{name}\left({}\right)", all().join(", ")), Level::Atom);
        match (function, arguments) {
            ("dot", [a, b]) => (format!(r"{} \cdot {}", self.factor(a), self.factor(b)), Level::Product),
            ("cross", [a, b]) => (format!(r"{} \times {}", self.factor(a), self.factor(b)), Level::Product),
            ("norm", [v]) => (format!(r"\lVert {} \rVert", self.write(v).0), Level::Atom),
            ("abs", [x]) => (format!(r"\lvert {} \rvert", self.write(x).0), Level::Atom),
            ("sqrt", [x]) => (format!(r"\sqrt{{{}}}", self.write(x).0), Level::Atom),
            ("exp", [x]) => (format!("e^{{{}}}", self.write(x).0), Level::Atom),
            ("inverse", [r]) => (format!("{}^{{-1}}", self.at(r, Level::Atom)), Level::Atom),
            ("vec", _) => (format!(r"\begin{{pmatrix}} {} \end{{pmatrix}}", all().join(r" \\ ")), Level::Atom),
            ("derivative", [x, q]) => {
                let (x, q) = (self.at(x, Level::Atom), self.write(q).0);
                (format!(r"\frac{{\partial {x}}}{{\partial {q}}}"), Level::Atom)
            }
            ("rotation_x", _) => applied(r"\mathbf{R}_{x}"),
            ("rotation_y", _) => applied(r"\mathbf{R}_{y}"),
            ("rotation_z", _) => applied(r"\mathbf{R}_{z}"),
            ("sin" | "cos" | "tan" | "exp", _) => applied(&format!(r"\{function}")),
            ("asin", _) => applied(r"\arcsin"),
            ("acos", _) => applied(r"\arccos"),
            ("atan", _) => applied(r"\arctan"),
            ("log", _) => applied(r"\ln"),
            _ => applied(&format!(r"\operatorname{{{}}}", escaped(function))),
        }
    }

    fn is_frame(&self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Name(name) => self.frames.contains(name),
            ExprKind::Call { function, .. } => {
                let chain = function.split('.').next().unwrap_or(function);
                self.frames.contains(chain) || function.starts_with("rotation_") || function == "frame"
            }
            ExprKind::Index { family, .. } => self.frames.contains(family),
            ExprKind::Binary { op: Op::Mul, left, .. } => self.is_frame(left),
            _ => false,
        }
    }

    fn field(&self, base: &Expr, field: &str) -> String {
        let below = match &base.kind {
            ExprKind::Name(name) if is_word(name) => format!(r"\mathrm{{{}}}", escaped(name)),
            _ => self.write(base).0,
        };
        if self.is_frame(base) && matches!(field, "x" | "y" | "z" | "o" | "r") {
            let letter = if field == "r" { "R" } else { field };
            return format!(r"\mathbf{{{letter}}}_{{{below}}}");
        }
        match (&base.kind, field) {
            // a component of a vector
            (_, "x" | "y" | "z") => format!("{{{}}}_{{{field}}}", self.at(base, Level::Atom)),
            // a joint's parameter
            _ => format!("{}_{{{below}}}", symbol(field)),
        }
    }
}

const GREEK: &[&str] = &[
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu", "xi",
    "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega",
];

/// All Greek letters in their order; omicron is set as the letter that it looks like.
const ALPHABET: &[&str] = &[
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu", "xi",
    "o", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega",
];

/// Whether a name is set upright: more than a letter and its number.
fn is_word(name: &str) -> bool {
    !GREEK.contains(&name) && name.trim_end_matches(|c: char| c.is_ascii_digit()).chars().count() > 1
}

/// A name: Greek letters as such, numbers at its end and what follows `_` below the line, words upright.
fn symbol(name: &str) -> String {
    let (stem, below) = match name.split_once('_') {
        Some((stem, below)) if !stem.is_empty() && !below.is_empty() => (stem, Some(below.to_owned())),
        _ => {
            let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
            let number = name.strip_prefix(stem).unwrap_or_default();
            match stem.is_empty() {
                true => (name, None),
                false => (stem, (!number.is_empty()).then(|| number.to_owned())),
            }
        }
    };
    let head = if GREEK.contains(&stem) {
        format!(r"\{stem}")
    } else if stem.chars().count() > 1 {
        format!(r"\mathrm{{{}}}", escaped(stem))
    } else {
        escaped(stem)
    };
    match below {
        Some(below) if below.chars().count() > 1 && !below.chars().all(|c| c.is_ascii_digit()) => {
            format!(r"{head}_{{\mathrm{{{}}}}}", escaped(&below))
        }
        Some(below) => format!("{head}_{{{}}}", escaped(&below)),
        None => head,
    }
}

/// 1.5, 10⁻²⁰
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-4..1e6).contains(&size) {
        return format!("{value}");
    }
    let text = format!("{value:e}");
    match text.split_once('e') {
        Some(("1", exponent)) => format!("10^{{{exponent}}}"),
        Some((digits, exponent)) => format!(r"{digits} \cdot 10^{{{exponent}}}"),
        None => text,
    }
}

/// Text in which nothing is a command. Greek letters of names are given by their commands.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '_' | '#' | '$' | '%' | '&' | '{' | '}' => out.extend(['\\', c]),
            '\\' => out.push_str(r"\textbackslash{}"),
            '~' => out.push_str(r"\textasciitilde{}"),
            '^' => out.push_str(r"\textasciicircum{}"),
            'α'..='ω' => {
                // final sigma shares its letter
                let place = c as usize - 'α' as usize;
                let place = if place > 17 { place - 1 } else { place };
                let name = ALPHABET.get(place).copied().unwrap_or("omega");
                out.push_str(&if name == "o" { "o".to_owned() } else { format!(r"\ensuremath{{\{name}}}") });
            }
            c => out.push(c),
        }
    }
    out
}
