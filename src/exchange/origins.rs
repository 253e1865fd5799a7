//! A serial chain put back into a URDF: new origins of its joints, the text otherwise as it is.
//!
//! A chain states its axes and nothing between them: the zero of a reading about an axis, and where along the axis a link's frame sits, are
//! the URDF's own. Every link's frame is therefore left where the original has it, seen from the link before, in all that the chain does not
//! say: it keeps its turn about its own axis and its place along it (a sliding joint's, its whole place). What is over then goes to the next
//! origin, and what is over at last to the first fixed joint behind the last that moves. Fixed joints in between, axes, limits, and all that
//! hangs on a link stay as they are. Where the last joint itself moves the end, its own origin takes the turn and the slide.

use super::motion::{Motion, Real, Screw, Vector, angle};
use super::number::number_text;
use super::robot::{Limits, Reading, Robot};
use super::serial::{Kind, Serial};
use super::urdf::{Urdf, UrdfJoint, UrdfKind};
use crate::diag::{Code, DataPlace, Diagnostic};

/// The new origin of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin<D> {
    /// The joint.
    pub name: String,
    /// x, y, z in metres; roll, pitch, yaw in radians.
    pub numbers: [D; 6],
}

/// What the numbers of an origin are called.
pub const ORIGIN_SYMBOLS: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

/// Numbers nearer than this to the old ones are the old ones.
const SAME: f64 = 2e-15;

fn kind_of(joint: &UrdfJoint) -> Option<Kind> {
    match joint.kind {
        UrdfKind::Revolute => Some(Kind::Revolute),
        UrdfKind::Prismatic => Some(Kind::Prismatic),
        UrdfKind::Fixed | UrdfKind::Several => None,
    }
}

/// The robot between two links of a URDF.
pub fn robot_of(urdf: &Urdf, path: &[&UrdfJoint]) -> Robot {
    let mut serial = Serial::default();
    let mut readings = Vec::new();
    for joint in path {
        serial.push(&joint.origin());
        let Some(kind) = kind_of(joint) else { continue };
        let to_axis = joint.z_to_axis();
        serial.push(&to_axis);
        serial.joint(&joint.name, kind);
        serial.push(&to_axis.inverse());
        readings.push(reading(urdf, joint, kind));
    }
    let ends = path.first().zip(path.last());
    let ends = ends.map_or(String::new(), |(first, last)| format!(", from `{}` to `{}`", first.parent, last.child));
    Robot {
        name: urdf.name.clone(),
        source: format!("URDF{ends}; lengths in m, angles in rad"),
        serial,
        readings,
        length: "m".into(),
        angle: "rad".into(),
    }
}

fn reading(urdf: &Urdf, joint: &UrdfJoint, kind: Kind) -> Reading {
    let of = |known: &UrdfJoint, kind: Kind, multiplier: f64, offset: f64| {
        let whole = if kind == Kind::Revolute { std::f64::consts::PI } else { 0.0 };
        let limits = known.limits.unwrap_or(Limits { min: -whole, max: whole });
        Reading { of: known.name.clone(), kind, limits, multiplier, offset }
    };
    let mimicked = joint.mimic.as_ref().and_then(|(name, multiplier, offset)| {
        let known = urdf.joints.iter().find(|known| known.name == *name)?;
        Some(of(known, kind_of(known)?, *multiplier, *offset))
    });
    mimicked.unwrap_or_else(|| of(joint, kind, 1.0, 0.0))
}

/// New origins for the joints of a path, so that the URDF has the chain's poses.
///
/// # Errors
/// Where the chain has other joints than the path, or the end has no origin that could take what is over.
pub fn origins<D: Real>(
    serial: &Serial<D>,
    path: &[&UrdfJoint],
    reach: f64,
    file: &str,
) -> Result<Vec<Origin<D>>, Box<Diagnostic>> {
    let moving: Vec<Kind> = path.iter().filter_map(|joint| kind_of(joint)).collect();
    if moving != serial.joints.iter().map(|joint| joint.kind).collect::<Vec<_>>() {
        let words = |kinds: &[Kind]| {
            kinds.iter().map(|kind| if *kind == Kind::Revolute { 'R' } else { 'P' }).collect::<String>()
        };
        let own: Vec<Kind> = serial.joints.iter().map(|joint| joint.kind).collect();
        let message = format!("the chain's joints are {}, and those of the URDF {}", words(&own), words(&moving));
        let found = Diagnostic::error(Code::OtherRobot, message).at_data(DataPlace::file(file));
        return Err(Box::new(found.hint("say which links the chain goes between: `--base LINK --tip LINK`")));
    }
    let behind = path.iter().rev().take_while(|joint| kind_of(joint).is_none()).count();
    let last = path.len() - behind;
    let mut found = Vec::new();
    // what moves the frame of the last axis from where the chain has it to where the URDF will
    let mut carried = Motion::none();
    let mut before = Motion::<f64>::none();
    let mut constants = serial.constants.iter();
    let mut count = 0;
    for joint in path.iter().take(last) {
        let Some(kind) = kind_of(joint) else {
            before = before.then(&joint.origin());
            continue;
        };
        count += 1;
        let part = carried.then(constants.next().unwrap_or(&Motion::none()));
        let to_axis = joint.z_to_axis();
        let nominal = before.then(&joint.origin()).then(&to_axis);
        let left = match (behind == 0 && count == moving.len()).then(|| constants.next()).flatten() {
            // the end is the last joint's own: it has to be met
            Some(end) => end_met(&end.then(&to_axis.constant()), kind, reach, &joint.child, file)?,
            None => difference(&nominal.inverse().constant().then(&part), kind),
        };
        let new = before.inverse().constant().then(&part).then(&left.inverse()).then(&to_axis.inverse().constant());
        found.push(origin_of(joint, &new));
        carried = left;
        before = to_axis.inverse();
    }
    if let Some((first, rest)) = path.get(last..).and_then(<[_]>::split_first) {
        let part = carried.then(constants.next().unwrap_or(&Motion::none()));
        let rest = rest.iter().fold(Motion::<f64>::none(), |all, joint| all.then(&joint.origin()));
        let new = before.inverse().constant().then(&part).then(&rest.inverse().constant());
        found.push(origin_of(first, &new));
    }
    Ok(found)
}

/// What of a change of an axis' frame the axis does not show.
fn difference<D: Real>(change: &Motion<D>, kind: Kind) -> Motion<D> {
    let r = &change.rotation;
    // the turn about z nearest to the whole: z, of its quaternion
    let turn = angle(r[1][0] - r[0][1], r[0][0] + r[1][1]);
    match kind {
        Kind::Revolute => Motion::about_z(Screw { turn, slide: change.origin[2] / r[2][2] }),
        Kind::Prismatic => {
            let back = change.inverse();
            let turned = Motion::turn(2, -turn);
            Motion { origin: back.origin, ..turned }.inverse()
        }
    }
}

/// The screw about the last axis by which its frame becomes the end.
fn end_met<D: Real>(
    end: &Motion<D>,
    kind: Kind,
    reach: f64,
    link: &str,
    file: &str,
) -> Result<Motion<D>, Box<Diagnostic>> {
    let tilt = end.rotation[0][2].re().hypot(end.rotation[1][2].re());
    let aside = end.origin[0].re().hypot(end.origin[1].re());
    if tilt > 1e-12 || (kind == Kind::Revolute && aside > 1e-12 * reach) {
        let message =
            format!("the link `{link}` is moved by the last joint itself, so no origin can hold where the chain ends");
        let found = Diagnostic::error(Code::OtherRobot, message).at_data(DataPlace::file(file));
        return Err(Box::new(found.hint("end the chain at the last axis, or add a link behind a fixed joint")));
    }
    Ok(end.inverse())
}

fn origin_of<D: Real>(joint: &UrdfJoint, new: &Motion<D>) -> Origin<D> {
    let [roll, pitch, yaw] = new.roll_pitch_yaw();
    let [x, y, z] = new.origin;
    Origin { name: joint.name.clone(), numbers: [x, y, z, roll, pitch, yaw] }
}

/// The text of a URDF with new origins. What is the same but for rounding stays as it is written.
pub fn with_origins(urdf: &Urdf, origins: &[Origin<f64>], reach: f64) -> String {
    let mut edits: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    for origin in origins {
        let Some(joint) = urdf.joints.iter().find(|joint| joint.name == origin.name) else { continue };
        let [x, y, z, roll, pitch, yaw] = origin.numbers;
        let (xyz, rpy) = ([x, y, z], [roll, pitch, yaw]);
        let moved = joint.xyz.iter().zip(&xyz).any(|(old, new)| (old - new).abs() > SAME * reach);
        let turned = joint.origin().apart(&Motion::of_origin(joint.xyz, rpy)) > SAME;
        let words = |three: Vector<f64>, scale: f64| three.map(|x| number_text(x, scale)).join(" ");
        let place = &joint.place;
        let mut added = String::new();
        for (changed, range, name, text) in
            [(moved, &place.xyz, "xyz", words(xyz, reach)), (turned, &place.rpy, "rpy", words(rpy, 1.0))]
        {
            match range {
                _ if !changed => {}
                Some(range) => edits.push((range.clone(), text)),
                None => added.push_str(&format!(" {name}=\"{text}\"")),
            }
        }
        if !added.is_empty() {
            let text = if place.there { added } else { format!("\n    <origin{added}/>") };
            edits.push((place.insert..place.insert, text));
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    let text = urdf.source.text();
    let (mut all, mut at) = (String::with_capacity(text.len()), 0);
    for (range, new) in edits {
        all.push_str(text.get(at..range.start).unwrap_or_default());
        all.push_str(&new);
        at = range.end;
    }
    all.push_str(text.get(at..).unwrap_or_default());
    all
}
