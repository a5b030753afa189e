//! What any analysis of variance must obey.

use errsep_models::anova::recipe::{self, Recipe};
use errsep_models::anova::{AnovaError, Group, Groups, Truth, analyse, analyse_repeats, simulate};
use errsep_models::uncertainty::mean_of;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{ContinuousCDF, StudentsT};

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found} is not {expected} within {tolerance}"
    );
}

#[test]
fn one_group_is_the_plain_mean() {
    let readings = vec![8.388, 6.124, 4.94, 5.996, 6.177];
    let one = Groups::new(vec![Group {
        name: "1".into(),
        readings: readings.clone(),
    }])
    .unwrap();
    let found = analyse(&one, "um", 0.95).unwrap();
    let plain = mean_of("mean", &readings, "um").unwrap();
    // Exact limit, to the last bits of another order of summation.
    near(
        "mean",
        found.mean.value,
        plain.value,
        8.0 * f64::EPSILON * plain.value,
    );
    let u = plain.standard_uncertainty;
    near(
        "uncertainty",
        found.mean.standard_uncertainty,
        u,
        8.0 * f64::EPSILON * u,
    );
    assert_eq!(found.mean.degrees_of_freedom, plain.degrees_of_freedom);
    assert_eq!(
        (found.f, found.p_value, found.components.between),
        (None, None, None)
    );
    assert_eq!(found.between.mean_square, None);
}

#[test]
fn single_readings_leave_the_components_open() {
    let groups = (1..=4)
        .map(|i| Group {
            name: i.to_string(),
            readings: vec![f64::from(i * i)],
        })
        .collect();
    let found = analyse(&Groups::new(groups).unwrap(), "um", 0.95).unwrap();
    assert_eq!(
        (found.components.between, found.components.within),
        (None, None)
    );
    assert_eq!((found.f, &found.future_reading), (None, &None));
    let plain = mean_of("mean", &[1.0, 4.0, 9.0, 16.0], "um").unwrap();
    let u = plain.standard_uncertainty;
    near(
        "uncertainty",
        found.mean.standard_uncertainty,
        u,
        8.0 * f64::EPSILON * u,
    );
}

#[test]
fn two_groups_are_a_t_test() {
    let group = |name: &str, readings: &[f64]| Group {
        name: name.into(),
        readings: readings.to_vec(),
    };
    let groups = Groups::new(vec![
        group("a", &[1.0, 2.0, 3.0]),
        group("b", &[2.0, 3.0, 4.0]),
    ]);
    let found = analyse(&groups.unwrap(), "um", 0.95).unwrap();
    // Exact limit: with one degree of freedom between, F is the square of Student's t.
    near("F", found.f.unwrap(), 1.5, 1e-14);
    let t = StudentsT::new(0.0, 1.0, 4.0).unwrap();
    near(
        "p",
        found.p_value.unwrap(),
        2.0 * t.sf(1.5_f64.sqrt()),
        1e-12,
    );
}

#[test]
fn a_large_common_part_costs_no_digits() {
    // Offsets and readings are binary fractions, so the same deviations are exactly there (the
    // idea of the Simon-Lesage reference sets). Epsilons.
    let make = |offset: f64| {
        let groups = (0..5)
            .map(|i| Group {
                name: i.to_string(),
                readings: (0..7)
                    .map(|j| offset + f64::from(i) * 0.125 + f64::from(j % 2) * 0.25)
                    .collect(),
            })
            .collect();
        analyse(&Groups::new(groups).unwrap(), "um", 0.95)
            .unwrap()
            .f
            .unwrap()
    };
    let plain = make(0.0);
    near(
        "F",
        make(2.0_f64.powi(40)),
        plain,
        100.0 * f64::EPSILON * plain,
    );
}

#[test]
fn intervals_cover_the_truth() {
    // k·u: of 600 sets the 95 % intervals miss 30 ± 5.3; three standard deviations are allowed.
    let truth = Truth {
        mean: 3.0,
        between: 2.0,
        within: 1.0,
        replicates: [vec![5; 4], vec![2; 17]].concat(),
    };
    let sets = 600;
    let (mut between, mut within, mut mean, mut future) = (0, 0, 0, 0);
    for seed in 0..sets {
        let groups = simulate(&truth, seed).unwrap();
        let found = analyse(&groups, "um", 0.95).unwrap();
        let holds = |i: Option<errsep_models::anova::Interval>, sigma: f64| {
            i.is_some_and(|i| i.lower <= sigma * sigma && sigma * sigma <= i.upper)
        };
        between += u32::from(holds(found.components.between, 2.0));
        within += u32::from(holds(found.components.within, 1.0));
        let interval = found.mean.expanded(0.95).unwrap();
        mean += u32::from(interval.lower <= 3.0 && 3.0 <= interval.upper);
        let one = Truth {
            replicates: vec![2],
            ..truth.clone()
        };
        let next = simulate(&one, 10_000 + seed).unwrap().groups()[0].readings[0];
        let interval = found.future_reading.unwrap().result.expanded(0.95).unwrap();
        future += u32::from(interval.lower <= next && next <= interval.upper);
    }
    for (what, count) in [
        ("between", between),
        ("within", within),
        ("mean", mean),
        ("future", future),
    ] {
        near(what, f64::from(count), 570.0, 16.0);
    }
}

#[test]
fn readings_of_any_size_give_numbers_or_reasons() {
    for scale in [1e-150, 1e-30, 1.0, 1e30, 1e60] {
        let groups = (0..3)
            .map(|i| Group {
                name: i.to_string(),
                readings: vec![scale * f64::from(i), scale * f64::from(i + 1)],
            })
            .collect();
        let found = analyse(&Groups::new(groups).unwrap(), "um", 0.95).unwrap();
        near("F", found.f.unwrap(), 4.0, 1e-12);
    }
    let huge = Group {
        name: "a".into(),
        readings: vec![1e200, -1e200],
    };
    assert_eq!(Groups::new(vec![huge]), Err(AnovaError::Overflow));
    let equal = |n: usize| Group {
        name: n.to_string(),
        readings: vec![2.0; n],
    };
    let found = analyse(&Groups::new(vec![equal(2), equal(3)]).unwrap(), "um", 0.95).unwrap();
    assert_eq!((found.f, found.mean.standard_uncertainty), (None, 0.0));
}

#[test]
fn what_cannot_be_analysed_is_named() {
    let group = |name: &str, readings: &[f64]| Group {
        name: name.into(),
        readings: readings.to_vec(),
    };
    assert_eq!(Groups::new(vec![]), Err(AnovaError::Empty));
    assert_eq!(
        Groups::new(vec![group("a", &[1.0])]),
        Err(AnovaError::OneReading)
    );
    assert!(matches!(
        Groups::new(vec![group("a", &[1.0]), group("b", &[])]),
        Err(AnovaError::EmptyGroup { .. })
    ));
    assert!(matches!(
        Groups::new(vec![group("a", &[1.0]), group("a", &[2.0])]),
        Err(AnovaError::RepeatedGroup { .. })
    ));
    assert!(matches!(
        Groups::new(vec![group("a", &[1.0, f64::NAN])]),
        Err(AnovaError::NotFinite { number: 2, .. })
    ));
    let pair = Groups::new(vec![group("a", &[1.0, 2.0])]).unwrap();
    assert!(analyse(&pair, "um", 1.0).is_err());
    assert_eq!(
        recipe::summarise(&pair, Recipe::Section51),
        Err(AnovaError::NothingToCompare)
    );
}

#[test]
fn the_component_between_is_what_the_repeats_leave() {
    // By hand: means 2, 6, 4 of two readings each; MS_b = 8, MS_w = 2, n0 = 2, so that the component
    // between is (8 − 2)/2 = 3, with Satterthwaite's 36/(64/2 + 4/3) degrees of freedom. The mean has
    // MS_b/6. Tolerance: epsilons.
    let groups = [[1.0, 3.0], [5.0, 7.0], [3.0, 5.0]];
    let groups = groups.iter().enumerate().map(|(i, readings)| Group {
        name: i.to_string(),
        readings: readings.to_vec(),
    });
    let found = analyse(&Groups::new(groups.collect()).unwrap(), "um", 0.95).unwrap();
    let between = found.components.between.unwrap();
    near("between", between.variance, 3.0, 1e-14);
    near(
        "within",
        found.components.within.unwrap().variance,
        2.0,
        1e-14,
    );
    near("F", found.f.unwrap(), 4.0, 1e-14);
    let degrees = 36.0 / (64.0 / 2.0 + 4.0 / 3.0);
    near("degrees", between.degrees.as_f64(), degrees, 1e-14);
    let u = found.mean.standard_uncertainty;
    near("mean", u * u, 8.0 / 6.0, 1e-14);
    // A future reading: the mean, a new group, its own reading.
    let future = found.future_reading.unwrap().result.standard_uncertainty;
    near("future", future * future, 8.0 / 6.0 + 3.0 + 2.0, 1e-13);
}

/// Readings of three parts measured three times, and what a statistician prints for them.
#[test]
fn three_parts_give_two_degrees_of_freedom_to_a_future_reading() {
    let groups = [[10.0, 10.1, 9.9], [14.0, 14.1, 13.9], [7.0, 7.1, 6.9]];
    let groups = groups.iter().enumerate().map(|(i, readings)| Group {
        name: i.to_string(),
        readings: readings.to_vec(),
    });
    let found = analyse(&Groups::new(groups.collect()).unwrap(), "um", 0.95).unwrap();
    // By hand: the means 10, 14, 7 have the variance 37/3; (1 + 1/3)·37/3 + (1 − 1/3)·0.01 = 16.451.
    let future = found.future_reading.unwrap().result;
    let u = future.standard_uncertainty;
    near(
        "variance",
        u * u,
        4.0 / 3.0 * 37.0 / 3.0 + 2.0 / 3.0 * 0.01,
        1e-13,
    );
    // t(0.975; 2) = 4.303: the second digit of what Satterthwaite adds to two is not certified.
    near("degrees", future.degrees_of_freedom.as_f64(), 2.0, 0.001);
    near(
        "U",
        future.expanded(0.95).unwrap().upper - future.value,
        17.45,
        0.01,
    );
}

#[test]
fn the_mean_of_unequal_counts_is_as_sure_as_its_groups_allow() {
    // Limit: when the groups do not scatter beyond their readings' noise the generalised form is the
    // weighted scatter of the means, when they scatter far more the plain one times N²/Σn².
    let make = |offsets: [f64; 3]| {
        let counts = [2usize, 5, 9];
        let groups = counts
            .iter()
            .zip(offsets)
            .enumerate()
            .map(|(i, (n, o))| Group {
                name: i.to_string(),
                // Deviations that sum to zero in each group, so that the means are the offsets.
                readings: (0..*n)
                    .map(|j| o + (j as f64 - 0.5 * (*n as f64 - 1.0)))
                    .collect(),
            });
        analyse(&Groups::new(groups.collect()).unwrap(), "um", 0.95).unwrap()
    };
    let far = make([0.0, 1e6, 3e6]);
    let s2 = (7.0 / 3.0) * 1e12;
    let share = (4.0 + 25.0 + 81.0) / 256.0;
    // Exact limit, to the share of one reading's variance (9) in the means' (10¹²).
    let u = far.mean.standard_uncertainty;
    near("far", u * u / (s2 * share), 1.0, 1e-10);
    assert_eq!(far.mean.degrees_of_freedom.as_f64(), 2.0);
    let close = make([0.0, 0.1, -0.1]);
    let grand = (2.0 * 0.0 + 5.0 * 0.1 - 9.0 * 0.1) / 16.0;
    let squares = 2.0 * grand * grand
        + 5.0 * (0.1 - grand) * (0.1 - grand)
        + 9.0 * (-0.1 - grand) * (-0.1 - grand);
    let u = close.mean.standard_uncertainty;
    near("close", u * u, squares / 2.0 / 16.0, 1e-13);
}

/// Twenty parts measured three times, zeroed anew before each of the three times by 3 µm: the mean of all is known
/// no better than that of three zeros. Kind: k·u; of 200 sets 95 % ± 4 standard deviations, and the truth of one
/// measurement in its interval.
#[test]
fn repeats_that_were_zeroed_anew_are_in_the_uncertainty_of_the_mean() {
    let numbers = vec![vec![1, 2, 3]; 20];
    let (mut mean, mut within, mut differ) = (0, 0, 0);
    for seed in 0..200 {
        let truth = Truth {
            mean: 7.0,
            between: 5.0,
            within: 2.0,
            replicates: vec![3; 20],
        };
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let zeros: Vec<f64> = (0..3).map(|_| StandardNormal.sample(&mut random)).collect();
        let groups = simulate(&truth, seed).unwrap();
        let groups = groups.groups().iter().map(|g| Group {
            name: g.name.clone(),
            readings: g
                .readings
                .iter()
                .zip(&zeros)
                .map(|(r, z)| r + 3.0 * z)
                .collect(),
        });
        let groups = Groups::new(groups.collect()).unwrap();
        let (found, repeats) = analyse_repeats(&groups, &numbers, "um", 0.95).unwrap();
        let (low, high) = interval(&found.mean);
        mean += usize::from(low < 7.0 && 7.0 < high);
        let one = found.components.within.unwrap();
        within += usize::from(one.lower < 4.0 && 4.0 < one.upper);
        differ += usize::from(repeats.unwrap().differ);
    }
    assert!(
        mean >= 178 && within >= 178 && differ >= 170,
        "{mean} {within} {differ}"
    );
}

/// Repeats that differ by nothing but noise leave the analysis as it is without their numbers.
#[test]
fn repeats_that_do_not_differ_change_nothing() {
    let truth = Truth {
        mean: 0.0,
        between: 1.0,
        within: 1.0,
        replicates: vec![3; 8],
    };
    let groups = simulate(&truth, 2).unwrap();
    let (found, repeats) = analyse_repeats(&groups, &vec![vec![1, 2, 3]; 8], "um", 0.95).unwrap();
    let repeats = repeats.unwrap();
    assert!(!repeats.differ && repeats.p_value > 0.01);
    assert_eq!(found, analyse(&groups, "um", 0.95).unwrap());
    assert_eq!(analyse_repeats(&groups, &[], "um", 0.95).unwrap().1, None);
}

fn interval(found: &errsep_models::uncertainty::Quantity) -> (f64, f64) {
    let k = errsep_models::uncertainty::coverage_factor(0.95, found.degrees_of_freedom).unwrap();
    let u = k * found.standard_uncertainty;
    (found.value - u, found.value + u)
}
