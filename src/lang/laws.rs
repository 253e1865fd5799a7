//! What holds for every tree and every text: printing is undone by parsing, brackets are needed, nothing panics.

use proptest::prelude::*;

use super::*;
use crate::unit::{TABLE, Unit};

/// Names, some of which are also units or look like exponents.
fn names() -> impl Strategy<Value = String> {
    prop_oneof!["[a-zA-Z_αφΩ][a-z0-9_θ]{0,2}", Just("m".to_owned()), Just("s".to_owned()), Just("e3".to_owned())]
}

fn numbers() -> impl Strategy<Value = ExprKind> {
    let value = prop_oneof![
        any::<f64>().prop_map(f64::abs).prop_filter("finite with any unit", |value| *value < 1e290),
        (0u32..100).prop_map(f64::from),
    ];
    let known = (0..TABLE.len()).prop_map(|row| TABLE[row].symbol).prop_filter("a sign", |symbol| *symbol != "1");
    let symbol = prop_oneof![
        known.prop_map(str::to_owned),
        Just("m/s^2".to_owned()),
        Just("kg*m^-0.5".to_owned()),
        Just("K/h*px".to_owned()),
    ];
    let unit = symbol.prop_map(|symbol| Unit::parse(&symbol).map(|unit| (symbol, unit)).ok());
    (value, prop_oneof![Just(None), unit]).prop_map(|(value, unit)| ExprKind::Number { value, unit })
}

fn trees_of_all_kinds() -> impl Strategy<Value = Expr> {
    let bare = |kind| Expr { kind, span: 0..0 };
    let key = prop_oneof![names().prop_map(|name| (name, false)), "[a-zA-Z0-9/' .]{0,4}".prop_map(|text| (text, true))];
    let keys = prop::collection::vec(key.prop_map(|(name, quoted)| Key { name, quoted, span: 0..0 }), 1..3);
    let index = (names(), keys).prop_map(|(family, keys)| ExprKind::Index { family, keys });
    let leaf = prop_oneof![numbers(), names().prop_map(ExprKind::Name), index].prop_map(bare);
    leaf.prop_recursive(8, 64, 3, move |inner| {
        let operator = prop::sample::select(Op::ALL.to_vec());
        let arguments = prop::collection::vec(inner.clone(), 0..4);
        let boxed = inner.clone().prop_map(Box::new);
        prop_oneof![
            (boxed.clone(), names()).prop_map(|(base, field)| ExprKind::Field(base, field)),
            boxed.clone().prop_map(ExprKind::Negate),
            (names(), arguments).prop_map(|(function, arguments)| ExprKind::Call {
                function,
                name_span: 0..0,
                arguments
            }),
            (operator.clone(), boxed.clone(), boxed.clone()).prop_map(|(op, left, right)| ExprKind::Binary {
                op,
                left,
                right
            }),
            (operator, boxed.clone(), boxed).prop_map(|(op, left, right)| ExprKind::Binary { op, left, right }),
        ]
        .prop_map(bare)
    })
}

/// The text without the bracket pair whose opening one is the `pair`-th; none where the pair holds a number alone, which
/// keeps its brackets for the reader.
fn without_pair(text: &str, pair: usize) -> Option<String> {
    let open = text.match_indices('(').nth(pair)?.0;
    let mut depth = 0;
    let close = open
        + text[open..].find(|c| {
            depth += i32::from(c == '(') - i32::from(c == ')');
            depth == 0
        })?;
    let inside = &text[open + 1..close];
    let number = parse(inside).is_ok_and(|expr| matches!(expr.kind, ExprKind::Number { .. }));
    (!number).then(|| format!("{}{}{}", &text[..open], inside, &text[close + 1..]))
}

/// Checks that an error can be shown.
fn check_error(text: &str, error: &ParseError) -> Result<(), TestCaseError> {
    prop_assert!(text.get(error.span.clone()).is_some(), "{text:?}: {error:?}");
    prop_assert!(!error.message.is_empty());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn print_then_parse_is_the_same(expr in trees_of_all_kinds()) {
        let text = print(&expr);
        let again = parse(&text);
        prop_assert!(again.as_ref().is_ok_and(|again| again.same(&expr)), "{text}\n{again:?}");
        for pair in 0..text.matches('(').count() {
            let Some(fewer) = without_pair(&text, pair) else { continue };
            let spare = parse(&fewer).is_ok_and(|other| other.same(&expr));
            prop_assert!(!spare, "spare brackets in {text}");
        }
    }

    #[test]
    fn print_then_parse_of_relations_is_the_same(
        sides in prop::collection::vec(trees_of_all_kinds(), 2..4),
        comparison in prop::sample::select(Comparison::ALL.to_vec()),
    ) {
        let sides = if comparison == Comparison::Equal { sides[..2].to_vec() } else { sides };
        let text = Relation { comparison, sides: sides.clone() }.to_string();
        let again = parse_relation(&text);
        let same = |again: &Relation| {
            again.comparison == comparison
                && again.sides.len() == sides.len()
                && again.sides.iter().zip(&sides).all(|(again, side)| again.same(side))
        };
        prop_assert!(again.as_ref().is_ok_and(same), "{text}\n{again:?}");
    }

    #[test]
    fn no_text_panics(text in ".{0,40}") {
        if let Err(error) = parse(&text) {
            check_error(&text, &error)?;
        }
        if let Err(error) = parse_signature(&text) {
            check_error(&text, &error)?;
        }
        if let Err(error) = parse_relation(&text) {
            check_error(&text, &error)?;
        }
    }

    #[test]
    fn no_soup_of_tokens_panics(parts in prop::collection::vec(prop::sample::select(vec![
        "(", ")", "[", "]", ",", ".", "+", "-", "−", "*", "/", "^", "**", "<=", "=", ">=", "<", "'", " ", "a", "φ", "e", "E", "1", "2.5", "1e9", "°", "'",
        "\"", "′", "%", "mm", "m", "s", "h", "µm", "0.3", "99", "²", "º", "\u{301}",
    ]), 0..24)) {
        let text = parts.concat();
        match parse(&text) {
            Ok(expr) => {
                let again = parse(&print(&expr));
                prop_assert!(again.is_ok_and(|again| again.same(&expr)), "{text} → {}", print(&expr));
            }
            Err(error) => check_error(&text, &error)?,
        }
        let _ = parse_signature(&text);
        match parse_relation(&text) {
            Ok(relation) => prop_assert!(parse_relation(&relation.to_string()).is_ok(), "{text} → {relation}"),
            Err(error) => check_error(&text, &error)?,
        }
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = parse(&text) {
            check_error(&text, &error)?;
        }
    }
}
