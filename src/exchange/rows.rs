//! A serial chain as a Denavit–Hartenberg table, in either convention.
//!
//! A constant part C between two axes is *S·X·S′*: a screw S(θ, d) about the first axis, the link X = Trans_x(a)·Rot_x(α)·Rot_y(β), and
//! a screw S′ about the second axis, which goes over to the next part. The whole chain is then S₀·X₁·(S₁Z₁)·X₂·…·(SₙZₙ)·Xₙ₊₁·Sₙ₊₁, and
//! the conventions differ in how they cut it into rows only:
//!
//! | convention | first row | row of joint i | last row |
//! |---|---|---|---|
//! | Denavit & Hartenberg (1955) | S₀ X₁ | (SᵢZᵢ) Xᵢ₊₁ | Sₙ₊₁ |
//! | Craig, *Introduction to Robotics*, 3.4 | S₀ | Xᵢ (SᵢZᵢ) | Xₙ₊₁ Sₙ₊₁ |
//!
//! The first and last rows read nothing. They are what of base and tool the joints' rows have no place for; where they are nothing they
//! are left out. So the product of all rows is the chain's frame exactly, whatever stands before and after its joints.
//!
//! Where the axes are not nearly parallel, X is along their common normal and β = 0. Where they are, the common normal is far away or
//! nowhere, and X is that of Hayati (*Robot arm geometric link parameter estimation*, CDC 1983): d = 0, a to the point where the second axis
//! crosses the plane z = 0 of the first, and α and β tilt it. Exactly parallel axes so have d = 0, α = 0 or π, and β = 0, as is usual.

use std::f64::consts::{FRAC_PI_2, PI};

use super::motion::{Motion, Real, Screw, angle};
use super::serial::{Kind, Serial};
use crate::model::Reads;

/// How rows are multiplied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// *Rot_z(θ)·Trans_z(d)·Trans_x(a)·Rot_x(α)·Rot_y(β)*
    Dh,
    /// *Trans_x(a)·Rot_x(α)·Rot_y(β)·Rot_z(θ)·Trans_z(d)*
    ModifiedDh,
}

impl Convention {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Convention::Dh => "Denavit-Hartenberg",
            Convention::ModifiedDh => "modified Denavit-Hartenberg (Craig)",
        }
    }

    /// `dh` or `mdh`.
    pub fn short(self) -> &'static str {
        match self {
            Convention::Dh => "dh",
            Convention::ModifiedDh => "mdh",
        }
    }
}

/// A row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row<D> {
    /// Its name.
    pub name: String,
    /// What a reading is added to.
    pub reads: Reads,
    /// θ, d, a, α, β: angles in radians.
    pub numbers: [D; 5],
}

/// What the numbers of a row are called.
pub const SYMBOLS: [&str; 5] = ["theta", "d", "a", "alpha", "beta"];

/// Which of them are angles.
pub const ANGLES: [bool; 5] = [true, false, false, true, true];

/// Two axes that are nearly parallel.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    /// The row of the first; `base` where it is the z of the base.
    pub first: String,
    /// The row of the second; `tool` where it is the z of the end.
    pub second: String,
    /// The angle between them, in radians.
    pub angle: f64,
}

/// A table, and what is to be said of it.
#[derive(Clone, Debug)]
pub struct Rows<D> {
    /// All rows; the first and the last read nothing.
    pub rows: Vec<Row<D>>,
    /// Pairs of axes that are nearly, and not exactly, parallel.
    pub near: Vec<Near>,
    /// Numbers that are zero and have no place in the table, by row: where two axes are one, the offset that θ would have to tell the
    /// direction of; without β, the tilt of parallel axes.
    pub lost: Vec<(usize, D)>,
}

/// Nearer than this, in radians (5°), axes are nearly parallel.
const NEAR: f64 = 5.0 * PI / 180.0;

/// Nearer than this, in radians, they are parallel but for rounding.
const PARALLEL: f64 = 1e-13;

/// What rows may have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// No β: nearly parallel axes are stated by their common normal, however far that is.
    pub plain: bool,
    /// A base close to the first axis, and nearly parallel, has a row for x and one for y. Else it has a distance and a direction, which
    /// is as good as unknown where the distance is next to nothing.
    pub split: bool,
}

/// A chain as rows; `reach` is its size.
pub fn rows<D: Real>(serial: &Serial<D>, convention: Convention, style: Style, reach: f64) -> Rows<D> {
    let n = serial.joints.len();
    let name = |k: usize| serial.joints.get(k).map_or("tool", |joint| joint.name.as_str());
    let mut screws = Vec::with_capacity(n + 4);
    let mut links = Vec::with_capacity(n + 3);
    let (mut near, mut lost) = (Vec::new(), Vec::new());
    let mut carried = Screw::none();
    let mut extra = 0;
    for (k, constant) in serial.constants.iter().enumerate() {
        let motion = Motion::about_z(carried).then(constant);
        let placed = (k == 0 && k < n && style.split && !style.plain).then(|| beside(&motion, reach)).flatten();
        let part = match placed {
            Some(([x, y], part)) => {
                let ([a, alpha, beta], zero) = (part.link, D::from(0.0));
                let quarter = |turn: f64| Screw { turn: D::from(turn), slide: zero };
                match convention {
                    // Rot_z(π/2)·Trans_x(y)·Rot_z(−π/2)·Trans_x(x)·…
                    Convention::Dh => {
                        screws.extend([quarter(FRAC_PI_2), quarter(-FRAC_PI_2)]);
                        links.extend([[y, zero, zero], [x, alpha, beta]]);
                    }
                    // Trans_x(x)·Rot_z(π/2)·Trans_x(y)·Rot_z(−π/2)·…
                    Convention::ModifiedDh => {
                        screws.extend([Screw::none(), quarter(FRAC_PI_2), quarter(-FRAC_PI_2)]);
                        links.extend([[x, zero, zero], [y, zero, zero], [a, alpha, beta]]);
                    }
                }
                extra = screws.len() - 1;
                part
            }
            None => {
                let part = part(&motion, style.plain, k == n, reach);
                screws.push(part.before);
                links.push(part.link);
                part
            }
        };
        carried = part.after;
        let of = extra + if convention == Convention::Dh { k } else { k + 1 };
        lost.extend(part.lost.into_iter().map(|lost| (of, lost)));
        if part.angle > PARALLEL && part.angle < NEAR && k < n {
            let first = if k == 0 { "base" } else { name(k - 1) };
            near.push(Near { first: first.to_owned(), second: name(k).to_owned(), angle: part.angle });
        }
    }
    screws.push(carried);

    let nothing = [D::from(0.0); 3];
    let row = |k: usize, link: [D; 3]| {
        let screw = screws[k];
        let at = k.checked_sub(1 + extra);
        let reads = match at.and_then(|at| serial.joints.get(at)).map(|joint| joint.kind) {
            Some(Kind::Revolute) => Reads::Angle,
            Some(Kind::Prismatic) => Reads::Length,
            None => Reads::Nothing,
        };
        let name = match at {
            Some(at) => name(at).to_owned(),
            None if k == 0 => "base".to_owned(),
            None => format!("base_{}", k + 1),
        };
        let [a, alpha, beta] = link;
        Row { name, reads, numbers: [screw.turn, screw.slide, a, alpha, beta] }
    };
    let of_row = |k: usize| match convention {
        Convention::Dh => links.get(k),
        Convention::ModifiedDh => k.checked_sub(1).and_then(|k| links.get(k)),
    };
    let rows = (0..screws.len()).map(|k| row(k, of_row(k).copied().unwrap_or(nothing))).collect();
    Rows { rows, near, lost }
}

/// The first axis where it is close to the base's z: where it crosses the base's plane, and the rest without a distance.
fn beside<D: Real>(motion: &Motion<D>, reach: f64) -> Option<([D; 2], Part<D>)> {
    const CLOSE: f64 = 0.05;
    let [x, y, z] = motion.axis(2);
    let sine = x.re().hypot(y.re());
    if sine > NEAR.sin() {
        return None;
    }
    let [p, q, r] = motion.origin;
    let slide = r / z;
    let place = [p - slide * x, q - slide * y];
    if place[0].re().hypot(place[1].re()) > CLOSE * reach {
        return None;
    }
    let zero = D::from(0.0);
    let alpha = angle(-y, z);
    let beta = angle(x, y * (-alpha.sin()) + z * alpha.cos());
    let after = Screw { turn: turn_left(motion, zero, alpha, beta), slide };
    let angle = sine.atan2(z.re().abs());
    Some((place, Part { before: Screw::none(), link: [zero, alpha, beta], after, angle, lost: Vec::new() }))
}

/// The chain that rows state.
pub fn serial_of<D: Real>(rows: &[Row<D>], convention: Convention) -> Serial<D> {
    let mut serial = Serial::default();
    for row in rows {
        let [turn, slide, a, alpha, beta] = row.numbers;
        let link = Motion::screw(0, alpha, a).then(&Motion::turn(1, beta));
        let screw = Motion::about_z(Screw { turn, slide });
        let kind = match row.reads {
            Reads::Angle => Some(Kind::Revolute),
            Reads::Length => Some(Kind::Prismatic),
            Reads::Nothing => None,
        };
        if convention == Convention::ModifiedDh {
            serial.push(&link);
        }
        if let Some(kind) = kind {
            serial.joint(&row.name, kind);
        }
        serial.push(&screw);
        if convention == Convention::Dh {
            serial.push(&link);
        }
    }
    serial
}

/// A constant part as S·X·S′.
struct Part<D> {
    before: Screw<D>,
    /// a, α, β
    link: [D; 3],
    after: Screw<D>,
    /// between the axes, or one and the other's opposite
    angle: f64,
    lost: Vec<D>,
}

fn part<D: Real>(motion: &Motion<D>, plain: bool, last: bool, reach: f64) -> Part<D> {
    let [x, y, z] = motion.axis(2);
    let sine = x.re().hypot(y.re());
    let least = if plain { PARALLEL } else { NEAR.sin() };
    let between = sine.atan2(z.re().abs());
    let [p, q, r] = motion.origin;
    if sine > least {
        // along the common normal z × z', where that does not turn it by more than a quarter
        let turn = nearer(x, -y);
        let (s, c) = (turn.sin(), turn.cos());
        let alpha = angle(s * x - c * y, z);
        // the origin is d·z + a·x + slide·z'
        let slide = (p * s - q * c) / alpha.sin();
        let (a, d) = (p * c + q * s, r - slide * alpha.cos());
        let after = Screw { turn: turn_left(motion, turn, alpha, D::from(0.0)), slide };
        let before = Screw { turn, slide: d };
        return Part { before, link: [a, alpha, D::from(0.0)], after, angle: between, lost: Vec::new() };
    }
    // Hayati: where the axis crosses a plane across the first, at its origin; the end's frame stays where it is
    let (d, slide) = if last { (r, D::from(0.0)) } else { (D::from(0.0), r / z) };
    let (f, g) = (p - slide * x, q - slide * y);
    let across = f.re().hypot(g.re());
    let apart = across > 1e-13 * reach;
    let turn = match apart {
        true => nearer(g, f),
        // one axis: the end is turned about it
        false if last => angle(motion.rotation[1][0], motion.rotation[0][0]),
        false => D::from(0.0),
    };
    let (s, c) = (turn.sin(), turn.cos());
    let (a, aside) = (f * c + g * s, g * c - f * s);
    let (u, v) = (x * c + y * s, y * c - x * s);
    let alpha = angle(-v, z);
    let beta = angle(u, v * (-alpha.sin()) + z * alpha.cos());
    let mut lost = if apart { Vec::new() } else { vec![aside] };
    if plain {
        lost.push(beta);
    }
    let beta = if plain { D::from(0.0) } else { beta };
    let after = Screw { turn: turn_left(motion, turn, alpha, beta), slide };
    Part { before: Screw { turn, slide: d }, link: [a, alpha, beta], after, angle: between, lost }
}

/// The turn about the new axis that is left.
fn turn_left<D: Real>(motion: &Motion<D>, turn: D, alpha: D, beta: D) -> D {
    let stated = Motion::turn(2, turn).then(&Motion::turn(0, alpha)).then(&Motion::turn(1, beta));
    let left = stated.inverse().then(motion).rotation;
    angle(left[1][0], left[0][0])
}

/// The angle of a line, of its two directions the one within a quarter of a turn.
fn nearer<D: Real>(y: D, x: D) -> D {
    let toward = angle(y, x);
    let quarter = FRAC_PI_2 + 1e-9;
    if toward.re() > quarter || toward.re() <= -FRAC_PI_2 + 1e-9 { angle(-y, -x) } else { toward }
}
