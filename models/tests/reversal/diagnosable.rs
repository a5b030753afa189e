//! The linearised reversal that the diagnosis judges, against readings in exact geometry.

use errsep_models::model::{FittedModel, Shape};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simulate::{Plan, TrueForm, Wave, simulate};
use errsep_models::reversal::{Channel, Direction, Observations, Reading};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A wave of a form.
fn wave(amplitude: f64, wavelength: f64, phase_rad: f64) -> TrueForm {
    TrueForm::Waves(vec![Wave {
        amplitude,
        wavelength,
        phase_rad,
    }])
}

/// An artefact of 60 mm that stands 8 mrad oblique, without noise.
fn oblique() -> Plan {
    Plan {
        alpha_rad: 5e-4,
        beta_rad: 2e-4,
        gamma_rad: 8e-3,
        thickness_mm: 60.0,
        m: wave(0.5, 70.0, 0.3),
        s_a: wave(0.4, 50.0, 1.1),
        s_b: wave(0.6, 40.0, 2.0),
        ..Plan::even(0.0, 300.0, 301, 0.0)
    }
}

fn linearised(plan: &Plan) -> Linearised {
    let (readings, _) = simulate(plan, &[]).unwrap();
    let assumptions = Assumptions {
        thickness: Some(plan.thickness_mm),
        noise: Some(0.001),
        ..Assumptions::default()
    };
    Linearised::new(&readings, assumptions).unwrap()
}

/// What the exact geometry does is no gap. Tolerance: the points touched lie 0.24 mm apart in the two
/// spindle positions, and the forms are those of their mean: a second difference of it, S″·0.24²/8 of a
/// wave of 0.6 µm over 40 mm, 1.1e-4 µm.
#[test]
fn the_exact_geometry_leaves_no_closure() {
    let plan = oblique();
    let model = linearised(&plan);
    let readings = model.linearised();
    let n = model.positions().len();
    let mut closure = vec![0.0; n];
    for (k, place) in model.places().iter().enumerate() {
        closure[place.cell % n] += model.seat(place).theta[0] * readings[k] / 4.0;
    }
    let middle = 0.5 * (n as f64 - 1.0);
    let mean = closure.iter().sum::<f64>() / n as f64;
    let (product, spread) = (0..n).fold((0.0, 0.0), |(p, s), k| {
        let d = k as f64 - middle;
        (p + d * (closure[k] - mean), s + d * d)
    });
    let left = (0..n)
        .map(|k| (closure[k] - mean - product / spread * (k as f64 - middle)).abs())
        .fold(0.0, f64::max);
    assert!(left < 1.1e-4, "{left} µm");
}

/// The tilts are those of the readings' truth. Tolerance: as above, over the travel.
#[test]
fn the_exact_geometry_leaves_the_tilts() {
    let plan = oblique();
    let model = linearised(&plan);
    let readings = model.linearised();
    let truths = [plan.alpha_rad, plan.beta_rad, plan.gamma_rad];
    for (quantity, truth) in model.quantities().iter().zip(truths) {
        let value = quantity.weights.dot(&readings);
        assert!(
            (value - truth).abs() < 1e-9,
            "{}: {value} for {truth} rad",
            quantity.name
        );
    }
}

/// *Truncation*: what is gathered into cells keeps the line of all positions that were read. Forms are carried to the
/// cells' centres by cubics, which leaves 6·10⁻¹¹ rad here; the lines over the centres themselves are off by 2·10⁻⁹ rad.
#[test]
fn gathered_readings_keep_the_tilts() {
    let plan = Plan {
        repeats: 4,
        both_directions: true,
        ..oblique()
    };
    let model = linearised(&plan);
    assert!(model.gathered.is_some());
    let readings = model.linearised();
    let truths = [plan.alpha_rad, plan.beta_rad, plan.gamma_rad];
    for (quantity, truth) in model.quantities().iter().zip(truths) {
        let off = quantity.weights.dot(&readings) - truth;
        assert!(off.abs() < 3e-10, "{}: {off:e} rad", quantity.name);
    }
}

/// Eight traces of each channel, forward and backward, each on a grid of 2 mm of its own; a chip of 1 µm lies in the
/// third repeat of 1A.
fn on_grids_of_their_own(chip: f64) -> Linearised {
    let mut readings = Vec::new();
    for (c, channel) in Channel::ALL.into_iter().enumerate() {
        for trace in 0..8_u32 {
            let repeat = 1 + trace / 2;
            // Anywhere within a spacing, by the golden ratio.
            let shift = 2.0 * (0.618 * f64::from(8 * c as u32 + trace)).fract();
            readings.extend((0..100).map(|k| {
                let x = 2.0 * f64::from(k) + shift;
                let away = (x - CHIP[0]) / CHIP[1];
                let lies = channel == Channel::C1A && repeat == 3;
                let height = if lies { chip } else { 0.0 };
                Reading {
                    channel,
                    repeat,
                    direction: if trace % 2 == 0 {
                        Direction::Forward
                    } else {
                        Direction::Backward
                    },
                    time: None,
                    x,
                    value: 0.5 * (0.07 * x + c as f64).sin() + height * (-0.5 * away * away).exp(),
                }
            }));
        }
    }
    let assumptions = Assumptions {
        noise: Some(0.05),
        ..Assumptions::default()
    };
    Linearised::new(&Observations { readings }, assumptions).unwrap()
}

/// Place and width of the chip, mm.
const CHIP: [f64; 2] = [90.3, 1.2];

/// *Simulated truth*: the column of a chip in one repeat is what the chip changes in readings that were gathered from grids of
/// each trace's own. Tolerance: 10⁻⁵ of the chip's square; 1.5·10⁻⁷ is left, which the fit that carries the readings takes
/// up of it, and 0.08 where the column is taken at the centres of the cells, up to 1 mm from where the readings were taken.
#[test]
fn a_chip_in_one_repeat_lies_where_it_was_read() {
    let [clean, chipped] = [0.0, 1.0].map(on_grids_of_their_own);
    assert!(chipped.gathered.is_some());
    let effects = chipped.effects();
    let chip = effects.iter().find(|e| e.name() == "local-contamination");
    let chip = chip.unwrap();
    let told = |shape: &Shape| chip.variant_name(&chipped, shape).unwrap();
    let mut shape = (chip.grid(&chipped).into_iter())
        .flat_map(|shape| [chip.relatives(&chipped, &shape), vec![shape]].concat())
        .find(|shape| told(shape) == "Gaussian, channel 1A, repeat 3")
        .unwrap();
    shape.values = vec![CHIP[0], CHIP[1].ln()];
    let change = chipped.linearised() - clean.linearised();
    let [column] = &chip.columns(&chipped, &shape)[..] else {
        panic!("one amplitude")
    };
    let own = column.rows.iter().zip(&column.values);
    let (along, own_square) = own.fold((0.0, 0.0), |(along, square), (row, value)| {
        (along + value * change[*row], square + value * value)
    });
    let square: f64 = column.rows.iter().map(|row| change[*row].powi(2)).sum();
    let left = (square - along * along / own_square) / square;
    assert!(left < 1e-5, "{left}");
}

/// Values less their straight line.
fn less_line<'v>(x: &'v [f64], values: &'v [f64]) -> impl Iterator<Item = f64> + 'v {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (middle, height) = (mean(x), mean(values));
    let moment: f64 = x.iter().zip(values).map(|(x, v)| (x - middle) * v).sum();
    let slope = moment / x.iter().map(|x| (x - middle).powi(2)).sum::<f64>();
    x.iter()
        .zip(values)
        .map(move |(x, v)| v - height - slope * (x - middle))
}

/// *Simulated truth*, twelve seeds, forms of waves down to four spacings: what one indicator adds, half a micrometre of a cubic, is in the closure of
/// readings that were taken at positions of each channel's own and carried to common places; the forms, fine enough to swing between the positions of one
/// channel and another's, take little of it up, and at three places from either end hardly more than elsewhere. Truncation: in the root mean square places are off by 2.8 and
/// 3.1 times the noise of their mean (0.005 µm), as cubics miss some of these waves; by 6.0 and 7.8 times where forms take up what they can.
#[test]
fn what_the_model_misses_is_carried_beside_the_forms() {
    let (n, length, noise) = (150, 300.0, 0.02);
    let (mut all, mut ends, mut places) = (0.0, 0.0, 0);
    for seed in 0..12 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut form = || TrueForm::random_waves(&mut random, 1.0, 60.0, 8);
        let mut plan = Plan {
            m: form(),
            s_a: form(),
            s_b: form(),
            seed,
            repeats: 4,
            ..Plan::even(0.0, length, n, noise)
        };
        for trace in &mut plan.traces {
            for x in &mut trace.positions {
                *x += random.random_range(-0.49..0.49) * length / (n - 1) as f64;
            }
        }
        let missed = |x: f64| 0.5 * (2.0 * x / length - 1.0).powi(3);
        let (mut readings, _) = simulate(&plan, &[]).unwrap();
        for reading in &mut readings.readings {
            if reading.channel == Channel::C1A {
                reading.value += missed(reading.x);
            }
        }
        let model = Linearised::new(&readings, Assumptions::default()).unwrap();
        let x = model.positions();
        let mut closure: Vec<f64> = x.iter().map(|x| -0.25 * missed(*x)).collect();
        for (place, value) in model.places().iter().zip(&model.record().observed) {
            let sign = [1.0, 1.0, -1.0, -1.0][place.channel];
            closure[place.cell % x.len()] += 0.25 * sign * value / 4.0;
        }
        let left = less_line(x, &closure);
        let squares: Vec<f64> = left.map(|v| (v / (0.25 * noise)).powi(2)).collect();
        all += squares.iter().sum::<f64>();
        places += squares.len();
        let at_ends = squares.iter().take(3).chain(squares.iter().rev().take(3));
        ends += at_ends.sum::<f64>();
    }
    let (all, ends) = ((all / places as f64).sqrt(), (ends / 72.0).sqrt());
    assert!(all < 3.6, "{all}");
    assert!(ends < 4.2, "{ends}");
}

/// *Simulated truth*: no channel has readings in a sixth of the travel, and each trace has positions of its own. Nothing is carried over the gap, so the
/// closure of what is carried is noise of its means and what forms of waves of 30 mm and less do between places: 1.6 times the noise, root mean square of six
/// seeds. Where cells lie over the gap it is 2.4 times.
#[test]
fn nothing_is_carried_over_a_gap() {
    let (n, length, noise) = (400, 300.0, 0.02);
    let (mut squares, mut expected) = (0.0, 0.0);
    for seed in 0..6 {
        let mut random = ChaCha8Rng::seed_from_u64(40 + seed);
        let mut form = || TrueForm::random_waves(&mut random, 1.0, 30.0, 8);
        let mut plan = Plan {
            m: form(),
            s_a: form(),
            s_b: form(),
            seed,
            repeats: 2,
            ..Plan::even(0.0, length, n, noise)
        };
        for trace in &mut plan.traces {
            for x in &mut trace.positions {
                *x += random.random_range(-0.49..0.49) * length / (n - 1) as f64;
            }
            trace.positions.retain(|x| !(100.0..150.0).contains(x));
        }
        let (readings, _) = simulate(&plan, &[]).unwrap();
        let model = Linearised::new(&readings, Assumptions::default()).unwrap();
        let x = model.positions();
        assert!(x.iter().all(|x| !(102.0..148.0).contains(x)), "{x:?}");
        let each = model.gathered.as_ref().unwrap().readings_per_cell * 2.0;
        let mut closure = vec![0.0; x.len()];
        for (place, value) in model.places().iter().zip(&model.record().observed) {
            let sign = [1.0, 1.0, -1.0, -1.0][place.channel];
            closure[place.cell % x.len()] += 0.25 * sign * value / 2.0;
        }
        squares += less_line(x, &closure).map(|v| v * v).sum::<f64>();
        expected += x.len() as f64 * (0.5 * noise).powi(2) / each;
    }
    let times = (squares / expected).sqrt();
    assert!(times < 2.0, "{times}");
}
