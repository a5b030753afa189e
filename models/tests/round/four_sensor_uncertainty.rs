//! What a four-sensor separation says of its own errors, against known truths.

use errsep_models::four_sensor::simulate::{Disturbances, Example, Truth, simulate};
use errsep_models::four_sensor::{
    Choice, Geometry, Likeliest, Line, Outputs, Parabola, Penalised, Separator, Settings,
    separate_long,
};
use errsep_models::noise::Law;
use errsep_models::straightness::{ReferenceLine, straightness};
use errsep_models::uncertainty::{DegreesOfFreedom, coverage_factor};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The example of the paper on a surface of cosines with random phases and sizes, the longer the larger.
struct Rough {
    base: Example,
    /// Order, amplitude and phase of each wave.
    waves: Vec<(f64, f64, f64)>,
    /// The slide as a share of the paper's.
    slide: f64,
    /// Coefficient of x² that the slide is made without, µm/mm².
    without: f64,
}

impl Rough {
    /// Waves whose amplitude falls with their order to a power, 5 µm for the first.
    fn new(geometry: &Geometry, power: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let waves = (1..geometry.point_count() / 2)
            .map(|k| {
                (
                    k as f64,
                    5.0 * normal() / (k as f64).powf(power),
                    10.0 * normal(),
                )
            })
            .collect();
        Self {
            base: Example::of(geometry),
            waves,
            slide: 1.0,
            without: 0.0,
        }
    }
}

impl Truth for Rough {
    fn surface(&self, x: f64) -> f64 {
        // One and a half periods more or less: ends that do not meet, as surfaces have them.
        let turn = 0.93 * std::f64::consts::TAU * x / self.base.surface_length;
        self.waves
            .iter()
            .map(|(k, size, phase)| size * (k * turn + phase).cos())
            .sum()
    }
    fn straightness(&self, x: f64) -> f64 {
        self.slide * self.base.straightness(x) - self.without * x * x
    }
    fn tilt(&self, x: f64) -> f64 {
        self.base.tilt(x)
    }
    fn zero_adjustment(&self) -> [f64; 4] {
        self.base.zero_adjustment()
    }
}

/// S, γ and e of a truth as they are stated: no parabola in the surface, which is counted from its end
/// points, and e4 = 0.
struct Stated {
    straightness: DVector<f64>,
    tilt: DVector<f64>,
    zero: [f64; 4],
}

/// The coefficient of x² in the surface, µm/mm².
fn parabola_of_surface(geometry: &Geometry, truth: &impl Truth) -> f64 {
    let at = |n: usize| n as f64 * geometry.step();
    let points = geometry.point_count();
    let powers = DMatrix::from_fn(points, 3, |n, k| at(n).powi(k as i32));
    let surface = DVector::from_fn(points, |n, _| truth.surface(at(n)));
    powers
        .svd(true, true)
        .solve(&surface, 0.0)
        .expect("both sides")[2]
}

fn stated(geometry: &Geometry, truth: &impl Truth) -> Stated {
    let at = |n: usize| n as f64 * geometry.step();
    let points = geometry.point_count();
    let surface = DVector::from_fn(points, |n, _| truth.surface(at(n)));
    let c = parabola_of_surface(geometry, truth);
    let bare = |n: usize| surface[n] - c * at(n).powi(2);
    let b = (bare(points - 1) - bare(0)) / at(points - 1);
    let a = bare(0);
    let places = geometry.positions();
    let zero = truth.zero_adjustment();
    let bent: [f64; 4] = std::array::from_fn(|i| zero[i] + c * places[i].powi(2));
    let level = bent[3] / places[3];
    let count = geometry.output_count();
    Stated {
        straightness: DVector::from_fn(count, |n, _| {
            truth.straightness(at(n)) + a + b * at(n) + c * at(n).powi(2)
        }),
        tilt: DVector::from_fn(count, |n, _| {
            truth.tilt(at(n)) + (b + 2.0 * c * at(n) + level) / 1e3
        }),
        zero: std::array::from_fn(|i| bent[i] - level * places[i]),
    }
}

/// Shares of S, γ, e2 and e3 inside their 95 % intervals over runs.
fn shares<T: Truth>(
    geometry: &Geometry,
    truth: impl Fn(u64) -> T,
    noise: f64,
    choice: Choice,
    runs: u64,
) -> [f64; 3] {
    let separator =
        Separator::new(geometry, Penalised::Profile, Line::EndPoints).expect("well posed");
    let settings = Settings {
        choice,
        ..Settings::default()
    };
    let mut inside = [0; 3];
    for seed in 0..runs {
        let truth = truth(seed);
        let outputs =
            simulate(geometry, &truth, &Disturbances::noise(noise), seed).expect("finite");
        let found = separator.separate(&outputs, &settings).expect("separates");
        let true_ = stated(geometry, &truth);
        let freedom = found
            .degrees_of_freedom
            .unwrap_or(DegreesOfFreedom::Infinite);
        let k = coverage_factor(0.95, freedom).expect("positive");
        let count = |off: &DVector<f64>, std: &DVector<f64>| {
            off.iter()
                .zip(std.iter())
                .filter(|(off, std)| off.abs() <= k * **std)
                .count()
        };
        inside[0] += count(
            &(&found.straightness.values - &true_.straightness),
            &found.straightness.std,
        );
        inside[1] += count(&(&found.tilt.values - &true_.tilt), &found.tilt.std);
        for i in [1, 2] {
            let off = found.zero_adjustment[i] - true_.zero[i];
            inside[2] += usize::from(off.abs() <= k * found.zero_adjustment_std[i]);
        }
    }
    let count = geometry.output_count();
    let values = [count, count, 2].map(|n| (runs * n as u64) as f64);
    std::array::from_fn(|k| 100.0 * inside[k] as f64 / values[k])
}

/// k·u: 95 % intervals hold the truth, by both rules, for the waves of the paper, whose ends lie on the
/// mean line, and for surfaces on which long waves are the largest. Values along one profile are not
/// independent: a profile counts for about six, so that over 150 runs 2.9 % is four standard errors;
/// e2 and e3 are 300 values, three of their standard errors.
#[test]
fn intervals_hold_the_truth() {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).expect("valid");
    for choice in [Choice::LCurve, Choice::Likelihood] {
        for noise in [0.1, 0.3] {
            let found = shares(&geometry, |_| Example::of(&geometry), noise, choice, 150);
            let rough = |seed| Rough::new(&geometry, 0.5, seed);
            let of_rough = shares(&geometry, rough, noise, choice, 150);
            for shares in [found, of_rough] {
                let near = |share: f64, by: f64| (share - 95.0).abs() < by;
                assert!(
                    near(shares[0], 2.9) && near(shares[1], 2.9) && near(shares[2], 3.8),
                    "{choice:?} {noise}: {found:?} {of_rough:?}"
                );
            }
        }
    }
}

/// Spacings of five steps each: what repeats every five steps is seen alike by all sensors. The outputs
/// do not change with it (epsilons), it is listed, and the uncertainties hold for surfaces that have as
/// much of it as of anything else (k·u, as above).
#[test]
fn waves_that_no_sensor_tells_apart_are_listed_and_counted() {
    let geometry = Geometry::new(5.0, [5, 5, 5], 54).expect("valid");
    assert_eq!(geometry.invisible_periods(), [25.0, 12.5]);
    let uneven = Geometry::new(5.0, [5, 5, 6], 54).expect("valid");
    assert!(uneven.invisible_periods().is_empty());
    for period in geometry.invisible_periods() {
        let mut truth = Rough::new(&geometry, 0.0, 1);
        truth.waves = vec![(truth.base.surface_length / period / 0.93, 3.0, 0.4)];
        truth.slide = 0.0;
        let quiet = Disturbances::noise(0.0);
        let outputs = simulate(&geometry, &truth, &quiet, 0).expect("finite");
        let plain = simulate(&geometry, &Example::of(&geometry), &quiet, 0).expect("finite");
        for (n, row) in outputs.readings().iter().enumerate() {
            let x = n as f64 * geometry.step();
            let tilt: Vec<f64> = (0..4)
                .map(|i| {
                    row[i]
                        - truth.zero_adjustment()[i]
                        - 1e3 * geometry.positions()[i] * truth.tilt(x)
                })
                .collect();
            assert!(tilt.iter().all(|left| (left - tilt[0]).abs() < 1e-10));
        }
        assert_eq!(plain.readings().len(), outputs.readings().len());
    }
    let found = shares(
        &geometry,
        |seed| Rough::new(&geometry, 0.0, seed),
        0.1,
        Choice::LCurve,
        150,
    );
    assert!((found[0] - 95.0).abs() < 2.9, "{found:?}");
}

/// k·u: the interval of the minimum zone holds the zone of the true S, of a straight slide, of one as
/// straight as its error and of the paper's. Of 100 runs 95 % are 95 with a standard deviation of 2.2; 88
/// is three of them. A straight slide is held by intervals that begin at zero, 97.5 % of them: 93 is
/// three of their standard deviations. Far above the error the interval is that of value ± k·std or
/// wider, as it allows for the least favourable slide of each width: not by more than a fifth, which
/// would hold 98 % (and 800 drawn zones know a 2.5 % point to 7 % of the half width).
#[test]
fn the_zone_of_the_slide_lies_in_its_interval() {
    const RUNS: u64 = 100;
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).expect("valid");
    let separator =
        Separator::new(&geometry, Penalised::Profile, Line::EndPoints).expect("well posed");
    let settings = Settings::default();
    for (slide, least) in [(0.0, 93), (0.025, 88), (1.0, 88)] {
        let (mut inside, mut ratio) = (0, 0.0);
        for seed in 0..RUNS {
            let mut truth = Rough::new(&geometry, 0.5, seed);
            truth.slide = slide;
            truth.without = parabola_of_surface(&geometry, &truth);
            let outputs =
                simulate(&geometry, &truth, &Disturbances::noise(0.1), seed).expect("finite");
            let found = separator.separate(&outputs, &settings).expect("separates");
            let freedom = found
                .degrees_of_freedom
                .unwrap_or(DegreesOfFreedom::Infinite);
            let zone = separator
                .straightness_error(&outputs, &settings, &found, freedom, None)
                .expect("a zone");
            let (low, high) = zone.interval(0.95).expect("a probability");
            let k = coverage_factor(0.95, freedom).expect("positive");
            ratio += (high - low) / (2.0 * k * zone.std) / RUNS as f64;
            let expected = stated(&geometry, &truth).straightness;
            let x = outputs.slide_positions();
            let expected = straightness(&x, expected.as_slice(), ReferenceLine::MinimumZone)
                .expect("a line")
                .error();
            // The zone of a straight line is rounding.
            inside += u32::from(low <= expected.max(1e-9) && expected <= high);
        }
        println!("{slide}: {inside} of {RUNS}, width {ratio:.3}");
        assert!(inside >= least, "{slide}: {inside} of {RUNS}");
        if slide == 1.0 {
            assert!(ratio > 0.93 && ratio < 1.2, "{ratio}");
        }
    }
}

/// *Simulated truth*, 60 runs: noise of which half the variance goes on over four readings, read once. 95 % intervals of the zone and of S held
/// 80 % with noise that is taken as independent (48 of 60, and 80 % of all points); with 95 % 57 of 60 have a standard deviation of 1.7, and 52 is three
/// below. Points of S of one run err together: 88 % of them all.
#[test]
fn noise_that_goes_on_along_the_slide_is_in_the_uncertainty() {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).unwrap();
    let separator = Separator::new(&geometry, Penalised::Profile, Line::EndPoints).unwrap();
    let settings = Settings::default();
    let law = Law {
        correlated: 0.005,
        length: 20.0,
        ..Law::of_white(0.005)
    };
    let (mut zones, mut points, mut told) = (0, 0, 0);
    for seed in 0..60 {
        let mut truth = Rough::new(&geometry, 0.5, seed);
        truth.without = parabola_of_surface(&geometry, &truth);
        let exact = simulate(&geometry, &truth, &Disturbances::noise(0.0), seed).unwrap();
        let x = exact.slide_positions();
        let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
        let noise: [Vec<f64>; 4] = std::array::from_fn(|_| {
            let mut own = vec![0.0; x.len()];
            law.draw(&x, &mut random, &mut own);
            own
        });
        let rows = exact.readings().iter().enumerate();
        let rows = rows.map(|(n, row)| std::array::from_fn(|s| row[s] + noise[s][n]));
        let outputs = Outputs::new(geometry, 0.0, rows.collect()).unwrap();
        let mut found = separator.separate(&outputs, &settings).unwrap();
        let along = separator.count_correlation(&outputs, &settings, &mut found);
        let along = along.unwrap();
        let excess = found.excess.map(|excess| excess.degrees);
        let degrees = excess.or(found.degrees_of_freedom).unwrap();
        told += usize::from(along.is_some());
        let zone = separator
            .straightness_error(&outputs, &settings, &found, degrees, along.as_ref())
            .unwrap();
        let (low, high) = zone.interval(0.95).unwrap();
        let truth = stated(&geometry, &truth).straightness;
        let expected = straightness(&x, truth.as_slice(), ReferenceLine::MinimumZone);
        let expected = expected.unwrap().error();
        zones += u32::from(low <= expected && expected <= high);
        let k = coverage_factor(0.95, degrees).unwrap();
        let s = &found.straightness;
        let held = (0..x.len()).filter(|n| (s.values[*n] - truth[*n]).abs() <= k * s.std[*n]);
        points += held.count();
    }
    let share = points as f64 / (60.0 * 62.0);
    println!("{zones} of 60, points {share:.3}, told {told}");
    assert!(told >= 40, "{told}");
    assert!(zones >= 52 && share > 0.88, "{zones} {share}");
}

/// Five repeats in each of which every sensor drifts along the travel by 0.5 µm beside a noise of 0.1 µm, which the
/// separation adds up: rms of error/u of S was 3.3. Kind: k·u.
#[test]
fn sensors_that_drift_within_a_repeat_are_in_the_uncertainty() {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).unwrap();
    let truth = Rough::new(&geometry, 0.3, 5);
    let line = Line::EndPoints;
    let separator = Separator::new(&geometry, Penalised::Profile, line).unwrap();
    let (mut sum, mut count, mut told) = (0.0, 0.0, 0);
    for seed in 0..20 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let noise = Disturbances::noise(0.1);
        let each: Vec<Outputs> = (0..5)
            .map(|repeat| {
                let seen = simulate(&geometry, &truth, &noise, 100 * seed + repeat).unwrap();
                let drift: [f64; 4] = std::array::from_fn(|_| 0.5 * normal());
                let rows =
                    seen.readings().iter().enumerate().map(|(n, row)| {
                        std::array::from_fn(|k| row[k] + drift[k] * n as f64 / 61.0)
                    });
                Outputs::new(geometry, 0.0, rows.collect()).unwrap()
            })
            .collect();
        let mean = (0..62).map(|n| {
            std::array::from_fn(|k| each.iter().map(|one| one.readings()[n][k]).sum::<f64>() / 5.0)
        });
        let mean = Outputs::new(geometry, 0.0, mean.collect()).unwrap();
        // What the scatter of such readings looks like as white noise, of the average.
        let settings = Settings {
            noise: Some(0.08),
            ..Settings::default()
        };
        let mut found = separator.separate(&mean, &settings).unwrap();
        let fixed = Settings {
            choice: Choice::Fixed(found.chosen.point.lambda),
            ..settings
        };
        let each: Vec<_> = each
            .iter()
            .map(|one| separator.separate(one, &fixed).unwrap().found())
            .collect();
        let draws = separator.noise_errors(&mean, &settings, &found).unwrap();
        let degrees = DegreesOfFreedom::new(4.0 * 4.0 * 61.0).unwrap();
        found.count_repeats(&each, &draws, degrees, Parabola::LeastNorm);
        told += usize::from(found.excess.is_some());
        let true_slide = stated(&geometry, &truth).straightness;
        let error = &found.straightness.values - true_slide;
        let height = error.mean();
        for (error, std) in error.iter().zip(found.straightness.std.iter()).step_by(7) {
            sum += ((error - height) / std).powi(2);
            count += 1.0;
        }
    }
    let z = f64::sqrt(sum / count);
    assert!(told >= 18 && z < 1.3, "{told} {z}");
}

/// A surface whose long waves are the largest: of the penalties that on the curvature is the likeliest by far, through
/// the decomposition and through the band, which agree to what the sampling of λ leaves; and S errs by less than half
/// as much as with the penalty on the profile.
#[test]
fn the_likeliest_penalty_is_that_which_errs_least() {
    let geometry = Geometry::new(5.0, [1, 1, 5], 62).unwrap();
    let (mut by_profile, mut by_likeliest) = (0.0, 0.0);
    for seed in 0..10 {
        let truth = Rough::new(&geometry, 1.5, seed);
        let outputs = simulate(&geometry, &truth, &Disturbances::noise(0.1), seed).unwrap();
        let likeliest = Likeliest::of(&outputs, true).unwrap().unwrap();
        assert_eq!(likeliest.penalised, Penalised::Curvature, "{likeliest:?}");
        let long = Likeliest::of(&outputs, false).unwrap().unwrap();
        assert_eq!(long.penalised, Penalised::Curvature, "{long:?}");
        let slope = |found: &Likeliest| {
            let of = |(penalised, _): &&(Penalised, f64)| *penalised == Penalised::Slope;
            found.against.iter().find(of).unwrap().1
        };
        assert!(
            (slope(&likeliest) - slope(&long)).abs() < 1.0,
            "{likeliest:?} {long:?}"
        );
        let expected = stated(&geometry, &truth).straightness;
        let square = |penalised| {
            let separator = Separator::new(&geometry, penalised, Line::EndPoints).unwrap();
            let found = separator.separate(&outputs, &Settings::default()).unwrap();
            (found.straightness.values - &expected).norm_squared()
        };
        by_likeliest += square(likeliest.penalised);
        by_profile += square(Penalised::Profile);
    }
    assert!(
        by_likeliest < 0.25 * by_profile,
        "{by_likeliest} {by_profile}"
    );
}

/// Through the band differences find a λ as through the decomposition: the range of λ reaches as far as the long waves
/// ask for, where it ended at the norms of the rows.
#[test]
fn long_records_find_a_lambda_with_differences() {
    let geometry = Geometry::new(1.0, [5, 7, 25], 100).unwrap();
    let truth = Rough::new(&geometry, 3.0, 3);
    let outputs = simulate(&geometry, &truth, &Disturbances::noise(0.1), 3).unwrap();
    let settings = Settings {
        choice: Choice::Likelihood,
        ..Settings::default()
    };
    for penalised in [Penalised::Slope, Penalised::Curvature] {
        let line = Line::EndPoints;
        let dense = Separator::new(&geometry, penalised, line).unwrap();
        let dense = dense.separate(&outputs, &settings).unwrap();
        let long = separate_long(&outputs, penalised, line, &settings).unwrap();
        let ratio = long.chosen.point.lambda / dense.chosen.point.lambda;
        // Both roots of one slope to 1e-9 of λ; the rounding of two ways to it.
        assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
    }
}
