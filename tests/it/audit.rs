//! Derivatives by hand: right ones raise no alarm, planted mistakes are found where they are.

use std::collections::BTreeSet;
use std::sync::Arc;

use phical::audit::{CheckedFormula, check_formulas};
use phical::compile::{Formulas, Program, compile, formulas};
use phical::diag::Source;
use phical::graph::Tape;
use phical::lang::{Expr, ExprKind, Op, parse, print};
use phical::model::{Model, load};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use crate::shared::project;

/// A quantity, and by what it is differentiated.
type Entry = (String, Option<String>);

struct Read {
    source: Arc<Source>,
    model: Model,
    program: Program,
    formulas: Vec<Formulas>,
}

/// A model with its formulas; none where they make no sense.
fn read(text: &str) -> Option<Read> {
    let source = Source::new("model.ron", text);
    let (model, _) = load(&source).ok()?;
    let (program, _) = compile(&model, &source, &[]).ok()?;
    let formulas = formulas(&model, &source).ok()?;
    Some(Read { source, model, program, formulas })
}

impl Read {
    fn checked(&self, seed: u64, mend: bool) -> Vec<CheckedFormula> {
        check_formulas(&self.model, &self.source, &self.program, &self.formulas, seed, mend)
    }

    /// Components of every formula at a few points, by quantity and parameter.
    fn values(&self) -> Vec<(Entry, Vec<f64>)> {
        let mut all = Vec::new();
        for found in &self.formulas {
            let measurement = &self.program.measurements[found.measurement];
            let mut random = ChaCha8Rng::seed_from_u64(99);
            let mut points = Vec::new();
            for _ in 0..8 {
                let mut leaves = vec![0.0; measurement.leaves];
                for slot in &measurement.slots {
                    for (i, nominal) in self.program.parameters[slot.parameter].setting.nominal.iter().enumerate() {
                        leaves[slot.first_leaf + i] = nominal + 0.1 * (random.random::<f64>() - 0.5);
                    }
                }
                let inputs: Vec<f64> = measurement.inputs.iter().map(|_| random.random::<f64>() - 0.4).collect();
                points.push((leaves, inputs));
            }
            for formula in &found.all {
                let tape = Tape::lower(&found.graph, &formula.given);
                let at = |(leaves, inputs): &(Vec<f64>, Vec<f64>)| {
                    let (mut leaves, mut inputs) = (leaves.clone(), inputs.clone());
                    leaves.resize(leaves.len().max(tape.parameters()), 0.0);
                    inputs.resize(inputs.len().max(tape.inputs()), 0.0);
                    tape.evaluate(&leaves, &inputs)
                };
                let key = (formula.of.clone(), formula.by.as_ref().map(|by| by.name.clone()));
                all.push((key, points.iter().flat_map(at).collect()));
            }
        }
        all
    }
}

fn flagship() -> String {
    std::fs::read_to_string(project("models/two_theodolite/model.ron")).expect("readable")
}

/// The paper's (16), (17), (18), (21) and (22).
#[test]
fn the_papers_formulas_agree_to_twelve_digits() {
    let read = read(&flagship()).expect("it compiles");
    for seed in 0..5 {
        let found = read.checked(seed, true);
        assert_eq!(found.len(), 4 * 21 + 1);
        for one in &found {
            assert!(one.agrees && one.digits >= 12.0 && one.points == 12, "seed {seed}: {one:#?}");
        }
    }
}

/// A sign in a function's body is wrong for some parameters and right for others: the change has to be right for all.
#[test]
fn the_mistake_is_named_where_it_is() {
    let wrong = flagship().replace(
        "dot(r.z, derivative(cross(l.o, l.z), q)) + dot(derivative(r.z, q)",
        "dot(r.z, derivative(cross(l.o, l.z), q)) - dot(derivative(r.z, q)",
    );
    let read = read(&wrong).expect("it compiles");
    let found = read.checked(1, true);
    let wrong: Vec<&CheckedFormula> = found.iter().filter(|one| !one.agrees).collect();
    assert!(!wrong.is_empty() && wrong.iter().all(|one| one.of.starts_with("kci")));
    for one in wrong {
        let by = one.by.as_deref().expect("a parameter");
        assert!(by.starts_with('R'), "{by}");
        let repair = one.repair.as_ref().expect("a repair");
        assert_eq!(repair.within.as_deref(), Some("dkci"), "{repair:?}");
    }
}

/// A planar arm with every derivative written out: names, signs, sines and factors that can be mistaken.
const ARM: &str = r#"(
    name: "arm",
    parameters: {
        "alpha": Scalar(Free("0.3 rad")), "beta": Scalar(Free("0.7 rad")),
        "a": Scalar(Free("400 mm")), "b": Scalar(Free("300 mm")), "k": Scalar(Free(1.5)),
    },
    measurements: { "point": (
        inputs: { "s": (unit: "rad"), "t": (unit: "rad"), "x": (unit: "mm"), "y": (unit: "mm") },
        define: { "u": "s + alpha", "v": "s + alpha + k*t + beta" },
        residuals: {
            "rx": "a*cos(u) + b*cos(v) - x",
            "ry": "a*sin(u) + b*sin(v) - y",
            "r2": "(a*cos(u) + b*cos(v))^2 / a - k*sqrt(a*b)",
        },
        derivatives: {
            "rx": {
                "a": "cos(u)", "b": "cos(v)", "alpha": "-a*sin(u) - b*sin(v)", "beta": "-b*sin(v)", "k": "-b*t*sin(v)",
                "x": "-1", "t": "-k*b*sin(v)",
            },
            "ry": { "a": "sin(u)", "b": "sin(v)", "alpha": "a*cos(u) + b*cos(v)", "beta": "b*cos(v)", "k": "b*t*cos(v)" },
            "r2": {
                "a": "2*(a*cos(u) + b*cos(v))*cos(u)/a - (a*cos(u) + b*cos(v))^2/a^2 - k*b/(2*sqrt(a*b))",
                "b": "2*(a*cos(u) + b*cos(v))*cos(v)/a - k*a/(2*sqrt(a*b))",
                "beta": "-2*(a*cos(u) + b*cos(v))*b*sin(v)/a",
                "k": "-2*(a*cos(u) + b*cos(v))*b*t*sin(v)/a - sqrt(a*b)",
            },
        },
    ) },
)"#;

/// Places of a tree, the root first.
fn places(expr: &Expr) -> usize {
    1 + expr.children().map(places).sum::<usize>()
}

fn rebuilt(expr: &Expr, at: &mut usize, change: &mut dyn FnMut(&Expr) -> Option<Expr>) -> Expr {
    let here = *at == 0;
    *at = at.wrapping_sub(1);
    if here && let Some(new) = change(expr) {
        return new;
    }
    let mut children: Vec<Expr> = expr.children().map(|child| rebuilt(child, at, change)).collect();
    children.reverse();
    let mut next = || Box::new(children.pop().expect("as many as before"));
    let kind = match &expr.kind {
        ExprKind::Field(_, field) => ExprKind::Field(next(), field.clone()),
        ExprKind::Negate(_) => ExprKind::Negate(next()),
        ExprKind::Binary { op, .. } => ExprKind::Binary { op: *op, left: next(), right: next() },
        ExprKind::Call { function, name_span, arguments } => ExprKind::Call {
            function: function.clone(),
            name_span: name_span.clone(),
            arguments: arguments.iter().map(|_| *next()).collect(),
        },
        leaf => leaf.clone(),
    };
    Expr { kind, span: expr.span.clone() }
}

/// A slip of the pen at a place of a formula, if one of this kind can happen there.
fn slip(expr: &Expr, kind: u64, names: &[&str]) -> Option<Expr> {
    let made = |kind: ExprKind| Expr { kind, span: 0..0 };
    let number = |value: f64| Box::new(made(ExprKind::Number { value, unit: None }));
    let call = |function: &str, arguments: Vec<Expr>| {
        made(ExprKind::Call { function: function.into(), name_span: 0..0, arguments })
    };
    Some(match (kind % 12, &expr.kind) {
        // a sign
        (0, _) => made(ExprKind::Negate(Box::new(expr.clone()))),
        // a factor of two too many
        (1, _) => made(ExprKind::Binary { op: Op::Mul, left: number(2.0), right: Box::new(expr.clone()) }),
        // α for β, h_L for h_R, l for r
        (2 | 3, ExprKind::Name(name)) => {
            let others: Vec<&&str> = names.iter().filter(|other| **other != name).collect();
            made(ExprKind::Name((*others.get(kind as usize / 12 % others.len().max(1))?).to_string()))
        }
        // an origin for an axis
        (4, ExprKind::Field(base, field)) => {
            let other = match field.as_str() {
                "o" => "z",
                "z" => "x",
                _ => "o",
            };
            made(ExprKind::Field(base.clone(), other.into()))
        }
        // degrees for radians
        (5, _) => {
            let scale = made(ExprKind::Binary {
                op: Op::Div,
                left: Box::new(made(ExprKind::Name("pi".into()))),
                right: number(180.0),
            });
            made(ExprKind::Binary { op: Op::Mul, left: Box::new(expr.clone()), right: Box::new(scale) })
        }
        // products the other way round, plus for minus, a term or factor dropped
        (6, ExprKind::Call { function, arguments, .. }) if arguments.len() > 1 => {
            let mut swapped = arguments.clone();
            swapped.swap(0, 1);
            call(function, swapped)
        }
        (7, ExprKind::Binary { op: Op::Add, left, right }) => {
            made(ExprKind::Binary { op: Op::Sub, left: left.clone(), right: right.clone() })
        }
        (7, ExprKind::Binary { op: Op::Sub, left, right }) => {
            made(ExprKind::Binary { op: Op::Add, left: left.clone(), right: right.clone() })
        }
        (8, ExprKind::Binary { left, .. }) => (**left).clone(),
        (9, ExprKind::Binary { right, .. }) => (**right).clone(),
        // a power, a sine for a cosine, an inner derivative forgotten
        (10, ExprKind::Number { value, unit }) => made(ExprKind::Number { value: value + 1.0, unit: unit.clone() }),
        (10, ExprKind::Call { function, arguments, .. }) if function == "sin" => call("cos", arguments.clone()),
        (10, ExprKind::Call { function, arguments, .. }) if function == "cos" => call("sin", arguments.clone()),
        (11, ExprKind::Call { function, arguments, .. }) if function == "derivative" => arguments.first()?.clone(),
        (11, ExprKind::Negate(operand)) => (**operand).clone(),
        _ => return None,
    })
}

/// What became of planted mistakes.
#[derive(Debug, Default)]
struct Tally {
    planted: usize,
    refused: usize,
    harmless: usize,
    found: usize,
    mended: usize,
    asked_to_mend: usize,
}

/// Plants mistakes in the texts of a model that stand between the markers, one at a time.
fn plant(text: &str, texts: &[String], names: &[&str], wanted: usize, seed: u64, tally: &mut Tally) {
    let right = read(text).expect("it compiles");
    let truth = right.values();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let until = tally.planted + wanted;
    while tally.planted < until {
        let original = &texts[random.random_range(0..texts.len() as u64) as usize];
        let tree = parse(original).expect("it parses");
        let mut at = random.random_range(0..places(&tree) as u64) as usize;
        let kind = random.random::<u64>() >> 8;
        let mut done = false;
        let wrong = rebuilt(&tree, &mut at, &mut |expr| {
            let new = slip(expr, kind, names);
            done = new.is_some();
            new
        });
        let wrong = print(&wrong);
        if !done || wrong == print(&tree) {
            continue;
        }
        tally.planted += 1;
        let Some(with) = read(&text.replacen(&format!("\"{original}\""), &format!("\"{wrong}\""), 1)) else {
            // dimensions or shapes gave it away, with a place
            tally.refused += 1;
            continue;
        };
        let values = with.values();
        assert_eq!(values.len(), truth.len());
        let off = |(a, b): &(f64, f64)| match a.is_nan() || b.is_nan() {
            true => a.is_nan() != b.is_nan(),
            false => (a - b).abs() > 1e-12 * (a.abs() + b.abs()),
        };
        let differ = |a: &[f64], b: &[f64]| a.iter().copied().zip(b.iter().copied()).any(|pair| off(&pair));
        let changed: BTreeSet<_> =
            values.iter().zip(&truth).filter(|(a, b)| differ(&a.1, &b.1)).map(|(a, _)| a.0.clone()).collect();
        let mend = tally.planted.is_multiple_of(10);
        let checked = with.checked(seed, mend);
        let alarms: BTreeSet<_> =
            checked.iter().filter(|one| !one.agrees).map(|one| (one.of.clone(), one.by.clone())).collect();
        assert_eq!(alarms, changed, "`{original}` written as `{wrong}`");
        if changed.is_empty() {
            tally.harmless += 1;
            continue;
        }
        tally.found += 1;
        for one in checked.iter().filter(|one| !one.agrees) {
            let example = one.counter_example.as_ref().expect("a counter-example");
            assert!((example.given - example.exact).abs() > 0.0 || example.given.is_nan(), "{one:#?}");
        }
        if mend {
            tally.asked_to_mend += 1;
            let mended = checked.iter().filter_map(|one| one.repair.as_ref()).next();
            tally.mended += usize::from(mended.is_some());
        }
    }
}

/// How many mistakes are planted.
fn wanted() -> usize {
    std::env::var("PHICAL_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(300)
}

/// A seed that is another one in every run, said so that it can be repeated.
fn fresh_seed() -> u64 {
    let given = std::env::var("PHICAL_SEED").ok().and_then(|seed| seed.parse().ok());
    let seed = given.unwrap_or_else(|| u64::from(std::process::id()));
    eprintln!("PHICAL_SEED={seed}");
    seed
}

#[test]
fn planted_mistakes_are_found_where_they_are() {
    let seed = fresh_seed();
    let mut tally = Tally::default();
    let texts: Vec<String> = {
        let lines = ARM.lines().skip_while(|line| !line.contains("derivatives"));
        let quoted = lines.flat_map(|line| line.split('"').skip(3).step_by(4).map(str::to_owned).collect::<Vec<_>>());
        // a text that stands twice could be changed in the wrong place
        quoted.filter(|text| text.len() > 6 && ARM.matches(&format!("\"{text}\"")).count() == 1).collect()
    };
    assert!(texts.len() >= 8, "{texts:?}");
    plant(ARM, &texts, &["alpha", "beta", "a", "b", "u", "v", "s", "t", "k"], wanted() / 2, seed, &mut tally);

    // the paper's, by two parameters of each kind
    let text = flagship().replace("\"*\"", "\"L1.*\"");
    let bodies: Vec<String> = ["dz(l, r)", "dh(l, r, q)", "dp(l, r, q)", "dkci(l, r, q)"]
        .iter()
        .map(|head| {
            let line = text.lines().find(|line| line.contains(&format!("\"{head}\":"))).expect("the function");
            line.split('"').nth(3).expect("its body").to_owned()
        })
        .collect();
    plant(&text, &bodies, &["l", "r"], wanted() - wanted() / 2, seed, &mut tally);
    eprintln!("{tally:?}");
    assert_eq!(tally.planted, tally.refused + tally.harmless + tally.found);
    assert!(tally.found * 2 > tally.planted, "{tally:?}");
}
