//! One problem, several solvers: the same answer, also by one that is written here, outside the crate.

use phical::fit::{Estimate, Fit, analyse};
use phical::linalg::{Bound, SquareRootInformation, solve_upper};
use phical::problem::{Options, Problem, Selection, Weights};
use phical::session::{Choice, Procedure, Search, Session, fit_by};
use phical::simulate::{self, simulate};
use phical::solve::{
    Conic, Datum, Evaluations, LeastSquares, LevenbergMarquardt, Norm, Solution, Solver, StartError, Status,
};

use crate::accuracy::{OFFSETS, errors, median, seeds, with_prior};
use crate::engine::models;
use crate::fitting::{bound, estimate, table};
use crate::flagship::{Flagship, compiled, flagship};
use crate::shared::project;

/// Gauss–Newton, halved until the cost falls: a fourth solver, made of what the trait tells and nothing else. It knows no bounds
/// and nothing invisible.
struct Halving;

impl<L: LeastSquares> Solver<L> for Halving {
    fn name(&self) -> &'static str {
        "halving"
    }

    fn solve(&self, problem: &L, start: L::Point) -> Result<Solution<L::Point>, StartError<L::Error>> {
        let (mut cost, mut information) = problem.evaluate(&start).map_err(StartError::Undefined)?;
        let (mut point, mut iterations, mut status) = (start, 0, Status::MaxTrials);
        'search: while iterations < 100 {
            iterations += 1;
            let Ok(full) = step(&information) else { break };
            let small = full.iter().zip(problem.magnitude(&point)).all(|(step, size)| step.abs() <= 1e-9 * size);
            for halved in 0..60 {
                let delta: Vec<f64> = full.iter().map(|step| step * 0.5f64.powi(halved)).collect();
                let next = problem.retract(&point, &delta);
                if let Ok((lower, found)) = problem.evaluate(&next)
                    && (lower < cost || small)
                {
                    (point, cost, information) = (next, lower, found);
                    if small {
                        status = Status::Step;
                        break 'search;
                    }
                    continue 'search;
                }
            }
            status = Status::Stalled;
            break;
        }
        let n = problem.dimension();
        Ok(Solution {
            point,
            status,
            cost,
            iterations,
            trace: vec![],
            information,
            invisible: vec![],
            datum: Datum::NotNeeded,
            active: vec![Bound::Free; n],
            projected: false,
            multipliers: vec![0.0; n],
            constraints: vec![],
            kkt: f64::NAN,
            evaluations: Evaluations::default(),
        })
    }
}

/// −R⁻¹d
fn step(information: &SquareRootInformation) -> Result<Vec<f64>, phical::linalg::LinalgError> {
    solve_upper(information.r(), &information.d().iter().map(|d| -d).collect::<Vec<_>>())
}

fn lines<'f>(flagship: &'f Flagship, lines: usize, seed: u64, selection: Selection) -> Problem<'f> {
    let options = simulate::Options { rows: vec![(0, lines)], seed: Some(seed), exact: false };
    let simulated = simulate(&flagship.0, &flagship.0.scenarios[0], &options).expect("it simulates");
    let options = Options { weights: Some(Weights::Propagated), selection, ..Options::default() };
    Problem::bind(&flagship.0, simulated.tables, &options).expect("it binds").0
}

fn analysed<'p>(problem: &Problem<'p>, solver: &dyn Solver<Problem<'p>>) -> Fit {
    let solution = solver.solve(problem, problem.start.clone()).expect("it starts");
    analyse(problem, solution).expect("defined")
}

/// By how much estimates differ, in standard uncertainties; those of exact data are rounding, and a share of the value counts.
fn apart(one: &Fit, other: &Fit) -> f64 {
    one.parameters.iter().zip(&other.parameters).fold(0.0, |worst: f64, (a, b)| {
        assert_eq!((&a.name, a.estimable), (&b.name, b.estimable));
        a.sigma.map_or(worst, |sigma| worst.max((a.value - b.value).abs() / sigma.max(1e-6 * a.value.abs())))
    })
}

#[test]
fn a_solver_from_outside_finds_the_same() {
    let flagship = flagship();
    let problem = lines(&flagship, 100, 3, Selection::default());
    let found = analysed(&problem, &Halving);
    assert_eq!(found.status, Status::Step);
    for fit in [analysed(&problem, &LevenbergMarquardt::default()), analysed(&problem, &Conic::default())] {
        assert!((fit.cost / found.cost - 1.0).abs() <= 1e-12, "{} {}", fit.cost, found.cost);
        assert!(apart(&fit, &found) <= 1e-6, "{}", apart(&fit, &found));
    }
}

/// On every shipped model without constraints, with the weights it is fitted with; no bound is active at any minimum.
#[test]
fn conic_steps_end_where_levenberg_and_marquardt_do() {
    let mut compared = 0;
    for name in models() {
        let session = Session::open(&project(&format!("models/{name}/model.ron")), &[]).expect("it compiles");
        let Ok(bound) = session.bind(&Choice::default(), &Options::default()) else {
            eprintln!("SKIPPED: the data of {name} are not present");
            continue;
        };
        if bound.problem.constrained().len() > 0 {
            continue;
        }
        let by = |search| fit_by(&bound.problem, &Procedure { search, ..Procedure::default() }).expect("a fit");
        let (lm, conic) = (by(Search::LevenbergMarquardt), by(Search::Conic(Norm::LeastSquares)));
        assert!(lm.status.converged() && conic.status.converged(), "{name}: {:?}", conic.status);
        assert!(conic.restraints.iter().all(|restraint| !restraint.active), "{name}");
        // what is left where everything fits is rounding
        let rounding = 1e-20 * lm.equations as f64;
        let different = (lm.cost - conic.cost).abs();
        assert!(different <= 1e-12 * lm.cost + rounding, "{name}: {:e} {:e}", lm.cost, conic.cost);
        assert!(apart(&lm, &conic) <= 1e-6, "{name}: {:e}", apart(&lm, &conic));
        compared += 1;
    }
    assert!(compared >= 5);
}

/// The flagship whose offsets are within so many millimetres.
fn bounded(limit: f64) -> Flagship {
    let mut flagship = flagship();
    for parameter in &mut flagship.0.parameters {
        if OFFSETS.contains(&parameter.name.as_str()) {
            (parameter.setting.min[0], parameter.setting.max[0]) = (-limit, limit);
        }
    }
    flagship
}

#[test]
fn bounds_are_nearly_as_good_as_a_prior() {
    let (bounds, prior) = (bounded(0.5), with_prior());
    let mut means = [[const { Vec::new() }; 3], [const { Vec::new() }; 3]];
    let mut held = 0;
    for seed in 0..seeds() {
        let problem = lines(&bounds, 20, 4000 + seed, Selection::default());
        let inside = analysed(&problem, &Conic::default());
        assert!(inside.status.converged() && inside.kkt <= 1e-8, "{:?} {:e}", inside.status, inside.kkt);
        for parameter in inside.parameters.iter().filter(|p| OFFSETS.contains(&p.name.as_str())) {
            assert!(parameter.value.abs() <= 0.5);
            assert_eq!(parameter.at_bound, parameter.value.abs() == 0.5);
            assert_eq!(parameter.sigma.is_none(), parameter.at_bound);
        }
        for restraint in &inside.restraints {
            assert!(restraint.active && restraint.multiplier >= 0.0, "{restraint:?}");
        }
        held += inside.restraints.len();
        let guided = analysed(&lines(&prior, 20, 4000 + seed, Selection::default()), &LevenbergMarquardt::default());
        for (means, (flagship, fit)) in means.iter_mut().zip([(&bounds, &inside), (&prior, &guided)]) {
            for (means, (mean, _)) in means.iter_mut().zip(errors(flagship, &fit.point, 500, 77)) {
                means.push(mean);
            }
        }
    }
    let [inside, guided] = means.map(|of| of.map(median));
    eprintln!("20 lines: within bounds {inside:.3?}, with the prior {guided:.3?}; {held} bounds active");
    assert!(held > 0);
    for (inside, guided) in inside.iter().zip(guided) {
        assert!(*inside <= 1.15 * guided, "{inside} {guided}");
    }
}

/// What nothing sees, L1.b and R1.b together, is settled by the nominal values and not by a bound: their difference is seen, and
/// where it is as large as the bounds allow, both are on one, at opposite ends. (Where a third offset is on a bound, going along
/// what is invisible loosens it, and the cost falls.)
#[test]
fn the_invisible_does_not_run_into_a_bound() {
    let flagship = bounded(1.5);
    let mut judged = 0;
    for seed in 0..8 {
        let selection = Selection { free: vec!["L1.b".into()], ..Selection::default() };
        let problem = lines(&flagship, 300, 600 + seed, selection);
        let fit = analysed(&problem, &Conic::default());
        assert!(fit.status.converged(), "{:?}", fit.status);
        assert_eq!((fit.rank, fit.parameters.len()), (20, 21));
        let together = |p: &&Estimate| ["L1.b", "R1.b"].contains(&p.name.as_str());
        for found in fit.parameters.iter().filter(together) {
            assert!(found.sigma.is_none() && !found.estimable, "{found:?}");
        }
        if fit.restraints.iter().any(|r| r.name != "L1.b" && r.name != "R1.b") {
            continue;
        }
        judged += 1;
        let offset = |name: &str| {
            let found = fit.parameters.iter().find(|p| p.name == name).expect("free");
            (found.value - found.nominal) / found.tolerance
        };
        let along: f64 = fit.null_directions[0].iter().map(|(name, weight)| weight * offset(name)).sum();
        assert!(along.abs() <= 1e-6, "{along}");
    }
    assert!(judged >= 3, "{judged}");
}

/// A network that gets its size from a known length, and a plate that must not be inside out.
#[test]
fn constraints_are_met_to_rounding() {
    let session = Session::open(&project("models/known_distances/model.ron"), &[]).expect("it compiles");
    let mut active = [0; 2];
    for seed in 0..20 {
        let made = simulate::Options { seed: Some(seed), ..simulate::Options::default() };
        let made = simulate(&session.program, &session.program.scenarios[0], &made).expect("it simulates");
        let (problem, _) = Problem::bind(&session.program, made.tables, &Options::default()).expect("it binds");
        let fit = analysed(&problem, &Conic::default());
        let value = |name: &str| estimate(&fit, name).0;
        let between = |c: &str| value(&format!("target[A].{c}")) - value(&format!("target[B].{c}"));
        let length = ["x", "y", "z"].map(between).iter().map(|d| d * d).sum::<f64>().sqrt();
        assert!((length - 1000.02).abs() <= 4e-11, "{length}");
        let behind = value("target[back].y") - value("target[front].y");
        let [bar, plate] = &fit.restraints[..] else { panic!("{:?}", fit.restraints) };
        assert!(behind >= 0.0 && plate.active == (behind == 0.0) && plate.multiplier >= 0.0, "{behind} {plate:?}");
        assert!(bar.equation && bar.active && fit.status.converged() && fit.kkt <= 1e-8, "{:e}", fit.kkt);
        // 112 equations and the bar, 25 parameters; an order that holds is none
        assert_eq!((fit.dof, fit.rank), (88, 24));
        active[usize::from(plate.active)] += 1;
        let step = fit.trace.iter().rev().find_map(|trial| trial.conic.as_ref()).expect("a conic step");
        assert_eq!((step.status.name(), step.active.len()), ("solved", 1 + usize::from(plate.active)));
        let refused = LevenbergMarquardt::default().solve(&problem, problem.start.clone());
        assert!(matches!(refused, Err(StartError::Constraints)));
    }
    // a plate of 0.02 mm is thinner than what is known of either side
    assert!(active[0] >= 3 && active[1] >= 3, "{active:?}");
}

/// One number measured five times: closed forms.
#[test]
fn other_norms_have_their_own_centres() {
    let program = compiled(
        r#"(name: "centre", parameters: { "m": Scalar(Free(0)) },
            measurements: { "x": (inputs: {"x": ()}, residuals: {"r": "m - x"}) })"#,
    );
    let table = table(&[1.0, 2.0, 4.0, 9.0, 30.0].map(|x| vec![x]));
    let problem = bound(&program, &[table], Selection::default(), Some(Weights::Unit));
    for (norm, centre, cost) in [(Norm::L1, 4.0, 3.0 + 2.0 + 5.0 + 26.0), (Norm::Minimax, 15.5, 14.5)] {
        let procedure = Procedure { search: Search::Conic(norm), ..Procedure::default() };
        let fit = fit_by(&problem, &procedure).expect("a fit");
        let (found, sigma) = estimate(&fit, "m");
        assert!(fit.status.converged() && (found - centre).abs() < 1e-6, "{norm:?}: {found}");
        assert!((fit.cost - cost).abs() < 1e-6 && sigma.is_none() && fit.chi_squared.is_none(), "{}", fit.cost);
    }
    let huber = Procedure { search: Search::Conic(Norm::Huber(3.0)), ..Procedure::default() };
    let (found, _) = estimate(&fit_by(&problem, &huber).expect("a fit"), "m");
    let slope: f64 = [1.0, 2.0, 4.0, 9.0, 30.0].iter().map(|x| (found - x).clamp(-3.0, 3.0)).sum();
    assert!(slope.abs() < 1e-6, "{found} {slope}");
}

/// Interferometers in a room: five stations of which the place is not known, eleven points, readings known to 1e-14 of their lengths.
/// A cost of such residuals has five digits, and the search ends where it has no more to tell.
#[test]
fn readings_near_the_rounding_of_their_lengths_are_fitted() {
    let program = compiled(
        r#"(name: "room", units: (length: "mm"),
            parameters: {
                "station": Vec3(value: Free((0, 0, 0)), family: true, members: {
                    "A": Held((0, 0, 0)), "B": (Free(9000), Held(0), Held(0)), "C": (Free(9000), Free(9000), Held(0)),
                    "D": Free((0, 9000, 300)), "E": Free((4500, 4500, 4000)),
                }),
                "point": Vec3(value: Free((0, 0, 0)), family: true, members: {
                    "1": Free((1000, 1000, -900)), "2": Free((8000, 1000, 1200)), "3": Free((8000, 8000, -900)),
                    "4": Free((1000, 8000, 1200)), "5": Free((4000, 1000, 600)), "6": Free((8000, 4000, -300)),
                    "7": Free((4000, 8000, 900)), "8": Free((1000, 4000, 0)), "9": Free((3000, 3000, 1300)),
                    "10": Free((6000, 6000, -700)), "11": Free((4000, 4000, 200)),
                }),
                "dead": Scalar(Free("250 mm")),
            },
            measurements: { "sight": (
                keys: ["from", "to"], inputs: { "range": (unit: "mm", sigma: "0.1 nm") },
                residuals: { "miss": "norm(point[to] - station[from]) - range - dead" },
            ) },
            scenarios: { "room": (
                truth: { "station[B].x": Around("3 mm"), "station[C].y": Around("3 mm"), "point[*]": Around("5 mm") },
                measurements: { "sight": (
                    rows: 55, set: { "range": "norm(point[to] - station[from]) - dead" },
                    draw: {
                        "from": Cycle(["A", "B", "C", "D", "E"]),
                        "to": Cycle(["1", "2", "3", "4", "5", "6", "7", "8", "9", "10", "11"]),
                    },
                ) },
            ) })"#,
    );
    for seed in 0..8 {
        let options = simulate::Options { seed: Some(seed), ..simulate::Options::default() };
        let made = simulate(&program, &program.scenarios[0], &options).expect("it simulates");
        let problem = Problem::bind(&program, made.tables, &Options::default()).expect("it binds").0;
        let fit = fit_by(&problem, &Procedure::default()).expect("a fit");
        assert!(fit.status.converged(), "seed {seed}: {:?}", fit.status);
        for (name, truth) in &made.truth {
            let found = fit.parameters.iter().find(|p| p.name == *name);
            let Some((value, sigma)) = found.and_then(|p| Some((p.value, p.sigma?))) else { continue };
            // twelve degrees of freedom, seven sigmas: rounding alone is a sigma here
            assert!((value - truth).abs() < 7.0 * sigma, "seed {seed}, {name}: {value} ± {sigma}, not {truth}");
        }
    }
}
