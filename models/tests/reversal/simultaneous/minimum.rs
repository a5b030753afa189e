//! The minimum: that of the truth, of the staged solution, of a dense method, from far away.

use errsep_models::reversal::simulate::{even_grid, simulate};
use errsep_models::reversal::simultaneous::{
    Axis, ChannelReadings, DenseReversal, Knots, Noise, Options, Reversal, Unknowns, fit,
};
use errsep_models::reversal::{Channel, Convention, Observations, simultaneous, staged};
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::structured::{Parameters, evaluate, fit_structured};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::plan::*;

#[test]
fn noise_free_readings_give_the_truth() {
    for tilt_scale in [0.01, 1.0, 10.0] {
        let (mut plan, basis) = spline_plan(12, 150, 0.0, 1);
        plan.alpha_rad *= tilt_scale;
        plan.beta_rad *= tilt_scale;
        plan.gamma_rad *= tilt_scale;
        let (observations, truth) = simulate(&plan, &[]).unwrap();
        let solution = fit(&observations, &options(&basis, 42.0, Noise::Equal)).unwrap();
        for (name, value) in truths(&truth) {
            let error = tilt(&solution, name).value - value;
            // Exact limit: the target, 1e-12 rad; 300 mm times that is 3e-7 µm.
            assert!(error.abs() < 1e-12, "{name} at {tilt_scale}: {error:e}");
        }
        for (profile, form) in solution
            .forms(&even_grid(0.0, LENGTH, 77))
            .iter()
            .zip(true_forms(&truth))
        {
            for (x, value) in profile.x.iter().zip(&profile.values) {
                let error = value - form.at(*x);
                // Exact limit: the target.
                assert!(
                    error.abs() < 1e-9,
                    "{} at {x} mm, {tilt_scale}: {error:e}",
                    profile.name
                );
            }
        }
        assert!(solution.convergence.iterations() <= 10);
    }
}

#[test]
fn with_small_tilts_no_thickness_and_equal_noise_it_is_the_staged_solution() {
    let n = 40;
    let (mut plan, _) = spline_plan(9, n, 0.05, 2);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (1e-6, -2e-6, 3e-6);
    plan.thickness_mm = 0.0;
    let (observations, _) = simulate(&plan, &[]).unwrap();
    // A break at every position but the second from either end: the splines pass through any values.
    let mut breaks = even_grid(0.0, LENGTH, n);
    breaks.remove(n - 2);
    breaks.remove(1);
    let simultaneous = fit(
        &observations,
        &Options {
            knots: Knots::At(breaks),
            noise: Noise::Equal,
            ..Options::default()
        },
    )
    .unwrap();
    let staged = staged::solve(
        &observations,
        &staged::Options {
            removal: Some(staged::Removal::Shear),
            ..staged::Options::default()
        },
    )
    .unwrap();
    for s in &staged.tilts {
        let error = tilt(&simultaneous, &s.name).value - s.angle.value;
        // Exact limit: what is left is the rotation of a 1 µm form by 6 µrad.
        assert!(error.abs() < 1e-12, "{}: {error:e}", s.name);
    }
    let closure = simultaneous.closure.as_ref().unwrap();
    assert!(
        (closure.slope.unwrap().value - staged.closure.as_ref().unwrap().slope.value).abs() < 1e-12
    );
    for (form, s) in simultaneous.forms(&staged.x).iter().zip(&staged.forms) {
        assert_eq!(form.name, s.name);
        for (a, b) in form.values.iter().zip(&s.values) {
            assert!((a - b).abs() < 1e-9, "{}: {a} and {b}", form.name);
        }
    }
}

#[test]
fn derivatives_are_those_of_finite_differences() {
    let (mut plan, basis) = spline_plan(5, 33, 0.1, 3);
    (plan.alpha_rad, plan.gamma_rad) = (0.02, 0.3);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let channels = ChannelReadings::sort(&observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, true, 8);
    let axis = Axis::of(&channels).unwrap();
    let problem = Reversal::new(
        &channels,
        unknowns.clone(),
        vec![basis; 3],
        axis,
        42.0,
        vec![1.0; 4],
    );
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut at = Parameters::zeros(unknowns.band_count(), unknowns.border_count());
    for c in at.band.iter_mut() {
        // Steep on purpose: slopes of some mm/mm·10⁻¹ make every term of the derivatives count.
        *c = 3_000.0 * rng.random_range(-1.0..1.0);
    }
    for y in at.border.iter_mut() {
        *y = rng.random_range(-0.1..0.1);
    }
    *at.border.last_mut().unwrap() = 40.0;
    let count = observations.readings.len();
    let model = |at: &Parameters| {
        let mut r = vec![0.0; count];
        let residuals = problem.residuals(at).unwrap();
        for (channel, own) in channels.iter().zip(&residuals) {
            for (i, residual) in channel.source.iter().zip(own) {
                r[*i as usize] = -residual;
            }
        }
        r
    };
    let system = evaluate(&problem, &at).unwrap().system;
    let (band_norm, border_norm) = system.column_norms();
    let (band_gradient, border_gradient) = system.gradient();
    let residual = model(&at);
    let n = unknowns.band_count();
    for j in 0..n + unknowns.border_count() {
        let (norm, gradient) = if j < n {
            (band_norm[j], band_gradient[j])
        } else {
            (border_norm[j - n], border_gradient[j - n])
        };
        let step = |sign: f64| {
            let mut moved = at.clone();
            let (value, h) = if j < n {
                (&mut moved.band[j], 1e-2)
            } else if j - n < 4 {
                (&mut moved.border[j - n], 1e-6)
            } else {
                (&mut moved.border[j - n], 1e-3)
            };
            *value += sign * h;
            (model(&moved), h)
        };
        let ((up, h), (down, _)) = (step(1.0), step(-1.0));
        let column: Vec<f64> = up
            .iter()
            .zip(&down)
            .map(|(u, d)| (u - d) / (2.0 * h))
            .collect();
        let numeric_norm = column.iter().map(|c| c * c).sum::<f64>().sqrt();
        let numeric_gradient: f64 = column.iter().zip(&residual).map(|(c, r)| c * r).sum();
        let size = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
        let name = if j < n {
            format!("c{j}")
        } else {
            unknowns.border_name(j - n)
        };
        // Truncation: central differences of steps chosen for an error below 1e-6.
        assert!(
            (norm - numeric_norm).abs() < 1e-6 * norm,
            "{name}: {norm} and {numeric_norm}"
        );
        assert!(
            (gradient - numeric_gradient).abs() < 1e-6 * norm * size,
            "{name}: {gradient} and {numeric_gradient}"
        );
    }
}

#[test]
fn a_dense_method_finds_the_same_minimum() {
    let (mut plan, basis) = spline_plan(7, 60, 0.05, 13);
    plan.gamma_rad = 5e-3;
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let solution = fit(&observations, &options(&basis, 42.0, Noise::Equal)).unwrap();
    let channels = ChannelReadings::sort(&observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, false, 10);
    let axis = Axis::of(&channels).unwrap();
    let lines = simultaneous::lines(&channels).unwrap();
    let seed = simultaneous::tilts(&unknowns, &lines);
    let start = simultaneous::start(&unknowns, &seed, &lines, 42.0);
    let problem = Reversal::new(
        &channels,
        unknowns,
        vec![basis; 3],
        axis,
        42.0,
        vec![1.0; 4],
    );
    let dense = DenseReversal::new(&problem);
    let found = errsep_solvers::fit(
        &dense,
        dense.parameters_of(&start),
        &errsep_solvers::Options::default(),
    )
    .unwrap();
    assert!(found.ending.is_converged(), "{}", found.ending);
    let point = dense.point_of(&found.parameters);
    let cost: f64 = 0.5 * solution.residuals.iter().map(|r| r * r).sum::<f64>();
    // Truncation: both stop within 1e-12 of the cost or so.
    assert!(
        (found.cost - cost).abs() < 1e-10 * cost,
        "{} and {cost}",
        found.cost
    );
    for (j, t) in solution.tilts().iter().enumerate() {
        let error = point.border[j] - t.angle.value;
        assert!(error.abs() < 1e-5 * t.angle.std, "{}: {error:e}", t.name);
    }
}

#[test]
fn from_a_head_start_the_minimum_is_that_over_all_readings() {
    // 150 readings a cell and channel: the start comes from 24 of them.
    let (plan, basis) = spline_plan(6, 900, 0.05, 17);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let channels = ChannelReadings::sort(&observations);
    let unknowns = Unknowns::new(Channel::ALL.to_vec(), Convention::Seed, false, 9);
    let axis = Axis::of(&channels).unwrap();
    let lines = simultaneous::lines(&channels).unwrap();
    let seed = simultaneous::tilts(&unknowns, &lines);
    let start = simultaneous::start(&unknowns, &seed, &lines, 42.0);
    for noise in [Noise::Equal, Noise::Estimated] {
        let solution = fit(&observations, &options(&basis, 42.0, noise)).unwrap();
        let weights: Vec<f64> = match noise {
            Noise::Equal => vec![1.0; 4],
            _ => solution.noise.iter().map(|n| 1.0 / n.sigma).collect(),
        };
        let problem = Reversal::new(
            &channels,
            unknowns.clone(),
            vec![basis.clone(); 3],
            axis,
            42.0,
            weights.clone(),
        );
        let plain = fit_structured(&problem, start.clone(), &Minimisation::structured()).unwrap();
        assert!(plain.converged(), "{}", plain.ending);
        let cost: f64 = observations
            .readings
            .iter()
            .zip(&solution.residuals)
            .map(|(reading, r)| 0.5 * (weights[reading.channel.index()] * r).powi(2))
            .sum();
        // Truncation: both stop within 1e-12 of the cost.
        assert!(
            (cost / plain.cost - 1.0).abs() < 1e-11,
            "{cost} and {}",
            plain.cost
        );
        for (j, t) in solution.tilts().iter().enumerate() {
            let error = plain.parameters.border[j] - t.angle.value;
            // Truncation: 1e-12 of a cost of 1800 lets a tilt move by 6e-5 of its uncertainty.
            assert!(error.abs() < 1e-4 * t.angle.std, "{}: {error:e}", t.name);
        }
        if noise == Noise::Estimated {
            // Under these weights the noise comes out as one in all channels together.
            let (mut left, mut freedom) = (0.0, 0.0);
            for n in &solution.noise {
                left += n.readings as f64 * (n.residual_rms / n.sigma).powi(2);
                freedom += n.degrees_of_freedom;
            }
            // Epsilons: 3600 terms.
            assert!((left / freedom - 1.0).abs() < 1e-12, "{left} {freedom}");
        }
    }
}

#[test]
fn a_prediction_is_the_reading_less_its_residual() {
    let (plan, basis) = spline_plan(9, 61, 0.05, 5);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let solution = fit(&observations, &options(&basis, 42.0, Noise::Estimated)).unwrap();
    for record in solution.records(&observations) {
        let predicted = solution
            .predict(record.reading.channel, record.reading.x)
            .unwrap();
        // Epsilons: readings of some hundred micrometres.
        assert!((predicted.value - record.model).abs() < 1e-10, "{record:?}");
    }
    let jacobian = solution.jacobian(&observations).unwrap();
    assert_eq!(jacobian.ncols(), solution.jacobian_names().len());
    // At the minimum the weighted residuals are orthogonal to every column.
    for (j, name) in solution.jacobian_names().iter().enumerate() {
        let (mut product, mut squares, mut rest) = (0.0, 0.0, 0.0);
        for (i, record) in solution.records(&observations).enumerate() {
            let weight = record.standardised / record.residual;
            let (d, r) = (jacobian[(i, j)] * weight, record.standardised);
            product += d * r;
            squares += d * d;
            rest += r * r;
        }
        // Truncation: the fit stops within 1e-12 of the cost, whose root is 1e-6.
        let cosine = product / f64::sqrt(squares * rest);
        assert!(cosine.abs() < 2e-6, "{name}: {cosine:e}");
    }
}

#[test]
fn any_set_of_channels_gives_what_it_determines() {
    use Channel::{C1A, C1B, C2A, C2B};
    let (plan, basis) = spline_plan(8, 90, 0.0, 6);
    let (all, truth) = simulate(&plan, &[]).unwrap();
    let (a, b, g) = (truth.alpha_rad, truth.beta_rad, truth.gamma_rad);
    let x = even_grid(0.0, LENGTH, 31);
    type Case<'a> = (&'a [Channel], Vec<(&'a str, f64)>, Vec<&'a str>);
    let cases: [Case; 5] = [
        (
            &[C1A, C1B, C2A],
            vec![("alpha", a), ("beta", b), ("gamma", g)],
            vec!["M", "S_A", "S_B"],
        ),
        (
            &[C1A, C2B],
            vec![("alpha", a), ("beta + gamma", b + g)],
            vec!["M + S_A/2 + S_B/2", "S_A/2 - S_B/2"],
        ),
        (
            &[C1A, C2A],
            vec![("alpha + beta", a + b), ("gamma", g)],
            vec!["M", "S_A"],
        ),
        (&[C2A, C2B], vec![], vec![]),
        (&[C1B], vec![("alpha - beta + gamma", a - b + g)], vec![]),
    ];
    for (channels, tilts, forms) in cases {
        let some = Observations {
            readings: all
                .readings
                .iter()
                .filter(|r| channels.contains(&r.channel))
                .copied()
                .collect(),
        };
        let solution = fit(&some, &options(&basis, 42.0, Noise::Equal)).unwrap();
        assert!(solution.closure.is_none());
        for (name, value) in tilts {
            let error = tilt(&solution, name).value - value;
            // Truncation: with the slide's form riding on the artefact's axis (fewer than both
            // indicators on a side) a 1 µm form is shifted by 20 µm: 1e-9 rad.
            assert!(error.abs() < 2e-9, "{channels:?} {name}: {error:e}");
        }
        let found = solution.forms(&x);
        if !forms.is_empty() {
            assert_eq!(
                found.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(),
                forms
            );
        }
        for profile in found {
            for (x, value) in profile.x.iter().zip(&profile.values) {
                let (m, sa, sb) = (truth.m.at(*x), truth.s_a.at(*x), truth.s_b.at(*x));
                let expected = match profile.name.as_str() {
                    "M" => m,
                    "S_A" => sa,
                    "S_B" => sb,
                    "M + S_A/2 + S_B/2" => m + (sa + sb) / 2.0,
                    "S_A/2 - S_B/2" => (sa - sb) / 2.0,
                    _ => continue,
                };
                // Truncation: as above, a slope of 0.2 µm/mm times 20 µm.
                assert!(
                    (value - expected).abs() < 0.02,
                    "{} at {x}: {value} {expected}",
                    profile.name
                );
            }
        }
    }
}

#[test]
fn a_far_start_ends_at_the_same_minimum() {
    let (plan, basis) = spline_plan(10, 120, 0.02, 9);
    let (observations, _) = simulate(&plan, &[]).unwrap();
    let mut options = options(&basis, 42.0, Noise::Equal);
    let near = fit(&observations, &options).unwrap();
    options.start_tilts_rad = Some(vec![0.05, -0.1, 0.09]);
    let far = fit(&observations, &options).unwrap();
    for (a, b) in near.tilts().iter().zip(far.tilts()) {
        // Truncation: both stop within 1e-12 of the cost, a millionth of the uncertainty and √m.
        assert!((a.angle.value - b.angle.value).abs() < 1e-4 * a.angle.std);
    }
}
