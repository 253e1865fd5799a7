//! A model as canonical text.

use super::Model;
use super::text::Text;
use super::tree::{Body, Kind, Node};

/// Lines are kept to this many characters where they can be broken.
const WIDTH: usize = 110;

/// The model as RON, fields in the order of their declaration, without what is absent. Loads as an equal model.
#[must_use]
pub fn print(model: &Model) -> String {
    let root = model.to_fields().node(Some("Model"));
    let mut out = String::new();
    broken(&root, 0, &mut out);
    out.push('\n');
    out
}

/// A node on one line if it fits behind what stands on the line, else one part per line.
fn layout(node: &Node, depth: usize, used: usize, out: &mut String) {
    let mut line = String::new();
    flat(node, &mut line);
    if used + line.chars().count() <= WIDTH {
        out.push_str(&line);
    } else {
        broken(node, depth, out);
    }
}

/// The opening of a node, its closing bracket, and its parts, each with what stands before its value.
type Parts<'n> = (String, char, Vec<(String, &'n Node)>);

fn parts(node: &Node) -> Option<Parts<'_>> {
    Some(match &node.kind {
        Kind::List(items) => {
            let parts = items.iter().map(|item| (String::new(), item)).collect();
            ("[".into(), ']', parts)
        }
        Kind::Map(pairs) => {
            let part = |(key, value)| {
                let mut before = String::new();
                flat(key, &mut before);
                (before + ": ", value)
            };
            let parts = pairs.iter().map(|(key, value)| part((key, value)));
            ("{".into(), '}', parts.collect())
        }
        Kind::Group(word, body) => {
            let name = word.as_ref().map_or("", |word| &word.name);
            let parts = match body {
                Body::Bare => return None,
                Body::Tuple(items) => items.iter().map(|item| (String::new(), item)).collect(),
                Body::Fields(fields) => {
                    fields.iter().map(|(word, value)| (format!("{}: ", word.name), value)).collect()
                }
            };
            (format!("{name}("), ')', parts)
        }
        _ => return None,
    })
}

fn flat(node: &Node, out: &mut String) {
    let Some((open, close, parts)) = parts(node) else {
        return atom(node, out);
    };
    out.push_str(&open);
    for (at, (before, value)) in parts.into_iter().enumerate() {
        if at > 0 {
            out.push_str(", ");
        }
        out.push_str(&before);
        flat(value, out);
    }
    out.push(close);
}

fn broken(node: &Node, depth: usize, out: &mut String) {
    let Some((open, close, parts)) = parts(node) else {
        return atom(node, out);
    };
    let indent = "    ".repeat(depth + 1);
    out.push_str(&open);
    out.push('\n');
    for (before, value) in parts {
        out.push_str(&indent);
        out.push_str(&before);
        let used = indent.len() + before.chars().count() + 1;
        layout(value, depth + 1, used, out);
        out.push_str(",\n");
    }
    out.push_str(&"    ".repeat(depth));
    out.push(close);
}

/// A node without parts.
fn atom(node: &Node, out: &mut String) {
    match &node.kind {
        Kind::Number(_, Some(whole)) => out.push_str(&whole.to_string()),
        Kind::Number(value, None) => out.push_str(&number(*value)),
        Kind::Text(text) => quote(text, out),
        Kind::Bool(value) => out.push_str(if *value { "true" } else { "false" }),
        Kind::Group(Some(word), Body::Bare) => out.push_str(&word.name),
        _ => out.push_str("()"),
    }
}

/// The shortest text that reads back as the same number.
fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

fn quote(text: &Text, out: &mut String) {
    out.push('"');
    for c in text.value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            c if c.is_control() => out.push_str(&c.escape_unicode().to_string()),
            c => out.push(c),
        }
    }
    out.push('"');
}
