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
