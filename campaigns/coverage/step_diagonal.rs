//! Error functions, squareness, mirrors, reversals and the paper's closed forms of step-diagonal tests:
//! targets, noise stated and not, there and back, slopes measured apart.

use std::collections::BTreeMap;

use errsep_models::diagonal::{
    Assumptions, Axis, Component, ComponentEstimate, Determined, DiagonalSimulation, ErrorTables,
    Measured, Misalignments, Sequence, StepDiagonalFit, Target, WorkZone, closed_forms, regress,
    simulate,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rayon::prelude::*;

use super::tally::{Row, Tally};

const NOISE_UM: f64 = 0.2;

/// Standard uncertainty of a slope measured apart, µm/mm.
const SLOPE_STD: f64 = 5e-4;

/// A test as people make it.
struct Case {
    name: &'static str,
    what: DiagonalSimulation,
    stated: bool,
    /// Errors taken as zero, which they are.
    zero: Vec<Component>,
    /// Degrees of freedom of the slope of X, where it is measured.
    slope: Option<DegreesOfFreedom>,
}

fn cases() -> Vec<Case> {
    let body = DiagonalSimulation {
        zone: WorkZone {
            travel: [600.0, 500.0, 400.0],
            steps: 3,
        },
        noise: NOISE_UM,
        ..DiagonalSimulation::default()
    };
    let case = |name, stated, what| Case {
        name,
        what,
        stated,
        zero: Vec::new(),
        slope: None,
    };
    let retro = DiagonalSimulation {
        targets: vec![Target::RetroReflector],
        ..body.clone()
    };
    let back = DiagonalSimulation {
        backward: true,
        reversal: 1.0,
        reversal_rotation: 5e-6,
        ..body.clone()
    };
    let usual = DiagonalSimulation {
        rotation: 0.0,
        mirror: 0.0,
        sequences: vec![Sequence::XYZ],
        repeats: 2,
        ..body.clone()
    };
    vec![
        case("mirror, noise estimated", false, body.clone()),
        case("mirror, noise stated", true, body.clone()),
        case("retro-reflector, noise estimated", false, retro),
        case("mirror there and back, noise estimated", false, back),
        Case {
            zero: Component::all().filter(|c| c.rotation).collect(),
            ..case(
                "mirror, one sequence, no angular errors, noise estimated",
                false,
                usual,
            )
        },
        Case {
            slope: Some(DegreesOfFreedom::Infinite),
            ..case(
                "mirror, slope of X known, noise estimated",
                false,
                body.clone(),
            )
        },
        Case {
            slope: Some(DegreesOfFreedom::Finite(9.0)),
            ..case(
                "mirror, slope of X from ten repeats, noise estimated",
                false,
                body,
            )
        },
    ]
}

/// Counts by what is printed.
type Counts = BTreeMap<&'static str, Tally>;

pub fn rows(seeds: u64) -> Vec<Row> {
    let mut rows = Vec::new();
    for case in cases() {
        let counts: Vec<Counts> = (0..seeds)
            .into_par_iter()
            .filter_map(|seed| counted(&case, seed))
            .collect();
        let mut sums = Counts::new();
        for one in &counts {
            for (what, tally) in one {
                let sum = sums.entry(what).or_default();
                *sum = sum.and(*tally);
            }
        }
        rows.extend(sums.into_iter().map(|(quantity, tally)| Row {
            case: case.name.to_owned(),
            quantity: quantity.to_owned(),
            seeds: counts.len() as u64,
            tally,
        }));
    }
    rows
}

fn counted(case: &Case, seed: u64) -> Option<Counts> {
    let zone = &case.what.zone;
    let (readings, errors, mirrors) = simulate(&case.what, seed);
    let quiet = DiagonalSimulation {
        noise: 0.0,
        ..case.what.clone()
    };
    let exact = simulate(&quiet, seed).0;
    let (slopes, true_slopes) = slopes(case, &errors, seed);
    let fit = |readings, noise, slopes| {
        let assumptions = Assumptions {
            zero: case.zero.clone(),
            slopes,
            noise,
        };
        regress(zone, readings, &assumptions).ok()
    };
    let found = fit(&readings, case.stated.then_some(NOISE_UM), slopes)?;
    // What a part that is determined only in combinations would be without noise.
    let noiseless = fit(&exact, Some(NOISE_UM), true_slopes)?;

    let mut counts = Counts::new();
    let functions = found.components.iter().zip(&noiseless.components);
    for (estimate, without) in functions {
        let truth = truth(estimate.determined, errors.of(estimate.component), without);
        let what = match (estimate.component.rotation, estimate.determined) {
            (_, Determined::Partly) => "error functions, in part",
            (false, _) => "translations",
            (true, _) => "rotations",
        };
        count_function(&mut counts, what, estimate, &truth);
    }
    for (estimate, without) in found.reversals.iter().zip(&noiseless.reversals) {
        let values = errors.reversal_of(estimate.component);
        let truth = truth(estimate.determined, values, without);
        count_function(&mut counts, "reversals", estimate, &truth);
    }
    count_angles(&mut counts, &found, &case.what, &errors, &mirrors);

    let degrees = found.noise_degrees_of_freedom?.as_f64();
    let noise = found.noise?;
    let forms = closed_forms(zone, &readings).ok()?;
    for (form, without) in forms.iter().zip(closed_forms(zone, &exact).ok()?) {
        let tally = counts.entry("closed forms").or_default();
        for (k, gain) in form.profile_gains.iter().enumerate().skip(1) {
            tally.add(form.profile[k] - without.profile[k], gain * noise, degrees);
        }
    }
    Some(counts)
}

/// The slope of X as measured, and as it is.
fn slopes(case: &Case, errors: &ErrorTables, seed: u64) -> (Vec<Measured>, Vec<Measured>) {
    let (Some(degrees), Some(exx)) = (case.slope, Component::from_name("EXX")) else {
        return (Vec::new(), Vec::new());
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(2);
    let end = errors.of(exx).last().copied().unwrap_or(0.0);
    let of = |slope, std| {
        vec![Measured {
            axis: Axis::X,
            slope,
            std,
            degrees_of_freedom: degrees,
        }]
    };
    let slope = end / case.what.zone.travel[0];
    let drawn: f64 = StandardNormal.sample(&mut random);
    let std = match degrees {
        DegreesOfFreedom::Infinite => SLOPE_STD,
        DegreesOfFreedom::Finite(nu) => {
            let square = ChiSquared::new(nu).map_or(nu, |law| law.sample(&mut random));
            SLOPE_STD * (square / nu).sqrt()
        }
    };
    (of(slope + SLOPE_STD * drawn, std), of(slope, SLOPE_STD))
}

/// The true values of what is given of an error function.
fn truth(determined: Determined, values: &[f64], noiseless: &ComponentEstimate) -> Vec<f64> {
    let (first, last) = (
        values.first().copied().unwrap_or(0.0),
        values.last().copied().unwrap_or(0.0),
    );
    let end = values.len().saturating_sub(1).max(1) as f64;
    let less = |of: &dyn Fn(usize) -> f64| {
        let points = values.iter().enumerate();
        points.map(|(i, v)| v - of(i)).collect::<Vec<f64>>()
    };
    match determined {
        Determined::Wholly => values.to_vec(),
        Determined::ShapeOnly => less(&|i| first + (last - first) * i as f64 / end),
        Determined::ChangesOnly => less(&|_| first),
        Determined::Partly | Determined::Nothing | Determined::NotTouched => {
            noiseless.values.clone()
        }
    }
}

fn count_function(
    counts: &mut Counts,
    what: &'static str,
    estimate: &ComponentEstimate,
    truth: &[f64],
) {
    for (k, (value, &std)) in estimate.values.iter().zip(&estimate.std).enumerate() {
        // Zero by definition has no uncertainty.
        if std > 0.0 {
            let degrees = estimate.degrees_of_freedom[k].as_f64();
            let tally = counts.entry(what).or_default();
            tally.add(value - truth[k], std, degrees);
        }
    }
}

/// Squareness and the angles of the mirrors.
fn count_angles(
    counts: &mut Counts,
    found: &StepDiagonalFit,
    what: &DiagonalSimulation,
    errors: &ErrorTables,
    mirrors: &Misalignments,
) {
    for l in &found.squareness {
        if let (Some(value), Some(std), Some(degrees)) = (l.value, l.std, l.degrees_of_freedom) {
            let error = value - errors.squareness_of(l.location);
            let tally = counts.entry("squareness").or_default();
            tally.add(error, std, degrees.as_f64());
        }
    }
    for m in &found.mirrors {
        let axes = m.diagonal.mirror_axes(&what.zone);
        let turned = mirrors.get(&(m.diagonal, m.target));
        if let (Some(value), Some(std), Some(degrees), Some(axis), Some(turned)) = (
            m.value,
            m.std,
            m.degrees_of_freedom,
            axes.get(m.direction),
            turned,
        ) {
            let tally = counts.entry("mirror misalignment").or_default();
            tally.add(value - axis.dot(turned), std, degrees.as_f64());
        }
    }
}
