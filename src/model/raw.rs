//! What the parser hands over of one level of a text: pieces borrowed from it, so that their address is their place.

use std::fmt;

use ron::value::RawValue;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// The entries of a map in order, twins included.
pub(crate) struct Pairs<'t>(pub(crate) Vec<(&'t RawValue, &'t RawValue)>);

/// What stands between round brackets: values, or names and values.
pub(crate) enum Inside<'t> {
    Tuple(Vec<&'t RawValue>),
    Fields(Vec<(Name<'t>, &'t RawValue)>),
}

/// The name of a field.
pub(crate) struct Name<'t>(pub(crate) &'t str);

/// A text literal: as it stands in the file, or with escapes resolved.
pub(crate) enum Quoted<'t> {
    Plain(&'t str),
    Escaped(String),
}

fn entries<'t, K: Deserialize<'t>, A: MapAccess<'t>>(mut map: A) -> Result<Vec<(K, &'t RawValue)>, A::Error> {
    let mut all = Vec::new();
    while let Some(entry) = map.next_entry()? {
        all.push(entry);
    }
    Ok(all)
}

impl<'t> Deserialize<'t> for Pairs<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect;
        impl<'t> Visitor<'t> for Collect {
            type Value = Pairs<'t>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map")
            }
            fn visit_map<A: MapAccess<'t>>(self, map: A) -> Result<Self::Value, A::Error> {
                entries(map).map(Pairs)
            }
        }
        deserializer.deserialize_map(Collect)
    }
}

impl<'t> Deserialize<'t> for Inside<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collect;
        impl<'t> Visitor<'t> for Collect {
            type Value = Inside<'t>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("values or fields between round brackets")
            }
            fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
                Ok(Inside::Tuple(Vec::new()))
            }
            fn visit_seq<A: SeqAccess<'t>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(item) = seq.next_element()? {
                    all.push(item);
                }
                Ok(Inside::Tuple(all))
            }
            fn visit_map<A: MapAccess<'t>>(self, map: A) -> Result<Self::Value, A::Error> {
                entries(map).map(Inside::Fields)
            }
        }
        deserializer.deserialize_any(Collect)
    }
}

impl<'t> Deserialize<'t> for Name<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        struct Borrow;
        impl<'t> Visitor<'t> for Borrow {
            type Value = Name<'t>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a field")
            }
            fn visit_borrowed_str<E: Error>(self, name: &'t str) -> Result<Self::Value, E> {
                Ok(Name(name))
            }
        }
        deserializer.deserialize_identifier(Borrow)
    }
}

impl<'t> Deserialize<'t> for Quoted<'t> {
    fn deserialize<D: Deserializer<'t>>(deserializer: D) -> Result<Self, D::Error> {
        struct Borrow;
        impl<'t> Visitor<'t> for Borrow {
            type Value = Quoted<'t>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("text between quotes")
            }
            fn visit_borrowed_str<E: Error>(self, text: &'t str) -> Result<Self::Value, E> {
                Ok(Quoted::Plain(text))
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                Ok(Quoted::Escaped(text.to_owned()))
            }
        }
        deserializer.deserialize_str(Borrow)
    }
}
