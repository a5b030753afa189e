//! The simulation of the paper's section 4.2 over 200 seeds, and what the corrected equations claim.

use errsep_models::fourier::{
    Combination, Compensation, FourierSimulation, Scan, Section, Separation, mean_deviation,
    mean_harmonic_deviation, separate, simulate, straightness,
};
use realfft::num_complex::Complex64;

const SECTION: Section = Section {
    length: 100.0,
    orders: 30,
};

fn run(scans: &[Scan], compensation: Compensation, combination: Combination) -> Separation {
    separate(scans, SECTION, compensation, combination, Some(2.0)).unwrap()
}

/// Coefficients of the true profile: the mean over the grid of f e^{−jωθ}.
fn spectrum(f: &[f64]) -> Vec<Complex64> {
    let n = f.len() as f64;
    (1..=30)
        .map(|w| {
            f.iter()
                .enumerate()
                .map(|(k, v)| {
                    let angle = -std::f64::consts::TAU * (w * k) as f64 / n;
                    v * Complex64::from_polar(1.0, angle)
                })
                .sum::<Complex64>()
                / n
        })
        .collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

/// d_sp and D_h of the three single spacings, the hybrid and the least-squares combination.
fn deviations(samples: usize, seed: u64) -> [(f64, f64); 5] {
    let what = FourierSimulation {
        samples,
        ..FourierSimulation::default()
    };
    let (scans, truth) = simulate(&what, seed).unwrap();
    let actual = straightness(&truth.x, &truth.workpiece);
    let actual_spectrum = spectrum(&truth.workpiece);
    let figures = |s: Separation| {
        let f: Vec<Complex64> = s.orders.iter().map(|o| o.coefficient).collect();
        (
            mean_deviation(&straightness(&s.x, &s.workpiece), &actual),
            mean_harmonic_deviation(&f, &actual_spectrum),
        )
    };
    let none = Compensation::None;
    [
        figures(run(&scans[..1], none, Combination::LeastSquares)),
        figures(run(&scans[1..2], none, Combination::LeastSquares)),
        figures(run(&scans[2..], none, Combination::LeastSquares)),
        figures(run(&scans, none, Combination::Hybrid)),
        figures(run(&scans, none, Combination::LeastSquares)),
    ]
}

/// A row of the fixture: the three single spacings, the hybrid, the least-squares combination.
fn expected(samples: usize, figure: &str) -> [f64; 5] {
    let start = format!("{samples},{figure},");
    let row = include_str!("../../../fixtures/fourier/expected.csv")
        .lines()
        .find_map(|line| line.strip_prefix(&start))
        .unwrap();
    let values: Vec<f64> = row.split(',').map(|v| v.parse().unwrap()).collect();
    values.try_into().unwrap()
}

fn table(samples: usize) {
    let seeds = 200;
    let (d_sp, d_h) = (expected(samples, "d_sp"), expected(samples, "D_h"));
    let runs: Vec<[(f64, f64); 5]> = (0..seeds).map(|s| deviations(samples, s)).collect();
    for column in 0..5 {
        let sp = median(runs.iter().map(|r| r[column].0).collect());
        let h = median(runs.iter().map(|r| r[column].1).collect());
        println!("{samples} samples, column {column}: d_sp {sp:.4} D_h {h:.4}");
        // Tolerance: k·u of two medians of 200 seeds each. A single bad order makes the scatter of
        // d = 78.6 about half its median, u = 1.25 · 0.5/√200 · √2 = 6 %; the others a fifth of it.
        let k_u = if column == 2 { 0.18 } else { 0.08 };
        assert!(
            (sp / d_sp[column] - 1.0).abs() < k_u,
            "{sp} {}",
            d_sp[column]
        );
        assert!((h / d_h[column] - 1.0).abs() < k_u, "{h} {}", d_h[column]);
    }
    let ratio = |part: fn(&(f64, f64)) -> f64| {
        median(
            runs.iter()
                .map(|r| part(&r[3]) / r[..3].iter().map(part).fold(f64::INFINITY, f64::min))
                .collect(),
        )
    };
    let (sp, h) = (ratio(|p| p.0), ratio(|p| p.1));
    println!("{samples} samples: hybrid over best single {sp:.3} {h:.3}");
    // Tolerance: the published range widened by k·u of a median ratio, 0.02.
    assert!((0.43..0.50).contains(&sp), "{sp}");
    assert!((0.55..0.61).contains(&h), "{h}");
    let wins = runs
        .iter()
        .filter(|r| r[..3].iter().all(|single| r[3].0 < single.0))
        .count();
    assert!(wins as f64 >= 0.97 * seeds as f64, "{wins} of {seeds}");
    let gain = median(runs.iter().map(|r| r[4].0 / r[3].0).collect());
    println!("{samples} samples: least squares over hybrid {gain:.3}");
    assert!((0.70..0.80).contains(&gain), "{gain}");
}

#[test]
fn table_1_with_200_samples() {
    table(200);
}

#[test]
fn table_1_with_500_samples() {
    table(500);
}

#[test]
fn table_1_with_1000_samples() {
    table(1000);
}

#[test]
fn noise_gains_of_the_combinations() {
    let gain = |spacings: &[f64], combination: Combination| {
        let what = FourierSimulation {
            spacings: spacings.to_vec(),
            samples: 100,
            ..FourierSimulation::default()
        };
        let (scans, _) = simulate(&what, 0).unwrap();
        let s = run(&scans, Compensation::None, combination);
        (s.orders.iter().map(|o| o.gain * o.gain).sum::<f64>() / 30.0).sqrt()
    };
    // Tolerance: half a unit of the last digit of the theory page.
    for (spacings, combination, expected, half) in [
        (&[48.5][..], Combination::LeastSquares, 1.44, 5.1e-3),
        (&[34.1], Combination::LeastSquares, 1.70, 5.1e-3),
        (&[78.6], Combination::LeastSquares, 8.19, 5.1e-3),
        (&[48.5, 34.1, 78.6], Combination::Hybrid, 0.597, 5.1e-4),
        (
            &[48.5, 34.1, 78.6],
            Combination::LeastSquares,
            0.445,
            5.1e-4,
        ),
    ] {
        let found = gain(spacings, combination);
        assert!((found - expected).abs() < half, "{spacings:?} {found}");
    }
}

fn exact(what: FourierSimulation) -> (Vec<Scan>, Vec<f64>, Vec<f64>, Vec<f64>) {
    let what = FourierSimulation { noise: 0.0, ..what };
    let (scans, truth) = simulate(&what, 3).unwrap();
    (scans, truth.x, truth.workpiece, truth.slide)
}

fn greatest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn without_tilt_and_noise_the_profile_is_exact_with_the_corrected_sign() {
    for third_probe in [true, false] {
        let (scans, x, workpiece, slide) = exact(FourierSimulation {
            slope: 0.0,
            spacings: vec![34.1],
            third_probe,
            step: if third_probe {
                (40.0, 105.0)
            } else {
                (0.0, 0.0)
            },
            ..FourierSimulation::default()
        });
        let s = run(&scans, Compensation::None, Combination::LeastSquares);
        // Tolerance: 30 µm of signal, divided by the least transfer 0.14: 1e-12 is 20 epsilons of it.
        let error = greatest(&s.workpiece, &workpiece);
        assert!(error < 1e-12, "{third_probe} {error:e}");
        assert!(greatest(&straightness(&x, &s.slide), &straightness(&x, &slide)) < 1e-12);
    }
}

#[test]
fn the_chord_leaves_no_ramp_to_cut_off() {
    // A tilted workpiece, 50 µm height difference: equation (20) keeps the ramp, whose cut-off series
    // rings at the ends; the chord does not, and the rise is given beside it.
    let (scans, x, workpiece, _) = exact(FourierSimulation {
        slope: 5.0,
        spacings: vec![34.1],
        height_difference: 50.0,
        ..FourierSimulation::default()
    });
    let straight = straightness(&x, &workpiece);
    let chord = run(&scans, Compensation::Chord, Combination::LeastSquares);
    let error = greatest(&straightness(&x, &chord.workpiece), &straight);
    assert!(error < 1e-10, "{error}");
    let rise = std::f64::consts::TAU * 5.0;
    // Tolerance: epsilons of 50 µm.
    assert!((chord.rise.unwrap() - rise).abs() < 1e-11);
    assert!((chord.height_difference.unwrap() - 50.0).abs() < 1e-11);
    let level = run(&scans, Compensation::Level, Combination::LeastSquares);
    let ringing = greatest(&straightness(&x, &level.workpiece), &straight);
    assert!(ringing > 5.0, "{ringing}");
    let uncompensated = run(&scans, Compensation::None, Combination::LeastSquares);
    assert!(greatest(&straightness(&x, &uncompensated.workpiece), &straight) > ringing);
}

#[test]
fn uncompensated_height_difference_is_a_ramp_cut_off_at_30_orders() {
    // Figures of the theory page for the paper's workpiece, line removed: mean 0.70, greatest 23.6 µm.
    let (scans, x, workpiece, _) = exact(FourierSimulation {
        spacings: vec![34.1],
        height_difference: 50.0,
        ..FourierSimulation::default()
    });
    let s = run(&scans, Compensation::None, Combination::LeastSquares);
    let (found, actual) = (straightness(&x, &s.workpiece), straightness(&x, &workpiece));
    let (mean, max) = (mean_deviation(&found, &actual), greatest(&found, &actual));
    println!("uncompensated: mean {mean:.3} max {max:.2}");
    // Tolerance: half a unit of the last digit.
    assert!((mean - 0.70).abs() < 5.1e-3, "{mean}");
    assert!((max - 23.6).abs() < 0.051, "{max}");
}

#[test]
fn predicted_uncertainty_meets_the_scatter_of_200_seeds() {
    let what = FourierSimulation {
        samples: 200,
        slope: 0.0,
        height_difference: 20.0,
        ..FourierSimulation::default()
    };
    for compensation in [Compensation::None, Compensation::Chord] {
        let what = FourierSimulation {
            height_difference: if compensation == Compensation::None {
                0.0
            } else {
                20.0
            },
            ..what.clone()
        };
        let (mut sum, mut predicted) = (vec![0.0; 200], vec![0.0; 200]);
        for seed in 0..200 {
            let (scans, truth) = simulate(&what, seed).unwrap();
            let s = run(&scans, compensation, Combination::LeastSquares);
            for k in 0..200 {
                sum[k] += (s.workpiece[k] - truth.workpiece[k]).powi(2) / 200.0;
                predicted[k] = s.workpiece_std[k].powi(2);
            }
        }
        // Tolerance: the mean of 200 positions of variances known to 10 % each, about 40 of them
        // independent: k·u = 3 · 0.1/√40 = 5 %.
        let ratio = sum.iter().sum::<f64>() / predicted.iter().sum::<f64>();
        println!("{compensation:?}: variance found over predicted {ratio:.3}");
        assert!((ratio - 1.0).abs() < 0.06, "{compensation:?} {ratio}");
    }
}

#[test]
fn noise_is_estimated_from_spacings_and_from_repeats() {
    let what = FourierSimulation {
        samples: 400,
        ..FourierSimulation::default()
    };
    let (scans, _) = simulate(&what, 1).unwrap();
    let found = |scans: &[Scan]| {
        separate(
            scans,
            SECTION,
            Compensation::None,
            Combination::Hybrid,
            None,
        )
        .unwrap()
        .noise
        .0
    };
    // Tolerance: k·u = 3 · 2/√(2·120) for 120 degrees of freedom, 3 · 2/√(2·1200) for the repeats.
    assert!((found(&scans) - 2.0).abs() < 0.39);
    let (scans, _) = simulate(&FourierSimulation { repeats: 2, ..what }, 1).unwrap();
    assert!((found(&scans) - 2.0).abs() < 0.13);
}

#[test]
fn lost_orders_are_named() {
    let (scans, _, _, _) = exact(FourierSimulation {
        spacings: vec![25.0],
        slope: 0.0,
        ..FourierSimulation::default()
    });
    let s = run(&scans, Compensation::None, Combination::LeastSquares);
    assert_eq!(s.lost, vec![4, 8, 12, 16, 20, 24, 28]);
}
