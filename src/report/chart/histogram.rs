//! How often numbers are how large.

use maud::html;

use super::axis::Axis;
use super::plot::Plot;
use super::{Figure, labelled, short, table};
use crate::report::{count, significant};
use crate::survey::{Histogram, Series, Span};

/// The normal distribution that numbers should have.
#[derive(Clone, Copy, Debug)]
pub(in crate::report) struct Curve {
    pub(in crate::report) mean: f64,
    pub(in crate::report) deviation: f64,
}

/// Points of a curve.
const CURVE: usize = 81;

/// A histogram with the curve that is expected, as counts.
pub(in crate::report) fn histogram(id: &str, of: &Series, expected: Option<Curve>) -> Option<Figure> {
    let found = Histogram::of(&of.values)?;
    let (span, width, n) = (found.span, found.width(), found.moments.count());
    let expected = expected.filter(|curve| curve.deviation > 0.0 && curve.deviation.is_finite());
    let curve: Vec<(f64, f64)> =
        expected.into_iter().flat_map(|curve| (0..CURVE).map(move |k| points(curve, span, k, n * width))).collect();
    let largest =
        found.counts.iter().map(|count| *count as f64).chain(curve.iter().map(|(_, y)| *y)).fold(1.0, f64::max);
    let plot = Plot {
        x: Axis::linear(span, labelled(&of.name, &of.unit)),
        y: Axis::linear(Span { low: 0.0, high: 1.05 * largest }, "rows"),
        width: 300.0,
        height: 190.0,
    };
    let bar = |(k, count): (usize, &usize)| {
        let (left, right) = (span.low + k as f64 * width, span.low + (k + 1) as f64 * width);
        plot.rectangle((left, 0.0), (right.min(span.high), *count as f64))
    };
    let bars: String = found.counts.iter().enumerate().filter(|(_, count)| **count > 0).filter_map(bar).collect();
    let mean = found.moments.mean().unwrap_or(0.0);
    let deviation = found.moments.deviation();
    let told = format!(
        "mean {}{}",
        significant(mean, 2),
        deviation.map_or(String::new(), |deviation| format!(", sd {}", significant(deviation, 3)))
    );
    let inside = html! {
        path.now.bars d=(bars) {}
        @if !curve.is_empty() { path.expected d=(plot.path(curve.iter().copied())) {} }
        text.soft x=(short(plot.width - 14.0)) y="13" text-anchor="end" { (told) }
    };
    let beyond = match found.beyond {
        0 => String::new(),
        n => format!("{} beyond the axis.", count(n, "row lies", "rows lie")),
    };
    let numbers = found.counts.iter().enumerate().map(|(k, count)| {
        vec![
            (span.low + k as f64 * width).to_string(),
            (span.low + (k + 1) as f64 * width).to_string(),
            count.to_string(),
        ]
    });
    Some(Figure {
        id: id.to_owned(),
        caption: beyond,
        svg: plot.svg(&of.name, &inside),
        numbers: table("from,to,rows", numbers),
    })
}

/// A point of n w φ((x − mean)/sd)/sd, the count that a bin of width w should have.
fn points(curve: Curve, span: Span, k: usize, area: f64) -> (f64, f64) {
    let x = span.low + (span.high - span.low) * k as f64 / (CURVE - 1) as f64;
    let z = (x - curve.mean) / curve.deviation;
    (x, area * (-0.5 * z * z).exp() / (curve.deviation * (2.0 * std::f64::consts::PI).sqrt()))
}
