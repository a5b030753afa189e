//! The straight line of a profile, and how sure it is where traces begin and end at different places.

use nalgebra::DVector;

use super::cells::cell_width;

/// Cells at an end of which a profile's value and slope there are taken.
const AT_END: usize = 3;

/// The straight line of a profile, each position weighted by the width of its cell, as the fits have it.
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
}

/// Over how much the first positions of traces spread, and the last, mm; of the first and last of each.
pub fn spread_of_ends(traces: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    let [first, last] = traces.fold([none; 2], |[first, last], [from, to]| {
        let with = |[low, high]: [f64; 2], x: f64| [low.min(x), high.max(x)];
        [with(first, from), with(last, to)]
    });
    [first, last].map(|[low, high]| (high - low).max(0.0))
}

/// How sure the straight line of a profile is, µm/mm, whose readings begin and end at different places:
/// standard deviation. `profile`: by cell, at these centres; `ends`: over how much the traces' first positions
/// spread, and their last, mm.
///
/// The line of a travel L that ends a length δ later turns by 6/L² (f δ + f′ δ²/2), f how far the profile is from
/// its line there; where it ends is taken as anywhere within that spread with equal probability.
pub fn looseness(profile: &DVector<f64>, centres: &[f64], ends: [f64; 2]) -> f64 {
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

    /// A profile that is a straight line over its travel and bends beyond is not loose; one of t³ is, by what its line
    /// over a longer travel is.
    #[test]
    fn a_line_is_as_loose_as_its_ends() {
        let centres: Vec<f64> = (0..400).map(|k| 0.5 * f64::from(k)).collect();
        let line = DVector::from_iterator(400, centres.iter().map(|x| 3.0 - 0.02 * x));
        // Rounding.
        assert!(looseness(&line, &centres, [1.0, 1.0]) < 1e-12);
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
        let loose = looseness(&profile, &centres, [0.0, 1.0]);
        let turned = (slope_to(200.5) - slope_to(199.5)).abs() / 3.0f64.sqrt();
        // The value and slope at the end are those of its last three cells: 3 %.
        assert!((loose / turned - 1.0).abs() < 0.03, "{loose} {turned}");
    }
}
