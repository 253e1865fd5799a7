//! Random values of the parameters.

use proptest::prelude::*;

use crate::problem::Problem;
use crate::solve::LeastSquares;

/// How far from where a problem starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spread {
    /// So many tolerances of each parameter to either side, as far as its bounds allow.
    Tolerances(f64),
    /// As far as the bounds of a parameter; where it has none, so many tolerances.
    Bounds(f64),
}

/// Points of a problem, one number for each coordinate in internal units: the free ones evenly distributed about the start, with the
/// start itself and the ends of the range among them, the others where they start. Rotations turn on from where they start. They
/// shrink to the start.
///
/// ```
/// use phical::problem::{Options, Problem};
/// use phical::simulate::simulate;
/// use phical::testing::{Spread, parameters, program};
/// use proptest::prelude::*;
///
/// let program = program(r#"(name: "line", parameters: {"a": Scalar(Free(nominal: 1, min: 0)), "b": Scalar(Held(2))},
///     measurements: {"m": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - a - b*x"})},
///     scenarios: {"s": (measurements: {"m": (rows: 3, draw: {"x": Uniform(0, 1)}, set: {"y": "a + b*x"})})},
/// )"#);
/// let made = simulate(&program, &program.scenarios[0], &Default::default()).expect("it simulates");
/// let (problem, _) = Problem::bind(&program, made.tables, &Options::default())?;
/// proptest!(|(point in parameters(&problem, Spread::Tolerances(1e6)))| {
///     prop_assert!(point[0] >= 0.0 && point[1] == 2.0);
///     prop_assert!(problem.cost(&point).is_ok());
/// });
/// # use phical::solve::LeastSquares;
/// # Ok::<(), phical::diag::Diagnostics>(())
/// ```
pub fn parameters<'p>(problem: &Problem<'p>, spread: Spread) -> impl Strategy<Value = Vec<f64>> + use<'p> {
    let problem = problem.clone();
    let share = prop_oneof![1 => Just(0.0), 8 => -1.0..=1.0f64, 1 => prop::sample::select(vec![1.0, -1.0])];
    prop::collection::vec(share, problem.free.len()).prop_map(move |shares| {
        let step = |(&c, share): (&usize, f64)| {
            let coordinate = &problem.layout.coordinates[c];
            let to_bound =
                if share > 0.0 { coordinate.max - problem.start[c] } else { problem.start[c] - coordinate.min };
            share
                * match spread {
                    Spread::Tolerances(many) => many * coordinate.tolerance,
                    Spread::Bounds(many) if to_bound.is_infinite() => many * coordinate.tolerance,
                    Spread::Bounds(_) => to_bound,
                }
        };
        let delta: Vec<f64> = problem.free.iter().zip(shares).map(step).collect();
        problem.retract(&problem.start, &delta)
    })
}
