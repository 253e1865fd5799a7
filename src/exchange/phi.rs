//! A serial chain as joints of the φ-model, far from where that breaks down.
//!
//! A constant part C is stated as *T(φ, d)·T(a, b, α, β)·S*, where the screw S about the next axis goes over to the next joint, for
//! which it is all the same where the zero of its reading lies. Any φ will do whose frame's z, *u = (cos φ, sin φ, 0)*, is not parallel
//! to the next axis: a, b, α, β state that axis, four numbers for a line, and any line near it, the ones parallel to the joint's
//! own axis included ((A1)–(A3) of Sultan & Wager; what breaks down at u ∥ z' is told by [`crate::identify::conventions`]).

use std::f64::consts::{FRAC_PI_2, PI};

use super::motion::{Motion, Real, Screw};
use super::number::{is_nice, nil};
use super::serial::Serial;

/// The numbers of a φ-model joint: φ, a, b, α, β. Its d is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhiLink<D = f64> {
    /// The turn of the φ-frame about z.
    pub phi: D,
    /// The slide along the φ-frame's z.
    pub a: D,
    /// The slide along the new x.
    pub b: D,
    /// The turn about the new x.
    pub alpha: D,
    /// The turn about the φ-frame's z.
    pub beta: D,
}

/// An axis this near to u, by the sine, is not stated from there.
const LEAST_SINE: f64 = 0.5;

/// A chain in the φ-model: a link to the axis of each moving joint, and the pose of the end in the last one.
pub fn phi_links(serial: &Serial<f64>) -> (Vec<PhiLink>, Motion<f64>) {
    let reach = serial.reach();
    let mut carried = Screw::none();
    let mut links = Vec::new();
    let mut constants = serial.constants.iter();
    for (_, constant) in serial.joints.iter().zip(&mut constants) {
        let (link, rest) = link(&Motion::about_z(carried).then(constant), carried.turn, reach);
        links.push(link);
        carried = rest;
    }
    let end = constants.next().copied().unwrap_or_else(Motion::none);
    (links, Motion::about_z(carried).then(&end))
}

/// The φ and α of a link, its other numbers zero, that is no motion at all: what the last joint has, whose end is stated otherwise.
pub(super) const NO_LINK: f64 = -FRAC_PI_2;

/// The motion of a link.
pub fn phi_motion<D: Real>(link: &PhiLink<D>) -> Motion<D> {
    // the φ-frame: z where x was, x where y was, y where z was
    let (one, zero) = (D::from(1.0), D::from(0.0));
    let permuted = Motion { rotation: [[zero, zero, one], [one, zero, zero], [zero, one, zero]], origin: [zero; 3] };
    let along = Motion::screw(2, link.beta, link.a).then(&Motion::screw(0, link.alpha, link.b));
    Motion::turn(2, link.phi).then(&permuted).then(&along)
}

/// The best of some φ: first what is far from breaking down, then what reads well.
fn link(motion: &Motion<f64>, carried: f64, reach: f64) -> (PhiLink, Screw<f64>) {
    let [x, y, z] = motion.axis(2);
    let mut candidates = vec![0.0, FRAC_PI_2, carried, carried + FRAC_PI_2];
    if x.hypot(y) > 1e-9 {
        candidates.push(y.atan2(x) + FRAC_PI_2);
    } else {
        candidates.push(motion.origin[1].atan2(motion.origin[0]));
    }
    let mut best: Option<(f64, PhiLink, Screw<f64>)> = None;
    for phi in candidates.into_iter().map(half_turn) {
        // u × z', whose length is the sine
        let (s, c) = phi.sin_cos();
        let along = c * x + s * y;
        if (c * y - s * x).hypot(z) < LEAST_SINE {
            continue;
        }
        let (link, rest) = stated(motion, phi);
        let odd = |nice: bool| if nice { 0.0 } else { 1.0 };
        let angles = [link.phi, link.alpha, link.beta, rest.turn].map(|angle| odd(is_nice(angle)));
        let lengths = [link.a, link.b, rest.slide].map(|length| 0.5 * odd(nil(length, reach)));
        let cost = 6.0 * along.abs()
            + angles.iter().sum::<f64>()
            + lengths.iter().sum::<f64>()
            + 0.1 * odd(phi == 0.0)
            + 0.1 * odd(rest.turn.abs() < 1e-9);
        if best.as_ref().is_none_or(|(least, ..)| cost < *least - 1e-9) {
            best = Some((cost, link, rest));
        }
    }
    // the axis is across its own direction turned by a quarter, so one is always found
    best.map_or((PhiLink::default(), Screw::none()), |(_, link, rest)| (link, rest))
}

/// From one φ: *x_new* is the common normal of u and the axis, on the side where |β| is not above a quarter of a turn.
fn stated(motion: &Motion<f64>, phi: f64) -> (PhiLink, Screw<f64>) {
    let turned = Motion::turn(2, -phi).then(motion);
    // in the φ-frame x is y and y is z; the axis is (−sin β sin … ) across u = x
    let [along, x, y] = turned.axis(2);
    let mut beta = (-x).atan2(y);
    let mut alpha = x.hypot(y).atan2(along);
    // z' = cos α·u − sin α·y_new: with y_new = (−sin β, cos β), sin α is negative for this β
    alpha = -alpha;
    if !(1e-9 - FRAC_PI_2..=FRAC_PI_2 + 1e-9).contains(&beta) {
        beta = if beta > 0.0 { beta - PI } else { beta + PI };
        alpha = -alpha;
    }
    let (s, c) = beta.sin_cos();
    let [o_along, o_x, o_y] = turned.origin;
    // the origin is a·u + b·x_new + slide·z'
    let slide = (-s * o_x + c * o_y) / -alpha.sin();
    let b = c * o_x + s * o_y;
    let a = o_along - slide * alpha.cos();
    let link = PhiLink { phi, a, b, alpha, beta };
    let rest = phi_motion(&link).inverse().then(motion);
    (link, Screw { turn: rest.rotation[1][0].atan2(rest.rotation[0][0]), slide })
}

/// Within (−π/2, π/2]: u and −u state the same lines.
fn half_turn(angle: f64) -> f64 {
    let turned = angle.rem_euclid(PI);
    let near = |x: f64| (turned - x).abs() < 1e-12;
    match () {
        () if near(0.0) || near(PI) => 0.0,
        () if near(FRAC_PI_2) => FRAC_PI_2,
        () if turned > FRAC_PI_2 => turned - PI,
        () => turned,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::serial::Kind;
    use proptest::prelude::*;

    fn rebuilt(serial: &Serial<f64>) -> Serial<f64> {
        let (links, end) = phi_links(serial);
        let constants = links.iter().map(phi_motion).chain([end]).collect();
        Serial { joints: serial.joints.clone(), constants }
    }

    fn any_motion() -> impl Strategy<Value = Motion<f64>> {
        // angles that chains have, and any others
        let angle = prop_oneof![(-6..=6i32).prop_map(|k| f64::from(k) * PI / 6.0), -PI..PI];
        let length = prop_oneof![Just(0.0), -1.0..1.0];
        (prop::array::uniform3(angle), prop::array::uniform3(length)).prop_map(|(rpy, xyz)| Motion::of_origin(xyz, rpy))
    }

    #[test]
    fn the_last_joint_has_no_link() {
        let link = PhiLink { phi: NO_LINK, alpha: NO_LINK, ..PhiLink::default() };
        assert!(phi_motion(&link).apart(&Motion::none()) < 1e-15);
    }

    proptest! {
        #[test]
        fn any_chain_keeps_its_poses(
            constants in prop::collection::vec(any_motion(), 2..8),
            slides in prop::collection::vec(any::<bool>(), 7),
            readings in prop::array::uniform7(-3.0..3.0f64),
        ) {
            let kind = |slides: &bool| if *slides { Kind::Prismatic } else { Kind::Revolute };
            let mut serial = Serial::default();
            let mut all = constants.iter();
            if let Some(first) = all.next() { serial.push(first) }
            for (constant, slides) in all.zip(&slides) {
                serial.joint("J", kind(slides));
                serial.push(constant);
            }
            let again = rebuilt(&serial);
            let apart = serial.pose(&readings).apart(&again.pose(&readings));
            prop_assert!(apart < 1e-13 * (1.0 + serial.reach()), "{apart}");
            for link in phi_links(&serial).0 {
                prop_assert!(link.alpha.sin().abs() > 0.49 && link.beta.abs() < FRAC_PI_2 + 1e-8, "{link:?}");
            }
        }
    }
}
