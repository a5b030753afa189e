//! The worked examples of the guide (JCGM 100, annex H.1; JCGM 101, chapter 9) and the identities
//! that every combination of uncertainties obeys.

use errsep_models::uncertainty::{
    Budget, Correlation, DegreesOfFreedom, Quantity, Sample, UncertaintyError, arcsine,
    coverage_factor, degrees_from_reliability, mean_of, rectangular, second_order_variance,
    simulate, welch_satterthwaite,
};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

/// A figure printed with this last digit: half a unit of it (certified digits).
fn printed(found: f64, expected: f64, last_digit: f64) {
    assert!(
        (found - expected).abs() <= 0.5 * last_digit,
        "{found} is not {expected} to the printed {last_digit}"
    );
}

fn finite(number: f64) -> DegreesOfFreedom {
    DegreesOfFreedom::new(number).unwrap()
}

/// The inputs of GUM H.1, lengths in the given number of units a nanometre: end standard, measured
/// difference, differences of expansion and temperature, expansion, temperature deviation.
fn end_gauge(nm: f64, unit: &str) -> Vec<Quantity> {
    let repeat = Quantity::new("repeatability of d", 0.0, 13.0 / 5.0_f64.sqrt() * nm, unit)
        .unwrap()
        .with_degrees_of_freedom(finite(24.0));
    let random = Quantity::new(
        "comparator, random",
        0.0,
        10.0 * nm / coverage_factor(0.95, finite(5.0)).unwrap(),
        unit,
    )
    .unwrap()
    .with_degrees_of_freedom(finite(5.0));
    let systematic = Quantity::from_expanded("comparator, systematic", 0.0, 20.0 * nm, 3.0, unit)
        .unwrap()
        .with_degrees_of_freedom(degrees_from_reliability(0.25).unwrap());
    let difference = Budget::combine(
        "d",
        215.0 * nm,
        unit,
        vec![(repeat, 1.0), (random, 1.0), (systematic, 1.0)],
        &Correlation::none(3),
    )
    .unwrap();
    let temperature = 0.2_f64.hypot(arcsine(0.5));
    vec![
        Quantity::from_expanded("l_S", 50_000_623.0 * nm, 75.0 * nm, 3.0, unit)
            .unwrap()
            .with_degrees_of_freedom(finite(18.0)),
        difference.result,
        Quantity::new("delta alpha", 0.0, rectangular(1e-6), "1/K")
            .unwrap()
            .with_degrees_of_freedom(degrees_from_reliability(0.1).unwrap()),
        Quantity::new("delta theta", 0.0, rectangular(0.05), "K")
            .unwrap()
            .with_degrees_of_freedom(degrees_from_reliability(0.5).unwrap()),
        Quantity::new("alpha_S", 11.5e-6, rectangular(2e-6), "1/K").unwrap(),
        Quantity::new("theta", -0.1, temperature, "K").unwrap(),
    ]
}

/// GUM equation H.3.
fn end_gauge_length(x: &[f64]) -> f64 {
    x[0] + x[1] - x[0] * (x[2] * x[5] + x[4] * x[3])
}

#[test]
fn gum_h1_end_gauge_with_its_intermediate_values() {
    let inputs = end_gauge(1.0, "nm");
    printed(inputs[0].standard_uncertainty, 25.0, 1.0);
    printed(inputs[1].standard_uncertainty, 9.7, 0.1);
    printed(inputs[1].degrees_of_freedom.as_f64(), 25.6, 0.1);
    printed(inputs[2].standard_uncertainty * 1e6, 0.58, 0.01);
    printed(inputs[2].degrees_of_freedom.as_f64(), 50.0, 1e-9);
    printed(inputs[3].standard_uncertainty, 0.029, 0.001);
    printed(inputs[3].degrees_of_freedom.as_f64(), 2.0, 1e-9);
    printed(inputs[4].standard_uncertainty * 1e6, 1.2, 0.1);
    printed(inputs[5].standard_uncertainty, 0.41, 0.01);

    let budget =
        Budget::of_function("l", "nm", &inputs, &Correlation::none(6), end_gauge_length).unwrap();
    printed(budget.result.value, 50_000_838.0, 1.0);
    printed(budget.result.standard_uncertainty, 32.0, 1.0);
    printed(budget.result.degrees_of_freedom.as_f64(), 16.7, 0.2);
    let order: Vec<&str> = budget
        .contributions
        .iter()
        .map(|c| c.input.label.as_str())
        .collect();
    assert_eq!(order[..4], ["l_S", "delta theta", "d", "delta alpha"]);
    for (row, nm) in budget.contributions.iter().zip([25.0, 16.6, 9.7, 2.9]) {
        printed(row.contribution, nm, 0.1);
    }
    // Epsilons: six shares sum to one.
    let shares: f64 = budget.contributions.iter().map(|c| c.share).sum();
    assert!((shares - 1.0).abs() < 8.0 * f64::EPSILON);

    // H.1.6 truncates the degrees of freedom to 16, then t_99(16) = 2.92 and U_99 = 93 nm.
    let mut truncated = budget.result.clone();
    truncated.degrees_of_freedom = truncated.degrees_of_freedom.truncated();
    let expanded = truncated.expanded(0.99).unwrap();
    printed(expanded.coverage_factor, 2.92, 0.01);
    // The guide multiplies its rounded 32 nm; unrounded it is 92.5 nm.
    printed(
        expanded.coverage_factor * budget.result.standard_uncertainty.round(),
        93.0,
        1.0,
    );
    printed(expanded.expanded_uncertainty, 92.5, 0.1);

    // H.1.7: the second-order terms 11.7 nm and 1.7 nm raise it to 34 nm.
    let second = second_order_variance(&inputs, end_gauge_length);
    printed(second.sqrt(), 11.7_f64.hypot(1.7), 0.1);
    printed(
        (budget.result.standard_uncertainty.powi(2) + second).sqrt(),
        34.0,
        1.0,
    );
}

#[test]
fn gum_h1_in_metres_is_the_same_budget() {
    let nm = Budget::of_function(
        "l",
        "nm",
        &end_gauge(1.0, "nm"),
        &Correlation::none(6),
        end_gauge_length,
    )
    .unwrap();
    let metres = Budget::of_function(
        "l",
        "m",
        &end_gauge(1e-9, "m"),
        &Correlation::none(6),
        end_gauge_length,
    )
    .unwrap();
    // Truncation: a difference of 50 mm lengths keeps 50e6 eps of each nanometre of uncertainty.
    let relative = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-7, "{a} against {b}");
    relative(
        metres.result.standard_uncertainty * 1e9,
        nm.result.standard_uncertainty,
    );
    relative(
        metres.result.degrees_of_freedom.as_f64(),
        nm.result.degrees_of_freedom.as_f64(),
    );
}

#[test]
fn correlation_spans_from_difference_to_sum() {
    let combine = |r: f64, sign: f64| {
        let x = |label: &str| Quantity::new(label, 1.0, 3.0, "um").unwrap();
        Budget::combine(
            "y",
            0.0,
            "um",
            vec![(x("a"), 1.0), (x("b"), sign)],
            &Correlation::none(2).with(0, 1, r).unwrap(),
        )
        .unwrap()
        .result
        .standard_uncertainty
    };
    // Exact limits: full correlation adds linearly, and cancels in a difference.
    assert_eq!(combine(1.0, 1.0), 6.0);
    assert_eq!(combine(1.0, -1.0), 0.0);
    assert_eq!(combine(0.0, 1.0), 18.0_f64.sqrt());
}

#[test]
fn contradictory_correlations_are_named() {
    let table = Correlation::none(3)
        .with(0, 1, -1.0)
        .and_then(|t| t.with(1, 2, -1.0))
        .and_then(|t| t.with(0, 2, -1.0))
        .unwrap();
    let x = || Quantity::new("x", 0.0, 1.0, "um").unwrap();
    let inputs = vec![(x(), 1.0), (x(), 1.0), (x(), 1.0)];
    assert!(matches!(
        Budget::combine("y", 0.0, "um", inputs, &table),
        Err(UncertaintyError::NegativeVariance { .. })
    ));
    assert!(Correlation::none(2).with(0, 0, 0.5).is_err());
    assert!(Correlation::none(2).with(0, 1, 1.5).is_err());
    assert!(Correlation::none(2).with(0, 2, 0.5).is_err());
}

#[test]
fn welch_satterthwaite_equals_two_sample_rule() {
    // Two equal contributions with 4 degrees of freedom each have 8; with an exact one the
    // remaining finite one is diluted: (1 + 1)² / (1/4) = 16. Exact limits.
    let four = finite(4.0);
    assert_eq!(
        welch_satterthwaite(&[(1.0, four), (1.0, four)]).as_f64(),
        8.0
    );
    let exact = DegreesOfFreedom::Infinite;
    assert_eq!(
        welch_satterthwaite(&[(1e-200, four), (1e-200, exact)]).as_f64(),
        16.0
    );
    assert_eq!(welch_satterthwaite(&[(0.0, four), (1.0, exact)]), exact);
}

#[test]
fn coverage_factors_of_gum_table_g2() {
    // GUM table G.2, certified to its printed two decimals.
    for (p, nu, k) in [
        (0.95, 1.0, 12.71),
        (0.95, 4.0, 2.78),
        (0.95, 16.0, 2.12),
        (0.9545, 10.0, 2.28),
        (0.99, 2.0, 9.92),
        (0.9973, 50.0, 3.16),
    ] {
        printed(coverage_factor(p, finite(nu)).unwrap(), k, 0.01);
    }
    printed(
        coverage_factor(0.95, DegreesOfFreedom::Infinite).unwrap(),
        1.96,
        0.01,
    );
    assert!(coverage_factor(1.0, DegreesOfFreedom::Infinite).is_err());
}

#[test]
fn json_names_the_parts_and_survives_the_round_trip() {
    let mean = mean_of("alpha", &[1.0, 2.0, 4.0], "urad").unwrap();
    let text = serde_json::to_string(&mean).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    for key in ["label", "value", "std", "degrees_of_freedom", "unit"] {
        assert!(value.get(key).is_some(), "{key} is missing in {text}");
    }
    assert_eq!(serde_json::from_str::<Quantity>(&text).unwrap(), mean);
    let exact = Quantity::new("pi", 3.1, 0.0, "1").unwrap();
    let text = serde_json::to_string(&exact).unwrap();
    assert!(text.contains("\"infinite\""));
    assert_eq!(serde_json::from_str::<Quantity>(&text).unwrap(), exact);
}

#[test]
fn simulation_depends_on_the_seed_and_not_on_the_threads() {
    let run = |threads: usize, seed: u64| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| {
                simulate(
                    5000,
                    2,
                    seed,
                    || (),
                    |rng, (), out| {
                        out[0] = rng.random();
                        out[1] = StandardNormal.sample(rng);
                    },
                )
                .unwrap()
            })
    };
    assert_eq!(run(1, 7), run(3, 7));
    assert_ne!(run(1, 7), run(1, 8));
}

#[test]
fn additive_model_of_jcgm_101() {
    // 9.2.2: four standard normal inputs, interval ±3.92; 9.2.3: four rectangular ones of the same
    // standard deviation, ±3.88. Truncation: 2e5 trials give an end to about 0.01.
    let normal = simulate(
        200_000,
        1,
        1,
        || (),
        |rng, (), out| {
            out[0] = (0..4).map(|_| -> f64 { StandardNormal.sample(rng) }).sum();
        },
    );
    let sample = normal.unwrap().output(0).unwrap();
    assert!((sample.standard_deviation() - 2.0).abs() < 0.015);
    let interval = sample.symmetric_interval(0.95).unwrap();
    assert!((interval.upper - 3.92).abs() < 0.04 && (interval.lower + 3.92).abs() < 0.04);

    let half = 3.0_f64.sqrt();
    let rectangular = simulate(
        200_000,
        1,
        2,
        || (),
        |rng, (), out| {
            out[0] = (0..4).map(|_| rng.random_range(-half..half)).sum();
        },
    );
    let interval = rectangular
        .unwrap()
        .output(0)
        .unwrap()
        .symmetric_interval(0.95)
        .unwrap();
    assert!((interval.upper - 3.88).abs() < 0.03 && (interval.lower + 3.88).abs() < 0.03);
}

#[test]
fn lopsided_distribution_of_jcgm_101() {
    // 9.4.2.2: X1² + X2² with zero means and u = 0.005 is exponential: mean and standard deviation
    // 50e-6, shortest 95 % interval from 0 to 150e-6. Truncation of 2e5 trials: 1e-6.
    let loss = simulate(
        200_000,
        1,
        3,
        || (),
        |rng, (), out| {
            let draw = |rng: &mut _| -> f64 { StandardNormal.sample(rng) };
            out[0] = ((0.005 * draw(rng)).powi(2) + (0.005 * draw(rng)).powi(2)) * 1e6;
        },
    );
    let sample = loss.unwrap().output(0).unwrap();
    assert!((sample.mean() - 50.0).abs() < 0.5);
    assert!((sample.standard_deviation() - 50.0).abs() < 0.7);
    let shortest = sample.shortest_interval(0.95).unwrap();
    assert!(
        shortest.lower < 0.2 && (shortest.upper - 149.8).abs() < 2.0,
        "{shortest:?}"
    );
    let symmetric = sample.symmetric_interval(0.95).unwrap();
    assert!(shortest.upper - shortest.lower < symmetric.upper - symmetric.lower);
}

#[test]
fn intervals_of_a_small_sample_stay_inside_it() {
    let sample = Sample::new(vec![3.0, 1.0]).unwrap();
    for p in [1e-9, 0.5, 0.999_999] {
        for interval in [sample.shortest_interval(p), sample.symmetric_interval(p)] {
            let interval = interval.unwrap();
            assert!(interval.lower >= 1.0 && interval.upper <= 3.0);
        }
    }
    assert!(Sample::new(vec![f64::NAN, 1.0]).is_none());
    assert!(sample.shortest_interval(1.0).is_err());
}

#[test]
fn coverage_factors_end_for_any_degrees_of_freedom() {
    // Effective degrees of freedom take any value; an inversion by Newton's method need not end there.
    let mut before = f64::INFINITY;
    for exponent in -20..=600 {
        let degrees = 10_f64.powf(f64::from(exponent) / 20.0);
        let k = coverage_factor(0.95, DegreesOfFreedom::Finite(degrees)).unwrap();
        // Falls towards the normal one; epsilons where it has arrived.
        assert!(
            k <= before * (1.0 + 1e-13) && k > 1.959_963,
            "{degrees} {k}"
        );
        before = k;
        if degrees < 1e4 {
            // Student's distribution itself, another algorithm: to 1e-9 of the share.
            let student = statrs::distribution::StudentsT::new(0.0, 1.0, degrees).unwrap();
            let share = 1.0 - 2.0 * statrs::distribution::ContinuousCDF::sf(&student, k);
            assert!((share - 0.95).abs() < 1e-9, "{degrees} {share}");
        }
    }
    // Limit.
    let normal = coverage_factor(0.95, DegreesOfFreedom::Infinite).unwrap();
    assert!((before / normal - 1.0).abs() < 1e-14, "{before} {normal}");
}
