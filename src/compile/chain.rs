//! Chains of joints as frames.

use super::declarations::{Declarations, Symbol};
use super::program::{Parameter, Shape};
use super::quantity::Quantities;
use super::scope::Scope;
use super::snippet::Snippet;
use crate::diag::Diagnostics;
use crate::graph::{Axis, Frame, Graph, Scalar};
use crate::model::{self, DhRow, PhiJoint, Quantity, Reads, Rigid, Value};
use crate::unit::Dimension;

/// A chain: its joints from the base on.
#[derive(Clone, Debug)]
pub(crate) struct Chain {
    pub(crate) name: String,
    pub(crate) joints: Vec<Joint>,
}

/// A joint whose numbers are symbols `name.field`.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) name: String,
    motion: Motion,
    /// what it reads, if it moves
    pub(crate) reading: Option<Dimension>,
}

#[derive(Clone, Debug)]
enum Motion {
    /// T(φ + θ, d)·T(a, b, α, β)
    Phi,
    /// Trans(x, y, z)·Rx·Ry·Rz
    Rigid,
    /// a declared pose or rotation
    Pose(Snippet, String),
    /// Rot_z(θ)·Trans_z(d)·Trans_x(a)·Rot_x(α)·Rot_y(β)
    Dh,
    /// Trans_x(a)·Rot_x(α)·Rot_y(β)·Rot_z(θ)·Trans_z(d)
    ModifiedDh,
}

const LENGTH: Dimension = Dimension::LENGTH;
const ANGLE: Dimension = Dimension::ANGLE;

type Fields<'a> = Vec<(&'static str, &'a Option<Value<Quantity>>, Dimension)>;

fn phi_fields(joint: &PhiJoint) -> Fields<'_> {
    vec![
        ("phi", &joint.phi, ANGLE),
        ("d", &joint.d, LENGTH),
        ("a", &joint.a, LENGTH),
        ("b", &joint.b, LENGTH),
        ("alpha", &joint.alpha, ANGLE),
        ("beta", &joint.beta, ANGLE),
    ]
}

fn rigid_fields(joint: &Rigid) -> Fields<'_> {
    vec![
        ("x", &joint.x, LENGTH),
        ("y", &joint.y, LENGTH),
        ("z", &joint.z, LENGTH),
        ("rx", &joint.rx, ANGLE),
        ("ry", &joint.ry, ANGLE),
        ("rz", &joint.rz, ANGLE),
    ]
}

fn dh_fields(row: &DhRow) -> Fields<'_> {
    vec![
        ("theta", &row.theta, ANGLE),
        ("d", &row.d, LENGTH),
        ("a", &row.a, LENGTH),
        ("alpha", &row.alpha, ANGLE),
        ("beta", &row.beta, ANGLE),
    ]
}

impl Chain {
    /// What the moving ones of its first joints read, in order.
    pub(crate) fn readings(&self, joints: usize) -> impl Iterator<Item = (&Joint, Dimension)> {
        self.joints.iter().take(joints).filter_map(|joint| joint.reading.map(|dimension| (joint, dimension)))
    }

    /// Reads a chain, and declares its parameters, constants and ties.
    pub(crate) fn read(
        name: &str,
        joints: &[model::Joint],
        quantities: &Quantities,
        all: &mut Declarations,
        diagnostics: &mut Diagnostics,
    ) -> Chain {
        let joints = joints.iter().map(|joint| read_joint(joint, quantities, all, diagnostics)).collect();
        Chain { name: name.to_owned(), joints }
    }
}

fn read_joint(
    joint: &model::Joint,
    quantities: &Quantities,
    all: &mut Declarations,
    diagnostics: &mut Diagnostics,
) -> Joint {
    let dh_reading = |row: &DhRow| match row.reads {
        Reads::Angle => Some(ANGLE),
        Reads::Length => Some(LENGTH),
        Reads::Nothing => None,
    };
    let (motion, reading, fields) = match joint {
        model::Joint::Revolute(phi) => (Motion::Phi, Some(ANGLE), phi_fields(phi)),
        model::Joint::Prismatic(phi) => (Motion::Phi, Some(LENGTH), phi_fields(phi)),
        model::Joint::Fixed(phi) => (Motion::Phi, None, phi_fields(phi)),
        model::Joint::Rigid(rigid) => match &rigid.pose {
            Some(pose) => (Motion::Pose(Snippet::new(pose, &quantities.source), pose.value.clone()), None, Vec::new()),
            None => (Motion::Rigid, None, rigid_fields(rigid)),
        },
        model::Joint::Dh(row) => (Motion::Dh, dh_reading(row), dh_fields(row)),
        model::Joint::ModifiedDh(row) => (Motion::ModifiedDh, dh_reading(row), dh_fields(row)),
    };
    let name = joint.name();
    let at = Snippet::new(name, &quantities.source);
    for (field, value, dimension) in fields {
        let full = format!("{}.{field}", name.value);
        let symbol = match value {
            None => Symbol::Constant(0.0, dimension),
            Some(Value::Constant(quantity)) => match quantity {
                Quantity::Text(text) if quantities.is_tie(quantity) => {
                    Symbol::Tie(Snippet::new(text, &quantities.source), Some(dimension))
                }
                _ => match quantities.constant(quantity, dimension, None, diagnostics) {
                    Some(value) => Symbol::Constant(value, dimension),
                    None => Symbol::Broken,
                },
            },
            Some(value) => match quantities.scalar_setting(value, dimension, diagnostics) {
                Some(setting) => {
                    all.parameters.push(Parameter {
                        name: full.clone(),
                        shape: Shape::Scalar,
                        dimensions: vec![dimension],
                        setting,
                        family: false,
                        members: Vec::new(),
                        span: value.span(),
                    });
                    Symbol::Parameter(all.parameters.len() - 1)
                }
                None => Symbol::Broken,
            },
        };
        all.declare(&full, symbol, &at, diagnostics);
    }
    Joint { name: name.value.clone(), motion, reading }
}

impl Joint {
    /// The values of all of a joint's symbols, each looked at so that every mistake is found.
    fn symbols<const N: usize>(&self, scope: &mut Scope, names: [&str; N]) -> Option<[Scalar; N]> {
        let all = names.map(|field| scope.joint_scalar(&format!("{}.{field}", self.name)));
        all.into_iter().collect::<Option<Vec<_>>>()?.try_into().ok()
    }

    /// The angle and the slide of a joint, its reading added to that which it reads.
    fn moved(&self, g: &mut Graph, angle: Scalar, slide: Scalar, reading: Option<Scalar>) -> (Scalar, Scalar) {
        match (reading, self.reading) {
            (Some(reading), Some(LENGTH)) => (angle, g.add(slide, reading)),
            (Some(reading), Some(_)) => (g.add(angle, reading), slide),
            _ => (angle, slide),
        }
    }

    /// The joint's frame, `reading` added where it reads.
    pub(crate) fn frame(&self, scope: &mut Scope, reading: Option<Scalar>) -> Option<Frame> {
        Some(match &self.motion {
            Motion::Pose(at, name) => return scope.joint_pose(at, name),
            Motion::Phi => {
                let [phi, d, a, b, alpha, beta] = self.symbols(scope, ["phi", "d", "a", "b", "alpha", "beta"])?;
                let (phi, d) = self.moved(&mut scope.graph, phi, d, reading);
                scope.graph.phi_joint(phi, d, [a, b, alpha, beta])
            }
            Motion::Rigid => {
                let [x, y, z, rx, ry, rz] = self.symbols(scope, ["x", "y", "z", "rx", "ry", "rz"])?;
                let g = &mut scope.graph;
                let origin = g.vector(x, y, z);
                let turns = [(Axis::X, rx), (Axis::Y, ry), (Axis::Z, rz)];
                let mut r = g.no_rotation();
                for (axis, angle) in turns {
                    let turn = g.turn(axis, angle);
                    r = g.compose_rotation(r, turn);
                }
                g.frame(r, origin)
            }
            Motion::Dh | Motion::ModifiedDh => {
                let [theta, d, a, alpha, beta] = self.symbols(scope, ["theta", "d", "a", "alpha", "beta"])?;
                let g = &mut scope.graph;
                let (theta, d) = self.moved(g, theta, d, reading);
                let zero = g.constant(0.0);
                let moving = g.screw(Axis::Z, theta, d);
                let link = g.screw(Axis::X, alpha, a);
                let hayati = g.screw(Axis::Y, beta, zero);
                let link = g.compose_frame(link, hayati);
                match self.motion {
                    Motion::Dh => g.compose_frame(moving, link),
                    _ => g.compose_frame(link, moving),
                }
            }
        })
    }
}
