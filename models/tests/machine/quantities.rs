//! Every model offers its results as quantities of the GUM, with the degrees of freedom of its noise.

use errsep_models::circle::{Point, orthogonal_fit};
use errsep_models::diagonal::{Assumptions, DiagonalSimulation, regress};
use errsep_models::four_sensor::{Choice, Geometry, Line, Outputs, Penalised, Separator, Settings};
use errsep_models::fourier::{
    Combination, Compensation, FourierSimulation, Section, separate, simulate,
};
use errsep_models::uncertainty::DegreesOfFreedom;

#[test]
fn circle_through_four_points_has_one_degree_of_freedom() {
    let points = [(1.01, 0.0), (0.0, 1.0), (-1.01, 0.0), (0.0, -1.0)];
    let points: Vec<Point> = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
    let [radius, x, y] = orthogonal_fit(&points, None).unwrap().quantities().unwrap();
    assert_eq!(radius.degrees_of_freedom, DegreesOfFreedom::Finite(1.0));
    // Deviations ±5 um of four points: s = sqrt(4 · 25 / 1) um, s/2 for the radius, s/√2 for the
    // centre. Tolerance: truncation, the sensitivities differ from those of a circle by 1e-5.
    assert!((radius.value - 1.005).abs() < 1e-9, "{radius:?}");
    assert!(
        (radius.standard_uncertainty - 5e-3).abs() < 1e-6,
        "{radius:?}"
    );
    for centre in [x, y] {
        let wanted = 1e-2 / 2.0_f64.sqrt();
        assert!(
            (centre.standard_uncertainty - wanted).abs() < 1e-6,
            "{centre:?}"
        );
    }
    let given = orthogonal_fit(&points, Some(1.0))
        .unwrap()
        .quantities()
        .unwrap();
    assert!(
        given
            .iter()
            .all(|q| q.degrees_of_freedom == DegreesOfFreedom::Infinite)
    );
}

#[test]
fn fourier_profile_and_orders_carry_the_freedom_of_the_noise() {
    let what = FourierSimulation {
        samples: 200,
        ..FourierSimulation::default()
    };
    let (scans, _) = simulate(&what, 3).unwrap();
    let section = Section {
        length: what.length,
        orders: 30,
    };
    let found = separate(
        &scans,
        section,
        Compensation::Chord,
        Combination::LeastSquares,
        None,
    )
    .unwrap();
    let profile = found.profile_quantities().unwrap();
    let orders = found.order_quantities().unwrap();
    assert_eq!(profile.len(), 200);
    assert_eq!(orders.len(), 2 * (30 - found.lost.len()));
    // Three spacings: two of three coefficients, real and imaginary, are left over in each order of the
    // coarser half, less the three steps at the joints.
    let left = DegreesOfFreedom::Finite(2.0 * 2.0 * 49.0 - 3.0);
    assert!(
        profile
            .iter()
            .chain(&orders)
            .all(|q| q.degrees_of_freedom == left)
    );
    assert_eq!(profile[7].value, found.workpiece[7]);
    assert_eq!(profile[7].standard_uncertainty, found.workpiece_std[7]);
    assert_eq!(orders[1].value, found.orders[0].coefficient.im);
}

#[test]
fn step_diagonal_errors_are_named_with_their_positions() {
    let what = DiagonalSimulation::default();
    let (readings, _, _) = errsep_models::diagonal::simulate(&what, 2);
    let fit = regress(&what.zone, &readings, &Assumptions::default()).unwrap();
    let found = fit.components_at_positions().unwrap();
    let yaw = fit
        .components
        .iter()
        .find(|c| c.component.name() == "ECY")
        .unwrap();
    let last = found.iter().find(|q| q.label == "ECY at 500 mm").unwrap();
    assert_eq!(
        (last.value, last.standard_uncertainty),
        (yaw.values[5], yaw.std[5])
    );
    assert_eq!(last.unit, "rad");
    let freedom = DegreesOfFreedom::Finite(fit.degrees_of_freedom as f64);
    assert!(
        found
            .iter()
            .chain(&fit.angles().unwrap())
            .all(|q| q.degrees_of_freedom == freedom)
    );
}

#[test]
fn four_sensor_profiles_carry_what_the_residuals_leave() {
    let geometry = Geometry::new(5.0, [1, 1, 5], 30).unwrap();
    let rows = (0..30_i32).map(|k| [0, 1, 2, 3].map(|s| f64::from((7 * k + 3 * s) % 11)));
    let outputs = Outputs::new(geometry, 0.0, rows.collect()).unwrap();
    let separator = Separator::new(&geometry, Penalised::Profile, Line::EndPoints).unwrap();
    let of = |settings: &Settings| separator.separate(&outputs, settings).unwrap();
    let fixed = Settings {
        choice: Choice::Fixed(0.1),
        ..Settings::default()
    };
    let found = of(&fixed);
    let quantities = found.quantities(&outputs).unwrap();
    assert_eq!(quantities.len(), 30 + 30 + 37);
    let gamma = quantities
        .iter()
        .find(|q| q.label == "gamma at 15 mm")
        .unwrap();
    assert_eq!(gamma.value, found.tilt.values[3]);
    assert_eq!(
        (gamma.standard_uncertainty, gamma.unit.as_str()),
        (found.tilt.std[3], "rad")
    );
    let left = 60.0 - found.chosen.point.effective_parameters;
    assert_eq!(gamma.degrees_of_freedom, DegreesOfFreedom::Finite(left));
    let stated = of(&Settings {
        noise: Some(1.0),
        ..fixed
    });
    assert_eq!(
        stated.quantities(&outputs).unwrap()[0].degrees_of_freedom,
        DegreesOfFreedom::Infinite
    );
}
