//! What a name is worth, on calibration lines: names far above and near the limit of detection, by whole
//! diagnoses, and by any number of threads.

use errsep::diagnosis::{Confidence, Diagnosis, Options, agreement, diagnose};

use crate::models::seen;
use crate::other_models::{MAKERS, Maker, calibration_line_made};

fn options(severity: usize) -> Options {
    Options {
        draws: 200,
        severity,
        ..Options::default()
    }
}

/// The same without what else grows with time or jumps.
fn few(severity: usize) -> Options {
    let without = ["zero-jump", "sensitivity-drift", "set-slope", "hysteresis"];
    Options {
        without: without.map(str::to_owned).to_vec(),
        ..options(severity)
    }
}

fn calibration_line() -> &'static Maker {
    let mut makers = MAKERS.iter();
    makers.find(|m| m.model == "calibration-line").unwrap()
}

/// Four sets with a drift of a number of times the smallest that is seen.
fn drifting(times: f64) -> [(&'static str, f64); 1] {
    let smallest = seen(calibration_line(), "drift");
    [("drift", times * smallest)]
}

fn only(diagnosis: &Diagnosis) -> &errsep::diagnosis::Severity {
    match &diagnosis.verdict.severity[..] {
        [only] => only,
        several => panic!("{several:?}: {}", diagnosis.verdict.statement),
    }
}

/// With its rivals, the first measurement in which an effect that the catalogue lacks is taken for another; which that is
/// tells a diagnosis without them.
fn taken_for(
    maker: &Maker,
    put: &[(&str, f64); 1],
    name: &str,
    mut seeds: std::ops::Range<u64>,
) -> Option<Diagnosis> {
    let lacking = |severity| Options {
        without: vec![put[0].0.to_owned()],
        ..options(severity)
    };
    let seed = seeds.find(|seed| {
        let verdict = maker.diagnosed(put, *seed, &lacking(0)).verdict;
        verdict.causes() == [[name]]
    });
    seed.map(|seed| maker.diagnosed(put, seed, &lacking(256)))
}

#[test]
fn a_drift_far_above_the_noise_is_strong() {
    let diagnosis = calibration_line().diagnosed(&drifting(4.0), 7, &options(256));
    let severity = only(&diagnosis);
    assert_eq!(severity.effect, "drift");
    // Quantile: the lower limit of 95 % of which a name is strong.
    assert!(severity.lower >= 0.95, "{severity:?}");
    assert_eq!(severity.confidence, Confidence::Strong);
    let said = &diagnosis.verdict.statement;
    assert!(
        said.contains("because of drift") && !said.contains("weak"),
        "{said}"
    );
}

/// Near the limit of detection, and with a catalogue that knows little else of time, a smooth function of it
/// is taken for a drift: the name is weak, its first sentence says so, and whole diagnoses of the rivals say
/// it as often as the score stage.
#[test]
fn a_drift_that_any_smooth_function_of_time_imitates_is_weak() {
    let put = drifting(1.3);
    // Near the limit not every measurement is given a name, and not to every one are rivals enough near: the
    // first that is named and of which a tenth of the smooth functions of time are named alike.
    let made = (2..22).map(|seed| calibration_line_made(&put, seed, 1.0));
    let judged = made.map(|line| (diagnose(&line, &few(256)), line));
    let imitated = |diagnosis: &Diagnosis| {
        let mut rivals = only(diagnosis).rivals.iter();
        rivals.any(|rival| rival.name == "smooth in time" && rival.probability >= 0.1)
    };
    let mut weak = judged.filter(|(d, _)| d.verdict.causes() == [["drift"]] && imitated(d));
    let (diagnosis, line) = weak.next().expect("one of twenty drifts is named alone");
    let severity = only(&diagnosis);
    assert_eq!(severity.effect, "drift");
    assert_eq!(severity.confidence, Confidence::Weak);
    // Nothing but what goes by the time: smooth functions of it and steps.
    assert!(severity.rivals[0].name.ends_with("in time"));
    let said = &diagnosis.verdict.statement;
    let worst = severity.rivals[0].in_words();
    let weak = format!("weak: {worst} of this size would be given this name in ");
    assert!(
        said.contains(&weak) && said.find(&weak) < said.find(". "),
        "{said}"
    );

    let rows = agreement(&line, &few(0), 40);
    let time = rows
        .iter()
        .find(|row| row.family == "smooth in time")
        .unwrap();
    assert!(time.cases == 40 && time.scored >= 4, "{time:?}");
    // k·u: where one of two judgements of the same rivals says so and the other does not, either way is
    // as probable (McNemar); three standard deviations of the difference.
    let (once, other) = (time.scored - time.both, time.whole - time.both);
    let apart = once.abs_diff(other) as f64;
    assert!(apart <= 3.0 * ((once + other) as f64).sqrt(), "{time:?}");
    // Nor do they differ in more than a quarter of the rivals.
    assert!(4 * (once + other) <= time.cases, "{time:?}");
}

#[test]
fn any_number_of_threads_gives_the_same_severity() {
    let line = calibration_line_made(&drifting(1.5), 3, 1.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| only(&diagnose(&line, &options(256))).clone())
    };
    let (one, two) = (on(1), on(2));
    assert!(one.rivals.iter().any(|rival| rival.probability > 0.0));
    // Exact limit: the same bits.
    assert_eq!(format!("{one:?}"), format!("{two:?}"));
    assert_eq!(one, two);
}

/// A circle reads the same all around: no error is a function of its reading, and lobes are none of themselves.
#[test]
fn what_reads_the_same_has_no_rival_along_the_reading() {
    let mut makers = MAKERS.iter();
    let circle = makers.find(|m| m.model == "circle").unwrap();
    let smallest = seen(circle, "lobes");
    let diagnosis = circle.diagnosed(&[("lobes", 4.0 * smallest)], 3, &options(64));
    let severity = only(&diagnosis);
    assert_eq!(severity.effect, "lobes");
    let names: Vec<&str> = severity.rivals.iter().map(|r| &r.name[..]).collect();
    assert!(names.contains(&"smooth in position"), "{names:?}");
    assert!(!names.contains(&"smooth in reading"), "{names:?}");
}

/// A jump that the catalogue lacks is named as the drift that is nearest; steps in time, which nobody has listed,
/// would be named so too. With the whole catalogue a jump is strong: of the steps those are left out that are jumps
/// themselves, whose places lie between those of its signatures.
#[test]
fn a_drift_that_is_a_jump_is_weak_and_a_jump_is_strong() {
    let line = calibration_line();
    let size = 3.0 * seen(line, "zero-jump");
    let known = line.diagnosed(&[("zero-jump", size)], 3, &options(256));
    let severity = only(&known);
    assert_eq!(severity.effect, "zero-jump");
    assert_eq!(severity.confidence, Confidence::Strong, "{severity:?}");

    let put = [("zero-jump", size)];
    let taken = taken_for(line, &put, "drift", 2..12);
    let diagnosis = taken.expect("one of ten jumps is taken for a drift");
    let severity = only(&diagnosis);
    assert_eq!(severity.confidence, Confidence::Weak);
    let steps = severity.rivals.iter().find(|r| r.name == "step in time");
    // Quantile: the share of a family from which on a name is weak.
    assert!(steps.unwrap().probability > 0.05, "{severity:?}");
}

/// An effect that the catalogue lacks is taken for one of like shape, and the name is weak by what the model says errors may
/// be functions of, at twice the size that is seen.
#[test]
fn a_name_for_what_the_catalogue_lacks_is_weak_by_what_the_model_knows() {
    let cases = [
        (
            "machine",
            "part-rotation",
            "part-zero",
            "another in every part",
        ),
        (
            "machine",
            "angular-error-times-height",
            "axis-scale",
            "times another coordinate",
        ),
        (
            "circle",
            "axis-backlash",
            "squareness",
            "the sense of travel",
        ),
        (
            "calibration-line",
            "sensitivity-drift",
            "drift",
            "in proportion to the load",
        ),
    ];
    for (model, effect, name, along) in cases {
        let maker = MAKERS.iter().find(|m| m.model == model).unwrap();
        let size = 2.0 * seen(maker, effect);
        let taken = taken_for(maker, &[(effect, size)], name, 2..22);
        let diagnosis = taken.unwrap_or_else(|| panic!("{effect} is never taken for {name}"));
        let severity = only(&diagnosis);
        assert_eq!(
            severity.confidence,
            Confidence::Weak,
            "{effect}: {severity:?}"
        );
        let mut rivals = severity.rivals.iter();
        let own = rivals.find(|rival| rival.name.contains(along));
        // One-sided 95 % lower limit above 5 %: 12 of 128 draws are.
        assert!(
            own.is_some_and(|own| own.probability > 0.09),
            "{effect}: {severity:?}"
        );
    }
}

/// Two effects far above the noise: each alone would be strong, and what two may imitate together was not asked.
#[test]
fn of_several_names_none_is_strong() {
    let line = calibration_line();
    let smallest = |effect: &str| seen(line, effect);
    let put = [
        ("drift", 6.0 * smallest("drift")),
        ("quadratic", 6.0 * smallest("quadratic")),
    ];
    let diagnosis = line.diagnosed(&put, 7, &few(256));
    let verdict = &diagnosis.verdict;
    assert_eq!(verdict.severity.len(), 2, "{}", verdict.statement);
    for severity in &verdict.severity {
        assert!(
            severity.beside_others && !severity.leaves_something(),
            "{severity:?}"
        );
        assert_eq!(severity.confidence, Confidence::Weak);
    }
    let by_rivals = |s: &errsep::diagnosis::Severity| s.is_weak_by_rivals();
    assert!(
        !verdict.severity.iter().all(by_rivals),
        "{:?}",
        verdict.severity
    );
    let why = "each of several causes is judged alone";
    assert!(verdict.statement.contains(why), "{}", verdict.statement);
}

/// Beside a drift far above the noise a bend that nobody listed leaves something, less than makes the drift inadequate:
/// no rival is named alike, and the name is weak by what it leaves. Without the bend it is strong.
#[test]
fn a_name_that_leaves_something_is_weak() {
    let line = calibration_line();
    let bends = [
        "quadratic",
        "cubic",
        "logarithmic",
        "square-root",
        "saturation",
    ];
    let lacking = Options {
        without: bends.map(str::to_owned).to_vec(),
        ..options(256)
    };
    let smallest = |effect: &str| seen(line, effect);
    let (drift, bend) = (6.0 * smallest("drift"), smallest("quadratic"));
    let with = |times: f64| {
        let put = [("drift", drift), ("quadratic", times * bend)];
        line.diagnosed(&put, 7, &lacking)
    };
    let clean = with(0.0);
    assert_eq!(clean.verdict.causes(), [["drift"]]);
    assert!(!only(&clean).leaves_something());
    assert_eq!(only(&clean).confidence, Confidence::Strong);

    let mut bent = (1..30).map(|k| with(0.1 * f64::from(k)));
    let left = bent.find(|diagnosis| {
        diagnosis.verdict.causes() == [["drift"]] && only(diagnosis).leaves_something()
    });
    let diagnosis = left.expect("between nothing and what is unknown something is left");
    let severity = only(&diagnosis);
    assert!(!severity.is_weak_by_rivals(), "{severity:?}");
    assert_eq!(severity.confidence, Confidence::Weak);
    let said = &diagnosis.verdict.statement;
    assert!(
        said.contains("weak: noise alone would leave as much beside this name in only "),
        "{said}"
    );
}
