//! Mounts that grow with their temperature.

use std::f64::consts::TAU;

use super::{Facts, Recipe};
use crate::chance::Chance;
use crate::rig::Disturbance;

/// Each indicator stands on a body of its own: how far it has grown after a step of temperature.
pub fn drift(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let sign = chance.sign();
    let whole = facts.end;
    let tau = chance.log_between(0.1, 0.8) * whole;
    let slow = chance.between(2.5, 6.0) * tau;
    let fast = chance.log_between(0.04, 0.15) * whole;
    let lag = chance.between(0.05, 0.2) * whole;
    // How far each body grows; how it gets there.
    let (what, parts) = [
        ("both nearly alike", [0.92, 1.03]),
        ("one against the other", [0.85, -0.28]),
        ("near mount, evenly", [1.0, 0.0]),
        ("two bodies under each mount", [1.0, 0.6]),
        ("far mount, two bodies against each other", [0.15, 1.0]),
        ("the air goes up slowly, the mounts follow", [0.7, -1.0]),
    ][which % 6];
    let grown = move |t: f64, tau: f64| if t > 0.0 { 1.0 - (-t / tau).exp() } else { 0.0 };
    Recipe::new(what, [0.2, 100.0], move |s| {
        vec![Disturbance::mount(move |m| {
            let course = match which % 6 {
                2 => m.time / whole,
                3 => 0.5 * grown(m.time, fast) + 0.7 * grown(m.time, slow),
                4 => 1.2 * grown(m.time, fast) - 0.8 * grown(m.time, slow),
                5 => (m.time.max(0.0) - lag * grown(m.time, lag)) / whole,
                _ => grown(m.time, tau),
            };
            sign * s * parts[m.indicator] * course
        })]
    })
}

/// The hall's temperature comes and goes.
pub fn cycle(which: usize, chance: &mut Chance, facts: &Facts) -> Recipe {
    let period = facts.end / chance.log_between(1.0, 8.0);
    let phase = chance.between(0.0, TAU);
    let late = chance.between(0.5, 2.0);
    let (what, parts) = [
        ("both mounts alike", [1.0, 1.0]),
        ("one against the other", [1.0, -1.0]),
        ("near mount alone", [1.0, 0.0]),
        ("far mount more and later", [0.4, 1.0]),
        ("a thermostat, both mounts", [1.0, 0.7]),
    ][which % 5];
    Recipe::new(what, [0.2, 100.0], move |s| {
        vec![Disturbance::mount(move |m| {
            let own = if which % 5 == 3 && m.indicator == 1 {
                late
            } else {
                0.0
            };
            let angle = TAU * m.time / period + phase - own;
            let wave = if which % 5 == 4 {
                // The heater on and off: a slightly rounded triangle.
                (0.97 * angle.sin()).asin() / 1.33
            } else {
                angle.sin()
            };
            s * parts[m.indicator] * wave
        })]
    })
}
