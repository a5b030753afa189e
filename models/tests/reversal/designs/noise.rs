//! Repeats that are zeroed anew and drift, and channels of different noise, in readings made by the formulas below.

use errsep_models::reversal::Direction;
use errsep_models::reversal::designs::{
    Design, DesignFit, DesignObservations, DesignOptions, DesignReading, fit,
};
use errsep_models::reversal::simultaneous::Knots;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const QUARTERS: &str = "0/0,0/90,0/180,0/270";
const TRAVEL: f64 = 300.0;
const POSITIONS: usize = 41;
/// α_h + τ, rad.
const SLOPE: f64 = 60e-6;

/// How the repeats of a trace differ.
#[derive(Clone, Copy)]
struct Made {
    repeats: u32,
    /// Standard deviation of a reading, µm: of the second channel and of the others.
    noise: [f64; 2],
    /// Of the zeros, µm.
    zero: f64,
    /// Of what a trace drifts along its travel, µm.
    drift: f64,
}

fn solved(made: &Made, seed: u64) -> DesignFit {
    let design = Design::parse(QUARTERS).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut readings = Vec::new();
    for repeat in 1..=made.repeats {
        for channel in 0..design.channels().len() {
            let zero = made.zero * normal();
            let drift = made.drift * normal();
            let noise = made.noise[usize::from(channel != 1)];
            for k in 0..POSITIONS {
                let part = k as f64 / (POSITIONS - 1) as f64;
                let x = TRAVEL * part;
                // Over the positions a whole wave of the cosine has no slope.
                let form = 2.0 * (std::f64::consts::TAU * part).cos();
                let value = form + 1e3 * SLOPE * x + zero + drift * (part - 0.5) + noise * normal();
                readings.push(DesignReading {
                    channel,
                    repeat,
                    direction: Direction::Forward,
                    time: None,
                    x,
                    value,
                });
            }
        }
    }
    let options = DesignOptions {
        knots: Knots::Cells(6),
        ..DesignOptions::default()
    };
    fit(&DesignObservations { design, readings }, &options).unwrap()
}

/// k·u: a drift of each repeat by a line of its own is in the uncertainty of slopes, and in that of no form.
#[test]
fn slopes_beside_repeats_that_drift_are_as_sure_as_they_say() {
    let made = Made {
        repeats: 4,
        noise: [0.1; 2],
        zero: 3.0,
        drift: 1.0,
    };
    let seeds = 30;
    let (mut squares, mut of_form) = (0.0, 0.0);
    for seed in 0..seeds {
        let found = solved(&made, seed);
        let slopes = found.slopes();
        let slope = slopes.iter().find(|s| s.name == "alpha_h + cone").unwrap();
        squares += ((slope.value.value - SLOPE) / slope.value.std).powi(2);
        of_form += found.forms(&[150.0])[0].std[0];
    }
    let rms = (squares / seeds as f64).sqrt();
    // Three standard deviations of a root mean square of thirty: 3/√60; without drifts in the law it is 2.5.
    assert!(rms < 1.39 && rms > 0.5, "{rms}");
    // Four repeats of 0.1 µm, 41 positions for nine unknowns: 0.023 µm. As misfit drifts would make it 0.06.
    let of_form = of_form / seeds as f64;
    assert!(of_form < 0.035, "{of_form}");
}

/// Zeros set anew are no reason to doubt the channels that are quiet: each has its own noise.
#[test]
fn a_noisy_channel_beside_zeros_leaves_the_others_sure() {
    let made = Made {
        repeats: 3,
        noise: [1.0, 0.05],
        zero: 3.0,
        drift: 0.0,
    };
    let (mut squares, mut largest, seeds) = (0.0, 0.0_f64, 10);
    for seed in 0..seeds {
        let found = solved(&made, seed);
        // Of the first channel alone.
        let forms = found.forms(&[150.0]);
        let form = forms.iter().find(|f| f.name == "M_h + S_0").unwrap();
        largest = largest.max(form.std[0]);
        // The cosine at half the travel, less its mean over the positions, of which both ends are one.
        squares += ((form.values[0] + 2.0 + 2.0 / POSITIONS as f64) / form.std[0]).powi(2);
        // Shifts of 3 µm are told as such, not as 20 times that by the noisy channel's scale.
        assert!(found.noise_um < 8.0, "{}", found.noise_um);
    }
    // Three repeats of 0.05 µm, 41 positions for nine unknowns: 0.015 µm.
    assert!(largest < 0.04, "{largest}");
    // k·u: the root mean square of ten is known to 0.22; what six cells cut off a cosine is below a fifth of u.
    assert!((squares / seeds as f64).sqrt() < 1.7, "{squares}");
}
