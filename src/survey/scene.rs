//! The instrument as a picture: frames of its chains at some rows, what they sight, and points with what is not known of them.

use super::placed::Calls;
use crate::compile::{Program, Shape};
use crate::data::Table;
use crate::evaluate::{Estimated, evaluate, point, uncertainties};
use crate::fit::JointUncertainty;
use crate::problem::{Options, Problem};
use crate::unit::Dimension;

/// Rows that are shown.
const SHOTS: usize = 24;

/// Parameters that are points, of which are shown.
const MOST_POINTS: usize = 300;

/// A line of sight is one that passes a point no farther than this share of the way to it.
const SIGHTED: f64 = 0.02;

/// A frame with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// its joint, or its chain
    pub name: String,
    /// where it is
    pub origin: [f64; 3],
    /// where its x, y and z point
    pub axes: [[f64; 3]; 3],
}

/// A chain from its base on; the last frame is its end.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// its name
    pub name: String,
    /// one for each joint
    pub frames: Vec<Frame>,
}

/// A point, and how well it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// `p1`, `target[A]`
    pub name: String,
    /// where it is
    pub at: [f64; 3],
    /// The covariance of its coordinates, where it is known.
    pub covariance: Option<[[f64; 3]; 3]>,
}

/// One row: where the chains are, what they sight, and which points follow from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// the measurement
    pub measurement: String,
    /// the row, from zero
    pub row: usize,
    /// its chains
    pub chains: Vec<Chain>,
    /// lines of sight from a chain's end to a point
    pub sights: Vec<[[f64; 3]; 2]>,
    /// derived points
    pub points: Vec<Point>,
}

/// The picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The unit of lengths.
    pub unit: String,
    /// Rows, spread evenly.
    pub shots: Vec<Shot>,
    /// Parameters that are points.
    pub points: Vec<Point>,
}

impl Scene {
    /// Whether there is anything to see.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty() && self.shots.iter().all(|shot| shot.chains.is_empty() && shot.points.is_empty())
    }

    /// All points, those of rows first.
    pub fn all_points(&self) -> impl Iterator<Item = &Point> {
        self.shots.iter().flat_map(|shot| &shot.points).chain(&self.points)
    }
}

/// The picture of a model with some values (in reported units), at rows spread evenly over a problem's. What is undefined is left out.
pub fn scene(problem: &Problem, values: &[(String, f64)], known: Option<&JointUncertainty>) -> Scene {
    let program = problem.program;
    let mut scene = Scene { unit: program.units.symbol(Dimension::LENGTH), ..Scene::default() };
    for block in &problem.blocks {
        let rows = block.table.rows();
        let shots = SHOTS.div_ceil(problem.blocks.len()).min(rows).max(1);
        let chosen: Vec<usize> =
            (0..shots).map(|k| k * rows / shots).filter(|&row| row < rows && !block.excludes(row)).collect();
        scene.shots.extend(of_rows(program, block.index, &block.table, &chosen, values, known).unwrap_or_default());
    }
    scene.points = parameters(problem, values, known);
    scene
}

/// The chosen rows of a measurement; nothing where something is undefined there.
fn of_rows(
    program: &Program,
    measurement: usize,
    table: &Table,
    chosen: &[usize],
    values: &[(String, f64)],
    known: Option<&JointUncertainty>,
) -> Option<Vec<Shot>> {
    let mut few = Table::new(program.measurements.get(measurement)?.keys.len(), table.width());
    for &row in chosen {
        few.push_with(|key| table.key(row, key), &table.row(row), None);
    }
    let options = Options { unconstrained: true, ..Options::default() };
    let (problem, _) = Problem::bind(program, vec![(measurement, few)], &options).ok()?;
    let at = point(&problem, values);
    let block = problem.blocks.first()?;
    let calls = Calls::of(block.measurement);
    let length = program.units.to_reported(1.0, Dimension::LENGTH);
    let evaluated = evaluate(&problem, &at).ok().and_then(|all| all.measurements.into_iter().next());
    let estimated: Vec<Estimated> =
        known.map(|known| Estimated::new(&problem, "calibration", known)).into_iter().collect();
    let covariance = uncertainties(&problem, &at, &estimated)
        .ok()
        .and_then(|all| all.into_iter().next())
        .and_then(|of| of.covariance);
    let triples = points_among(block.measurement);

    let mut shots = Vec::with_capacity(chosen.len());
    for (k, &row) in chosen.iter().enumerate() {
        let frames = calls.frames(&block.leaves_of(&problem.layout, &at, k).ok()?, &block.table.row(k));
        let scaled = |v: [f64; 3]| v.map(|x| x * length);
        let chains: Vec<Chain> = calls
            .calls
            .iter()
            .map(|call| Chain {
                name: call.chain.clone(),
                frames: call
                    .joints
                    .iter()
                    .zip(frames.iter().skip(call.first))
                    .map(|(name, &[origin, x, y, z])| Frame {
                        name: name.clone(),
                        origin: scaled(origin),
                        axes: [x, y, z],
                    })
                    .collect(),
            })
            .filter(|chain| chain.frames.iter().all(Frame::is_finite))
            .collect();
        let column = |output: usize| evaluated.as_ref()?.outputs.get(output)?.values.get(k).copied();
        let entry = |i: usize, j: usize| *covariance.as_ref()?.get(k)?.get(i)?.get(j)?;
        let points: Vec<Point> = triples
            .iter()
            .filter_map(|(name, first)| {
                let at = triple(|i| column(first + i))?;
                Some(Point { name: name.clone(), at, covariance: square(|i, j| entry(first + i, first + j)) })
            })
            .collect();
        let ends = chains.iter().filter_map(|chain| chain.frames.last());
        let sights = ends.flat_map(|end| points.iter().filter_map(|point| sight(end, point.at))).collect();
        let measurement = block.measurement.name.clone();
        shots.push(Shot { measurement, row, chains, sights, points });
    }
    Some(shots)
}

impl Frame {
    fn is_finite(&self) -> bool {
        self.origin.iter().chain(self.axes.iter().flatten()).all(|x| x.is_finite())
    }
}

/// Outputs that are points: their names, and the number of their first component.
fn points_among(measurement: &crate::compile::Measurement) -> Vec<(String, usize)> {
    let all = &measurement.outputs;
    let starts = all.windows(3).enumerate().filter_map(|(first, window)| {
        let [x, y, z] = window else { return None };
        let base = x.name.strip_suffix(".x")?;
        let fits = y.name.strip_suffix(".y") == Some(base) && z.name.strip_suffix(".z") == Some(base);
        (fits && x.dimension == Dimension::LENGTH).then(|| (base.to_owned(), first))
    });
    starts.collect()
}

fn triple(of: impl Fn(usize) -> Option<f64>) -> Option<[f64; 3]> {
    let all = [of(0)?, of(1)?, of(2)?];
    all.iter().all(|x| x.is_finite()).then_some(all)
}

fn square(of: impl Fn(usize, usize) -> Option<f64>) -> Option<[[f64; 3]; 3]> {
    Some([triple(|j| of(0, j))?, triple(|j| of(1, j))?, triple(|j| of(2, j))?])
}

/// The line from a frame's origin to a point, where that lies along the frame's z.
fn sight(from: &Frame, to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let [_, _, z] = from.axes;
    let way =
        std::array::from_fn::<f64, 3, _>(|i| to.get(i).zip(from.origin.get(i)).map_or(0.0, |(to, from)| to - from));
    let along = crate::linalg::dot(&way, &z);
    let off: f64 = way.iter().zip(&z).map(|(w, z)| (w - along * z).powi(2)).sum::<f64>().sqrt();
    (along.abs() > 0.0 && off <= SIGHTED * along.abs()).then_some([from.origin, to])
}

/// Parameters that are points, or the places of poses.
fn parameters(problem: &Problem, values: &[(String, f64)], known: Option<&JointUncertainty>) -> Vec<Point> {
    let at = point(problem, values);
    let units = &problem.program.units;
    let mut points = Vec::new();
    for group in &problem.layout.groups {
        let coordinates: Vec<_> = problem.layout.coordinates.iter().zip(&at).skip(group.first).take(3).collect();
        let Some((first, _)) = coordinates.first() else { continue };
        let is_point = matches!(group.shape, Shape::Vec3 | Shape::Pose) && first.dimension == Dimension::LENGTH;
        if !is_point || points.len() == MOST_POINTS {
            continue;
        }
        let place = |i: usize| coordinates.get(i).map(|(of, value)| units.to_reported(**value, of.dimension));
        let variance = |i: usize, j: usize| {
            let known = known?;
            let number = |i: usize| {
                let (of, _) = coordinates.get(i)?;
                known.names.iter().position(|name| *name == of.name)
            };
            known.covariance.as_ref()?.get(number(i)?)?.get(number(j)?).copied()
        };
        if let Some(at) = triple(place) {
            let name = first.name.strip_suffix(".x").unwrap_or(&first.name).to_owned();
            points.push(Point { name, at, covariance: square(variance) });
        }
    }
    points
}
