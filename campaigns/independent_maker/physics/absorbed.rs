//! What four channels cannot show, whatever its size.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::forms::Form;
use crate::rig::Disturbance;

/// The artefact hangs through: its axis bends, and does not turn with the spindle.
pub fn sag(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let depth = chance.log_between(0.3, 15.0);
    let length = facts.length;
    let what = [
        "held at one end",
        "between centres",
        "with an overhang",
        "on two supports",
    ][which % 4];
    Recipe::new(what, [1.0, 1.0], move |s| {
        vec![Disturbance::slide(move |_, x| {
            let t = x / length;
            let shape = match which % 4 {
                0 => t * t * (6.0 - 4.0 * t + t * t) / 3.0,
                1 => 16.0 / 5.0 * t * (1.0 - 2.0 * t * t + t * t * t),
                2 => t * t * (1.5 - t),
                _ => t * t * (1.0 - t) * (1.0 - t) * 16.0 - 0.3,
            };
            s * depth * shape
        })]
    })
}

/// A tip of finite radius rides on what is highest beneath it.
pub fn tip(which: usize, _: &mut Chance, facts: &Facts) -> Recipe {
    let what = [
        "ball of 3 mm",
        "ball of 10 mm",
        "button of 60 mm",
        "button of 300 mm",
    ][which % 4];
    let radius = [3.0, 10.0, 60.0, 300.0][which % 4];
    let surfaces = facts.surfaces.clone();
    Recipe::new(what, [1.0, 1.0], move |_| {
        let surfaces = surfaces.clone();
        vec![Disturbance::surface(move |m, u| {
            let form: &Form = &surfaces[m.side()];
            let highest = (-40..=40)
                .map(|k| {
                    let w = f64::from(k) * 0.025;
                    form.at(u + w) - 1e3 * w * w / (2.0 * radius)
                })
                .fold(f64::NEG_INFINITY, f64::max);
            highest - form.at(u)
        })]
    })
}

/// Both indicators read too much by the same part.
pub fn gain(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let what = [
        "half a per cent",
        "two per cent",
        "five per cent",
        "ten per cent",
    ][which % 4];
    let part = [0.005, 0.02, 0.05, 0.1][which % 4] * chance.sign();
    Recipe::new(what, [1.0, 1.0], move |s| {
        vec![Disturbance::sensor(move |_, r| r * (1.0 + s * part))]
    })
}
