//! RON text as a tree of nodes that know their bytes.
//!
//! The grammar is that of the `ron` crate: each level is taken apart into borrowed [`RawValue`]s, whose address in the text is
//! their place. Nothing of the model is known here, so any value is read and judged later, all mistakes at once.

use ron::error::SpannedError;
use ron::value::RawValue;

use super::raw::{Inside, Name, Pairs, Quoted};
use super::text::Text;
use crate::diag::Span;

/// A value and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub(crate) span: Span,
    pub(crate) kind: Kind,
}

/// What a value can be.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Kind {
    /// A number, perhaps not finite, and the same as a whole number where it is one.
    Number(f64, Option<u64>),
    Text(Text),
    Bool(bool),
    /// `[…]`
    List(Vec<Node>),
    /// `{key: value, …}`
    Map(Vec<(Node, Node)>),
    /// `Name`, `Name(…)` or `(…)`
    Group(Option<Word>, Body),
    /// RON that no model needs, described in a few words.
    Other(&'static str),
}

/// What stands after the name of a group.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Body {
    Bare,
    Tuple(Vec<Node>),
    Fields(Vec<(Word, Node)>),
}

/// A name outside quotes: a field, a joint, `Free`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Word {
    pub(crate) name: String,
    pub(crate) span: Span,
}

/// The tree of a whole text. `shift` is added to every place, for a text that is the rest of a longer one.
///
/// The caller makes sure that the text ends in a line break (a raw value may not end in a comment) and that brackets are not
/// nested without limit.
pub(crate) fn parse(text: &str, shift: usize) -> Result<Node, SpannedError> {
    let raw: &RawValue = ron::from_str(text)?;
    Builder { text, shift }.node(raw)
}

struct Builder<'t> {
    text: &'t str,
    shift: usize,
}

impl<'t> Builder<'t> {
    /// Where a piece of the text stands, by its address.
    fn span(&self, piece: &str) -> Span {
        let start = (piece.as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize);
        if start > self.text.len() {
            return Span::new(self.shift, self.shift);
        }
        let start = start + self.shift;
        Span::new(start, start + piece.len())
    }

    fn holds(&self, piece: &str) -> bool {
        let start = (piece.as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize);
        start <= self.text.len() && piece.len() <= self.text.len() - start
    }

    fn node(&self, raw: &'t RawValue) -> Result<Node, SpannedError> {
        let text = raw.trim().get_ron();
        let span = self.span(text);
        let word = leading_word(text);
        let kind = match text.as_bytes().first() {
            Some(b'[') => {
                let items: Vec<&RawValue> = ron::from_str(text)?;
                Kind::List(self.nodes(&items)?)
            }
            Some(b'{') => {
                let Pairs(pairs) = ron::from_str(text)?;
                let node = |(k, v)| Ok((self.node(k)?, self.node(v)?));
                Kind::Map(pairs.into_iter().map(node).collect::<Result<_, _>>()?)
            }
            Some(b'(') => Kind::Group(None, self.body(text)?),
            Some(b'"') => self.text(text, span)?,
            Some(b'r') if text.starts_with("r\"") || text.starts_with("r#") => match self.text(text, span) {
                Ok(text) => text,
                Err(_) => Kind::Other("a raw name"),
            },
            Some(b'\'') => Kind::Other("a character"),
            Some(b'b')
                if text.starts_with("b'")
                    || text.starts_with("b\"")
                    || text.starts_with("br") && text.contains('"') =>
            {
                Kind::Other("bytes")
            }
            _ if matches!(word, "true" | "false") => Kind::Bool(word == "true"),
            _ if word.is_empty() || is_number_word(word) => number(text),
            _ => {
                let name = Some(Word { name: word.to_owned(), span: self.span(word) });
                let rest = skip_blank(text.strip_prefix(word).unwrap_or_default());
                let body = if rest.is_empty() { Body::Bare } else { self.body(rest)? };
                Kind::Group(name, body)
            }
        };
        Ok(Node { span, kind })
    }

    fn nodes(&self, raw: &[&'t RawValue]) -> Result<Vec<Node>, SpannedError> {
        raw.iter().map(|item| self.node(item)).collect()
    }

    /// What stands between round brackets.
    fn body(&self, text: &'t str) -> Result<Body, SpannedError> {
        match ron::from_str::<Inside>(text)? {
            Inside::Tuple(items) => Ok(Body::Tuple(self.nodes(&items)?)),
            Inside::Fields(fields) => {
                let field = |(name, value): (Name<'t>, _)| {
                    let word = Word { span: self.span(name.0), name: name.0.to_owned() };
                    Ok((word, self.node(value)?))
                };
                let fields = fields.into_iter().map(field).collect::<Result<_, _>>()?;
                Ok(Body::Fields(fields))
            }
        }
    }

    fn text(&self, literal: &'t str, span: Span) -> Result<Kind, SpannedError> {
        let quoted: Quoted<'t> = ron::from_str(literal)?;
        Ok(Kind::Text(match quoted {
            Quoted::Plain(value) if self.holds(value) => {
                Text { value: value.to_owned(), span: self.span(value), exact: true }
            }
            Quoted::Plain(value) => Text { value: value.to_owned(), span, exact: false },
            Quoted::Escaped(value) => {
                Text { value, span: Span::new(span.start + 1, span.end.max(span.start + 2) - 1), exact: false }
            }
        }))
    }
}

fn number(text: &str) -> Kind {
    let whole = ron::from_str::<u64>(text).ok();
    let general = || match ron::from_str::<ron::Value>(text) {
        Ok(ron::Value::Number(number)) => Some(number.into_f64()),
        _ => None,
    };
    match ron::from_str::<f64>(text).ok().or_else(general) {
        Some(value) => Kind::Number(value, whole),
        None => Kind::Other("a range or something else that is no number"),
    }
}

/// The letters, digits and underscores a text starts with, if it starts with a letter.
fn leading_word(text: &str) -> &str {
    if !text.starts_with(|c: char| c.is_alphabetic() || c == '_') {
        return "";
    }
    let rest = text.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_');
    text.strip_suffix(rest).unwrap_or(text)
}

fn is_number_word(word: &str) -> bool {
    let plain = word.trim_end_matches("f32").trim_end_matches("f64");
    matches!(plain, "inf" | "NaN")
}

/// The text after the comment it starts with, from the end of its line on.
pub(super) fn skip_line_comment(text: &str) -> &str {
    text.trim_start_matches(|c| c != '\n')
}

/// The text without the white space and comments it starts with.
pub(crate) fn skip_blank(text: &str) -> &str {
    let mut rest = text.trim_start();
    loop {
        let after = if rest.starts_with("//") {
            skip_line_comment(rest)
        } else if rest.starts_with("/*") {
            skip_block_comment(rest)
        } else {
            return rest;
        };
        rest = after.trim_start();
    }
}

/// The text after the block comment it starts with; block comments nest.
pub(crate) fn skip_block_comment(text: &str) -> &str {
    let mut depth = 0_usize;
    let mut rest = text;
    loop {
        if let Some(after) = rest.strip_prefix("/*") {
            depth += 1;
            rest = after;
        } else if let Some(after) = rest.strip_prefix("*/") {
            depth -= 1;
            rest = after;
            if depth == 0 {
                return rest;
            }
        } else {
            let mut chars = rest.chars();
            if chars.next().is_none() {
                return rest;
            }
            rest = chars.as_str();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(text: &str) -> Node {
        parse(&format!("{text}\n"), 0).unwrap()
    }

    #[test]
    fn every_node_knows_its_bytes() {
        let text = "/* /* a */ */ Model( // b\n µ: [ 1 , -2.5 ], k : {\"x\" : Free( (0, 0) ) } ) // end";
        let node = tree(text);
        assert_eq!(&text[node.span.range()], &text[14..text.len() - 7]);
        let Kind::Group(Some(word), Body::Fields(fields)) = node.kind else { panic!("{node:?}") };
        assert_eq!(&text[word.span.range()], "Model");
        assert_eq!(&text[fields[0].0.span.range()], "µ");
        assert_eq!(&text[fields[0].1.span.range()], "[ 1 , -2.5 ]");
        let Kind::Map(pairs) = &fields[1].1.kind else { panic!("{fields:?}") };
        let Kind::Text(key) = &pairs[0].0.kind else { panic!("{pairs:?}") };
        assert_eq!(&text[key.span.range()], "x");
        assert_eq!(&text[pairs[0].1.span.range()], "Free( (0, 0) )");
    }

    #[test]
    fn texts_are_exact_unless_escaped() {
        for (literal, value, exact) in [
            (r#""a°b""#, "a°b", true),
            (r##"r#"a"b"#"##, "a\"b", true),
            (r#""56.7\"""#, "56.7\"", false),
            (r#""""#, "", true),
        ] {
            let node = tree(&format!("  {literal} "));
            let Kind::Text(text) = node.kind else { panic!("{literal}") };
            assert_eq!((text.value.as_str(), text.exact), (value, exact));
            if exact {
                assert_eq!(&format!("  {literal} ")[text.span.range()], value);
            }
        }
    }

    #[test]
    fn numbers_words_and_the_rest() {
        let kind = |text| tree(text).kind;
        assert_eq!(kind("1_000"), Kind::Number(1000.0, Some(1000)));
        assert_eq!(kind("0x10"), Kind::Number(16.0, Some(16)));
        assert_eq!(kind("0.1"), Kind::Number(0.1, None));
        assert_eq!(kind("+.5e-3"), Kind::Number(0.5e-3, None));
        assert_eq!(kind("1e400"), Kind::Number(f64::INFINITY, None));
        assert!(matches!(kind("-inf"), Kind::Number(x, None) if x < -f64::MAX));
        assert!(matches!(kind("NaN"), Kind::Number(x, None) if x.is_nan()));
        assert_eq!(kind("true"), Kind::Bool(true));
        assert_eq!(kind("()"), Kind::Group(None, Body::Tuple(vec![])));
        assert_eq!(kind("( )"), Kind::Group(None, Body::Tuple(vec![])));
        for other in ["'c'", "b'c'", "b\"c\"", "1..2", "br\"x\"", "r#name", "1..", ".."] {
            assert!(matches!(kind(other), Kind::Other(_)), "{other}");
        }
        for word in ["Angle", "information", "b", "r", "NaNa"] {
            let Kind::Group(Some(found), Body::Bare) = kind(word) else { panic!("{word}") };
            assert_eq!(found.name, word);
        }
    }
}
