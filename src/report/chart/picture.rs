//! The instrument, drawn as it is first seen. The page's script draws the same from other sides.

use maud::{Markup, html};
use serde_json::{Value, json};

use super::plot::drawing;
use super::short;
use crate::report::number::significant;
use crate::survey::{Frame, Point, Scene, Shot};

/// From where it is first seen: turned about z, then tilted; radians.
const AZIMUTH: f64 = -0.6;
const ELEVATION: f64 = 0.45;

/// Of the drawing.
const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 460.0;

/// Half axes of ellipsoids are at most about this share of the picture.
const LARGEST: f64 = 0.06;

/// The middle of what is shown, and the radius of a sphere that has it all.
fn extent(scene: &Scene) -> ([f64; 3], f64) {
    let frames = scene.shots.iter().flat_map(|shot| &shot.chains).flat_map(|chain| &chain.frames);
    let points = || frames.clone().map(|frame| frame.origin).chain(scene.all_points().map(|point| point.at));
    let fold = |pick: fn(f64, f64) -> f64, from: f64| {
        points().fold([from; 3], |so_far, at| std::array::from_fn(|i| pick(value(so_far, i), value(at, i))))
    };
    let (low, high) = (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY));
    let middle = std::array::from_fn(|i| 0.5 * (value(low, i) + value(high, i)));
    let radius = points().map(|at| distance(at, middle)).fold(0.0, f64::max);
    (middle, if radius > 0.0 { radius } else { 1.0 })
}

fn value(of: [f64; 3], i: usize) -> f64 {
    of.get(i).copied().unwrap_or(0.0)
}

fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// How many times ellipsoids are magnified: a round number by which the largest is well seen; none where there are none.
pub(in crate::report) fn magnification(scene: &Scene) -> Option<f64> {
    let (_, radius) = extent(scene);
    // the trace is the square of the half diagonal
    let size =
        |point: &Point| point.covariance.map(|c| c.iter().enumerate().map(|(i, row)| value(*row, i)).sum::<f64>());
    let largest = scene.all_points().filter_map(size).fold(0.0, f64::max).sqrt();
    let exact = LARGEST * radius / largest;
    let power = 10f64.powf(exact.log10().floor());
    let round = [5.0, 2.0, 1.0].into_iter().map(|k| k * power).find(|round| *round <= exact * (1.0 + 1e-12));
    round.filter(|round| round.is_finite() && *round > 0.0)
}

/// From numbers in the model's unit to the drawing.
struct View {
    middle: [f64; 3],
    scale: f64,
    radius: f64,
    magnified: f64,
}

impl View {
    /// Right and down on the drawing: orthographic, from the first side.
    fn at(&self, point: [f64; 3]) -> (f64, f64) {
        let (right, up) = self.turned(std::array::from_fn(|i| value(point, i) - value(self.middle, i)));
        (0.5 * WIDTH + self.scale * right, 0.5 * HEIGHT - self.scale * up)
    }

    fn turned(&self, [x, y, z]: [f64; 3]) -> (f64, f64) {
        let ((sa, ca), (se, ce)) = (AZIMUTH.sin_cos(), ELEVATION.sin_cos());
        (ca * x - sa * y, se * (sa * x + ca * y) + ce * z)
    }

    fn line(&self, from: [f64; 3], to: [f64; 3]) -> String {
        let ((x0, y0), (x1, y1)) = (self.at(from), self.at(to));
        format!("M{} {}L{} {}", short(x0), short(y0), short(x1), short(y1))
    }

    fn axes(&self, frame: &Frame, length: f64) -> [(String, &'static str); 3] {
        let names = ["x", "y", "z"];
        let tip =
            |axis: [f64; 3]| std::array::from_fn(|i| value(frame.origin, i) + length * self.radius * value(axis, i));
        let [x, y, z] = frame.axes;
        let [nx, ny, nz] = names;
        [
            (self.line(frame.origin, tip(x)), nx),
            (self.line(frame.origin, tip(y)), ny),
            (self.line(frame.origin, tip(z)), nz),
        ]
    }

    /// The outline of the ellipsoid of one standard deviation, magnified: that of the covariance P C Pᵀ of the projection.
    fn outline(&self, c: [[f64; 3]; 3]) -> (f64, f64, f64) {
        let unit = |i: usize| self.turned(std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }));
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for (i, row) in c.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let ((xi, yi), (xj, yj)) = (unit(i), unit(j));
                xx += xi * entry * xj;
                xy += xi * entry * yj;
                yy += yi * entry * yj;
            }
        }
        let (mean, half) = (0.5 * (xx + yy), f64::hypot(0.5 * (xx - yy), xy));
        let k = self.magnified * self.scale;
        let angle = -0.5 * f64::atan2(2.0 * xy, xx - yy).to_degrees();
        (k * (mean + half).max(0.0).sqrt(), k * (mean - half).max(0.0).sqrt(), angle)
    }
}

/// The picture with one row's chains, and all points.
pub(in crate::report) fn picture(scene: &Scene) -> (Markup, Value) {
    let (middle, radius) = extent(scene);
    let magnified = magnification(scene).unwrap_or(0.0);
    let scale = 0.46 * HEIGHT / radius;
    let view = View { middle, scale, radius, magnified };
    let shown = scene.shots.first();
    let inside = html! {
        g #scene {
            @for (path, axis) in view.axes(&BASE, 0.16) { path class=(format!("axis-{axis}")) d=(path) {} }
            @if let Some(shot) = shown { (drawn(&view, shot)) }
            @for point in scene.all_points() { (ellipsoid(&view, point)) }
        }
    };
    let rounded = |x: f64| significant(x, 6).parse::<f64>().unwrap_or(0.0);
    let triple = |v: [f64; 3]| v.map(rounded);
    let frame = |f: &Frame| json!({"n": f.name, "o": triple(f.origin), "a": f.axes.map(triple)});
    let point = |p: &Point| json!({"n": p.name, "p": triple(p.at), "c": p.covariance.map(|c| c.map(triple))});
    let shot = |s: &Shot| {
        json!({
            "m": s.measurement, "r": s.row + 1,
            "chains": s.chains.iter().map(|c| json!({"n": c.name, "f": c.frames.iter().map(frame).collect::<Vec<_>>()})).collect::<Vec<_>>(),
            "sights": s.sights.iter().map(|line| line.map(triple)).collect::<Vec<_>>(),
            "points": s.points.iter().map(point).collect::<Vec<_>>(),
        })
    };
    let data = json!({
        "unit": scene.unit, "middle": triple(middle), "radius": rounded(radius), "magnified": magnified,
        "azimuth": AZIMUTH, "elevation": ELEVATION, "width": WIDTH, "height": HEIGHT,
        "shots": scene.shots.iter().map(shot).collect::<Vec<_>>(),
        "points": scene.points.iter().map(point).collect::<Vec<_>>(),
    });
    (drawing(WIDTH, HEIGHT, "The instrument", &inside), data)
}

const BASE: Frame =
    Frame { name: String::new(), origin: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

fn drawn(view: &View, shot: &Shot) -> Markup {
    html! {
        @for line in &shot.sights { path.sight d=({ let [from, to] = *line; view.line(from, to) }) {} }
        @for chain in &shot.chains {
            @let path: String = chain.frames.iter().zip(chain.frames.iter().skip(1)).map(|(one, next)| view.line(one.origin, next.origin)).collect();
            path.link d=(path) {}
            @for frame in &chain.frames {
                @for (path, axis) in view.axes(frame, 0.06) { path class=(format!("axis-{axis}")) d=(path) {} }
            }
            @if let Some(end) = chain.frames.last() {
                @let (x, y) = view.at(end.origin);
                text x=(short(x + 6.0)) y=(short(y + 12.0)) { (chain.name) }
            }
        }
    }
}

fn ellipsoid(view: &View, point: &Point) -> Markup {
    let (x, y) = view.at(point.at);
    html! {
        @if let Some(c) = point.covariance {
            @let (long, wide, angle) = view.outline(c);
            ellipse.known rx=(short(long)) ry=(short(wide)) transform=(format!("translate({} {}) rotate({})", short(x), short(y), short(angle))) {
                title { (point.name) }
            }
        }
        circle.point cx=(short(x)) cy=(short(y)) r="1.5" {}
    }
}
