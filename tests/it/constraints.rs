//! Constraints of a model: what solvers see of them, against differences and against values known by hand.

use phical::compile::{Program, compile};
use phical::data::Table;
use phical::diag::{Code, Diagnostics, Source};
use phical::model::load;
use phical::problem::{Options, Problem, Selection};
use phical::simulate;
use phical::solve::{LeastSquares, Relation};
use phical::testing::differences;

use crate::fitting::bound;
use crate::flagship::compiled;
use crate::shared::project;

/// Parameters of every shape, among them rotations at the identity, in every kind of constraint.
const EVERYTHING: &str = r#"(
    name: "everything",
    units: (length: "mm", angle: "deg"),
    chains: { "arm": [
        Revolute(name: "J1", a: Free("2 mm"), b: Held("3 mm"), alpha: Free("pi/2")),
        Revolute(name: "J2", a: Free("100 mm"), b: "2*J1.a", beta: Free("1 deg")),
    ] },
    parameters: {
        "scale": Scalar(Free(1.5)),
        "p": Vec3(Free((10, 20, 30))),
        "q": Vec3(Held((1, 2, 3))),
        "tilt": Rotation(Free((0, 0, 0))),
        "turned": Rotation(Free((0.5, "-40 deg", 0.1))),
        "base": Pose(Free((1, 2, 3, 0, 0, 0))),
        "target": Vec3(value: Free((5, 6, 7)), family: true, members: { "b/1": Free((-4, 9, 1)) }),
    },
    functions: { "apart(a, b)": "norm(a - b)" },
    define: { "k": "2*scale" },
    constraints: {
        "sum":      "scale + k = 2",
        "product":  "scale*J1.a >= 1 mm",
        "range":    "0.1 mm <= J1.a + J1.b <= 3 mm",
        "bar":      "apart(target[A], target['b/1']) = 1000.02 mm",
        "vector":   "tilt*p - q = vec(0, 0, 100 mm)",
        "poses":    "base*p = inverse(base)*target[A]",
        "rotation": "log_rotation(inverse(tilt)*turned) = vec(0, 0, 10 deg)",
        "chain":    "arm(J1.alpha, 20 deg).o.x <= 3*p.y + J1.b",
        "height":   "target[b, '1'].z = target[A].z",
    },
    measurements: { "m": (
        keys: ["hole", "other"], inputs: {"x": (unit: "mm", sigma: "1 mm"), "y": (unit: "mm")},
        residuals: { "r": "norm(target[hole] + p*scale + base.o + tilt*turned*q) + arm(0, 1).o.x - x + y" },
    ) },
)"#;

/// A row for each of two members.
fn rows() -> Table {
    let mut table = Table::new(2, 2);
    for names in [["A", "0"], ["b/1", "0"]] {
        table.push(&names, &[1.0, 2.0], None).expect("a row of the table");
    }
    table
}

fn problem<'p>(program: &'p Program, fix: &[&str]) -> Problem<'p> {
    let fix = fix.iter().map(|name| ((*name).into(), None)).collect();
    bound(program, &[rows()], Selection { fix, ..Selection::default() }, None)
}

fn refused(text: &str, selection: Selection) -> Diagnostics {
    let program = compiled(text);
    let options = Options { selection, ..Options::default() };
    Problem::bind(&program, vec![(0, rows())], &options).expect_err("it cannot be bound")
}

/// Compares every gradient at a point with differences along every free coordinate.
fn compare(problem: &Problem, q: &Vec<f64>, wrong: f64) -> Result<usize, String> {
    let found = problem.constraints(q).map_err(|error| error.to_string())?;
    let names: Vec<&str> = problem.constrained().map(|item| item.name.as_str()).collect();
    assert_eq!(names.len(), found.len());
    let mut sharp = 0;
    for k in 0..problem.dimension() {
        let at = |h: f64| {
            let mut delta = vec![0.0; problem.dimension()];
            delta[k] = h;
            let there = problem.constraints(&problem.retract(q, &delta)).ok()?;
            Some(there.iter().map(|constraint| constraint.value).collect())
        };
        for (i, (expected, error)) in differences(found.len(), at).into_iter().enumerate() {
            let gradient = found[i].gradient[k] * wrong;
            let unit = 1.0 + gradient.abs() + found[i].magnitude * 1e-3;
            if (gradient - expected).abs() > 30.0 * error + 1e-8 * unit {
                let by = &problem.layout.coordinates[problem.free[k]].name;
                return Err(format!("{} by {by}: {gradient:e}, {expected:e} ± {error:e}", names[i]));
            }
            sharp += usize::from(error < 1e-7 * unit && gradient != 0.0);
        }
    }
    Ok(sharp)
}

#[test]
fn gradients_are_those_of_differences_at_the_identity_and_elsewhere() {
    let program = compiled(EVERYTHING);
    for fix in [&[][..], &["tilt", "target[A].x", "base.rz", "J2.a"]] {
        let problem = problem(&program, fix);
        let delta: Vec<f64> = (0..problem.dimension()).map(|k| 0.3 * (k as f64 + 0.7).sin()).collect();
        for q in [problem.start.clone(), problem.retract(&problem.start, &delta)] {
            let sharp = compare(&problem, &q, 1.0).unwrap_or_else(|wrong| panic!("{wrong}"));
            assert!(sharp > 25, "{sharp}");
            assert!(compare(&problem, &q, 1.001).is_err());
        }
    }
}

#[test]
fn values_relations_and_names() {
    let program = compiled(EVERYTHING);
    let problem = problem(&program, &[]);
    let found = problem.constraints(&problem.start).expect("they are defined");
    let of = |name: &str| {
        let at = problem.constrained().position(|item| item.name == name).unwrap_or_else(|| panic!("no `{name}`"));
        (&found[at], problem.constrained().nth(at).expect("there"))
    };
    let expected = [
        ("sum", Relation::Equal, 2.5, true),
        // at least: the other side less this one
        ("product", Relation::AtMost, 1.0 - 3.0, false),
        ("range (lower)", Relation::AtMost, 0.1 - 5.0, true),
        ("range (upper)", Relation::AtMost, 5.0 - 3.0, true),
        ("bar", Relation::Equal, 126f64.sqrt() - 1000.02, false),
        ("vector.x", Relation::Equal, 9.0, false),
        ("vector.z", Relation::Equal, 27.0 - 100.0, false),
        ("poses.x", Relation::Equal, 11.0 - 4.0, false),
        ("height", Relation::Equal, 1.0 - 7.0, true),
    ];
    for (name, relation, value, linear) in expected {
        let (constraint, item) = of(name);
        assert_eq!((constraint.relation, item.linear), (relation, linear), "{name}");
        assert!((constraint.value - value).abs() < 1e-12, "{name}: {} is not {value}", constraint.value);
        assert!(constraint.magnitude >= value.abs(), "{name}");
    }
    // two targets of about ten from each other: their sizes and both sides
    let (bar, item) = of("bar");
    assert!(bar.magnitude > 1000.02 && bar.magnitude < 1060.0, "{}", bar.magnitude);
    assert_eq!(item.text, "apart(target[A], target['b/1']) = 1000.02 mm");
    assert!((bar.violation() - (1000.02 - 126f64.sqrt())).abs() < 1e-9);
}

#[test]
fn what_is_held_contributes_its_value_alone() {
    let program = compiled(EVERYTHING);
    let all = problem(&program, &[]);
    let some = problem(&program, &["target[A]"]);
    let of = |problem: &Problem| {
        let at = problem.constrained().position(|item| item.name == "bar").expect("there");
        let found = problem.constraints(&problem.start).expect("defined").swap_remove(at);
        let seen: Vec<String> = (0..problem.dimension())
            .filter(|&k| found.gradient[k] != 0.0)
            .map(|k| problem.layout.coordinates[problem.free[k]].name.clone())
            .collect();
        (found.value, seen)
    };
    assert_eq!(of(&all).0, of(&some).0);
    assert_eq!(of(&all).1.len(), 6);
    assert_eq!(of(&some).1, ["target[b/1].x", "target[b/1].y", "target[b/1].z"]);
}

#[test]
fn held_constraints_are_met_or_refused() {
    let met = EVERYTHING.replace("scale + k = 2", "scale + k = 4.5");
    let met_program = compiled(&met);
    let problem = problem(&met_program, &["scale"]);
    assert!(problem.constrained().all(|item| item.name != "sum"));
    let fix = vec![("scale".to_owned(), None)];
    let found = refused(EVERYTHING, Selection { fix, ..Selection::default() });
    assert_eq!(found.iter().filter(|d| d.code == Code::BrokenConstraint).count(), 1);
    let message = &found.iter().find(|d| d.code == Code::BrokenConstraint).expect("there").message;
    assert_eq!(message, "`sum` is not met by what is held: its sides are 4.5 and 2, off by 2.5");
    // what is left when more is held
    let all = problem.with_free(Vec::new());
    assert_eq!(all.constrained().len(), 0);
    assert_eq!(all.constraints(&all.start).expect("nothing is asked"), []);
}

#[test]
fn a_difference_that_is_rounding_is_met() {
    let text = r#"(
        name: "rounding", units: (length: "mm"),
        parameters: { "a": Scalar(Held("0.1 mm")), "b": Scalar(Held("0.2 mm")), "c": Scalar(Held("0.3 mm")), "d": Scalar(Free("0 mm")) },
        constraints: { "sum": "a + b - c = 0" },
        measurements: { "m": (keys: ["k", "l"], inputs: {"x": (unit: "mm"), "y": ()}, residuals: {"r": "a + b + c + d - x"}) },
    )"#;
    let program = compiled(text);
    assert_eq!(problem(&program, &[]).constrained().len(), 0);
    let broken = text.replace("0.3 mm", "0.3000001 mm");
    assert!(refused(&broken, Selection::default()).has_errors());
}

#[test]
fn undefined_constraints_are_named() {
    let text = EVERYTHING.replace("scale + k = 2", "sqrt(scale - 1.5) <= 2");
    let program = compiled(&text);
    let problem = problem(&program, &[]);
    let message = problem.constraints(&problem.start).expect_err("no derivative at zero").to_string();
    assert!(message.starts_with("constraint `sum`: `sqrt` has no derivative at 0"), "{message}");
    let mut below = problem.start.clone();
    below[problem.layout.find("scale").expect("there")] = 1.0;
    let message = problem.constraints(&below).expect_err("no value").to_string();
    assert!(message.starts_with("constraint `sum`: `sqrt` has no value at -0.5"), "{message}");
}

#[test]
fn members_that_no_row_names_are_mistakes() {
    let text = EVERYTHING.replace("target[b, '1']", "target[a]");
    let found = refused(&text, Selection::default());
    let mistakes: Vec<_> = found.iter().filter(|d| d.code == Code::ConstraintMember).collect();
    assert_eq!(mistakes.len(), 1);
    assert_eq!(mistakes[0].hint.as_deref(), Some("did you mean `A`?"));
    // who searches for nothing is not bothered
    let program = compiled(&text);
    let options = Options { unconstrained: true, ..Options::default() };
    let (problem, _) = Problem::bind(&program, vec![(0, rows())], &options).expect("it binds");
    assert_eq!(problem.constrained().len(), 0);
}

#[test]
fn starts_outside_bounds_are_said_with_their_numbers() {
    let text = r#"(
        name: "bounds", units: (length: "mm", angle: "deg"),
        parameters: { "a": Scalar(Free(nominal: "1 deg", max: "2 deg")), "b": Scalar(Free(nominal: 1, min: 0)) },
        measurements: { "m": (keys: ["k", "l"], inputs: {"x": (), "y": ()}, residuals: {"r": "a*x + b - y"}) },
    )"#;
    let program = compiled(text);
    let selection = Selection {
        start: vec![("a".into(), 2.5)],
        fix: vec![("b".into(), Some("-0.5".into()))],
        ..Selection::default()
    };
    let options = Options { selection, ..Options::default() };
    let (problem, warnings) = Problem::bind(&program, vec![(0, rows())], &options).expect("it binds");
    let said: Vec<(Code, &str)> = warnings.iter().map(|d| (d.code, d.message.as_str())).collect();
    assert!(said.contains(&(Code::StartProjected, "`a` starts at 2.5 deg, above its most, and was moved to 2 deg")));
    assert!(said.contains(&(Code::HeldOutside, "`b` is held at -0.5, below its least, which is 0")), "{said:?}");
    assert_eq!(problem.start, [2f64.to_radians(), -0.5]);
}

/// The model of `models/known_distances`: what its scenario makes up meets its constraints.
#[test]
fn the_known_distances_are_true() {
    let text = std::fs::read_to_string(project("models/known_distances/model.ron")).expect("the model is there");
    let source = Source::new("model.ron", text);
    let (model, _) = load(&source).expect("it loads");
    let (program, warnings) = compile(&model, &source, &[]).expect("it compiles");
    assert!(warnings.is_empty());
    let made =
        simulate::simulate(&program, &program.scenarios[0], &simulate::Options::default()).expect("it simulates");
    let selection = Selection { start: made.truth.clone(), ..Selection::default() };
    let options = Options { selection, ..Options::default() };
    let (problem, _) = Problem::bind(&program, made.tables, &options).expect("it binds");
    let found = problem.constraints(&problem.start).expect("defined");
    let names: Vec<&str> = problem.constrained().map(|item| item.name.as_str()).collect();
    assert_eq!(names, ["bar", "plate"]);
    assert!(found.iter().all(|constraint| constraint.violation() < 1e-12 * constraint.magnitude));
    assert!((found[1].value + 0.02).abs() < 1e-9);
}
