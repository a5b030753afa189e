//! Centre, radius and the deviation of a point: full circles and arcs, noise stated and not, and with a
//! form besides, which the answer takes for noise and tells.

use errsep_models::circle::{CircleSimulation, Point, orthogonal_fit, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::tally::{ONE_SIGMA, Row, Tally};

const NOISE_UM: f64 = 1.0;
/// Undulations and amplitude, µm, of the form.
const FORM: (u32, f64) = (3, 3.0);
/// The level at which the command says that neighbouring deviations are alike.
const ALIKE: f64 = 0.01;

struct Case {
    points: usize,
    arc_degrees: f64,
    stated: bool,
    form: bool,
    /// Passes, and over how many points half of the noise's variance is correlated in each.
    passes: Option<(usize, f64)>,
}

/// What one data set gives: centre x, centre y, radius, deviation, and whether form is seen.
type Counts = ([Tally; 4], bool);

pub fn rows(seeds: u64) -> Vec<Row> {
    let white = [(8, 360.0), (36, 360.0), (36, 200.0), (36, 90.0), (36, 20.0)]
        .into_iter()
        .flat_map(|(points, arc_degrees)| {
            [false, true].map(|stated| Case {
                points,
                arc_degrees,
                stated,
                form: false,
                passes: None,
            })
        });
    let formed = [360.0, 90.0].map(|arc_degrees| Case {
        points: 36,
        arc_degrees,
        stated: false,
        form: true,
        passes: None,
    });
    let passed = [
        (2, 0.0),
        (4, 0.0),
        (1, 4.0),
        (2, 4.0),
        (4, 4.0),
        (8, 4.0),
        (4, 12.0),
    ];
    let passed = passed.map(|passes| Case {
        points: 72,
        arc_degrees: 360.0,
        stated: false,
        form: false,
        passes: Some(passes),
    });
    white
        .chain(formed)
        .chain(passed)
        .flat_map(|case| rows_of(&case, seeds))
        .collect()
}

fn rows_of(case: &Case, seeds: u64) -> Vec<Row> {
    let what = CircleSimulation {
        centre: Point::new(3.0, -2.0),
        count: case.points,
        arc: f64::to_radians(case.arc_degrees),
        noise_um: NOISE_UM,
        lobes: if case.form {
            vec![(FORM.0, FORM.1, 0.7)]
        } else {
            Vec::new()
        },
        ..CircleSimulation::default()
    };
    let found: Vec<Counts> = (0..seeds)
        .into_par_iter()
        .filter_map(|seed| count(&what, case, seed))
        .collect();
    let seen = found.iter().filter(|f| f.1).count();
    let mut name = format!(
        "{} points over {}°, noise {}",
        case.points,
        case.arc_degrees,
        if case.stated { "stated" } else { "estimated" }
    );
    if let Some((passes, length)) = case.passes {
        let noise = if length > 0.0 {
            format!("half of it correlated over {length} points")
        } else {
            "white".to_owned()
        };
        let plural = if passes == 1 { "" } else { "es" };
        name += &format!(", {passes} pass{plural}, {noise}");
    }
    if case.form {
        name += &format!(
            ", {} lobes of {} µm (seen in {:.1} %)",
            FORM.0,
            FORM.1,
            100.0 * seen as f64 / found.len().max(1) as f64
        );
    }
    // A stated noise is no result, and with a form there is no true one.
    let told = case.stated || case.form || case.passes.is_some();
    let quantities = if told { 3 } else { 4 };
    ["centre x", "centre y", "radius", "deviation"]
        .into_iter()
        .take(quantities)
        .enumerate()
        .map(|(k, quantity)| Row {
            case: name.clone(),
            quantity: quantity.to_owned(),
            seeds: found.len() as u64,
            tally: found
                .iter()
                .fold(Tally::default(), |sum, (tallies, _)| sum.and(tallies[k])),
        })
        .collect()
}

/// Points of several passes with noise of which half of the variance is correlated along each, and the pass of each point.
fn passed(
    what: &CircleSimulation,
    (passes, length): (usize, f64),
    seed: u64,
) -> (Vec<Point>, Vec<usize>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let (decay, share) = if length > 0.0 {
        (f64::exp(-1.0 / length), 0.5f64)
    } else {
        (0.0, 0.0)
    };
    let (mut points, mut of) = (Vec::new(), Vec::new());
    for pass in 0..passes {
        let mut slow = [normal(), normal()];
        for k in 0..what.count {
            let angle = std::f64::consts::TAU * k as f64 / what.count as f64;
            let [x, y] = [angle.cos(), angle.sin()].map(|part| what.radius * part);
            let mut noise = [0.0; 2];
            for (noise, slow) in noise.iter_mut().zip(&mut slow) {
                *slow = decay * *slow + (1.0 - decay * decay).sqrt() * normal();
                *noise = 1e-3 * NOISE_UM * ((1.0 - share).sqrt() * normal() + share.sqrt() * *slow);
            }
            points.push(Point::new(
                what.centre.x + x + noise[0],
                what.centre.y + y + noise[1],
            ));
            of.push(pass);
        }
    }
    (points, of)
}

fn count(what: &CircleSimulation, case: &Case, seed: u64) -> Option<Counts> {
    let (points, passes) = match case.passes {
        Some(passes) => passed(what, passes, seed),
        None => {
            let points = simulate(what, seed).ok()?;
            let passes = vec![0; points.len()];
            (points, passes)
        }
    };
    let mut fit = orthogonal_fit(&points, case.stated.then_some(NOISE_UM)).ok()?;
    fit.count_passes(&passes);
    let [radius, x, y] = fit.quantities().ok()?;
    let mut tallies = [Tally::default(); 4];
    for (k, (quantity, truth)) in [
        (x, what.centre.x),
        (y, what.centre.y),
        (radius, what.radius),
    ]
    .into_iter()
    .enumerate()
    {
        tallies[k].add(
            quantity.value - truth,
            quantity.standard_uncertainty,
            quantity.degrees_of_freedom.as_f64(),
        );
    }
    // The interval that the printed degrees of freedom give a standard deviation.
    let freedom = fit.degrees_of_freedom as f64;
    let chi = ChiSquared::new(freedom).ok()?;
    let share = chi.cdf(freedom * (fit.noise_um / NOISE_UM).powi(2));
    let inside = |nominal: f64| (share - 0.5).abs() <= nominal / 2.0;
    tallies[3].add_inside(inside(ONE_SIGMA), inside(0.95));
    let alike = fit.neighbours_alike(&points, &passes);
    let alike = alike.is_some_and(|p| p < ALIKE);
    Some((tallies, alike))
}
