//! Tests of reading and printing whole models.

mod damage;
mod mistakes;
mod random;

use super::*;
use crate::diag::{Diagnostics, Source, Span};

/// The flagship in full, with a scenario that draws lengths and places and solves for the angles.
pub(super) const TWO_THEODOLITE: &str = include_str!("two_theodolite.ron");

/// One of everything that the language reference mentions.
pub(super) const EVERYTHING: &str = include_str!("everything.ron");

pub(super) fn read(text: &str) -> Result<Model, Diagnostics> {
    load(&Source::new("model.ron", text)).map(|(model, _)| model)
}

fn good(text: &str) -> Model {
    read(text).unwrap_or_else(|found| panic!("{}", crate::diag::text(&found, false)))
}

#[test]
fn the_flagship_says_what_it_should() {
    let model = good(TWO_THEODOLITE);
    assert_eq!(model.units.length.as_ref().unwrap().value, "mm");
    let left = model.chains.get("left").unwrap();
    assert_eq!(left.len(), 3);
    let Joint::Revolute(l1) = &left[1] else { panic!("{:?}", left[1]) };
    assert_eq!(l1.phi, Some(Value::Constant(0.0.into())));
    let Some(Value::Held(b)) = &l1.b else { panic!("{:?}", l1.b) };
    assert_eq!(b.nominal, 0.0.into());
    let lines = model.measurements.get("vo_line").unwrap();
    assert_eq!(lines.inputs.len(), 9);
    assert_eq!(lines.data.0[0].file.value, "vo_line.csv");
    let paper = model.scenarios.get("paper").unwrap();
    let made = paper.measurements.get("vo_line").unwrap();
    assert_eq!((paper.seed, made.rows), (Some(1), Some(300)));
    assert_eq!(made.solve.len(), 4);
    assert_eq!(made.draw.get("length"), Some(&Draw::Uniform(200.0.into(), 500.0.into())));
}

#[test]
fn names_and_leaves_know_their_bytes() {
    let model = good(TWO_THEODOLITE);
    let at = |span: Span| &TWO_THEODOLITE[span.range()];
    let (name, left) = model.chains.entry("left").unwrap();
    assert_eq!(at(name.span), "left");
    assert_eq!(at(left[0].span()), "Fixed(name: \"L0\", phi: \"pi/2\", alpha: Free(\"pi/2\"), beta: Free(\"pi\"))");
    assert_eq!(at(left[0].name().span), "L0");
    let lines = model.measurements.get("vo_line").unwrap();
    let vo = &lines.residuals.get("vo").unwrap().value;
    let inner = vo.value.find("length").unwrap();
    assert!(vo.exact);
    assert_eq!(at(vo.locate(Span::new(inner, inner + 6))), "length");
    let length = lines.inputs.get("length").unwrap();
    assert_eq!(at(length.span), "(unit: \"mm\", sigma: \"0.01 mm\")");
    assert_eq!(at(length.sigma.as_ref().unwrap().span()), "0.01 mm");
    let truth = &model.scenarios.get("paper").unwrap().truth;
    let Some(Draw::Constant(a)) = truth.get("L1.a") else { panic!("{truth:?}") };
    assert_eq!(at(a.span()), "0.229008");
}

#[test]
fn printed_models_load_as_equal_ones() {
    for text in [TWO_THEODOLITE, EVERYTHING, "(name: \"\")"] {
        let model = good(text);
        let printed = print(&model);
        assert_eq!(good(&printed), model, "{printed}");
        assert_eq!(print(&good(&printed)), printed);
    }
}

#[test]
fn printing_is_canonical() {
    let text = r#"( parameters : { "s" : Scalar ( value : Free( nominal : 1.50 , min : None ) ) , },
        units: (), define: {}, /* nothing */ name: r"two \ words", ) // end"#;
    assert_eq!(
        print(&good(text)),
        "\
Model(
    name: \"two \\\\ words\",
    parameters: {\"s\": Scalar(Free(1.5))},
)
"
    );
}

#[test]
fn every_way_to_write_a_value() {
    let model = good(EVERYTHING);
    let value = |name: &str| model.parameters.get(name).unwrap();
    let Values::Whole(whole) = &value("target").value else { panic!("it is free as a whole") };
    assert_eq!(whole.nominal(), &Components::Each(vec![0.0.into(), 0.0.into(), 100.0.into()]));
    assert_eq!(value("target").sigma, Some(Components::One("5 mm".into())));
    assert_eq!(value("base").value.component(2).unwrap().nominal, value("base2").value.component(2).unwrap().nominal);
    assert!(value("socket").family);
    assert_eq!(value("height").members.len(), 1);
    let Values::Whole(Value::Free(bounded)) = &value("bounded").value else { panic!("it is free") };
    assert_eq!(bounded.min, Some(Components::One((-1.0).into())));
    assert_eq!(bounded.sigma, Some(Components::One("0.5 mm".into())));
    assert_eq!(bounded.tolerance, None);
    let arm = model.chains.get("arm").unwrap();
    let Joint::Dh(row) = &arm[2] else { panic!("{:?}", arm[2]) };
    assert_eq!(row.reads, Reads::Length);
    let data = &model.measurements.get("touch").unwrap().data.0;
    assert_eq!(data.len(), 3);
    assert!(data[2].optional);
}

#[test]
fn the_root_and_the_edges_of_the_text() {
    for text in [
        "Model(name: \"m\")",
        "(name: \"m\") // the end",
        "\u{feff}(name: \"m\")",
        "#![enable(implicit_some)]\n(name: \"m\")",
        "(name: \"m\", source: Some(\"m\"), description: None)",
    ] {
        assert_eq!(good(text).name.value, "m");
    }
    let text = "\u{feff}(name: \"µ\")";
    assert_eq!(&text[good(text).name.span.range()], "µ");
}
