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
