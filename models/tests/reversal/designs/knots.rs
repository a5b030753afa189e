//! Knots of each form's own.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{
    Design, DesignFit, DesignOptions, central_differences, fit,
};
use errsep_models::reversal::simultaneous::Noise;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";
const THIRDS: &str = "0/0,120/0,240/0,0/120,120/120,240/120,0/240,120/240,240/240";

/// A slide with waves and a straight bar.
fn plan(design: &str, seed: u64) -> DesignPlan {
    DesignPlan {
        slopes_rad: [2e-4, -1.5e-4, 3e-4, 1e-4, 2.5e-4, 0.0, 0.0],
        thickness_mm: 40.0,
        noise_um: 0.05,
        forms_um: [3.0, 0.0],
        positions: 121,
        seed,
        ..DesignPlan::of(Design::parse(design).unwrap())
    }
}

fn options(alike: bool) -> DesignOptions {
    DesignOptions {
        thickness_mm: 40.0,
        alike,
        ..DesignOptions::default()
    }
}

fn cells(fit: &DesignFit, of: &str) -> Vec<usize> {
    let all = fit.cells().into_iter();
    all.filter(|(name, _)| name.starts_with(of))
        .map(|c| c.1)
        .collect()
}

/// A straight bar on a wavy slide takes fewer cells than the slide; its forms are better for it, and the
/// errors of all forms are as large as their standard uncertainties.
#[test]
fn each_form_takes_the_knots_it_needs() {
    let (mut own_errors, mut alike_errors) = (0.0, 0.0);
    let (mut squares, mut count) = (0.0, 0.0);
    for seed in 0..8 {
        let made = plan(EIGHT, seed);
        let (readings, truth) = simulate(&made).unwrap();
        let found = fit(&readings, &options(false)).unwrap();
        let alike = fit(&readings, &options(true)).unwrap();
        let (slide, sides) = (cells(&found, "M"), cells(&found, "S"));
        let most = sides.iter().max().unwrap();
        assert!(slide.iter().all(|m| m > most), "{slide:?} {sides:?}");
        let together = cells(&alike, "");
        assert!(together.iter().all(|k| *k == together[0]), "{together:?}");
        let x = [30.0, 90.0, 150.0, 210.0, 270.0];
        for (own, other) in found.forms(&x).iter().zip(&alike.forms(&x)) {
            let form = match own.side {
                None if own.name == "M_h" => &truth.slide[0],
                None => &truth.slide[1],
                Some(side) => {
                    let at = readings.design.sides().iter().position(|s| *s == side);
                    &truth.sides[at.unwrap()]
                }
            };
            for k in 0..x.len() {
                let error = own.values[k] - form.at(x[k]);
                squares += (error / own.std[k]).powi(2);
                count += 1.0;
                if own.side.is_some() {
                    own_errors += error.powi(2);
                    alike_errors += (other.values[k] - form.at(x[k])).powi(2);
                }
            }
        }
    }
    assert!(
        own_errors < 0.6 * alike_errors,
        "{own_errors} {alike_errors}"
    );
    let rms = f64::sqrt(squares / count);
    // k·u: points of a form go together, so that some 100 values count; three standard deviations.
    assert!(
        (rms - 1.0).abs() < 0.25,
        "errors are {rms} times their uncertainty"
    );
}

/// Forms of different knots have the derivatives of central differences, and the tilts their bound.
#[test]
fn different_knots_keep_derivatives_and_bound() {
    for design in [EIGHT, THIRDS] {
        let made = DesignPlan {
            slopes_rad: [2e-2, -1.5e-2, 3e-2, 1e-2, 2.5e-2, 0.0, 0.0],
            forms_um: [200.0, 1.0],
            positions: 61,
            ..plan(design, 5)
        };
        let (readings, _) = simulate(&made).unwrap();
        let own = options(false);
        let found = fit(&readings, &own).unwrap();
        assert!(
            cells(&found, "M")[0] > cells(&found, "S")[0],
            "{:?}",
            found.cells()
        );
        let worst = central_differences(&readings, &own).unwrap();
        // Truncation: central differences with a relative step of 1e-5 on readings of mm.
        assert!(worst < 1e-6, "{design}: {worst}");
    }
    let made = plan(EIGHT, 7);
    let (readings, _) = simulate(&made).unwrap();
    let declared = DesignOptions {
        noise: Noise::Declared(0.05),
        ..options(false)
    };
    let alpha = fit(&readings, &declared).unwrap().slope("alpha_h").unwrap();
    let spread: f64 = made.x().iter().map(|x| (x - 150.0).powi(2)).sum();
    // Truncation: tilts of 3e-4 change a derivative by 1e-7; forms have no line whatever their knots.
    let bound = 0.5 * 0.05e-3 / spread.sqrt();
    assert!((alpha.std / bound - 1.0).abs() < 1e-5, "{alpha:?} {bound}");
}

/// Whether an indicator is zeroed before each trace or not, the forms are the same: what repeats differ by is no noise beside
/// which detail could not be seen.
#[test]
fn a_zero_of_each_repeat_hides_no_detail() {
    let made = DesignPlan {
        forms_um: [1.0, 1.0],
        repeats: 3,
        ..plan(EIGHT, 3)
    };
    let (mut readings, truth) = simulate(&made).unwrap();
    for reading in &mut readings.readings {
        reading.value += 3.0 * f64::from(7 * reading.repeat + 5 * reading.channel as u32).sin();
    }
    let found = fit(&readings, &options(false)).unwrap();
    let x = [30.0, 90.0, 150.0, 210.0, 270.0];
    let form = found
        .forms(&x)
        .into_iter()
        .find(|f| f.name == "M_h")
        .unwrap();
    for ((x, value), std) in x.iter().zip(&form.values).zip(&form.std) {
        let error = value - truth.slide[0].at(*x);
        // k·u of a form that is known to less than a fifth of the noise.
        assert!(
            error.abs() < 4.0 * std && *std < 0.01,
            "{x}: {error} ± {std}"
        );
    }
}

/// *Limit*: under noise that goes on over some ten readings forms take about as many knots as under white noise of the same size, and
/// no more than twice as many. By a criterion that takes it for white they take eight times as many and more.
#[test]
fn noise_that_goes_on_takes_no_knots() {
    let (mut white, mut correlated) = (0, 0);
    for seed in 0..4 {
        let made = DesignPlan {
            positions: 600,
            noise_um: 0.0,
            ..plan(EIGHT, seed)
        };
        let (exact, _) = simulate(&made).unwrap();
        for (sum, share) in [(&mut white, 0.0_f64), (&mut correlated, 0.7)] {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let mut readings = exact.clone();
            let (mut before, mut channel) = (0.0, usize::MAX);
            for reading in &mut readings.readings {
                // A tenth of what is left of the reading before is forgotten.
                let fresh = normal();
                before = if reading.channel == channel {
                    0.9 * before + 0.19_f64.sqrt() * fresh
                } else {
                    fresh
                };
                channel = reading.channel;
                reading.value += 0.05 * (share.sqrt() * before + (1.0 - share).sqrt() * normal());
            }
            let found = fit(&readings, &options(false)).unwrap();
            *sum += cells(&found, "").iter().sum::<usize>();
        }
    }
    println!("{white} {correlated}");
    assert!(correlated <= 2 * white, "{correlated} {white}");
}
