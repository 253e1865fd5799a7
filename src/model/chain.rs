//! Chains of joints, as declared.

use super::leaf::Quantity;
use super::read::{Entry, Fields, Reader, record};
use super::text::Text;
use super::tree::{Body, Kind, Node};
use super::value::Value;
use crate::diag::Span;

record! {
    /// A φ-model joint, *T(φ + θ, d) · T(a, b, α, β)*. What is absent is zero.
    "a joint"
    pub struct PhiJoint {
        /// Its name, unique in the file.
        pub name: Text,
        /// The turn about z, φ.
        pub phi: Option<Value<Quantity>>,
        /// The slide along z.
        pub d: Option<Value<Quantity>>,
        /// The slide along the z of the φ-frame.
        pub a: Option<Value<Quantity>>,
        /// The slide along the new x.
        pub b: Option<Value<Quantity>>,
        /// The turn about the new x, α.
        pub alpha: Option<Value<Quantity>>,
        /// The turn about the z of the φ-frame, β.
        pub beta: Option<Value<Quantity>>,
    }
}

record! {
    /// A constant pose: a translation, then *Rx(rx)·Ry(ry)·Rz(rz)*; or a declared pose or rotation. What is absent is zero.
    "`Rigid`"
    pub struct Rigid {
        /// Its name, unique in the file.
        pub name: Text,
        /// The translation along x.
        pub x: Option<Value<Quantity>>,
        /// The translation along y.
        pub y: Option<Value<Quantity>>,
        /// The translation along z.
        pub z: Option<Value<Quantity>>,
        /// The turn about x.
        pub rx: Option<Value<Quantity>>,
        /// The turn about y.
        pub ry: Option<Value<Quantity>>,
        /// The turn about z.
        pub rz: Option<Value<Quantity>>,
        /// The name of a declared pose or rotation, instead of the six.
        pub pose: Option<Text>,
    }
}

record! {
    /// A row of a Denavit–Hartenberg table. What is absent is zero.
    "a Denavit–Hartenberg row"
    pub struct DhRow {
        /// Its name, unique in the file.
        pub name: Text,
        /// The turn about z, θ.
        pub theta: Option<Value<Quantity>>,
        /// The slide along z.
        pub d: Option<Value<Quantity>>,
        /// The slide along x.
        pub a: Option<Value<Quantity>>,
        /// The turn about x, α.
        pub alpha: Option<Value<Quantity>>,
        /// Hayati's turn about y, β.
        pub beta: Option<Value<Quantity>>,
        /// What the reading is added to.
        pub reads: Reads,
    }
}

/// What the reading of a Denavit–Hartenberg row is added to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reads {
    /// To θ.
    #[default]
    Angle,
    /// To d.
    Length,
    /// There is no reading.
    Nothing,
}

impl Entry for Reads {
    fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
        match &node.kind {
            Kind::Group(Some(word), Body::Bare) => match word.name.as_str() {
                "Angle" => Some(Self::Angle),
                "Length" => Some(Self::Length),
                "Nothing" => Some(Self::Nothing),
                _ => reader.unknown_word(word, "reading", &["Angle", "Length", "Nothing"]),
            },
            _ => reader.wrong(node, "`Angle`, `Length` or `Nothing`", None),
        }
    }

    fn write(&self) -> Option<Node> {
        let name = match self {
            Self::Angle => return None,
            Self::Length => "Length",
            Self::Nothing => "Nothing",
        };
        Some(super::read::group(Some(name), Body::Bare))
    }

    fn absent() -> Option<Self> {
        Some(Self::default())
    }
}

macro_rules! joints {
    ($($(#[$meta:meta])* $Variant:ident($Record:ident),)*) => {
        /// A joint of a chain.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Joint {
            $($(#[$meta])* $Variant($Record),)*
        }

        impl Joint {
            /// The names of all joints.
            pub const KINDS: &[&str] = &[$(stringify!($Variant)),*];

            /// Its name.
            #[must_use]
            pub fn name(&self) -> &Text {
                match self { $(Self::$Variant(joint) => &joint.name,)* }
            }

            /// Where it stands in the file.
            #[must_use]
            pub fn span(&self) -> Span {
                match self { $(Self::$Variant(joint) => joint.span,)* }
            }
        }

        impl Entry for Joint {
            fn read(node: &Node, reader: &mut Reader) -> Option<Self> {
                let Kind::Group(Some(word), body) = &node.kind else {
                    return reader.wrong(node, "a joint such as `Revolute(name: …)`", None);
                };
                match word.name.as_str() {
                    $(stringify!($Variant) => {
                        let fields = Fields::between(body, node, $Record::WHAT, reader)?;
                        $Record::from_fields(fields, reader).map(Self::$Variant)
                    })*
                    _ => reader.unknown_word(word, "joint", Self::KINDS),
                }
            }

            fn write(&self) -> Option<Node> {
                match self {
                    $(Self::$Variant(joint) => {
                        Some(joint.to_fields().node(Some(stringify!($Variant))))
                    })*
                }
            }
        }
    };
}

joints! {
    /// Reads an angle, added to φ.
    Revolute(PhiJoint),
    /// Reads a length, added to d.
    Prismatic(PhiJoint),
    /// Reads nothing.
    Fixed(PhiJoint),
    /// A constant pose.
    Rigid(Rigid),
    /// *Rot_z(θ)·Trans_z(d)·Trans_x(a)·Rot_x(α)·Rot_y(β)*, as Denavit and Hartenberg have it.
    Dh(DhRow),
    /// *Trans_x(a)·Rot_x(α)·Rot_y(β)·Rot_z(θ)·Trans_z(d)*, as Craig has it.
    ModifiedDh(DhRow),
}
