use std::f64::consts::PI;

use super::*;

/// A planar arm of two bars, 300 and 200 mm, that touches sockets.
fn arm(solve: &str) -> String {
    format!(
        r#"(
        name: "arm",
        units: (angle: "deg"),
        parameters: {{ "socket": Vec3(value: Free((400, 0, 0)), family: true, members: {{ "b/1": Free((100, 200, 0)) }}), "base": Pose(Free((0, 0, 0, 0, 0, 90))) }},
        chains: {{ "arm": [Dh(name: "A", a: Free(300)), Dh(name: "B", a: Free(200))] }},
        measurements: {{ "touch": (
            keys: ["place", "hole"],
            inputs: {{ "q1": (unit: "deg", bias: "1 deg"), "q2": (unit: "deg") }},
            residuals: {{ "miss": "(base * arm(q1, q2)).o - socket[place, hole]" }},
        ) }},
        scenarios: {{ "s": (
            truth: {{ "socket[a/1].y": "10 mm", "socket[*].z": Normal(0, 0), "A.a": Normal("300 mm", "1 mm"), "socket[b/1].x": Uniform(90, 110) }},
            measurements: {{ "touch": (
                rows: 12,
                draw: {{ "place": Cycle(["a", "b"]), "hole": Choice(["1", "2"]) }},
                {solve}
            ) }},
        ) }},
    )"#
    )
}

const SOLVE: &str = r#"solve: [ (unknowns: {"q1": "-90 deg", "q2": "START deg"}, zero: "(base * arm(q1, q2)).o - socket[place, hole]") ],"#;

fn value(made: &Simulated, name: &str) -> f64 {
    made.truth.iter().find(|(known, _)| known == name).unwrap_or_else(|| panic!("{name}: {:?}", made.truth)).1
}

#[test]
fn families_and_branches() {
    for (start, sign) in [("30", 1.0), ("-30", -1.0)] {
        let program = program(&arm(&SOLVE.replace("START", start)));
        let made = made(&program, &Options { exact: true, ..Options::default() });
        let table = &made.tables[0].1;
        assert_eq!(table.names(0), ["a", "b"]);
        assert_eq!(table.names(1).len(), 2);
        assert_eq!(
            (value(&made, "socket[a/1].y"), value(&made, "socket[a/2].y"), value(&made, "base.rz")),
            (10.0, 0.0, 90.0)
        );
        assert_eq!(value(&made, "socket[b/1].y"), 200.0);
        let x = value(&made, "socket[b/1].x");
        assert!((90.0..110.0).contains(&x) && x != 100.0);
        assert!((value(&made, "A.a") - 300.0).abs() < 5.0 && value(&made, "A.a") != 300.0);
        for row in 0..table.rows() {
            // elbow up or down, as the start says
            assert!(table.row(row)[1] * sign > 0.0, "{:?}", table.row(row));
            assert!(table.row(row).iter().all(|q| q.abs() <= PI));
        }
    }
}

#[test]
fn truth_and_first_rows_do_not_depend_on_the_number_of_rows() {
    let program = program(&arm(&SOLVE.replace("START", "30")));
    let of = |rows| made(&program, &Options { rows: vec![(0, rows)], ..Options::default() });
    let (few, many) = (of(12), of(60));
    assert!(same(&few.tables[0].1, &many.tables[0].1, 12));
    for (name, value) in &few.truth {
        assert!(many.truth.contains(&(name.clone(), *value)), "{name}");
    }
    assert_eq!(of(0).tables[0].1.rows(), 0);
}

#[test]
fn a_bias_is_in_the_file_and_not_in_the_table() {
    let program = program(&arm(r#"set: { "q1": "20 deg", "q2": "30 deg" }"#));
    let made = made(&program, &Options { rows: vec![(0, 1)], exact: true, ..Options::default() });
    let mut bytes = Vec::new();
    crate::data::write_to(&program, 0, &made.tables[0].1, &mut bytes).unwrap();
    assert!((made.tables[0].1.row(0)[0] - 20f64.to_radians()).abs() < 1e-15);
    let text = String::from_utf8(bytes).unwrap();
    let cell: f64 = text.lines().nth(1).unwrap().split(',').nth(2).unwrap().parse().unwrap();
    assert!((cell - 21.0).abs() < 1e-12, "{text}");
}

/// Where a start is singular, the first step can be of any length, and its end counted as a solution.
#[test]
fn a_singular_start_leads_to_solutions_too() {
    let text = r#"(
        name: "sight",
        parameters: {"p": Scalar(Free("0 rad"))},
        measurements: {"m": (
            inputs: {"a, b": (unit: "rad", sigma: "1 mrad"), "x": ()},
            define: {"d": "rotation_z(a + p) * vec(sin(b), 0, cos(b))"},
            residuals: {"r": "unit(vec(cos(x), sin(x), 0.2)) - d"},
        )},
        scenarios: {"s": (measurements: {"m": (
            rows: 2000,
            draw: {"x": Uniform(-3, 3)},
            solve: [(unknowns: {"a": 0, "b": "pi/2"}, zero: "unit(vec(cos(x), sin(x), 0.2)) - d")],
        )})},
    )"#;
    let program = program(text);
    let made = made(&program, &Options { exact: true, ..Options::default() });
    for row in 0..2000 {
        let [a, b, x] = made.tables[0].1.row(row)[..] else { panic!("three inputs") };
        let seen = [a.cos() * b.sin(), a.sin() * b.sin(), b.cos()];
        let length = 1.04_f64.sqrt();
        let wanted = [x.cos() / length, x.sin() / length, 0.2 / length];
        assert!(seen.iter().zip(wanted).all(|(s, w)| (s - w).abs() < 1e-8), "{row}: {seen:?} {wanted:?}");
    }
}

/// A start that the row decides says which of two solutions is meant.
#[test]
fn a_start_may_be_what_is_drawn() {
    let text = r#"(
        name: "faces",
        units: (angle: "deg"),
        parameters: {"p": Scalar(Free("0 rad"))},
        measurements: {"m": (
            inputs: {"v": (unit: "deg", sigma: "1 deg"), "h": (unit: "deg")},
            residuals: {"r": "sin(v + p) - h/(1 rad)"},
        )},
        scenarios: {"s": (measurements: {"m": (
            rows: 4,
            draw: {"face": Cycle([0, 1]), "h": Each(2, Cycle([10, 20]))},
            solve: [(unknowns: {"v": "face*pi"}, zero: "sin(v) - h")],
        )})},
    )"#;
    let program = program(text);
    let made = made(&program, &Options { exact: true, ..Options::default() });
    let found: Vec<(f64, f64)> = (0..4).map(|row| made.tables[0].1.row(row)).map(|row| (row[0], row[1])).collect();
    for (row, (v, h)) in found.into_iter().enumerate() {
        assert!((h.to_degrees() - [10.0, 10.0, 20.0, 20.0][row]).abs() < 1e-9);
        let upright = h.asin();
        let wanted = if row % 2 == 0 { upright } else { std::f64::consts::PI - upright };
        assert!((v - wanted).abs() < 1e-8, "{row}: {v} {wanted}");
    }
}

#[test]
fn what_cannot_be_solved_is_named() {
    let refused = |solve: &str, options: &Options| {
        let program = program(&arm(solve));
        let found = simulate(&program, &program.scenarios[0], options).unwrap_err();
        (found.code.id(), format!("{} {}", found.message, found.hint.unwrap_or_default()))
    };
    let none = Options::default();
    let far =
        SOLVE.replace("START", "30").replace("socket[place, hole]\"", "socket[place, hole] - vec(2000 mm, 0, 0)\"");
    let (code, words) = refused(&far, &none);
    assert_eq!(code, "E040");
    for part in ["scenario `s`, measurement `touch`, row 1", "`q1`, `q2`", "q1 = ", "deg", "left of them"] {
        assert!(words.contains(part), "{words}");
    }
    let (code, words) = refused(r#"set: { "q1": "sqrt(-1 - A.a/(1 mm))", "q2": 0 }"#, &none);
    assert!(code == "E040" && words.contains("`q1` has no value") && words.contains("`sqrt` is defined"), "{words}");
    let (code, _) = refused(r#"set: { "q1": 0, "q2": 0 }"#, &Options { rows: vec![(0, usize::MAX)], ..none.clone() });
    assert_eq!(code, "E038");
    let program = program(&arm(r#"set: { "q1": 0, "q2": 0 }"#).replace(r#""place": Cycle(["a", "b"]),"#, ""));
    assert_eq!(simulate(&program, &program.scenarios[0], &none).unwrap_err().code.id(), "E039");
}

#[test]
fn lengths_are_solved_for_from_where_nothing_is_seen() {
    let text = r#"(
        name: "m",
        parameters: { "a": Scalar(Free(1)) },
        measurements: { "m": (inputs: {"x": (), "y": (unit: "mm"), "c": ()}, residuals: {"r": "x*a - y/(1 mm)"}) },
        scenarios: { "s": (measurements: { "m": (
            rows: 5,
            draw: { "c": Uniform(2, 9) },
            solve: [
                (unknowns: {"x": 0}, zero: "x^2 - c"),
                (unknowns: {"y": 0}, zero: "y - 1000 mm * exp(c)"),
            ],
        ) }) },
    )"#;
    let made = made(&program(text), &Options::default());
    for row in 0..5 {
        let [x, y, c] = *made.tables[0].1.row(row) else { panic!() };
        assert!((x * x / c - 1.0).abs() < 1e-12 && (y / (1000.0 * c.exp()) - 1.0).abs() < 1e-12);
    }
}

/// Of the two ways to reach a point, the one nearer to the start, wherever a search from the start itself leads.
#[test]
fn the_nearest_solution_is_taken() {
    let (long, short) = (300.0f64, 200.0f64);
    for start in [(0.0, 10.0), (20.0, 60.0), (-100.0, -140.0), (170.0, 90.0)] {
        let text = r#"(
            name: "arm",
            parameters: { "a": Scalar(Free("300 mm")) },
            chains: { "arm": [Dh(name: "A", a: "300 mm"), Dh(name: "B", a: "200 mm")] },
            measurements: { "m": (
                inputs: { "q1": (unit: "rad"), "q2": (unit: "rad"), "x": (unit: "mm"), "y": (unit: "mm") },
                residuals: { "r": "arm(q1, q2).o.x - x + a - 300 mm" },
            ) },
            scenarios: { "s": (measurements: { "m": (
                rows: 400,
                draw: { "r": Uniform("110 mm", "490 mm"), "phi": Uniform("-180 deg", "180 deg") },
                set: { "x": "r*cos(phi)", "y": "r*sin(phi)" },
                solve: [ (unknowns: {"q1": "START1 deg", "q2": "START2 deg"}, zero: "arm(q1, q2).o - vec(x, y, 0)") ],
            ) }) },
        )"#;
        let program = program(&text.replace("START1", &start.0.to_string()).replace("START2", &start.1.to_string()));
        let made = made(&program, &Options::default());
        let wrap = |angle: f64| angle.sin().atan2(angle.cos());
        let distance =
            |q1: f64, q2: f64| wrap(q1 - f64::to_radians(start.0)).hypot(wrap(q2 - f64::to_radians(start.1)));
        for row in 0..400 {
            let [q1, q2, x, y] = *made.tables[0].1.row(row) else { panic!() };
            let bend = ((x * x + y * y - long * long - short * short) / (2.0 * long * short)).acos();
            let nearest = [bend, -bend]
                .map(|q2| distance(y.atan2(x) - (short * q2.sin()).atan2(long + short * q2.cos()), q2))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            assert!((distance(q1, q2) - nearest).abs() < 1e-6, "{start:?} {:?} {nearest}", [q1, q2, x, y]);
        }
    }
}

#[test]
fn an_input_that_stays_at_its_default_changes_nothing_else() {
    let model = |inputs: &str| {
        format!(
            r#"(name: "line", measurements: {{ "m": (inputs: {{ {inputs} "x": (), "y": (sigma: 1) }}, residuals: {{ "r": "y - x" }}) }},
                scenarios: {{ "s": (measurements: {{ "m": (
                    rows: 5, draw: {{ "x": Uniform(0, 1), "u": Uniform(0, 1) }}, set: {{ "y": "x + u" }},
                ) }}) }})"#
        )
    };
    let of = |inputs: &str| made(&program(&model(inputs)), &Options::default()).tables.remove(0).1;
    let (without, with) = (of(""), of(r#""t": (default: 3),"#));
    for row in 0..5 {
        assert_eq!(with.row(row)[0], 3.0);
        assert_eq!(with.row(row)[1..], without.row(row)[..]);
    }
}
