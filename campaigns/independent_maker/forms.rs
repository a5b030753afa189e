//! Forms of slides and surfaces, as making leaves them: broken lines that a stylus of finite width
//! rounds, steps of segments, wander, lapped faces with plateaus, edges.

use crate::chance::Chance;

/// A profile, µm over mm, known on a fine grid and straight between its points.
#[derive(Debug, Clone)]
pub struct Form {
    values: Vec<f64>,
    /// A straight line beneath them: µm at x = 0, µm/mm.
    line: [f64; 2],
}

/// Rounds in which ends are laid on the line that they move.
const ROUNDS: usize = 4;

/// Distance of the grid's points, mm.
const PITCH: f64 = 0.05;
/// How far a form reaches beyond the measured travel at either end, mm.
const BEYOND: f64 = 40.0;

impl Form {
    /// The profile at a place, µm; beyond its ends that of the end.
    pub fn at(&self, x: f64) -> f64 {
        let line = self.line[0] + self.line[1] * x;
        let Some(last) = self.values.len().checked_sub(2) else {
            return line;
        };
        let place = ((x + BEYOND) / PITCH).max(0.0);
        let k = (place.floor() as usize).min(last);
        let part = (place - k as f64).min(1.0);
        line + self.values[k] * (1.0 - part) + self.values[k + 1] * part
    }

    /// One of the kinds, without its straight line over 0 … `length`, of a given root mean square.
    pub fn drawn(chance: &mut Chance, length: f64, rms: f64) -> Self {
        let form = match chance.pick(4) {
            0 => broken(chance, length),
            1 => steps(chance, length),
            2 => wander(chance, length),
            _ => lapped(chance, length),
        };
        form.levelled(length, rms)
    }

    /// The form without its straight line against the commanded positions, each weighted by the width of
    /// its cell; of a position the form is taken at the places that are touched there.
    pub fn without_line(mut self, touched: &[[f64; 2]]) -> Self {
        let mut sorted = touched.to_vec();
        sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut at: Vec<f64> = sorted.iter().map(|pair| pair[0]).collect();
        at.dedup();
        let n = at.len();
        if n < 3 {
            return self;
        }
        // The end cells reach as far beyond the last position as they do before it.
        let width = |k: usize| match k {
            0 => at[1] - at[0],
            k if k == n - 1 => at[k] - at[k - 1],
            k => (at[k + 1] - at[k - 1]) / 2.0,
        };
        let whole: f64 = (0..n).map(width).sum();
        let middle = (0..n).map(|k| width(k) * at[k]).sum::<f64>() / whole;
        let (mut level, mut moment, mut spread) = (0.0, 0.0, 0.0);
        for (k, cell) in sorted.chunk_by(|a, b| a[0] == b[0]).enumerate() {
            let seen = cell.iter().map(|pair| self.at(pair[1])).sum::<f64>() / cell.len() as f64;
            let t = at[k] - middle;
            level += width(k) * seen / whole;
            moment += width(k) * t * seen;
            spread += width(k) * t * t;
        }
        let slope = moment / spread;
        self.line[0] -= level - slope * middle;
        self.line[1] -= slope;
        self
    }

    /// The same with both ends on that line, by polynomials of the second and third degree that have none.
    pub fn ended_on_line(mut self, touched: &[[f64; 2]], ends: [f64; 2]) -> Self {
        let [middle, half] = [(ends[0] + ends[1]) / 2.0, (ends[1] - ends[0]) / 2.0];
        for _ in 0..ROUNDS {
            self = self.without_line(touched);
            let [low, high] = ends.map(|x| self.at(x));
            let (even, odd) = ((low + high) / 2.0, (high - low) / 2.0);
            for (k, value) in self.values.iter_mut().enumerate() {
                let t = (place(k) - middle) / half;
                *value -= even * (1.5 * t * t - 0.5) + odd * (2.5 * t * t - 1.5) * t;
            }
        }
        self.without_line(touched)
    }

    /// The form with a texture finer than most spacings of readings.
    pub fn roughened(mut self, chance: &mut Chance, length: f64, rms: f64) -> Self {
        let mut texture: Vec<f64> = self.values.iter().map(|_| 0.0).collect();
        let every = (1.0 / PITCH) as usize;
        let mut level = 0.0;
        for (k, value) in texture.iter_mut().enumerate() {
            if k % every == 0 {
                level = chance.normal();
            }
            *value = level;
        }
        let texture = of(averaged(&texture, 2.0)).levelled(length, rms);
        for (value, more) in self.values.iter_mut().zip(&texture.values) {
            *value += more;
        }
        self
    }

    /// The form with one edge, that spreads over `width` mm.
    pub fn edged(mut self, chance: &mut Chance, length: f64, height: f64, width: f64) -> Self {
        let at = chance.between(0.2, 0.8) * length;
        for (k, value) in self.values.iter_mut().enumerate() {
            *value += height * ((place(k) - at) / width).clamp(-0.5, 0.5);
        }
        self
    }

    /// Without the straight line over 0 … `length`, scaled to a root mean square there.
    fn levelled(mut self, length: f64, rms: f64) -> Self {
        let inside = |k: usize| (0.0..=length).contains(&place(k));
        let middle = length / 2.0;
        let (mut n, mut mean, mut moment, mut spread) = (0.0, 0.0, 0.0, 0.0);
        for (k, value) in self.values.iter().enumerate().filter(|(k, _)| inside(*k)) {
            let t = place(k) - middle;
            n += 1.0;
            mean += value;
            moment += t * value;
            spread += t * t;
        }
        let (mean, slope) = (mean / n, moment / spread);
        let mut square = 0.0;
        for (k, value) in self.values.iter_mut().enumerate() {
            *value -= mean + slope * (place(k) - middle);
            if inside(k) {
                square += *value * *value / n;
            }
        }
        let scale = rms / square.sqrt().max(1e-12);
        self.values.iter_mut().for_each(|value| *value *= scale);
        self
    }
}

/// Where the k-th point lies, mm.
fn place(k: usize) -> f64 {
    k as f64 * PITCH - BEYOND
}

/// How many points a form has.
fn points(length: f64) -> usize {
    ((length + 2.0 * BEYOND) / PITCH) as usize + 1
}

fn of(values: Vec<f64>) -> Form {
    Form {
        values,
        line: [0.0; 2],
    }
}

fn tabulated(length: f64, form: impl Fn(f64) -> f64) -> Form {
    of((0..points(length)).map(|k| form(place(k))).collect())
}

/// Mean over a width, mm, as a stylus or a straight-edge of that width sees it.
fn averaged(values: &[f64], width: f64) -> Vec<f64> {
    let half = (width / PITCH / 2.0) as usize;
    let mut sums = vec![0.0];
    for value in values {
        sums.push(sums.last().copied().unwrap_or(0.0) + value);
    }
    (0..values.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(half), (k + half + 1).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

/// Straight pieces between a few corners, rounded by a stylus of finite width.
fn broken(chance: &mut Chance, length: f64) -> Form {
    let corners = 5 + chance.pick(6);
    let mut knots: Vec<(f64, f64)> = (0..corners)
        .map(|_| (chance.between(0.0, length), chance.normal()))
        .collect();
    knots.push((-BEYOND, chance.normal()));
    knots.push((length + BEYOND, chance.normal()));
    knots.sort_by(|a, b| a.0.total_cmp(&b.0));
    let line = tabulated(length, |x| {
        let k = knots
            .partition_point(|knot| knot.0 <= x)
            .clamp(1, knots.len() - 1);
        let ((a, y), (b, z)) = (knots[k - 1], knots[k]);
        y + (z - y) * (x - a) / (b - a).max(1e-9)
    });
    let width = chance.between(6.0, 20.0);
    of(averaged(&averaged(&line.values, width), width / 2.0))
}

/// Segments that meet at slightly different heights, each joint scraped over some length.
fn steps(chance: &mut Chance, length: f64) -> Form {
    let joints: Vec<(f64, f64, f64, bool)> = (0..4 + chance.pick(6))
        .map(|_| {
            let at = chance.between(-0.05, 1.05) * length;
            (
                at,
                chance.normal(),
                chance.between(8.0, 50.0),
                chance.happens(0.5),
            )
        })
        .collect();
    tabulated(length, |x| {
        joints
            .iter()
            .map(|(at, height, width, sharp)| {
                let t = (x - at) / width;
                height * if *sharp { t.tanh() } else { t.atan() }
            })
            .sum()
    })
}

/// A random walk, as wear leaves it, rounded by what bridges it.
fn wander(chance: &mut Chance, length: f64) -> Form {
    let mut level = 0.0;
    let mut values: Vec<f64> = (0..points(length))
        .map(|_| {
            level += chance.normal();
            level
        })
        .collect();
    let width = chance.between(10.0, 35.0);
    for _ in 0..3 {
        values = averaged(&values, width);
    }
    of(values)
}

/// A lapped face: low powers of the position and a few plateaus where it stood proud.
fn lapped(chance: &mut Chance, length: f64) -> Form {
    let powers: Vec<f64> = (2..6).map(|_| chance.normal()).collect();
    let plateaus: Vec<[f64; 4]> = (0..2 + chance.pick(3))
        .map(|_| {
            let from = chance.between(-0.1, 0.9) * length;
            let wide = chance.between(0.08, 0.3) * length;
            [
                from,
                from + wide,
                0.5 * chance.normal(),
                chance.between(4.0, 12.0),
            ]
        })
        .collect();
    tabulated(length, |x| {
        let t = 2.0 * x / length - 1.0;
        let smooth: f64 = powers
            .iter()
            .zip(2..)
            .map(|(c, power)| c * t.clamp(-1.2, 1.2).powi(power))
            .sum();
        let proud: f64 = plateaus
            .iter()
            .map(|[from, to, height, edge]| {
                height * (((x - from) / edge).tanh() - ((x - to) / edge).tanh()) / 2.0
            })
            .sum();
        smooth + proud
    })
}
