//! One case: a rig, its forms and noise, and the error sources at sizes that show as much as wanted.

use errsep_models::reversal::{Channel, Direction, Observations, Reading};

use crate::chance::Chance;
use crate::design::{Count, Design, Schedule};
use crate::forms::Form;
use crate::noise::{Law, Noise};
use crate::physics::{Facts, Recipe, Source};
use crate::projection::true_gap;
use crate::rig::{Disturbance, Rig};

/// What a case is made from; the same again gives the same readings.
pub struct Order<'a> {
    /// Names the random numbers, with the seed.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// The sources, each with its realisation.
    pub sources: Vec<(&'a Source, usize)>,
    /// The law of noise.
    pub law: Law,
    /// Where readings are taken.
    pub design: Design,
    /// How many.
    pub count: Count,
}

/// A source as it was put in.
pub struct Truth {
    /// Its name.
    pub name: &'static str,
    /// Its realisation in words.
    pub what: &'static str,
    /// What of it shows on the shared grid, µm.
    pub visible: f64,
    /// Its size with its unit, where a catalogue may state it in the same sense.
    pub size: Option<(f64, &'static str)>,
    /// What it changes by itself in each reading of each trace, µm.
    pub change: Vec<Vec<f64>>,
}

/// Readings with what is known of them.
pub struct Case {
    /// The readings.
    pub observations: Observations,
    /// The same measurement without noise and without sources.
    pub undisturbed: Observations,
    /// Where and when they are taken.
    pub schedule: Schedule,
    /// What the sources change in each reading of each trace, µm.
    pub change: Vec<Vec<f64>>,
    /// Thickness of the artefact, mm, where the set-up states it.
    pub thickness: Option<f64>,
    /// The noise.
    pub noise: Noise,
    /// What was put in.
    pub truths: Vec<Truth>,
    /// √(RSS₀/ν) of what was put in, under this design, µm.
    pub gap: f64,
}

/// Least and greatest visible root mean square, in standard deviations of a reading.
const VISIBLE: [f64; 2] = [0.7, 3.0];
/// How near the visible part comes to what is wanted.
const CLOSE: f64 = 0.003;

/// Makes a case.
pub fn made(order: &Order) -> Case {
    let mut chance = Chance::of(&order.name, order.seed);
    let tilted = order.sources.iter().any(|(source, _)| source.tilted);
    let sigma = chance.log_between(0.02, 0.2);
    let rig = rig(&mut chance, tilted, order.law, sigma);
    let shared = Schedule::shared(&mut chance, rig.length, order.count);
    let rig = rig.levelled(&shared, &[]);
    let bare = rig.readings(&shared, &[]);
    let facts = facts(&rig, &shared, &bare);
    let mut noise = Noise::drawn(order.law, sigma, &mut chance);
    let recipes: Vec<(&Source, Recipe, f64)> = order
        .sources
        .iter()
        .map(|(source, which)| {
            let recipe = (source.recipe)(*which, &mut chance, &facts);
            (*source, recipe, chance.log_between(VISIBLE[0], VISIBLE[1]))
        })
        .collect();
    let shows = |recipe: &Recipe, size: f64| {
        let with = rig.readings(&shared, &(recipe.make)(size));
        true_gap(&shared, &difference(&with, &bare))
    };
    // Where as much as is possible does not show so far above the noise, the noise is less.
    for (_, recipe, wanted) in recipes.iter().filter(|(source, ..)| !source.absorbed) {
        let size = sized(recipe, wanted * noise.sigma, |size| shows(recipe, size));
        let visible = shows(recipe, size);
        if visible < wanted * noise.sigma * (1.0 - 2.0 * CLOSE) {
            let less = visible / wanted / noise.sigma;
            noise.sigma *= less;
            noise.resolution *= less;
        }
    }
    let mut truths = Vec::new();
    let mut sources: Vec<Disturbance> = Vec::new();
    let mut alone: Vec<Vec<Disturbance>> = Vec::new();
    for (source, recipe, wanted) in &recipes {
        let size = if source.absorbed {
            1.0
        } else {
            sized(recipe, wanted * noise.sigma, |size| shows(recipe, size))
        };
        sources.extend((recipe.make)(size));
        alone.push((recipe.make)(size));
        truths.push(Truth {
            name: source.name,
            what: recipe.what,
            visible: shows(recipe, size),
            size: recipe.size.as_ref().map(|(of, unit)| (of(size), *unit)),
            change: Vec::new(),
        });
    }
    let schedule = order.design.of(&shared, &mut chance);
    let rig = rig.levelled(&schedule, &sources);
    let undisturbed = rig.readings(&schedule, &[]);
    let clean = rig.readings(&schedule, &sources);
    let written = noise.upon(&clean, &schedule, &mut chance);
    let change = difference(&clean, &undisturbed);
    for (truth, own) in truths.iter_mut().zip(&alone) {
        truth.change = difference(&rig.readings(&schedule, own), &undisturbed);
    }
    Case {
        observations: observed(&schedule, &written),
        undisturbed: observed(&schedule, &undisturbed),
        thickness: (!tilted).then_some(rig.thickness),
        noise,
        truths,
        gap: true_gap(&schedule, &change),
        schedule,
        change,
    }
}

/// A rig as it may stand in any shop.
fn rig(chance: &mut Chance, tilted: bool, law: Law, sigma: f64) -> Rig {
    let length = chance.between(180.0, 420.0);
    let surface = chance.log_between(0.4, 4.0);
    let mut form = |rms: f64| {
        let form = Form::drawn(chance, length, rms);
        if law != Law::RoughForms {
            form
        } else if chance.happens(0.5) {
            let rough = chance.between(0.5, 3.0) * sigma;
            form.roughened(chance, length, rough)
        } else {
            let (height, width) = (chance.between(3.0, 10.0) * sigma, chance.between(8.0, 12.0));
            form.edged(chance, length, height, width)
        }
    };
    let slide = form(surface * 1.3);
    let surfaces = [form(surface), form(surface * 0.8)];
    let mut tilt = || {
        let size = if tilted {
            chance.log_between(1e-3, 8e-3)
        } else {
            chance.log_between(1e-5, 3e-4)
        };
        size * chance.sign()
    };
    let (alpha, gamma) = (tilt(), tilt());
    Rig {
        length,
        thickness: if tilted {
            0.0
        } else {
            chance.between(15.0, 90.0)
        },
        slide,
        surfaces,
        alpha,
        gamma,
        zero_at: if chance.happens(0.7) {
            length / 2.0
        } else {
            0.0
        },
        zero: [(); 4].map(|()| chance.normal()),
    }
}

fn facts(rig: &Rig, schedule: &Schedule, bare: &[Vec<f64>]) -> Facts {
    let of = |indicator: usize| {
        schedule
            .traces
            .iter()
            .zip(bare)
            .filter(move |(trace, _)| trace.indicator == indicator)
            .flat_map(|(_, values)| values.iter().copied())
    };
    let span = |k| of(k).fold(f64::NEG_INFINITY, f64::max) - of(k).fold(f64::INFINITY, f64::min);
    let reach = |k| of(k).fold(0.0, |most: f64, r| most.max(r.abs()));
    Facts {
        length: rig.length,
        spacing: schedule.spacing,
        turn: schedule.turn,
        end: schedule.end,
        span: [span(0), span(1)],
        reach: [reach(0), reach(1)],
        surfaces: rig.surfaces.clone(),
    }
}

/// The size of which `wanted` shows, or the greatest that is possible.
fn sized(recipe: &Recipe, wanted: f64, shows: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, recipe.start.min(recipe.most));
    for _ in 0..24 {
        if shows(high) >= wanted || high >= recipe.most {
            break;
        }
        low = high;
        high = (2.0 * high).min(recipe.most);
    }
    let top = shows(high);
    if top <= wanted {
        return high;
    }
    // The secant of what shows, kept between the limits; halving where it does not serve.
    let mut at_high = top;
    let mut at_low = if low > 0.0 { shows(low) } else { 0.0 };
    for round in 0..30 {
        let secant = low + (high - low) * (wanted - at_low) / (at_high - at_low).max(1e-12);
        let middle = if round % 3 == 2 {
            (low + high) / 2.0
        } else {
            secant
        };
        let value = shows(middle);
        if (value / wanted - 1.0).abs() < CLOSE {
            return middle;
        }
        if value < wanted {
            (low, at_low) = (middle, value);
        } else {
            (high, at_high) = (middle, value);
        }
    }
    high
}

fn difference(with: &[Vec<f64>], without: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let one = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a - b).collect();
    with.iter().zip(without).map(one).collect()
}

/// Readings as a file holds them.
fn observed(schedule: &Schedule, values: &[Vec<f64>]) -> Observations {
    let mut readings = Vec::new();
    for (trace, values) in schedule.traces.iter().zip(values) {
        for (moment, value) in trace.moments().zip(values) {
            readings.push(Reading {
                channel: Channel::ALL[moment.channel()],
                repeat: moment.repeat,
                direction: if moment.direction > 0.0 {
                    Direction::Forward
                } else {
                    Direction::Backward
                },
                time: Some(moment.time),
                x: moment.x,
                value: *value,
            });
        }
    }
    Observations { readings }
}
