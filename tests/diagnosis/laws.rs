//! A gap told as a law, on a few machines; many are in `campaigns/law`.

use errsep::diagnosis::{Law, LawFound, Options, Tabulated, TabulatedEffects, diagnose_with, law};
use std::f64::consts::PI;

use errsep_models::calibration_line::CalibrationLine;
use errsep_models::calibration_line::simulate::{CalibrationSimulation, simulate};
use errsep_models::model::{Effect, FittedModel, Place, Shape};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use nalgebra::DVector;

use crate::other_models::calibration_line_made;
use crate::scene::scene;

/// The change of a reading by its circumstances.
type Form = Box<dyn Fn(&Place) -> f64>;

fn options() -> Options {
    Options {
        draws: 100,
        ..Options::default()
    }
}

/// A small reversal with a change of its readings.
fn reversal(seed: u64, change: impl Fn(&Place) -> f64) -> Linearised {
    let mut scene = scene(seed, 20e-6);
    scene.repeats = 3;
    let observations = scene.measured(seed);
    let model = Linearised::new(&observations, Assumptions::default()).unwrap();
    changed(&model, change)
}

fn line(seed: u64, change: impl Fn(&Place) -> f64) -> CalibrationLine {
    changed(&calibration_line_made(&[], seed, 1.0), change)
}

fn changed<M: FittedModel + 'static>(model: &M, change: impl Fn(&Place) -> f64) -> M {
    let changes = model.places().iter().map(change);
    model.refit(model.observed() + DVector::from_iterator(model.places().len(), changes))
}

fn told<M: FittedModel + 'static>(model: &M) -> Law {
    match law(model, &options(), 0) {
        Ok(LawFound::Law(law)) => *law,
        other => panic!("{other:?}"),
    }
}

/// A drift of one channel is found as it was put in, with its sizes within their uncertainties.
#[test]
fn a_law_of_the_time_is_found_in_its_channel() {
    let range = reversal(3, |_| 0.0)
        .places()
        .iter()
        .map(|p| p.time)
        .fold(0.0, f64::max);
    let tau = 0.3 * range;
    let model = reversal(3, |p| match p.channel {
        1 => 0.9 * (1.0 - (-p.time / tau).exp()),
        _ => 0.0,
    });
    let law = told(&model);
    let [term] = law.terms.as_slice() else {
        panic!("{law:?}");
    };
    assert_eq!(term.function, "saturating exponential", "{law:?}");
    assert_eq!((term.along, term.pattern.as_str()), (Some("time"), "1B"));
    for (name, truth) in [("amplitude", 0.9), ("constant", tau)] {
        let found = term.parameters.iter().find(|p| p.name == name).unwrap();
        // k·u: four standard uncertainties.
        assert!((found.value - truth).abs() < 4.0 * found.std, "{found:?}");
        // It is known to some per cent.
        assert!(found.std < 0.1 * truth, "{found:?}");
    }
    assert!(law.p_value < 1e-3 && law.odds > 100.0 && law.confirmed > 3.0);
}

/// A jump of one channel, while another is read beside it: both are read in the first half of the time, so that a
/// step in its middle is a constant of theirs.
#[test]
fn a_jump_of_one_of_two_channels_read_together_is_found() {
    let range = reversal(4, |_| 0.0)
        .places()
        .iter()
        .map(|p| p.time)
        .fold(0.0, f64::max);
    let law = told(&reversal(4, |p| {
        if p.channel == 1 && p.time >= 0.2 * range {
            1.5
        } else {
            0.0
        }
    }));
    let [term] = law.terms.as_slice() else {
        panic!("{law:?}");
    };
    assert_eq!(term.function, "step", "{law:?}");
    assert_eq!((term.along, term.pattern.as_str()), (Some("time"), "1B"));
}

/// A curved indicator: the readings that the law is sought along are changed by it, by a fifth of themselves.
#[test]
fn a_law_along_the_reading_is_found_though_it_changes_the_reading() {
    let mut scene = scene(6, 400e-6);
    scene.repeats = 3;
    let observations = scene.measured(6);
    let model = Linearised::new(&observations, Assumptions::default()).unwrap();
    let steepest = model.observed().iamax();
    let channel = model.places()[steepest].channel;
    let truth = 0.2 / model.observed()[steepest].abs();
    let places = model.places().iter().zip(model.observed());
    let change = places.map(|(p, r)| {
        if p.channel == channel {
            truth * r * r
        } else {
            0.0
        }
    });
    let change = DVector::from_iterator(model.places().len(), change);
    let law = told(&model.refit(model.observed() + change));
    let [term] = law.terms.as_slice() else {
        panic!("{law:?}");
    };
    assert_eq!(term.function, "power 2", "{law:?}");
    let name = &model.channel_names()[channel];
    assert_eq!((term.along, &term.pattern), (Some("reading"), name));
    let found = term
        .parameters
        .iter()
        .find(|p| p.name == "amplitude")
        .unwrap();
    // The form of the law is exact; what the noise leaves is less: 1 % of its size.
    assert!(
        (found.value / truth - 1.0).abs() < 0.01,
        "{found:?} {truth}"
    );
}

/// A sum of two terms, by the change that it makes: what the formula that is told makes of every reading.
#[test]
fn a_sum_of_two_terms_is_found() {
    let truth = |p: &Place| {
        0.02 * (2.0 * std::f64::consts::PI * p.x / 230.0 + 0.7).cos()
            + if p.time >= 33.0 { 0.015 } else { 0.0 }
    };
    let model = line(5, truth);
    let law = told(&model);
    let mut classes: Vec<&str> = law.terms.iter().map(|t| t.function.as_str()).collect();
    classes.sort_unstable();
    assert_eq!(classes, ["cosine", "step"], "{law:?}");
    let made = law.effect.columns(&model, &Shape::only())[0].dense(model.places().len());
    let wanted = model.places().iter().map(truth);
    let wanted = DVector::from_iterator(model.places().len(), wanted);
    // Both less what a straight line absorbs.
    let seen = |change: DVector<f64>| {
        let columns = model.freedom().columns;
        let fit = (columns.tr_mul(&columns)).cholesky().unwrap();
        let sizes = fit.solve(&columns.tr_mul(&change));
        (change - columns * sizes).norm()
    };
    // k·u: of five parameters that are known to one part in |truth|/noise each, √5 of them with an allowance.
    let noise = 1e-3;
    let off = seen(&made - &wanted);
    assert!(off < 2.0 * 5f64.sqrt() * noise, "{off}");
}

/// Without a gap, with a curve that is no law, and with a bump nothing is told.
#[test]
fn what_is_no_law_is_not_told() {
    let wave = |u: f64| (2.0 * (u - 0.3)).sinh().sin() * (1.0 + u) + 0.6 * (9.0 * u * u).cos();
    let cases: [(&str, Form); 4] = [
        ("nothing", Box::new(|_: &Place| 0.0)),
        (
            "a curve",
            Box::new(move |p: &Place| 0.006 * wave(p.x / 1000.0)),
        ),
        (
            "a small curve",
            Box::new(move |p: &Place| 0.002 * wave(p.x / 1000.0)),
        ),
        (
            "a bump",
            Box::new(|p: &Place| 0.012 * (-((p.x - 420.0) / 130.0).powi(2)).exp()),
        ),
    ];
    for (k, (name, change)) in cases.iter().enumerate() {
        let found = law(&line(20 + k as u64, change), &options(), 0).unwrap();
        assert!(matches!(found, LawFound::None(_)), "{name}: {found:?}");
    }
}

/// Beside a cosine lies a lag that begins anew in each set: it comes back along the loads, is no noise, and would excuse what
/// the law leaves. Without it the same law is told.
#[test]
fn a_law_beside_what_is_no_noise_is_refused() {
    let line = CalibrationSimulation {
        line: [0.5, 2e-3],
        full_scale: 1000.0,
        loads: 60,
        sets: 6,
        both_directions: false,
        noise: 1e-3,
        disturbances: Vec::new(),
    };
    let line = CalibrationLine::new(&simulate(&line, 3).unwrap(), None).unwrap();
    let waves = |lag: f64| {
        changed(&line, move |p| {
            let begun = 0.618 * 2.0 * PI * f64::from(p.repeat).powi(2);
            0.01 * (2.0 * PI * p.x / 310.0).cos() + lag * (2.0 * PI * p.x / 83.0 + begun).sin()
        })
    };
    assert_eq!(told(&waves(0.0)).terms[0].function, "cosine");
    match law(&waves(1e-3), &options(), 0) {
        Ok(LawFound::None(none)) => assert!(none.why.contains("is no noise"), "{none:?}"),
        other => panic!("{other:?}"),
    }
}

/// Where there is no law it is told how often one of that size would have been found: often if it is great, seldom if
/// it is small.
#[test]
fn the_power_grows_with_the_size() {
    let wave = |u: f64| (2.0 * (u - 0.3)).sinh().sin() * (1.0 + u) + 0.6 * (9.0 * u * u).cos();
    let part = |size: f64| {
        let model = line(31, |p| size * wave(p.x / 1000.0));
        match law(&model, &options(), 12).unwrap() {
            LawFound::None(none) => none.power.unwrap(),
            other => panic!("{other:?}"),
        }
    };
    let (small, great) = (part(0.0006), part(0.02));
    // Monte Carlo: of twelve, the seed stated; a third of the laws that a line shows are told from smooth curves.
    assert!(great.found >= small.found + 3, "{small:?} {great:?}");
    assert!(great.ci95[0] <= great.probability && great.probability <= great.ci95[1]);
}

/// The formula that is written is read again as the same effect, and named on another campaign.
#[test]
fn a_law_is_read_back_and_named_on_another_campaign() {
    let truth = |p: &Place| 0.01 * (2.0 * std::f64::consts::PI * p.x / 310.0).cos();
    let model = line(7, truth);
    let mut found = told(&model);
    found.effect.name = "swing".to_owned();
    let text = errsep::diagnosis::written(&found.effect, &model, &[]);
    let read: TabulatedEffects = toml::from_str(&text).unwrap();
    let effect: Tabulated = read.effect.into_iter().next().unwrap().into_inner();
    assert_eq!(effect, found.effect, "{text}");
    let other = line(8, truth);
    assert_eq!(effect.fault(&other), None);
    let told = diagnose_with(&other, vec![Box::new(effect)], &options());
    assert_eq!(
        told.verdict.effects,
        ["swing"],
        "{}",
        told.verdict.statement
    );
}
