//! What is asked of public functions that is not there: rows, blocks, coordinates, measurements, tables and points of another
//! size. All of it is refused, and nothing panics.

use phical::compile::Program;
use phical::coverage::predicted;
use phical::data::{Buffer, Table, write_to};
use phical::derive::{Asked, derive};
use phical::evaluate::{Estimated, evaluate, jacobians, uncertainties};
use phical::fit::{Fit, JointUncertainty, analyse};
use phical::problem::{Options, Problem, Quantities, Rows};
use phical::report::{rounded, significant};
use phical::simulate::with_declared_errors;
use phical::solve::{InRows, Keep, LeastSquares, SequentialState, Settings, Solver, Suited, minimise};
use phical::testing::program;
use proptest::prelude::*;

use crate::cli::{model, refused};

/// A turned rod with targets that move, a condition, and an output.
fn rod() -> Program {
    program(
        r#"(name: "rod",
            parameters: {
                "long": Scalar(Free(nominal: 2, min: 0.1, max: 9)), "tilt": Rotation(Free((0.1, 0, 0))),
                "place": Scalar(value: Free(0), family: true),
            },
            constraints: { "short": "long <= 5" },
            measurements: { "height": (
                keys: ["at"],
                inputs: { "t": (unit: "rad", sigma: "0.001"), "h": (sigma: "0.01") },
                residuals: { "r": "h - place[at] - long * sin(t) - (tilt * vec(0, 0, 1)).z + 1" },
                outputs: { "tip": "long * cos(t)" },
            ) },
        )"#,
    )
}

/// Rows of two targets.
fn rows() -> Table {
    let mut table = Table::new(1, 2);
    for k in 0..24 {
        let angle = 0.1 * f64::from(k) - 1.0;
        let (name, place) = if k % 2 == 0 { ("a", 0.3) } else { ("b", -0.2) };
        table.push(&[name], &[angle, place + 2.1 * angle.sin()], None).expect("two readings");
    }
    table
}

fn bound(program: &Program) -> Problem<'_> {
    let options = Options {
        selection: phical::problem::Selection { fix: vec![("tilt".into(), None)], ..Default::default() },
        ..Options::default()
    };
    Problem::bind(program, vec![(0, rows())], &options).expect("it can be bound").0
}

fn fitted(problem: &Problem) -> Fit {
    let solution = Suited::default().solve(problem, problem.start.clone()).expect("it begins");
    analyse(problem, solution).expect("it is defined")
}

/// All that a problem does at a point: whether any of it went well.
fn anything(problem: &Problem, point: &[f64]) -> bool {
    let block = &problem.blocks[0];
    let q = point.to_vec();
    [
        problem.check(point).is_ok(),
        problem.sums(point).is_ok(),
        problem.linearised(point).is_ok(),
        problem.at_consistent_inputs(point, Rows::All).is_ok(),
        problem.derivatives(point, |_, _| ()).is_ok(),
        problem.inspect(point, |_| ()).is_ok(),
        problem.engine_rows(0, point, |_| ()).is_ok(),
        problem.sensitivities(0, point, &[0], |_| ()).is_ok(),
        problem.pure_error(point).is_ok(),
        problem.path(point).is_ok(),
        problem.consistent(point).is_ok(),
        problem.all_equations(point).is_ok(),
        problem.linearised_constraints(point).is_ok(),
        problem.estimated_scales(point).is_ok(),
        problem.cost(&q).is_ok(),
        problem.evaluate(&q).is_ok(),
        problem.cost_of(&[(0, 0)], &q).is_ok(),
        block.values(Quantities::Outputs, &problem.layout, point, |_, _| ()).is_ok(),
        block.jacobians(&problem.layout, point, &problem.places(), |_| Ok(())).is_ok(),
        block.input_jacobians(&problem.layout, point, |_, _| ()).is_ok(),
        block.leaves_of(&problem.layout, point, 0).is_ok(),
        evaluate(problem, point).is_ok(),
        jacobians(problem, point).is_ok(),
        uncertainties(problem, point, &[]).is_ok(),
        phical::audit::check_points(problem, std::slice::from_ref(&q)).is_ok(),
        minimise(problem, q.clone(), &Settings::default()).is_ok(),
        Suited::default().solve(problem, q).is_ok(),
    ]
    .contains(&true)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn points_of_another_size(length in 0..20usize, value in -2.0..2.0f64) {
        let program = rod();
        let problem = bound(&program);
        prop_assume!(length != problem.layout.coordinates.len());
        let point = vec![value; length];
        prop_assert!(!anything(&problem, &point));
        // what has no error to give has no number to give
        prop_assert_eq!(problem.retract(&point, &[0.1, 0.2]).len(), problem.layout.coordinates.len());
        let (lower, upper) = problem.bounds(&point);
        prop_assert_eq!((lower.len(), upper.len()), (problem.free.len(), problem.free.len()));
        prop_assert_eq!(problem.offset(&point).len(), problem.free.len());
        prop_assert_eq!(problem.difference(&point, &problem.start).len(), problem.start.len());
    }

    #[test]
    fn rows_that_are_not_there(row in prop_oneof![0..60usize, Just(usize::MAX), Just(usize::MAX - 1)], column in 0..4usize) {
        let table = rows();
        let there = row < table.rows();
        prop_assert_eq!(table.row(row).iter().all(|reading| reading.is_finite()), there);
        prop_assert_eq!(table.row(row).len(), 2);
        prop_assert_eq!(!table.key(row, column).is_empty(), there && column == 0);
        prop_assert_eq!(table.key_index(row, column) < u32::MAX, there && column == 0);
        prop_assert_eq!(table.names(column).is_empty(), column > 0);
        prop_assert!(table.place(row).row.is_some());
        let mut buffer = Buffer::default();
        prop_assert_eq!(table.read(row..row.saturating_add(1), &mut buffer).is_ok(), there);
        let some = table.read(0..5, &mut buffer).expect("they are there");
        prop_assert_eq!((some.row(row).len(), some.keys(row).len()), if row < 5 { (2, 1) } else { (0, 0) });
        prop_assert_eq!(some.line(row), None);

        let program = rod();
        let problem = bound(&program);
        let start = &problem.start;
        prop_assert_eq!(problem.blocks[0].leaves_of(&problem.layout, start, row).is_ok(), there);
        prop_assert_eq!(problem.cost_of(&[(0, row)], start).is_ok(), there);
        prop_assert_eq!(problem.cost_of(&[(row, 0)], start).is_ok(), row == 0);
        prop_assert_eq!(problem.engine_rows(row, start, |_| ()).is_ok(), row == 0);
        prop_assert_eq!(problem.observations(row).is_empty(), row > 0);
        prop_assert!(!problem.whitened_by_factors(row) && problem.observation_correlations(row).is_none());
        let known = row < problem.layout.coordinates.len();
        prop_assert_eq!(problem.sensitivities(0, start, &[row], |_| ()).is_ok(), known);
        prop_assert_eq!(problem.with_free(vec![row]).free.len(), usize::from(known));
        prop_assert_eq!(Estimated::unstated(&problem, "some", vec![row]).coordinates.len(), usize::from(known));
        let mut other = problem.clone();
        other.set_weight((row, row), 0.5);
    }

    #[test]
    fn measurements_and_tables_of_others(number in 0..4usize, keys in 0..3usize, inputs in 0..4usize) {
        let program = rod();
        let (names, readings) = (vec!["a"; keys], vec![0.5; inputs]);
        let mut table = Table::new(keys, inputs);
        table.push(&names, &readings, None).expect("it is of this table");
        let fits = number == 0 && (keys, inputs) == (1, 2);
        prop_assert_eq!(Problem::bind(&program, vec![(number, table.clone())], &Options::default()).is_ok(), fits);
        prop_assert_eq!(with_declared_errors(&program, number, &table, 1).is_ok(), fits);
        prop_assert_eq!(write_to(&program, number, &table, &mut Vec::new()).is_ok(), fits);
        prop_assert_eq!(derive(&program, number, &Asked::default()).is_ok(), number == 0);
        let mut all = rows();
        prop_assert_eq!(all.append(&table).is_ok(), (keys, inputs) == (1, 2));
        let before = all.rows();
        prop_assert_eq!(all.push(&names, &readings, None).is_ok(), (keys, inputs) == (1, 2));
        prop_assert_eq!(all.rows() - before, usize::from((keys, inputs) == (1, 2)));
        let mut problem = bound(&program);
        prop_assert_eq!(problem.push(number, &names, &readings, None).is_some(), fits);
    }
}

#[test]
fn what_is_known_of_other_parameters() {
    let program = rod();
    let problem = bound(&program);
    let fit = fitted(&problem);
    let covariance = fit.covariance.as_ref().expect("the data determine it");
    assert!(covariance.sigma(99).is_nan() && covariance.correlation(0, 99).is_none());
    assert!(covariance.with_datum(&[vec![1.0]], &[0]).is_err());
    assert!(covariance.with_datum(&[vec![1.0; 3]], &[99]).is_err());
    let measurement = &program.measurements[0];
    assert!(predicted(&problem, &fit, measurement, &["a"], &[0.1, 0.2]).is_some());
    assert!(predicted(&problem, &fit, measurement, &["a"], &[0.1]).is_none());
    assert!(predicted(&problem, &fit, measurement, &[], &[0.1, 0.2]).is_none());
    assert!(predicted(&problem, &Fit { point: vec![1.0], ..fit.clone() }, measurement, &["a"], &[0.1, 0.2]).is_none());
    // sizes that do not go together say nothing
    let whole = JointUncertainty::of(&fit);
    for broken in [
        JointUncertainty { tolerances: vec![], ..whole.clone() },
        JointUncertainty { on_bound: vec![], ..whole.clone() },
        JointUncertainty { covariance: Some(vec![vec![1.0]]), ..whole.clone() },
        JointUncertainty { null_directions: vec![vec![1.0]], ..whole.clone() },
    ] {
        let known = Estimated::new(&problem, "broken", &broken);
        assert!(uncertainties(&problem, &fit.point, &[known]).is_ok());
    }
}

#[test]
fn more_digits_than_a_double_has() {
    for digits in [0, 17, 18, 70_000, usize::MAX] {
        assert!(significant(0.1, digits).len() < 30 && rounded(0.5, digits).len() < 30, "{digits}");
    }
    assert_eq!(significant(0.1, usize::MAX), significant(0.1, 17));
}

/// `n + 64` was too large for a number of rows.
#[test]
fn as_many_rows_are_kept_as_can_be_counted() {
    let program = rod();
    let problem = bound(&program);
    let keep = Keep::Last(usize::MAX);
    let mut state = SequentialState::new(&problem, problem.start.clone(), keep, Settings::default());
    state.add(&problem, &problem.rows()).expect("they are defined");
    assert_eq!(state.kept().len(), 24);
    let flagship = model("two_theodolite");
    let most = usize::MAX.to_string();
    crate::cli::ends(0, &["calibrate", &flagship, "--solver", "sequential", "--keep", &most]);
}

/// Rows were drawn until the disk was full.
#[test]
fn as_many_rows_as_can_be_counted_are_not_made() {
    let directory = tempfile::tempdir().expect("it can be made");
    let file = crate::cli::path(&directory, "rod.ron");
    let text = r#"(name: "rod", parameters: { "a": Scalar(Free(1)) }, measurements: { "m": (
        inputs: { "x": (), "y": () }, residuals: { "r": "y - a*x" },
    ) })"#;
    std::fs::write(&file, text).expect("it can be written");
    let most = format!("m={}", usize::MAX);
    assert_eq!(refused(&["identify", &file, "--structural", "--rows", &most]), ["E038"]);
}
