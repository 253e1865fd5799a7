//! Reading nodes into the types of the model, and writing these as nodes again. Mistakes are collected, not returned.

use std::sync::Arc;

use super::text::Text;
use super::tree::{Body, Kind, Node, Word};
use crate::diag::{Code, Diagnostic, Diagnostics, Source, Span, did_you_mean, nearest};

/// A type that stands somewhere in a model file.
pub(crate) trait Entry: Sized {
    /// Reads a node. `None` means that what is wrong with it has been reported.
    fn read(node: &Node, reader: &mut Reader) -> Option<Self>;

    /// The node to be printed, or `None` where nothing need stand.
    fn write(&self) -> Option<Node>;

    /// The value where nothing stands, or `None` where something must.
    fn absent() -> Option<Self> {
        None
    }

    /// Whether it is the value that stands for nothing, and so is not written as a field.
    fn is_absent(&self) -> bool {
        false
    }
}

/// Collects what is wrong while a text is read.
#[derive(Debug)]
pub(crate) struct Reader {
    source: Arc<Source>,
    pub(crate) found: Diagnostics,
}

impl Reader {
    pub(crate) fn new(source: &Arc<Source>) -> Self {
        Self { source: Arc::clone(source), found: Diagnostics::new() }
    }

    /// Reports an error at a place.
    pub(crate) fn error(&mut self, code: Code, span: Span, message: impl Into<String>, hint: Option<String>) {
        let error = Diagnostic::error(code, message);
        self.found.push(error.at(&self.source, span).maybe_hint(hint));
    }

    /// Reports that something else was wanted than what stands there. Gives `None`, to be returned.
    pub(crate) fn wrong<T>(&mut self, node: &Node, wanted: &str, hint: Option<&str>) -> Option<T> {
        let message = format!("expected {wanted}, found {}", describe(node));
        self.error(Code::WrongKind, node.span, message, hint.map(str::to_owned));
        None
    }

    /// Reports a name that is not among those that may stand before a bracket.
    pub(crate) fn unknown_word<T>(&mut self, word: &Word, what: &str, legal: &[&str]) -> Option<T> {
        let message = format!("there is no {what} `{}`", word.name);
        let hint = did_you_mean(&word.name, "known", legal);
        self.error(Code::UnknownVariant, word.span, message, hint);
        None
    }

    /// Reports a name that stands twice.
    pub(crate) fn twice(&mut self, what: &str, name: &str, first: Span, again: Span) {
        let error = Diagnostic::error(Code::Duplicate, format!("{what} `{name}` stands twice"))
            .at(&self.source, again)
            .label(&self.source, first, "first here")
            .hint("rename or remove one of the two");
        self.found.push(error);
    }
}

/// What a node is, for a message.
pub(crate) fn describe(node: &Node) -> String {
    match &node.kind {
        Kind::Number(..) => "a number".into(),
        Kind::Text(_) => "text".into(),
        Kind::Bool(value) => format!("`{value}`"),
        Kind::List(_) => "a list".into(),
        Kind::Map(_) => "a map".into(),
        Kind::Group(Some(word), Body::Bare) => format!("`{}`", word.name),
        Kind::Group(Some(word), _) => format!("`{}(…)`", word.name),
        Kind::Group(None, Body::Tuple(items)) if items.is_empty() => "`()`".into(),
        Kind::Group(None, Body::Tuple(_)) => "a tuple".into(),
        Kind::Group(None, _) => "a structure".into(),
        Kind::Other(what) => (*what).into(),
    }
}

/// The fields of one structure while they are taken out one by one.
pub(crate) struct Fields<'n> {
    what: &'static str,
    pub(crate) span: Span,
    given: Vec<(&'n Word, &'n Node)>,
    legal: Vec<&'static str>,
    missing: Vec<&'static str>,
}

impl<'n> Fields<'n> {
    /// The fields of `(…)`; `what` names the structure in messages.
    pub(crate) fn of(node: &'n Node, what: &'static str, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(None, body) => Self::between(body, node, what, reader),
            _ => reader.wrong(node, &format!("{what} as `(field: value, …)`"), None),
        }
    }

    /// The fields of a body whose name has been dealt with.
    pub(crate) fn between(body: &'n Body, node: &Node, what: &'static str, reader: &mut Reader) -> Option<Self> {
        let given: Vec<_> = match body {
            Body::Fields(fields) => fields.iter().map(|(word, value)| (word, value)).collect(),
            Body::Tuple(items) if items.is_empty() => Vec::new(),
            _ => {
                let wanted = format!("{what} with named fields, `field: value`");
                return reader.wrong(node, &wanted, None);
            }
        };
        let mut fields = Self { what, span: node.span, given: Vec::new(), legal: Vec::new(), missing: Vec::new() };
        for (word, value) in given {
            match fields.given.iter().find(|(known, _)| known.name == word.name) {
                Some((first, _)) => reader.twice("field", &word.name, first.span, word.span),
                None => fields.given.push((word, value)),
            }
        }
        Some(fields)
    }

    /// Takes a field out. `None` means that it cannot be had, which has been or will be reported.
    pub(crate) fn take<T: Entry>(&mut self, name: &'static str, reader: &mut Reader) -> Option<T> {
        self.legal.push(name);
        match self.given.iter().position(|(word, _)| word.name == name) {
            Some(at) => T::read(self.given.remove(at).1, reader),
            None => {
                let value = T::absent();
                if value.is_none() {
                    self.missing.push(name);
                }
                value
            }
        }
    }

    /// Reports the fields that nobody took and those that are missing.
    pub(crate) fn close(mut self, reader: &mut Reader) {
        for (word, _) in &self.given {
            let message = format!("{} has no field `{}`", self.what, word.name);
            let hint = did_you_mean(&word.name, "fields", &self.legal);
            reader.error(Code::UnknownField, word.span, message, hint);
            if let Some(meant) = nearest(&word.name, self.missing.iter().copied()) {
                self.missing.retain(|name| *name != meant);
            }
        }
        for name in self.missing {
            let message = format!("{} needs the field `{name}`", self.what);
            let hint = Some(format!("add `{name}: …`"));
            reader.error(Code::MissingField, self.span, message, hint);
        }
    }
}

/// The nodes of fields while a structure is written.
#[derive(Default)]
pub(crate) struct Written(pub(crate) Vec<(Word, Node)>);

impl Written {
    pub(crate) fn put(mut self, name: &str, value: &impl Entry) -> Self {
        if !value.is_absent()
            && let Some(node) = value.write()
        {
            self.0.push((word(name), node));
        }
        self
    }

    /// As `(…)` or `Name(…)`.
    pub(crate) fn node(self, name: Option<&str>) -> Node {
        group(name, Body::Fields(self.0))
    }
}

/// A name to be printed.
pub(crate) fn word(name: &str) -> Word {
    Word { name: name.to_owned(), span: Span::default() }
}

/// A group to be printed.
pub(crate) fn group(name: Option<&str>, body: Body) -> Node {
    unplaced(Kind::Group(name.map(word), body))
}

/// A node to be printed.
pub(crate) fn unplaced(kind: Kind) -> Node {
    let span = Span::default();
    Node { span, kind }
}

/// Declares a structure of the file: each field once, with its documentation. Fields whose type has an absent value are
/// optional. Equality leaves the place out.
macro_rules! record {
    ($(#[$meta:meta])* $what:literal
     pub struct $Name:ident { $($(#[$field_meta:meta])* pub $field:ident: $Type:ty,)* }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default)]
        pub struct $Name {
            $($(#[$field_meta])* pub $field: $Type,)*
            /// Where it stands in the file.
            pub span: $crate::diag::Span,
        }

        impl PartialEq for $Name {
            fn eq(&self, other: &Self) -> bool {
                true $(&& self.$field == other.$field)*
            }
        }

        impl $Name {
            /// What it is called in messages.
            pub(crate) const WHAT: &'static str = $what;

            pub(crate) fn from_fields(
                mut fields: $crate::model::read::Fields<'_>,
                reader: &mut $crate::model::read::Reader,
            ) -> Option<Self> {
                let span = fields.span;
                $(let $field = fields.take(stringify!($field), reader);)*
                fields.close(reader);
                Some(Self { $($field: $field?,)* span })
            }

            pub(crate) fn to_fields(&self) -> $crate::model::read::Written {
                $crate::model::read::Written::default()$(.put(stringify!($field), &self.$field))*
            }
        }
    };
}
pub(crate) use record;

/// Makes records stand in the file as `(field: value, …)`.
macro_rules! plain_records {
    ($($Name:ident),*) => {$(
        impl $crate::model::read::Entry for $Name {
            fn read(
                node: &$crate::model::tree::Node,
                reader: &mut $crate::model::read::Reader,
            ) -> Option<Self> {
                let fields = $crate::model::read::Fields::of(node, Self::WHAT, reader)?;
                Self::from_fields(fields, reader)
            }

            fn write(&self) -> Option<$crate::model::tree::Node> {
                Some(self.to_fields().node(None))
            }
        }
    )*};
}
pub(crate) use plain_records;

/// Like plain records, and may be left out altogether, which is the same as `()`.
macro_rules! optional_records {
    ($($Name:ident),*) => {$(
        impl $crate::model::read::Entry for $Name {
            fn read(
                node: &$crate::model::tree::Node,
                reader: &mut $crate::model::read::Reader,
            ) -> Option<Self> {
                let fields = $crate::model::read::Fields::of(node, Self::WHAT, reader)?;
                Self::from_fields(fields, reader)
            }

            fn write(&self) -> Option<$crate::model::tree::Node> {
                let fields = self.to_fields();
                (!fields.0.is_empty()).then(|| fields.node(None))
            }

            fn absent() -> Option<Self> {
                Some(Self::default())
            }
        }
    )*};
}
pub(crate) use optional_records;

impl Entry for Text {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Text(text) => Some(text.clone()),
            Kind::Number(..) => reader.wrong(node, "text", Some("put it between quotes: \"…\"")),
            _ => reader.wrong(node, "text", None),
        }
    }

    fn write(&self) -> Option<Node> {
        Some(unplaced(Kind::Text(self.clone())))
    }
}

impl Entry for bool {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match node.kind {
            Kind::Bool(value) => Some(value),
            _ => reader.wrong(node, "`true` or `false`", None),
        }
    }

    fn write(&self) -> Option<Node> {
        Some(unplaced(Kind::Bool(*self)))
    }

    fn absent() -> Option<Self> {
        Some(false)
    }

    fn is_absent(&self) -> bool {
        !self
    }
}

impl Entry for u64 {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match node.kind {
            Kind::Number(_, Some(whole)) => Some(whole),
            _ => reader.wrong(node, "a whole number, not negative", None),
        }
    }

    fn write(&self) -> Option<Node> {
        #[allow(clippy::cast_precision_loss, reason = "printed from the whole number")]
        let value = *self as f64;
        Some(unplaced(Kind::Number(value, Some(*self))))
    }
}

impl<T: Entry> Entry for Option<T> {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(Some(word), Body::Bare) if word.name == "None" => Some(None),
            Kind::Group(Some(word), Body::Tuple(items)) if word.name == "Some" => match &items[..] {
                [item] => T::read(item, reader).map(Some),
                _ => reader.wrong(node, "one value", None),
            },
            _ => T::read(node, reader).map(Some),
        }
    }

    fn write(&self) -> Option<Node> {
        self.as_ref().and_then(Entry::write)
    }

    fn absent() -> Option<Self> {
        Some(None)
    }
}

impl<T: Entry> Entry for Vec<T> {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::List(items) => read_all(items, reader),
            Kind::Group(None, Body::Tuple(_)) => {
                reader.wrong(node, "a list", Some("lists have square brackets: [a, b]"))
            }
            _ => reader.wrong(node, "a list", Some("put it between square brackets: […]")),
        }
    }

    fn write(&self) -> Option<Node> {
        let items: Vec<_> = self.iter().filter_map(Entry::write).collect();
        Some(unplaced(Kind::List(items)))
    }

    fn absent() -> Option<Self> {
        Some(Self::new())
    }

    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}

/// Reads every item, so that all mistakes are found, and gives them if all are right.
pub(crate) fn read_all<T: Entry>(items: &[Node], reader: &mut Reader) -> Option<Vec<T>> {
    let read: Vec<_> = items.iter().map(|item| T::read(item, reader)).collect();
    read.into_iter().collect()
}
