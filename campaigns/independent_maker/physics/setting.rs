//! How the artefact is set after the spindle has been turned.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::Disturbance;

/// The artefact stands elsewhere along the slide in the second spindle position.
pub fn reversal_shift(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let sign = chance.sign();
    let tilt = 1e-5 * chance.normal();
    let (what, parts, with_tilt) = [
        ("shifted once", [0.0, 1.0], false),
        ("half back, half forth", [-0.5, 0.5], false),
        (
            "shifted before the first position was measured",
            [-1.0, 0.0],
            false,
        ),
        ("shifted and re-clamped a little oblique", [0.0, 1.0], true),
    ][which % 4];
    Recipe::new(what, [0.3, 8.0], move |d| {
        let mut all = vec![Disturbance::axial(move |m| sign * d * parts[m.position])];
        if with_tilt {
            all.push(Disturbance::turn(
                move |m| if m.position == 1 { tilt } else { 0.0 },
            ));
        }
        all
    })
    .sized(1.0, "mm")
}

/// The spindle turns by 180° and a little more: what the artefact's tilt across the plane puts into it
/// is one more angle in the second position.
pub fn indexing(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let what = ["half a degree", "a degree", "two degrees", "five degrees"][which % 4];
    let error = [0.5_f64, 1.0, 2.0, 5.0][which % 4].to_radians() * chance.sign();
    let across = chance.log_between(1e-5, 2e-3);
    Recipe::new(what, [1.0, 1.0], move |s| {
        vec![Disturbance::turn(move |m| {
            if m.position == 1 {
                s * across * error.sin()
            } else {
                0.0
            }
        })]
    })
}
