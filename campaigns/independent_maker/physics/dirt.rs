//! Dirt and scratches that some passes meet and others do not.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::{Disturbance, Moment};

/// A bump or a scratch in one channel, in one repeat of it, or from a moment on.
pub fn bump(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    let channel = chance.pick(4);
    let repeat = 1 + chance.pick(4) as u32;
    let at = chance.between(0.08, 0.92) * facts.length;
    let width = chance.log_between(2.0, 15.0) * facts.spacing;
    let from = {
        let part = chance.between(0.2, 0.7);
        let second = facts.turn[1] + part * (facts.end - facts.turn[1]);
        if channel < 2 {
            part * facts.turn[0]
        } else {
            second
        }
    };
    let what = [
        "grain in one channel",
        "flat scratch in one channel",
        "chip in one repeat",
        "grain or pit in one repeat",
        "dirt that stays from then on",
    ][which % 5];
    let met = move |m: &Moment| {
        m.channel() == channel
            && match which % 5 {
                0 | 1 => true,
                2 | 3 => m.repeat == repeat,
                _ => m.time >= from,
            }
    };
    let recipe = Recipe::new(what, [1.0, 1000.0], move |height| {
        vec![Disturbance::surface(move |m, u| {
            if !met(m) {
                return 0.0;
            }
            let t = (u - at) / width;
            let shape = match which % 5 {
                1 => ((0.75 - t.abs()) * 8.0).clamp(0.0, 1.0),
                2 => (1.0 - t.abs()).max(0.0),
                _ => (-t * t / 2.0).exp(),
            };
            let way = if which % 5 == 1 { -1.0 } else { sign };
            way * height * shape
        })]
    });
    if matches!(which % 5, 0 | 3 | 4) {
        recipe.sized(1.0, "µm")
    } else {
        recipe
    }
}
