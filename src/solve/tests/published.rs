//! Every test function of Moré, Garbow & Hillstrom ends at a published minimum, and says so.

use super::functions::FUNCTIONS;

#[test]
fn every_published_minimum_is_reached() {
    let mut failures = vec![];
    for function in FUNCTIONS {
        let solution = function.closure().solve(function.start);
        let sum_of_squares = 2.0 * solution.cost;
        // Watson's problem with 12 parameters is published to six digits, Biggs' other minimum too.
        let digits = if matches!(function.name, "Watson12" | "BiggsEXP6") { 1e-6 } else { 1e-8 };
        let reached = function.minima.iter().any(|&minimum| {
            if minimum == 0.0 { sum_of_squares < 1e-20 } else { (sum_of_squares / minimum - 1.0).abs() < digits }
        });
        if !reached || !solution.status.converged() {
            failures.push((function.name, sum_of_squares, solution.status));
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
