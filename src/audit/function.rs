//! A function that somebody wrote for a Jacobian, against dual numbers.

use super::cause::{Cause, Seen, cause};
use super::formulas::{Compared, compared, digits, points_of};
use super::points::{Place, Point, places};
use super::shrink::shrink;
use crate::compile::{self, Measurement, Program};
use crate::eval::{Evaluator, Leaf};
use crate::problem::Selection;
use crate::unit::Dimension;

/// Derivatives by residual and then by parameter, from parameters and inputs.
pub type JacobianFunction<'f> = dyn Fn(&[f64], &[f64]) -> Vec<f64> + 'f;

/// A function for the Jacobian of a measurement, compared.
#[derive(Clone, Debug)]
pub struct CheckedFunction {
    /// The measurement.
    pub measurement: String,
    /// What is differentiated: the rows.
    pub residuals: Vec<String>,
    /// By what: the columns.
    pub parameters: Vec<String>,
    /// Points that were looked at.
    pub points: usize,
    /// The entries that are wrong, in the order of the function.
    pub wrong: Vec<WrongEntry>,
    /// What they look like: all, columns, rows, or entries, each entry once.
    pub blame: Vec<Blame>,
    /// The simplest point at which an entry is still wrong.
    pub counter_example: Option<Mismatch>,
}

/// An entry that is wrong, where it is farthest off; in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct WrongEntry {
    /// The derivative of what.
    pub residual: String,
    /// By what.
    pub by: String,
    /// As the function gives it.
    pub given: f64,
    /// As it is.
    pub exact: f64,
    /// To how many digits of the largest derivative of the residual by anything of this kind.
    pub digits: f64,
}

/// What some entries look like.
#[derive(Clone, Debug, PartialEq)]
pub struct Blame {
    /// Which: `all of it`, `by L1.alpha`, `of vo.x`, `of vo.x by L1.alpha`.
    pub of: String,
    /// In words.
    pub sentence: String,
}

/// An entry at a point, in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct Mismatch {
    /// Names of parameters and inputs with their values and units; those at their nominal value, and inputs at zero, left out.
    pub at: Vec<(String, f64, String)>,
    /// Which: `of vo.x by L1.alpha`.
    pub entry: String,
    /// As the function gives it.
    pub given: f64,
    /// As it is.
    pub exact: f64,
}

/// By what a column differentiates.
struct Column {
    name: String,
    dimension: Dimension,
    nominal: f64,
    /// the leaf with its value, and the one by which to differentiate; none where the measurement does not use it
    leaves: Option<(usize, usize)>,
}

/// Compares `function(q, x)`, derivatives by residual and then by parameter, with the exact ones: at the nominal values and at so many
/// random points of a seed. q are the free coordinates of the model in declared order, x the inputs of the measurement, all numbers
/// in reported units. Of a family, q has the members that a row names, one for each way in which the measurement names them.
///
/// # Errors
/// Where the function gives too few numbers or too many, or no point is found at which the derivatives exist.
///
/// ```
/// use phical::audit::check_function;
/// use phical::compile::compile;
/// use phical::diag::Source;
/// use phical::model::load;
/// # fn main() -> Result<(), phical::diag::Diagnostics> {
/// let source = Source::new("model.ron", r#"(name: "line", parameters: {"a": Scalar(Free(1)), "b": Scalar(Free(2))},
///     measurements: {"m": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - a - b*x"})})"#);
/// let (program, _) = compile(&load(&source)?.0, &source, &[])?;
/// let found = check_function(&program, 0, &Default::default(), 5, 0, &|_, x| vec![-1.0, x[0]]).expect("two numbers");
/// assert_eq!(found.wrong.len(), 1);
/// assert_eq!((found.blame[0].of.as_str(), found.blame[0].sentence.as_str()), ("by b", "it is the negative"));
/// # Ok(())
/// # }
/// ```
pub fn check_function(
    program: &Program,
    measurement: usize,
    selection: &Selection,
    points: usize,
    seed: u64,
    function: &JacobianFunction,
) -> Result<CheckedFunction, String> {
    let declared = &program.measurements[measurement];
    let places = places(program, declared);
    let drawn = points_of(program, measurement, &places, seed);
    let of = Of { program, declared, columns: columns(program, declared, selection), function };
    // what is held stays where it is, for the function may not know of it
    let (free, held): (Vec<Place>, Vec<Place>) = places.into_iter().partition(|place| of.moves(place));
    let drawn = drawn.into_iter().map(|point| with_nominal(point, &held)).filter(|point| of.exact(point).is_some());
    let drawn: Vec<Point> = drawn.take(points.max(1)).collect();
    let nominal = drawn.first().map(|first| with_nominal(first.clone(), &free));
    let all = nominal.into_iter().chain(drawn.into_iter().take(points));
    let (m, n) = (declared.residuals.len(), of.columns.len());
    let mut seen = Vec::new();
    for (salt, point) in all.filter(|point| of.exact(point).is_some()).enumerate() {
        let given = of.given(&point).len();
        if given != m * n {
            return Err(format!("the function gives {given} numbers: {m} residuals by {n} parameters are {}", m * n));
        }
        seen.extend(of.at(&point, seed.wrapping_add(salt as u64)).map(|at| (point, at)));
    }
    if seen.is_empty() {
        return Err("no point was found at which the derivatives exist".into());
    }
    Ok(of.verdict(&free, &seen, seed))
}

/// A point with parameters at their nominal values.
fn with_nominal(mut point: Point, places: &[Place]) -> Point {
    places.iter().filter(|place| place.leaf.is_ok()).for_each(|place| point.set(place, place.nominal));
    point
}

/// A function, and of what it should be the Jacobian.
struct Of<'f> {
    program: &'f Program,
    declared: &'f Measurement,
    columns: Vec<Column>,
    function: &'f JacobianFunction<'f>,
}

impl Of<'_> {
    fn reported(&self, value: f64, dimension: Dimension) -> f64 {
        self.program.units.to_reported(value, dimension)
    }

    /// Whether a place is an input or a free coordinate.
    fn moves(&self, place: &Place) -> bool {
        let own = |leaf: usize| self.columns.iter().any(|column| column.leaves.is_some_and(|(value, _)| value == leaf));
        place.leaf.map_or(true, own)
    }

    /// What the function gives.
    fn given(&self, point: &Point) -> Vec<f64> {
        let value = |column: &Column| match column.leaves {
            Some((leaf, _)) => self.reported(point.leaves[leaf], column.dimension),
            None => self.reported(column.nominal, column.dimension),
        };
        let q: Vec<f64> = self.columns.iter().map(value).collect();
        let inputs = point.inputs.iter().zip(&self.declared.inputs);
        let x: Vec<f64> = inputs.map(|(&value, input)| self.reported(value, input.unit.dimension)).collect();
        (self.function)(&q, &x)
    }

    /// The derivatives, in reported units; none where something is undefined.
    fn exact(&self, point: &Point) -> Option<Vec<f64>> {
        let (m, n) = (self.declared.residuals.len(), self.columns.len());
        let used: Vec<(usize, usize)> =
            self.columns.iter().enumerate().filter_map(|(j, column)| Some((j, column.leaves?.1))).collect();
        let mut evaluator =
            Evaluator::new(&self.declared.tape, used.iter().map(|(_, leaf)| Leaf::Parameter(*leaf)).collect());
        let (mut values, mut derivatives) = (vec![0.0; m], vec![0.0; m * used.len()]);
        evaluator.begin(&point.leaves);
        evaluator.row(&point.inputs, &mut values, &mut derivatives);
        let mut exact = vec![0.0; m * n];
        for (i, residual) in self.declared.residuals.iter().enumerate() {
            for (k, (j, _)) in used.iter().enumerate() {
                let factor = self.reported(1.0, residual.dimension) / self.reported(1.0, self.columns[*j].dimension);
                exact[i * n + j] = derivatives[i * used.len() + k] * factor;
            }
        }
        values.iter().chain(&exact).all(|number| number.is_finite()).then_some(exact)
    }

    fn at(&self, point: &Point, seed: u64) -> Option<Compared> {
        let mut found = compared(point, seed, |point| Some((self.given(point), self.exact(point)?)))?;
        let n = self.columns.len();
        let kind = |j: usize| self.columns[j].dimension.without_angle();
        for at in 0..found.exact.len() {
            let line = &found.exact[at / n * n..][..n];
            let alike = line.iter().enumerate().filter(|(j, _)| kind(*j) == kind(at % n));
            found.scales[at] = alike.fold(0.0, |most, (_, derivative)| most.max(derivative.abs()));
        }
        Some(found)
    }

    fn entry(&self, at: usize) -> String {
        let n = self.columns.len();
        format!("of {} by {}", self.declared.residuals[at / n].name, self.columns[at % n].name)
    }

    fn verdict(&self, places: &[Place], seen: &[(Point, Compared)], seed: u64) -> CheckedFunction {
        let (m, n) = (self.declared.residuals.len(), self.columns.len());
        let mut found = CheckedFunction {
            measurement: self.declared.name.clone(),
            residuals: self.declared.residuals.iter().map(|residual| residual.name.clone()).collect(),
            parameters: self.columns.iter().map(|column| column.name.clone()).collect(),
            points: seen.len(),
            wrong: Vec::new(),
            blame: Vec::new(),
            counter_example: None,
        };
        let off: Vec<usize> = (0..m * n).filter(|&at| seen.iter().any(|(_, one)| one.is_off(at))).collect();
        for &at in &off {
            let worst = seen.iter().max_by(|a, b| a.1.share(at).total_cmp(&b.1.share(at)));
            let Some((_, worst)) = worst else { continue };
            let (given, exact) = (worst.given[at], worst.exact[at]);
            found.wrong.push(WrongEntry {
                residual: found.residuals[at / n].clone(),
                by: found.parameters[at % n].clone(),
                given,
                exact,
                digits: digits(given - exact, worst.scales[at].max(given.abs())),
            });
        }
        found.blame = self.blame(seen, &off);
        // the point at which most is wrong
        let count = |one: &Compared| off.iter().filter(|&&at| one.is_off(at)).count();
        let from = seen.iter().max_by_key(|(_, one)| count(one)).filter(|_| !off.is_empty());
        found.counter_example = from.map(|(point, _)| self.counter_example(point, places, seed));
        found
    }

    /// What entries look like that are off: as few words for as many as there are.
    fn blame(&self, seen: &[(Point, Compared)], off: &[usize]) -> Vec<Blame> {
        let (m, n) = (self.declared.residuals.len(), self.columns.len());
        let mut left = off.to_vec();
        let mut all = Vec::new();
        let column = |j: usize| (0..m).map(move |i| i * n + j).collect::<Vec<_>>();
        let row = |i: usize| (0..n).map(move |j| i * n + j).collect::<Vec<_>>();
        let mut groups = vec![("all of it".to_owned(), (0..m * n).collect::<Vec<_>>())];
        groups.extend((0..n).map(|j| (format!("by {}", self.columns[j].name), column(j))));
        groups.extend((0..m).map(|i| (format!("of {}", self.declared.residuals[i].name), row(i))));
        groups.extend(off.iter().map(|&at| (self.entry(at), vec![at])));
        for (number, (of, entries)) in groups.into_iter().enumerate() {
            if !entries.iter().any(|at| left.contains(at)) {
                continue;
            }
            let numbers: Vec<Seen> =
                seen.iter().flat_map(|(_, one)| entries.iter().map(|&at| number_of(one, at))).collect();
            // one number that is none says nothing of its neighbours
            let whole = |found: &Cause| *found != Cause::Undefined || numbers.iter().all(|one| !one.given.is_finite());
            let named = cause(&numbers).filter(whole).as_ref().map(Cause::sentence);
            let is_column = (1..=n).contains(&number);
            let other = || is_column.then(|| self.other_column(seen, number - 1)).flatten();
            if let Some(sentence) = named.or_else(other) {
                left.retain(|at| !entries.contains(at));
                all.push(Blame { of, sentence });
            }
        }
        all
    }

    /// Which other column stands in the place of one.
    fn other_column(&self, seen: &[(Point, Compared)], j: usize) -> Option<String> {
        let (m, n) = (self.declared.residuals.len(), self.columns.len());
        let is = |k: &usize| {
            let near = |one: &Compared, i: usize| {
                let off = (one.given[i * n + j] - one.exact[i * n + k]).abs();
                off <= one.allowed(i * n + j).max(one.allowed(i * n + k))
            };
            *k != j && seen.iter().all(|(_, one)| (0..m).all(|i| near(one, i)))
        };
        (0..n).find(is).map(|k| format!("it is the derivative by {}", self.columns[k].name))
    }

    fn counter_example(&self, from: &Point, places: &[Place], seed: u64) -> Mismatch {
        let still = |point: &Point| self.at(point, seed).is_some_and(|one| one.any_off());
        let found = shrink(from, places, &still, |point| {
            let one = self.at(point, seed)?;
            let at = (0..one.given.len()).find(|&at| one.is_off(at))?;
            Some((self.entry(at), one.given[at], one.exact[at]))
        });
        let units = &self.program.units;
        let number = |(name, value): (String, f64)| {
            let place = places.iter().find(|place| place.name == name);
            let dimension = place.map_or(Dimension::NUMBER, |place| place.dimension);
            (name, units.to_reported(value, dimension), units.symbol(dimension))
        };
        let at = found.at.into_iter().map(number).collect();
        Mismatch { at, entry: found.component, given: found.given, exact: found.exact }
    }
}

fn number_of(one: &Compared, at: usize) -> Seen {
    Seen { given: one.given[at], exact: one.exact[at], allowed: one.allowed(at) }
}

/// The free coordinates of the model, in declared order.
fn columns(program: &Program, declared: &Measurement, selection: &Selection) -> Vec<Column> {
    let named = |name: &str, parameter: usize, component: usize| {
        let all = compile::coordinates(&program.parameters, name);
        all.iter().any(|one| one.parameter == parameter && one.component == component)
    };
    let mut all = Vec::new();
    for (index, parameter) in program.parameters.iter().enumerate() {
        let slots: Vec<_> = declared.slots.iter().filter(|slot| slot.parameter == index).collect();
        let free = |component: usize| {
            let freed = selection.free.iter().any(|name| named(name, index, component));
            let fixed = selection.fix.iter().any(|(name, _)| named(name, index, component));
            !fixed && (freed || parameter.setting.is_free(component))
        };
        let column = |component: usize, name: &str, leaves: Option<(usize, usize)>| Column {
            name: format!("{name}{}", parameter.shape.suffixes()[component]),
            dimension: parameter.dimensions[component],
            nominal: parameter.setting.nominal[component],
            leaves,
        };
        let components: Vec<usize> = (0..parameter.shape.dimension()).filter(|&k| free(k)).collect();
        for slot in &slots {
            let keys: Vec<&str> = slot.keys.iter().filter_map(|&k| declared.keys.get(k)).map(String::as_str).collect();
            let name = match keys.is_empty() {
                true => parameter.name.clone(),
                false => format!("{}[{}]", parameter.name, keys.join(", ")),
            };
            all.extend(components.iter().map(|&k| {
                let (value, tangent) = (slot.first_leaf + k, slot.first_leaf + parameter.shape.tangent_leaf(k));
                column(k, &name, Some((value, tangent)))
            }));
        }
        if slots.is_empty() && !parameter.family {
            all.extend(components.iter().map(|&k| column(k, &parameter.name, None)));
        }
    }
    all
}
