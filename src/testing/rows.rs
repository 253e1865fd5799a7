//! Random rows of a measurement, and random data of a scenario.

use std::fmt;
use std::ops::RangeInclusive;
use std::sync::Arc;

use proptest::prelude::*;

use crate::compile::{Program, Scenario};
use crate::identify::Ranges;
use crate::simulate::{self, Simulated, simulate};

/// Rows that are simulated to take one of them, so that names which come by turns all occur.
const ROWS: usize = 16;

/// One row of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The names of its key columns.
    pub keys: Vec<String>,
    /// Its readings in internal units, one for each input.
    pub readings: Vec<f64>,
}

/// Rows of a measurement, by its number: of a scenario that simulates it, with errors, where there is one; else inputs of the
/// declared kinds, as [`Ranges`] has them, which nothing makes consistent. They shrink to zero readings, or to the first row.
///
/// ```
/// use phical::data::Table;
/// use phical::testing::{program, readings};
/// use proptest::prelude::*;
///
/// let program = program(r#"(name: "line", parameters: {"a": Scalar(Free(1))}, measurements: {"m": (
///     inputs: {"angle": (unit: "deg"), "y": ()}, residuals: {"r": "y - a*sin(angle)"},
/// )})"#);
/// proptest!(|(row in readings(&program, 0))| {
///     prop_assert!(row.readings[0].abs() <= std::f64::consts::PI && row.readings[1].abs() <= 1.5);
/// });
/// ```
///
/// # Panics
/// Where the model has no measurement of this number.
pub fn readings(program: &Program, measurement: usize) -> BoxedStrategy<Reading> {
    let simulates = |scenario: &&Scenario| scenario.measurements.iter().any(|s| s.measurement == measurement);
    if let Some(scenario) = program.scenarios.iter().find(simulates) {
        let (program, scenario) = (Arc::new(program.clone()), scenario.clone());
        let row = move |(seed, row): (u32, usize)| {
            let rows =
                scenario.measurements.iter().map(|s| (s.measurement, usize::from(s.measurement == measurement) * ROWS));
            let options = simulate::Options { rows: rows.collect(), seed: Some(seed.into()), exact: false };
            let tables = simulate(&program, &scenario, &options).ok()?.tables;
            let (_, table) = tables.into_iter().find(|(index, _)| *index == measurement)?;
            let keys = (0..program.measurements[measurement].keys.len()).map(|key| table.key(row, key).to_owned());
            Some(Reading { keys: keys.collect(), readings: table.row(row).to_vec() })
        };
        return (any::<u32>(), 0..ROWS).prop_filter_map("the scenario has no such row", row).boxed();
    }
    let Ranges { keys, inputs } = Ranges::of(program, &program.measurements[measurement]);
    let names: Vec<BoxedStrategy<String>> = keys.into_iter().map(|all| prop::sample::select(all).boxed()).collect();
    let shares = prop::collection::vec(-1.0..=1.0f64, inputs.len());
    let row = move |(keys, shares): (Vec<String>, Vec<f64>)| {
        let readings = shares.iter().zip(&inputs).map(|(share, (middle, range))| middle + share * range);
        Reading { keys, readings: readings.collect() }
    };
    (names, shares).prop_map(row).boxed()
}

/// Made-up data, and how to make them again: `phical simulate` with the same rows and seed.
#[derive(Clone)]
pub struct Data {
    /// How many rows each measurement has, by its number.
    pub rows: Vec<(usize, usize)>,
    /// The seed.
    pub seed: u64,
    /// Whether sensors make no errors.
    pub exact: bool,
    /// The tables, and the truth behind them.
    pub simulated: Simulated,
}

/// Without the tables, which the rest tells.
impl fmt::Debug for Data {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Data");
        shown.field("rows", &self.rows).field("seed", &self.seed).field("exact", &self.exact).finish_non_exhaustive()
    }
}

/// Data of a scenario, with so many rows for each of its measurements. They shrink to fewer rows, and then to smaller seeds.
///
/// ```
/// use phical::testing::{data, program};
/// use proptest::prelude::*;
/// let program = program(r#"(name: "mean", parameters: {"a": Scalar(Free(1))},
///     measurements: {"m": (inputs: {"x": (sigma: 0.1)}, residuals: {"r": "x - a"})},
///     scenarios: {"s": (truth: {"a": Uniform(0, 2)}, measurements: {"m": (rows: 9, set: {"x": "a"})})},
/// )"#);
/// proptest!(|(made in data(&program, &program.scenarios[0], 1..=5, true))| {
///     let (_, table) = &made.simulated.tables[0];
///     prop_assert!((1..=5).contains(&table.rows()));
///     prop_assert_eq!(table.row(0)[0], made.simulated.truth[0].1);
/// });
/// ```
pub fn data(program: &Program, scenario: &Scenario, rows: RangeInclusive<usize>, exact: bool) -> BoxedStrategy<Data> {
    let (program, scenario) = (Arc::new(program.clone()), scenario.clone());
    let numbers = prop::collection::vec(rows, scenario.measurements.len());
    let make = move |(numbers, seed): (Vec<usize>, u32)| {
        let rows: Vec<_> = scenario.measurements.iter().map(|s| s.measurement).zip(numbers).collect();
        let seed = u64::from(seed);
        let options = simulate::Options { rows: rows.clone(), seed: Some(seed), exact };
        let simulated = simulate(&program, &scenario, &options).ok()?;
        Some(Data { rows, seed, exact, simulated })
    };
    (numbers, any::<u32>()).prop_filter_map("the scenario cannot be simulated", make).boxed()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::strategy::ValueTree;
    use proptest::test_runner::{Config, TestError, TestRunner};

    const LINE: &str = r#"(name: "line", parameters: {"a": Scalar(Free(1)), "b": Scalar(value: Free(0), family: true)},
        measurements: {"m": (keys: ["day"], inputs: {"x": (), "y": (sigma: 0.1)}, residuals: {"r": "y - a*x - b[day]"})},
        scenarios: {"s": (measurements: {"m": (
            rows: 30, draw: {"x": Uniform(0, 1), "day": Cycle(["mon", "tue"])}, set: {"y": "a*x + b[day]"}, noise: {"y": (sigma: 0.1)},
        )})},
    )"#;

    #[test]
    fn what_fails_shrinks_to_few_rows() {
        let program = crate::testing::program(LINE);
        let config = Config { failure_persistence: None, ..Config::default() };
        let mut runner = TestRunner::new_with_rng(config, TestRunner::deterministic().rng().clone());
        let found = runner.run(&data(&program, &program.scenarios[0], 1..=30, false), |made| {
            prop_assert!(made.simulated.tables[0].1.rows() < 7);
            Ok(())
        });
        let Err(TestError::Fail(_, least)) = found else { panic!("{found:?}") };
        assert_eq!((least.rows, least.seed), (vec![(0, 7)], 0));
    }

    #[test]
    fn rows_have_all_names_and_the_errors_of_their_sensors() {
        let program = crate::testing::program(LINE);
        let mut runner = TestRunner::deterministic();
        let rows: Vec<Reading> =
            (0..50).map(|_| readings(&program, 0).new_tree(&mut runner).unwrap().current()).collect();
        for name in ["mon", "tue"] {
            assert!(rows.iter().any(|row| row.keys == [name]), "{name}");
        }
        // y = x but for its errors
        let errors: Vec<f64> = rows.iter().map(|row| row.readings[1] - row.readings[0]).collect();
        let size = (errors.iter().map(|e| e * e).sum::<f64>() / 50.0).sqrt();
        assert!((0.05..0.2).contains(&size), "{size}");
    }
}
