//! Thinning of long series for the picture: per column of pixels what can be seen is kept.

/// Places of the points that are enough to draw a series on `columns` columns of pixels: in each
/// column the first and last point, and lowest and highest of every one of `heights`. The order
/// of the points stays. A series of at most four points a column is kept whole.
///
/// `at` gives a point's place in columns, none for a point that is not drawn; `heights` are the
/// curves over the points (value, lower and upper band), each as long as the series.
pub(crate) fn kept(
    points: usize,
    columns: usize,
    at: impl Fn(usize) -> Option<f64>,
    heights: &[&[f64]],
) -> Vec<usize> {
    let columns = columns.max(1);
    if points <= 4 * columns {
        return (0..points).collect();
    }
    let mut bins: Vec<Option<Bin>> = vec![None; columns];
    for point in 0..points {
        let Some(place) = at(point) else { continue };
        let column = (place.max(0.0) as usize).min(columns - 1);
        if let Some(slot) = bins.get_mut(column) {
            match slot {
                Some(bin) => bin.add(point, heights),
                None => *slot = Some(Bin::new(point, heights.len())),
            }
        }
    }
    let mut kept: Vec<usize> = bins.into_iter().flatten().flat_map(Bin::points).collect();
    kept.sort_unstable();
    kept.dedup();
    kept
}

/// What is kept of one column of pixels.
#[derive(Debug, Clone)]
struct Bin {
    first: usize,
    last: usize,
    /// Lowest and highest point of each curve.
    extremes: Vec<(usize, usize)>,
}

impl Bin {
    fn new(point: usize, curves: usize) -> Self {
        Self {
            first: point,
            last: point,
            extremes: vec![(point, point); curves],
        }
    }

    fn add(&mut self, point: usize, heights: &[&[f64]]) {
        self.last = point;
        for ((lowest, highest), curve) in self.extremes.iter_mut().zip(heights) {
            let height = |k: usize| curve.get(k).copied().unwrap_or(f64::NAN);
            // A point without a height never wins, and always gives way.
            if height(point) < height(*lowest) || height(*lowest).is_nan() {
                *lowest = point;
            }
            if height(point) > height(*highest) || height(*highest).is_nan() {
                *highest = point;
            }
        }
    }

    fn points(self) -> impl Iterator<Item = usize> {
        [self.first, self.last]
            .into_iter()
            .chain(self.extremes.into_iter().flat_map(|(a, b)| [a, b]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_short_series_is_kept_whole() {
        let y = [0.0; 40];
        assert_eq!(kept(40, 10, |k| Some(k as f64 / 4.0), &[&y]).len(), 40);
    }

    proptest! {
        #[test]
        fn extremes_of_every_column_survive(
            y in prop::collection::vec(prop_oneof![9 => -1.0..1.0f64, 1 => Just(f64::NAN)], 500..3000),
            columns in 1usize..60,
        ) {
            let n = y.len();
            let column = |k: usize| k as f64 * columns as f64 / n as f64;
            let kept = kept(n, columns, |k| Some(column(k)), &[&y]);
            prop_assert!(n <= 4 * columns || kept.len() <= 4 * columns);
            prop_assert!(kept.windows(2).all(|w| w[0] < w[1]));
            for c in 0..columns {
                let inside = |k: &usize| column(*k) as usize == c;
                let all = (0..n).filter(inside).map(|k| y[k]);
                let seen = || kept.iter().copied().filter(inside).map(|k| y[k]);
                prop_assert_eq!(all.clone().fold(f64::NAN, f64::min).to_bits(),
                    seen().fold(f64::NAN, f64::min).to_bits());
                prop_assert_eq!(all.fold(f64::NAN, f64::max).to_bits(),
                    seen().fold(f64::NAN, f64::max).to_bits());
            }
        }
    }
}
