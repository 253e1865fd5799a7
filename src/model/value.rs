//! A parameter's value: constant, free or held.

use super::leaf::{Components, Quantity};
use super::read::{Entry, Fields, Reader, Written, group};
use super::tree::{Body, Kind, Node};
use crate::diag::Span;

/// The value of a parameter. `Q` is [`Quantity`] for a number and [`Components`] for what has several.
#[derive(Clone, Debug, PartialEq)]
pub enum Value<Q> {
    /// A constant, or an expression of other parameters.
    Constant(Q),
    /// Free, starting at its nominal value.
    Free(Setting<Q>),
    /// Free in principle, held at its value.
    Held(Setting<Q>),
}

impl<Q: Default> Default for Value<Q> {
    fn default() -> Self {
        Self::Constant(Q::default())
    }
}

impl<Q> Value<Q> {
    /// The setting of a free or held value.
    #[must_use]
    pub fn setting(&self) -> Option<&Setting<Q>> {
        match self {
            Self::Constant(_) => None,
            Self::Free(setting) | Self::Held(setting) => Some(setting),
        }
    }

    /// The constant or the nominal value.
    #[must_use]
    pub fn nominal(&self) -> &Q {
        match self {
            Self::Constant(value) => value,
            Self::Free(setting) | Self::Held(setting) => &setting.nominal,
        }
    }
}

impl Value<Quantity> {
    /// Where it stands, `Free(…)` included.
    #[must_use]
    pub fn span(&self) -> Span {
        self.setting().map_or_else(|| self.nominal().span(), |setting| setting.span)
    }
}

impl Value<Components> {
    /// Where it stands, `Free(…)` included.
    #[must_use]
    pub fn span(&self) -> Span {
        self.setting().map_or_else(|| self.nominal().span(), |setting| setting.span)
    }
}

/// What `Free(…)` and `Held(…)` say. Equality leaves the place out.
#[derive(Clone, Debug, Default)]
pub struct Setting<Q> {
    /// Where to start, and the centre of the prior.
    pub nominal: Q,
    /// The lower bound.
    pub min: Option<Q>,
    /// The upper bound.
    pub max: Option<Q>,
    /// The standard deviation of a Gaussian prior.
    pub sigma: Option<Q>,
    /// What counts as known well enough.
    pub tolerance: Option<Q>,
    /// Where it stands, `Free(…)` included.
    pub span: Span,
}

impl<Q: PartialEq> PartialEq for Setting<Q> {
    fn eq(&self, other: &Self) -> bool {
        self.nominal == other.nominal
            && self.min == other.min
            && self.max == other.max
            && self.sigma == other.sigma
            && self.tolerance == other.tolerance
    }
}

/// What stands behind `Free` or `Held`.
fn read_setting<Q: Entry>(body: &Body, node: &Node, reader: &mut Reader) -> Option<Setting<Q>> {
    const HINT: &str = "write `Free(0)`, `Free((0, 0, 100))` or `Free(nominal: 0, min: …, max: …)`";
    let span = node.span;
    match body {
        Body::Tuple(items) => match &items[..] {
            [item] => Some(Setting {
                nominal: Q::read(item, reader)?,
                min: None,
                max: None,
                sigma: None,
                tolerance: None,
                span,
            }),
            _ => reader.wrong(node, "one nominal value", Some(HINT)),
        },
        Body::Bare => reader.wrong(node, "a nominal value", Some(HINT)),
        Body::Fields(_) => {
            let mut fields = Fields::between(body, node, "a free or held value", reader)?;
            let nominal = fields.take("nominal", reader);
            let min = fields.take("min", reader);
            let max = fields.take("max", reader);
            let sigma = fields.take("sigma", reader);
            let tolerance = fields.take("tolerance", reader);
            fields.close(reader);
            Some(Setting { nominal: nominal?, min: min?, max: max?, sigma: sigma?, tolerance: tolerance?, span })
        }
    }
}

fn write_setting<Q: Entry>(setting: &Setting<Q>, name: &str) -> Option<Node> {
    let fields = Written::default()
        .put("nominal", &setting.nominal)
        .put("min", &setting.min)
        .put("max", &setting.max)
        .put("sigma", &setting.sigma)
        .put("tolerance", &setting.tolerance);
    if fields.0.len() > 1 {
        return Some(fields.node(Some(name)));
    }
    let nominal = setting.nominal.write()?;
    Some(group(Some(name), Body::Tuple(vec![nominal])))
}

impl<Q: Entry> Entry for Value<Q> {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(Some(word), body) => match word.name.as_str() {
                "Free" => read_setting(body, node, reader).map(Self::Free),
                "Held" => read_setting(body, node, reader).map(Self::Held),
                _ => reader.unknown_word(word, "value", &["Free", "Held"]),
            },
            _ => Q::read(node, reader).map(Self::Constant),
        }
    }

    fn write(&self) -> Option<Node> {
        match self {
            Self::Constant(value) => value.write(),
            Self::Free(setting) => write_setting(setting, "Free"),
            Self::Held(setting) => write_setting(setting, "Held"),
        }
    }
}
