//! The small things a model is made of: numbers, quantities, tuples of them, and ordered maps.

use super::read::{Entry, Reader, group, read_all, unplaced};
use super::text::Text;
use super::tree::{Body, Kind, Node};
use crate::diag::{Code, Span};

/// A finite number and where it stands. Equality compares the number.
#[derive(Clone, Copy, Debug, Default)]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Its bytes.
    pub span: Span,
}

impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        let span = Span::default();
        Self { value, span }
    }
}

/// A number in the unit of its place, or text: a number with its unit, or an expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// `2400`
    Number(Number),
    /// `"17.59 arcsec"`, `"pi/2"`, `"R1.b + 2 mm"`
    Text(Text),
}

impl Quantity {
    /// Where it stands: the number, or the text between the quotes.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            Self::Number(number) => number.span,
            Self::Text(text) => text.span,
        }
    }
}

impl Default for Quantity {
    fn default() -> Self {
        Self::Number(Number::default())
    }
}

impl From<f64> for Quantity {
    fn from(value: f64) -> Self {
        Self::Number(value.into())
    }
}

impl From<&str> for Quantity {
    fn from(value: &str) -> Self {
        Self::Text(value.into())
    }
}

impl Entry for Quantity {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Number(value, _) if value.is_finite() => {
                Some(Self::Number(Number { value: *value, span: node.span }))
            }
            Kind::Number(..) => {
                reader.error(Code::NotFinite, node.span, "the number is not finite", None);
                None
            }
            Kind::Text(text) => Some(Self::Text(text.clone())),
            _ => reader.wrong(node, "a number or text such as \"5 mm\"", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match self {
            Self::Number(number) => Some(unplaced(Kind::Number(number.value, None))),
            Self::Text(text) => text.write(),
        }
    }
}

/// One quantity, or one for each component.
#[derive(Clone, Debug, PartialEq)]
pub enum Components {
    /// One for all, or an expression for the whole.
    One(Quantity),
    /// `(0, 0, "100 mm")`
    Each(Vec<Quantity>),
}

impl Default for Components {
    fn default() -> Self {
        Self::One(Quantity::default())
    }
}

impl Components {
    /// That of one component; none where there is none of this number.
    #[must_use]
    pub fn at(&self, component: usize) -> Option<&Quantity> {
        match self {
            Self::One(one) => Some(one),
            Self::Each(all) => all.get(component),
        }
    }

    /// Where it stands.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            Self::One(one) => one.span(),
            Self::Each(all) => {
                let spans = all.iter().map(Quantity::span);
                spans.reduce(Span::join).unwrap_or_default()
            }
        }
    }
}

impl Entry for Components {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(None, Body::Tuple(items)) if !items.is_empty() => read_all(items, reader).map(Self::Each),
            Kind::List(_) => {
                let hint = "a vector has round brackets: (x, y, z)";
                reader.wrong(node, "a number or a tuple", Some(hint))
            }
            Kind::Number(..) | Kind::Text(_) => Quantity::read(node, reader).map(Self::One),
            _ => reader.wrong(node, "a number, text such as \"5 mm\", or a tuple", None),
        }
    }

    fn write(&self) -> Option<Node> {
        match self {
            Self::One(one) => one.write(),
            Self::Each(all) => {
                let items = all.iter().filter_map(Entry::write).collect();
                Some(group(None, Body::Tuple(items)))
            }
        }
    }
}

/// Entries by name, in the order of the file. No name stands twice in one that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Map<V>(pub Vec<(Text, V)>);

impl<V> Default for Map<V> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<V> Map<V> {
    /// The value of a name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&V> {
        self.entry(name).map(|(_, value)| value)
    }

    /// The name as it stands in the file, and its value.
    #[must_use]
    pub fn entry(&self, name: &str) -> Option<(&Text, &V)> {
        self.iter().find(|(key, _)| key.value == name)
    }

    /// The entries in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&Text, &V)> {
        self.0.iter().map(|(key, value)| (key, value))
    }

    /// The names in order.
    pub fn keys(&self) -> impl ExactSizeIterator<Item = &Text> {
        self.0.iter().map(|(key, _)| key)
    }

    /// The values in order.
    pub fn values(&self) -> impl ExactSizeIterator<Item = &V> {
        self.0.iter().map(|(_, value)| value)
    }

    /// How many entries there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<V: Entry> Entry for Map<V> {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        let Kind::Map(pairs) = &node.kind else {
            let hint = "maps are written {\"name\": value}";
            return reader.wrong(node, "a map", Some(hint));
        };
        let mut first = std::collections::BTreeMap::new();
        let mut entries = Vec::with_capacity(pairs.len());
        let mut right = true;
        for (key, value) in pairs {
            let key = Text::read(key, reader);
            let value = V::read(value, reader);
            if let Some(key) = &key {
                let known = first.entry(key.value.clone()).or_insert(key.span);
                if *known != key.span {
                    reader.twice("the name", &key.value, *known, key.span);
                    right = false;
                }
            }
            match key.zip(value) {
                Some(entry) => entries.push(entry),
                None => right = false,
            }
        }
        right.then_some(Self(entries))
    }

    fn write(&self) -> Option<Node> {
        let pair = |(key, value): &(Text, V)| Some((key.write()?, value.write()?));
        let pairs: Vec<_> = self.0.iter().filter_map(pair).collect();
        Some(unplaced(Kind::Map(pairs)))
    }

    fn absent() -> Option<Self> {
        Some(Self::default())
    }

    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}
