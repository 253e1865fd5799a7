use super::*;
use crate::model::load;

fn compiled(text: &str) -> Result<Program, Vec<String>> {
    let source = Source::new("m.ron", text);
    let say = |d: Diagnostics| d.iter().map(|d| format!("{} {}", d.code, d.message)).collect::<Vec<_>>();
    let (model, _) = load(&source).map_err(say)?;
    compile(&model, &source, &[]).map(|(program, _)| program).map_err(say)
}

const LINE: &str = r#"(
    name: "line",
    parameters: { "a": Scalar(Free(1)), "b": Scalar(Free(0)) },
    measurements: { "point": (inputs: {"x": (), "y": ()}, residuals: {"r": "y - (a + b*x)"}) },
)"#;

#[test]
fn a_line() {
    let program = compiled(LINE).unwrap();
    let m = &program.measurements[0];
    assert_eq!(m.tape.evaluate(&[1.0, 2.0], &[10.0, 30.0]), [9.0]);
}

#[test]
fn a_unit_counts_once_and_a_bare_number_in_the_unit_of_its_place() {
    let text = r#"(
        name: "units",
        parameters: {
            "scale": Scalar(value: Free("5 ppm"), unit: "ppm"),
            "other": Scalar(value: Free(5), unit: "ppm"),
            "turn": Scalar(value: Free("pi/2"), unit: "deg"),
        },
        measurements: { "m": (inputs: {"x": ()}, residuals: {"r": "x*scale + other + turn"}) },
    )"#;
    let program = compiled(text).unwrap();
    let nominal: Vec<f64> = program.parameters.iter().map(|p| p.setting.nominal[0]).collect();
    assert_eq!(nominal, [5e-6, 5e-6, std::f64::consts::FRAC_PI_2]);
    let wrong = compiled(&text.replace("unit: \"deg\"", "unit: \"mm\"").replace("pi/2", "5 px")).unwrap_err();
    assert!(wrong[0].starts_with("E012"), "{wrong:?}");
}

#[test]
fn mistakes_are_found_together() {
    let found = compiled(
        r#"(
        name: "m",
        units: (length: "mm"),
        chains: { "arm": [Revolute(name: "J", a: Free(0), alpha: "pi/2")] },
        measurements: { "m": (
            inputs: {"q": (unit: "rad"), "l": (unit: "mm"), "t": (unit: "s")},
            residuals: {
                "one": "arm(q).o - l",
                "two": "l + t",
                "three": "arm(q, q).o",
                "four": "sin(l)",
                "five": "J.alhpa",
                "six": "l + 5",
                "seven": "arm(q)",
                "eight": "nrm(arm(q).o)",
            },
        ) },
    )"#,
    )
    .unwrap_err();
    for code in ["E015", "E016", "E014", "E013"] {
        assert!(found.iter().any(|line| line.starts_with(code)), "{code} in {found:#?}");
    }
    assert_eq!(found.len(), 8, "{found:#?}");
}

#[test]
fn functions_that_call_functions_do_not_explode_and_do_not_overflow() {
    let chain = |n: usize| {
        let mut text = String::from(r#"(name: "d", parameters: {"a": Scalar(Free(1))}, functions: {"f0(x)": "x","#);
        for i in 1..n {
            text += &format!(r#""f{i}(x)": "f{0}(x) + f{0}(x)","#, i - 1);
        }
        text + &format!(r#"}}, measurements: {{"m": (residuals: {{"r": "f{}(a)"}})}})"#, n - 1)
    };
    // 2^39 calls, 39 additions
    let program = compiled(&chain(40)).unwrap();
    assert_eq!(program.measurements[0].tape.evaluate(&[1.0], &[]), [2f64.powi(39)]);
    let found = compiled(&chain(2000)).unwrap_err();
    assert!(found[0].starts_with("E038"), "{found:?}");
}

/// The constraints of two scalars, a family of vectors and a rotation: name, relation, whether linear.
fn constrained(constraints: &str) -> Result<Vec<(String, Relation, bool)>, Vec<String>> {
    let text = format!(
        r#"(
        name: "c",
        units: (length: "mm"),
        parameters: {{ "a": Scalar(Free("1 mm")), "b": Scalar(Held("2 mm")), "p": Vec3(value: Free((0, 0, 0)), family: true), "r": Rotation(Held((0, 0, 0))) }},
        constraints: {{ {constraints} }},
        measurements: {{ "m": (keys: ["k"], inputs: {{"x": (unit: "mm")}}, residuals: {{"s": "norm(p[k]) + a - x"}}) }},
    )"#
    );
    let items = |program: Program| {
        program.constraints.items.into_iter().map(|item| (item.name, item.relation, item.linear)).collect()
    };
    compiled(&text).map(items)
}

#[test]
fn constraints_are_one_scalar_each() {
    use Relation::{AtMost, Equal};
    let expect = |constraints: &str, expected: &[(&str, Relation, bool)]| {
        let found = constrained(constraints).unwrap();
        let found: Vec<_> = found.iter().map(|(name, relation, linear)| (name.as_str(), *relation, *linear)).collect();
        assert_eq!(found, expected, "{constraints}");
    };
    expect(r#""e": "2*a - b/3 = 1 mm""#, &[("e", Equal, true)]);
    expect(r#""e": "a >= b""#, &[("e", AtMost, true)]);
    // a held one can be freed, and then it is not linear
    expect(r#""e": "a*b <= 1 mm^2""#, &[("e", AtMost, false)]);
    expect(r#""e": "3 mm >= a >= 1 mm""#, &[("e (upper)", AtMost, true), ("e (lower)", AtMost, true)]);
    expect(r#""e": "2 mm <= a <= 2 mm""#, &[("e", Equal, true)]);
    expect(r#""e": "a <= b <= norm(p[u])""#, &[("e (lower)", AtMost, true), ("e (upper)", AtMost, false)]);
    // a component that always holds says nothing
    expect(r#""e": "vec(a, 0, b) = vec(0, 0, 1 mm)""#, &[("e.x", Equal, true), ("e.z", Equal, true)]);
    expect(r#""e": "r*p[u] = p['v w']""#, &[("e.x", Equal, false), ("e.y", Equal, false), ("e.z", Equal, false)]);
}

#[test]
fn mistakes_of_constraints_have_their_code() {
    for (constraint, code) in [
        ("x = a", "E013"),
        ("norm(p[k]) + k = a", "E013"),
        ("a = 3", "E016"),
        ("p[u] <= p[v]", "E015"),
        ("r = r", "E015"),
        ("p[u] = a", "E015"),
        ("a", "E010"),
        ("1 mm <= 2 mm", "E050"),
        ("a - a = 0", "E050"),
        ("2 mm <= a <= 1 mm", "E051"),
        ("1 mm >= a >= 2 mm", "E051"),
        ("vec(a, 0, 1 mm) = vec(0, 0, 2 mm)", "E051"),
    ] {
        let found = constrained(&format!(r#""e": "{constraint}""#)).unwrap_err();
        assert_eq!(found.len(), 1, "{constraint}: {found:?}");
        assert!(found[0].starts_with(code), "{constraint}: {found:?}");
    }
}

#[test]
fn an_equation_makes_a_parameter_used_and_an_order_does_not() {
    let text = |constraint: &str| {
        format!(
            r#"(name: "u", parameters: {{ "a": Scalar(Free(1)), "b": Scalar(Free(1)) }}, constraints: {{ "e": "{constraint}" }},
            measurements: {{ "m": (inputs: {{"x": ()}}, residuals: {{"s": "a - x"}}) }})"#
        )
    };
    assert!(compiled(&text("a + b = 2")).is_ok());
    assert!(compiled(&text("a <= b")).unwrap_err()[0].starts_with("E018"));
}
