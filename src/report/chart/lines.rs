//! How the search went, and how well directions are seen.

use maud::html;

use super::axis::Axis;
use super::plot::Plot;
use super::{Figure, short, table};
use crate::survey::Span;

/// A step of the search.
pub(in crate::report) struct Step {
    pub(in crate::report) cost: f64,
    /// where it led, and whether it was taken
    pub(in crate::report) trial: Option<f64>,
    pub(in crate::report) accepted: bool,
}

/// The span of what a logarithm can show.
fn positive(values: impl Iterator<Item = f64>) -> Option<Span> {
    values
        .filter(|value| *value > 0.0 && value.is_finite())
        .map(|value| Span { low: value, high: value })
        .reduce(Span::with)
}

/// Cost by trial step; steps that were not taken are crosses.
pub(in crate::report) fn trace(id: &str, steps: &[Step], last: f64) -> Option<Figure> {
    let begin = steps.first()?.cost;
    let all = steps.iter().filter_map(|step| step.trial).chain([begin, last]);
    let span = positive(all)?;
    let plot = Plot {
        x: Axis::linear(Span { low: 0.0, high: steps.len() as f64 }, "trial step").roomy(),
        y: Axis::logarithmic(span, "cost"),
        width: 420.0,
        height: 220.0,
    };
    let trial = |(k, step): (usize, &Step)| Some(((k + 1) as f64, step.trial?, step.accepted));
    let taken =
        || steps.iter().enumerate().filter_map(trial).filter(|(.., accepted)| *accepted).map(|(x, y, _)| (x, y));
    let refused =
        || steps.iter().enumerate().filter_map(trial).filter(|(.., accepted)| !*accepted).map(|(x, y, _)| (x, y));
    let line = [(0.0, begin)].into_iter().chain(taken());
    let inside = html! {
        path.now.line d=(plot.path(line.clone())) {}
        @for (x, y) in line.filter_map(|point| plot.at(point)) { circle.now cx=(short(x)) cy=(short(y)) r="3" {} }
        @for (x, y) in refused().filter_map(|point| plot.at(point)) {
            path.was.line d=(format!("M{} {}l6 6m0 -6l-6 6", short(x - 3.0), short(y - 3.0))) {}
        }
    };
    let numbers = steps.iter().enumerate().map(|(k, step)| {
        vec![
            (k + 1).to_string(),
            step.cost.to_string(),
            step.trial.map_or(String::new(), |trial| trial.to_string()),
            step.accepted.to_string(),
        ]
    });
    let crossed = steps.iter().filter(|step| !step.accepted).count();
    Some(Figure {
        id: id.to_owned(),
        caption: match crossed {
            0 => "Cost after each step; every step was taken.".into(),
            n => format!(
                "Cost after each step; crosses are the {n} that were not taken, as the true cost did not fall enough."
            ),
        },
        svg: plot.svg("Convergence", &inside),
        numbers: table("step,cost before,cost after,taken", numbers),
    })
}

/// Singular values, the largest first; beyond the rank they are not seen.
pub(in crate::report) fn spectrum(id: &str, values: &[f64], rank: usize) -> Option<Figure> {
    /// what rounding leaves of a zero
    const ROUNDING: f64 = 1e-17;
    let largest = values.first().copied().filter(|value| *value > 0.0)?;
    let shown = |value: f64| value.max(ROUNDING * largest);
    let plot = Plot {
        x: Axis::linear(Span { low: 1.0, high: values.len() as f64 }, "number").roomy(),
        y: Axis::logarithmic(positive(values.iter().map(|value| shown(*value)))?, "singular value"),
        width: 420.0,
        height: 220.0,
    };
    let inside = html! {
        @for (k, value) in values.iter().enumerate() {
            @if let Some((x, y)) = plot.at(((k + 1) as f64, shown(*value))) {
                circle class=(if k < rank { "now" } else { "was" }) cx=(short(x)) cy=(short(y)) r="3" {}
            }
        }
    };
    let ratio = values.last().copied().unwrap_or(0.0) / largest;
    let numbers = values.iter().enumerate().map(|(k, value)| vec![(k + 1).to_string(), value.to_string()]);
    Some(Figure {
        id: id.to_owned(),
        caption: format!(
            "Of the Jacobian with normalised columns; smallest over largest {}. {} of {} directions are seen by the data.",
            crate::report::significant(ratio, 2),
            rank.min(values.len()),
            values.len()
        ),
        svg: plot.svg("Singular values", &inside),
        numbers: table("number,singular value", numbers),
    })
}
