//! Random graphs of scalar operations: the engine against tapes, and its derivatives against dual numbers.

use num_dual::Dual64;
use proptest::prelude::*;

use super::compare::agree;
use super::engine::{Engine, Run, compiled};
use super::random_scalars::{INPUTS, PARAMETERS, build, genes, point, uncertainty};
use crate::eval::{Evaluator, Leaf};
use crate::graph::{Graph, Scalar, Tape, View, differentiate};
use crate::simd::InstructionSet;

/// What is compared with what.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    pub(super) graph: &'a Graph,
    pub(super) outputs: &'a [Scalar],
    pub(super) parameters: &'a [f64],
    pub(super) rows: &'a [Vec<f64>],
    pub(super) set: InstructionSet,
}

/// Compares values and all derivatives with those of an [`Evaluator`]. Returns how many were compared: where dual numbers are
/// none, or two right evaluations may differ in the sixth digit, there is nothing to compare.
pub(super) fn check(case: Case<'_>, engine: Engine<'_>) -> Result<usize, String> {
    let Case { graph, outputs, parameters, rows, set } = case;
    let mut original = graph.clone();
    let mut leaves: Vec<Scalar> = (0..PARAMETERS as u32).map(|i| original.parameter(i)).collect();
    leaves.extend((0..INPUTS as u32).map(|i| original.input(i)));
    let derived = differentiate(&original, outputs, &leaves, &View::default());
    let wanted = [&derived.values[..], &derived.derivatives].concat();
    let all = engine(Run { set, graph: &derived.graph, outputs: &wanted, parameters, rows });
    let values = engine(Run { set, graph, outputs, parameters, rows });

    let tape = Tape::lower(graph, outputs);
    let mut by: Vec<Leaf> = (0..PARAMETERS).map(Leaf::Parameter).collect();
    by.extend((0..INPUTS).map(Leaf::Input));
    let mut evaluator = Evaluator::new(&tape, by);
    evaluator.begin(parameters);
    let width = leaves.len();
    let (mut value, mut derivative) = (vec![0.0; outputs.len()], vec![0.0; outputs.len() * width]);
    let mut compared = 0;
    for (n, row) in rows.iter().enumerate() {
        evaluator.row(row, &mut value, &mut derivative);
        for leaf in 0..width {
            let mut duals = [parameters, row].concat().into_iter().map(Dual64::from).collect::<Vec<_>>();
            duals[leaf] = duals[leaf].derivative();
            let (p, x) = duals.split_at(PARAMETERS);
            for (i, [of_value, of_derivative]) in uncertainty(graph, outputs, p, x).into_iter().enumerate() {
                let at = i * width + leaf;
                let pairs = [
                    (values[n][i], value[i], of_value),
                    (all[n][i], value[i], of_value),
                    (all[n][outputs.len() + at], derivative[at], of_derivative),
                ];
                for (found, expected, tolerance) in pairs {
                    let determined = tolerance <= 1e-6 * (1e-3 + expected.abs());
                    if !expected.is_finite() || !determined {
                        continue;
                    }
                    compared += 1;
                    if !agree(found, expected, tolerance) {
                        let set = set.name();
                        return Err(format!(
                            "row {n}, output {i}, leaf {leaf}, {set}: {found:e}, not {expected:e} ± {tolerance:e}"
                        ));
                    }
                }
            }
        }
    }
    Ok(compared)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn random_graphs_have_the_values_and_derivatives_of_the_reference(
        genes in genes(), (parameters, rows) in point(1..9),
    ) {
        let (graph, outputs) = build(&genes);
        for set in InstructionSet::available() {
            let case = Case { graph: &graph, outputs: &outputs, parameters: &parameters, rows: &rows, set };
            if let Err(difference) = check(case, &compiled) {
                prop_assert!(false, "{}", difference);
            }
        }
    }

    #[test]
    fn every_row_of_several_blocks_has_the_value_of_the_reference(genes in genes(), (parameters, rows) in point(60..200)) {
        let (graph, outputs) = build(&genes);
        let tape = Tape::lower(&graph, &outputs);
        for set in InstructionSet::available() {
            let found = compiled(Run { set, graph: &graph, outputs: &outputs, parameters: &parameters, rows: &rows });
            for (n, row) in rows.iter().enumerate().step_by(7).chain(rows.iter().enumerate().skip(rows.len() - 3)) {
                let [p, x] = [&parameters, row].map(|v| v.iter().map(|&v| Dual64::from(v)).collect::<Vec<_>>());
                let uncertain = uncertainty(&graph, &outputs, &p, &x);
                for (i, expected) in tape.evaluate(&parameters, row).into_iter().enumerate() {
                    let determined = uncertain[i][0] <= 1e-6 * (1e-3 + expected.abs());
                    if expected.is_finite() && determined {
                        prop_assert!(agree(found[n][i], expected, uncertain[i][0]), "row {} output {}: {} {}", n, i, found[n][i], expected);
                    }
                }
            }
        }
    }
}

#[test]
fn most_of_what_random_graphs_give_is_compared() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let (mut compared, mut all) = (0, 0);
    for _ in 0..60 {
        let tree = (genes(), point(2..3)).new_tree(&mut runner).expect("a case");
        let (genes, (parameters, rows)) = tree.current();
        let (graph, outputs) = build(&genes);
        let set = InstructionSet::Baseline;
        let case = Case { graph: &graph, outputs: &outputs, parameters: &parameters, rows: &rows, set };
        compared += check(case, &compiled).expect("agreement");
        all += 3 * outputs.len() * (PARAMETERS + INPUTS) * rows.len();
    }
    assert!(compared * 10 > all * 8, "{compared} of {all}");
}
