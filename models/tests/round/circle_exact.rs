//! The reference circles against every pair and triple of contacts, on sets made to be awkward.
//! Nothing here is shared with the code that is checked.

use errsep_models::circle::{
    AlgebraicFit, CircleError, Point, Reference, algebraic, reference_zone,
};
use proptest::prelude::*;

fn minus(a: Point, b: Point) -> Point {
    Point::new(a.x - b.x, a.y - b.y)
}

fn cross(a: Point, b: Point) -> f64 {
    a.x * b.y - a.y * b.x
}

fn dot(a: Point, b: Point) -> f64 {
    a.x * b.x + a.y * b.y
}

/// Nearest and farthest distance.
fn extremes(points: &[Point], c: Point) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, 0.0), |(l, h), p| {
        let d = p.distance(c);
        (l.min(d), h.max(d))
    })
}

/// Outer less inner radius, without the cancellation of great distances.
fn width(points: &[Point], c: Point) -> f64 {
    let squares = |p: Point, q: Point| {
        dot(
            minus(p, q),
            minus(
                Point::new(p.x + q.x, p.y + q.y),
                Point::new(2.0 * c.x, 2.0 * c.y),
            ),
        )
    };
    let extreme = |sign: f64| {
        points.iter().copied().reduce(|best, p| {
            if sign * squares(p, best) > 0.0 {
                p
            } else {
                best
            }
        })
    };
    match (extreme(1.0), extreme(-1.0)) {
        (Some(far), Some(near)) => {
            squares(far, near) / (far.distance(c) + near.distance(c)).max(f64::MIN_POSITIVE)
        }
        _ => f64::INFINITY,
    }
}

/// The crossing of the bisectors of two pairs: from an origin at the first point, then corrected
/// once by what is left of both equations there, which takes out the rounding of products (two
/// short pairs, far from each other, otherwise leave the centre uncertain by 1e-12).
fn crossing(a: (Point, Point), b: (Point, Point)) -> Option<Point> {
    let step = |from: Point| {
        let row = |(p, q): (Point, Point)| {
            let n = minus(q, p);
            let middle = Point::new(
                0.5 * (p.x - from.x) + 0.5 * (q.x - from.x),
                0.5 * (p.y - from.y) + 0.5 * (q.y - from.y),
            );
            (n, dot(n, middle))
        };
        let ((n, r), (m, s)) = (row(a), row(b));
        let det = cross(n, m);
        let c = Point::new(
            from.x + (r * m.y - s * n.y) / det,
            from.y + (s * n.x - r * m.x) / det,
        );
        (c.x.is_finite() && c.y.is_finite()).then_some(c)
    };
    step(step(a.0)?)
}

fn pairs(points: &[Point]) -> Vec<(Point, Point)> {
    let n = points.len();
    (0..n)
        .flat_map(|i| (i + 1..n).map(move |j| (i, j)))
        .map(|(i, j)| (points[i], points[j]))
        .filter(|(p, q)| p != q)
        .collect()
}

/// Least width over the crossings of all bisectors, with its centre.
fn narrowest_ring(points: &[Point]) -> (f64, Point) {
    let pairs = pairs(points);
    let mut best = (f64::INFINITY, Point::default());
    for (k, &a) in pairs.iter().enumerate() {
        for &b in &pairs[k + 1..] {
            if let Some(c) = crossing(a, b) {
                let width = width(points, c);
                if width < best.0 {
                    best = (width, c);
                }
            }
        }
    }
    best
}

/// Least width of a strip along one of the sides.
fn narrowest_strip(points: &[Point]) -> f64 {
    pairs(points)
        .iter()
        .map(|&(p, q)| {
            let side = minus(q, p);
            let length = p.distance(q);
            let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(l, h), &r| {
                let height = cross(side, minus(r, p)) / length;
                (l.min(height), h.max(height))
            });
            high - low
        })
        .fold(f64::INFINITY, f64::min)
}

/// Centre, nearest and farthest distance for the centre through each triple and, for pairs, midway.
fn triples(points: &[Point]) -> Vec<([Point; 3], Point)> {
    let n = points.len();
    let mut found = Vec::new();
    for i in 0..n {
        for j in i + 1..n {
            for k in j + 1..n {
                let (a, b, c) = (points[i], points[j], points[k]);
                if let Some(centre) = crossing((a, b), (a, c)) {
                    found.push(([a, b, c], centre));
                }
            }
        }
    }
    found
}

fn smallest_around(points: &[Point]) -> f64 {
    let middles = pairs(points)
        .into_iter()
        .map(|(p, q)| Point::new(0.5 * (p.x + q.x), 0.5 * (p.y + q.y)));
    middles
        .chain(triples(points).into_iter().map(|t| t.1))
        .map(|c| extremes(points, c).1)
        .fold(f64::INFINITY, f64::min)
}

/// Radius of the largest empty circle through three points with its centre in their triangle.
fn largest_within(points: &[Point]) -> Option<f64> {
    let size = span(points);
    triples(points)
        .into_iter()
        .filter(|([a, b, c], o)| {
            let r = a.distance(*o);
            let turns = [(a, b), (b, c), (c, a)]
                .map(|(p, q)| cross(minus(*q, *p), minus(*o, *p)) / (p.distance(*q) * r));
            turns.iter().all(|t| *t >= -1e-11) || turns.iter().all(|t| *t <= 1e-11)
        })
        .filter(|(t, o)| extremes(points, *o).0 >= t[0].distance(*o) - 1e-12 * size)
        .map(|(t, o)| t[0].distance(o))
        .reduce(f64::max)
}

fn span(points: &[Point]) -> f64 {
    points
        .iter()
        .flat_map(|p| points.iter().map(|q| p.distance(*q)))
        .fold(0.0, f64::max)
}

fn polar(r: f64, t: f64) -> Point {
    Point::new(r * t.cos(), r * t.sin())
}

/// Rings of all widths and arcs, points of a small lattice (duplicates, lines, many on one circle),
/// scatter, clusters, two circles.
fn sets() -> impl Strategy<Value = Vec<Point>> {
    let ring = (4..10_usize, 1..12_i32, 0.5..6.3_f64).prop_flat_map(|(n, digits, arc)| {
        prop::collection::vec((0.0..1.0_f64, -1.0..1.0_f64), n).prop_map(move |v| {
            let noise = 10f64.powi(-digits);
            v.into_iter()
                .map(|(t, e)| polar(1.0 + noise * e, arc * t))
                .collect()
        })
    });
    let lattice = prop::collection::vec((-3..4_i32, -3..4_i32), 3..10).prop_map(|v| {
        v.into_iter()
            .map(|(x, y)| Point::new(f64::from(x), f64::from(y)))
            .collect()
    });
    let scatter = prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64), 3..10)
        .prop_map(|v| v.into_iter().map(|(x, y)| Point::new(x, y)).collect());
    let clusters =
        prop::collection::vec((0..4_u8, -1.0..1.0_f64, -1.0..1.0_f64), 4..10).prop_map(|v| {
            v.into_iter()
                .map(|(k, x, y)| {
                    let centre = polar(1.0, 1.7 * f64::from(k));
                    Point::new(centre.x + 1e-3 * x, centre.y + 1e-3 * y)
                })
                .collect()
        });
    let two = prop::collection::vec((any::<bool>(), 0..24_u8), 4..10).prop_map(|v| {
        v.into_iter()
            .map(|(outer, k)| {
                let t = f64::from(k) * std::f64::consts::TAU / 24.0;
                polar(if outer { 1.0 } else { 0.9 }, t)
            })
            .collect()
    });
    prop_oneof![ring, lattice, scatter, clusters, two]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn minimum_zone_is_the_narrowest_of_all_crossings(points in sets()) {
        let (ring, centre) = narrowest_ring(&points);
        let strip = narrowest_strip(&points);
        match reference_zone(&points, Reference::MinimumZone) {
            Ok(zone) => {
                // Epsilons: both widths are differences of distances, the greater of which is meant.
                let tolerance = 1e-12 * zone.outer.min(centre.distance(points[0]) + span(&points));
                prop_assert!((1e-3 * zone.width_um - ring).abs() <= tolerance,
                    "{} {ring} of {points:?}", 1e-3 * zone.width_um);
            }
            Err(CircleError::StraighterThanAnyCircle) => {
                prop_assert!(strip <= ring + 1e-12 * span(&points), "{strip} {ring} of {points:?}");
            }
            Err(CircleError::Collinear | CircleError::TooFewPoints { .. } | CircleError::AllEqual { .. }) => {
                prop_assert!(strip <= 1e-14 * span(&points) || pairs(&points).is_empty());
            }
            Err(other) => prop_assert!(false, "{other} of {points:?}"),
        }
    }

    #[test]
    fn inscribed_and_circumscribed_are_the_best_of_all_triples(points in sets()) {
        let size = span(&points);
        let [inscribed, circumscribed] = [Reference::MaximumInscribed, Reference::MinimumCircumscribed]
            .map(|r| reference_zone(&points, r));
        match (inscribed, circumscribed) {
            (Ok(inside), Ok(around)) => {
                // Epsilons of the size of the set.
                let (inner, outer) = (largest_within(&points), smallest_around(&points));
                prop_assert!(inner.is_some_and(|r| (inside.radius - r).abs() <= 1e-12 * size),
                    "{} {inner:?} of {points:?}", inside.radius);
                prop_assert!((around.radius - outer).abs() <= 1e-12 * size,
                    "{} {outer} of {points:?}", around.radius);
                prop_assert!((inside.inner - inside.radius).abs() <= 1e-12 * size);
                prop_assert!((around.outer - around.radius).abs() <= 1e-12 * size);
            }
            (Err(CircleError::NotSurrounded), Err(CircleError::NotSurrounded)) => {
                // The least-squares centre is not between the points, or no three points hold a circle.
                let beside = algebraic(&points, AlgebraicFit::Taubin)
                    .map_or(f64::INFINITY, |c| widest_gap(&points, c.centre));
                prop_assert!(beside >= std::f64::consts::PI - 1e-9 || largest_within(&points).is_none(),
                    "gap {beside} of {points:?}");
            }
            (Err(a), Err(b)) => prop_assert_eq!(a, b),
            (a, b) => prop_assert!(false, "{a:?} {b:?} of {points:?}"),
        }
    }
}

fn widest_gap(points: &[Point], c: Point) -> f64 {
    let mut angles: Vec<f64> = points
        .iter()
        .map(|p| (p.y - c.y).atan2(p.x - c.x))
        .collect();
    angles.sort_by(f64::total_cmp);
    let across = angles[0] + std::f64::consts::TAU - angles[angles.len() - 1];
    angles
        .windows(2)
        .map(|w| w[1] - w[0])
        .fold(across, f64::max)
}

/// Points whose zones are known from their making: `lobes` undulations of `amplitude` about (7, −3).
fn lobed(count: usize, lobes: u32, amplitude: f64) -> Vec<Point> {
    (0..count)
        .map(|i| {
            let t = std::f64::consts::TAU * i as f64 / count as f64;
            let p = polar(50.0 + amplitude * (f64::from(lobes) * t).cos(), t);
            Point::new(p.x + 7.0, p.y - 3.0)
        })
        .collect()
}

#[test]
fn lobed_traces_on_which_every_point_is_a_corner() {
    // The number of points is a multiple of twice the lobes, so that crests and valleys are points; with
    // an even number of lobes they are opposite each other, and no centre does better than the middle.
    for (count, lobes) in [
        (3600, 2),
        (14_400, 2),
        (14_400, 30),
        (100_000, 2),
        (100_800, 6),
    ] {
        let points = lobed(count, lobes, 0.01);
        for (reference, radius) in [
            (Reference::MinimumZone, 50.0),
            (Reference::MaximumInscribed, 49.99),
            (Reference::MinimumCircumscribed, 50.01),
        ] {
            let zone = reference_zone(&points, reference).unwrap();
            // Epsilons: 1e-12 of the radius. The inscribed circle of an oval is held by a valley, its
            // neighbour and the valley opposite, on either side of the middle: its centre lies up to
            // twice the amplitude times the spacing off the middle (its radius then differs by the square).
            let off = if lobes == 2 && reference == Reference::MaximumInscribed {
                0.02 * std::f64::consts::TAU / count as f64
            } else {
                0.0
            };
            assert!(
                (zone.radius - radius).abs() <= 5e-11,
                "{count} {lobes} {}",
                zone.radius
            );
            let width = 1e-3 * zone.width_um;
            assert!(
                (0.02 - 5e-11..=0.02 + off + 5e-11).contains(&width),
                "{reference:?} {count} {lobes} {width}"
            );
        }
    }
}

#[test]
fn a_dense_short_arc_has_neither_inscribed_nor_circumscribed_circle() {
    // Noise wider than the spacing of the points lets three neighbours hold a tiny circle between them.
    let points: Vec<Point> = (0..5000)
        .map(|i| {
            let t = f64::from(i) / 5000.0 * std::f64::consts::FRAC_PI_2;
            let noise = f64::from(i * 7919 % 1009) / 1009.0 - 0.5;
            polar(50.0 + 0.1 * noise, t)
        })
        .collect();
    for reference in [Reference::MaximumInscribed, Reference::MinimumCircumscribed] {
        assert_eq!(
            reference_zone(&points, reference),
            Err(CircleError::NotSurrounded)
        );
    }
    let zone = reference_zone(&points, Reference::MinimumZone).unwrap();
    assert!(zone.width_um <= 100.0, "{}", zone.width_um);
}

#[test]
fn coordinates_beyond_calculation_are_refused_as_such() {
    let ring =
        |radius: f64| -> Vec<Point> { (0..8).map(|i| polar(radius, f64::from(i))).collect() };
    for reference in Reference::ALL {
        let zone = |radius| reference_zone(&ring(radius), reference);
        assert!(matches!(
            zone(1e160),
            Err(CircleError::TooLarge { index: 0, .. })
        ));
        assert!(matches!(zone(1e-160), Err(CircleError::TooClose { .. })));
        for radius in [1e90, 1e-90] {
            // Epsilons of the radius.
            assert!((zone(radius).unwrap().radius / radius - 1.0).abs() < 1e-14);
        }
    }
}
