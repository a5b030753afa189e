//! Zeros that jump.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::Disturbance;

/// An indicator jumps in all that it reads from then on, or in one spindle position only, after which
/// it is set to zero again.
pub fn jump(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    let position = chance.pick(2);
    let part = chance.between(0.12, 0.88);
    let within = [
        part * facts.turn[0],
        facts.turn[1] + part * (facts.end - facts.turn[1]),
    ];
    let (what, indicator, until_turn, at) = [
        (
            "near indicator, from then on, in the first position",
            0,
            false,
            within[0],
        ),
        (
            "far indicator, from then on, in the first position",
            1,
            false,
            within[0],
        ),
        (
            "one channel, until it is set anew",
            chance.pick(2),
            true,
            within[position],
        ),
        (
            "an indicator in the second position",
            chance.pick(2),
            false,
            within[1],
        ),
    ][which % 4];
    let turned = facts.turn[1];
    Recipe::new(what, [0.2, 200.0], move |step| {
        vec![Disturbance::mount(move |m| {
            let anew = until_turn && at < turned && m.time >= turned;
            if m.indicator == indicator && m.time >= at && !anew {
                sign * step
            } else {
                0.0
            }
        })]
    })
    .sized(1.0, "µm")
}
