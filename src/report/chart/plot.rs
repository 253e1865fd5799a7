//! Two axes around a field, and what is drawn in it.

use maud::{Markup, html};

use super::axis::Axis;
use super::short;

/// A field with axes.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    pub(super) x: Axis,
    pub(super) y: Axis,
    /// of all with axes
    pub(super) width: f64,
    pub(super) height: f64,
}

/// Room for the axes.
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 38.0;

/// Beyond the field nothing is drawn, but near its edge a mark may reach over.
const OVER: f64 = 1e-6;

impl Plot {
    /// Where a number is across; none beyond the field.
    pub(super) fn across(&self, x: f64) -> Option<f64> {
        let share = self.x.place(x).filter(|share| (-OVER..=1.0 + OVER).contains(share))?;
        Some(LEFT + share * self.field_width())
    }

    /// Where a number is down; none beyond the field.
    pub(super) fn down(&self, y: f64) -> Option<f64> {
        let share = self.y.place(y).filter(|share| (-OVER..=1.0 + OVER).contains(share))?;
        Some(TOP + (1.0 - share) * self.field_height())
    }

    /// Where a point is; none beyond the field.
    pub(super) fn at(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        Some((self.across(x)?, self.down(y)?))
    }

    pub(super) fn field_width(&self) -> f64 {
        self.width - LEFT - RIGHT
    }

    pub(super) fn field_height(&self) -> f64 {
        self.height - TOP - BOTTOM
    }

    /// A path through points; it is interrupted where one is beyond the field.
    pub(super) fn path(&self, points: impl Iterator<Item = (f64, f64)>) -> String {
        let (mut path, mut drawing) = (String::new(), false);
        for point in points {
            match self.at(point) {
                Some((x, y)) => {
                    path.push_str(&format!("{}{} {}", if drawing { 'L' } else { 'M' }, short(x), short(y)));
                    drawing = true;
                }
                None => drawing = false,
            }
        }
        path
    }

    /// A rectangle between two points of the field.
    pub(super) fn rectangle(&self, (x0, y0): (f64, f64), (x1, y1): (f64, f64)) -> Option<String> {
        let (left, right, top, bottom) = (self.across(x0)?, self.across(x1)?, self.down(y1)?, self.down(y0)?);
        Some(format!("M{} {}H{}V{}H{}z", short(left), short(bottom), short(right), short(top), short(left)))
    }

    /// The axes with what is drawn between them, without the `svg` around it.
    pub(super) fn drawn(&self, title: &str, inside: &Markup) -> Markup {
        let (left, right, top, bottom) = (LEFT, self.width - RIGHT, TOP, self.height - BOTTOM);
        let across = |share: f64| short(left + share * (right - left));
        let down = |share: f64| short(bottom - share * (bottom - top));
        let zero = self.down(0.0).filter(|at| *at > top + 1.0 && *at < bottom - 1.0);
        html! {
            text.title x=(short(left)) y="13" { (title) }
            @for (share, label) in self.y.ticks() {
                path.rule d=(format!("M{} {}H{}", short(left), down(share), short(right))) {}
                text.tick x=(short(left - 5.0)) y=(down(share)) dy="0.32em" text-anchor="end" { (label) }
            }
            @for (share, label) in self.x.ticks() {
                path.axis d=(format!("M{} {}v4", across(share), short(bottom))) {}
                text.tick x=(across(share)) y=(short(bottom + 15.0)) text-anchor="middle" { (label) }
            }
            @if let Some(zero) = zero { path.zero d=(format!("M{} {}H{}", short(left), short(zero), short(right))) {} }
            (inside)
            path.axis d=(format!("M{} {}V{}H{}", short(left), short(top), short(bottom), short(right))) {}
            text x=(short(0.5 * (left + right))) y=(short(self.height - 6.0)) text-anchor="middle" { (self.x.label) }
            text transform=(format!("translate(12 {}) rotate(-90)", short(0.5 * (top + bottom)))) text-anchor="middle" { (self.y.label) }
        }
    }

    /// The whole as a drawing of its own.
    pub(super) fn svg(&self, title: &str, inside: &Markup) -> Markup {
        drawing(self.width, self.height, title, &self.drawn(title, inside))
    }
}

/// An `svg` of a size, which shrinks where there is less room.
pub(super) fn drawing(width: f64, height: f64, name: &str, inside: &Markup) -> Markup {
    html! {
        svg viewBox=(format!("0 0 {} {}", short(width), short(height))) width=(short(width)) height=(short(height)) role="img" aria-label=(name) {
            (inside)
        }
    }
}
