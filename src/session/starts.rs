//! From several starts: which minima there are, and how many starts lead to each.
//!
//! The declared start is the first, the others are spread over what is declared of the parameters (`design`). Each is followed to
//! its end by whatever finds minima. **Two ends are the same minimum** where
//!
//! - their costs differ by no more than what follows from the second condition, ½ (s σ)², and a billionth of the cost;
//! - the way δ from one to the other, without what no residual sees of it and with angles less whole turns, is short by what the
//!   data know of it at either end: ‖R δ‖ ≤ s σ. With s = 0.01 no estimable quantity differs by more than a hundredth of its
//!   standard uncertainty.
//!
//! σ is one where weights are real, and √(2 cost/dof) at the better end where they are unit. Below what the parameters resolve, a share of
//! 1e-10 of their magnitudes, nothing is told apart. So mirrored minima of the same cost count as two.

use std::f64::consts::TAU;

use super::design::design;
use crate::diag::{Code, Diagnostic};
use crate::fit::{Minimum, Starts};
use crate::linalg::{SquareRootInformation, norm};
use crate::problem::{Coordinate, Problem, Undefined};
use crate::solve::LeastSquares;
use crate::unit::Dimension;

/// Standard uncertainties by which estimable quantities of the same minimum may differ.
const SAME: f64 = 0.01;
/// Likewise in shares of the coordinates' magnitudes, and of the cost.
const RESOLVED: f64 = 1e-10;
const SAME_COST: f64 = 1e-9;
/// Minima of which 2 Δcost/σ² is below this are equally good: the upper 0.001 of χ² with one degree of freedom.
const REACH: f64 = 10.83;

/// How many starts, and how the others than the declared one are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MultiStart {
    /// All of them, the declared one among them.
    pub starts: usize,
    /// Of the design.
    pub seed: u64,
}

/// Where a search ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// The point.
    pub point: Vec<f64>,
    /// The cost there.
    pub cost: f64,
    /// Whether it is a minimum.
    pub converged: bool,
}

/// A minimum that some start found first.
struct Known {
    end: Ended,
    /// the first start that ended here
    first: usize,
    /// how many did
    count: usize,
    information: SquareRootInformation,
    /// orthonormal, in tolerances
    invisible: Vec<Vec<f64>>,
}

/// Searches from several starts; the start that leads to the best minimum, the declared one where it does, and what the others found.
/// `search` is called for the same problem with different starts, by several threads at once.
///
/// # Errors
/// Where no parameter has bounds or a prior, or no start can begin.
pub fn compare_starts(
    problem: &Problem,
    options: MultiStart,
    search: &(dyn Fn(&Problem) -> Result<Ended, Box<Diagnostic>> + Sync),
) -> Result<(Vec<f64>, Starts), Box<Diagnostic>> {
    let design = design(problem, options.starts.saturating_sub(1), options.seed);
    if options.starts > 1 && design.not_varied.len() == problem.free.len() {
        let found = Diagnostic::error(
            Code::NothingToVary,
            "no free parameter has bounds or a prior, so all starts would be the same",
        );
        return Err(Box::new(found.hint("declare where to start: `Free(nominal: 1, min: 0, max: 2)`")));
    }
    let mut points = vec![problem.start.clone()];
    points.extend(design.points);
    let mut silent = problem.clone();
    silent.execution = problem.execution.silent();
    let ends = problem.execution.each_of("starts", &points, |point| {
        let mut from = silent.clone();
        from.start.clone_from(point);
        search(&from)
    });
    let mut starts = Starts { total: points.len(), ..Starts::default() };
    starts.not_varied =
        design.not_varied.iter().filter_map(|&c| problem.layout.coordinates.get(c)).map(|c| c.name.clone()).collect();
    let mut known: Vec<Known> = Vec::new();
    let (mut first_error, mut farthest) = (None, None::<Ended>);
    for (number, end) in ends.into_iter().enumerate() {
        match end {
            Err(found) => {
                starts.undefined += 1;
                first_error.get_or_insert(found);
            }
            Ok(end) if !end.converged || !end.cost.is_finite() => {
                let lowest = farthest.as_ref().map_or(f64::INFINITY, |other| other.cost);
                farthest = if end.cost < lowest { Some(end) } else { farthest };
            }
            Ok(end) => {
                starts.converged += 1;
                sort_in(problem, &mut known, end, number);
            }
        }
    }
    known.sort_by(|a, b| a.end.cost.total_cmp(&b.end.cost));
    // of minima whose costs are equal but for rounding the one that was found first is the best: the declared start's, if it is one
    if let Some(lowest) = known.first() {
        let equal = lowest.end.cost * (1.0 + SAME_COST) + 0.5 * lowest.rounding(problem).powi(2);
        let of = known.iter().enumerate().filter(|(_, minimum)| minimum.end.cost <= equal);
        let first = of.min_by_key(|(_, minimum)| minimum.first).map_or(0, |(at, _)| at);
        let best = known.remove(first);
        known.insert(0, best);
    }
    let Some(best) = known.first() else {
        return match first_error {
            Some(found) if starts.undefined == starts.total => Err(found),
            // a search that was cut short is worth going on from
            _ if problem.execution.stopped() => {
                Ok((farthest.map_or_else(|| points.swap_remove(0), |end| end.point), starts))
            }
            _ => Ok((points.swap_remove(0), starts)),
        };
    };
    starts.agreed = best.count;
    let shown = differing(problem, &known);
    let reach = best.reach(problem);
    starts.minima = known
        .iter()
        .map(|minimum| Minimum {
            cost: minimum.end.cost,
            count: minimum.count,
            declared: minimum.first == 0,
            as_good: minimum.end.cost - best.end.cost <= reach,
            at: reported(problem, &shown, &minimum.end.point),
        })
        .collect();
    // nobody will search from there again where it is time to stop
    if problem.execution.stopped() {
        return Ok((best.end.point.clone(), starts));
    }
    let from = best.first;
    Ok((points.swap_remove(from), starts))
}

/// Counts an end with its minimum, or as a new one.
fn sort_in(problem: &Problem, known: &mut Vec<Known>, end: Ended, number: usize) {
    let found = problem.linearise(&end.point).and_then(|information| {
        let invisible = problem.invisible(&end.point, &information)?;
        Ok::<_, Undefined>((information, invisible))
    });
    // it has converged there, so there is a linearisation
    let Ok((information, invisible)) = found else { return };
    let new = Known { end, first: number, count: 1, information, invisible };
    match known.iter_mut().find(|known| known.is(problem, &new)) {
        Some(same) => same.count += 1,
        None => known.push(new),
    }
}

impl Known {
    /// σ² of what is minimised.
    fn variance(&self, problem: &Problem) -> f64 {
        let dof = (problem.equations() + problem.priors() + self.invisible.len()).saturating_sub(problem.free.len());
        match (problem.weights.are_real(), dof) {
            (true, _) => 1.0,
            (false, 0) => 0.0,
            (false, dof) => 2.0 * self.end.cost / dof as f64,
        }
    }

    /// What is left of ‖r‖ where coordinates are changed by less than they are resolved.
    fn rounding(&self, problem: &Problem) -> f64 {
        let magnitude = problem.magnitude(&self.end.point);
        let lengths = self.information.r().column_norms();
        RESOLVED * lengths.iter().zip(magnitude).map(|(length, magnitude)| length * magnitude).sum::<f64>()
    }

    /// By how much another minimum may cost more and be as good.
    fn reach(&self, problem: &Problem) -> f64 {
        0.5 * (REACH * self.variance(problem) + self.rounding(problem).powi(2))
    }

    fn is(&self, problem: &Problem, other: &Known) -> bool {
        let better = if other.end.cost < self.end.cost { other } else { self };
        let allowed = SAME * better.variance(problem).sqrt();
        let way = way(problem, &self.end.point, &other.end.point);
        let near = |from: &Known| {
            let seen = norm(&from.information.r().mul_vec(&from.visible(problem, &way)));
            seen <= allowed.max(from.rounding(problem))
        };
        let rounding = better.rounding(problem);
        let allowed_cost = 0.5 * (allowed * allowed + rounding * rounding) + SAME_COST * better.end.cost;
        (self.end.cost - other.end.cost).abs() <= allowed_cost && near(self) && near(other)
    }

    /// What of a way the data see.
    fn visible(&self, problem: &Problem, way: &[f64]) -> Vec<f64> {
        let scale = problem.scale();
        let mut z: Vec<f64> = way.iter().zip(scale).map(|(way, scale)| way / scale).collect();
        for direction in &self.invisible {
            let share = crate::linalg::dot(direction, &z);
            z.iter_mut().zip(direction).for_each(|(z, direction)| *z -= share * direction);
        }
        z.iter().zip(scale).map(|(z, scale)| z * scale).collect()
    }
}

/// From one point to another, by free coordinate; of angles what is left of whole turns.
fn way(problem: &Problem, from: &[f64], to: &[f64]) -> Vec<f64> {
    let all = problem.difference(from, to);
    let of = |(coordinate, way): (&Coordinate, f64)| match coordinate.dimension {
        Dimension::ANGLE => way - TAU * (way / TAU).round(),
        _ => way,
    };
    problem.free_coordinates().zip(problem.of_free(&all)).map(of).collect()
}

/// By free coordinate, whether the minima differ in it by more than its tolerance; all where they differ in none.
fn differing(problem: &Problem, known: &[Known]) -> Vec<bool> {
    let Some((best, others)) = known.split_first() else { return Vec::new() };
    let ways: Vec<Vec<f64>> = others.iter().map(|other| way(problem, &best.end.point, &other.end.point)).collect();
    let scale = problem.scale();
    let mut found = vec![false; scale.len()];
    for way in &ways {
        found.iter_mut().zip(way.iter().zip(scale)).for_each(|(far, (way, scale))| *far |= way.abs() > *scale);
    }
    if found.contains(&true) { found } else { vec![true; scale.len()] }
}

/// The free coordinates that are to be shown, at a point.
fn reported(problem: &Problem, shown: &[bool], point: &[f64]) -> Vec<(String, f64)> {
    let all = problem.free_coordinates().zip(problem.of_free(point)).zip(shown);
    let told = |(coordinate, value): (&Coordinate, f64)| {
        (coordinate.name.clone(), problem.program.units.to_reported(value, coordinate.dimension))
    };
    all.filter(|(_, shown)| **shown).map(|(of, _)| told(of)).collect()
}
