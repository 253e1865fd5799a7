//! What must hold for every model and every data: units, order of rows and of declarations leave the answer; rotations, poses,
//! families, ties, priors and bounds do what they say; what is not a number is refused with its place.

use std::fmt::Write as _;

use nalgebra::{Rotation3, Vector3};
use phical::compile::{Program, compile};
use phical::data::{Table, read};
use phical::diag::{Code, DataPlace, Diagnostic, Diagnostics, Place, Source};
use phical::fit::{Fit, NOT_ESTIMABLE};
use phical::model::load;
use phical::problem::{Selection, Weights};
use phical::solve::{LeastSquares, Settings, StartError, minimise};
use proptest::prelude::*;

use crate::close::close;
use crate::fitting::{bound, estimate, fit, fitted, table};
use crate::flagship::compiled;

/// A total station that sights known targets, and its data in metres and radians.
#[derive(Clone, Debug)]
struct Station {
    rows: Vec<[f64; 6]>,
}

/// Random stations with random noise of a few sigmas.
fn stations() -> impl Strategy<Value = Station> {
    let target = (5.0..40.0f64, -3.0..3.0f64, -4.0..4.0f64);
    let noise = prop::array::uniform3(-2.0..2.0f64);
    let rows = prop::collection::vec((target, noise), 5..12);
    (prop::array::uniform3(-0.5..0.5f64), -1.0..1.0f64, -0.004..0.004f64, rows).prop_map(|(at, turn, add, rows)| {
        let row = |((distance, bearing, height), noise): ((f64, f64, f64), [f64; 3])| {
            let d = [distance * bearing.cos(), distance * bearing.sin(), height];
            let hz = bearing - turn + noise[0] * 5e-5;
            let v = height.atan2(distance) + noise[1] * 5e-5;
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() - add + noise[2] * 2e-3;
            let wrapped = hz.sin().atan2(hz.cos());
            [at[0] + d[0], at[1] + d[1], at[2] + d[2], wrapped, v, length]
        };
        // three around the station, so that everything is estimable, and any others
        let around = [(8.0, 0.3, 1.0), (20.0, 2.4, -2.0), (13.0, -2.0, 3.0)].map(|target| (target, [0.5, -0.7, 1.1]));
        Station { rows: around.into_iter().chain(rows).map(row).collect() }
    })
}

const STATION: [&str; 3] = [
    r#""at": Vec3(Free(("0.1 m", "-0.2 m", 0)))"#,
    r#""turn": Scalar(Free("0.1 rad"))"#,
    r#""add": Scalar(Free(nominal: "0 mm", sigma: "5 mm"))"#,
];

/// The station's model; `order` is that of its parameters.
fn station(length: &str, angle: &str, order: [usize; 3], weighted: bool) -> String {
    let parameters: String = order.iter().map(|&k| format!("{}, ", STATION[k])).collect();
    // a prior is real, so beside it weights that are alike mean something else in every unit
    let parameters = if weighted { parameters } else { parameters.replace(", sigma: \"5 mm\"", "") };
    let sigma = |text: &str| if weighted { format!(", sigma: {text:?}") } else { String::new() };
    // weights that are alike mean something else in every unit, unless all is measured in one
    let along = |text: &str| if weighted { text.to_owned() } else { format!("10 m * sin({text})") };
    format!(
        r#"(name: "station", units: (length: "{length}", angle: "{angle}"), parameters: {{{parameters}}}, measurements: {{"sight": (
            data: "sight.csv",
            inputs: {{
                "tx": (unit: "{length}"), "ty": (unit: "{length}"), "tz": (unit: "{length}"),
                "hz": (unit: "{angle}"), "v": (unit: "{angle}"), "length": (unit: "{length}"),
            }},
            define: {{"d": "vec(tx, ty, tz) - at"}},
            residuals: {{
                "hz": (value: "{}"{}), "v": (value: "{}"{}), "length": (value: "norm(d) - add - length"{}),
            }},
        )}})"#,
        along("wrap(atan2(d.y, d.x) - turn - hz)"),
        sigma("10 arcsec"),
        along("atan2(d.z, sqrt(d.x^2 + d.y^2)) - v"),
        sigma("10 arcsec"),
        sigma("2 mm"),
    )
}

/// Writes the rows in the units of the model, reads them back, and fits. Values and sigmas are in metres and radians again.
fn fit_station(
    data: &Station,
    (length, per_metre): (&str, f64),
    (angle, per_radian): (&str, f64),
    weighted: bool,
) -> Vec<[f64; 2]> {
    let text = station(length, angle, [0, 1, 2], weighted);
    let folder = tempfile::tempdir().expect("a folder");
    let mut csv = String::from("tx,ty,tz,hz,v,length\n");
    for [tx, ty, tz, hz, v, d] in &data.rows {
        let (l, a) = (per_metre, per_radian);
        writeln!(csv, "{},{},{},{},{},{}", tx * l, ty * l, tz * l, hz * a, v * a, d * l).expect("a string");
    }
    std::fs::write(folder.path().join("sight.csv"), csv).expect("writable");
    let source = Source::new("model.ron", text);
    let (model, _) = load(&source).expect("a right model");
    let (program, _) = compile(&model, &source, &[]).expect("a right model");
    let mut found = Diagnostics::new();
    let table = read(&program, 0, &program.measurements[0].data, folder.path(), &mut found).expect("readable");
    let fit = fitted(&program, &[table]);
    assert!(fit.status.converged(), "{}", fit.status);
    let si = |name: &str, value: f64| value / if name == "turn" { per_radian } else { per_metre };
    fit.parameters.iter().map(|p| [si(&p.name, p.value), si(&p.name, p.sigma.expect("estimable"))]).collect()
}

fn same(found: &[[f64; 2]], expected: &[[f64; 2]], relative: f64) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        close(found, expected, relative, "value and sigma");
        close(&found[1..], &expected[1..], relative, "sigma");
    }
}

fn values(fit: &Fit, names: &[&str]) -> Vec<[f64; 2]> {
    names.iter().map(|name| estimate(fit, name)).map(|(value, sigma)| [value, sigma.expect("estimable")]).collect()
}

const NAMES: [&str; 5] = ["at.x", "at.y", "at.z", "turn", "add"];

fn station_table(rows: &[[f64; 6]]) -> Table {
    table(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn units_leave_the_answer(data in stations(), weighted in any::<bool>()) {
        let degrees = ("deg", 180.0 / std::f64::consts::PI);
        let one = fit_station(&data, ("mm", 1e3), ("rad", 1.0), weighted);
        let other = fit_station(&data, ("m", 1.0), degrees, weighted);
        same(&one, &other, 1e-9);
    }

    #[test]
    fn the_order_of_rows_leaves_the_answer((data, mixed) in stations().prop_flat_map(|data| {
        let rows = data.rows.clone();
        (Just(data), Just(rows).prop_shuffle())
    })) {
        let program = compiled(&station("m", "rad", [0, 1, 2], true));
        let one = fitted(&program, &[station_table(&data.rows)]);
        let other = fitted(&program, &[station_table(&mixed)]);
        same(&values(&one, &NAMES), &values(&other, &NAMES), 1e-10);
    }

    #[test]
    fn the_order_of_declarations_leaves_the_answer(data in stations(), order in Just([0, 1, 2]).prop_shuffle()) {
        let one = fitted(&compiled(&station("m", "rad", [0, 1, 2], true)), &[station_table(&data.rows)]);
        let other = fitted(&compiled(&station("m", "rad", order, true)), &[station_table(&data.rows)]);
        same(&values(&one, &NAMES), &values(&other, &NAMES), 1e-10);
    }
}

/// Other units are another answer where the weights do not say what they mean; so the comparison above can fail.
#[test]
fn a_wrong_conversion_is_found() {
    let one = [[1.0, 0.1], [2.0, 0.2]];
    assert!(std::panic::catch_unwind(|| same(&one, &[[1.0, 0.1], [2.0, 0.2 * (1.0 + 2e-9)]], 1e-9)).is_err());
    assert!(std::panic::catch_unwind(|| same(&one, &[[1.0 + 2e-9, 0.1], [2.0, 0.2]], 1e-9)).is_err());
}

/// Two measurements, of which the second has a logarithm.
const TWO: &str = r#"(name: "two", parameters: {"a": Scalar(Free(1))}, measurements: {
    "first": (inputs: {"x": ()}, residuals: {"r": "x - a"}),
    "second": (keys: ["place"], inputs: {"y": (), "z": ()}, residuals: {"s": "y - a", "t": "log(z) - a", "u": "y"}),
})"#;

/// What is said of rows of the second measurement.
fn refused(rows: &[[f64; 2]]) -> Diagnostic {
    let program = compiled(TWO);
    let mut second = Table::new(1, 2);
    second.begin("second.csv");
    rows.iter().enumerate().for_each(|(i, row)| second.push(&["front"], row, Some(i + 2)).expect("a row of the table"));
    let problem = bound(&program, &[table(&[vec![1.0], vec![2.0]]), second], Selection::default(), None);
    let at_cost = problem.cost(&problem.start).expect_err("refused").0;
    match minimise(&problem, problem.start.clone(), &Settings::default()) {
        Err(StartError::Undefined(found)) => assert_eq!(found.0.message, at_cost.message),
        other => panic!("{other:?}"),
    }
    *at_cost
}

fn place(found: &Diagnostic) -> &DataPlace {
    let Some(Place::Data(place)) = &found.place else { panic!("{found:?}") };
    place
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_not_a_number_is_refused_with_its_place(
        rows in 1usize..30, bad in 0usize..30, column in 0usize..2, value in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
    ) {
        let bad = bad % rows;
        let mut all = vec![[0.5, 2.0]; rows];
        all[bad][column] = value;
        let found = refused(&all);
        prop_assert_eq!(found.code, Code::DataNotFinite);
        prop_assert!(found.message.contains(&format!("`second`, row {}: the reading `{}`", bad + 1, ["y", "z"][column])), "{}", found.message);
        let place = place(&found);
        prop_assert_eq!((place.file.as_str(), place.line, place.row), ("second.csv", Some(bad + 2), Some(bad + 1)));
        prop_assert_eq!(place.column.as_deref(), Some(["y", "z"][column]));
    }

    #[test]
    fn a_residual_without_a_value_is_refused_with_its_place(rows in 1usize..30, bad in 0usize..30, z in -5.0..=0.0f64) {
        let bad = bad % rows;
        let mut all = vec![[0.5, 2.0]; rows];
        all[bad][1] = z;
        let found = refused(&all);
        prop_assert_eq!(found.code, Code::UndefinedAtStart);
        prop_assert!(found.message.contains(&format!("`second`, row {}, residual `t`: `log`", bad + 1)), "{}", found.message);
        prop_assert_eq!((place(&found).line, place(&found).row), (Some(bad + 2), Some(bad + 1)));
    }
}

/// Two lines that are parallel but for rounding have a crossing, and finite, as far as arithmetic goes.
#[test]
fn what_a_model_refuses_is_refused_though_it_is_finite() {
    let program = compiled(
        r#"(name: "lines", units: (length: "m"), parameters: {"x": Scalar(Free("1 m"))}, measurements: {"sight": (
            inputs: {"a": (unit: "rad"), "b": (unit: "rad")},
            define: {
                "l": "frame(vec(0, 0, 0), rotation_x(a))", "r": "frame(vec(x, 0.5*x, 0), rotation_x(b))",
            },
            residuals: {"p": "triangulate(l, r)"},
        )})"#,
    );
    for (parallel, rows) in [(false, [[0.7, 0.9], [0.7, -0.3]]), (true, [[0.7, 0.9], [0.7, 0.7 + 1e-13]])] {
        let problem = bound(&program, &[table(&rows.map(|row| row.to_vec()))], Selection::default(), None);
        match problem.cost(&problem.start) {
            Ok(cost) => assert!(!parallel && cost.is_finite(), "{cost}"),
            Err(found) => assert!(parallel && found.0.message.contains("`sight`, row 2, residual `p."), "{found}"),
        }
    }
}

/// Points, and where a pose takes them.
fn cloud(points: &[[f64; 3]], turn: Vector3<f64>, shift: Vector3<f64>) -> Vec<Vec<f64>> {
    let rotation = Rotation3::new(turn);
    let row = |point: &[f64; 3]| {
        let moved = rotation * Vector3::from(*point) + shift;
        point.iter().chain(moved.iter()).copied().collect()
    };
    points.iter().map(row).collect()
}

/// A point cloud seen before and after a pose; `pose` declares `base`, and `moved` says where `p` goes.
fn registration(pose: &str, moved: &str) -> Program {
    compiled(&format!(
        r#"(name: "cloud", units: (length: "m"), parameters: {{"base": {pose}}}, measurements: {{"point": (
            inputs: {{
                "px": (unit: "m"), "py": (unit: "m"), "pz": (unit: "m"), "qx": (unit: "m"), "qy": (unit: "m"), "qz": (unit: "m"),
            }},
            residuals: {{"r": "{moved} - vec(qx, qy, qz)"}},
        )}})"#
    ))
}

fn clouds() -> impl Strategy<Value = Vec<[f64; 3]>> {
    // four that span space, and any others
    prop::collection::vec(prop::array::uniform3(-2.0..2.0f64), 0..6).prop_map(|mut points| {
        points.extend([[1.0, 0.2, 0.0], [-0.3, 1.0, 0.1], [0.0, -0.2, 1.0], [-1.0, -1.0, -0.5]]);
        points
    })
}

fn component(fit: &Fit, names: [&str; 3]) -> Vector3<f64> {
    Vector3::from(names.map(|name| estimate(fit, name).0))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_pose_is_found_from_identity(points in clouds(), turn in prop::array::uniform3(-1.2..1.2f64), shift in prop::array::uniform3(-3.0..3.0f64)) {
        let program = registration("Pose(Free((0, 0, 0, 0, 0, 0)))", "transform(base, vec(px, py, pz))");
        let (turn, shift) = (Vector3::from(turn), Vector3::from(shift));
        let problem = bound(&program, &[table(&cloud(&points, turn, shift))], Selection::default(), None);
        prop_assert!(problem.start.iter().all(|&value| value == 0.0));
        let fit = fit(&problem);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        let found = component(&fit, ["base.rx", "base.ry", "base.rz"]);
        close(Rotation3::new(found).matrix().as_slice(), Rotation3::new(turn).matrix().as_slice(), 1e-9, "rotation");
        let found = component(&fit, ["base.x", "base.y", "base.z"]);
        prop_assert!((found - shift).norm() <= 1e-9 * (1.0 + shift.norm()), "{found} {shift}");
    }

    #[test]
    fn a_rotation_is_found_from_identity(points in clouds(), turn in prop::array::uniform3(-1.2..1.2f64)) {
        let program = registration("Rotation(Free((0, 0, 0)))", "base*vec(px, py, pz)");
        let turn = Vector3::from(turn);
        let fit = fitted(&program, &[table(&cloud(&points, turn, Vector3::zeros()))]);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        let found = component(&fit, ["base.rx", "base.ry", "base.rz"]);
        close(Rotation3::new(found).matrix().as_slice(), Rotation3::new(turn).matrix().as_slice(), 1e-9, "rotation");
    }

    /// ∂(R p)/∂ω at R = 1 is −[p]×, to the last digit.
    #[test]
    fn the_jacobian_at_identity_is_exact(point in prop::array::uniform3(-2.0..2.0f64)) {
        let program = registration("Rotation(Free((0, 0, 0)))", "base*vec(px, py, pz)");
        let rows = cloud(&[point], Vector3::new(0.1, 0.2, 0.3), Vector3::zeros());
        let problem = bound(&program, &[table(&rows)], Selection::default(), Some(Weights::Unit));
        let [x, y, z] = point;
        problem.blocks[0].jacobians(&problem.layout, &problem.start, &problem.places(), |row| {
            assert_eq!(row.derivatives, [0.0, z, -y, -z, 0.0, x, y, -x, 0.0].as_slice());
            Ok(())
        }).expect("defined");
    }

    #[test]
    fn held_components_stay(points in clouds(), shift in prop::array::uniform2(-3.0..3.0f64), rz in -2.0..2.0f64) {
        let program = registration("Pose(Free((0, 0, 0.25, 0, 0, 0)))", "transform(base, vec(px, py, pz))");
        let fix = ["base.z", "base.rx", "base.ry"].map(|name| (name.to_owned(), None)).to_vec();
        let rows = cloud(&points, Vector3::new(0.0, 0.0, rz), Vector3::new(shift[0], shift[1], 0.25));
        let problem = bound(&program, &[table(&rows)], Selection { fix, ..Selection::default() }, None);
        let fit = fit(&problem);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        let found = [estimate(&fit, "base.x").0, estimate(&fit, "base.y").0, estimate(&fit, "base.rz").0];
        close(&found, &[shift[0], shift[1], rz], 1e-9, "free components");
        let held: Vec<(&str, f64)> = fit.held.iter().map(|held| (held.name.as_str(), held.value)).collect();
        prop_assert_eq!(held, [("base.z", 0.25), ("base.rx", 0.0), ("base.ry", 0.0)]);
    }
}

const FAMILY: &str = r#"(name: "sockets", units: (length: "m"), parameters: {
    "socket": Vec3(value: Free((0, 0, 0)), family: true), "tip": Vec3(Free((0, 0, 0.1))),
}, measurements: {"touch": (
    keys: ["hole"],
    inputs: {"wx": (unit: "rad"), "wy": (unit: "rad"), "wz": (unit: "rad"), "x": (unit: "m"), "y": (unit: "m"), "z": (unit: "m")},
    residuals: {"r": "vec(x, y, z) + rotate(rotation_vector(vec(wx, wy, wz)), tip) - socket[hole]"},
)})"#;

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// A hand of unknown tip touches each of a few unknown points in several attitudes.
    #[test]
    fn a_family_is_found_whatever_the_order_of_rows(
        (sockets, attitudes, order) in (2usize..=5).prop_flat_map(|members| (
            prop::collection::vec(prop::array::uniform3(-2.0..2.0f64), members),
            prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), members * 2),
            Just((0..members * 5).collect::<Vec<usize>>()).prop_shuffle(),
        )),
        tip in prop::array::uniform3(0.05..0.3f64),
    ) {
        let program = compiled(FAMILY);
        let members = sockets.len();
        // three attitudes that tell the tip from the socket, and two others
        let known = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.3]];
        let mut rows = Table::new(1, 6);
        for at in order {
            let (hole, k) = (at % members, at / members);
            let turn = if k < 3 { known[k] } else { attitudes[hole * 2 + k - 3] };
            let hand = Vector3::from(sockets[hole]) - Rotation3::new(Vector3::from(turn)) * Vector3::from(tip);
            rows.push(&[&format!("h{hole}")], &[turn[0], turn[1], turn[2], hand.x, hand.y, hand.z], None).expect("a row of the table");
        }
        let fit = fitted(&program, &[rows]);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        prop_assert_eq!(fit.parameters.len(), 3 * members + 3);
        for (hole, socket) in sockets.iter().enumerate() {
            let found = ["x", "y", "z"].map(|c| estimate(&fit, &format!("socket[h{hole}].{c}")).0);
            close(&found, socket, 1e-9, "socket");
        }
        close(&["tip.x", "tip.y", "tip.z"].map(|name| estimate(&fit, name).0), &tip, 1e-9, "tip");
    }

    /// Two links of one length, known by one parameter: an arm of two joints, its tip measured.
    #[test]
    fn a_tied_parameter_is_found(length in 0.3..1.5f64, offset in -0.3..0.3f64, angles in prop::collection::vec(prop::array::uniform2(-1.5..1.5f64), 4..10)) {
        let program = compiled(r#"(name: "tie", units: (length: "m"), chains: {"arm": [
            Dh(name: "A", a: Free(1), theta: Free(0)), Dh(name: "B", a: "A.a", theta: "2*A.theta"),
        ]}, measurements: {"tip": (
            inputs: {"q1": (unit: "rad"), "q2": (unit: "rad"), "x": (unit: "m"), "y": (unit: "m")},
            define: {"f": "arm(q1, q2)"}, residuals: {"x": "f.o.x - x", "y": "f.o.y - y"},
        )})"#);
        let rows: Vec<Vec<f64>> = angles.iter().map(|&[q1, q2]| {
            let (a, b) = (q1 + offset, q1 + q2 + 3.0 * offset);
            vec![q1, q2, length * (a.cos() + b.cos()), length * (a.sin() + b.sin())]
        }).collect();
        let fit = fitted(&program, &[table(&rows)]);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        prop_assert_eq!(fit.parameters.len(), 2);
        close(&[estimate(&fit, "A.a").0, estimate(&fit, "A.theta").0], &[length, offset], 1e-9, "tied");
    }

    /// n readings of one number and a prior: the weighted mean, in closed form; and with bounds, the nearest point inside.
    #[test]
    fn priors_pull_and_bounds_hold(
        readings in prop::collection::vec(-3.0..3.0f64, 1..8), nominal in -2.0..2.0f64, prior in 0.05..5.0f64, sigma in 0.1..2.0f64,
        least in -1.0..0.0f64, most in 0.0..1.0f64,
    ) {
        let fit_with = |free: String| {
            let program = compiled(&format!(
                r#"(name: "mean", parameters: {{"a": Scalar({free})}}, measurements: {{"m": (
                    inputs: {{"x": ()}}, residuals: {{"r": (value: "x - a", sigma: {sigma:?})}},
                )}})"#
            ));
            fitted(&program, &[table(&readings.iter().map(|&x| vec![x]).collect::<Vec<_>>())])
        };
        let weight = readings.len() as f64 / (sigma * sigma) + 1.0 / (prior * prior);
        let mean = (readings.iter().sum::<f64>() / (sigma * sigma) + nominal / (prior * prior)) / weight;
        let free = fit_with(format!("Free(nominal: {nominal:?}, sigma: {prior:?})"));
        let (value, deviation) = estimate(&free, "a");
        prop_assert!((value - mean).abs() <= 1e-12 * (1.0 + mean.abs()), "{value} {mean}");
        close(&[deviation.expect("estimable")], &[1.0 / weight.sqrt()], 1e-12, "sigma");
        prop_assert_eq!((free.priors, free.dof), (1, readings.len()));

        let inside = nominal.clamp(least, most);
        let mean = (readings.iter().sum::<f64>() / (sigma * sigma) + inside / (prior * prior)) / weight;
        let bounded = fit_with(format!("Free(nominal: {inside:?}, sigma: {prior:?}, min: {least:?}, max: {most:?})"));
        let found = bounded.parameters[0].clone();
        prop_assert!(bounded.status.converged(), "{}", bounded.status);
        if mean < least || mean > most {
            prop_assert_eq!(found.value, mean.clamp(least, most));
            prop_assert!(found.at_bound && found.sigma.is_none());
        } else {
            prop_assert!((found.value - mean).abs() <= 1e-12 && !found.at_bound, "{found:?} {mean}");
        }
    }

    /// One sum of three parameters is measured: two directions are invisible, and the fit is the nearest point to the nominal
    /// values in tolerances.
    #[test]
    fn fewer_equations_than_unknowns(weights in prop::array::uniform3(0.2..2.0f64), nominal in prop::array::uniform3(-1.0..1.0f64), y in -3.0..3.0f64) {
        let [a, b, c] = weights;
        let [x1, x2, x3] = nominal;
        let program = compiled(&format!(
            r#"(name: "sum", parameters: {{
                "p": Scalar(Free(nominal: {x1:?}, tolerance: 0.1)), "q": Scalar(Free(nominal: {x2:?}, tolerance: 0.2)),
                "s": Scalar(Free(nominal: {x3:?}, tolerance: 0.4)),
            }}, measurements: {{"m": (inputs: {{"y": ()}}, residuals: {{"r": "{a:?}*p + {b:?}*q + {c:?}*s - y"}})}})"#
        ));
        let fit = fitted(&program, &[table(&[vec![y]])]);
        prop_assert!(fit.status.converged(), "{}", fit.status);
        prop_assert_eq!((fit.equations, fit.rank, fit.dof, fit.null_directions.len()), (1, 1, 0, 2));
        prop_assert!(fit.warnings.iter().any(|found| found.code == Code::Underdetermined));
        prop_assert!(fit.parameters.iter().all(|p| p.sigma.is_none()));
        prop_assert!(!fit.verdict().trustworthy());
        // in tolerances, along w = (0.1 a, 0.2 b, 0.4 c)
        let scale = [0.1, 0.2, 0.4];
        let w = [0, 1, 2].map(|k| weights[k] * scale[k]);
        let way = (y - (a * x1 + b * x2 + c * x3)) / w.iter().map(|w| w * w).sum::<f64>();
        let expected = [0, 1, 2].map(|k| nominal[k] + scale[k] * w[k] * way);
        let found: Vec<f64> = fit.parameters.iter().map(|p| p.value).collect();
        close(&found, &expected, 1e-9, "the nearest point");
        for (k, p) in fit.parameters.iter().enumerate() {
            let invisible = 1.0 - w[k] * w[k] / w.iter().map(|w| w * w).sum::<f64>();
            prop_assert_eq!(p.estimable, invisible <= NOT_ESTIMABLE);
        }
        for direction in &fit.null_directions {
            let of = |name: &str| direction.iter().find(|(known, _)| known == name).map_or(0.0, |(_, weight)| *weight);
            let seen = w[0] * of("p") + w[1] * of("q") + w[2] * of("s");
            prop_assert!(seen.abs() < 1e-12, "{direction:?}");
            let length = direction.iter().map(|(_, weight)| weight * weight).sum::<f64>();
            prop_assert!((length - 1.0).abs() < 1e-12);
        }
    }
}
