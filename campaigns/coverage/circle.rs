//! Centre, radius and the deviation of a point: full circles and arcs, noise stated and not, and with a
//! form besides, which the answer takes for noise and tells.

use errsep_models::circle::{CircleSimulation, Point, orthogonal_fit, simulate};
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
            })
        });
    let formed = [360.0, 90.0].map(|arc_degrees| Case {
        points: 36,
        arc_degrees,
        stated: false,
        form: true,
    });
    white
        .chain(formed)
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
        .filter_map(|seed| count(&what, case.stated, seed))
        .collect();
    let seen = found.iter().filter(|f| f.1).count();
    let mut name = format!(
        "{} points over {}°, noise {}",
        case.points,
        case.arc_degrees,
        if case.stated { "stated" } else { "estimated" }
    );
    if case.form {
        name += &format!(
            ", {} lobes of {} µm (seen in {:.1} %)",
            FORM.0,
            FORM.1,
            100.0 * seen as f64 / found.len().max(1) as f64
        );
    }
    // A stated noise is no result, and with a form there is no true one.
    let quantities = if case.stated || case.form { 3 } else { 4 };
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

fn count(what: &CircleSimulation, stated: bool, seed: u64) -> Option<Counts> {
    let points = simulate(what, seed).ok()?;
    let fit = orthogonal_fit(&points, stated.then_some(NOISE_UM)).ok()?;
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
    let alike = fit
        .neighbours_alike(&points, &vec![0; points.len()])
        .is_some_and(|p| p < ALIKE);
    Some((tallies, alike))
}
