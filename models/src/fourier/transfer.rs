//! What the difference of two probes passes of each order.

use realfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// Determinants below this are called lost: noise would be amplified more than ten thousand times.
pub const LOST_BELOW: f64 = 1e-8;

/// T(ω) = 1 − e^{+jφω}, φ = 2π d/L: equation (24) of the paper, whose text uses this sign while its
/// (4) and (5) print the other one. Spacing and length in the same unit.
pub fn transfer(spacing: f64, length: f64, order: usize) -> Complex64 {
    // Whole turns are taken off before the multiplication by 2π, so that a lost order gives zero to
    // rounding.
    let turns = (spacing / length) * order as f64;
    let angle = TAU * (turns - turns.round());
    Complex64::new(1.0, 0.0) - Complex64::from_polar(1.0, angle)
}

/// det W(ω) = 2 − 2 cos φω = 4 sin²(π d ω/L) = |T|², equation (26).
pub fn determinant(spacing: f64, length: f64, order: usize) -> f64 {
    transfer(spacing, length, order).norm_sqr()
}

/// Standard deviation of a Fourier coefficient of the profile for unit standard deviation of that of
/// one difference signal, when several spacings are combined by least squares: 1/√Σ|W|.
/// Infinite where every spacing loses the order.
pub fn noise_gain(spacings: &[f64], length: f64, order: usize) -> f64 {
    let information: f64 = spacings
        .iter()
        .map(|&d| determinant(d, length, order))
        .sum();
    if information < LOST_BELOW {
        f64::INFINITY
    } else {
        information.sqrt().recip()
    }
}

/// Orders 1 to `orders` with a determinant below `threshold`, most sensitive first, with that
/// determinant.
pub fn sensitive_orders(
    spacing: f64,
    length: f64,
    orders: usize,
    threshold: f64,
) -> Vec<(usize, f64)> {
    let mut found: Vec<(usize, f64)> = (1..=orders)
        .map(|order| (order, determinant(spacing, length, order)))
        .filter(|&(_, w)| w < threshold)
        .collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn determinants_of_the_three_spacings() {
        // Tolerance: half a unit of the last digit of the list in the theory page.
        let expected: [(f64, &[(usize, f64)]); 3] = [
            (
                48.5,
                &[(2, 0.035), (4, 0.140), (29, 0.165), (6, 0.31), (27, 0.35)],
            ),
            (
                34.1,
                &[
                    (3, 0.021),
                    (6, 0.083),
                    (9, 0.185),
                    (12, 0.325),
                    (29, 0.467),
                    (15, 0.500),
                    (26, 0.668),
                    (18, 0.706),
                ],
            ),
            (
                78.6,
                &[
                    (14, 0.0006),
                    (28, 0.0025),
                    (19, 0.170),
                    (5, 0.190),
                    (9, 0.212),
                    (23, 0.235),
                    (24, 0.687),
                ],
            ),
        ];
        for (spacing, list) in expected {
            let found = sensitive_orders(spacing, 100.0, 30, 4.1);
            for (&(order, value), &(place, w)) in list.iter().zip(&found) {
                assert_eq!(order, place, "d = {spacing}");
                let half_digit = match value {
                    v if v < 0.01 => 5.1e-5,
                    v if v == 0.31 || v == 0.35 => 5.1e-3,
                    _ => 5.1e-4,
                };
                assert!((w - value).abs() < half_digit, "d = {spacing}: {order} {w}");
            }
        }
    }

    #[test]
    fn orders_lost_for_good_are_multiples_of_the_denominator() {
        for (spacing, denominator) in [(48.5, 200), (34.1, 1000), (78.6, 500)] {
            for order in 1..=2000 {
                let lost = determinant(spacing, 100.0, order) < LOST_BELOW;
                assert_eq!(lost, order % denominator == 0, "{spacing} {order}");
            }
        }
    }

    #[test]
    fn three_spacings_together_are_worst_at_order_23() {
        let best = |order: usize| {
            [48.5, 34.1, 78.6]
                .iter()
                .map(|&d| determinant(d, 100.0, order))
                .fold(0.0, f64::max)
        };
        let worst = (1..=30)
            .min_by(|&a, &b| best(a).total_cmp(&best(b)))
            .unwrap();
        assert_eq!(worst, 23);
        // Tolerance: half a unit of the printed digit.
        assert!((best(23) - 0.897).abs() < 5.1e-4);
    }

    #[test]
    fn spacing_and_its_complement_are_equivalent() {
        for order in 1..=60 {
            let (a, b) = (
                determinant(34.1, 100.0, order),
                determinant(65.9, 100.0, order),
            );
            // Tolerance: the angle carries order · 2π · ε.
            assert!((a - b).abs() < 1e-12);
        }
    }
}
