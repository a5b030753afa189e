//! Tilts, closure slope and forms of the simultaneous fit: white, correlated and shifted noise, stated or
//! not, one repeat and four, few and many knots, fewer channels, and readings that the model does not fit.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::noise::Law;
use errsep_models::reversal::simulate::{Plan, TrueForm, Truth, simulate};
use errsep_models::reversal::simultaneous::{Knots, Noise, Options, Thickness, fit};
use errsep_models::reversal::{Channel, Observations};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::tally::{Row, Tally};

const LENGTH_MM: f64 = 300.0;
const THICKNESS_MM: f64 = 42.0;
const NOISE_UM: f64 = 0.05;
/// Where the bands of the forms are looked at, as shares of the range.
const LOOKED_AT: [f64; 5] = [0.0, 0.11, 0.37, 0.63, 1.0];

/// What is measured.
struct Case {
    name: &'static str,
    positions: usize,
    repeats: u32,
    /// Standard deviations of the white and the correlated part (over 15 mm) and of the shift, µm.
    noise: [f64; 3],
    /// Of each channel, relative.
    channels: [f64; 4],
    read: &'static [Channel],
    stated: bool,
    /// Cells of the true forms; waves that no spline is where zero.
    cells: usize,
    /// Cells of the fit; chosen from the data where zero.
    knots: usize,
    /// A taper, µrad.
    taper: f64,
    /// Uneven steps between positions.
    jitter: f64,
    /// By how much the slide runs elsewhere in each pass: correlated over 60 mm, and a line at its ends, µm.
    slide: [f64; 2],
}

/// Wavelength of the longest wave, mm, and how many there are, amplitudes as the squares of the wavelengths.
const LONGEST_MM: f64 = 450.0;
const WAVES: usize = 12;

const ALL: &[Channel] = &Channel::ALL;

const BASE: Case = Case {
    name: "",
    positions: 61,
    repeats: 1,
    noise: [NOISE_UM, 0.0, 0.0],
    channels: [1.0; 4],
    read: ALL,
    stated: false,
    cells: 10,
    knots: 10,
    taper: 0.0,
    jitter: 0.0,
    slide: [0.0; 2],
};

const CASES: &[Case] = &[
    Case {
        name: "white",
        ..BASE
    },
    Case {
        name: "white, noise stated",
        stated: true,
        ..BASE
    },
    Case {
        name: "white, knots chosen",
        knots: 0,
        ..BASE
    },
    Case {
        name: "white, waves, knots chosen",
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "white, waves, 31 positions, knots chosen",
        positions: 31,
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "white, waves, 2 channels, knots chosen",
        read: &[Channel::C1A, Channel::C2B],
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "4 repeats, white and correlated, waves, knots chosen",
        repeats: 4,
        noise: [NOISE_UM, NOISE_UM, 0.0],
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "white, one channel 10 times as noisy",
        positions: 151,
        channels: [1.0, 10.0, 1.0, 1.0],
        ..BASE
    },
    Case {
        name: "white, 4 positions, 1 cell",
        positions: 4,
        cells: 1,
        knots: 1,
        ..BASE
    },
    Case {
        name: "white, 8 positions, 5 cells",
        positions: 8,
        cells: 1,
        knots: 5,
        ..BASE
    },
    Case {
        name: "white, 61 positions, 58 cells",
        knots: 58,
        ..BASE
    },
    Case {
        name: "white, 600 positions, 120 cells",
        positions: 600,
        cells: 20,
        knots: 120,
        ..BASE
    },
    Case {
        name: "white, 3 channels",
        read: &[Channel::C1A, Channel::C1B, Channel::C2A],
        ..BASE
    },
    Case {
        name: "white, 2 channels",
        read: &[Channel::C1A, Channel::C2B],
        ..BASE
    },
    Case {
        name: "white, 1 channel",
        read: &[Channel::C1A],
        ..BASE
    },
    Case {
        name: "taper of 0.5 µrad",
        taper: 0.5,
        ..BASE
    },
    Case {
        name: "taper of 5 µrad",
        taper: 5.0,
        ..BASE
    },
    Case {
        name: "forms finer than the knots: 20 cells, fitted with 8",
        cells: 20,
        knots: 8,
        ..BASE
    },
    Case {
        name: "4 repeats, white",
        repeats: 4,
        ..BASE
    },
    Case {
        name: "4 repeats, white and correlated",
        repeats: 4,
        noise: [NOISE_UM, NOISE_UM, 0.0],
        ..BASE
    },
    Case {
        name: "4 repeats, white and shifts",
        repeats: 4,
        noise: [NOISE_UM, 0.0, NOISE_UM],
        ..BASE
    },
    Case {
        name: "4 repeats, white and correlated, uneven steps",
        repeats: 4,
        noise: [NOISE_UM, NOISE_UM, 0.0],
        jitter: 1.5,
        ..BASE
    },
    Case {
        name: "4 repeats, white and correlated, taper of 5 µrad",
        repeats: 4,
        noise: [NOISE_UM, NOISE_UM, 0.0],
        taper: 5.0,
        ..BASE
    },
    Case {
        name: "4 repeats, each zeroed anew by 3 µm, knots chosen",
        repeats: 4,
        noise: [NOISE_UM, 0.0, 3.0],
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "4 repeats, the slide elsewhere in each pass, knots chosen",
        repeats: 4,
        slide: [3.0 * NOISE_UM, 0.0],
        cells: 0,
        knots: 0,
        ..BASE
    },
    Case {
        name: "4 repeats, the slide askew in each pass",
        repeats: 4,
        slide: [0.0, 6.0 * NOISE_UM],
        ..BASE
    },
    Case {
        name: "1 repeat, white and correlated (assumed white)",
        noise: [NOISE_UM, NOISE_UM, 0.0],
        ..BASE
    },
];

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows: Vec<Row> = CASES.iter().flat_map(|case| case.rows(seeds)).collect();
    for channels in 1..=4 {
        for cells in [1, 12] {
            rows.push(knots_scanned(channels, cells, seeds / 20));
        }
    }
    rows
}

/// The first tilt over designs of 4 to 600 positions with 0.2 to 3 times as many knots, forms in the
/// splines' space (one cell) or not.
fn knots_scanned(channels: usize, cells: usize, seeds: u64) -> Row {
    let (mut tally, mut refused, mut answered) = (Tally::default(), 0, 0);
    for positions in [4, 6, 10, 25, 61, 150, 600] {
        for share in [0.2, 0.5, 0.8, 0.95, 1.2, 3.0] {
            let case = Case {
                positions,
                knots: ((share * positions as f64) as usize).max(1),
                cells,
                read: &ALL[..channels],
                ..BASE
            };
            let found: Vec<_> = (0..seeds.max(4))
                .into_par_iter()
                .map(|seed| case.one(seed))
                .collect();
            for found in found {
                match found.as_ref().and_then(|f| f.first()) {
                    Some((_, own)) => {
                        tally = tally.and(*own);
                        answered += 1;
                    }
                    None => refused += 1,
                }
            }
        }
    }
    let inside = if cells == 1 { "in" } else { "outside" };
    Row {
        case: format!(
            "knots 0.2 to 3 × positions, 4 to 600 positions, {channels} channels, forms {inside} the splines' space; {refused} refused"
        ),
        quantity: "first tilt".to_owned(),
        seeds: answered,
        tally,
    }
}

impl Case {
    fn rows(&self, seeds: u64) -> Vec<Row> {
        // Cases with many positions take fewer seeds, at least 400.
        let seeds = (seeds * 61 / (self.positions as u64).max(61)).max(seeds.min(400));
        let found: Vec<Vec<(String, Tally)>> = (0..seeds)
            .into_par_iter()
            .filter_map(|seed| self.one(seed))
            .collect();
        let mut rows: Vec<Row> = Vec::new();
        for (name, tally) in found.iter().flatten() {
            match rows.iter_mut().find(|r| r.quantity == *name) {
                Some(row) => {
                    row.tally = row.tally.and(*tally);
                    row.seeds += 1;
                }
                None => rows.push(Row {
                    case: self.name.to_owned(),
                    quantity: name.clone(),
                    seeds: 1,
                    tally: *tally,
                }),
            }
        }
        rows
    }

    fn one(&self, seed: u64) -> Option<Vec<(String, Tally)>> {
        let (observations, truth) = self.data(seed)?;
        let options = Options {
            thickness: Thickness::Known(THICKNESS_MM),
            noise: if self.stated {
                Noise::Declared(NOISE_UM)
            } else {
                Noise::Estimated
            },
            knots: match self.knots {
                0 => Knots::Chosen,
                cells => Knots::Cells(cells),
            },
            ..Options::default()
        };
        let solution = fit(&observations, &options).ok()?;
        let mut found = Vec::new();
        let tilts = solution.tilts();
        // The command prints one figure for all angles: the fewest.
        let freedom = tilts
            .iter()
            .map(|t| t.degrees_of_freedom)
            .fold(f64::INFINITY, f64::min);
        let true_tilts = [truth.alpha_rad, truth.beta_rad, truth.gamma_rad];
        for tilt in &tilts {
            let value: f64 = tilt
                .combination
                .coefficients
                .iter()
                .zip(true_tilts)
                .map(|(c, t)| c * t)
                .sum();
            // Two traces cannot tell a taper from a tilt.
            found.push((
                tilt.name.clone(),
                counted(tilt.angle.value - value, tilt.angle.std, freedom),
            ));
        }
        if let Some(closure) = &solution.closure
            && let Some(slope) = closure.slope
        {
            let error = slope.value - 1e-6 * self.taper;
            let own = closure.degrees_of_freedom;
            found.push(("closure".to_owned(), counted(error, slope.std, own)));
        }
        let x: Vec<f64> = LOOKED_AT.iter().map(|share| share * LENGTH_MM).collect();
        let profiles = solution.forms(&x);
        let freedom = profiles
            .iter()
            .map(|p| p.degrees_of_freedom)
            .fold(f64::INFINITY, f64::min);
        let forms = [("M", &truth.m), ("S_A", &truth.s_a), ("S_B", &truth.s_b)];
        let mut tally = Tally::default();
        for profile in &profiles {
            let Some((_, form)) = forms.iter().find(|(name, _)| *name == profile.name) else {
                continue;
            };
            for ((x, value), std) in profile.x.iter().zip(&profile.values).zip(&profile.std) {
                tally.add(value - form.at(*x), *std, freedom);
            }
        }
        if profiles.iter().any(|p| forms.iter().any(|f| f.0 == p.name)) {
            found.push(("forms".to_owned(), tally));
        }
        Some(found)
    }

    /// Readings without noise from the exact geometry, noise of the law on top.
    fn data(&self, seed: u64) -> Option<(Observations, Truth)> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let basis = CubicBSpline::uniform(0.0, LENGTH_MM, self.cells.max(1)).ok()?;
        let mut plan = Plan::even(0.0, LENGTH_MM, self.positions, 0.0);
        for form in [&mut plan.m, &mut plan.s_a, &mut plan.s_b] {
            *form = match self.cells {
                0 => TrueForm::random_waves(&mut random, 1.0, LONGEST_MM, WAVES),
                _ => TrueForm::random_spline(&mut random, basis.clone(), 1.0),
            };
        }
        (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (40e-6, 0.0, -150e-6);
        plan.tau_rad = 1e-6 * self.taper;
        plan.thickness_mm = THICKNESS_MM;
        plan.repeats = self.repeats;
        plan.seed = seed;
        plan.traces.retain(|t| self.read.contains(&t.channel));
        if self.jitter > 0.0 {
            let last = self.positions - 1;
            for trace in &mut plan.traces {
                for (k, x) in trace.positions.iter_mut().enumerate() {
                    if k > 0 && k < last {
                        *x += self.jitter * (((k * 7919) % 13) as f64 / 6.0 - 1.0);
                    }
                }
            }
        }
        let (mut observations, truth) = simulate(&plan, &[]).ok()?;
        let [white, correlated, shift] = self.noise.map(|s| s * s);
        let law = Law {
            white,
            correlated,
            length: 15.0,
            shift,
            drift: 0.0,
        };
        for channel in self.read {
            let factor = self.channels[channel.index()];
            for repeat in 1..=self.repeats {
                let own: Vec<usize> = (0..observations.readings.len())
                    .filter(|i| {
                        let r = &observations.readings[*i];
                        r.channel == *channel && r.repeat == repeat
                    })
                    .collect();
                let x: Vec<f64> = own.iter().map(|i| observations.readings[*i].x).collect();
                let mut noise = vec![0.0; x.len()];
                law.draw(&x, &mut random, &mut noise);
                for (i, e) in own.iter().zip(noise) {
                    observations.readings[*i].value += factor * e;
                }
            }
        }
        self.move_slide(&mut observations, &mut random);
        Some((observations, truth))
    }

    /// What the slide does anew in each pass, which both indicators read from opposite sides.
    fn move_slide(&self, observations: &mut Observations, random: &mut ChaCha8Rng) {
        let [correlated, line] = self.slide;
        if correlated <= 0.0 && line <= 0.0 {
            return;
        }
        let law = Law {
            white: 0.0,
            correlated: correlated * correlated,
            length: 60.0,
            shift: 0.0,
            drift: (2.0 * line / LENGTH_MM).powi(2),
        };
        let x: Vec<f64> = (0..self.positions)
            .map(|k| LENGTH_MM * k as f64 / (self.positions - 1) as f64)
            .collect();
        for channels in [[Channel::C1A, Channel::C1B], [Channel::C2A, Channel::C2B]] {
            for repeat in 1..=self.repeats {
                let mut moved = vec![0.0; x.len()];
                law.draw(&x, random, &mut moved);
                let readings = observations.readings.iter_mut();
                for r in readings.filter(|r| channels.contains(&r.channel) && r.repeat == repeat) {
                    let at = x.partition_point(|p| *p < r.x - 1e-9);
                    r.value += r.channel.indicator_sign() * moved[at];
                }
            }
        }
    }
}

fn counted(error: f64, std: f64, freedom: f64) -> Tally {
    let mut tally = Tally::default();
    tally.add(error, std, freedom);
    tally
}
