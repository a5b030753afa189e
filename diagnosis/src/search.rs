//! A derivative-free search for functions that are smooth in places, with kinks and steps in others.

/// Values that a search may take, and for each coordinate where there are many.
const FEWEST: usize = 400;
const EACH: usize = 32;
/// Points of a cycle at which a coordinate that comes back is tried.
const AROUND: usize = 24;

/// The best of the points around a cycle, one coordinate after the other, the rest kept: a saw's drop that has
/// crossed a reading is seen by no step that is smaller than the way to the next one.
pub(super) fn around(
    start: &[f64],
    cycles: &[(usize, f64)],
    mut value: impl FnMut(&[f64]) -> f64,
) -> (Vec<f64>, bool) {
    let mut at = start.to_vec();
    let mut best = value(&at);
    let mut moved = false;
    for &(k, cycle) in cycles {
        let centre = at[k];
        let mut kept = centre;
        for point in 1..AROUND {
            at[k] = centre + cycle * point as f64 / AROUND as f64;
            let here = value(&at);
            if here < best {
                (best, kept, moved) = (here, at[k], true);
            }
        }
        at[k] = kept;
    }
    (at, moved)
}

/// How far from its start a search looks first, and how closely it settles, in steps of each coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reach {
    pub first: f64,
    pub last: f64,
}

impl Reach {
    /// From a start of a grid.
    pub const WIDE: Self = Self {
        first: 1.0,
        last: 1e-2,
    };
    /// From what a search has found, something else having changed since.
    pub const NEAR: Self = Self {
        first: 0.3,
        last: 3e-3,
    };
    /// The same where what has changed since is little.
    pub const CLOSE: Self = Self {
        first: 0.03,
        last: 3e-3,
    };
}

/// Coordinate search: the smallest value found from a start, with a step for each coordinate (zero
/// keeps it). Each coordinate is tried on both sides and at the vertex of the parabola through the
/// three values; what it is tried at shrinks to what the vertex asks for, or to half, and grows again
/// where it walks.
pub(super) fn coordinate_search(
    start: &[f64],
    steps: &[f64],
    Reach { first, last }: Reach,
    mut value: impl FnMut(&[f64]) -> f64,
) -> (Vec<f64>, f64) {
    let mut at = start.to_vec();
    let mut best = value(&at);
    let mut scales = vec![first; steps.len()];
    let longest = first.max(Reach::NEAR.first);
    let free = steps.iter().filter(|s| **s != 0.0).count();
    let mut left = FEWEST.max(EACH * free) as isize;
    loop {
        let mut searching = false;
        for (k, step) in steps.iter().enumerate().filter(|(_, s)| **s != 0.0) {
            if scales[k] <= last || left <= 0 {
                continue;
            }
            searching = true;
            let centre = at[k];
            let reach = scales[k] * step;
            let mut here = |position: f64| {
                let mut trial = at.clone();
                trial[k] = position;
                left -= 1;
                value(&trial)
            };
            let (below, above) = (here(centre - reach), here(centre + reach));
            let bend = below - 2.0 * best + above;
            let vertex = 0.5 * (below - above) / bend;
            let inside = bend > 0.0 && vertex.abs() < 1.0;
            let mut moved = (0.0, best);
            let mut offer = |part: f64, found: f64| {
                if found < moved.1 {
                    moved = (part, found);
                }
            };
            offer(-1.0, below);
            offer(1.0, above);
            if inside && vertex != 0.0 {
                offer(vertex, here(centre + vertex * reach));
            }
            best = moved.1;
            at[k] = centre + moved.0 * reach;
            scales[k] *= match moved.0.abs() {
                1.0 => (longest / scales[k]).clamp(1.0, 2.0),
                part if inside => (0.5 * part).clamp(0.05, 0.5),
                _ => 0.5,
            };
        }
        if !searching {
            return (at, best);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside a narrow hollow that no small step reaches, the cycle is seen whole; what does not come back is
    /// left where it is.
    #[test]
    fn a_hollow_elsewhere_on_the_cycle_is_found() {
        let hollow = |v: &[f64]| {
            let away = (v[0] - 0.73).rem_euclid(1.0);
            let away = away.min(1.0 - away);
            let hollow = if away < 0.04 { -1.0 + away } else { 0.0 };
            hollow + (v[1] - 2.0).powi(2)
        };
        let (at, value) = coordinate_search(&[0.2, 2.0], &[0.1, 0.1], Reach::WIDE, hollow);
        assert!(value == 0.0, "small steps: {at:?}");
        let (at, moved) = around(&[0.2, 2.0], &[(0, 1.0)], hollow);
        // Half the way between two of the points that are tried.
        assert!(
            moved && (at[0] - 0.73).abs() <= 0.5 / AROUND as f64 && at[1] == 2.0,
            "{at:?}"
        );
        assert!(!around(&at, &[], hollow).1);
    }

    /// A parabola is found in its vertex, not by halving alone.
    #[test]
    fn a_smooth_minimum_takes_few_values() {
        let mut count = 0;
        let (at, value) = coordinate_search(&[0.0, 0.0], &[1.0, 1.0], Reach::WIDE, |v| {
            count += 1;
            (v[0] - 0.4).powi(2) + 3.0 * (v[1] + 0.7).powi(2)
        });
        // A hundredth of the first step, as asked for; the vertex of a parabola is exact.
        assert!(
            (at[0] - 0.4).abs() < 1e-9 && (at[1] + 0.7).abs() < 1e-9,
            "{at:?}"
        );
        assert!(value < 1e-18);
        // Halving to a hundredth takes 2 · 7 values a coordinate and the moves; this three rounds.
        assert!(count <= 20, "{count}");
    }

    #[test]
    fn a_minimum_several_steps_away_is_walked_to() {
        let far = coordinate_search(&[0.0], &[1.0], Reach::WIDE, |v| (v[0] - 25.3).abs());
        assert!((far.0[0] - 25.3).abs() < 1e-2, "{:?}", far.0);
    }

    /// A start that was thought to be close and is not: at a first step of 0.03 the way of three steps would take 200
    /// values.
    #[test]
    fn a_walk_from_close_by_takes_longer_steps() {
        let mut count = 0;
        let (at, _) = coordinate_search(&[0.0], &[1.0], Reach::CLOSE, |v| {
            count += 1;
            (v[0] - 3.0).abs()
        });
        // What it settles to; a kink has no vertex.
        assert!((at[0] - 3.0).abs() <= 3e-3, "{at:?}");
        // Some ten moves of 0.3, of two values each, and as many again to settle by halves.
        assert!(count <= 80, "{count}");
    }

    #[test]
    fn steps_and_what_is_not_allowed_are_withstood() {
        let (at, value) = coordinate_search(&[0.2, 5.0], &[1.0, 0.0], Reach::WIDE, |v| {
            if v[0] > 2.5 {
                f64::INFINITY
            } else {
                (2.0 - v[0]).abs().ceil()
            }
        });
        assert!(
            value <= 1.0 && at[0] <= 2.5 && at[0] >= 1.0,
            "{at:?} {value}"
        );
        // A step of zero keeps its coordinate.
        assert!((at[1] - 5.0).abs() < f64::EPSILON);
    }
}
