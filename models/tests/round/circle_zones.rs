//! The exact reference circles against brute-force searches that share no code with them.

use errsep_models::circle::{
    CircleError, CircleSimulation, Point, Reference, Zone, reference_zone, simulate,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn width(points: &[Point], c: Point) -> f64 {
    let d: Vec<f64> = points.iter().map(|p| p.distance(c)).collect();
    d.iter().fold(0.0_f64, |a, &b| a.max(b)) - d.iter().fold(f64::INFINITY, |a, &b| a.min(b))
}

fn nearest(points: &[Point], c: Point) -> f64 {
    points
        .iter()
        .map(|p| p.distance(c))
        .fold(f64::INFINITY, f64::min)
}

fn farthest(points: &[Point], c: Point) -> f64 {
    points.iter().map(|p| p.distance(c)).fold(0.0, f64::max)
}

/// Least value over a square of centres: a full grid, then grids a tenth as wide about the five best,
/// down to nothing.
fn search(objective: &dyn Fn(Point) -> f64, about: Point, half: f64) -> (Point, f64) {
    let mut seeds = vec![about];
    let mut reach = half;
    let mut best = (about, objective(about));
    while reach > 1e-13 * half {
        let mut found: Vec<(Point, f64)> = Vec::new();
        for s in &seeds {
            for i in -20..=20 {
                for j in -20..=20 {
                    let c = Point::new(
                        s.x + reach * f64::from(i) / 20.0,
                        s.y + reach * f64::from(j) / 20.0,
                    );
                    found.push((c, objective(c)));
                }
            }
        }
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        if found[0].1 < best.1 {
            best = found[0];
        }
        seeds = found.iter().take(5).map(|f| f.0).collect();
        reach *= 0.2;
    }
    best
}

fn noisy_circles() -> Vec<(Vec<Point>, f64)> {
    let mut sets = Vec::new();
    for seed in 0..12 {
        let what = CircleSimulation {
            count: 24,
            radius: 20.0,
            noise_um: if seed % 2 == 0 { 5.0 } else { 2000.0 },
            lobes: vec![(3, 20.0, 0.3), (5, 8.0, 1.0)],
            ..CircleSimulation::default()
        };
        sets.push((simulate(&what, seed).unwrap(), what.noise_um));
    }
    sets
}

fn zone(points: &[Point], reference: Reference) -> Zone {
    reference_zone(points, reference).unwrap()
}

// Tolerance of the searches: the last grid is 1e-13 of its first width, and the objectives change
// by at most twice the distance: truncation, 1e-9 mm is ample for 2 mm.
const SEARCH: f64 = 1e-9;

#[test]
fn minimum_zone_agrees_with_a_search_of_all_centres() {
    for (points, noise_um) in noisy_circles() {
        let exact = zone(&points, Reference::MinimumZone);
        let half = if noise_um > 100.0 { 6.0 } else { 0.2 };
        let (_, brute) = search(&|c| width(&points, c), Point::default(), half);
        assert!(
            exact.width_um * 1e-3 <= brute + 1e-12,
            "a search found a narrower zone: {} against {brute}",
            exact.width_um * 1e-3
        );
        assert!(
            brute - exact.width_um * 1e-3 < SEARCH,
            "{} {brute}",
            exact.width_um * 1e-3
        );
        assert!(exact.inner_contacts.len() >= 2 && exact.outer_contacts.len() >= 2);
    }
}

#[test]
fn minimum_zone_agrees_with_every_pair_of_pairs() {
    // Few points scattered at random: the zone is nothing like a thin ring and has many local minima.
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut compared = 0;
    for _ in 0..60 {
        let points: Vec<Point> = (0..7)
            .map(|_| Point::new(rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)))
            .collect();
        // Bisector of one pair crossed with the bisector of another holds every alternating optimum.
        let mut brute = f64::INFINITY;
        let mut pairs = Vec::new();
        for i in 0..7 {
            for j in i + 1..7 {
                pairs.push((points[i], points[j]));
            }
        }
        for a in &pairs {
            for b in &pairs {
                if let Some(c) = crossing(*a, *b) {
                    brute = brute.min(width(&points, c));
                }
            }
        }
        match reference_zone(&points, Reference::MinimumZone) {
            Ok(exact) => {
                compared += 1;
                // Tolerance: both evaluate the same centre, 1e-9 covers bisectors nearly parallel.
                assert!(
                    (exact.width_um * 1e-3 - brute).abs() < 1e-9,
                    "{} {brute}",
                    exact.width_um * 1e-3
                );
            }
            Err(e) => {
                assert_eq!(e, CircleError::StraighterThanAnyCircle);
                // Then the narrowest strip is at least as narrow as any ring.
                let strip = (0..200_000)
                    .map(|k| {
                        let t = std::f64::consts::PI * f64::from(k) / 200_000.0;
                        let s: Vec<f64> = points
                            .iter()
                            .map(|p| p.x * t.cos() + p.y * t.sin())
                            .collect();
                        s.iter().fold(f64::MIN, |a, &b| a.max(b))
                            - s.iter().fold(f64::MAX, |a, &b| a.min(b))
                    })
                    .fold(f64::INFINITY, f64::min);
                // Tolerance: truncation of the direction grid, 2 · diameter · step.
                assert!(strip <= brute + 1e-4, "{strip} {brute}");
            }
        }
    }
    assert!(compared > 10, "only {compared} sets had a ring");
}

fn crossing(a: (Point, Point), b: (Point, Point)) -> Option<Point> {
    let rows = [a, b].map(|(p, q)| {
        let n = (q.x - p.x, q.y - p.y);
        (
            n.0,
            n.1,
            0.5 * (q.x * q.x + q.y * q.y - p.x * p.x - p.y * p.y),
        )
    });
    let det = rows[0].0 * rows[1].1 - rows[0].1 * rows[1].0;
    (det.abs() > 1e-12).then(|| {
        Point::new(
            (rows[0].2 * rows[1].1 - rows[0].1 * rows[1].2) / det,
            (rows[0].0 * rows[1].2 - rows[0].2 * rows[1].0) / det,
        )
    })
}

#[test]
fn circumscribed_agrees_with_every_pair_and_triple() {
    for (points, _) in noisy_circles() {
        let exact = zone(&points, Reference::MinimumCircumscribed);
        let mut brute = f64::INFINITY;
        let mut offer = |c: Point| brute = brute.min(farthest(&points, c));
        for (i, &a) in points.iter().enumerate() {
            for (j, &b) in points.iter().enumerate().skip(i + 1) {
                offer(Point::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y)));
                for &c in &points[j + 1..] {
                    crossing((a, b), (a, c)).map(&mut offer);
                }
            }
        }
        // Tolerance: 100 epsilons of the radius; both evaluate the same centre.
        assert!(
            (exact.radius - brute).abs() < 1e-12,
            "{} {brute}",
            exact.radius
        );
        assert!((exact.outer - exact.radius).abs() < 1e-11);
    }
}

#[test]
fn inscribed_agrees_with_a_search() {
    for (points, _) in noisy_circles() {
        let exact = zone(&points, Reference::MaximumInscribed);
        let (_, brute) = search(&|c| -nearest(&points, c), Point::default(), 6.0);
        assert!(
            (exact.radius + brute).abs() < SEARCH,
            "{} {brute}",
            exact.radius
        );
        assert!((exact.inner - exact.radius).abs() < 1e-11);
    }
}

#[test]
fn no_reference_beats_the_minimum_zone() {
    for (points, _) in noisy_circles() {
        let least = zone(&points, Reference::MinimumZone).width_um;
        for reference in Reference::ALL {
            assert!(zone(&points, reference).width_um >= least * (1.0 - 1e-12));
        }
    }
}

#[test]
fn four_alternating_points_have_the_zone_of_their_radii() {
    // Exact: outer points on the x axis at ±11, inner ones on the y axis at ±10.
    let points = [(11., 0.), (0., 10.), (-11., 0.), (0., -10.)].map(|(x, y)| Point::new(x, y));
    let exact = zone(&points, Reference::MinimumZone);
    assert!((exact.width_um - 1000.0).abs() < 1e-9, "{exact:?}");
    assert!(exact.centre.distance(Point::default()) < 1e-13);
}

#[test]
fn an_exact_full_circle_has_no_deviation() {
    let points: Vec<Point> = (0..360)
        .map(|i| {
            let t = f64::from(i).to_radians();
            Point::new(100.0 + 30.0 * t.cos(), -40.0 + 30.0 * t.sin())
        })
        .collect();
    for reference in Reference::ALL {
        let z = zone(&points, reference);
        // Tolerance: rounding of coordinates of 130 mm, 64 epsilons in µm.
        assert!(z.width_um < 1e3 * 64.0 * f64::EPSILON * 130.0, "{z:?}");
        assert!((z.radius - 30.0).abs() < 1e-12, "{z:?}");
    }
}

#[test]
fn a_short_arc_has_no_inscribed_circle() {
    let what = CircleSimulation {
        arc: 1.0,
        ..CircleSimulation::default()
    };
    let points = simulate(&what, 1).unwrap();
    assert_eq!(
        reference_zone(&points, Reference::MaximumInscribed),
        Err(CircleError::NotSurrounded)
    );
}

#[test]
fn points_without_a_circle_are_refused_with_the_reason() {
    let p = |x, y| Point::new(x, y);
    let line: Vec<Point> = (0..9)
        .map(|i| p(1e5 + 0.1 * f64::from(i), 0.3 * f64::from(i)))
        .collect();
    for reference in Reference::ALL {
        let refuse = |points: &[Point]| reference_zone(points, reference).unwrap_err();
        assert_eq!(refuse(&line), CircleError::Collinear);
        assert_eq!(refuse(&line[..3]), CircleError::Collinear);
        assert_eq!(refuse(&[p(1., 2.); 5]), CircleError::AllEqual { count: 5 });
        assert_eq!(
            refuse(&[p(1., 2.), p(2., 2.), p(2., 2.)]),
            CircleError::TooFewPoints {
                count: 3,
                distinct: 2
            }
        );
        assert_eq!(
            refuse(&[p(1., 2.), p(2., f64::NAN), p(3., 2.)]),
            CircleError::NotFinite { index: 1 }
        );
        assert_eq!(
            refuse(&[]),
            CircleError::TooFewPoints {
                count: 0,
                distinct: 0
            }
        );
    }
}
