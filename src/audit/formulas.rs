//! Hand-derived formulas against dual numbers.

use std::sync::Arc;

use num_dual::{Dual64, DualStruct};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;

use super::cause::{Cause, Seen, cause};
use super::points::{Place, Point, measured, nudged, places, random};
use super::repair::{Repair, repair};
use super::shrink::{CounterExample, shrink};
use crate::compile::{Formula, Formulas, Program};
use crate::diag::{Source, Span};
use crate::graph::{Graph, Scalar, Tape};
use crate::model::Model;

/// Random points at which a formula is looked at.
pub(super) const POINTS: usize = 12;
/// Points that are tried to have so many at which everything is defined.
pub(super) const TRIED: u64 = 400;
/// Copies of a point that differ in the last digits of its numbers: what differs between them is rounding.
pub(super) const COPIES: usize = 6;
/// A difference beyond so many times the rounding is none.
pub(super) const BEYOND: f64 = 60.0;
/// Another formula may lose so many times as much to rounding as the exact derivative does,
const SCATTER: f64 = 1e3;
/// which counts as this share of its size at least.
const UNSTABLE: f64 = 1e-11;
/// Digits that no comparison of doubles goes beyond.
pub(super) const MOST_DIGITS: f64 = 16.0;

/// A formula, compared.
#[derive(Clone, Debug)]
pub struct CheckedFormula {
    /// Its measurement.
    pub measurement: String,
    /// Of what: `kci1`.
    pub of: String,
    /// The component that is farthest off: `vo.x`.
    pub component: String,
    /// By what; by nothing where it is another form of the quantity itself.
    pub by: Option<String>,
    /// Whether it agrees at all points, but for rounding.
    pub agrees: bool,
    /// To how many digits of the largest value of its kind, where it is farthest off.
    pub digits: f64,
    /// Points that were looked at; none where something is undefined at every one.
    pub points: usize,
    /// The value of the formula and the exact one where it is farthest off.
    pub worst: Option<(f64, f64)>,
    /// What it looks like.
    pub cause: Option<Cause>,
    /// The single change that makes it right.
    pub repair: Option<Repair>,
    /// The simplest point at which it is still wrong.
    pub counter_example: Option<CounterExample>,
    /// The formula as written.
    pub text: String,
    /// Where it stands in the model.
    pub span: Span,
}

/// One formula at one point: its components, the exact ones, and how far rounding makes the differences scatter.
#[derive(Clone, Debug)]
pub(super) struct Compared {
    pub(super) given: Vec<f64>,
    pub(super) exact: Vec<f64>,
    pub(super) rounding: Vec<f64>,
    /// how far rounding makes the exact ones scatter
    scatter: Vec<f64>,
    /// the largest derivative of each component's quantity by anything of this dimension, from which small ones are left by cancellation
    pub(super) scales: Vec<f64>,
}

impl Compared {
    /// Whether a component is off by more than rounding.
    pub(super) fn is_off(&self, component: usize) -> bool {
        let off = self.given[component] - self.exact[component];
        // a formula that is not defined where the derivative is, is wrong
        !off.is_finite() || off.abs() > self.allowed(component)
    }

    pub(super) fn allowed(&self, component: usize) -> f64 {
        let kind = self.scales[component].max(self.exact[component].abs());
        let size = kind.max(self.given[component].abs());
        // a formula that scatters far more than the derivative does is no formula of it: its denominator may be zero
        let most = SCATTER * (self.scatter[component] + UNSTABLE * kind);
        BEYOND * (self.rounding[component].min(most) + f64::EPSILON * size)
    }

    /// How far a component is off, as a multiple of what rounding allows.
    pub(super) fn share(&self, component: usize) -> f64 {
        let off = (self.given[component] - self.exact[component]).abs();
        if off.is_finite() { off / self.allowed(component).max(f64::MIN_POSITIVE) } else { f64::INFINITY }
    }

    pub(super) fn any_off(&self) -> bool {
        (0..self.given.len()).any(|component| self.is_off(component))
    }
}

/// A formula as a tape.
pub(super) struct Comparison<'f> {
    tape: Tape,
    graph: &'f Graph,
    formula: &'f Formula,
    scale: f64,
}

impl<'f> Comparison<'f> {
    pub(super) fn new(graph: &'f Graph, formula: &'f Formula, given: &[Scalar], scale: f64) -> Comparison<'f> {
        let outputs: Vec<Scalar> = formula.values.iter().chain(given).copied().collect();
        Comparison { tape: Tape::lower(graph, &outputs), graph, formula, scale }
    }

    /// Components of the formula, and of the exact derivative; none where that is undefined.
    fn at_once(&self, point: &Point) -> Option<(Vec<f64>, Vec<f64>)> {
        let (mut leaves, mut inputs): (Vec<Dual64>, Vec<Dual64>) = (dual(&point.leaves), dual(&point.inputs));
        if let Some(by) = &self.formula.by {
            let parameters = (0..point.leaves.len()).find(|&i| self.graph.known_parameter(i as u32) == Some(by.leaf));
            match parameters {
                Some(leaf) => leaves[leaf].eps = 1.0,
                None => {
                    let input = (0..point.inputs.len()).find(|&i| self.graph.known_input(i as u32) == Some(by.leaf))?;
                    inputs[input].eps = 1.0;
                }
            }
        }
        leaves.resize(leaves.len().max(self.tape.parameters()), Dual64::from(0.0));
        inputs.resize(inputs.len().max(self.tape.inputs()), Dual64::from(0.0));
        let all = self.tape.evaluate(&leaves, &inputs);
        let (values, given) = all.split_at(self.formula.values.len());
        let exact = |value: &Dual64| if self.formula.by.is_some() { value.eps } else { value.re() };
        let exact: Vec<f64> = values.iter().map(exact).collect();
        let given: Vec<f64> = given.iter().map(DualStruct::re).collect();
        let defined = exact.iter().chain(values.iter().map(|value| &value.re)).all(|number| number.is_finite());
        defined.then_some((given, exact))
    }

    /// Both, and rounding.
    pub(super) fn at(&self, point: &Point, seed: u64) -> Option<Compared> {
        let found = compared(point, seed, |point| self.at_once(point))?;
        Some(Compared { scales: vec![self.scale; found.given.len()], ..found })
    }
}

/// Given numbers and exact ones at a point, and rounding as copies of the point that differ in their last digits show it; scales are
/// left to be set.
pub(super) fn compared(
    point: &Point,
    seed: u64,
    at_once: impl Fn(&Point) -> Option<(Vec<f64>, Vec<f64>)>,
) -> Option<Compared> {
    let (given, exact) = at_once(point)?;
    let (mut rounding, mut scatter) = (vec![0.0_f64; given.len()], vec![0.0_f64; given.len()]);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..COPIES {
        let mut nudge = |x: &f64| nudged(*x, &mut random);
        let near = Point {
            leaves: point.leaves.iter().map(&mut nudge).collect(),
            inputs: point.inputs.iter().map(&mut nudge).collect(),
        };
        let Some((again, truth)) = at_once(&near) else { continue };
        for (i, (most, scatter)) in rounding.iter_mut().zip(&mut scatter).enumerate() {
            *scatter = scatter.max((truth[i] - exact[i]).abs());
            let change = (again[i] - truth[i]) - (given[i] - exact[i]);
            // an exact value that moves by its own slope is known no better than that
            let slope = f64::EPSILON * (truth[i] - exact[i]).abs();
            *most = most.max(change.abs()).max(slope);
        }
    }
    Some(Compared { scales: vec![0.0; given.len()], given, exact, rounding, scatter })
}

fn dual(numbers: &[f64]) -> Vec<Dual64> {
    numbers.iter().map(|&number| Dual64::from(number)).collect()
}

/// Compares all formulas of a model with the exact derivatives, at points of a seed. With `mend`, the change that makes a wrong one
/// right is looked for.
pub fn check_formulas(
    model: &Model,
    source: &Arc<Source>,
    program: &Program,
    all: &[Formulas],
    seed: u64,
    mend: bool,
) -> Vec<CheckedFormula> {
    let mut checked: Vec<CheckedFormula> = Vec::new();
    for formulas in all {
        let measurement = &program.measurements[formulas.measurement];
        let places = places(program, measurement);
        let points = points_of(program, formulas.measurement, &places, seed);
        let mut looked: Vec<Looked> = formulas.all.iter().map(|one| Looked::at(formulas, one, &points, seed)).collect();
        let scales: Vec<f64> = looked.iter().map(|one| scale(&looked, one)).collect();
        looked.iter_mut().zip(&scales).for_each(|(one, scale)| one.set_scale(*scale));
        let first: usize = checked.len();
        for (number, looked) in looked.iter().enumerate() {
            let (mut found, off) = looked.verdict(&measurement.name, &places, seed);
            if let Some(points) = off.filter(|_| mend) {
                // one text for many parameters has one mistake, or none that is found
                let known = checked[first..].iter().find(|other| other.span == found.span && !other.agrees);
                found.repair = match known {
                    Some(other) => other.repair.clone(),
                    None => repair(model, source, (formulas.measurement, number), &scales, &points),
                };
            }
            checked.push(found);
        }
    }
    checked
}

/// The largest derivative of the same quantity by anything of the same dimension.
fn scale(all: &[Looked], one: &Looked) -> f64 {
    let kind = |one: &Looked| {
        let formula = one.comparison.formula;
        (formula.of.clone(), formula.by.as_ref().map(|by| by.dimension.without_angle()))
    };
    let wanted = kind(one);
    let alike = all.iter().filter(|other| kind(other) == wanted);
    let values = alike.flat_map(|other| other.seen.iter().flat_map(|(_, at)| &at.exact));
    values.fold(0.0, |most, value| most.max(value.abs()))
}

/// Points at which to look: where a scenario measures, else at random.
pub(super) fn points_of(program: &Program, measurement: usize, places: &[Place], seed: u64) -> Vec<Point> {
    let declared = &program.measurements[measurement];
    let mut drawn = (0..TRIED).map(|salt| random(declared, places, seed.wrapping_add(salt)));
    let mut points = Vec::new();
    // where inputs fit the parameters, residuals all but vanish and a wrong form of one may as well: half of the points are elsewhere
    for point in measured(program, measurement, places, seed, POINTS / 2) {
        points.push(point);
        points.extend(drawn.next());
    }
    points.extend(drawn);
    points
}

/// A formula, and what is seen of it at points.
struct Looked<'f> {
    comparison: Comparison<'f>,
    seen: Vec<(Point, Compared)>,
}

impl<'f> Looked<'f> {
    fn at(formulas: &'f Formulas, formula: &'f Formula, points: &[Point], seed: u64) -> Looked<'f> {
        let comparison = Comparison::new(&formulas.graph, formula, &formula.given, 0.0);
        let seen = points.iter().enumerate().filter_map(|(salt, point)| {
            let compared = comparison.at(point, seed.wrapping_add(salt as u64))?;
            Some((point.clone(), compared))
        });
        Looked { seen: seen.take(POINTS).collect(), comparison }
    }

    fn set_scale(&mut self, scale: f64) {
        self.comparison.scale = scale;
        self.seen.iter_mut().for_each(|(_, at)| at.scales.fill(scale));
    }

    /// The verdict; with the points, the worst first, where it does not agree.
    fn verdict(&self, measurement: &str, places: &[Place], seed: u64) -> (CheckedFormula, Option<Vec<Point>>) {
        let (seen, comparison) = (&self.seen, &self.comparison);
        let formula = comparison.formula;
        let components = formula.names.len();
        let mut found = CheckedFormula {
            measurement: measurement.to_owned(),
            of: formula.of.clone(),
            component: formula.of.clone(),
            by: formula.by.as_ref().map(|by| by.name.clone()),
            agrees: !seen.is_empty(),
            digits: MOST_DIGITS,
            points: seen.len(),
            worst: None,
            cause: None,
            repair: None,
            counter_example: None,
            text: formula.text.clone(),
            span: formula.span,
        };
        let entries = (0..seen.len()).flat_map(|k| (0..components).map(move |i| (k, i)));
        let worst = entries.max_by(|a, b| seen[a.0].1.share(a.1).total_cmp(&seen[b.0].1.share(b.1)));
        let Some((k, i)) = worst else { return (found, None) };
        let at = &seen[k].1;
        found.component = formula.names[i].clone();
        found.worst = Some((at.given[i], at.exact[i]));
        // digits count from the largest exact value of the component at any point
        let size = seen.iter().fold(at.given[i].abs(), |most, (_, at)| most.max(at.exact[i].abs()));
        found.digits = digits(at.given[i] - at.exact[i], size);
        found.agrees = !at.is_off(i);
        if found.agrees {
            return (found, None);
        }
        let of = |at: &Compared, i: usize| Seen { given: at.given[i], exact: at.exact[i], allowed: at.allowed(i) };
        let all: Vec<Seen> = seen.iter().flat_map(|(_, at)| (0..components).map(move |i| of(at, i))).collect();
        found.cause = cause(&all);
        let still = |point: &Point| comparison.at(point, seed).is_some_and(|at| at.any_off());
        found.counter_example = Some(shrink(&seen[k].0, places, &still, |point| {
            let at = comparison.at(point, seed)?;
            let i = (0..components).find(|&i| at.is_off(i))?;
            Some((formula.names[i].clone(), at.given[i], at.exact[i]))
        }));
        let most = |at: &Compared| (0..components).map(|i| at.share(i)).fold(0.0, f64::max);
        let mut points: Vec<(f64, Point)> = seen.iter().map(|(point, at)| (most(at), point.clone())).collect();
        points.sort_by(|a, b| b.0.total_cmp(&a.0));
        (found, Some(points.into_iter().map(|(_, point)| point).collect()))
    }
}

/// To how many digits of a size two numbers agree that differ by so much.
pub(super) fn digits(off: f64, size: f64) -> f64 {
    match off.abs() {
        0.0 => MOST_DIGITS,
        off if off.is_nan() => 0.0,
        off => (size / off).log10().clamp(0.0, MOST_DIGITS),
    }
}
