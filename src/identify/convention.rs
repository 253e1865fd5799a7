//! Joints that are close to where their convention breaks down.
//!
//! A joint's constant part T(a, b, α, β) states where the next axis is, by its common normal with the z of the φ-frame, (A1)–(A3).
//! Where the two are parallel there is no common normal: β turns about the new axis as the next reading does, `a` slides along it
//! as the next `d` does, and a tilt of the axis in one of its two ways cannot be stated at all. Numbers near there are large
//! where they should be small, by 1/sin α. A Denavit–Hartenberg row states the next axis from the joint's own: parallel axes are its
//! breakdown, unless Hayati's β stands in. The cure of both is the φ-model with a φ that puts its z across the new axis.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::compile::{Program, quantity};
use crate::diag::{Code, Diagnostic, Span};
use crate::model::{DhRow, Joint, Model, PhiJoint, Quantity, Value};
use crate::unit::Dimension;

/// Nearer than this, in radians (5°), numbers grow more than tenfold.
const NEAR: f64 = 5.0 * PI / 180.0;

/// A joint near its breakdown, and what to write instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Convention {
    /// The chain.
    pub chain: String,
    /// The joint.
    pub joint: String,
    /// How far the new axis is from the parallel, in radians.
    pub angle: f64,
    /// Whether it is a Denavit–Hartenberg row, whose own axis the new one is parallel to; else the z of the φ-frame is.
    pub parallel_axes: bool,
    /// φ, d, a, b, α, β of the φ-model joint that states the same next axis; internal units.
    pub instead: [f64; 6],
    /// What the next joint's angle and slide must have added then.
    pub carried: [f64; 2],
    /// Where it stands.
    pub span: Span,
}

type Vector = [f64; 3];

const LENGTH: Dimension = Dimension::LENGTH;
const ANGLE: Dimension = Dimension::ANGLE;

/// All joints of a model near their breakdown that state something which can be free. Numbers tied to others are not judged.
pub fn conventions(model: &Model, program: &Program) -> Vec<Convention> {
    let mut all = Vec::new();
    for (chain, joints) in model.chains.iter() {
        for (i, joint) in joints.iter().enumerate() {
            let follows = joints.get(i + 1);
            // a constant pose has no axis that could be parallel
            if matches!(follows, Some(Joint::Rigid(_))) {
                continue;
            }
            let found = match joint {
                Joint::Revolute(phi) | Joint::Prismatic(phi) | Joint::Fixed(phi) => of_phi(program, phi),
                Joint::Dh(row) if follows.is_some() => of_row(program, row, row),
                // the twist of the next row lies between this axis and the next
                Joint::ModifiedDh(row) => match follows {
                    Some(Joint::ModifiedDh(after)) => of_row(program, row, after),
                    _ => None,
                },
                _ => None,
            };
            let Some((angle, parallel_axes, instead, carried)) = found else { continue };
            let (chain, joint_name) = (chain.value.clone(), joint.name().value.clone());
            all.push(Convention {
                chain,
                joint: joint_name,
                angle,
                parallel_axes,
                instead,
                carried,
                span: joint.span(),
            });
        }
    }
    all
}

type Found = (f64, bool, [f64; 6], [f64; 2]);

fn of_phi(program: &Program, joint: &PhiJoint) -> Option<Found> {
    let declared = [&joint.a, &joint.b, &joint.alpha, &joint.beta];
    if !declared.iter().any(|value| adjustable(value)) {
        return None;
    }
    let [phi, d, a, b, alpha, beta] = numbers(
        program,
        [
            (&joint.phi, ANGLE),
            (&joint.d, LENGTH),
            (&joint.a, LENGTH),
            (&joint.b, LENGTH),
            (&joint.alpha, ANGLE),
            (&joint.beta, ANGLE),
        ],
    )?;
    let angle = from_parallel(alpha);
    if angle >= NEAR {
        return None;
    }
    let frame = phi_frame(phi, d, [a, b, alpha, beta]);
    let (instead, carried) = across(d, &frame, phi + FRAC_PI_2);
    Some((angle, false, instead, carried))
}

/// `twist` is the row that has the twist between the axis of `row` and the next.
fn of_row(program: &Program, row: &DhRow, twist: &DhRow) -> Option<Found> {
    let declared = [&row.d, &row.theta, &twist.a, &twist.alpha];
    if adjustable(&twist.beta) || !declared.iter().any(|value| adjustable(value)) {
        return None;
    }
    let stated = [(&row.d, LENGTH), (&row.theta, ANGLE), (&twist.a, LENGTH), (&twist.alpha, ANGLE)];
    let [d, theta, a, alpha] = numbers(program, stated)?;
    let angle = from_parallel(alpha);
    if angle >= NEAR {
        return None;
    }
    let (x, y) = ([theta.cos(), theta.sin(), 0.0], [-theta.sin(), theta.cos(), 0.0]);
    let z = std::array::from_fn(|k| alpha.cos() * [0.0, 0.0, 1.0][k] - alpha.sin() * y[k]);
    let frame = Axis { origin: [a * x[0], a * x[1], d], x, z };
    let (instead, carried) = across(d, &frame, theta);
    Some((angle, true, instead, carried))
}

fn adjustable(value: &Option<Value<Quantity>>) -> bool {
    matches!(value, Some(Value::Free(_) | Value::Held(_)))
}

fn from_parallel(alpha: f64) -> f64 {
    alpha.sin().abs().asin()
}

/// Nominal values, zero where nothing is said; none where one is tied to others.
fn numbers<const N: usize>(
    program: &Program,
    declared: [(&Option<Value<Quantity>>, Dimension); N],
) -> Option<[f64; N]> {
    let mut all = [0.0; N];
    for (number, (value, dimension)) in all.iter_mut().zip(declared) {
        let Some(value) = value else { continue };
        let text = match value.nominal() {
            Quantity::Number(number) => format!("{:?}", number.value),
            Quantity::Text(text) => text.value.clone(),
        };
        *number = quantity(program, "nominal value", &text, dimension).ok()?;
    }
    Some(all)
}

/// An axis with a frame on it: the frame's origin, its x, and its z along the axis.
struct Axis {
    origin: Vector,
    x: Vector,
    z: Vector,
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The frame after T(φ, d)·T(a, b, α, β), in the joint's own.
fn phi_frame(phi: f64, d: f64, [a, b, alpha, beta]: [f64; 4]) -> Axis {
    let (along, across, up) = ([phi.cos(), phi.sin(), 0.0], [-phi.sin(), phi.cos(), 0.0], [0.0, 0.0, 1.0]);
    // the φ-frame has z along, x across, y up
    let sum = |p: f64, q: f64, r: f64| -> Vector { std::array::from_fn(|k| p * along[k] + q * across[k] + r * up[k]) };
    let x = sum(0.0, beta.cos(), beta.sin());
    let y = sum(0.0, -beta.sin(), beta.cos());
    let z = std::array::from_fn(|k| alpha.cos() * along[k] - alpha.sin() * y[k]);
    let origin = std::array::from_fn(|k| d * up[k] + a * along[k] + b * x[k]);
    Axis { origin, x, z }
}

/// The same axis stated from another φ, and what is left over: the turn about it and the slide along it.
fn across(d: f64, axis: &Axis, phi: f64) -> ([f64; 6], [f64; 2]) {
    let along = [phi.cos(), phi.sin(), 0.0];
    let over = [-phi.sin(), phi.cos(), 0.0];
    let z = axis.z;
    let (w, u) = (dot(z, over), z[2]);
    let sine = w.hypot(u);
    // the common normal of both axes is the new x, so that sin α is positive
    let (cx, cy) = (-u / sine, w / sine);
    let beta = cy.atan2(cx);
    let alpha = sine.atan2(dot(z, along));
    let x: Vector = std::array::from_fn(|k| cx * over[k] + cy * [0.0, 0.0, 1.0][k]);
    let y: Vector = std::array::from_fn(|k| -cy * over[k] + cx * [0.0, 0.0, 1.0][k]);
    let from: Vector = std::array::from_fn(|k| axis.origin[k] - [0.0, 0.0, d][k]);
    let back = -dot(from, y) / dot(z, y);
    let (a, b) = (dot(from, along) + back * dot(z, along), dot(from, x));
    let new = phi_frame(phi, d, [a, b, alpha, beta]);
    let slide: f64 = (0..3).map(|k| (axis.origin[k] - new.origin[k]) * z[k]).sum();
    let side: Vector =
        [z[1] * new.x[2] - z[2] * new.x[1], z[2] * new.x[0] - z[0] * new.x[2], z[0] * new.x[1] - z[1] * new.x[0]];
    let turn = dot(axis.x, side).atan2(dot(axis.x, new.x));
    ([wrapped(phi), d, a, b, alpha, beta], [turn, slide])
}

fn wrapped(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

impl Convention {
    /// What is wrong, with the cure.
    pub fn diagnostic(&self, program: &Program) -> Diagnostic {
        let degrees = |angle: f64| format!("{} deg", tidy(angle.to_degrees()));
        let length = |value: f64| {
            let units = &program.units;
            format!("{} {}", tidy(units.to_reported(value, Dimension::LENGTH)), units.symbol(Dimension::LENGTH))
        };
        let what = match self.parallel_axes {
            true => "its axis and the next are parallel",
            false => "its new axis is parallel to the z of its phi-frame",
        };
        let within = if self.angle < 1e-9 { String::new() } else { format!(" within {}", degrees(self.angle)) };
        let message = format!(
            "joint `{}` of chain `{}`: {what}{within}, where its convention breaks down",
            self.joint, self.chain
        );
        let [phi, d, a, b, alpha, beta] = self.instead;
        let [turn, slide] = self.carried;
        let hint = format!(
            "state the same axis from phi = {}: d = {}, a = {}, b = {}, alpha = {}, beta = {}; then the next joint's angle \
             grows by {} and its slide by {}",
            degrees(phi),
            length(d),
            length(a),
            length(b),
            degrees(alpha),
            degrees(beta),
            degrees(turn),
            length(slide)
        );
        Diagnostic::warning(Code::NearConvention, message).at(&program.source, self.span).hint(hint)
    }
}

/// Without the digits that rounding has made.
fn tidy(value: f64) -> String {
    let text = format!("{value:.6}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn same(a: Vector, b: Vector) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    /// The frame that a joint gives with what the next one carries.
    fn with_carried(axis: &Axis, [turn, slide]: [f64; 2]) -> Axis {
        let (x, z) = (axis.x, axis.z);
        let y: Vector = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]];
        Axis {
            origin: std::array::from_fn(|k| axis.origin[k] + slide * z[k]),
            x: std::array::from_fn(|k| turn.cos() * x[k] + turn.sin() * y[k]),
            z,
        }
    }

    #[test]
    fn another_phi_states_the_same_axis() {
        for (phi, d, rest) in [
            (0.3, 20.0, [5.0, -7.0, 0.01, 0.4]),
            (-2.0, 0.0, [100.0, 3.0, PI - 0.02, -1.0]),
            (0.0, 1.0, [0.0, 0.0, 0.0, 0.0]),
            (1.0, -4.0, [2.0, 9.0, 1.2, 2.5]),
        ] {
            let axis = phi_frame(phi, d, rest);
            let (instead, carried) = across(d, &axis, phi + FRAC_PI_2);
            let [new_phi, new_d, a, b, alpha, beta] = instead;
            let again = with_carried(&phi_frame(new_phi, new_d, [a, b, alpha, beta]), carried);
            assert!(same(again.origin, axis.origin) && same(again.x, axis.x) && same(again.z, axis.z), "{rest:?}");
            assert!(rest[2].sin().abs() > 0.1 || alpha.sin() > 0.99, "{instead:?}");
        }
    }
}
