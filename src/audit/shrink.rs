//! The simplest point at which something is still wrong.

use super::points::{Place, Point};

/// A point with few numbers that matter.
#[derive(Clone, Debug, PartialEq)]
pub struct CounterExample {
    /// Names of parameters and inputs with their values in internal units; those at zero or at their nominal value left out.
    pub at: Vec<(String, f64)>,
    /// The component.
    pub component: String,
    /// The formula there.
    pub given: f64,
    /// The derivative there.
    pub exact: f64,
}

/// Passes over all numbers.
const PASSES: usize = 3;

/// Puts one number after the other to zero, to its nominal value, or to fewer digits, as long as `wrong` stays true.
pub(super) fn shrink(
    from: &Point,
    places: &[Place],
    wrong: &dyn Fn(&Point) -> bool,
    values: impl Fn(&Point) -> Option<(String, f64, f64)>,
) -> CounterExample {
    let mut point = from.clone();
    for _ in 0..PASSES {
        let before = point.clone();
        for place in places {
            let now = point.get(place);
            if now == 0.0 {
                continue;
            }
            let round = |digits: i32| {
                let scale = 10_f64.powi(digits - 1 - now.abs().log10().floor() as i32);
                (now * scale).round() / scale
            };
            let simpler = [place.nominal, 0.0, 1.0, round(1), round(2)];
            for value in simpler.into_iter().filter(|value| value.is_finite()) {
                if value == now {
                    break;
                }
                let mut trial = point.clone();
                trial.set(place, value);
                if wrong(&trial) {
                    point = trial;
                    break;
                }
            }
        }
        if point == before {
            break;
        }
    }
    let telling = places.iter().filter(|place| point.get(place) != place.nominal);
    let at = telling.map(|place| (place.name.clone(), point.get(place))).collect();
    let (component, given, exact) = values(&point).unwrap_or_default();
    CounterExample { at, component, given, exact }
}
