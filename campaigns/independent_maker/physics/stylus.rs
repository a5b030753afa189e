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

/// A plunger that sticks in its bushing.
pub fn sticking_plunger(which: usize, _: &mut Chance, _: &Facts) -> Recipe {
    let (what, parts) = [
        ("near plunger sticks", [1.0, 0.0]),
        ("both plungers stick alike", [1.0, 1.0]),
        ("far plunger sticks", [0.0, 1.0]),
        ("both plungers stick, by different amounts", [0.5, 1.0]),
    ][which % 4];
    let recipe = Recipe::new(what, [0.2, 20.0], move |hold| {
        vec![sticking(parts.map(|part| part * hold))]
    });
    if which % 4 == 3 {
        recipe
    } else {
        recipe.sized(1.0, "µm")
    }
}

/// A slide that its drive holds and lets go.
pub fn stick_slip(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let lot = chance.lot();
    let stride = chance.between(0.04, 0.15) * facts.length;
    match which % 2 {
        0 => Recipe::new("slide crabs while it sticks", [0.2, 50.0], move |s| {
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

/// Plungers of the near and the far indicator that stay until they are off by a hold, then go all the way.
fn sticking(holds: [f64; 2]) -> Disturbance {
    Disturbance::stylus(move |path, values| {
        let Some(hold) = path.first().map(|m| holds[m.indicator]) else {
            return;
        };
        let Some(mut pointer) = values.first().copied().filter(|_| hold > 0.0) else {
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
