//! Each kind of mistake: its code and its place, to the character.
//!
//! In the texts `‹` and `›` enclose the place that has to be reported; they are taken out before reading.

use std::collections::BTreeMap;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::Index;

use super::{TWO_THEODOLITE, read};
use crate::diag::Code::{
    self, Duplicate, MissingField, NestedTooDeep, NotFinite, Syntax, UnknownField, UnknownVariant, WrongKind,
};
use crate::diag::{Diagnostic, Place, Span, text};

/// The text without marks, and the marked places in order.
fn unmark(marked: &str) -> (String, Vec<Span>) {
    let (mut model, mut places, mut open) = (String::new(), Vec::new(), Vec::new());
    for c in marked.chars() {
        match c {
            '‹' => {
                open.push(places.len());
                places.push(Span::new(model.len(), model.len()));
            }
            '›' => places[open.pop().unwrap()].end = model.len(),
            c => model.push(c),
        }
    }
    (model, places)
}

/// Everything reported, in the order of places.
fn check(codes: &[Code], marked: &str) {
    let (model, places) = unmark(marked);
    let found = read(&model).expect_err(marked);
    let place = |place: &Option<Place>| match place {
        Some(Place::Text { span, .. }) => *span,
        other => panic!("{other:?}"),
    };
    let reported: Vec<_> = found.iter().map(|d| (d.code, place(&d.place))).collect();
    let expected: Vec<_> = codes.iter().copied().zip(places).collect();
    assert_eq!(reported, expected, "\n{marked}\n{}", text(&found, false));
}

fn one(code: Code, marked: &str) {
    check(&[code], marked);
}

/// One mistake among the parameters.
fn parameter(code: Code, marked: &str) {
    check(&[code], &format!("(name: \"m\", parameters: {{\"p\": {marked}}})"));
}

fn shown(model: &str) -> String {
    text(&read(model).expect_err(model), false)
}

#[test]
fn lines_and_columns_are_those_of_the_file() {
    let shown = shown("(\n  name: \"µ°\", /* ä */ nmae: 3,\n)");
    assert!(shown.contains("--> model.ron:2:23"), "{shown}");
}

#[test]
fn unknown_fields() {
    one(UnknownField, r#"(name: "µ°", ‹chain›: {})"#);
    one(UnknownField, r#"(name: "m", units: (‹lenght›: "mm"))"#);
    one(UnknownField, "(name: \"m\", chains: {\"c\": [\n  Revolute(name: \"µm\", ‹alhpa›: 0)]})");
    one(UnknownField, r#"(name: "m", chains: {"c": [Rigid(name: "a", ‹alpha›: 0)]})"#);
    one(UnknownField, r#"(name: "m", measurements: {"a": (‹keyed›: [])})"#);
    parameter(UnknownField, "Scalar(Free(nominal: 1, ‹least›: 0))");
    parameter(UnknownField, "Vec3(value: (0, 0, 0), ‹sigma_angle›: 1)");
    let shown = shown(r#"(nam: "m")"#);
    assert!(shown.contains("did you mean `name`? fields: `name`"), "{shown}");
}

#[test]
fn missing_fields() {
    one(MissingField, "‹()›");
    one(MissingField, "// µ\n ‹Model(units: ())› ");
    one(MissingField, r#"(name: "", chains: {"c": [ ‹Fixed(phi: 0)› , ]})"#);
    parameter(MissingField, "‹Scalar(sigma: 1)›");
    parameter(MissingField, "Scalar(‹Free(sigma: 1)›)");
    // A misspelt field is one mistake, not two.
    one(UnknownField, r#"(‹nam›: "m")"#);
}

#[test]
fn wrong_kinds_of_values() {
    for marked in [
        "(name: ‹3›)",
        "(name: ‹'c'›)",
        "‹[]›",
        "‹Model›",
        "‹3›",
        r#"(name: "m", define: ‹[]›)"#,
        r#"(name: "m", define: {"k": ‹2›})"#,
        r#"(name: "m", define: {‹2›: "k"})"#,
        r#"(name: "m", chains: {"c": ‹(Fixed(name: "a"))›})"#,
        r#"(name: "m", chains: {"c": [‹"a"›]})"#,
        r#"(name: "m", chains: {"c": [‹Fixed("a")›]})"#,
        r#"(name: "m", chains: {"c": [Fixed(name: "a", b: ‹(1, 2)›)]})"#,
        r#"(name: "m", chains: {"c": [Fixed(name: "a", b: Free(‹[1]›))]})"#,
        r#"(name: "m", measurements: {"a": ‹[]›})"#,
        r#"(name: "m", measurements: {"a": (keys: ‹"hole"›)})"#,
        r#"(name: "m", measurements: {"a": (data: ‹(file: "a")›)})"#,
        r#"(name: "m", measurements: {"a": (data: [(file: "a", optional: ‹1›)])})"#,
        r#"(name: "m", measurements: {"a": (residuals: {"r": ‹0›})})"#,
        r#"(name: "m", scenarios: {"s": (seed: ‹1.5›)})"#,
        r#"(name: "m", scenarios: {"s": (seed: ‹-1›)})"#,
        r#"(name: "m", scenarios: {"s": (truth: {"a": ‹Uniform(1)›})})"#,
        r#"(name: "m", scenarios: {"s": (truth: {"a": Cycle(‹[]›)})})"#,
    ] {
        one(WrongKind, marked);
    }
    for marked in [
        "‹1›",
        "‹Scalar›",
        "‹Scalar(1, 2)›",
        "Scalar(‹true›)",
        "Scalar(‹Free›)",
        "Scalar(‹Free(0, 1)›)",
        "Scalar((‹1, 2›))",
        "Vec3(‹[0, 0, 1]›)",
        "‹Vec3(0, 0, 1)›",
        "Vec3(‹0›)",
        "Vec3((‹0, 0.5›))",
        "Vec3(value: (0, 0, 0), min: (‹0, 0›))",
        "Pose(value: (0, 0, 0, 0, 0, 0), sigma: (‹1, 1, 1, 1, 1, 1›))",
        "Scalar(‹1..2›)",
    ] {
        parameter(WrongKind, marked);
    }
}

#[test]
fn unknown_variants() {
    one(UnknownVariant, r#"‹Robot›(name: "m")"#);
    one(UnknownVariant, r#"(name: "m", chains: {"c": [‹Revolut›(name: "a")]})"#);
    one(UnknownVariant, r#"(name: "m", chains: {"c": [Dh(name: "a", reads: ‹Angles›)]})"#);
    one(UnknownVariant, r#"(name: "m", scenarios: {"s": (truth: {"a": ‹Normale›(0, 1)})})"#);
    parameter(UnknownVariant, "‹Vec2›((0, 0))");
    parameter(UnknownVariant, "Scalar(‹Fre›(0))");
    let shown = shown(r#"(name: "m", chains: {"c": [Revolut(name: "a")]})"#);
    assert!(shown.contains("did you mean `Revolute`"), "{shown}");
}

#[test]
fn twins() {
    one(Duplicate, r#"(name: "m", define: {"k": "1", "‹k›": "2"})"#);
    one(Duplicate, r#"(name: "m", ‹name›: "n")"#);
    one(Duplicate, "(name: \"m\", chains: {\"c\": [Fixed(name: \"A\")], \"d\": [\n  Dh(name: \"‹A›\")]})");
}

#[test]
fn numbers_that_are_none() {
    for number in ["NaN", "inf", "-inf", "1e400", "-1e400", "NaNf64"] {
        parameter(NotFinite, &format!("Scalar(Free(‹{number}›))"));
        parameter(NotFinite, &format!("Vec3((0, ‹{number}›, 0))"));
    }
}

#[test]
fn text_that_is_not_ron() {
    for marked in [
        "‹›",
        r#"(name: "m" ‹s›ource: "s")"#,
        "(name: \"m\"‹\n›",
        r#"(name ‹"›m")"#,
        r#"(name: "m") ‹)›"#,
        r#"(name: "m", parameters: {"p": Vec3(1, sigma‹:› 5)})"#,
        r#"(name: "m", define: {"a" ‹"›b"})"#,
        r#"(name: ‹$›)"#,
    ] {
        one(Syntax, marked);
    }
    let mixed = shown(r#"(name: "m", parameters: {"p": Vec3(1, sigma: 5)})"#);
    assert!(mixed.contains("`Scalar(value: …, sigma: …)`"), "{mixed}");
    let crossed = shown(r#"(name: "m", define: {"a": "b")"#);
    assert!(crossed.contains("is closed by this one"), "{crossed}");
    let open = shown("(name: \"m\", chains: {");
    assert!(open.contains("not closed"), "{open}");
    let endless = shown(r#"(name: "m)"#);
    assert!(endless.contains("does not end"), "{endless}");
}

#[test]
fn deep_nesting_is_refused_where_it_goes_too_deep() {
    let deep = |open: &str| format!("(name: \"((((\", /* (((( */ // ((((\n define: {open}");
    one(NestedTooDeep, &deep(&format!("{}‹[›{}", "[".repeat(39), "[".repeat(200_000))));
    for open in ["(", "{", "Some(", "{\"a\":", "(a:", "[(", "/*", "r#\"", "'(", "\"(", "'\\", "r#"] {
        assert!(read(&open.repeat(100_000)).is_err());
    }
    assert!(read(&format!("(name: \"{}\")", "(".repeat(5000))).is_ok());
}

#[test]
fn all_mistakes_at_once() {
    check(
        &[
            UnknownField,
            WrongKind,
            UnknownVariant,
            MissingField,
            UnknownField,
            UnknownVariant,
            WrongKind,
            Duplicate,
            WrongKind,
            NotFinite,
        ],
        r#"(
    ‹nam›: "m",
    units: (length: ‹3›),
    chains: {"c": [
        ‹Revolut›(name: "a"),
        ‹Fixed(‹alhpa›: 0, a: ‹Fre›(0), b: ‹true›)›,
    ]},
    define: {"k": "1", "‹k›": ‹2›},
    tolerances: (length: ‹1e400›),
)"#,
    );
}

/// Commas and colons of a text outside quotes and comments, but for those before a closing bracket, which may be left out.
fn separators(text: &str) -> Vec<usize> {
    let (mut found, mut at) = (Vec::new(), 0);
    for line in text.split_inclusive('\n') {
        let mut quoted = false;
        for (k, c) in line.char_indices() {
            let rest = &line[k..];
            let ends = rest[1..].trim_start().starts_with([')', ']', '}', '/']);
            match c {
                '"' => quoted = !quoted,
                '/' if rest.starts_with("//") && !quoted => break,
                ',' if !quoted && rest.starts_with(", ") && !ends => found.push(at + k),
                ':' if !quoted && rest.starts_with(": ") => found.push(at + k),
                _ => {}
            }
        }
        at += line.len();
    }
    found
}

proptest! {
    #[test]
    fn commas_and_colons_are_missed_one_by_one(places in vec((any::<Index>(), 0..2_usize), 1..8)) {
        let all = separators(TWO_THEODOLITE);
        let mut text = TWO_THEODOLITE.to_owned();
        let mut broken = BTreeMap::new();
        for (place, how) in places {
            let at = *place.get(&all);
            let comma = &TWO_THEODOLITE[at..=at] == ",";
            // what stands there instead, and how far behind it that shows
            let (wrong, shows) = match (how, comma) {
                (0, _) => (" ", 2),
                (_, true) => (";", 0),
                (_, false) => ("=", 0),
            };
            broken.entry(at).or_insert((wrong, at + shows));
        }
        for (&at, (wrong, _)) in &broken {
            text.replace_range(at..=at, wrong);
        }
        let found = read(&text).expect_err("something is wrong");
        let said = crate::diag::text(&found, false);
        prop_assert!(found.0.iter().all(|mistake| mistake.code == Code::Syntax), "{said}");
        let start = |mistake: &Diagnostic| match &mistake.place {
            Some(Place::Text { span, .. }) => span.start,
            other => panic!("{other:?}"),
        };
        let starts: Vec<usize> = found.0.iter().map(start).collect();
        let expected: Vec<usize> = broken.values().map(|(_, shows)| *shows).collect();
        prop_assert_eq!(starts, expected, "{}", said);
    }
}
