//! Where to start from: points spread evenly over what is declared of the parameters.
//!
//! A Latin hypercube (McKay, Beckman & Conover, Technometrics 21 (1979) 239): of n points, each coordinate has exactly one in each
//! n-th of its range, in an order of its own and at a random place in it. The random numbers of a coordinate come from the seed
//! and its name, so that another parameter of the model does not move it. Ranges are
//!
//! - between min and max, evenly, where both are declared;
//! - else by the prior where there is one, normal about the nominal value, and within the one bound that may be declared;
//! - else nothing: the coordinate keeps its start value.
//!
//! A rotation of which all three components are bounded has its vector drawn in that box, and where the box holds the whole ball
//! of rotation vectors, evenly over all rotations (Shoemake, Graphics Gems III (1992) 124); otherwise turns are drawn by the
//! priors of their components, R(nominal)·exp(ω).

#![allow(
    clippy::indexing_slicing,
    reason = "ranges and shares have one entry for each free coordinate, which the problem numbers"
)]

use std::f64::consts::{PI, TAU};

use crate::problem::{Coordinate, Problem};
use crate::simulate::Stream;
use crate::solve::LeastSquares;
use crate::statistics::{Tail, normal_quantile};

/// Points to start from.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Design {
    pub(super) points: Vec<Vec<f64>>,
    /// free coordinates that are the same in all of them
    pub(super) not_varied: Vec<usize>,
}

/// How a coordinate is drawn from a share of its distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Range {
    Between(f64, f64),
    /// an offset from the nominal value
    Prior(f64),
    /// one of the three numbers that choose a rotation
    Turn,
    Same,
}

/// The design of so many points for a problem.
pub(super) fn design(problem: &Problem, count: usize, seed: u64) -> Design {
    let ranges = ranges(problem);
    let shares: Vec<Vec<f64>> = problem
        .free_coordinates()
        .map(|c| {
            let mut stream = Stream::new(seed, &format!("start {}", c.name));
            let order = stream.order(count);
            order.into_iter().map(|cell| (cell as f64 + stream.share()) / count as f64).collect()
        })
        .collect();
    let points = (0..count).map(|k| point(problem, &ranges, |j| shares[j][k])).collect();
    let same = problem.free.iter().zip(&ranges).filter(|(_, range)| **range == Range::Same);
    Design { points, not_varied: same.map(|(&c, _)| c).collect() }
}

fn bounded(of: &Coordinate) -> bool {
    of.min.is_finite() && of.max.is_finite() && of.min < of.max
}

/// By free coordinate.
fn ranges(problem: &Problem) -> Vec<Range> {
    let all = &problem.layout.coordinates;
    let places = problem.places();
    let of = |&c: &usize| {
        let prior = all[c].sigma.map_or(Range::Same, Range::Prior);
        let group = &problem.layout.groups[all[c].group];
        match group.shape.rotation().map(|first| group.first + first) {
            Some(first) if c >= first => {
                let mut whole = first..first + 3;
                let (boxed, ball) = (
                    whole.clone().all(|c| places[c].is_some() && bounded(&all[c])),
                    whole.all(|c| all[c].min <= -PI && all[c].max >= PI),
                );
                match (boxed, ball) {
                    (true, true) => Range::Turn,
                    (true, false) => Range::Between(all[c].min, all[c].max),
                    _ => prior,
                }
            }
            _ if bounded(&all[c]) => Range::Between(all[c].min, all[c].max),
            _ => prior,
        }
    };
    problem.free.iter().map(of).collect()
}

/// The point of one share for each free coordinate.
fn point(problem: &Problem, ranges: &[Range], share: impl Fn(usize) -> f64) -> Vec<f64> {
    let all = &problem.layout.coordinates;
    // offsets turn rotations, so they go first and from the nominal values
    let mut from = problem.start.clone();
    let mut offsets = vec![0.0; problem.free.len()];
    for (j, &c) in problem.free.iter().enumerate() {
        if let Range::Prior(sigma) = ranges[j] {
            offsets[j] = sigma * normal_quantile(Tail::Lower(share(j))).unwrap_or(0.0);
            from[c] = all[c].nominal;
        }
    }
    let mut point = problem.retract(&from, &offsets);
    for (j, &c) in problem.free.iter().enumerate() {
        match ranges[j] {
            Range::Between(min, max) => point[c] = (min + share(j) * (max - min)).clamp(min, max),
            // the three are free and next to one another
            Range::Turn if j + 2 < problem.free.len() && first_of_turn(problem, c) => {
                point[c..c + 3].copy_from_slice(&any_rotation([share(j), share(j + 1), share(j + 2)]));
            }
            _ => {}
        }
    }
    point
}

fn first_of_turn(problem: &Problem, c: usize) -> bool {
    let group = &problem.layout.groups[problem.layout.coordinates[c].group];
    group.shape.rotation().is_some_and(|first| group.first + first == c)
}

/// The rotation vector of three shares, all rotations being equally probable.
fn any_rotation([a, b, c]: [f64; 3]) -> [f64; 3] {
    let (near, far) = ((1.0 - a).sqrt(), a.sqrt());
    let q = [far * (TAU * c).cos(), near * (TAU * b).sin(), near * (TAU * b).cos(), far * (TAU * c).sin()];
    let [w, x, y, z] = if q[0] < 0.0 { q.map(|q| -q) } else { q };
    let s = (x * x + y * y + z * z).sqrt();
    let factor = if s > 0.0 { 2.0 * s.atan2(w) / s } else { 2.0 };
    [factor * x, factor * y, factor * z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_spread_evenly() {
        let mut stream = Stream::new(1, "rotations");
        let n = 20_000;
        let (mut mean, mut angles) = ([0.0; 3], 0.0);
        for _ in 0..n {
            let v = any_rotation([stream.share(), stream.share(), stream.share()]);
            let angle = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!(angle <= PI + 1e-12);
            angles += angle / f64::from(n);
            mean.iter_mut().zip(v).for_each(|(mean, v)| *mean += v / f64::from(n));
        }
        // the mean angle of a random rotation is π/2 + 2/π
        assert!((angles - (PI / 2.0 + 2.0 / PI)).abs() < 0.02, "{angles}");
        assert!(mean.iter().all(|mean| mean.abs() < 0.05), "{mean:?}");
    }
}
