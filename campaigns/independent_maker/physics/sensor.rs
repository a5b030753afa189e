//! Indicators that do not say what their stylus does: wrong gain, curved, periodic.

use std::f64::consts::TAU;

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::Disturbance;

/// Gains that differ between the indicators by a part s.
pub fn gain(which: usize, chance: &mut Chance, _: &Facts) -> Recipe {
    let sign = chance.sign();
    let (what, parts) = [
        ("near indicator alone", [1.0, 0.0]),
        ("far indicator alone", [0.0, -1.0]),
        ("both, opposite", [0.6, -0.4]),
        ("both, the same way", [1.5, 0.5]),
    ][which % 4];
    Recipe::new(what, [0.01, 0.25], move |s| {
        vec![Disturbance::sensor(move |m, r| {
            r * (1.0 + sign * s * parts[m.indicator])
        })]
    })
    // Of the gains only their ratio shows: their difference counts in parts of their mean.
    .sized_by(
        move |s| s / (1.0 + sign * s * (parts[0] + parts[1]) / 2.0),
        "1",
    )
}

/// A curve about the indicator's zero, of either or both.
pub fn curved(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    // Weights of the square and of the cube for the near and the far indicator.
    let (what, weights) = [
        ("near one, square", [[1.0, 0.0], [0.0, 0.0]]),
        ("far one, cube", [[0.0, 0.0], [0.0, 1.0]]),
        (
            "both, square, by different amounts",
            [[1.0, 0.0], [-0.4, 0.0]],
        ),
        ("both, square and cube mixed", [[0.8, 0.5], [0.3, 0.0]]),
        ("near one, a lever's sine", [[0.0, 0.0], [0.0, 0.0]]),
    ][which % 5];
    let reach = facts.reach.map(|r| r.max(1e-3));
    let lever = which % 5 == 4;
    let most = 0.2 * reach[0].min(reach[1]);
    Recipe::new(what, [most / 50.0, most], move |s| {
        vec![Disturbance::sensor(move |m, r| {
            let q = r / reach[m.indicator];
            let [square, cube] = weights[m.indicator];
            let bent = if lever && m.indicator == 0 {
                (1.6 * q).sin() / 1.6 - q
            } else {
                square * q * q + cube * q * q * q
            };
            r + sign * s * bent
        })]
    })
}

/// A period of the indicator's scale, or what its cable picks up of the drive. (A slide that swings by
/// another amount in one spindle position cannot be seen: M and S_A − S_B take it up.)
pub fn cyclic(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let phase = [chance.between(0.0, TAU), chance.between(0.0, TAU)];
    let few = chance.log_between(3.0, 12.0);
    let many = chance.log_between(15.0, 60.0);
    if which % 6 >= 4 {
        return pick_up(
            which % 6 == 5,
            phase,
            facts.length / chance.log_between(3.0, 50.0),
        );
    }
    let (what, parts, cycles) = [
        ("near indicator, few periods", [1.0, 0.0], few),
        ("far indicator, few periods", [0.0, 1.0], few),
        ("far indicator, many periods", [0.0, 1.0], many),
        ("near indicator, many periods", [1.0, 0.0], many),
    ][which % 6];
    let of = usize::from(parts[0] == 0.0);
    let period = facts.span[of].max(1e-3) / cycles;
    let most = 0.7 * period / TAU;
    Recipe::new(what, [most / 4.0, most], move |a| {
        vec![Disturbance::sensor(move |m, r| {
            r + a * parts[m.indicator] * (TAU * r / period + phase[m.indicator]).sin()
        })]
    })
    .sized(1.0, "µm")
}

/// The drive's motor in the cables of both indicators in the second spindle position, or in that of the
/// near one with another phase in each, as the drive is referenced anew.
fn pick_up(near: bool, phase: [f64; 2], period: f64) -> Recipe {
    let wave = move |x: f64, k: usize| (TAU * x / period + phase[k]).sin();
    if near {
        return Recipe::new(
            "drive's pick-up in the near indicator, another phase in each position",
            [0.1, 50.0],
            move |a| {
                vec![Disturbance::mount(move |m| {
                    if m.indicator == 0 {
                        a * wave(m.x, m.position)
                    } else {
                        0.0
                    }
                })]
            },
        );
    }
    Recipe::new(
        "drive's pick-up in both indicators, second position",
        [0.1, 50.0],
        move |a| {
            vec![Disturbance::mount(move |m| {
                if m.position == 1 {
                    a * wave(m.x, 0)
                } else {
                    0.0
                }
            })]
        },
    )
    .sized(1.0, "µm")
}
