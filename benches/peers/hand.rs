//! The five residuals of a vertical line and their derivatives by the paper's 21 parameters, derived by hand.
//!
//! A parameter moves its ray of sight as a rigid body: a turn about an axis, or a slide along it. A number that two rays
//! decide has a force and a moment on the left ray (its derivatives by a slide and by a turn), and, since it does not change
//! when both rays move together, the opposite ones on the right ray; its derivative by a parameter is the power of that
//! wrench on the parameter's screw. Numbers in brackets are the paper's equations.

/// The paper's parameters.
pub(crate) const PARAMETERS: usize = 21;
/// Those of the left theodolite, which come first.
const LEFT: usize = 10;
/// Length of a row: derivatives, residual, and zeros up to whole vectors.
pub(crate) const WIDTH: usize = 24;
/// Where the residual is in a row.
pub(crate) const RESIDUAL: usize = PARAMETERS;

/// Readings to the upper point (left hz, v; right hz, v), to the lower one, and the length between.
pub(crate) type Line = [f64; 9];
/// A line's residuals and derivatives.
pub(crate) type Rows = [[f64; WIDTH]; 5];

type V = [f64; 3];

/// a b + c, fused where that is one instruction.
#[inline(always)]
pub(crate) fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_feature = "fma") { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
fn dot(a: V, b: V) -> f64 {
    fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]))
}

#[inline(always)]
fn cross(a: V, b: V) -> V {
    add_cross([0.0; 3], a, b)
}

/// c + a × b
#[inline(always)]
fn add_cross(c: V, a: V, b: V) -> V {
    [
        fma(a[1], b[2], fma(-a[2], b[1], c[0])),
        fma(a[2], b[0], fma(-a[0], b[2], c[1])),
        fma(a[0], b[1], fma(-a[1], b[0], c[2])),
    ]
}

#[inline(always)]
fn scaled(s: f64, a: V) -> V {
    a.map(|x| s * x)
}

/// s a + b
#[inline(always)]
fn add_scaled(s: f64, a: V, b: V) -> V {
    [fma(s, a[0], b[0]), fma(s, a[1], b[1]), fma(s, a[2], b[2])]
}

#[inline(always)]
fn minus(a: V, b: V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A vector that turns with the first reading: what is multiplied by its cosine, by its sine, and what stands still.
#[derive(Clone, Copy)]
struct Turning([V; 3]);

impl Turning {
    /// x e + y n + z w, where w is the axis of the first joint, e = c x₁ + s y₁ and n = c y₁ − s x₁.
    fn new([x, y, z]: V, frame: &[V; 3]) -> Self {
        Turning([
            add_scaled(x, frame[0], scaled(y, frame[1])),
            add_scaled(x, frame[1], scaled(-y, frame[0])),
            scaled(z, frame[2]),
        ])
    }

    #[inline(always)]
    fn at(&self, (s, c): (f64, f64)) -> V {
        add_scaled(c, self.0[0], add_scaled(s, self.0[1], self.0[2]))
    }
}

/// What a theodolite's parameters alone decide. Index 0 is its place at the base, 1 the trunnion axis, 2 the line of sight.
struct Theodolite {
    /// The foot of the standing axis, on the base's y.
    origin: V,
    /// The axis of α₀.
    x0: V,
    /// The axis of a₁ and β₁; of b₁ and α₁; the other two of the trunnion frame.
    e1: Turning,
    x1: Turning,
    y1: Turning,
    z1: Turning,
    a1: f64,
    b1: f64,
    a2: f64,
    b2: f64,
    /// Sine and cosine of β₂.
    beta2: (f64, f64),
    /// The line of sight in the trunnion frame at zero reading.
    axis: V,
}

impl Theodolite {
    /// (A1)–(A3) with φ₀ = π/2, φ₁ = φ₂ = 0 and b₀ = 0.
    fn new(a0: f64, q: &[f64]) -> Self {
        let &[alpha0, beta0, a1, b1, alpha1, beta1, a2, b2, alpha2, beta2] = q else { unreachable!("ten parameters") };
        let ((sa, ca), (sb, cb)) = (alpha0.sin_cos(), beta0.sin_cos());
        let frame = [[-cb, 0.0, sb], [sb * ca, sa, cb * ca], [-sb * sa, ca, -cb * sa]];
        let ((sa, ca), (sb, cb)) = (alpha1.sin_cos(), beta1.sin_cos());
        let ((sa2, ca2), (sb2, cb2)) = (alpha2.sin_cos(), beta2.sin_cos());
        Theodolite {
            origin: [0.0, a0, 0.0],
            x0: frame[0],
            e1: Turning::new([1.0, 0.0, 0.0], &frame),
            x1: Turning::new([0.0, cb, sb], &frame),
            y1: Turning::new([sa, -sb * ca, cb * ca], &frame),
            z1: Turning::new([ca, sb * sa, -cb * sa], &frame),
            a1,
            b1,
            a2,
            b2,
            beta2: (sb2, cb2),
            axis: [ca2, sa2 * sb2, -sa2 * cb2],
        }
    }

    #[inline(always)]
    fn sight(&self, hz: f64, v: f64) -> Ray {
        let (s, c) = v.sin_cos();
        let hz = hz.sin_cos();
        let (e1, x1, y1, z1) = (self.e1.at(hz), self.x1.at(hz), self.y1.at(hz), self.z1.at(hz));
        let elbow = add_scaled(self.a1, e1, add_scaled(self.b1, x1, self.origin));
        let e2 = add_scaled(c, x1, scaled(s, y1));
        let n2 = add_scaled(c, y1, scaled(-s, x1));
        let (sb, cb) = self.beta2;
        let x2 = add_scaled(cb, n2, scaled(sb, z1));
        let z = add_scaled(self.axis[0], e2, add_scaled(self.axis[1], n2, scaled(self.axis[2], z1)));
        let eye = add_scaled(self.a2, e2, add_scaled(self.b2, x2, elbow));
        Ray { e1, x1, e2, x2, elbow, eye, z }
    }

    /// The power of a wrench on the screws of a₀, α₀, β₀, a₁, b₁, α₁, β₁, a₂, b₂, α₂, β₂.
    #[inline(always)]
    fn powers(&self, ray: &Ray, wrench: &Wrench, arms: &Arms) -> [f64; 1 + LEFT] {
        let force = wrench.force;
        let base = add_cross(wrench.moment, arms.base, force);
        let elbow = add_cross(wrench.moment, arms.elbow, force);
        let eye = add_cross(wrench.moment, arms.eye, force);
        [
            force[1],
            dot(self.x0, base),
            base[1],
            dot(ray.e1, force),
            dot(ray.x1, force),
            dot(ray.x1, elbow),
            dot(ray.e1, base),
            dot(ray.e2, force),
            dot(ray.x2, force),
            dot(ray.x2, eye),
            dot(ray.e2, elbow),
        ]
    }

    /// How a point at these arms is carried by α₀, β₀, a₁, b₁, α₁, β₁, a₂, b₂, α₂, β₂.
    #[inline(always)]
    fn carried(&self, ray: &Ray, arms: &Arms) -> [V; LEFT] {
        [
            cross(self.x0, arms.base),
            [arms.base[2], 0.0, -arms.base[0]],
            ray.e1,
            ray.x1,
            cross(ray.x1, arms.elbow),
            cross(ray.e1, arms.base),
            ray.e2,
            ray.x2,
            cross(ray.x2, arms.eye),
            cross(ray.e2, arms.elbow),
        ]
    }
}

/// A line of sight from `eye` along `z`, and the axes that move it.
struct Ray {
    e1: V,
    x1: V,
    e2: V,
    x2: V,
    elbow: V,
    eye: V,
    z: V,
}

/// The way to a point from the places where moments are taken.
struct Arms {
    base: V,
    elbow: V,
    eye: V,
}

impl Arms {
    #[inline(always)]
    fn new(theodolite: &Theodolite, ray: &Ray, point: V) -> Self {
        Arms { base: minus(point, theodolite.origin), elbow: minus(point, ray.elbow), eye: minus(point, ray.eye) }
    }
}

/// Force, and moment about the observed point.
struct Wrench {
    force: V,
    moment: V,
}

impl Wrench {
    #[inline(always)]
    fn opposite(&self) -> Self {
        Wrench { force: scaled(-1.0, self.force), moment: scaled(-1.0, self.moment) }
    }
}

/// Where the left line of sight is nearest to the right one.
struct Meeting {
    point: V,
    kci: f64,
    /// of the distance h along the left line
    on_h: Wrench,
    on_kci: Wrench,
}

#[inline(always)]
fn meet(left: &Ray, right: &Ray) -> Meeting {
    let (zl, zr) = (left.z, right.z);
    let dp = minus(left.eye, right.eye);
    let c = dot(zl, zr);
    let n = cross(zr, zl);
    let w = 1.0 / dot(n, n); // 1 / (1 − c²)
    let dz = add_scaled(c, zr, scaled(-1.0, zl)); // (14)
    let h = dot(dz, dp) * w; // (13)
    let kci = -dot(dp, n); // (20)
    // (17) and (22) as wrenches: the moments vanish where the rays meet
    Meeting {
        point: add_scaled(h, zl, left.eye), // (15)
        kci,
        on_h: Wrench { force: scaled(w, dz), moment: scaled(kci * w * w, add_scaled(-c, zl, zr)) },
        on_kci: Wrench { force: scaled(-1.0, n), moment: scaled(c * kci * w, n) },
    }
}

/// Both theodolites at one set of parameters.
pub(crate) struct Pair {
    left: Theodolite,
    right: Theodolite,
}

impl Pair {
    /// Everything that does not depend on the readings.
    pub(crate) fn new(q: &[f64]) -> Self {
        let (left, right) = q.split_at(LEFT);
        Pair { left: Theodolite::new(0.0, left), right: Theodolite::new(right[0], &right[1..]) }
    }

    #[inline(always)]
    fn rays(&self, readings: &[f64]) -> (Ray, Ray) {
        (self.left.sight(readings[0], readings[1]), self.right.sight(readings[2], readings[3]))
    }

    /// vo.x, vo.y, vo.z, kci1, kci2 of one line: (4) and (20).
    #[inline(always)]
    pub(crate) fn residuals(&self, line: &Line) -> [f64; 5] {
        let [upper, lower] = [&line[..4], &line[4..8]].map(|readings| {
            let (left, right) = self.rays(readings);
            meet(&left, &right)
        });
        let vo = minus(upper.point, lower.point);
        [vo[0], vo[1], vo[2] - line[8], upper.kci, lower.kci]
    }

    /// Residuals and derivatives of one line.
    #[inline(always)]
    pub(crate) fn linearise(&self, line: &Line, rows: &mut Rows) {
        let (left1, right1) = self.rays(&line[..4]);
        let (left2, right2) = self.rays(&line[4..8]);
        let (upper, lower) = (meet(&left1, &right1), meet(&left2, &right2));
        let (z1, z2) = (left1.z, left2.z);

        let (arms1, arms2) = (Arms::new(&self.left, &left1, upper.point), Arms::new(&self.left, &left2, lower.point));
        let (h1, h2) = (self.left.powers(&left1, &upper.on_h, &arms1), self.left.powers(&left2, &lower.on_h, &arms2));
        let (carried1, carried2) = (self.left.carried(&left1, &arms1), self.left.carried(&left2, &arms2));
        for k in 0..LEFT {
            // (16) and (18): carried as a part of the left ray, and along it by δh
            let moved = minus(carried1[k], carried2[k]);
            let along = add_scaled(h1[k + 1], z1, add_scaled(-h2[k + 1], z2, moved));
            (rows[0][k], rows[1][k], rows[2][k]) = (along[0], along[1], along[2]);
        }
        rows[3][..LEFT].copy_from_slice(&self.left.powers(&left1, &upper.on_kci, &arms1)[1..]);
        rows[4][..LEFT].copy_from_slice(&self.left.powers(&left2, &lower.on_kci, &arms2)[1..]);

        let (arms1, arms2) =
            (Arms::new(&self.right, &right1, upper.point), Arms::new(&self.right, &right2, lower.point));
        let (upper_h, lower_h) = (upper.on_h.opposite(), lower.on_h.opposite());
        let (h1, h2) = (self.right.powers(&right1, &upper_h, &arms1), self.right.powers(&right2, &lower_h, &arms2));
        for k in 0..=LEFT {
            let along = add_scaled(h1[k], z1, scaled(-h2[k], z2));
            (rows[0][LEFT + k], rows[1][LEFT + k], rows[2][LEFT + k]) = (along[0], along[1], along[2]);
        }
        let (upper_kci, lower_kci) = (upper.on_kci.opposite(), lower.on_kci.opposite());
        rows[3][LEFT..PARAMETERS].copy_from_slice(&self.right.powers(&right1, &upper_kci, &arms1));
        rows[4][LEFT..PARAMETERS].copy_from_slice(&self.right.powers(&right2, &lower_kci, &arms2));

        let vo = minus(upper.point, lower.point); // (4)
        let residuals = [vo[0], vo[1], vo[2] - line[8], upper.kci, lower.kci];
        for i in 0..5 {
            rows[i][RESIDUAL] = residuals[i];
        }
    }
}
