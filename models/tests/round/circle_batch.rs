//! Fits of many circles against the fit of one.

use errsep_models::circle::{
    CircleError, CircleSimulation, Point, orthogonal_fit, orthogonal_fits, simulate,
};

fn sets() -> Vec<Vec<Point>> {
    let mut sets = Vec::new();
    for seed in 0..300 {
        let k = seed as f64;
        let what = CircleSimulation {
            count: 5 + (seed as usize * 7) % 60,
            radius: [0.5, 20.0, 300.0][seed as usize % 3],
            centre: Point::new(10.0 * k, -3.0 * k),
            noise_um: [0.0, 0.1, 5.0, 200.0][seed as usize % 4],
            arc: [6.3, 5.0, 3.3, 1.0][seed as usize / 4 % 4],
            lobes: vec![(3, 2.0, 0.1 * k)],
            ..CircleSimulation::default()
        };
        sets.push(simulate(&what, seed).unwrap());
    }
    let on = |count: usize, radius: f64| {
        (0..count).map(move |k| {
            let t = std::f64::consts::TAU * k as f64 / count as f64;
            Point::new(radius * t.cos(), radius * t.sin())
        })
    };
    sets.push(on(36, 10.0).collect());
    sets.push(on(18, 10.0).chain(on(18, 11.0)).collect());
    sets.push(
        on(36, 1.0)
            .map(|p| Point::new(10.0 * p.x, 9.0 * p.y))
            .collect(),
    );
    sets.push(
        on(12, 10.0)
            .chain(on(12, 10.0))
            .chain(on(12, 10.0))
            .collect(),
    );
    sets
}

#[test]
fn many_at_once_are_fitted_as_one_by_one() {
    let sets = sets();
    for noise in [None, Some(3.0)] {
        for (k, (many, set)) in orthogonal_fits(&sets, noise).iter().zip(&sets).enumerate() {
            let one = orthogonal_fit(set, noise);
            let (many, one) = match (many, &one) {
                (Ok(many), Ok(one)) => (many, one),
                (many, one) => {
                    assert_eq!(many.as_ref().err(), one.as_ref().err(), "set {k}");
                    continue;
                }
            };
            // Tolerance: 1e-12 of the size and the rounding of coordinates far away, epsilons.
            let size =
                one.circle.radius + 1e-3 * (one.circle.centre.x.abs() + one.circle.centre.y.abs());
            let off = [
                many.circle.centre.x - one.circle.centre.x,
                many.circle.centre.y - one.circle.centre.y,
                many.circle.radius - one.circle.radius,
            ];
            assert!(
                off.iter().all(|d| d.abs() <= 1e-12 * size),
                "set {k}: {off:?}"
            );
            let noise_off = (many.noise_um - one.noise_um).abs();
            assert!(noise_off <= 1e-12 * one.noise_um + 1e-9 * size, "set {k}");
            assert_eq!(many.degrees_of_freedom, one.degrees_of_freedom);
            let scale = one.covariance.norm();
            let unit = (many.noise_um / one.noise_um).powi(2);
            if one.noise_um > 1e-6 {
                let off = (many.covariance - one.covariance * unit).norm();
                assert!(off <= 1e-11 * scale, "set {k}: {off:e} of {scale:e}");
            }
        }
    }
}

#[test]
fn what_is_refused_is_refused_with_the_same_reason() {
    let line: Vec<Point> = (0..9).map(|k| Point::new(f64::from(k), 2.0)).collect();
    let sets = vec![
        Vec::new(),
        vec![Point::new(1.0, 1.0); 5],
        line,
        vec![Point::new(f64::NAN, 0.0); 4],
        vec![
            Point::new(0.0, 0.0),
            Point::new(4.0, 0.0),
            Point::new(0.0, 3.0),
        ],
        vec![
            Point::new(1e200, 0.0),
            Point::new(0.0, 1.0),
            Point::new(2.0, 1.0),
            Point::new(3.0, 3.0),
        ],
    ];
    let many = orthogonal_fits(&sets, None);
    for (many, set) in many.iter().zip(&sets) {
        let one = orthogonal_fit(set, None).unwrap_err();
        // No number equals no number: their words do.
        assert_eq!(many.as_ref().unwrap_err().to_string(), one.to_string());
    }
    assert!(matches!(many[4], Err(CircleError::NoRedundancy)));
}
