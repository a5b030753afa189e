//! Shape and place of the artefact: cone, thickness, indicators beside its crest.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::Disturbance;

/// A cone: both surfaces rise along the artefact, by as much or by different amounts.
pub fn taper(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let (what, sides) = [
        ("both surfaces alike", [1.0, 1.0]),
        ("a wedge, only A rises", [2.0, 0.0]),
        ("a wedge, only B rises", [0.0, 2.0]),
        ("an oblique cone", [1.7, 0.3]),
    ][which % 4];
    let sign = chance.sign();
    Recipe::new(what, [1e-6, 3e-3], move |tau| {
        vec![Disturbance::surface(move |m, u| {
            1e3 * sign * tau * sides[m.side()] * u
        })]
    })
    .sized(1.0, "rad")
}

/// A thick artefact at a tilt, probed at places D·θ apart, of which the fit knows nothing.
pub fn thickness(which: usize, _: &mut Chance, _: &Facts) -> Recipe {
    let what = ["a bar", "a square", "a thick bar", "a gauge block"][which % 4];
    Recipe::new(what, [20.0, 400.0], move |d| {
        vec![Disturbance {
            thickness: d,
            ..Disturbance::default()
        }]
    })
    .sized(1.0, "mm")
}

/// A round bar touched beside its crest: the height falls by z²/2R, z the distance from the crest,
/// which changes along the slide as spindle and bar stand obliquely in that plane too.
pub fn off_crest(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let radius = chance.between(10.0, 40.0);
    // The slide's and the bar's obliquity across the plane; the bar's turns with the spindle.
    let (what, offsets, slide, bar) = [
        (
            "both indicators in the plane, oblique slide and bar",
            [0.0, 0.0],
            1.0,
            0.8,
        ),
        ("near indicator beside the crest", [1.5, 0.0], 0.6, 1.0),
        ("far indicator beside the crest", [0.0, -2.0], 1.0, 0.5),
        ("both beside the crest", [1.0, -0.7], 0.9, -0.9),
    ][which % 4];
    let middle = facts.length / 2.0;
    Recipe::new(what, [0.3, 8.0], move |s| {
        let per_mm = s / middle;
        vec![Disturbance::surface(move |m, u| {
            let turned = if m.position == 0 { bar } else { -bar };
            let z = s * offsets[m.indicator] + per_mm * (slide + turned) * (u - middle);
            -1e3 * z * z / (2.0 * radius)
        })]
    })
}
