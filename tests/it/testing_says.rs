//! What the assertions for users' models say where they fail.

use phical::compile::Program;
use phical::fit::Fit;
use phical::problem::{Options, Problem};
use phical::session::{Procedure, fit_by};
use phical::simulate::{self, simulate};
use phical::testing::{
    assert_derivatives, assert_identifiable, assert_invisible, assert_rank, assert_recovers, assert_same_fit,
    check_derivatives, check_invisible, check_recovers, check_same_fit, program,
};

/// A line through points; `slope` is what stands for the slope.
fn line(slope: &str) -> Program {
    program(&format!(
        r#"(name: "line", parameters: {{
            "a": Scalar(Free(nominal: 1, tolerance: 0.1)), "b": Scalar(Free(nominal: 2, tolerance: 0.1)), "c": Scalar(Free(nominal: 3, tolerance: 0.1)),
        }}, measurements: {{"m": (inputs: {{"x": (), "y": (sigma: 0.1)}}, residuals: {{"r": "y - a - ({slope})*x"}})}},
        scenarios: {{"s": (truth: {{"a": Uniform(0, 2), "b": Uniform(1, 3)}}, measurements: {{"m": (
            rows: 20, draw: {{"x": Uniform(-1, 1)}}, set: {{"y": "a + ({slope})*x"}}, noise: {{"y": (sigma: 0.1)}},
        )}})}})"#
    ))
}

fn fitted(program: &Program, seed: u64, fix: &[&str]) -> Fit {
    let options = simulate::Options { seed: Some(seed), ..simulate::Options::default() };
    let made = simulate(program, &program.scenarios[0], &options).expect("it simulates");
    let fix = fix.iter().map(|name| ((*name).to_owned(), None)).collect();
    let selection = phical::problem::Selection { fix, ..Default::default() };
    let (problem, _) =
        Problem::bind(program, made.tables, &Options { selection, ..Options::default() }).expect("it binds");
    fit_by(&problem, &Procedure::default()).expect("a fit")
}

#[test]
#[should_panic(expected = "not all can be known: rank 2 of 3 free parameters\n  \
    `b` and `c` can only be known in sum: moving `b` by 1 and `c` by -1 changes no residual\n  \
    hold `b`: `c` is then known relative to it")]
fn who_cannot_be_known() {
    assert_identifiable(&line("b + c"));
}

#[test]
#[should_panic(expected = "the rank is 2, not 3: rank 2 of 3 free parameters\n  `b` and `c` can only be known in sum")]
fn a_rank_that_is_too_low() {
    assert_rank(&line("b + c"), 3);
}

#[test]
#[should_panic(
    expected = "`c` is not estimable, either; `a` is estimable; `z` is not free: rank 2 of 3 free parameters"
)]
fn who_is_invisible() {
    assert_invisible(&line("b + c"), &["b", "a", "z"]);
}

#[test]
fn what_holds_is_not_complained_of() {
    let (all, short) = (line("b + c^2"), line("b + c"));
    assert_eq!(check_invisible(&short, &["c", "b"]), Ok(()));
    // c² is seen through its own value alone, which is the same direction as b
    assert_eq!(check_invisible(&all, &["b", "c"]), Ok(()));
    assert_identifiable(&line("b + c*x"));
    assert_rank(&line("b + c*x"), 3);
}

#[test]
#[should_panic(expected = "the fits differ:\n  the cost is ")]
fn fits_of_other_data() {
    assert_same_fit(&fitted(&line("b + c*x"), 1, &[]), &fitted(&line("b + c*x"), 2, &[]), 0.01);
}

#[test]
fn what_differs_between_fits_is_named() {
    let bent = line("b + c*x");
    let one = fitted(&bent, 1, &[]);
    let found = check_same_fit(&one, &fitted(&bent, 2, &[]), 0.01).unwrap_err();
    assert!(
        found.contains("`b` is ") && found.contains("of its standard uncertainty apart, 1e-2 is allowed"),
        "{found}"
    );
    let found = check_same_fit(&one, &fitted(&bent, 1, &["c"]), 0.01).unwrap_err();
    assert!(found.contains("free in the first fit alone: `c`"), "{found}");
    let found = check_same_fit(&fitted(&line("b + c"), 1, &["c"]), &fitted(&line("b + c"), 1, &[]), 0.01).unwrap_err();
    assert!(found.contains("not estimable in the second fit alone: `b`, `c`"), "{found}");
    // the order of parameters does not matter, a changed uncertainty does
    let mut turned = one.clone();
    turned.parameters.reverse();
    assert_eq!(check_same_fit(&one, &turned, 0.0), Ok(()));
    turned.parameters[0].sigma = turned.parameters[0].sigma.map(|sigma| 1.1 * sigma);
    let found = check_same_fit(&one, &turned, 0.01).unwrap_err();
    assert!(found.contains("the standard uncertainty of `c` is"), "{found}");
    turned.parameters[0].value = f64::NAN;
    assert!(check_same_fit(&one, &turned, 0.01).unwrap_err().contains("`c` is"));
}

/// A scenario that does not make what the residuals are about.
const WRONG: &str = r#"(name: "wrong", parameters: {"a": Scalar(Free(1))},
    measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "x - a"})},
    scenarios: {"s": (truth: {"a": 2}, measurements: {"m": (rows: 5, set: {"x": "a + 0.1"})})},
)"#;

#[test]
#[should_panic(expected = "seed 0: the truth does not explain its exact data: cost 2.500e-2, and 3.025e0 at the start")]
fn a_scenario_that_the_model_contradicts() {
    assert_recovers(&program(WRONG), 0..3);
}

/// The minimum that is nearest is not the truth.
const TWO_MINIMA: &str = r#"(name: "two", parameters: {"a": Scalar(Free(nominal: 1, tolerance: 0.01))},
    measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "x - a^2"})},
    scenarios: {"s": (truth: {"a": -2}, measurements: {"m": (rows: 5, set: {"x": "a^2"})})},
)"#;

#[test]
#[should_panic(
    expected = "seed 4: the truth is not recovered\n  `a` came out as 2, its truth is -2: 4.00e2 tolerances off"
)]
fn a_truth_that_is_not_recovered() {
    assert_recovers(&program(TWO_MINIMA), 4..5);
}

#[test]
fn without_a_scenario_nothing_is_recovered() {
    let bare = program(
        r#"(name: "m", parameters: {"a": Scalar(Free(1))}, measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "x - a"})})"#,
    );
    assert_eq!(check_recovers(&bare, 0..1).unwrap_err(), "seed 0: there is no scenario to make exact data of");
}

/// Corners so near that differences see both sides of them.
const CORNER: &str = r#"(name: "corner", parameters: {"a": Scalar(Free(nominal: 0.0010003, tolerance: 1)), "b": Scalar(Free(nominal: 0.0010004, tolerance: 1))},
    measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "abs(a - 0.001) + abs(b - 0.001) - x"})},
    scenarios: {"s": (measurements: {"m": (rows: 5, draw: {"x": Uniform(0, 1)})})},
)"#;

#[test]
#[should_panic(expected = "the residuals are undefined at all of 1 points")]
fn residuals_that_have_no_value() {
    let logarithm = r#"(name: "log", parameters: {"a": Scalar(Free(nominal: -1))},
        measurements: {"m": (inputs: {"x": ()}, residuals: {"r": "x - log(a)"})})"#;
    assert_derivatives(&program(logarithm), 0);
}

#[test]
#[should_panic(expected = "differences show nothing of most of the derivatives")]
fn derivatives_that_do_not_exist() {
    assert_derivatives(&program(CORNER), 0);
}

#[test]
fn derivatives_are_compared_by_all_routes() {
    let compared = check_derivatives(&line("b + c*x"), 4).expect("they agree");
    // 12 rows: by three parameters and two inputs, at the start and four points
    assert_eq!((compared.points, compared.derivatives, compared.undefined), (5, 300, 0));
    assert_eq!(compared.sharp, compared.derivatives);
}
