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
use crate::problem::{Problem, Undefined};
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
    /// the starts that ended here
    starts: Vec<usize>,
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
    let ends = problem.execution.each(&points, |point| {
        let mut from = problem.clone();
        from.start.clone_from(point);
        search(&from)
    });
    let mut starts = Starts { total: points.len(), ..Starts::default() };
    starts.not_varied = design.not_varied.iter().map(|&c| problem.layout.coordinates[c].name.clone()).collect();
    let mut known: Vec<Known> = Vec::new();
    let mut first_error = None;
    for (number, end) in ends.into_iter().enumerate() {
        match end {
            Err(found) => {
                starts.undefined += 1;
                first_error.get_or_insert(found);
            }
            Ok(end) if !end.converged || !end.cost.is_finite() => {}
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
        let first = of.min_by_key(|(_, minimum)| minimum.starts[0]).map_or(0, |(at, _)| at);
        known[..=first].rotate_right(1);
    }
    let Some(best) = known.first() else {
        return match first_error {
            Some(found) if starts.undefined == starts.total => Err(found),
            _ => Ok((points.swap_remove(0), starts)),
        };
    };
    starts.agreed = best.starts.len();
    let shown = differing(problem, &known);
    let reach = best.reach(problem);
    starts.minima = known
        .iter()
        .map(|minimum| Minimum {
            cost: minimum.end.cost,
            count: minimum.starts.len(),
            declared: minimum.starts[0] == 0,
            as_good: minimum.end.cost - best.end.cost <= reach,
            at: shown.iter().map(|&c| reported(problem, c, &minimum.end.point)).collect(),
        })
        .collect();
    let from = best.starts[0];
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
    let new = Known { end, starts: vec![number], information, invisible };
    match known.iter_mut().find(|known| known.is(problem, &new)) {
        Some(same) => same.starts.push(number),
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
    let of = |&c: &usize| match problem.layout.coordinates[c].dimension {
        Dimension::ANGLE => all[c] - TAU * (all[c] / TAU).round(),
        _ => all[c],
    };
    problem.free.iter().map(of).collect()
}

/// The free coordinates by which the minima differ by more than their tolerances; all where there are none.
fn differing(problem: &Problem, known: &[Known]) -> Vec<usize> {
    let Some((best, others)) = known.split_first() else { return Vec::new() };
    let ways: Vec<Vec<f64>> = others.iter().map(|other| way(problem, &best.end.point, &other.end.point)).collect();
    let far = |j: usize| ways.iter().any(|way| way[j].abs() > problem.scale()[j]);
    let found: Vec<usize> = (0..problem.free.len()).filter(|&j| far(j)).map(|j| problem.free[j]).collect();
    if found.is_empty() { problem.free.clone() } else { found }
}

fn reported(problem: &Problem, c: usize, point: &[f64]) -> (String, f64) {
    let coordinate = &problem.layout.coordinates[c];
    (coordinate.name.clone(), problem.program.units.to_reported(point[c], coordinate.dimension))
}
