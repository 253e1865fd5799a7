//! A derivative that is wrong by one route is seen, and named.

use super::*;
use crate::compile::compile;
use crate::diag::Source;
use crate::model::load;

/// Lengths, angles, and a rotation at zero.
const MODEL: &str = r#"(
    name: "turned",
    parameters: {
        "a": Scalar(Free("400 mm")), "t": Scalar(Free("0.3 rad")), "turn": Rotation(Free((0, 0, 0))),
    },
    measurements: { "m": (
        inputs: { "s": (unit: "rad"), "x": (unit: "mm") },
        residuals: { "r": "dot(rotate(turn, vec(a*cos(s + t), a*sin(s + t), x)), vec(1, 2, 3)) - x", "angle": "atan2(x, a) - s" },
    ) },
)"#;

fn program() -> Program {
    let source = Source::new("model.ron", MODEL);
    let (model, _) = load(&source).expect("it reads");
    compile(&model, &source, &[]).expect("it compiles").0
}

#[test]
fn one_wrong_derivative_of_any_route_is_named() {
    let program = program();
    let batch = Batch::of(&program, 0, None, &[], 3).expect("rows");
    let right = &check_batch(&batch, 3).expect("it is evaluated")[0];
    assert!(right.agree(), "{right:#?}");
    // r, angle by a, t, turn (3), s, x
    assert_eq!((right.points, right.derivatives, right.undefined), (13, 13 * 14, 0));
    for route in Route::ALL {
        let mut looked = Looked::at(&batch, 3).expect("it is evaluated");
        // columns: turn (3), a, t, s, x; the second residual by a, where that is not small
        let size = |at: &usize| {
            looked.seen[*at].as_ref().and_then(|seen| seen.routes[0][10]).map_or(0.0, |one| one.value.abs())
        };
        let point = (0..looked.seen.len()).max_by(|a, b| size(a).total_cmp(&size(b))).expect("a point");
        let wrong =
            looked.seen[point].as_mut().expect("a point").routes[route as usize][10].as_mut().expect("an entry");
        // differences know no more digits than they say
        let share = if route == Route::Differences { 1e-2 } else { 1e-9 };
        wrong.value *= 1.0 + share;
        let found = looked.verdict(&batch, 0);
        assert!(!found.agree(), "{route:?}: {found:#?}");
        for one in &found.routes {
            assert_eq!(one.agrees, one.route != route, "{one:#?}");
        }
        let named = found.routes[route as usize].worst.as_ref().expect("an entry");
        assert_eq!((named.residual.as_str(), named.by.as_str()), ("angle", "a"));
        assert_eq!(named.at.len(), 7);
        assert!((named.value / named.exact - 1.0 - share).abs() < 1e-6, "{named:?}");

        let wrong =
            looked.seen[point].as_mut().expect("a point").routes[route as usize][10].as_mut().expect("an entry");
        wrong.value = f64::NAN;
        assert!(!looked.verdict(&batch, 0).routes[route as usize].agrees);
    }
}
