//! The orthogonal fit: its optimum, its bias on short arcs, its uncertainty, and the fit of NISTIR 6868.

use errsep_models::circle::{
    AlgebraicFit, Circle, CircleError, CircleSimulation, NistirEnding, Point, algebraic,
    circularity, nistir_fit, orthogonal_fit, simulate,
};
use std::f64::consts::FRAC_PI_4;

fn six() -> Vec<Point> {
    [(1., 7.), (2., 6.), (5., 8.), (7., 7.), (9., 5.), (3., 7.)]
        .map(|(x, y)| Point::new(x, y))
        .to_vec()
}

#[test]
fn six_points_of_gander_golub_strebel() {
    // Tolerance: half a unit of the last published digit.
    let fit = orthogonal_fit(&six(), None).unwrap();
    let c = fit.circle;
    assert!((c.centre.x - 4.739782).abs() < 5.1e-7, "{c:?}");
    assert!((c.centre.y - 2.983533).abs() < 5.1e-7, "{c:?}");
    assert!((c.radius - 4.714226).abs() < 5.1e-7, "{c:?}");
    let squares: f64 = fit.residuals_um.iter().map(|r| r * r * 1e-6).sum();
    assert!((squares - 1.2275991).abs() < 5.1e-8, "{squares}");
}

fn short_arc() -> CircleSimulation {
    CircleSimulation {
        radius: 50.0,
        count: 36,
        arc: FRAC_PI_4,
        noise_um: 20.0,
        ..CircleSimulation::default()
    }
}

#[test]
fn short_arcs_do_not_shrink_the_orthogonal_circle() {
    let seeds = 8000;
    let (mut orthogonal, mut kasa, mut squares, mut predicted) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..seeds {
        let points = simulate(&short_arc(), seed).unwrap();
        let fit = orthogonal_fit(&points, Some(20.0)).unwrap();
        let error = 1e3 * (fit.circle.radius - 50.0);
        orthogonal += error;
        squares += error * error;
        predicted += 1e6 * fit.covariance[(2, 2)];
        kasa += 1e3 * (algebraic(&points, AlgebraicFit::Kasa).unwrap().radius - 50.0);
    }
    let n = seeds as f64;
    let (orthogonal, kasa) = (orthogonal / n, kasa / n);
    let scatter = (squares / n - orthogonal * orthogonal).sqrt();
    println!(
        "mean radius error: orthogonal {orthogonal:.2} µm, Kasa {kasa:.2} µm, scatter {scatter:.1}"
    );
    assert!(orthogonal.abs() < 5.0, "{orthogonal}");
    // Tolerance: k·u, three standard errors of both means: 3 √(scatter²/n + 2.1²).
    let k_u = 3.0 * (scatter * scatter / n + 2.1 * 2.1).sqrt();
    assert!((kasa + 9.3).abs() < k_u, "{kasa}");
    // Tolerance: the scatter of a standard deviation of 8000 is 0.8 %; the covariance is of first
    // order, and at u(R)/R = 0.3 % the second adds about as much.
    assert!((scatter / (predicted / n).sqrt() - 1.0).abs() < 0.03);
}

#[test]
fn residuals_are_those_of_the_circle_and_the_gradient_vanishes() {
    let points = simulate(&short_arc(), 3).unwrap();
    let fit = orthogonal_fit(&points, None).unwrap();
    for (p, r) in points.iter().zip(&fit.residuals_um) {
        let own = 1e3 * (p.distance(fit.circle.centre) - fit.circle.radius);
        // Tolerance: epsilons of 100 mm in µm.
        assert!((own - r).abs() < 1e-10, "{own} {r}");
    }
    let scale: f64 = fit.residuals_um.iter().map(|r| r.abs()).sum();
    for column in fit.jacobian.column_iter() {
        let slope: f64 = column
            .iter()
            .zip(&fit.residuals_um)
            .map(|(j, r)| j * r)
            .sum();
        // Tolerance: rounding of the coordinates, 50 mm · ε · 36 in µm against residuals of 20 µm.
        assert!(slope.abs() < 1e-10 * scale, "{slope}");
    }
}

#[test]
fn exact_full_circle() {
    let what = CircleSimulation {
        noise_um: 0.0,
        centre: Point::new(123.0, -45.0),
        ..CircleSimulation::default()
    };
    let points = simulate(&what, 0).unwrap();
    let fit = orthogonal_fit(&points, None).unwrap();
    // Tolerance: 100 epsilons of 170 mm.
    assert!((fit.circle.radius - 50.0).abs() < 4e-12);
    assert!(fit.circle.centre.distance(what.centre) < 4e-12);
    for z in circularity(&points, fit.circle).unwrap().zones() {
        assert!(z.width_um < 1e-9, "{z:?}");
    }
}

#[test]
fn known_lobes_show_as_residuals() {
    // Three lobes of 2 µm on a full circle are orthogonal to centre and radius to first order.
    let what = CircleSimulation {
        noise_um: 0.0,
        count: 360,
        lobes: vec![(3, 2.0, 0.0)],
        ..CircleSimulation::default()
    };
    let points = simulate(&what, 0).unwrap();
    let fit = orthogonal_fit(&points, None).unwrap();
    let lsci = circularity(&points, fit.circle).unwrap().least_squares;
    // Tolerance: second order, (2 µm)²/50 mm = 1e-4 µm.
    assert!((lsci.width_um - 4.0).abs() < 2e-4, "{lsci:?}");
    assert!((fit.circle.radius - 50.0).abs() < 1e-6);
}

#[test]
fn three_points_need_a_given_noise() {
    let three = &six()[..3];
    assert_eq!(
        orthogonal_fit(three, None).unwrap_err(),
        CircleError::NoRedundancy
    );
    let fit = orthogonal_fit(three, Some(1.0)).unwrap();
    assert!(fit.residuals_um.iter().all(|r| r.abs() < 1e-9));
    assert!(fit.standard_uncertainties().iter().all(|u| *u > 0.0));
}

#[test]
fn noise_on_a_line_is_no_circle() {
    // Points along a line, deviations alternating: no circle is better than the line.
    let points: Vec<Point> = (0..20)
        .map(|i| Point::new(f64::from(i), if i % 2 == 0 { 1e-3 } else { -1e-3 }))
        .collect();
    match orthogonal_fit(&points, None) {
        Err(e) => println!("{e}"),
        Ok(fit) => assert!(
            fit.standard_uncertainties()[2] > 0.1 * fit.circle.radius,
            "{fit:?}"
        ),
    }
}

fn arcs() -> Vec<(f64, Vec<Point>)> {
    [std::f64::consts::TAU, 3.0, FRAC_PI_4]
        .into_iter()
        .map(|arc| {
            let what = CircleSimulation { arc, ..short_arc() };
            (arc, simulate(&what, 5).unwrap())
        })
        .collect()
}

#[test]
fn nistir_iteration_ends_at_the_kasa_fit() {
    for (arc, points) in arcs() {
        let kasa = algebraic(&points, AlgebraicFit::Kasa).unwrap();
        for start in [
            Circle {
                centre: Point::new(1.0, -2.0),
                radius: 40.0,
            },
            Circle {
                centre: Point::new(30.0, 10.0),
                radius: 5.0,
            },
            Circle {
                centre: Point::new(200.0, 300.0),
                radius: 1.0,
            },
        ] {
            let fit = nistir_fit(&points, start).unwrap();
            if fit.ending == NistirEnding::IterationLimit {
                println!("arc {arc}: {start:?} not reached in 20 iterations");
                continue;
            }
            // Tolerance: its own step test, ε^(2/3) of 50 mm = 2e-9, before a quadratic last step.
            assert!(
                fit.circle.centre.distance(kasa.centre) < 2e-8,
                "{arc} {fit:?} {kasa:?}"
            );
            assert!(
                (fit.circle.radius - kasa.radius).abs() < 2e-8,
                "{arc} {fit:?}"
            );
            assert!((2..=20).contains(&fit.iterations), "{fit:?}");
        }
    }
}

#[test]
fn nistir_full_circle_is_no_different_from_the_orthogonal_one() {
    // 20 µm noise, so that the differences are of the order noise²/R: 1e-5 mm in the radius.
    let (_, points) = arcs().swap_remove(0);
    let orthogonal = orthogonal_fit(&points, None).unwrap().circle;
    let start = Circle {
        centre: Point::new(1.0, 1.0),
        radius: 40.0,
    };
    let nistir = nistir_fit(&points, start).unwrap().circle;
    assert!((nistir.radius - orthogonal.radius).abs() < 2e-5);
    assert!(nistir.centre.distance(orthogonal.centre) < 2e-5);
}

#[test]
fn nistir_radius_may_come_out_negative() {
    let (_, points) = arcs().swap_remove(0);
    let start = Circle {
        centre: Point::new(1.0, -2.0),
        radius: -40.0,
    };
    let fit = nistir_fit(&points, start).unwrap();
    assert!(fit.signed_radius < 0.0);
    assert_eq!(fit.circle.radius, -fit.signed_radius);
}

#[test]
fn nistir_cannot_leave_a_zero_radius() {
    let (_, points) = arcs().swap_remove(0);
    let start = Circle {
        centre: Point::new(1.0, -2.0),
        radius: 0.0,
    };
    assert_eq!(
        nistir_fit(&points, start).unwrap_err(),
        CircleError::RadiusNotPositive { radius: 0.0 }
    );
    let none = CircleSimulation {
        radius: 0.0,
        ..short_arc()
    };
    assert!(matches!(
        simulate(&none, 0),
        Err(CircleError::RadiusNotPositive { .. })
    ));
}
