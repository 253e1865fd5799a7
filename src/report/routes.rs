//! Derivatives by several routes, as text and JSON.

use std::fmt::Write;

use serde_json::{Map, Value, json};

use super::number::significant;
use super::table::{Align, Grid};
use crate::audit::{CheckedRoute, CheckedRoutes, Route, WorstDerivative};

/// What became of the derivatives of every measurement.
pub fn routes_text(all: &[CheckedRoutes]) -> String {
    let mut out = String::new();
    for (number, one) in all.iter().enumerate() {
        let gap = if number == 0 { "" } else { "\n" };
        let (derivatives, points) = (super::count(one.derivatives, "derivative", "derivatives"), points(one));
        let _ = writeln!(out, "{gap}{}: {derivatives} {points}, beside dual numbers", one.measurement);
        let mut grid = Grid::new(&[Align::Left, Align::Left, Align::Right, Align::Left]);
        for route in &one.routes {
            let verdict = match (route.compared, route.agrees) {
                (0, _) => "left out",
                (_, true) => "agrees",
                (_, false) => "disagrees",
            };
            let digits = match route.compared {
                0 => String::new(),
                _ => format!("{:.1} digits", route.digits),
            };
            let left_out = route.left_out.clone().unwrap_or_default();
            grid.row([title(route.route).to_owned(), verdict.to_owned(), digits, left_out]);
        }
        out.push_str(&grid.text("  "));
        for (route, worst) in
            one.routes.iter().filter(|route| !route.agrees).filter_map(|r| Some((r, r.worst.as_ref()?)))
        {
            let _ = writeln!(
                out,
                "\n  {}: {} by {} = {:e}, and it is {:e}",
                title(route.route),
                worst.residual,
                worst.by,
                worst.value,
                worst.exact
            );
            let at: Vec<String> =
                worst.at.iter().map(|(name, value)| format!("{name} = {}", significant(*value, 6))).collect();
            let _ = writeln!(out, "    at {}", at.join(", "));
        }
    }
    out
}

fn points(one: &CheckedRoutes) -> String {
    let points = super::count(one.points, "point", "points");
    match one.undefined {
        0 => format!("at {points}"),
        undefined => format!("at {points} ({undefined} undefined)"),
    }
}

fn title(route: Route) -> &'static str {
    match route {
        Route::ComplexStep => "complex step",
        other => other.name(),
    }
}

/// Every route of every measurement.
pub fn routes_json(all: &[CheckedRoutes]) -> Value {
    let worst = |worst: &WorstDerivative| {
        let at: Map<String, Value> = worst.at.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
        json!({"residual": worst.residual, "by": worst.by, "value": worst.value, "exact": worst.exact, "at": at})
    };
    let route = |one: &CheckedRoute| {
        let shown = one.compared > 0;
        json!({
            "route": one.route.name(), "agrees": shown.then_some(one.agrees), "compared": one.compared,
            "digits": shown.then_some(one.digits), "worst": one.worst.as_ref().map(worst), "left_out": one.left_out,
        })
    };
    let one = |one: &CheckedRoutes| {
        let routes: Vec<Value> = one.routes.iter().map(route).collect();
        json!({
            "measurement": one.measurement, "points": one.points, "undefined": one.undefined,
            "derivatives": one.derivatives, "agrees": one.agree(), "routes": routes,
        })
    };
    all.iter().map(one).collect()
}
