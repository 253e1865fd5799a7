//! Matrices that another program made: conventions are recognised, mistakes found where they are, right ones left alone.

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::io::Write;

use phical::audit::{Given, Kind, MatrixAudit, Precision, Rule, Stack, Steps, audit_matrix, refit};
use phical::evaluate::jacobians;
use phical::problem::{Options, Problem, Selection, Weights};
use phical::session::{Against, Choice, Session, Values};
use phical::solve::LeastSquares;
use rand::rngs::ChaCha8Rng;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};

use crate::shared::{project, shared};

/// Rows of data that are used.
const ROWS: usize = 24;

/// The flagship with some rows of data, at its start.
struct Case {
    session: Session,
    rows: tempfile::NamedTempFile,
}

impl Case {
    fn flagship() -> Case {
        let session = Session::open(&project("models/two_theodolite/model.ron"), &[]).expect("it compiles");
        let data = std::fs::read_to_string(project("models/two_theodolite/vo_line.csv")).expect("readable");
        let mut rows = tempfile::Builder::new().suffix(".csv").tempfile().expect("writable");
        let some: Vec<&str> = data.lines().take(ROWS + 1).collect();
        writeln!(rows, "{}", some.join("\n")).expect("writable");
        Case { session, rows }
    }

    fn problem(&self) -> Problem<'_> {
        let file = self.rows.path().display().to_string();
        let choice = Choice { files: vec![("vo_line".into(), file)], given_only: true, ..Choice::default() };
        let options = Options { weights: Some(Weights::Unit), unconstrained: true, ..Options::default() };
        self.session.bind(&choice, &options).expect("it binds").problem
    }
}

/// A point beside the start, where derivatives are not special.
fn beside(problem: &Problem, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let step: Vec<f64> =
        problem.scale().iter().map(|tolerance| 300.0 * tolerance * (random.random::<f64>() - 0.5)).collect();
    problem.retract(&problem.start, &step)
}

/// The columns of the parameters alone.
fn parameters(exact: &Stack) -> Vec<Vec<f64>> {
    exact.entries.iter().map(|row| row[..exact.parameters].to_vec()).collect()
}

fn audited(problem: &Problem, point: &[f64], entries: Vec<Vec<f64>>) -> MatrixAudit {
    let exact = Stack::at(problem, point).expect("it is defined");
    let given = Given { names: None, labels: vec![(None, None); entries.len()], entries };
    audit_matrix("given.csv", &given, problem, point, &exact).expect("it fits")
}

fn fresh_seed() -> u64 {
    let given = std::env::var("PHICAL_SEED").ok().and_then(|seed| seed.parse().ok());
    let seed = given.unwrap_or_else(|| u64::from(std::process::id()));
    eprintln!("PHICAL_SEED={seed}");
    seed
}

/// An independent program's matrices at four points, parameters and inputs.
#[test]
fn the_oracle_agrees() {
    let Some(oracle) = shared("reference/two_theodolite_oracle.json") else { return };
    let session = Session::open(&project("models/two_theodolite/model.ron"), &[]).expect("it compiles");
    let selection = Selection { free: vec!["L1.b".into()], ..Selection::default() };
    let asked = Against { file: oracle.display().to_string(), selection, ..Against::default() };
    let (found, _) = asked.run(&session).expect("it fits");
    assert_eq!(found.len(), 4);
    for one in &found {
        assert!(one.audit.agrees && one.audit.digits >= 12.0, "{}: {:#?}", one.point, one.audit);
        assert_eq!(one.audit.shape, (60, 30));
    }
}

/// Any mixture of signs and units of residuals and columns is told as what it is, and single mistakes beside it are found.
#[test]
fn conventions_and_mistakes_are_told_apart() {
    let case = Case::flagship();
    let problem = case.problem();
    let mut random = ChaCha8Rng::seed_from_u64(fresh_seed());
    let factors = [-1.0, 2.0, 0.5, PI / 180.0, 180.0 / PI, 1e3, -1e3, 200.0 / PI];
    for _ in 0..40 {
        let point = beside(&problem, random.random());
        let exact = Stack::at(&problem, &point).expect("it is defined");
        let (n, m) = (exact.parameters, exact.residuals.len());
        let mut entries = parameters(&exact);
        let (mut column, mut residual) = (vec![1.0; n], vec![1.0; m]);
        for _ in 0..random.random_range(0..4_usize) {
            column[random.random_range(0..n)] = *factors.choose(&mut random).expect("some");
        }
        if random.random::<bool>() {
            residual[random.random_range(0..m)] = *factors.choose(&mut random).expect("some");
        }
        for (entries, equation) in entries.iter_mut().zip(&exact.equations) {
            entries.iter_mut().zip(&column).for_each(|(x, c)| *x *= c * residual[equation.residual]);
        }
        // one entry of the larger ones is wrong
        let scales = exact.scales();
        let planted = random.random::<bool>().then(|| {
            loop {
                let (i, k) = (random.random_range(0..entries.len()), random.random_range(0..n));
                if exact.entries[i][k].abs() > 1e-2 * scales[exact.equations[i].residual][k] {
                    break (i, k);
                }
            }
        });
        if let Some((i, k)) = planted {
            entries[i][k] *= 1.0 + 10_f64.powf(-9.0 * random.random::<f64>());
        }
        let found = audited(&problem, &point, entries);
        let told = |by_column: bool| {
            let own = found.findings.iter().filter(|one| one.columns.is_empty() != by_column);
            own.flat_map(|one| if by_column { one.columns.clone() } else { one.residuals.clone() })
                .collect::<BTreeSet<String>>()
        };
        let wanted = |factors: &[f64], names: &[(String, String)]| {
            let off = factors.iter().zip(names).filter(|(f, _)| **f != 1.0);
            off.map(|(_, (name, _))| name.clone()).collect::<BTreeSet<String>>()
        };
        assert_eq!(told(true), wanted(&column, &exact.columns), "{:#?}", found.findings);
        assert_eq!(told(false), wanted(&residual, &exact.residuals), "{:#?}", found.findings);
        assert_eq!(found.agrees, found.findings.is_empty() && planted.is_none());
        assert_eq!(found.wrong, usize::from(planted.is_some()), "{:#?}", found.worst);
        if let Some((i, k)) = planted {
            let (worst, equation) = (&found.worst[0], exact.equations[i]);
            assert_eq!(
                (worst.row, &worst.residual, &worst.by),
                (equation.row + 1, &exact.residuals[equation.residual].0, &exact.columns[k].0)
            );
        }
        assert!(found.digits_undone >= 11.5, "{}", found.digits_undone);
    }
}

#[test]
fn exchanged_columns_and_residuals_are_named() {
    let case = Case::flagship();
    let problem = case.problem();
    let point = beside(&problem, 7);
    let exact = Stack::at(&problem, &point).expect("it is defined");
    let mut entries = parameters(&exact);
    entries.iter_mut().for_each(|row| row.swap(2, 5));
    let found = audited(&problem, &point, entries);
    assert_eq!(found.findings.iter().map(|one| one.kind.clone()).collect::<Vec<_>>(), [Kind::Swapped]);
    assert_eq!(found.wrong, 0);
    assert_eq!(found.findings[0].columns, [exact.columns[2].0.clone(), exact.columns[5].0.clone()]);

    let mut entries = parameters(&exact);
    entries.chunks_mut(5).for_each(|row| row.swap(0, 2));
    let found = audited(&problem, &point, entries);
    assert_eq!(found.findings.iter().map(|one| one.kind.clone()).collect::<Vec<_>>(), [Kind::SwappedResiduals]);
    assert_eq!((found.wrong, &found.findings[0].residuals), (0, &vec!["vo.x".to_owned(), "vo.z".to_owned()]));

    // a column that repeats its neighbour, and one that was forgotten
    let mut entries = parameters(&exact);
    entries.iter_mut().for_each(|row| row[4] = row[6]);
    entries.iter_mut().for_each(|row| row[9] = 0.0);
    let found = audited(&problem, &point, entries);
    let sentences: Vec<String> = found.findings.iter().map(|one| one.sentence()).collect();
    let (own, other, zero) = (&exact.columns[4].0, &exact.columns[6].0, &exact.columns[9].0);
    assert!(sentences.contains(&format!("the column `{own}` holds the derivatives by `{other}`")), "{sentences:?}");
    assert!(sentences.contains(&format!("the column `{zero}` is zero")), "{sentences:?}");
    assert_eq!(found.wrong, 0);
}

/// Residuals of all equations where one parameter is moved.
fn residuals(problem: &Problem, point: &[f64], column: usize, delta: f64) -> Vec<f64> {
    let mut step = vec![0.0; problem.dimension()];
    // the flagship's reported units are those it is computed in, or a thousandth of them
    let units = &problem.program.units;
    let dimension = problem.layout.coordinates[problem.free[column]].dimension;
    step[column] = units.to_internal(delta, units.unit(dimension));
    let moved = problem.retract(&point.to_vec(), &step);
    let all = jacobians(problem, &moved).expect("it is defined");
    all[0].r.iter().flatten().copied().collect()
}

fn differences(problem: &Problem, point: &[f64], rule: Rule, h: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let exact = Stack::at(problem, point).expect("it is defined");
    let columns: Vec<Vec<f64>> = (0..exact.parameters)
        .map(|k| {
            let at = |delta: f64| residuals(problem, point, k, delta);
            let (above, below, width) = match rule {
                Rule::Forward => (at(h(k)), at(0.0), h(k)),
                Rule::Backward => (at(0.0), at(-h(k)), h(k)),
                _ => (at(h(k)), at(-h(k)), 2.0 * h(k)),
            };
            above.iter().zip(below).map(|(a, b)| (a - b) / width).collect()
        })
        .collect();
    (0..exact.entries.len()).map(|i| columns.iter().map(|column| column[i]).collect()).collect()
}

#[test]
fn difference_quotients_are_recognised_with_their_step() {
    let case = Case::flagship();
    let problem = case.problem();
    let point = beside(&problem, 3);
    for (rule, h) in [
        (Rule::Central, 1e-2),
        (Rule::Central, 1e-3),
        (Rule::Central, 1e-4),
        (Rule::Forward, 1e-3),
        (Rule::Forward, 1e-5),
        (Rule::Forward, 1e-6),
        (Rule::Backward, 1e-4),
    ] {
        let found = audited(&problem, &point, differences(&problem, &point, rule, |_| h));
        let quotient = found.quotient.as_ref().unwrap_or_else(|| panic!("{rule:?} {h}: {found:#?}"));
        assert_eq!(quotient.rule, rule, "{h}");
        assert!(matches!(quotient.steps, Steps::Same(step) if (step / h - 1.0).abs() < 0.1), "{h}: {quotient:?}");
        assert!(!found.agrees && found.wrong == 0 && found.findings.is_empty(), "{h}: {found:#?}");
        assert!(found.digits > 2.0 && found.digits < 11.0, "{h}: {}", found.digits);
    }
    // a share of each value
    let exact = Stack::at(&problem, &point).expect("it is defined");
    let of_value = |k: usize| 1e-4 * exact.q[k].abs();
    let found = audited(&problem, &point, differences(&problem, &point, Rule::Forward, of_value));
    let quotient = found.quotient.expect("it is recognised");
    assert!(matches!(quotient.steps, Steps::Relative(share) if (share / 1e-4 - 1.0).abs() < 0.1), "{quotient:?}");
    // so small a step that rounding is all there is
    let found = audited(&problem, &point, differences(&problem, &point, Rule::Central, |_| 1e-9));
    let quotient = found.quotient.expect("it is recognised");
    assert_eq!(quotient.rule, Rule::Rounding);
    assert!(matches!(quotient.steps, Steps::About(h) if (3e-11..3e-8).contains(&h)), "{quotient:?}");
    // a mistake beside them is seen all the same
    let mut entries = differences(&problem, &point, Rule::Central, |_| 1e-3);
    let scales = exact.scales();
    let i = (0..entries.len())
        .find(|&i| exact.entries[i][4].abs() > 0.1 * scales[exact.equations[i].residual][4])
        .expect("one");
    entries[i][4] *= 1.01;
    let found = audited(&problem, &point, entries);
    assert_eq!(found.quotient.map(|found| found.rule), Some(Rule::Central));
    assert_eq!((found.wrong, found.worst[0].by.as_str()), (1, exact.columns[4].0.as_str()), "{:#?}", found.worst);
}

#[test]
fn few_digits_are_recognised() {
    let case = Case::flagship();
    let problem = case.problem();
    let point = beside(&problem, 5);
    let exact = parameters(&Stack::at(&problem, &point).expect("it is defined"));
    let written = |format: &dyn Fn(f64) -> String| -> Vec<Vec<f64>> {
        exact.iter().map(|row| row.iter().map(|&x| format(x).parse().expect("a number")).collect()).collect()
    };
    for (entries, wanted) in [
        (written(&|x| format!("{x:.4e}")), Precision::Digits(5)),
        (written(&|x| format!("{x:.4}")), Precision::Decimals(4)),
        (written(&|x| f64::from(x as f32).to_string()), Precision::Single),
    ] {
        let found = audited(&problem, &point, entries);
        assert_eq!((found.precision, found.wrong, found.agrees), (Some(wanted), 0, false), "{found:#?}");
    }
    let full = audited(&problem, &point, written(&|x| format!("{x:e}")));
    assert!(full.agrees && full.precision.is_none() && full.digits == 16.0, "{full:#?}");
}

#[test]
fn what_a_mistake_would_have_cost() {
    let case = Case::flagship();
    let problem = case.problem();
    let point = problem.start.clone();
    let exact = Stack::at(&problem, &point).expect("it is defined");
    let with = |entries: Vec<Vec<f64>>| {
        let audit = audited(&problem, &point, entries);
        refit(&problem, &point, &exact, &audit).expect("it starts")
    };
    let right = with(parameters(&exact));
    assert!(right.same() && right.exact.status.converged() && right.angle < 1e-6, "{right:#?}");
    assert_eq!(right.exact.iterations, right.audited.iterations);
    // differences lead to the same place
    let near = with(differences(&problem, &point, Rule::Central, |_| 1e-4));
    assert!(near.same() && (near.length - 1.0).abs() < 1e-3, "{near:#?}");
    // a column with the other sign does not, or not soon
    let mut entries = parameters(&exact);
    entries.iter_mut().for_each(|row| row[8] = -row[8]);
    let negative = with(entries);
    assert!(!negative.same() || negative.audited.iterations > negative.exact.iterations, "{negative:#?}");
    assert!(negative.angle > 0.01, "{negative:#?}");
    // a factor of all changes no minimum: a shorter step, and more of them
    let twice = with(parameters(&exact).into_iter().map(|row| row.iter().map(|x| 2.0 * x).collect()).collect());
    assert!((twice.length - 0.5).abs() < 1e-3 && twice.angle < 1e-3, "{twice:#?}");
    assert!(twice.audited.iterations > twice.exact.iterations, "{twice:#?}");
}

/// Every form in which programs write matrices is read as the same one.
#[test]
fn all_forms_are_the_same_matrix() {
    let case = Case::flagship();
    let problem = case.problem();
    let exact = Stack::at(&problem, &problem.start).expect("it is defined");
    let entries = parameters(&exact);
    let names: Vec<&str> = exact.columns[..exact.parameters].iter().map(|(name, _)| name.as_str()).collect();
    let lines = |separator: &str, entries: &[Vec<f64>]| {
        let line = |row: &Vec<f64>| row.iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(separator);
        entries.iter().map(line).collect::<Vec<_>>().join("\n")
    };
    let turned: Vec<Vec<f64>> = (0..names.len()).map(|k| entries.iter().map(|row| row[k]).collect()).collect();
    let residual = |i: usize| &exact.residuals[exact.equations[i].residual].0;
    let labelled = (0..entries.len()).rev().map(|i| {
        let numbers = entries[i].iter().map(|x| format!("{x:e}")).collect::<Vec<_>>().join(",");
        format!("{},{},{numbers}", exact.equations[i].row + 1, residual(i))
    });
    let mut by_residual: Vec<usize> = (0..entries.len()).collect();
    by_residual.sort_by_key(|&i| (exact.equations[i].residual, exact.equations[i].row));
    let by_residual: Vec<Vec<f64>> = by_residual.iter().map(|&i| entries[i].clone()).collect();
    let columns: serde_json::Map<String, serde_json::Value> = names
        .iter()
        .rev()
        .map(|name| (*name).to_owned())
        .zip(turned.iter().rev().map(|column| serde_json::json!(column)))
        .collect();
    let by_row: Vec<&[Vec<f64>]> = entries.chunks(exact.residuals.len()).collect();
    let forms = [
        ("csv", format!("{}\n{}\n", names.join(","), lines(",", &entries))),
        ("csv", format!("% MATLAB\n{}\n", lines("   ", &entries))),
        ("csv", format!("# NumPy\n\n{}\n", lines("\t", &entries))),
        ("csv", format!("{}\n", lines(";", &turned))),
        ("csv", format!("{}\n", lines(",", &by_residual))),
        ("csv", format!("row,residual,{}\n{}\n", names.join(","), labelled.collect::<Vec<_>>().join("\n"))),
        ("json", serde_json::json!(entries).to_string()),
        ("json", serde_json::json!(by_row).to_string()),
        ("json", serde_json::json!({"parameters": names, "jacobian": entries}).to_string()),
        ("json", serde_json::Value::Object(columns).to_string()),
    ];
    for (ending, text) in forms {
        let mut file = tempfile::Builder::new().suffix(&format!(".{ending}")).tempfile().expect("writable");
        write!(file, "{text}").expect("writable");
        let data = vec![("vo_line".to_owned(), case.rows.path().display().to_string())];
        let asked = Against { file: file.path().display().to_string(), data, ..Against::default() };
        let (found, _) = asked.run(&case.session).unwrap_or_else(|why| panic!("{why:?}\n{}", &text[..200]));
        assert!(found[0].audit.agrees && found[0].audit.digits == 16.0, "{}\n{:#?}", &text[..200], found[0].audit);
    }
    // a few columns by name at a point of one's own
    let mut values = tempfile::Builder::new().suffix(".json").tempfile().expect("writable");
    let q: serde_json::Map<String, serde_json::Value> =
        exact.columns.iter().zip(&exact.q).map(|((name, _), q)| (name.clone(), serde_json::json!(q + 1e-3))).collect();
    write!(values, "{}", serde_json::Value::Object(q)).expect("writable");
    let at = Values::read(&values.path().display().to_string()).expect("it is read");
    let there = phical::evaluate::point(&problem, &at.values);
    let moved = Stack::at(&problem, &there).expect("it is defined");
    let mut file = tempfile::Builder::new().suffix(".csv").tempfile().expect("writable");
    let some: Vec<Vec<f64>> = moved.entries.iter().map(|row| vec![row[7], row[3]]).collect();
    write!(file, "{},{}\n{}\n", names[7], names[3], lines(",", &some)).expect("writable");
    let data = vec![("vo_line".to_owned(), case.rows.path().display().to_string())];
    let asked = Against { file: file.path().display().to_string(), data, at: Some(at), ..Against::default() };
    let (found, _) = asked.run(&case.session).expect("it fits");
    assert!(found[0].audit.agrees && found[0].audit.notes.len() == 1, "{:#?}", found[0].audit);
}
