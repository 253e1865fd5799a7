//! Random geometry: derivatives by the frame rule against dual numbers, at random points and at exactly zero.

use num_dual::Dual64;
use proptest::prelude::*;

use super::compare::agree;
use super::engine::{Run, compiled};
use super::random_frames::{INPUTS, PARAMETERS, build, genes, point};
use super::random_scalars::uncertainty;
use crate::eval::{Evaluator, Leaf};
use crate::graph::{Derived, Graph, Scalar, Tape, View, differentiate};
use crate::simd::InstructionSet;

/// Values, and derivatives by all leaves, of every row.
pub(crate) struct Reference {
    pub(crate) values: Vec<Vec<f64>>,
    pub(crate) derivatives: Vec<Vec<f64>>,
    /// how far right evaluations of a derivative may be apart
    pub(crate) uncertain: Vec<Vec<f64>>,
}

/// Dual numbers, by all parameters and then all inputs. Each row has parameters of its own.
pub(crate) fn dual(graph: &Graph, outputs: &[Scalar], rows: &[(Vec<f64>, Vec<f64>)]) -> Reference {
    let tape = Tape::lower(graph, outputs);
    let leaves = (0..PARAMETERS).map(Leaf::Parameter).chain((0..INPUTS).map(Leaf::Input));
    let mut evaluator = Evaluator::new(&tape, leaves.collect());
    let (mut values, mut derivatives, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
    let lowered = differentiate(graph, outputs, &[], &View::default());
    for (parameters, inputs) in rows {
        let mut value = vec![0.0; outputs.len()];
        let mut derivative = vec![0.0; outputs.len() * (PARAMETERS + INPUTS)];
        evaluator.begin(parameters);
        evaluator.row(inputs, &mut value, &mut derivative);
        values.push(value);
        derivatives.push(derivative);
        let mut of_row = vec![0.0; outputs.len() * (PARAMETERS + INPUTS)];
        for leaf in 0..PARAMETERS + INPUTS {
            let mut duals: Vec<Dual64> = parameters.iter().chain(inputs).map(|&v| Dual64::from(v)).collect();
            duals[leaf] = duals[leaf].derivative();
            let (p, x) = duals.split_at(PARAMETERS);
            for (i, [_, of_derivative]) in uncertainty(&lowered.graph, &lowered.values, p, x).into_iter().enumerate() {
                of_row[i * (PARAMETERS + INPUTS) + leaf] = of_derivative;
            }
        }
        uncertain.push(of_row);
    }
    Reference { values, derivatives, uncertain }
}

/// All parameters and then all inputs, as leaves.
pub(crate) fn leaves(graph: &mut Graph) -> Vec<Scalar> {
    let mut leaves: Vec<Scalar> = (0..PARAMETERS as u32).map(|i| graph.parameter(i)).collect();
    leaves.extend((0..INPUTS as u32).map(|i| graph.input(i)));
    leaves
}

/// Compares what a derived graph gives with dual numbers: each row of derivatives to 1e-11 of its largest entry, or, as
/// near half a turn, to what rounding leaves of it. Returns how many rows there were.
pub(crate) fn check(
    derived: &Derived,
    reference: &Reference,
    parameters: &[f64],
    rows: &[Vec<f64>],
    set: InstructionSet,
) -> Result<usize, String> {
    let wanted = [&derived.values[..], &derived.derivatives].concat();
    let found = compiled(Run { set, graph: &derived.graph, outputs: &wanted, parameters, rows });
    let (count, width) = (derived.values.len(), PARAMETERS + INPUTS);
    let mut compared = 0;
    for (n, found) in found.iter().enumerate() {
        for i in 0..count {
            let value = reference.values[n][i];
            let expected = &reference.derivatives[n][i * width..(i + 1) * width];
            let found_here = &found[count + i * width..count + (i + 1) * width];
            let largest = expected.iter().fold(1e-3f64, |most, d| most.max(d.abs()));
            if !value.is_finite() || expected.iter().any(|d| !d.is_finite()) {
                let undefined = !found[i].is_finite() || found_here.iter().any(|d| !d.is_finite());
                if !value.is_finite() && !undefined {
                    return Err(format!("output {i}: {}, not {value}", found[i]));
                }
                continue;
            }
            if largest > 1e4 || value.abs() > 1e4 {
                continue;
            }
            compared += 1;
            if !agree(found[i], value, 1e-12 * (largest + value.abs())) {
                return Err(format!("row {n}, output {i}, {}: {:e}, not {value:e}", set.name(), found[i]));
            }
            for (leaf, (&found, &expected)) in found_here.iter().zip(expected).enumerate() {
                let uncertain = reference.uncertain[n][i * width + leaf];
                if uncertain <= 1e-6 * largest && !agree(found, expected, uncertain.max(1e-11 * largest)) {
                    let set = set.name();
                    return Err(format!("row {n}, output {i}, leaf {leaf}, {set}: {found:e}, not {expected:e}"));
                }
            }
        }
    }
    Ok(compared)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_geometry_has_the_derivatives_of_dual_numbers(genes in genes(), (parameters, rows) in point()) {
        let (mut graph, outputs) = build(&genes);
        let leaves = leaves(&mut graph);
        let derived = differentiate(&graph, &outputs, &leaves, &View::default());
        let by_row: Vec<(Vec<f64>, Vec<f64>)> = rows.iter().map(|row| (parameters.clone(), row.clone())).collect();
        let reference = dual(&graph, &outputs, &by_row);
        for set in InstructionSet::available() {
            let result = check(&derived, &reference, &parameters, &rows, set);
            prop_assert!(result.is_ok(), "{:?}", result);
        }
    }
}

#[test]
fn wrong_derivatives_of_geometry_are_noticed() {
    use proptest::strategy::{Strategy, ValueTree};
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let (mut compared, mut changed, mut all) = (0, 0, 0);
    for _ in 0..40 {
        let tree = (genes(), point()).new_tree(&mut runner).expect("a case");
        let (genes, (parameters, rows)) = tree.current();
        let (mut graph, outputs) = build(&genes);
        let leaves = leaves(&mut graph);
        let derived = differentiate(&graph, &outputs, &leaves, &View::default());
        let by_row: Vec<(Vec<f64>, Vec<f64>)> = rows.iter().map(|row| (parameters.clone(), row.clone())).collect();
        let reference = dual(&graph, &outputs, &by_row);
        let set = InstructionSet::Baseline;
        compared += check(&derived, &reference, &parameters, &rows, set).expect("agreement");
        all += rows.len() * outputs.len();
        for at in 0..derived.derivatives.len() {
            let (output, width) = (at / leaves.len(), leaves.len());
            let comparable = (0..rows.len()).any(|n| {
                let row = &reference.derivatives[n][output * width..(output + 1) * width];
                let fine = row.iter().all(|d| d.abs() < 1e4) && reference.values[n][output].abs() < 1e4;
                let sure = reference.uncertain[n][at] < 1e-10;
                fine && sure && row[at % width].abs() > 1e-3 * row.iter().fold(1e-3f64, |most, d| most.max(d.abs()))
            });
            if !comparable {
                continue;
            }
            let rules: [fn(&mut Graph, Scalar) -> Scalar; 2] = [Graph::neg, |g, d| {
                let factor = g.constant(1.0 + 1e-7);
                g.mul(factor, d)
            }];
            for rule in rules {
                changed += 1;
                let mut wrong = derived.clone();
                wrong.derivatives[at] = rule(&mut wrong.graph, wrong.derivatives[at]);
                assert!(check(&wrong, &reference, &parameters, &rows, set).is_err());
            }
        }
    }
    assert!(compared * 10 > all * 8 && changed > 100, "{compared} of {all}, {changed} changed");
}
