//! A point at which written code can be checked: arguments, and what the program's reference evaluation gives there.

use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::routine::{Number, Routine};
use crate::compile::Measurement;
use crate::eval::{Evaluator, Leaf};
use crate::problem::Problem;
use crate::unit::Dimension;

/// How often a point is looked for; each time nearer to where numbers stand by themselves.
const TRIES: i32 = 60;
/// Results beyond this show nothing.
const MOST: f64 = 1e12;

/// Arguments and results in reported units.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The parameters.
    pub q: Vec<f64>,
    /// The inputs.
    pub x: Vec<f64>,
    /// The members that the row names.
    pub m: Vec<f64>,
    /// The residuals.
    pub r: Vec<f64>,
    /// Their derivatives by the free parameters, by residual.
    pub dr_dq: Vec<Vec<f64>>,
    /// Their derivatives by the free members, by residual.
    pub dr_dm: Vec<Vec<f64>>,
    /// Their derivatives by the inputs, by residual.
    pub dr_dx: Vec<Vec<f64>>,
}

impl Point {
    /// The first point of a few made-up ones where all is defined: near the start, at random readings.
    pub(super) fn find(problem: &Problem, measurement: &Measurement, routine: &Routine) -> Option<Point> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        (0..TRIES).find_map(|attempt| {
            let reach = 0.9f64.powi(attempt);
            let mut draw = |size: f64| reach * size * (2.0 * random.random::<f64>() - 1.0);
            let layout = &problem.layout;
            let near = |number: &Number, c: Option<usize>, draw: &mut dyn FnMut(f64) -> f64| {
                let (start, tolerance) = c.map_or((0.0, 0.0), |c| (problem.start[c], layout.coordinates[c].tolerance));
                let (min, max) =
                    c.map_or((f64::MIN, f64::MAX), |c| (layout.coordinates[c].min, layout.coordinates[c].max));
                let moved = start + draw(0.02 * start.abs() + 10.0 * tolerance + 1e-2);
                problem.program.units.to_reported(moved.clamp(min, max), number.dimension)
            };
            let q = routine.parameters.iter().map(|p| near(p, layout.find(&p.name), &mut draw)).collect();
            let member = |number: &Number| {
                let (name, rest) = number.name.split_once('[').unwrap_or((&number.name, ""));
                let suffix = rest.rsplit_once(']').map_or("", |(_, suffix)| suffix);
                layout.coordinates.iter().position(|c| {
                    c.name.split_once('[').is_some_and(|(of, _)| of == name)
                        && c.name.rsplit_once(']').is_some_and(|(_, of)| of == suffix)
                })
            };
            let m = routine.members.iter().map(|number| near(number, member(number), &mut draw)).collect();
            let x = measurement.inputs.iter().map(|input| {
                let dimension = input.unit.dimension;
                let value = match input.default {
                    Some(default) => default + draw(0.1),
                    None if dimension == Dimension::ANGLE => draw(std::f64::consts::PI),
                    None => draw(largest(problem, dimension)),
                };
                problem.program.units.to_reported(value, dimension)
            });
            let x = x.collect();
            Point::at(problem, measurement, routine, q, x, m)
        })
    }

    /// What the reference evaluation gives; none where something is undefined.
    fn at(
        problem: &Problem,
        measurement: &Measurement,
        routine: &Routine,
        q: Vec<f64>,
        x: Vec<f64>,
        m: Vec<f64>,
    ) -> Option<Point> {
        let (program, units) = (problem.program, &problem.program.units);
        let inside = |value: f64, number: &Number| units.to_internal(value, units.unit(number.dimension));
        let mut leaves = vec![0.0; measurement.leaves];
        let (mut by_parameters, mut by_members) = (vec![None; q.len()], Vec::new());
        let mut member = 0;
        for slot in &measurement.slots {
            let parameter = &program.parameters[slot.parameter];
            for k in 0..parameter.shape.dimension() {
                let leaf = slot.first_leaf + k;
                let tangent = Leaf::Parameter(slot.first_leaf + parameter.shape.tangent_leaf(k));
                if parameter.family {
                    leaves[leaf] = inside(m[member], &routine.members[member]);
                    by_members.push(tangent);
                    member += 1;
                    continue;
                }
                let name = format!("{}{}", parameter.name, parameter.shape.suffixes()[k]);
                match routine.parameters.iter().position(|p| p.name == name) {
                    Some(at) => {
                        leaves[leaf] = inside(q[at], &routine.parameters[at]);
                        by_parameters[at] = Some(tangent);
                    }
                    None => leaves[leaf] = problem.layout.find(&name).map_or(0.0, |c| problem.start[c]),
                }
            }
        }
        let inputs: Vec<f64> = x.iter().zip(&routine.inputs).map(|(&value, number)| inside(value, number)).collect();
        let used = measurement.tape.inputs();
        let of_inputs = (0..used).map(Leaf::Input);
        let all: Vec<Leaf> = by_parameters.iter().flatten().copied().chain(by_members).chain(of_inputs).collect();
        let n = all.len();
        let mut evaluator = Evaluator::new(&measurement.tape, all);
        evaluator.begin(&leaves);
        let (mut values, mut derivatives) =
            (vec![0.0; routine.residuals.len()], vec![0.0; routine.residuals.len() * n]);
        evaluator.row(&inputs, &mut values, &mut derivatives);
        let sound = |value: &f64| value.abs() <= MOST;
        if !values.iter().chain(&derivatives).all(sound) || evaluator.undefined(&inputs, true).is_some() {
            return None;
        }
        let outside = |number: &Number| units.to_reported(1.0, number.dimension);
        let r: Vec<f64> = values.iter().zip(&routine.residuals).map(|(v, number)| v * outside(number)).collect();
        let (mut dr_dq, mut dr_dm, mut dr_dx) = (Vec::new(), Vec::new(), Vec::new());
        for (i, residual) in routine.residuals.iter().enumerate() {
            let mut row = derivatives[i * n..(i + 1) * n].iter();
            let mut next = |by: &Number| row.next().map_or(0.0, |d| d * outside(residual) * inside(1.0, by));
            let by_q: Vec<f64> = (by_parameters.iter().zip(&routine.parameters))
                .map(|(leaf, parameter)| if leaf.is_some() { next(parameter) } else { 0.0 })
                .collect();
            let by_m: Vec<f64> = routine.members.iter().map(&mut next).collect();
            let mut by_x: Vec<f64> = routine.inputs[..used].iter().map(&mut next).collect();
            by_x.resize(routine.inputs.len(), 0.0);
            dr_dq.push(routine.columns.iter().map(|&k| by_q[k]).collect());
            dr_dm.push(routine.member_columns.iter().map(|&k| by_m[k]).collect());
            dr_dx.push(by_x);
        }
        Some(Point { q, x, m, r, dr_dq, dr_dm, dr_dx })
    }
}

/// Half as much again as the largest number of this kind among the parameters, or 1.
fn largest(problem: &Problem, dimension: Dimension) -> f64 {
    let of_kind = problem.layout.coordinates.iter().zip(&problem.start).filter(|(c, _)| c.dimension == dimension);
    let most = of_kind.fold(0.0, |most: f64, (_, start)| most.max(start.abs()));
    if most > 0.0 { 1.5 * most } else { 1.0 }
}
