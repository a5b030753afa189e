//! The straight line of a profile, and how sure it is where traces begin and end at different places.

use nalgebra::DVector;

use super::cells::cell_width;

/// Part of the longest trace from which on a trace counts as one over the whole travel.
const WHOLE: f64 = 0.9;
/// Cells at an end of which a profile's value and slope there are taken.
const AT_END: usize = 3;

/// The straight line of a profile, each position weighted by the width of its cell, as the fits have it.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightLine {
    /// Where the height is taken, mm.
    pub center: f64,
    /// Weights of the height.
    pub height: DVector<f64>,
    /// Weights of the slope, 1/mm.
    pub slope: DVector<f64>,
}

impl StraightLine {
    /// Of profiles at these positions, mm, growing.
    pub fn of(positions: &[f64]) -> Self {
        let x = DVector::from_column_slice(positions);
        let widths = (0..x.len()).map(|k| cell_width(positions, k));
        let widths = DVector::from_iterator(x.len(), widths);
        let height = &widths / widths.sum();
        let center = height.dot(&x);
        let turn = height.component_mul(&x.add_scalar(-center));
        let spread = turn.dot(&x.add_scalar(-center));
        Self {
            center,
            slope: turn / spread,
            height,
        }
    }

    /// The line over positions of a profile that is known at other places, at least four: from place to position goes
    /// the cubic through the four nearest places.
    ///
    /// The line over the places would be another: of a profile that is f off its line where a travel L ends, one that
    /// ends δ earlier turns by 6 f δ/L².
    pub fn carried(positions: &[f64], places: &[f64]) -> Self {
        let whole = Self::of(positions);
        let mut height = DVector::zeros(places.len());
        let mut slope = DVector::zeros(places.len());
        for (k, x) in positions.iter().enumerate() {
            let next = places.partition_point(|place| place < x);
            let first = next.saturating_sub(2).min(places.len() - 4);
            let near = &places[first..first + 4];
            for (j, own) in near.iter().enumerate() {
                let others = (near.iter().enumerate()).filter(|(i, _)| *i != j);
                let share: f64 = others
                    .map(|(_, other)| (x - other) / (own - other))
                    .product();
                height[first + j] += share * whole.height[k];
                slope[first + j] += share * whole.slope[k];
            }
        }
        Self {
            center: whole.center,
            height,
            slope,
        }
    }
}

/// Weights of two slopes over positions, as [`StraightLine::carried`], one from every second place and one from the others;
/// none of fewer than eight places.
pub fn slopes_of_halves(positions: &[f64], places: &[f64]) -> Vec<DVector<f64>> {
    if places.len() < 8 {
        return Vec::new();
    }
    let of_half = |from: usize| {
        let half: Vec<f64> = places.iter().copied().skip(from).step_by(2).collect();
        let line = StraightLine::carried(positions, &half);
        let mut slope = DVector::zeros(places.len());
        for (k, weight) in line.slope.iter().enumerate() {
            slope[from + 2 * k] = *weight;
        }
        slope
    };
    vec![of_half(0), of_half(1)]
}

/// Over how much the first positions of traces spread, and the last, mm; of the first and last of each. A repeat over
/// part of the travel says nothing of where the travel ends.
pub fn spread_of_ends(traces: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let all: Vec<[f64; 2]> = traces.collect();
    let longest = all.iter().map(|[from, to]| to - from).fold(0.0, f64::max);
    let whole = || all.iter().filter(|[from, to]| to - from >= WHOLE * longest);
    let spread = |end: usize| {
        let at = whole().map(|ends| ends[end]);
        let (low, high) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        (high - low).max(0.0)
    };
    [spread(0), spread(1)]
}

/// Definitional uncertainty (VIM 2.27) of the straight line of a profile, µm/mm, whose readings begin and end at
/// different places: standard deviation. `profile`: by cell, at these centres; `ends`: over how much the traces' first
/// positions spread, and their last, mm.
///
/// The line of a travel L that ends a length δ later turns by 6/L² (f δ + f′ δ²/2), f how far the profile is from
/// its line there; where it ends is taken as anywhere within that spread with equal probability.
pub fn definitional_std(profile: &DVector<f64>, centres: &[f64], ends: [f64; 2]) -> f64 {
    let n = profile.len();
    if n < 2 * AT_END || ends == [0.0; 2] {
        return 0.0;
    }
    let line = StraightLine::of(centres);
    let (height, slope) = (line.height.dot(profile), line.slope.dot(profile));
    let left = |k: usize| profile[k] - height - slope * (centres[k] - line.center);
    let travel = centres[n - 1] - centres[0];
    let turn = |from: usize, spread: f64, to: f64| {
        let own: Vec<usize> = (from..from + AT_END).collect();
        let count = own.len() as f64;
        let middle = own.iter().map(|k| centres[*k]).sum::<f64>() / count;
        let level = own.iter().map(|k| left(*k)).sum::<f64>() / count;
        let moment: f64 = own.iter().map(|k| (centres[*k] - middle) * left(*k)).sum();
        let width: f64 = own.iter().map(|k| (centres[*k] - middle).powi(2)).sum();
        let steep = moment / width;
        let value = level + steep * (to - middle);
        6.0 / (travel * travel) * (value.abs() * spread + steep.abs() * spread * spread / 2.0)
    };
    let turns = [
        turn(0, ends[0], centres[0]),
        turn(n - AT_END, ends[1], centres[n - 1]),
    ];
    (turns.iter().map(|t| t * t).sum::<f64>() / 3.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// *Definition*: a repeat over a part of the travel does not move its ends.
    #[test]
    fn ends_are_those_of_whole_traces() {
        let traces = [[0.0, 300.0], [1.0, 298.5], [100.0, 120.0]];
        assert_eq!(spread_of_ends(traces.into_iter()), [1.0, 1.5]);
        assert_eq!(spread_of_ends(std::iter::empty()), [0.0; 2]);
    }

    /// *Truncation*: what is known of a wave in the middle of every second pair of positions is its line over all of
    /// them; its line over those middles is another.
    #[test]
    fn the_line_is_that_of_all_positions() {
        let positions: Vec<f64> = (0..300).map(f64::from).collect();
        let places: Vec<f64> = (0..150).map(|k| 2.0 * f64::from(k) + 0.5).collect();
        let wave = |x: &f64| (0.05 * x).cos() + (0.002 * x).exp();
        let of = |x: &[f64]| DVector::from_iterator(x.len(), x.iter().map(wave));
        let whole = StraightLine::of(&positions);
        let truth = whole.slope.dot(&of(&positions));
        let carried = StraightLine::carried(&positions, &places);
        let profile = of(&places);
        // A quarter of a spacing off its places a cubic misses 1/58 of the fourth difference, here 10⁻⁴: 2·10⁻⁶ of the wave,
        // which the sums average, and less than a hundredth of what the line over the places is off.
        let off = (carried.slope.dot(&profile) - truth).abs();
        assert!(off < 5e-9, "{off:e}");
        let heights = whole.height.dot(&of(&positions)) - carried.height.dot(&profile);
        assert!(heights.abs() < 1e-6, "{heights:e}");
        let own = StraightLine::of(&places).slope.dot(&profile);
        assert!((own - truth).abs() > 100.0 * off, "{own} {truth} {off}");
    }

    /// *Limit*: of a line both halves have the slope; of a wave that places twice as far apart do not follow they differ by
    /// much of what the places themselves miss of its slope over the positions.
    #[test]
    fn halves_tell_what_places_do_not_follow() {
        let places: Vec<f64> = (0..24).map(|k| 10.0 * f64::from(k)).collect();
        let positions: Vec<f64> = (0..=2300).map(|k| 0.1 * f64::from(k)).collect();
        let halves = slopes_of_halves(&positions, &places);
        let own = |x: &dyn Fn(f64) -> f64| {
            let profile = DVector::from_iterator(24, places.iter().map(|place| x(*place)));
            [halves[0].dot(&profile), halves[1].dot(&profile)]
        };
        for slope in own(&|x| 3.0 - 0.02 * x) {
            // Rounding.
            assert!((slope + 0.02).abs() < 1e-12, "{slope}");
        }
        let wave = |x: f64| (x / 4.5).sin();
        let followed = StraightLine::carried(&positions, &places);
        let profile = DVector::from_iterator(24, places.iter().map(|place| wave(*place)));
        let all = DVector::from_iterator(2301, positions.iter().map(|x| wave(*x)));
        let missed = followed.slope.dot(&profile) - StraightLine::of(&positions).slope.dot(&all);
        let apart = own(&wave).map(|slope| (slope - followed.slope.dot(&profile)).abs());
        assert!(apart[0].max(apart[1]) > missed.abs(), "{apart:?} {missed}");
    }

    /// *Limit*: the line of a line does not hang on its ends; that of t³ does, by what its line over a longer travel is.
    #[test]
    fn a_line_is_as_sure_as_its_ends() {
        let centres: Vec<f64> = (0..400).map(|k| 0.5 * f64::from(k)).collect();
        let line = DVector::from_iterator(400, centres.iter().map(|x| 3.0 - 0.02 * x));
        // Rounding.
        assert!(definitional_std(&line, &centres, [1.0, 1.0]) < 1e-12);
        let cubic = |x: f64| ((x - 100.0) / 100.0).powi(3);
        let slope_to = |end: f64| {
            let n = 20_000;
            let (mut product, mut square) = (0.0, 0.0);
            for k in 0..n {
                let x = end * (f64::from(k) + 0.5) / f64::from(n);
                let from_middle = x - 0.5 * end;
                product += from_middle * cubic(x);
                square += from_middle * from_middle;
            }
            product / square
        };
        let profile = DVector::from_iterator(400, centres.iter().map(|x| cubic(*x)));
        let found = definitional_std(&profile, &centres, [0.0, 1.0]);
        let turned = (slope_to(200.5) - slope_to(199.5)).abs() / 3.0f64.sqrt();
        // The value and slope at the end are those of its last three cells: 3 %.
        assert!((found / turned - 1.0).abs() < 0.03, "{found} {turned}");
    }
}
