//! URDF files: their joints, and where in the text their origins stand.

use std::ops::Range;
use std::str::FromStr;
use std::sync::Arc;

use roxmltree::{Document, Node};

use super::motion::{Motion, Vector};
use super::robot::Limits;
use crate::diag::{Code, Diagnostic, Diagnostics, Source, Span};

/// How a joint of a URDF moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UrdfKind {
    /// Not at all.
    Fixed,
    /// It turns.
    Revolute,
    /// It slides.
    Prismatic,
    /// In several ways at once, which a chain has no joint for.
    Several,
}

/// Where a joint's origin stands in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct OriginPlace {
    /// The value of `xyz`.
    pub(super) xyz: Option<Range<usize>>,
    /// The value of `rpy`.
    pub(super) rpy: Option<Range<usize>>,
    /// Where attributes can be added: behind the name of the element, or, where there is none, behind the start of the joint.
    pub(super) insert: usize,
    /// Whether there is an element.
    pub(super) there: bool,
}

/// A joint of a URDF.
#[derive(Clone, Debug)]
pub struct UrdfJoint {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: UrdfKind,
    /// The link that it is on.
    pub parent: String,
    /// The link that it moves.
    pub child: String,
    /// Where it is, in metres.
    pub xyz: Vector<f64>,
    /// How it is turned: roll, pitch, yaw in radians.
    pub rpy: Vector<f64>,
    /// Its axis, of length one.
    pub axis: Vector<f64>,
    /// Between which readings it moves, where it is said and makes sense.
    pub limits: Option<Limits>,
    /// Which other joint it goes along with: its name, the multiplier and the offset.
    pub mimic: Option<(String, f64, f64)>,
    pub(super) place: OriginPlace,
    span: Span,
}

impl UrdfJoint {
    /// Its origin as a motion.
    pub fn origin(&self) -> Motion<f64> {
        Motion::of_origin(self.xyz, self.rpy)
    }

    /// The rotation that takes z to its axis.
    pub fn z_to_axis(&self) -> Motion<f64> {
        Motion::z_to(self.axis)
    }
}

/// A URDF.
#[derive(Clone, Debug)]
pub struct Urdf {
    /// The robot's name.
    pub name: String,
    /// All joints, in the order of the file.
    pub joints: Vec<UrdfJoint>,
    /// All links, in the order of the file.
    pub links: Vec<String>,
    pub(super) source: Arc<Source>,
}

impl Urdf {
    /// Reads one.
    ///
    /// # Errors
    /// All its mistakes, each at its place.
    pub fn read(source: &Arc<Source>) -> Result<Urdf, Diagnostics> {
        let document = Document::parse(source.text()).map_err(|error| {
            let position = error.pos();
            let at = crate::diag::Position { line: position.row as usize, column: position.col as usize };
            let offset = source.offset(at);
            let found = Diagnostic::error(Code::BadUrdf, format!("this is not XML: {error}"));
            Diagnostics::from(found.at(source, Span::new(offset, offset + 1)))
        })?;
        let root = document.root_element();
        let mut reader = Reader { source, found: Diagnostics::new() };
        if !root.has_tag_name("robot") {
            let message = format!("a URDF is a `robot`, and this is a `{}`", root.tag_name().name());
            reader.wrong(message, tag(&root));
            return Err(reader.found);
        }
        // `transmission` and `gazebo` have elements of the same names
        let children = |name: &'static str| root.children().filter(move |node| node.has_tag_name(name));
        let links = children("link").filter_map(|link| reader.attribute(&link, "name")).collect();
        let joints: Vec<UrdfJoint> = children("joint").filter_map(|joint| reader.joint(&joint)).collect();
        for (at, joint) in joints.iter().enumerate() {
            if joints.iter().take(at).any(|before| before.name == joint.name) {
                reader.wrong(format!("the joint `{}` stands twice", joint.name), joint.span);
            }
            if joints.iter().take(at).any(|before| before.child == joint.child) {
                reader.wrong(format!("the link `{}` is the child of two joints", joint.child), joint.span);
            }
        }
        if reader.found.has_errors() {
            return Err(reader.found);
        }
        let name = root.attribute("name").unwrap_or("robot").to_owned();
        Ok(Urdf { name, joints, links, source: Arc::clone(source) })
    }

    /// The joints between two links. By default they are the link that is no joint's child, and the one that is no joint's parent.
    ///
    /// # Errors
    /// Where there are several such links, or no way from one to the other, or a joint on the way that no chain has.
    pub fn path(&self, from: Option<&str>, to: Option<&str>) -> Result<Vec<&UrdfJoint>, Diagnostics> {
        let mut found = Diagnostics::new();
        let named = |name: &str| self.links.iter().find(|link| *link == name);
        for name in [from, to].into_iter().flatten().filter(|name| named(name).is_none()) {
            let names: Vec<&str> = self.links.iter().map(String::as_str).collect();
            let wrong = Diagnostic::error(Code::NotOneChain, format!("there is no link `{name}`"));
            found.push(self.whole(wrong).maybe_hint(crate::diag::did_you_mean(name, "links", &names)));
        }
        if found.has_errors() {
            return Err(found);
        }
        let has_child = |link: &String| self.joints.iter().any(|joint| joint.parent == *link);
        let tip = match to {
            Some(to) => to.to_owned(),
            None => self.only_end(self.links.iter().filter(|link| !has_child(link)))?,
        };
        let mut path = Vec::new();
        let mut link = tip.clone();
        while from != Some(link.as_str()) {
            let Some(joint) = self.joints.iter().find(|joint| joint.child == link) else { break };
            path.push(joint);
            link.clone_from(&joint.parent);
            if path.len() > self.joints.len() {
                let wrong =
                    Diagnostic::error(Code::NotOneChain, format!("the joints at `{link}` go round in a circle"));
                return Err(self.whole(wrong).into());
            }
        }
        if let Some(from) = from.filter(|from| *from != link) {
            let message = format!("no joints lead from `{from}` to `{tip}`");
            return Err(self.whole(Diagnostic::error(Code::NotOneChain, message)).into());
        }
        path.reverse();
        for joint in path.iter().filter(|joint| joint.kind == UrdfKind::Several) {
            let message =
                format!("the joint `{}` moves in several ways at once, which no joint of a chain does", joint.name);
            let hint = "begin or end the chain beside it: `--from LINK`, `--to LINK`";
            found.push(Diagnostic::error(Code::UnsupportedJoint, message).at(&self.source, joint.span).hint(hint));
        }
        let moves = |joint: &&UrdfJoint| matches!(joint.kind, UrdfKind::Revolute | UrdfKind::Prismatic);
        if !found.has_errors() && !path.iter().any(moves) {
            let message = format!("no joint moves between `{link}` and `{tip}`");
            found.push(self.whole(Diagnostic::error(Code::NothingMoves, message)));
        }
        if found.has_errors() { Err(found) } else { Ok(path) }
    }

    fn whole(&self, wrong: Diagnostic) -> Diagnostic {
        wrong.at_data(crate::diag::DataPlace::file(self.source.name()))
    }

    fn only_end<'a>(&self, links: impl Iterator<Item = &'a String>) -> Result<String, Diagnostics> {
        let links: Vec<&str> = links.map(String::as_str).collect();
        match links[..] {
            [one] => Ok(one.to_owned()),
            _ => {
                let message = format!("the robot has {} links at an end: {}", links.len(), links.join(", "));
                let first = links.first().unwrap_or(&"LINK");
                let hint = format!("say which is meant: `--to {first}`, of an export `--tip {first}`");
                Err(self.whole(Diagnostic::error(Code::NotOneChain, message).hint(hint)).into())
            }
        }
    }
}

/// The tag that opens an element.
fn tag(node: &Node) -> Span {
    let start = node.range().start;
    let end = node.first_child().map_or(node.range().end, |child| child.range().start);
    Span::new(start, end.max(start))
}

struct Reader<'s> {
    source: &'s Arc<Source>,
    found: Diagnostics,
}

impl Reader<'_> {
    fn wrong(&mut self, message: impl Into<String>, span: Span) {
        self.found.push(Diagnostic::error(Code::BadUrdf, message).at(self.source, span));
    }

    fn attribute(&mut self, node: &Node, name: &str) -> Option<String> {
        let value = node.attribute(name).map(str::to_owned);
        if value.is_none() {
            self.wrong(format!("`{}` has no `{name}`", node.tag_name().name()), tag(node));
        }
        value
    }

    /// A number of an attribute, where it is there.
    fn number(&mut self, node: &Node, name: &str) -> Option<f64> {
        let attribute = node.attribute_node(name)?;
        let value = f64::from_str(attribute.value().trim()).ok().filter(|value| value.is_finite());
        if value.is_none() {
            let span = attribute.range_value();
            self.wrong(
                format!("`{name}` is a number, and this is `{}`", attribute.value()),
                Span::new(span.start, span.end),
            );
        }
        value
    }

    /// Three numbers of an attribute, or else the default.
    fn three(&mut self, node: Option<&Node>, name: &str, default: Vector<f64>) -> Vector<f64> {
        let Some(attribute) = node.and_then(|node| node.attribute_node(name)) else { return default };
        let numbers: Vec<f64> = attribute.value().split_whitespace().map_while(|word| word.parse().ok()).collect();
        let words = attribute.value().split_whitespace().count();
        match numbers[..] {
            [x, y, z] if words == 3 && [x, y, z].iter().all(|x| x.is_finite()) => [x, y, z],
            _ => {
                let span = attribute.range_value();
                let message = format!("`{name}` has three numbers, and this is `{}`", attribute.value());
                self.wrong(message, Span::new(span.start, span.end));
                default
            }
        }
    }

    fn joint(&mut self, node: &Node) -> Option<UrdfJoint> {
        let child = |name: &'static str| node.children().find(|child| child.has_tag_name(name));
        let span = tag(node);
        let name = self.attribute(node, "name");
        let kind = match self.attribute(node, "type").as_deref() {
            Some("fixed") => Some(UrdfKind::Fixed),
            Some("revolute" | "continuous") => Some(UrdfKind::Revolute),
            Some("prismatic") => Some(UrdfKind::Prismatic),
            Some("planar" | "floating") => Some(UrdfKind::Several),
            Some(other) => {
                self.wrong(format!("there is no joint of type `{other}`"), span);
                None
            }
            None => None,
        };
        let continuous = node.attribute("type") == Some("continuous");
        let mut link = |name: &'static str| match child(name) {
            Some(element) => self.attribute(&element, "link"),
            None => {
                self.wrong(format!("the joint has no `{name}`"), span);
                None
            }
        };
        let (parent, moved) = (link("parent"), link("child"));
        let origin = child("origin");
        let xyz = self.three(origin.as_ref(), "xyz", [0.0; 3]);
        let rpy = self.three(origin.as_ref(), "rpy", [0.0; 3]);
        let axis = self.three(child("axis").as_ref(), "xyz", [1.0, 0.0, 0.0]);
        let length = axis[0].hypot(axis[1]).hypot(axis[2]);
        if length == 0.0 && kind != Some(UrdfKind::Fixed) {
            self.wrong("the axis has no direction", span);
        }
        let limits = child("limit").and_then(|limit| {
            let (min, max) = (self.number(&limit, "lower"), self.number(&limit, "upper"));
            Some(Limits { min: min.unwrap_or(0.0), max: max? }).filter(Limits::are_useful)
        });
        let mimic = child("mimic").and_then(|mimic| {
            let multiplier = self.number(&mimic, "multiplier").unwrap_or(1.0);
            let offset = self.number(&mimic, "offset").unwrap_or(0.0);
            self.attribute(&mimic, "joint").map(|joint| (joint, multiplier, offset))
        });
        // behind `<origin` or behind the joint's own tag
        let place = match &origin {
            Some(element) => OriginPlace {
                xyz: element.attribute_node("xyz").map(|attribute| attribute.range_value()),
                rpy: element.attribute_node("rpy").map(|attribute| attribute.range_value()),
                insert: element.range().start + "<origin".len(),
                there: true,
            },
            None => {
                let insert = node.first_child().map_or(node.range().start, |child| child.range().start);
                OriginPlace { xyz: None, rpy: None, insert, there: false }
            }
        };
        Some(UrdfJoint {
            name: name?,
            kind: kind?,
            parent: parent?,
            child: moved?,
            xyz,
            rpy,
            axis: axis.map(|x| if length > 0.0 && length != 1.0 { x / length } else { x }),
            limits: limits.filter(|_| !continuous),
            mimic,
            place,
            span,
        })
    }
}
