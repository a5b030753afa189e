//! Positions of a measurement and the width of the cell that each stands for.
//!
//! A form has no straight-line part: its least-squares line is zero, each position weighted by the
//! width of its cell. A cell reaches half way to the neighbours; the first and the last reach as far
//! outwards as inwards, so that an even grid has equal weights. The positions are those of all
//! channels together, each counted once however many readings it has: what α means then depends on
//! where was measured, and neither on repeats nor on which channel lacks a reading.

/// Positions closer than this share of the range are the same place.
pub const SAME_PLACE: f64 = 1e-9;

/// The different positions of several lists, each growing, in growing order.
#[derive(Debug, Clone)]
pub struct Union<'a> {
    lists: Vec<&'a [f64]>,
    same: f64,
}

impl<'a> Union<'a> {
    /// The union of lists of positions, mm.
    pub fn of(lists: impl IntoIterator<Item = &'a [f64]>) -> Self {
        let mut lists: Vec<&[f64]> = lists.into_iter().collect();
        if lists.windows(2).all(|pair| pair[0] == pair[1]) {
            lists.truncate(1);
        }
        let ends = lists.iter().filter_map(|l| Some((l.first()?, l.last()?)));
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (a, b)| {
            (l.min(*a), h.max(*b))
        });
        let same = if low < high {
            SAME_PLACE * (high - low)
        } else {
            0.0
        };
        Self { lists, same }
    }
}

impl Iterator for Union<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let heads = self.lists.iter().filter_map(|list| list.first().copied());
        let x = heads.reduce(f64::min)?;
        for list in &mut self.lists {
            while let [head, rest @ ..] = *list
                && *head <= x + self.same
            {
                *list = rest;
            }
        }
        Some(x)
    }
}

/// The width of the cell of the position at `k` among growing positions, mm; 1 for a single one.
pub fn cell_width(x: &[f64], k: usize) -> f64 {
    let before = k.checked_sub(1).map(|j| x[k] - x[j]);
    let after = x.get(k + 1).map(|right| right - x[k]);
    match (before, after) {
        (Some(before), Some(after)) => (before + after) / 2.0,
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_counts_once_however_often_it_was_read() {
        let (a, b) = ([0.0, 1.0, 1.0, 2.0, 3.0], [1.0, 1.0 + 1e-12, 2.0, 2.5]);
        let union: Vec<f64> = Union::of([&a[..], &b[..], &[][..]]).collect();
        assert_eq!(union, [0.0, 1.0, 2.0, 2.5, 3.0]);
        let widths: Vec<f64> = (0..5).map(|k| cell_width(&union, k)).collect();
        assert_eq!(widths, [1.0, 1.0, 0.75, 0.5, 0.5]);
        assert_eq!(Union::of([&a[..], &a[..]]).count(), 4);
        assert_eq!(Union::of([]).count(), 0);
        assert_eq!(cell_width(&[7.0], 0), 1.0);
    }
}
