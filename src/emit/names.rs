//! Names of a model as names of a language.

use std::collections::HashSet;

/// Words of the languages that nothing may be called; names of arguments have a prefix and are none of them.
const RESERVED: &[&str] = &[
    // Rust, with the crates that paths begin with
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "core", "crate", "do", "dyn",
    "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro",
    "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "std", "struct",
    "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "while",
    "yield",
];

/// Greek letters in the order of the alphabet, from alpha on; the second sigma ends words.
const GREEK: [&str; 25] = [
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu", "xi",
    "omicron", "pi", "rho", "sigma", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega",
];

/// How names are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Case {
    /// as they stand
    Kept,
    /// `hzL1` is `hz_l1`
    Snake,
}

/// A name with letters, digits and single underscores: `L1.alpha` is `L1_alpha`, `φ₀` is `phi_u2080`. It may begin with a
/// digit, or be empty.
pub(super) fn plain(name: &str, case: Case) -> String {
    let mut out = String::new();
    let mut before = '_';
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            if case == Case::Snake && c.is_ascii_uppercase() && (before.is_ascii_lowercase() || before.is_ascii_digit())
            {
                out.push('_');
            }
            out.push(if case == Case::Snake { c.to_ascii_lowercase() } else { c });
        } else if let Some(letter) = greek(c) {
            if case == Case::Kept && c.is_uppercase() {
                let mut letters = letter.chars();
                out.extend(letters.next().map(|first| first.to_ascii_uppercase()));
                out += letters.as_str();
            } else {
                out += letter;
            }
        } else if c.is_ascii() {
            out.push('_');
        } else {
            out += &format!("_u{:x}", c as u32);
        }
        before = c;
    }
    let words: Vec<&str> = out.split('_').filter(|word| !word.is_empty()).collect();
    words.join("_")
}

fn greek(c: char) -> Option<&'static str> {
    let at = match c {
        'α'..='ω' => c as u32 - 'α' as u32,
        'Α'..='Ω' => c as u32 - 'Α' as u32,
        'ϑ' => 7,
        'ϕ' => 21,
        'ϵ' => 4,
        _ => return None,
    };
    GREEK.get(at as usize).copied()
}

/// Names that are taken, each once.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    taken: HashSet<String>,
}

impl Names {
    /// The name, or with a number behind it where it is taken.
    pub(super) fn unique(&mut self, name: String) -> String {
        let mut found = name.clone();
        let mut number = 2;
        while !self.taken.insert(found.clone()) {
            found = format!("{name}_{number}");
            number += 1;
        }
        found
    }

    /// A name that stands alone, as a module's or at the beginning of functions' names.
    pub(super) fn alone(&mut self, name: &str, case: Case) -> String {
        let mut found = plain(name, case);
        if !found.starts_with(|c: char| c.is_ascii_alphabetic()) {
            found = format!("m_{found}");
        }
        if RESERVED.contains(&found.as_str()) {
            found.push('_');
        }
        self.unique(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_names_of_languages() {
        for (name, kept, snake) in [
            ("L1.alpha", "L1_alpha", "l1_alpha"),
            ("hzL1", "hzL1", "hz_l1"),
            ("socket[hole].x", "socket_hole_x", "socket_hole_x"),
            ("α", "alpha", "alpha"),
            ("Δφ", "Deltaphi", "deltaphi"),
            ("é", "ue9", "ue9"),
            ("a__b", "a_b", "a_b"),
            ("+", "", ""),
        ] {
            assert_eq!((plain(name, Case::Kept).as_str(), plain(name, Case::Snake).as_str()), (kept, snake));
        }
    }

    #[test]
    fn names_are_unique_and_no_words_of_a_language() {
        let mut names = Names::default();
        let found: Vec<String> =
            ["A", "a", "a_2", "in", "3d", "+", "α", "alpha"].map(|n| names.alone(n, Case::Snake)).into();
        assert_eq!(found, ["a", "a_2", "a_2_2", "in_", "m_3d", "m_", "alpha", "alpha_2"]);
    }
}
