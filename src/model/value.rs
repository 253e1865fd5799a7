//! A parameter's value: constant, free or held; of several components together, or each by itself.

use super::leaf::{Components, Quantity};
use super::read::{Entry, Fields, Reader, Written, group, read_all};
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

/// The value of a free-standing parameter, all of which is constant, free or held, or each component by itself.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "a model has few of them")]
pub enum Values {
    /// `Free((0, 0, 100))`
    Whole(Value<Components>),
    /// `(Held(0), Held(0), Free(100))`, in which at least one stands in `Free(…)` or `Held(…)`
    Each(Vec<Value<Quantity>>),
}

impl Default for Values {
    fn default() -> Self {
        Self::Whole(Value::default())
    }
}

/// What is said of one component: its value and, where it is free or held, the rest.
#[derive(Clone, Copy, Debug)]
pub struct Component<'a> {
    /// Whether it is estimated.
    pub free: bool,
    /// Where to start, and the centre of the prior.
    pub nominal: &'a Quantity,
    /// The lower bound.
    pub min: Option<&'a Quantity>,
    /// The upper bound.
    pub max: Option<&'a Quantity>,
    /// The standard deviation of a Gaussian prior.
    pub sigma: Option<&'a Quantity>,
    /// What counts as known well enough.
    pub tolerance: Option<&'a Quantity>,
}

impl Values {
    /// What is said of component `k`; none where it has none of this number. Of a pose that is free or held as a whole, sigma and
    /// tolerance speak of the translation, components 0 to 2.
    #[must_use]
    pub fn component(&self, k: usize) -> Option<Component<'_>> {
        fn of_whole(part: &Option<Components>, k: usize) -> Option<&Quantity> {
            part.as_ref().and_then(|part| part.at(k))
        }
        Some(match self {
            Self::Whole(value) => {
                let setting = value.setting();
                let spread = setting.filter(|_| k < 3);
                Component {
                    free: matches!(value, Value::Free(_)),
                    nominal: value.nominal().at(k)?,
                    min: setting.and_then(|s| of_whole(&s.min, k)),
                    max: setting.and_then(|s| of_whole(&s.max, k)),
                    sigma: spread.and_then(|s| of_whole(&s.sigma, k)),
                    tolerance: spread.and_then(|s| of_whole(&s.tolerance, k)),
                }
            }
            Self::Each(all) => {
                let value = all.get(k)?;
                let setting = value.setting();
                Component {
                    free: matches!(value, Value::Free(_)),
                    nominal: value.nominal(),
                    min: setting.and_then(|s| s.min.as_ref()),
                    max: setting.and_then(|s| s.max.as_ref()),
                    sigma: setting.and_then(|s| s.sigma.as_ref()),
                    tolerance: setting.and_then(|s| s.tolerance.as_ref()),
                }
            }
        })
    }
}

impl Entry for Values {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        let wrapped = |item: &Node| matches!(item.kind, Kind::Group(Some(_), _));
        match &node.kind {
            Kind::Group(None, Body::Tuple(items)) if items.iter().any(wrapped) => {
                read_all(items, reader).map(Self::Each)
            }
            _ => Value::read(node, reader).map(Self::Whole),
        }
    }

    fn write(&self) -> Option<Node> {
        match self {
            Self::Whole(value) => value.write(),
            Self::Each(all) => Some(group(None, Body::Tuple(all.iter().filter_map(Entry::write).collect()))),
        }
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
