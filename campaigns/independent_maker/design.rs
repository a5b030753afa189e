//! Which readings are taken, where and when.

use crate::chance::Chance;
use crate::rig::Moment;

/// One place at which the slide stands or passes.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// Commanded position, mm.
    pub x: f64,
    /// Seconds since the first reading.
    pub time: f64,
    /// Whether a reading is taken; a run-in has none.
    pub read: bool,
}

/// One pass of one indicator.
#[derive(Debug, Clone)]
pub struct Trace {
    /// 0 near, 1 far.
    pub indicator: usize,
    /// 0 the spindle at 0°, 1 at 180°.
    pub position: usize,
    /// From 1.
    pub repeat: u32,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// In the order in which they are passed.
    pub stops: Vec<Stop>,
}

impl Trace {
    /// The circumstances of a stop.
    pub fn moment(&self, stop: &Stop) -> Moment {
        Moment {
            indicator: self.indicator,
            position: self.position,
            repeat: self.repeat,
            direction: self.direction,
            x: stop.x,
            time: stop.time,
        }
    }

    /// The circumstances of its readings.
    pub fn moments(&self) -> impl Iterator<Item = Moment> {
        self.stops.iter().filter(|s| s.read).map(|s| self.moment(s))
    }
}

/// All passes in the order of time.
#[derive(Debug, Clone)]
pub struct Schedule {
    /// The passes.
    pub traces: Vec<Trace>,
    /// Nominal positions of a pass.
    pub positions: usize,
    /// Travel, mm.
    pub length: f64,
    /// Distance of the nominal positions, mm.
    pub spacing: f64,
    /// Last reading of the first and first reading of the second spindle position, s.
    pub turn: [f64; 2],
    /// Last reading, s.
    pub end: f64,
}

/// How many readings are taken.
#[derive(Debug, Clone, Copy)]
pub struct Count {
    /// Positions of a pass.
    pub positions: usize,
    /// Repeats in each spindle position.
    pub repeats: u32,
    /// Whether each is forward only.
    pub one_way: bool,
}

impl Default for Count {
    fn default() -> Self {
        Self {
            positions: 150,
            repeats: 4,
            one_way: false,
        }
    }
}

/// Unread stops before every pass.
const RUN_IN: usize = 6;

impl Schedule {
    /// Four channels on one even grid, several repeats, both directions; the feed is uneven, both
    /// indicators are read together, the spindle is turned once.
    pub fn shared(chance: &mut Chance, length: f64, count: Count) -> Self {
        let spacing = length / (count.positions - 1) as f64;
        let dwell = chance.log_between(0.4, 3.0);
        let uneven = chance.between(0.05, 0.3);
        let mut clock = 0.0;
        let mut traces = Vec::new();
        let mut turn = [0.0; 2];
        for position in 0..2 {
            for repeat in 1..=count.repeats {
                let directions = if count.one_way {
                    &[1.0][..]
                } else {
                    &[1.0, -1.0]
                };
                for &direction in directions {
                    let slower = 1.0 + 0.15 * chance.normal().clamp(-2.0, 2.0);
                    let stops = pass(
                        chance,
                        count.positions,
                        [direction, spacing, dwell * slower, uneven],
                        &mut clock,
                    );
                    for indicator in 0..2 {
                        traces.push(Trace {
                            indicator,
                            position,
                            repeat,
                            direction,
                            stops: stops.clone(),
                        });
                    }
                    clock += chance.between(4.0, 30.0);
                }
            }
            if position == 0 {
                clock += chance.between(90.0, 900.0);
            }
        }
        let start = first(&traces, 0);
        for stop in traces.iter_mut().flat_map(|t| &mut t.stops) {
            stop.time -= start;
        }
        turn[0] = last(&traces, 0);
        turn[1] = first(&traces, 1);
        let end = last(&traces, 1);
        Self {
            traces,
            positions: count.positions,
            length,
            spacing,
            turn,
            end,
        }
    }
}

impl Schedule {
    /// The ends of what all traces have, where their positions are not those of one grid.
    pub fn common_ends(&self) -> Option<[f64; 2]> {
        let read = |trace: &Trace| {
            let mut at: Vec<f64> = trace.moments().map(|moment| moment.x).collect();
            at.sort_by(f64::total_cmp);
            at
        };
        let grids: Vec<Vec<f64>> = self.traces.iter().map(read).collect();
        let mut distinct = grids.concat();
        distinct.sort_by(f64::total_cmp);
        // The same position is worked out from either end.
        distinct.dedup_by(|a, b| (*a - *b).abs() < 1e-6 * self.spacing);
        let one = distinct.len() <= self.positions;
        let low = grids.iter().filter_map(|at| at.first().copied());
        let high = grids.iter().filter_map(|at| at.last().copied());
        let ends = [
            low.fold(f64::NEG_INFINITY, f64::max),
            high.fold(f64::INFINITY, f64::min),
        ];
        (!one && ends[0] < ends[1]).then_some(ends)
    }
}

fn first(traces: &[Trace], position: usize) -> f64 {
    times(traces, position).fold(f64::INFINITY, f64::min)
}

fn last(traces: &[Trace], position: usize) -> f64 {
    times(traces, position).fold(f64::NEG_INFINITY, f64::max)
}

fn times(traces: &[Trace], position: usize) -> impl Iterator<Item = f64> {
    traces
        .iter()
        .filter(move |t| t.position == position)
        .flat_map(|t| t.stops.iter().filter(|s| s.read).map(|s| s.time))
}

/// One pass with its run-in.
fn pass(
    chance: &mut Chance,
    positions: usize,
    [direction, spacing, dwell, uneven]: [f64; 4],
    clock: &mut f64,
) -> Vec<Stop> {
    let mut stops = Vec::with_capacity(positions + RUN_IN);
    for k in 0..positions + RUN_IN {
        let along = (k as f64 - RUN_IN as f64) * spacing;
        let x = if direction > 0.0 {
            along
        } else {
            (positions - 1) as f64 * spacing - along
        };
        stops.push(Stop {
            x,
            time: *clock,
            read: k >= RUN_IN,
        });
        *clock += dwell * (uneven * chance.normal()).exp();
        if chance.happens(0.005) {
            *clock += 20.0 * dwell;
        }
    }
    stops
}

/// How readings differ from one even grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// One grid for all.
    Shared,
    /// Every position off by up to 0.2 mm.
    Jittered,
    /// Every trace's grid shifted by up to half a spacing.
    Shifted,
    /// Every seventh reading or so left out.
    Thinned,
    /// Each channel has its own spacing and its own begin.
    DifferentGrids,
    /// One set of positions for all, each anywhere within its cell.
    Uneven,
    /// Each channel's own set of positions, each anywhere within its cell.
    OwnPositions,
    /// One channel is missing.
    ThreeChannels,
    /// One to four repeats, by channel.
    UnequalRepeats,
}

impl Design {
    /// All with their names on the command line.
    pub const ALL: [(&'static str, Self); 9] = [
        ("shared", Self::Shared),
        ("jittered", Self::Jittered),
        ("shifted", Self::Shifted),
        ("thinned", Self::Thinned),
        ("different-grids", Self::DifferentGrids),
        ("uneven", Self::Uneven),
        ("own-positions", Self::OwnPositions),
        ("three-channels", Self::ThreeChannels),
        ("unequal-repeats", Self::UnequalRepeats),
    ];

    /// The schedule of this design in place of that on the shared grid.
    pub fn of(self, shared: &Schedule, chance: &mut Chance) -> Schedule {
        let mut schedule = shared.clone();
        let (length, spacing) = (shared.length, shared.spacing);
        match self {
            Self::Shared => {}
            Self::Jittered => each_stop(&mut schedule, |stop| stop.x += chance.between(-0.2, 0.2)),
            Self::Shifted => {
                for trace in &mut schedule.traces {
                    let shift = chance.between(-0.5, 0.5) * spacing;
                    trace.stops.iter_mut().for_each(|stop| stop.x += shift);
                }
            }
            Self::Thinned => each_stop(&mut schedule, |stop| stop.read &= !chance.happens(0.14)),
            Self::DifferentGrids => {
                let grids: Vec<[f64; 2]> = (0..4)
                    .map(|_| {
                        [
                            chance.between(0.0, 0.04) * length,
                            chance.between(0.9, 0.96),
                        ]
                    })
                    .collect();
                for trace in &mut schedule.traces {
                    let channel = trace.stops.first().map_or(0, |s| trace.moment(s).channel());
                    let [begin, scale] = grids[channel];
                    trace
                        .stops
                        .iter_mut()
                        .for_each(|stop| stop.x = begin + scale * stop.x);
                }
            }
            Self::Uneven => within_cells(&mut schedule, chance, false),
            Self::OwnPositions => within_cells(&mut schedule, chance, true),
            Self::ThreeChannels => {
                let gone = chance.pick(4);
                schedule
                    .traces
                    .retain(|t| t.moments().next().is_some_and(|m| m.channel() != gone));
            }
            Self::UnequalRepeats => {
                let kept: Vec<usize> = (0..4).map(|_| 2 + chance.pick(3)).collect();
                let kept: Vec<usize> = if kept.iter().all(|k| *k == kept[0]) {
                    vec![2, 4, 3, 4]
                } else {
                    kept
                };
                schedule.traces.retain(|t| {
                    t.moments()
                        .next()
                        .is_some_and(|m| t.repeat as usize <= kept[m.channel()])
                });
            }
        }
        schedule
    }
}

/// Every position moved within its cell, in the same way for all traces or for those of each channel.
fn within_cells(schedule: &mut Schedule, chance: &mut Chance, own: bool) {
    let half = 0.49 * schedule.spacing;
    let moves: [Vec<f64>; 4] = [(); 4].map(|()| {
        let one = |_| chance.between(-half, half);
        (0..schedule.positions).map(one).collect()
    });
    let (spacing, last) = (schedule.spacing, schedule.positions as f64 - 1.0);
    for trace in &mut schedule.traces {
        let channel = trace.stops.first().map_or(0, |s| trace.moment(s).channel());
        let moves = &moves[if own { channel } else { 0 }];
        for stop in &mut trace.stops {
            let cell = (stop.x / spacing).round().clamp(0.0, last) as usize;
            stop.x += moves[cell];
        }
    }
}

fn each_stop(schedule: &mut Schedule, mut change: impl FnMut(&mut Stop)) {
    for trace in &mut schedule.traces {
        trace.stops.iter_mut().for_each(&mut change);
    }
}
