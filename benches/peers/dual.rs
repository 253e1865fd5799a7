//! The same residuals over dual numbers, which carry the 21 derivatives along: what one writes with an automatic
//! differentiation library, point and axis pushed through the chain, no 4×4 products.

use nalgebra::{Const, U1};
use num_dual::{Derivative, DualNum, DualSVec64};

use super::hand::{Line, PARAMETERS, RESIDUAL, Rows};

type Dual = DualSVec64<PARAMETERS>;
type V<T> = [T; 3];

/// A link's four numbers, sine and cosine taken once.
#[derive(Clone, Copy)]
struct Link<T> {
    a: T,
    b: T,
    alpha: (T, T),
    beta: (T, T),
}

impl<T: DualNum<Primitive = f64> + Copy> Link<T> {
    fn new([a, b, alpha, beta]: [T; 4]) -> Self {
        Link { a, b, alpha: alpha.sin_cos(), beta: beta.sin_cos() }
    }

    /// (A3) without its translation.
    #[inline(always)]
    fn turn(&self, [x, y, z]: V<T>) -> V<T> {
        let ((sa, ca), (sb, cb)) = (self.alpha, self.beta);
        let (y, z) = (ca * y - sa * z, sa * y + ca * z);
        [cb * x - sb * y, sb * x + cb * y, z]
    }

    /// (A3)
    #[inline(always)]
    fn push(&self, [x, y, z]: V<T>) -> V<T> {
        let [x, y, z] = self.turn([x + self.b, y, z]);
        [x, y, z + self.a]
    }
}

/// (A2) at a reading.
#[inline(always)]
fn read<T: DualNum<Primitive = f64> + Copy>((s, c): (f64, f64), [x, y, z]: V<T>) -> V<T> {
    [z * c - x * s, x * c + z * s, y]
}

#[inline(always)]
fn dot<T: DualNum<Primitive = f64> + Copy>(a: V<T>, b: V<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn minus<T: DualNum<Primitive = f64> + Copy>(a: V<T>, b: V<T>) -> V<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// One theodolite: two links, and the last one's axis and point, which no reading touches.
struct Theodolite<T> {
    links: [Link<T>; 2],
    axis: V<T>,
    point: V<T>,
}

impl<T: DualNum<Primitive = f64> + Copy> Theodolite<T> {
    fn new(links: [[T; 4]; 3]) -> Self {
        let [first, second, last] = links.map(Link::new);
        let zero = T::from(0.0);
        Theodolite { links: [first, second], axis: last.turn([zero, zero, T::from(1.0)]), point: last.push([zero; 3]) }
    }

    /// Origin and axis of the line of sight.
    #[inline(always)]
    fn sight(&self, hz: f64, v: f64) -> (V<T>, V<T>) {
        let (hz, v) = (hz.sin_cos(), v.sin_cos());
        let [first, second] = &self.links;
        let point = first.push(read(hz, second.push(read(v, self.point))));
        let axis = first.turn(read(hz, second.turn(read(v, self.axis))));
        // (A2) at φ₀ = π/2
        (base(point), base(axis))
    }
}

#[inline(always)]
fn base<T: DualNum<Primitive = f64> + Copy>([x, y, z]: V<T>) -> V<T> {
    [-x, z, y]
}

/// Both theodolites at one set of parameters.
pub(crate) struct Pair<T> {
    left: Theodolite<T>,
    right: Theodolite<T>,
}

impl<T: DualNum<Primitive = f64> + Copy> Pair<T> {
    fn with(q: [T; PARAMETERS]) -> Self {
        let zero = T::from(0.0);
        let link = |first: usize| [q[first], q[first + 1], q[first + 2], q[first + 3]];
        Pair {
            left: Theodolite::new([[zero, zero, q[0], q[1]], link(2), link(6)]),
            right: Theodolite::new([[q[10], zero, q[11], q[12]], link(13), link(17)]),
        }
    }

    /// The observed point (15) and the KCI (20).
    #[inline(always)]
    fn observe(&self, readings: &[f64]) -> (V<T>, T) {
        let (pl, zl) = self.left.sight(readings[0], readings[1]);
        let (pr, zr) = self.right.sight(readings[2], readings[3]);
        let (dp, c) = (minus(pl, pr), dot(zl, zr));
        let n = [zr[1] * zl[2] - zr[2] * zl[1], zr[2] * zl[0] - zr[0] * zl[2], zr[0] * zl[1] - zr[1] * zl[0]];
        let h = (c * dot(zr, dp) - dot(zl, dp)) / dot(n, n); // (13), (14)
        ([pl[0] + h * zl[0], pl[1] + h * zl[1], pl[2] + h * zl[2]], -dot(dp, n))
    }

    /// (4) and (20)
    #[inline(always)]
    fn residuals(&self, line: &Line) -> [T; 5] {
        let (upper, kci1) = self.observe(&line[..4]);
        let (lower, kci2) = self.observe(&line[4..8]);
        let vo = minus(upper, lower);
        [vo[0], vo[1], vo[2] - line[8], kci1, kci2]
    }
}

impl Pair<Dual> {
    /// Each parameter with its own derivative.
    pub(crate) fn new(q: &[f64]) -> Self {
        Self::with(std::array::from_fn(|k| Dual::new(q[k], Derivative::derivative_generic(Const, U1, k))))
    }

    /// Residuals and derivatives of one line.
    pub(crate) fn linearise(&self, line: &Line, rows: &mut Rows) {
        for (row, residual) in rows.iter_mut().zip(self.residuals(line)) {
            let derivatives = residual.eps.unwrap_generic(Const::<PARAMETERS>, U1);
            row[..PARAMETERS].copy_from_slice(derivatives.as_slice());
            row[RESIDUAL] = residual.re;
        }
    }
}
