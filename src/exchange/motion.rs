//! Rigid motions over any number type, so that conversions have exact derivatives.

use crate::graph::{Number, Operation};

/// A number that conversions run on: `f64`, or a dual number. Branches look at the real part alone.
pub trait Real: Number + Copy {}

impl<T: Number + Copy> Real for T {}

/// The angle of (x, y), with its derivative on the axes, too, where the one of num-dual has none.
pub(super) fn angle<D: Real>(y: D, x: D) -> D {
    Operation::Atan2.apply(&y, &x)
}

/// A vector.
pub type Vector<D> = [D; 3];

/// A rigid motion, *p ↦ R·p + o*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<D> {
    /// R, by rows.
    pub rotation: [[D; 3]; 3],
    /// o.
    pub origin: Vector<D>,
}

/// A turn about an axis and a slide along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screw<D> {
    /// The turn, in radians.
    pub turn: D,
    /// The slide.
    pub slide: D,
}

impl<D: Real> Screw<D> {
    /// Neither.
    pub fn none() -> Self {
        Screw { turn: D::from(0.0), slide: D::from(0.0) }
    }
}

impl<D: Real> Motion<D> {
    /// No motion.
    pub fn none() -> Self {
        let (one, zero) = (D::from(1.0), D::from(0.0));
        let rotation = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        Motion { rotation, origin: [zero; 3] }
    }

    /// A turn about a coordinate axis, 0 to 2, and a slide along it.
    pub fn screw(axis: usize, angle: D, slide: D) -> Self {
        let mut motion = Motion::none();
        let (c, s) = (angle.cos(), angle.sin());
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        motion.rotation[j][j] = c;
        motion.rotation[j][k] = -s;
        motion.rotation[k][j] = s;
        motion.rotation[k][k] = c;
        motion.origin[axis] = slide;
        motion
    }

    /// A turn about a coordinate axis, 0 to 2.
    pub fn turn(axis: usize, angle: D) -> Self {
        Motion::screw(axis, angle, D::from(0.0))
    }

    /// A turn about z and a slide along it.
    pub fn about_z(screw: Screw<D>) -> Self {
        Motion::screw(2, screw.turn, screw.slide)
    }

    /// A translation.
    pub fn shift(origin: Vector<D>) -> Self {
        Motion { origin, ..Motion::none() }
    }

    /// This motion, then, in the moved frame, the other: the product.
    #[must_use]
    pub fn then(&self, other: &Self) -> Self {
        let column = |k: usize| self.rotated(std::array::from_fn(|i| other.rotation[i][k]));
        let columns = [column(0), column(1), column(2)];
        let rotation = std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]));
        let moved = self.rotated(other.origin);
        Motion { rotation, origin: std::array::from_fn(|i| self.origin[i] + moved[i]) }
    }

    /// The motion back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation: [[D; 3]; 3] = std::array::from_fn(|i| std::array::from_fn(|k| self.rotation[k][i]));
        let back = Motion { rotation, origin: [D::from(0.0); 3] };
        Motion { origin: back.rotated(self.origin).map(|x| -x), ..back }
    }

    /// R·v
    pub fn rotated(&self, v: Vector<D>) -> Vector<D> {
        self.rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// An axis of the moved frame, 0 to 2.
    pub fn axis(&self, k: usize) -> Vector<D> {
        self.rotation.map(|row| row[k])
    }

    /// Roll, pitch and yaw: *R = Rz(yaw)·Ry(pitch)·Rx(roll)*. Yaw is taken first and the others of what it leaves, so that
    /// the product is R where yaw and roll turn about the same axis, too.
    pub fn roll_pitch_yaw(&self) -> [D; 3] {
        let r = &self.rotation;
        let yaw = first_angle(r[1][0], r[0][0]);
        let left = Motion::turn(2, -yaw).then(self).rotation;
        let pitch = angle(-left[2][0], left[0][0]);
        let roll = angle(-left[1][2], left[1][1]);
        [roll, pitch, yaw]
    }

    /// The angles of *R = Rx(rx)·Ry(ry)·Rz(rz)*, likewise.
    pub fn xyz_angles(&self) -> [D; 3] {
        let r = &self.rotation;
        let rx = first_angle(-r[1][2], r[2][2]);
        let left = Motion::turn(0, -rx).then(self).rotation;
        let ry = angle(left[0][2], left[2][2]);
        let rz = angle(left[1][0], left[1][1]);
        [rx, ry, rz]
    }

    /// From the three: *Rz(yaw)·Ry(pitch)·Rx(roll)* after a translation, as the origin of a URDF.
    pub fn of_origin(xyz: Vector<D>, [roll, pitch, yaw]: [D; 3]) -> Self {
        let turned = Motion::turn(2, yaw).then(&Motion::turn(1, pitch)).then(&Motion::turn(0, roll));
        Motion { origin: xyz, ..turned }
    }
}

/// The first of three angles, zero where the second leaves nothing to tell it by.
fn first_angle<D: Real>(y: D, x: D) -> D {
    if y.re().hypot(x.re()) < 1e-15 { D::from(0.0) } else { angle(y, x) }
}

impl Motion<f64> {
    /// The same in another number type, exact.
    pub fn constant<D: Real>(&self) -> Motion<D> {
        Motion { rotation: self.rotation.map(|row| row.map(D::from)), origin: self.origin.map(D::from) }
    }

    /// The largest difference of an entry, lengths and pure numbers alike.
    pub fn apart(&self, other: &Self) -> f64 {
        let entries = |m: &Self| m.rotation.iter().flatten().chain(&m.origin).copied().collect::<Vec<f64>>();
        entries(self).iter().zip(entries(other)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// A rotation that takes z to a direction of length one: none where it is z, else the shortest; half a turn about x where it is −z.
    pub fn z_to(axis: Vector<f64>) -> Self {
        let [x, y, z] = axis;
        let across = x.hypot(y);
        if across == 0.0 {
            let mut motion = Motion::none();
            if z < 0.0 {
                (motion.rotation[1][1], motion.rotation[2][2]) = (-1.0, -1.0);
            }
            return motion;
        }
        // z → axis about (−y, x, 0): I + K + K²(1 − cos)/sin²
        let (u, v) = (-y / across, x / across);
        let versine = 1.0 - z;
        let rotation =
            [[z + u * u * versine, u * v * versine, x], [u * v * versine, z + v * v * versine, y], [-x, -y, z]];
        Motion { rotation, origin: [0.0; 3] }
    }
}
