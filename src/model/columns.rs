//! Entries for columns: what several have in common is said once.

use std::ops::Deref;

use super::leaf::Map;
use super::read::{Entry, Reader};
use super::text::Text;
use super::tree::Node;
use crate::diag::Span;

/// Entries by the name of a column. `"hz, v": (…)` in the file is one for each of both names.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns<V>(pub Map<V>);

impl<V> Default for Columns<V> {
    fn default() -> Self {
        Self(Map::default())
    }
}

impl<V> Deref for Columns<V> {
    type Target = Map<V>;

    fn deref(&self) -> &Map<V> {
        &self.0
    }
}

impl<V: Entry + Clone> Entry for Columns<V> {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        let written = Map::read(node, reader)?;
        let all = written.0.into_iter().flat_map(|(names, entry): (Text, V)| {
            let names: Vec<Text> = if names.value.contains(',') { apart(&names) } else { vec![names] };
            names.into_iter().map(move |name| (name, entry.clone()))
        });
        let all: Vec<(Text, V)> = all.collect();
        let mut first: std::collections::BTreeMap<&str, Span> = std::collections::BTreeMap::new();
        let mut right = true;
        for (name, _) in &all {
            if let Some(known) = first.get(name.as_str()) {
                reader.twice("the name", &name.value, *known, name.span);
                right = false;
            } else {
                first.insert(&name.value, name.span);
            }
        }
        right.then_some(Self(Map(all)))
    }

    fn write(&self) -> Option<Node> {
        self.0.write()
    }

    fn absent() -> Option<Self> {
        Some(Self::default())
    }

    fn is_absent(&self) -> bool {
        self.0.is_absent()
    }
}

/// The names between commas, each at its place.
fn apart(names: &Text) -> Vec<Text> {
    let mut all = Vec::new();
    let mut at = 0;
    for part in names.value.split(',') {
        let name = part.trim();
        let start = at + part.find(name).unwrap_or(0);
        let span = names.locate(Span::new(start, start + name.len()));
        all.push(Text { value: name.to_owned(), span, exact: names.exact });
        at += part.len() + 1;
    }
    all
}
