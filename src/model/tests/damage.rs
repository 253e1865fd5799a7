//! Random damage: whatever is done to a text, reading it gives a model or diagnostics, never a panic.

use proptest::collection::vec;
use proptest::prelude::*;

use super::{EVERYTHING, TWO_THEODOLITE, read};
use crate::diag::{json, text};
use crate::model::print;

/// What is done to a good text: where, how much goes, what comes.
fn damage() -> BoxedStrategy<(f64, usize, String)> {
    let piece = prop_oneof![
        Just(String::new()),
        proptest::sample::select(vec![
            "(",
            ")",
            "[",
            "]",
            "{",
            "}",
            "\"",
            "\\",
            ",",
            ":",
            "'",
            "/*",
            "*/",
            "//",
            "r#\"",
            "b\"",
            "-",
            ".",
            "..",
            "1e400",
            "NaN",
            "Some(",
            "None",
            "µ",
            "\u{feff}",
            "#![enable(",
            "\0",
            "r#x",
            "0x",
        ])
        .prop_map(str::to_owned),
        any::<char>().prop_map(String::from),
    ];
    (0.0..1.0, 0..12_usize, piece).boxed()
}

fn damaged(good: &str, all: &[(f64, usize, String)], keep: f64) -> String {
    let mut chars: Vec<char> = good.chars().collect();
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a place in a short text"
    )]
    let place = |share: f64, length: usize| (share * length as f64) as usize;
    for (at, gone, come) in all {
        let start = place(*at, chars.len());
        let end = (start + gone).min(chars.len());
        chars.splice(start..end, come.chars());
    }
    chars.truncate(place(keep, chars.len()));
    chars.into_iter().collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn damaged_models_never_panic(
        all in vec(damage(), 0..4),
        keep in prop_oneof![Just(1.0), 0.0..1.0],
        flagship in any::<bool>(),
    ) {
        let good = if flagship { TWO_THEODOLITE } else { EVERYTHING };
        match read(&damaged(good, &all, keep)) {
            Ok(model) => prop_assert_eq!(read(&print(&model)).ok(), Some(model)),
            Err(found) => {
                prop_assert!(found.has_errors());
                prop_assert!(!text(&found, true).is_empty() && json(&found).is_array());
            }
        }
    }

    #[test]
    fn any_text_never_panics(text in any::<String>(), nested in r#"[\[\](){}",:a-z0-9 /*'r#\\.]{0,60}"#) {
        let _ = (read(&text), read(&nested));
    }
}
