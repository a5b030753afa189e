//! The staged reversal on data whose truth is known.

use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::staged::{
    Interpolation, NoSolution, NoiseSource, Options, Removal, Staged, solve,
};
use errsep_models::reversal::{Channel, Contrast, Convention, Direction, Observations, Reading};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const TILTS: [f64; 3] = [40e-6, -15e-6, 25e-6];
const OFFSETS: [f64; 4] = [3.0, -40.0, 12.0, 0.5];

fn reading(channel: Channel, x: f64, value: f64) -> Reading {
    Reading {
        channel,
        repeat: 1,
        direction: Direction::Forward,
        time: None,
        x,
        value,
    }
}

fn grid(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|k| k as f64 * step).collect()
}

/// Values of f at x less their least-squares line.
fn without_line(x: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
    let y = x.iter().map(|&x| f(x)).collect::<Vec<_>>();
    let n = x.len() as f64;
    let (xm, ym) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (xy, xx) = x.iter().zip(&y).fold((0.0, 0.0), |(xy, xx), (x, y)| {
        (xy + (x - xm) * (y - ym), xx + (x - xm).powi(2))
    });
    let rest = |(x, y): (&f64, f64)| y - ym - xy / xx * (x - xm);
    x.iter().zip(y).map(rest).collect()
}

/// Waves over the grid, µm.
fn form(x: &[f64], amplitude: f64, waves: f64, phase: f64) -> Vec<f64> {
    let length = x[x.len() - 1] - x[0];
    without_line(x, |x| {
        amplitude * (std::f64::consts::TAU * waves * x / length + phase).sin()
    })
}

struct Truth {
    x: Vec<f64>,
    m: Vec<f64>,
    s_a: Vec<f64>,
    s_b: Vec<f64>,
}

fn truth() -> Truth {
    let x = grid(101, 2.0);
    Truth {
        m: form(&x, 1.5, 1.3, 0.4),
        s_a: form(&x, 0.8, 3.1, 1.0),
        s_b: form(&x, 0.6, 2.2, 2.0),
        x,
    }
}

/// First-order readings: i·M + S + tan(ψ)·x + b.
fn sheared_data(t: &Truth, channels: &[Channel], sigma: f64, seed: u64) -> Observations {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise = Normal::new(0.0, sigma).unwrap();
    let mut readings = Vec::new();
    for &c in channels {
        let psi =
            TILTS[0] * c.indicator_sign() + TILTS[1] * c.spindle_sign() + TILTS[2] * c.side_sign();
        for (k, &x) in t.x.iter().enumerate() {
            let s = if c.is_side_a() { t.s_a[k] } else { t.s_b[k] };
            let value = c.indicator_sign() * t.m[k] + s + psi.tan() * 1e3 * x + OFFSETS[c.index()];
            readings.push(reading(c, x, value + noise.sample(&mut random)));
        }
    }
    Observations { readings }
}

fn shear() -> Options {
    Options {
        removal: Some(Removal::Shear),
        ..Options::default()
    }
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn first_order_data_without_noise_come_back_to_rounding() {
    let t = truth();
    let s = solve(&sheared_data(&t, &Channel::ALL, 0.0, 1), &shear()).unwrap();
    // Epsilons: readings up to 60 µm over 200 mm; a slope is good to 60 ε/200 ≈ 1e-16 rad.
    for (contrast, truth) in [Contrast::Alpha, Contrast::Spindle, Contrast::Side]
        .into_iter()
        .zip(TILTS)
    {
        let found = s.tilt(contrast).unwrap().value;
        assert!(
            (found - truth).abs() < 1e-15,
            "{contrast:?} {found} {truth}"
        );
    }
    // Some tens of roundings of readings up to 60 µm.
    for (form, truth) in [&t.m, &t.s_a, &t.s_b].into_iter().enumerate() {
        assert!(worst(&s.form(form).unwrap().values, truth) < 1e-12);
    }
    let closure = s.closure.unwrap();
    assert!(closure.rms < 1e-13 && closure.slope.value.abs() < 1e-15);
}

/// The readings that exact geometry gives for a tilted artefact of half thickness h and a straight
/// slide: x = u cosψ − (h + S) sinψ, reading = u sinψ + (h + S) cosψ − h + b.
fn rotated_data(tilts: [f64; 3], h: f64, surface: impl Fn(Channel, f64) -> f64) -> Observations {
    let mut readings = Vec::new();
    for c in Channel::ALL {
        let psi =
            tilts[0] * c.indicator_sign() + tilts[1] * c.spindle_sign() + tilts[2] * c.side_sign();
        for k in 0..201 {
            let x = f64::from(k);
            // u from x by fixed point: contraction by S′ψ, far below one.
            let mut u = x;
            for _ in 0..50 {
                u = (x + (h + surface(c, u) * 1e-3) * psi.sin()) / psi.cos();
            }
            let mm = u * psi.sin() + (h + surface(c, u) * 1e-3) * psi.cos() - h;
            readings.push(reading(c, x, mm * 1e3 + OFFSETS[c.index()]));
        }
    }
    Observations { readings }
}

fn surface(c: Channel, u: f64) -> f64 {
    if c.is_side_a() {
        2.0 * (std::f64::consts::TAU * u / 40.0).sin()
    } else {
        1.0 * (std::f64::consts::TAU * u / 55.0 + 1.0).cos()
    }
}

/// Forms of the truth in the gauge, at the solution's positions.
fn in_gauge(s: &Staged, c: Channel) -> Vec<f64> {
    without_line(&s.x, |x| surface(c, x))
}

#[test]
fn rotation_with_thickness_undoes_exact_geometry_where_shear_does_not() {
    let tilts = [3e-3, 0.0, 1e-3];
    let data = rotated_data(tilts, 21.0, surface);
    let error = |removal, interpolation| {
        let options = Options {
            removal: Some(removal),
            interpolation,
            thickness: Some(42.0),
            ..Options::default()
        };
        let s = solve(&data, &options).unwrap();
        worst(&s.form(1).unwrap().values, &in_gauge(&s, Channel::C1A))
    };
    let shear = error(Removal::Shear, Interpolation::Linear);
    let linear = error(Removal::Rotation, Interpolation::Linear);
    let cubic = error(Removal::Rotation, Interpolation::Cubic);
    // Truncation. Side A is seen tilted by +4 and −2 mrad: shifts of 0.084 and −0.042 mm, mean
    // 0.021 mm, times the slope 2 × 2π/40 = 0.314: 6.6 nm.
    assert!((5e-3..8e-3).contains(&shear), "{shear}");
    // Truncation: the error of the chord, d (g − d)/2 · abs(R″), is 0.0385 × 0.0493 µm in 1A
    // (d = 0.084) and 0.0201 × 0.0493 µm in 2A; the mean is 1.44 nm, and the line of this wave,
    // 3/(5π) of it at the ends, comes off: 1.72 nm.
    assert!((0.5e-3..1.75e-3).contains(&linear), "{linear}");
    // Truncation. Inside: d (g − d) (g − 2d)/6 · R‴ with opposite signs in the two channels, 0.0023 ×
    // 0.0078 = 0.02 nm, and the wave's own line, 3.8 µrad, moves h by 0.08 µm: × 0.314 = 0.025 nm.
    // Beside an end the one-sided tangent is off by g²/3 · R‴: half of 0.07 × 0.0026 = 0.09 nm.
    assert!(cubic < 1.4e-4, "{cubic}");
}

#[test]
fn auto_takes_the_smaller_corrected_estimate() {
    let data = rotated_data([3e-3, 0.0, 1e-3], 21.0, surface);
    let with = |thickness| {
        let options = Options {
            thickness,
            ..Options::default()
        };
        solve(&data, &options).unwrap()
    };
    let thick = with(Some(42.0));
    assert_eq!(thick.removal, Removal::Rotation);
    let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
    let e = &thick.lines[0].estimates;
    // The corrected shear error is near the true one (slope × shift: 0.084 mm × 0.314/√2 = 19 nm,
    // truncation of second order, 5 %); the printed one, R θ²/2 = 0.011 nm, misses by three
    // orders of magnitude.
    assert!(
        (rms(&e.shear) / 0.0187 - 1.0).abs() < 0.05,
        "{}",
        rms(&e.shear)
    );
    assert!(rms(&e.shear_as_printed) < 1e-3 * rms(&e.shear));
    assert!(rms(&e.interpolation_as_printed) < 1e-4 * rms(&e.interpolation));
    // D θ S′ is the shift between near and far, twice that of one probe.
    assert!((rms(&e.thickness) / rms(&e.shear) - 2.0).abs() < 0.05);
    let straight = solve(
        &sheared_data(&truth(), &Channel::ALL, 0.02, 3),
        &Options::default(),
    );
    assert_eq!(straight.unwrap().removal, Removal::Shear);
}

#[test]
fn uncertainties_are_the_scatter_over_seeds() {
    let t = truth();
    let (mut squares, mut form_squares, mut noise) = (0.0, 0.0, 0.0);
    let (mut std, mut form_std) = (0.0, 0.0);
    let runs = 2000;
    for seed in 0..runs {
        let s = solve(&sheared_data(&t, &Channel::ALL, 0.05, seed), &shear()).unwrap();
        let alpha = s.tilt(Contrast::Alpha).unwrap();
        squares += (alpha.value - TILTS[0]).powi(2);
        form_squares += (s.form(1).unwrap().values[3] - t.s_a[3]).powi(2);
        noise += s.noise.sigma.powi(2);
        assert_eq!(s.noise.source, NoiseSource::Closure);
        (std, form_std) = (
            std + alpha.std.powi(2),
            form_std + s.form(1).unwrap().std[3].powi(2),
        );
    }
    // k·u: a variance over 2000 runs is good to √(2/2000) = 3.2 %; 4 u.
    assert!((squares / std - 1.0).abs() < 0.13, "{}", squares / std);
    assert!(
        (form_squares / form_std - 1.0).abs() < 0.13,
        "{}",
        form_squares / form_std
    );
    // k·u: 2000 runs of 99 degrees of freedom, √(2/198000) = 0.3 %; 4 u.
    let ratio = noise / runs as f64 / 0.05f64.powi(2);
    assert!((ratio - 1.0).abs() < 0.013, "{ratio}");
}

/// *Simulated truth*, exact geometry, 30 seeds: beside tilts of milliradians a thick artefact's sides shift against each other, and
/// lines fitted to what is not rotated hold that. Their uncertainty does too; that of the noise alone is less than half of the errors.
/// The slide's form is counted with the sides', so that it is told rather too large.
#[test]
fn tilts_of_a_thick_artefact_are_as_sure_as_they_are_told() {
    let mut squares = 0.0;
    for seed in 0..30 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut form = |rms| TrueForm::random_waves(&mut random, rms, 600.0, 8);
        let plan = Plan {
            m: form(1.0),
            s_a: form(0.5),
            s_b: form(0.5),
            alpha_rad: 2e-3,
            gamma_rad: 3e-3,
            thickness_mm: 200.0,
            repeats: 3,
            seed,
            ..Plan::even(0.0, 300.0, 101, 0.01)
        };
        let (readings, _) = simulate(&plan, &[]).unwrap();
        let options = Options {
            thickness: Some(200.0),
            ..Options::default()
        };
        let found = solve(&readings, &options).unwrap();
        let alpha = found.tilts.iter().find(|t| t.name == "alpha").unwrap();
        squares += ((alpha.angle.value - plan.alpha_rad) / alpha.angle.std).powi(2);
    }
    let rms = f64::sqrt(squares / 30.0);
    // k·u: 30 values tell their root mean square to an eighth.
    assert!((0.3..1.25).contains(&rms), "{rms}");
}

#[test]
fn repeats_and_directions_are_averaged_and_give_the_noise() {
    let t = truth();
    let mut all = Observations::default();
    for repeat in 1..=6 {
        let run = sheared_data(&t, &Channel::ALL, 0.05, u64::from(repeat) + 50);
        let direction = if repeat % 2 == 0 {
            Direction::Backward
        } else {
            Direction::Forward
        };
        all.readings
            .extend(run.readings.into_iter().map(|r| Reading {
                repeat,
                direction,
                ..r
            }));
    }
    let one = solve(&sheared_data(&t, &Channel::ALL, 0.05, 9), &shear()).unwrap();
    let six = solve(&all, &shear()).unwrap();
    assert_eq!(six.noise.source, NoiseSource::Repeats);
    // Each repeat but the first takes a height of its own.
    assert_eq!(six.noise.degrees_of_freedom, Some(4.0 * 100.0 * 4.0));
    // k·u: 1600 degrees of freedom, 1.8 % of σ; 4 u.
    assert!((six.noise.sigma / 0.05 - 1.0).abs() < 0.07);
    // Six times the readings: √6 smaller for the same noise (epsilons).
    let at_unit_noise = |s: &Staged| s.tilt(Contrast::Alpha).unwrap().std / s.noise.sigma;
    assert!((at_unit_noise(&one) / at_unit_noise(&six) - 6f64.sqrt()).abs() < 1e-9);
    let difference = six.lines[0].direction_difference.unwrap();
    // k·u: mean of 101 differences of two means of three, 0.05 √(2/3/101) = 4 nm; 4 u.
    assert!(difference.abs() < 0.017, "{difference}");
}

#[test]
fn two_channels_give_what_they_determine_and_no_more() {
    let t = truth();
    let s = solve(
        &sheared_data(&t, &[Channel::C1A, Channel::C2B], 0.0, 1),
        &shear(),
    )
    .unwrap();
    assert!((s.tilt(Contrast::Alpha).unwrap().value - TILTS[0]).abs() < 1e-15);
    assert_eq!(s.tilt(Contrast::Spindle), None);
    assert_eq!(s.tilts[1].name, "beta + gamma");
    assert!((s.tilts[1].angle.value - TILTS[1] - TILTS[2]).abs() < 1e-15);
    assert!(s.form(0).is_none() && s.closure.is_none() && s.contrasts.is_none());
    let names = s.forms.iter().map(|f| f.name.as_str()).collect::<Vec<_>>();
    assert_eq!(names, ["M + S_A/2 + S_B/2", "S_A/2 - S_B/2"]);
    let half = t
        .s_a
        .iter()
        .zip(&t.s_b)
        .map(|(a, b)| (a - b) / 2.0)
        .collect::<Vec<_>>();
    assert!(worst(&s.forms[1].values, &half) < 1e-12);
    // The rigid reading knows that a cone has the pattern of α in these two.
    let rigid = Options {
        convention: Convention::Rigid,
        ..shear()
    };
    let s = solve(
        &sheared_data(&t, &[Channel::C1A, Channel::C2B], 0.0, 1),
        &rigid,
    )
    .unwrap();
    assert_eq!(s.tilts[0].name, "alpha + cone");
}

#[test]
fn traces_of_different_grids_meet_on_the_coarser() {
    let wave = |c: Channel, x: f64| {
        c.indicator_sign() * (x / 30.0).sin() + if c.is_side_a() { (x / 23.0).cos() } else { 0.0 }
    };
    let mut readings = Vec::new();
    for c in Channel::ALL {
        let (n, step, start) = if c == Channel::C2A {
            (64, 3.1, 1.0)
        } else {
            (201, 1.0, 0.0)
        };
        readings.extend((0..n).map(|k| {
            let x = start + f64::from(k) * step;
            reading(c, x, wave(c, x))
        }));
    }
    let s = solve(&Observations { readings }, &shear()).unwrap();
    assert!(!s.one_grid && s.left_out == 0);
    // 64 of the coarse trace, which ends at 196.3 mm, and 199 mm, where the other three were read.
    assert_eq!(s.x.len(), 65);
    // The gauge is over all positions: the trapezoidal rule with half an interval more at either end.
    let mut places: Vec<f64> = (0..201).map(f64::from).collect();
    places.extend((0..64).map(|k| 1.0 + f64::from(k) * 3.1));
    places.sort_by(f64::total_cmp);
    places.dedup_by(|b, a| *b - *a < 1e-6);
    let mut points: Vec<(f64, f64)> = Vec::new();
    for pair in places.windows(2) {
        points.extend(pair.iter().map(|x| (*x, (pair[1] - pair[0]) / 2.0)));
    }
    points.extend([points[0], points[points.len() - 1]]);
    let slide = |x: f64| (x / 30.0).sin();
    let total: f64 = points.iter().map(|p| p.1).sum();
    let center = points.iter().map(|(x, w)| w * x).sum::<f64>() / total;
    let height = points.iter().map(|(x, w)| w * slide(*x)).sum::<f64>() / total;
    let spread: f64 = points.iter().map(|(x, w)| w * (x - center).powi(2)).sum();
    let turn: f64 = points
        .iter()
        .map(|(x, w)| w * (x - center) * slide(*x))
        .sum();
    let straight: Vec<f64> = (s.x.iter())
        .map(|x| slide(*x) - height - turn / spread * (x - center))
        .collect();
    // Truncation: on its own positions the form is exact but for the line, and there the ends count,
    // where the tangent of the last three grid points is followed over 1 mm. By hand that leaves 2.9e-4
    // µm at 200 mm and −1.1e-4 at 0, cells of 1 mm each: 1.4e-6 and 0.5e-6 µm in the height, 4.3e-6
    // and 1.6e-6 at the ends by the slope, less than 7e-6 in all.
    let error = worst(&s.form(0).unwrap().values, &straight);
    assert!(error < 7e-6, "{error}");
}

#[test]
fn refusals_say_what_is_missing() {
    let of = |readings| solve(&Observations { readings }, &Options::default());
    assert_eq!(of(vec![]), Err(NoSolution::NoReadings));
    let same = (0..9).map(|k| reading(Channel::C1B, 5.0, f64::from(k)));
    assert_eq!(
        of(same.collect()),
        Err(NoSolution::TooFewPositions {
            channel: "1B",
            positions: 1
        })
    );
    let steep = (0..9).map(|k| reading(Channel::C2A, f64::from(k), f64::from(k) * 1200.0));
    assert!(matches!(
        of(steep.collect()),
        Err(NoSolution::TooSteep { channel: "2A", .. })
    ));
    let endless = (0..9).map(|k| reading(Channel::C2A, f64::from(k), f64::INFINITY));
    assert!(matches!(
        of(endless.collect()),
        Err(NoSolution::NotUsable { .. })
    ));
    let mut apart = Vec::new();
    for (c, start) in [(Channel::C1A, 0.0), (Channel::C2B, 100.0)] {
        apart.extend((0..9).map(|k| reading(c, start + f64::from(k), 0.0)));
    }
    assert_eq!(of(apart), Err(NoSolution::NoOverlap { positions: 0 }));
}
