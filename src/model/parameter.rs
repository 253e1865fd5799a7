//! Free-standing parameters, as declared.

use super::leaf::{Components, Map, Quantity};
use super::read::{Entry, Fields, Reader, Written, group};
use super::text::Text;
use super::tree::{Body, Kind, Node};
use super::value::{Value, Values};
use crate::diag::{Code, Span};

/// What a parameter is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shape {
    /// A number.
    #[default]
    Scalar,
    /// A vector of three.
    Vec3,
    /// A rotation, given by its rotation vector.
    Rotation,
    /// A translation, then a rotation vector.
    Pose,
}

impl Shape {
    /// Every shape.
    pub const ALL: [Self; 4] = [Self::Scalar, Self::Vec3, Self::Rotation, Self::Pose];

    /// As it stands in the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "Scalar",
            Self::Vec3 => "Vec3",
            Self::Rotation => "Rotation",
            Self::Pose => "Pose",
        }
    }

    /// How many components it has.
    #[must_use]
    pub const fn components(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec3 | Self::Rotation => 3,
            Self::Pose => 6,
        }
    }
}

/// A free-standing parameter, or a family of them with one member per key. Equality leaves the place out.
#[derive(Clone, Debug, Default)]
pub struct Parameter {
    /// What it is.
    pub shape: Shape,
    /// Its value; of a family, that of members not listed.
    pub value: Values,
    /// The unit of bare numbers, and so the dimension.
    pub unit: Option<Text>,
    /// The standard deviation of a Gaussian prior; of a pose, of the translation.
    pub sigma: Option<Components>,
    /// The lower bounds.
    pub min: Option<Components>,
    /// The upper bounds.
    pub max: Option<Components>,
    /// What counts as known well enough; of a pose, for the translation.
    pub tolerance: Option<Components>,
    /// The standard deviation of a pose's rotation.
    pub sigma_angle: Option<Components>,
    /// What counts as known well enough for a pose's rotation.
    pub tolerance_angle: Option<Components>,
    /// Whether there is one member per key.
    pub family: bool,
    /// Members whose value is not that of the rest.
    pub members: Map<Values>,
    /// Where it stands in the file.
    pub span: Span,
}

impl PartialEq for Parameter {
    fn eq(&self, other: &Self) -> bool {
        self.shape == other.shape
            && self.value == other.value
            && self.unit == other.unit
            && self.sigma == other.sigma
            && self.min == other.min
            && self.max == other.max
            && self.tolerance == other.tolerance
            && self.sigma_angle == other.sigma_angle
            && self.tolerance_angle == other.tolerance_angle
            && self.family == other.family
            && self.members == other.members
    }
}

const SHAPES: &[&str] = &["Scalar", "Vec3", "Rotation", "Pose"];

impl Entry for Parameter {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        let Kind::Group(Some(word), body) = &node.kind else {
            return reader.wrong(node, "a parameter such as `Scalar(Free(1))`", None);
        };
        let named = |shape: &Shape| shape.name() == word.name;
        let Some(shape) = Shape::ALL.into_iter().find(named) else {
            return reader.unknown_word(word, "kind of parameter", SHAPES);
        };
        let parameter = match body {
            Body::Tuple(items) if !items.is_empty() => Self::of_value(shape, items, node, reader),
            Body::Bare => reader.wrong(node, "a value", Some("write `Scalar(Free(0))`")),
            _ => Self::of_fields(shape, body, node, reader),
        }?;
        parameter.check(reader).then_some(parameter)
    }

    fn write(&self) -> Option<Node> {
        let fields = Written::default()
            .put("value", &self.value)
            .put("unit", &self.unit)
            .put("sigma", &self.sigma)
            .put("min", &self.min)
            .put("max", &self.max)
            .put("tolerance", &self.tolerance)
            .put("sigma_angle", &self.sigma_angle)
            .put("tolerance_angle", &self.tolerance_angle)
            .put("family", &self.family)
            .put("members", &self.members);
        if fields.0.len() == 1 {
            let value = self.value.write()?;
            return Some(group(Some(self.shape.name()), Body::Tuple(vec![value])));
        }
        Some(fields.node(Some(self.shape.name())))
    }
}

impl Parameter {
    /// `Scalar(Free(1))`
    fn of_value(shape: Shape, items: &[Node], node: &Node, reader: &mut Reader) -> Option<Self> {
        let [item] = items else {
            let hint = format!(
                "a vector has its own brackets, `{0}((x, y, z))`; further fields are named, `{0}(value: …, sigma: …)`",
                shape.name()
            );
            return reader.wrong(node, "one value", Some(&hint));
        };
        Some(Self { shape, value: Values::read(item, reader)?, span: node.span, ..Self::default() })
    }

    /// `Scalar(value: Free(1), sigma: 0.1)`
    fn of_fields(shape: Shape, body: &Body, node: &Node, reader: &mut Reader) -> Option<Self> {
        let mut fields = Fields::between(body, node, shape.name(), reader)?;
        let value = fields.take("value", reader);
        let unit = fields.take("unit", reader);
        let sigma = fields.take("sigma", reader);
        let min = fields.take("min", reader);
        let max = fields.take("max", reader);
        let tolerance = fields.take("tolerance", reader);
        let (sigma_angle, tolerance_angle) = match shape {
            Shape::Pose => (fields.take("sigma_angle", reader), fields.take("tolerance_angle", reader)),
            _ => (Some(None), Some(None)),
        };
        let family = fields.take("family", reader);
        let members = fields.take("members", reader);
        fields.close(reader);
        Some(Self {
            shape,
            value: value?,
            unit: unit?,
            sigma: sigma?,
            min: min?,
            max: max?,
            tolerance: tolerance?,
            sigma_angle: sigma_angle?,
            tolerance_angle: tolerance_angle?,
            family: family?,
            members: members?,
            span: node.span,
        })
    }

    /// Whether tuples have as many components as the parameter; reports those that have not.
    fn check(&self, reader: &mut Reader) -> bool {
        let mut right = true;
        for value in std::iter::once(&self.value).chain(self.members.values()) {
            right &= match value {
                Values::Whole(value) => self.whole_fits(value, reader),
                Values::Each(all) => self.each_fits(all, reader),
            };
        }
        right
            & self.fit(&self.min, Part::Bound, reader)
            & self.fit(&self.max, Part::Bound, reader)
            & self.fit(&self.sigma, Part::Spread, reader)
            & self.fit(&self.tolerance, Part::Spread, reader)
            & self.fit(&self.sigma_angle, Part::Spread, reader)
            & self.fit(&self.tolerance_angle, Part::Spread, reader)
    }

    fn whole_fits(&self, value: &Value<Components>, reader: &mut Reader) -> bool {
        self.fits(value.nominal(), Part::Value, reader)
            & value.setting().is_none_or(|setting| {
                self.fit(&setting.min, Part::Bound, reader)
                    & self.fit(&setting.max, Part::Bound, reader)
                    & self.fit(&setting.sigma, Part::Spread, reader)
                    & self.fit(&setting.tolerance, Part::Spread, reader)
            })
    }

    fn each_fits(&self, all: &[Value<Quantity>], reader: &mut Reader) -> bool {
        let all: Vec<Quantity> = all.iter().map(|value| value.nominal().clone()).collect();
        self.fits(&Components::Each(all), Part::Value, reader)
    }

    fn fit(&self, part: &Option<Components>, what: Part, reader: &mut Reader) -> bool {
        part.as_ref().is_none_or(|part| self.fits(part, what, reader))
    }

    fn fits(&self, part: &Components, what: Part, reader: &mut Reader) -> bool {
        let count = match what {
            // The sigma of a pose is that of its translation, `sigma_angle` that of its rotation.
            Part::Spread => self.shape.components().min(3),
            Part::Value | Part::Bound => self.shape.components(),
        };
        let found = match part {
            Components::One(Quantity::Number(_)) if count > 1 && what == Part::Value => "a number".to_owned(),
            Components::One(_) => return true,
            Components::Each(all) if count > 1 && all.len() == count => return true,
            Components::Each(all) => format!("a tuple of {}", all.len()),
        };
        let wanted = match count {
            1 => "one number".to_owned(),
            _ => format!("a tuple of {count}"),
        };
        let message = format!("expected {wanted} for `{}`, found {found}", self.shape.name());
        reader.error(Code::WrongKind, part.span(), message, None);
        false
    }
}

/// What a tuple stands for.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Value,
    Bound,
    Spread,
}
