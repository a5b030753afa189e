//! A slide that stands or runs elsewhere in one direction than in the other.

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::forms::Form;
use crate::rig::Disturbance;

/// Lost motion along the slide.
pub fn backlash(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    let far = facts.length;
    let (what, parts) = [
        ("half each way", [-0.5, 0.5]),
        ("backward only", [0.0, 1.0]),
        ("forward only", [-1.0, 0.0]),
        ("greater at the worn end of the screw", [-0.5, 0.5]),
    ][which % 4];
    let recipe = Recipe::new(what, [0.3, 8.0], move |b| {
        vec![Disturbance::place(move |m| {
            let worn = if which % 4 == 3 {
                0.6 + 0.8 * m.x / far
            } else {
                1.0
            };
            sign * b * worn * parts[usize::from(m.direction < 0.0)]
        })]
    });
    if which % 4 == 3 {
        recipe
    } else {
        recipe.sized(1.0, "mm")
    }
}

/// A slide that leans to one or the other side of its guide, by the direction of its feed.
pub fn lateral(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    let far = facts.length;
    let form = Form::drawn(chance, far, 1.0);
    let after = chance.between(0.05, 0.2) * far;
    let (what, kind) = [
        ("parallel guide", 0),
        ("another line back than forth", 1),
        ("a gib that is looser at one end", 2),
        ("leans over some way after it turns round", 3),
    ][which % 4];
    Recipe::new(what, [0.2, 100.0], move |s| {
        let form = form.clone();
        vec![Disturbance::slide(move |m, x| {
            let run = if m.direction > 0.0 { x } else { far - x };
            let shape = match kind {
                0 => 1.0,
                1 => form.at(x),
                2 => 0.4 + 1.2 * x / far,
                _ => 1.0 - 2.0 * (-run.max(0.0) / after).exp(),
            };
            sign * s * m.direction / 2.0 * shape
        })]
    })
}
