//! The picture of the instrument.

use maud::{PreEscaped, html};

use super::{Reported, Section};
use crate::report::chart::{Figure, magnification, picture};
use crate::report::number::significant;

/// Chains, what they sight, and how well points are known; none where there is nothing to see.
pub(super) fn section(of: &Reported) -> Option<Section> {
    let scene = of.scene.as_ref().filter(|scene| !scene.is_empty())?;
    let (svg, data) = picture(scene);
    let ellipsoids = match magnification(scene) {
        Some(times) => {
            format!("Ellipsoids are one standard uncertainty of points, magnified {} times.", significant(times, 3))
        }
        None => "No point has an uncertainty to draw.".into(),
    };
    let caption = format!(
        "Frames of the chains (x vermilion, y green, z blue), lines of sight, and points with the calibrated values. {ellipsoids}"
    );
    let numbers = scene.all_points().map(|point| {
        let [x, y, z] = point.at;
        let sigma =
            |i: usize| point.covariance.and_then(|c| Some(c.get(i)?.get(i)?.sqrt().to_string())).unwrap_or_default();
        format!("{},{x},{y},{z},{},{},{}\n", point.name, sigma(0), sigma(1), sigma(2))
    });
    let numbers = format!("point,x,y,z,sigma x,sigma y,sigma z\n{}", numbers.collect::<String>());
    // `<` ends a script nowhere
    let data = data.to_string().replace('<', "\\u003c");
    let body = html! {
        figure {
            (svg)
            div.controls {
                span { "drag to turn, wheel to come nearer, arrow keys too" }
                @if scene.shots.len() > 1 {
                    label { "row " input #shot type="range" min="0" max=(scene.shots.len() - 1) value="0"; " " output #shown {} }
                }
                @if magnification(scene).is_some() {
                    label { "ellipsoids × " input #larger type="range" min="-2" max="2" step="0.1" value="0"; " " output #times {} }
                }
            }
            figcaption { (caption) }
            details { summary { "Numbers" } pre { (numbers) } }
        }
        script #scene-data type="application/json" { (PreEscaped(data)) }
    };
    let figure = Figure { id: "instrument".into(), caption, svg, numbers };
    Some(Section { figures: vec![figure], ..Section::new("instrument", "The instrument", body) })
}
