//! A stylus or a slide that does not follow at once.

use super::{Facts, Recipe};
use crate::chance::{Chance, share};
use crate::rig::{Disturbance, Moment};

/// Lost motion of the pointer: it stands still until the stylus has crossed the play. It is followed
/// from the setting of the indicator on, run-ins included.
pub fn play(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let begin = [chance.between(-0.5, 0.5), chance.between(-0.5, 0.5)];
    let (what, parts) = [
        ("both indicators alike", [1.0, 1.0]),
        ("near indicator alone", [1.0, 0.0]),
        ("far indicator alone", [0.0, 1.0]),
        ("both, by different amounts", [1.0, 0.45]),
    ][which % 4];
    let recipe = Recipe::new(what, [0.2, 20.0], move |width| {
        vec![Disturbance::stylus(move |path, values| {
            let Some(indicator) = path.first().map(|m| m.indicator) else {
                return;
            };
            let half = width * parts[indicator] / 2.0;
            let Some(mut pointer) = values.first().map(|v| v + 2.0 * half * begin[indicator])
            else {
                return;
            };
            for value in values.iter_mut() {
                pointer = pointer.clamp(*value - half, *value + half);
                *value = pointer;
            }
        })]
    });
    if which % 4 == 3 {
        recipe
    } else {
        recipe.sized(1.0, "µm")
    }
}

/// Friction that holds and lets go.
pub fn stick_slip(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let lot = chance.lot();
    let stride = chance.between(0.04, 0.15) * facts.length;
    match which % 4 {
        0 => Recipe::new("near plunger sticks", [0.2, 20.0], |s| {
            vec![sticking(s, [true, false])]
        }),
        1 => Recipe::new("both plungers stick", [0.2, 20.0], |s| {
            vec![sticking(s, [true, true])]
        }),
        2 => Recipe::new("slide crabs while it sticks", [0.2, 50.0], move |s| {
            vec![Disturbance::slide(move |m, x| {
                m.direction * s * sawtooth(m, x, stride, lot)
            })]
        }),
        _ => Recipe::new("slide lags while it sticks", [0.5, 10.0], move |s| {
            vec![Disturbance::place(move |m| {
                -m.direction * s * sawtooth(m, m.x, stride, lot)
            })]
        }),
    }
}

/// From 0 to 1 along each stride, which begins elsewhere in every pass.
fn sawtooth(moment: &Moment, x: f64, stride: f64, lot: u64) -> f64 {
    (moment.direction * x / stride + share(lot, moment.pass())).rem_euclid(1.0)
}

/// A plunger that stays until it is off by `hold`, then goes all the way.
fn sticking(hold: f64, which: [bool; 2]) -> Disturbance {
    Disturbance::stylus(move |path, values| {
        if !path.first().is_some_and(|m| which[m.indicator]) {
            return;
        }
        let Some(mut pointer) = values.first().copied() else {
            return;
        };
        for value in values.iter_mut() {
            if (*value - pointer).abs() > hold {
                pointer = *value;
            }
            *value = pointer;
        }
    })
}
