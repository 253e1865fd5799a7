//! Each kind of mistake: its code and its place, to the character.

use super::read;
use crate::diag::{Code, Diagnostics, Place, text};

/// The code and `line:column` of everything that is wrong.
fn found(model: &str) -> Vec<(Code, String)> {
    match read(model) {
        Ok(_) => Vec::new(),
        Err(found) => places(&found),
    }
}

fn places(found: &Diagnostics) -> Vec<(Code, String)> {
    let place = |place: &Option<Place>| match place {
        Some(Place::Text { source, span }) => {
            let (start, end) = (source.position(span.start), source.position(span.end));
            match start.line == end.line {
                true => format!("{}:{}-{}", start.line, start.column, end.column),
                false => format!("{}:{}", start.line, start.column),
            }
        }
        _ => "nowhere".into(),
    };
    found.iter().map(|d| (d.code, place(&d.place))).collect()
}

fn shown(model: &str) -> String {
    text(&read(model).unwrap_err(), false)
}

fn one(code: Code, place: &str, model: &str) {
    assert_eq!(found(model), [(code, place.to_owned())], "{}", shown(model));
}

#[test]
fn unknown_fields_at_every_level() {
    use Code::UnknownField as E;
    one(E, "1:14-19", r#"(name: "µ°", chain: {})"#);
    one(E, "1:22-28", r#"(name: "m", units: (lenght: "mm"))"#);
    one(
        E,
        "2:28-33",
        "(name: \"m\", chains: {\"c\": [\n  Revolute(name: \"µm\", phi: 0, alhpa: 0)]})"
            .replace("phi: 0, ", "")
            .as_str(),
    );
    one(
        E,
        "1:57-62",
        r#"(name: "m", parameters: {"p": Scalar(value: Free(nominal: 1, least: 0))})"#
            .replace("nominal: 1, ", "nominal:1,")
            .as_str(),
    );
    one(E, "1:57-68", r#"(name: "m", parameters: {"p": Vec3(value: (0, 0, 0),    sigma_angle: 1)})"#);
    one(E, "1:37-42", r#"(name: "m", measurements: {"a": (key:[],)})"#.replace("key:[]", "   keyz:[]").replace("keyz", " keyed").as_str());
    assert!(shown(r#"(nam: "m")"#).contains("did you mean `name`"));
}

#[test]
fn missing_fields() {
    use Code::MissingField as E;
    one(E, "1:1-3", "()");
    one(E, "1:7-20", "      Model(units:())"[..].replace("units:()", "units:()").as_str().trim_end());
    one(
        E,
        "1:28-43",
        r#"(name: "", chains: {"c": [ Fixed(phi: 0) , ]})"#.replace("(phi: 0) ,", "(phi:  0 ),").as_str(),
    );
    one(E, "1:31-47", r#"(name: "m", parameters: {"p": Scalar(sigma: 1)})"#);
    one(
        E,
        "1:38-51",
        r#"(name: "m", parameters: {"p": Scalar(Free(sigma: 1)), })"#
            .replace("Free(sigma: 1)", "Free(sigma:1)")
            .as_str(),
    );
    // A misspelt field is one mistake, not two.
    one(Code::UnknownField, "1:2-5", r#"(nam: "m")"#);
}

#[test]
fn wrong_kinds_of_leaves() {
    use Code::WrongKind as E;
    one(E, "1:8-9", "(name: 3)");
    one(E, "1:21-23", r#"(name: "m", define: [])"#);
    one(E, "1:27-28", r#"(name: "m", define: {"k": 2})"#);
    one(E, "1:22-23", r#"(name: "m", define: {2: "k"})"#);
    one(
        E,
        "1:39-45",
        r#"(name: "m", measurements: {"a": (keys:"hole")})"#
            .replace("keys:", "keys: ")
            .replace("(keys", "(keys")
            .as_str()
            .replace("keys: ", "keys:")
            .as_str(),
    );
    one(E, "1:36-42", r#"(name: "m", parameters: {"p": Vec3([0, 0])})"#);
    one(E, "1:37-43", r#"(name: "m", parameters: {"p": Vec3((0, 0.5))})"#);
    one(E, "1:31-44", r#"(name: "m", parameters: {"p": Vec3(0, 0, 1)})"#);
    one(E, "1:36-37", r#"(name: "m", parameters: {"p": Vec3(0)})"#);
    one(E, "1:39-43", r#"(name: "m", parameters: {"p": Scalar((1, 2))})"#);
    one(E, "1:31-32", r#"(name: "m", parameters: {"p": 1})"#);
    one(E, "1:38-42", r#"(name: "m", parameters: {"p": Scalar(true)})"#);
    one(E, "1:38-42", r#"(name: "m", parameters: {"p": Scalar(Free)})"#);
    one(E, "1:40-43", r#"(name: "m", scenarios: {"s": (   seed: 1.5)})"#);
    one(
        E,
        "1:41-51",
        r#"(name: "m", scenarios: {"s": (truth: {  "a": Uniform(1)})})"#
            .replace("  \"a\": ", "\"a\":")
            .as_str()
            .replace("{\"a\":U", "{\"\":U")
            .as_str(),
    );
    one(E, "1:1-3", "[]");
    one(E, "1:1-6", "Model");
    one(E, "1:8-11", "(name: 'c')");
}

#[test]
fn unknown_variants() {
    use Code::UnknownVariant as E;
    one(E, "1:27-34", r#"(name: "m", chains: {"c": [Revolut(name: "a")]})"#.replace("\"c\": [", "\"c\":[ ").as_str());
    one(E, "1:31-35", r#"(name: "m", parameters: {"p": Vec2((0, 0))})"#);
    one(E, "1:38-42", r#"(name: "m", parameters: {"p": Scalar(Fre3(0))})"#);
    one(E, "1:48-54", r#"(name: "m", chains: {"c": [Dh(name: "a", reads:Angels)]})"#);
    one(E, "1:1-6", r#"Robot(name: "m")"#);
    let text = shown(r#"(name: "m", chains: {"c": [Revolut(name: "a")]})"#);
    assert!(text.contains("did you mean `Revolute`"), "{text}");
}

#[test]
fn twins() {
    use Code::Duplicate as E;
    one(E, "1:34-35", r#"(name: "m", define: {"k": "1", "k": "2"})"#.replace("\"1\", \"k", "\"1\",  \"k").as_str());
    one(E, "1:13-17", r#"(name: "m", name: "n")"#);
    one(E, "2:15-16", "(name: \"m\", chains: {\"c\": [Fixed(name: \"A\")], \"d\": [\n  Dh(   name:\"A\")]})");
}

#[test]
fn numbers_that_are_none() {
    for (number, width) in [("NaN", 3), ("inf", 3), ("-inf", 4), ("1e400", 5), ("-1e400", 6)] {
        let model = format!(r#"(name: "m", parameters: {{"p": Scalar(Free({number}))}})"#);
        one(Code::NotFinite, &format!("1:43-{}", 43 + width), &model);
    }
}

#[test]
fn text_that_is_not_ron() {
    use Code::Syntax as E;
    for (place, model) in [
        ("1:1-2", ""),
        ("1:12-13", r#"(name: "m" source: "s")"#),
        ("2:1-2", "(name: \"m\"\n"),
        ("1:7-8", r#"(name "m")"#),
        ("1:13-14", r#"(name: "m") )"#),
        ("1:9-10", r#"(name: "m)"#),
        ("1:44-45", r#"(name: "m", parameters: {"p": Vec3(1, sigma: 5)})"#),
    ] {
        one(E, place, model);
    }
    let mixed = shown(r#"(name: "m", parameters: {"p": Vec3(1, sigma: 5)})"#);
    assert!(mixed.contains("`Scalar(value: …, sigma: …)`"), "{mixed}");
    let crossed = shown(r#"(name: "m", define: {"a": "b")"#);
    assert!(crossed.contains("is closed by this one"), "{crossed}");
    let open = shown("(name: \"m\", chains: {");
    assert!(open.contains("not closed"), "{open}");
}

#[test]
fn deep_nesting_is_refused_where_it_goes_too_deep() {
    let deep = format!("(name: \"((((\", /* (((( */\n define: {}", "[".repeat(200_000));
    one(Code::NestedTooDeep, "2:49-50", &deep);
    for open in ["(", "{", "Some(", "{\"a\":", "(a:", "[(", "/*", "r#\"", "'(", "\"("] {
        assert!(read(&open.repeat(100_000)).is_err());
    }
    let quoted = format!("(name: \"{}\")", "(".repeat(5000));
    assert!(found(&quoted).is_empty());
}

#[test]
fn all_mistakes_at_once() {
    let model = r#"(
    nam: "m",
    units: (length: 3),
    chains: {"c": [
        Revolut(name: "a"),
        Fixed(alhpa: 0, a: Fre(0), b: true),
    ]},
    define: {"k": "1", "k": 1e400},
)"#;
    use Code::{Duplicate, MissingField, UnknownField, UnknownVariant, WrongKind};
    assert_eq!(
        found(model),
        [
            (UnknownField, "2:5-8".into()),
            (WrongKind, "3:21-22".into()),
            (UnknownVariant, "5:9-16".into()),
            (MissingField, "6:9-44".into()),
            (UnknownField, "6:15-20".into()),
            (UnknownVariant, "6:28-31".into()),
            (WrongKind, "6:39-43".into()),
            (Duplicate, "7:25-26".into()),
            (WrongKind, "7:29-34".into()),
        ]
        .map(|(code, place): (Code, String)| (code, place))
    );
}
