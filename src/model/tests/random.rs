//! Random models: what is printed loads as the same.

use proptest::collection::vec;
use proptest::option::of;
use proptest::prelude::*;

use super::read;
use crate::diag::{Span, text};
use crate::model::*;

fn any_text() -> BoxedStrategy<Text> {
    prop_oneof![
        "[a-z][a-z0-9.]{0,6}",
        "[0-9]{1,3} (mm|deg|°|µm)",
        any::<String>(),
        Just("12°34'56.7\"\\\n\t\r\0".to_owned()),
    ]
    .prop_map(|value| Text::from(value.as_str()))
    .boxed()
}

fn number() -> BoxedStrategy<f64> {
    prop_oneof![(-5000..5000_i32).prop_map(f64::from), any::<f64>().prop_filter("finite", |x| x.is_finite()),].boxed()
}

fn quantity() -> BoxedStrategy<Quantity> {
    prop_oneof![number().prop_map(Quantity::from), any_text().prop_map(Quantity::Text)].boxed()
}

fn map<V: std::fmt::Debug + 'static>(value: impl Strategy<Value = V> + 'static) -> BoxedStrategy<Map<V>> {
    vec((any_text(), value), 0..3)
        .prop_map(|mut entries| {
            let mut known = std::collections::BTreeSet::new();
            entries.retain(|(key, _)| known.insert(key.value.clone()));
            Map(entries)
        })
        .boxed()
}

/// Names of columns hold no comma: what is printed has one name for each.
fn columns<V: std::fmt::Debug + Clone + 'static>(
    value: impl Strategy<Value = V> + 'static,
) -> BoxedStrategy<Columns<V>> {
    let alone = |all: &Map<V>| all.keys().all(|name| !name.value.contains(','));
    map(value).prop_filter("a comma", alone).prop_map(Columns).boxed()
}

fn value<Q: Clone + std::fmt::Debug + 'static>(
    nominal: BoxedStrategy<Q>,
    bound: BoxedStrategy<Q>,
    spread: BoxedStrategy<Q>,
) -> BoxedStrategy<Value<Q>> {
    let setting = (nominal.clone(), of(bound.clone()), of(bound), of(spread.clone()), of(spread))
        .prop_map(|(nominal, min, max, sigma, tolerance)| Setting {
            nominal,
            min,
            max,
            sigma,
            tolerance,
            span: Span::default(),
        })
        .boxed();
    prop_oneof![
        nominal.prop_map(Value::Constant),
        setting.clone().prop_map(Value::Free),
        setting.prop_map(Value::Held),
    ]
    .boxed()
}

fn leaf() -> BoxedStrategy<Option<Value<Quantity>>> {
    let quantity = || quantity().boxed();
    of(value(quantity(), quantity(), quantity())).boxed()
}

fn phi_joint() -> BoxedStrategy<PhiJoint> {
    (any_text(), leaf(), leaf(), leaf(), leaf(), leaf(), leaf())
        .prop_map(|(name, phi, d, a, b, alpha, beta)| PhiJoint {
            name,
            phi,
            d,
            a,
            b,
            alpha,
            beta,
            span: Span::default(),
        })
        .boxed()
}

fn dh_row() -> BoxedStrategy<DhRow> {
    let reads = prop_oneof![Just(Reads::Angle), Just(Reads::Length), Just(Reads::Nothing)];
    (any_text(), leaf(), leaf(), leaf(), leaf(), leaf(), reads)
        .prop_map(|(name, theta, d, a, alpha, beta, reads)| DhRow {
            name,
            theta,
            d,
            a,
            alpha,
            beta,
            reads,
            span: Span::default(),
        })
        .boxed()
}

fn rigid() -> BoxedStrategy<Rigid> {
    (any_text(), leaf(), leaf(), leaf(), leaf(), of(any_text()))
        .prop_map(|(name, x, y, rx, rz, pose)| Rigid { name, x, y, rx, rz, pose, ..Rigid::default() })
        .boxed()
}

fn joint() -> BoxedStrategy<Joint> {
    prop_oneof![
        phi_joint().prop_map(Joint::Revolute),
        phi_joint().prop_map(Joint::Prismatic),
        phi_joint().prop_map(Joint::Fixed),
        rigid().prop_map(Joint::Rigid),
        dh_row().prop_map(Joint::Dh),
        dh_row().prop_map(Joint::ModifiedDh),
    ]
    .boxed()
}

fn each(count: usize) -> BoxedStrategy<Components> {
    vec(quantity(), count).prop_map(Components::Each).boxed()
}

fn nominal(count: usize) -> BoxedStrategy<Components> {
    let whole = any_text().prop_map(|text| Components::One(Quantity::Text(text)));
    match count {
        1 => quantity().prop_map(Components::One).boxed(),
        _ => prop_oneof![whole, each(count)].boxed(),
    }
}

/// A value of the whole, or for some of several components one each, of which the first stands in `Free(…)` or `Held(…)`.
fn values(count: usize, whole: BoxedStrategy<Value<Components>>) -> BoxedStrategy<Values> {
    let whole = whole.prop_map(Values::Whole);
    if count == 1 {
        return whole.boxed();
    }
    let leaf = || value(quantity(), quantity(), quantity());
    let wrapped = leaf().prop_filter("a constant", |value| value.setting().is_some());
    let each = (wrapped, vec(leaf(), count - 1))
        .prop_map(|(first, rest)| Values::Each(std::iter::once(first).chain(rest).collect()));
    prop_oneof![3 => whole, 1 => each].boxed()
}

fn part(count: usize) -> BoxedStrategy<Components> {
    let one = quantity().prop_map(Components::One);
    match count {
        1 => one.boxed(),
        _ => prop_oneof![one, each(count)].boxed(),
    }
}

fn parameter() -> BoxedStrategy<Parameter> {
    proptest::sample::select(Shape::ALL.to_vec())
        .prop_flat_map(|shape| {
            let count = shape.components();
            let spread = || part(count.min(3));
            let angle = move || match shape {
                Shape::Pose => of(part(3)).boxed(),
                _ => Just(None).boxed(),
            };
            let value = move || values(count, value(nominal(count), part(count), spread()));
            let first = (value(), of(any_text()), of(spread()), of(part(count)));
            let second = (of(part(count)), of(spread()), angle(), angle());
            (first, second, any::<bool>(), map(value())).prop_map(
                move |((value, unit, sigma, min), (max, tolerance, sa, ta), family, members)| Parameter {
                    shape,
                    value,
                    unit,
                    sigma,
                    min,
                    max,
                    tolerance,
                    sigma_angle: sa,
                    tolerance_angle: ta,
                    family,
                    members,
                    span: Span::default(),
                },
            )
        })
        .boxed()
}

fn data() -> BoxedStrategy<DataFiles> {
    let file = (any_text(), vec(any_text(), 0..3), map(quantity()), any::<bool>(), any::<bool>(), any::<bool>())
        .prop_map(|(file, columns, constants, optional, header, check)| DataFile {
            file,
            columns,
            constants,
            optional,
            header,
            role: if check { DataRole::Check } else { DataRole::Calibrate },
            span: Span::default(),
        });
    vec(file, 0..3).prop_map(DataFiles).boxed()
}

fn input() -> BoxedStrategy<Input> {
    (of(any_text()), of(quantity()), of(quantity()), of(quantity()), of(any_text()))
        .prop_map(|(unit, sigma, bias, default, group)| {
            let span = Span::default();
            Input { unit, sigma, bias, default, group, span }
        })
        .boxed()
}

fn measurement() -> BoxedStrategy<Measurement> {
    let residual =
        (any_text(), of(quantity())).prop_map(|(value, sigma)| Residual { value, sigma, span: Span::default() });
    let loss = (any_text(), of(quantity()), of(any_text()), of(any_text()))
        .prop_map(|(kernel, tuning, of, scale)| Loss { kernel, tuning, of, scale, span: Span::default() });
    let says = (map(quantity()), map(residual), of(loss.boxed()));
    let derivatives = map(map(any_text()).boxed());
    (data(), vec(any_text(), 0..3), columns(input()), map(any_text()), says, (map(any_text()), derivatives))
        .prop_map(|(data, keys, inputs, define, (correlations, residuals, loss), (outputs, derivatives))| Measurement {
            derivatives,
            data,
            keys,
            inputs,
            define,
            correlations,
            residuals,
            loss,
            outputs,
            span: Span::default(),
        })
        .boxed()
}

fn draw() -> BoxedStrategy<Draw> {
    prop_oneof![
        quantity().prop_map(Draw::Constant),
        (quantity(), quantity()).prop_map(|(a, b)| Draw::Uniform(a, b)),
        (quantity(), quantity()).prop_map(|(a, b)| Draw::Normal(a, b)),
        quantity().prop_map(Draw::Around),
        vec(quantity(), 1..3).prop_map(Draw::Cycle),
        vec(quantity(), 1..3).prop_map(Draw::Choice),
        (1_u64.., vec(quantity(), 1..3)).prop_map(|(rows, all)| Draw::Each(rows, Box::new(Draw::Cycle(all)))),
    ]
    .boxed()
}

fn experiment() -> BoxedStrategy<Experiment> {
    let solve = (map(quantity()), vec(any_text(), 1..3)).prop_map(|(unknowns, zero)| Solve {
        unknowns,
        zero: Zero(zero),
        span: Span::default(),
    });
    let noise = (of(quantity()), of(quantity())).prop_map(|(mean, sigma)| Noise { mean, sigma, span: Span::default() });
    (of(any::<u64>()), columns(draw()), map(any_text()), map(quantity()), vec(solve, 0..3), columns(noise))
        .prop_map(|(rows, draw, define, set, solve, noise)| Experiment {
            rows,
            draw,
            define,
            set,
            solve,
            noise,
            span: Span::default(),
        })
        .boxed()
}

fn model() -> BoxedStrategy<Model> {
    let scenario = (of(any::<u64>()), map(draw()), map(experiment()))
        .prop_map(|(seed, truth, measurements)| Scenario { seed, truth, measurements, span: Span::default() });
    let head = (any_text(), of(any_text()), of(any_text()), of(quantity()));
    let joints = map(vec(joint(), 0..3));
    let texts = (map(any_text()), map(any_text()), map(any_text()));
    (head, joints, map(parameter()), texts, map(measurement()), map(scenario))
        .prop_map(|(head, mut chains, parameters, (functions, define, constraints), measurements, scenarios)| {
            let (name, source, unit, number) = head;
            unique(&mut chains);
            Model {
                name,
                source: source.clone(),
                description: unit.clone(),
                units: Units { length: unit, time: source, ..Units::default() },
                tolerances: Tolerances { angle: number.clone(), number, ..Tolerances::default() },
                chains,
                parameters,
                functions,
                define,
                constraints,
                measurements,
                scenarios,
                span: Span::default(),
            }
        })
        .boxed()
}

/// Joints of a file have names of their own.
fn unique(chains: &mut Map<Vec<Joint>>) {
    let mut count = 0;
    for joint in chains.0.iter_mut().flat_map(|(_, joints)| joints) {
        count += 1;
        let name = match joint {
            Joint::Revolute(joint) | Joint::Prismatic(joint) | Joint::Fixed(joint) => &mut joint.name,
            Joint::Rigid(joint) => &mut joint.name,
            Joint::Dh(row) | Joint::ModifiedDh(row) => &mut row.name,
        };
        name.value.push_str(&count.to_string());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn printing_and_loading_is_the_identity(model in model()) {
        let printed = print(&model);
        match read(&printed) {
            Ok(again) => prop_assert_eq!(again, model),
            Err(found) => prop_assert!(false, "{}", text(&found, false)),
        }
    }
}
