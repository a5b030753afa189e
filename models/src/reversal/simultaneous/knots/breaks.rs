//! Break points of equal cells, and of as many where positions are uneven.
//!
//! A cell needs readings of channels that tell all fitted forms apart; otherwise coefficients there would be determined
//! by nothing. Where equal cells lack them they are joined, and in place of each the cell with most positions is split
//! between two of them, so that the cells are where the readings are. No part may be much narrower than positions are
//! apart: the slope of a form between two neighbours close to each other is mostly noise, and with it the form swings in
//! the gap beside them.

use super::different;

/// The narrowest part of a split cell, in mean distances of the positions of the channel that has most.
const NARROWEST: f64 = 0.25;

/// The break points of so many cells over a range, or of as many as positions of channels, in ascending order, let be.
/// `told` says whether channels with a reading tell all forms apart.
pub fn breaks(
    channels: &[&[f64]],
    [low, high]: [f64; 2],
    cells: usize,
    mut told: impl FnMut(&[bool]) -> bool,
) -> Vec<f64> {
    let cells = cells.max(1);
    let mut breaks = vec![low];
    let mut seen = vec![false; channels.len()];
    let mut at = vec![0; channels.len()];
    for k in 1..=cells {
        let right = if k == cells {
            high
        } else {
            end([low, high], k, cells)
        };
        for (c, x) in channels.iter().enumerate() {
            let next = at[c] + x[at[c]..].partition_point(|x| *x < right);
            seen[c] |= next > at[c];
            at[c] = next;
        }
        if told(&seen) {
            breaks.push(right);
            seen.fill(false);
        }
    }
    // What is left at the end belongs to the last cell.
    if breaks.len() > 1 {
        breaks.pop();
    }
    breaks.push(high);
    if breaks.len() <= cells {
        split(channels, &mut breaks, cells, told);
    }
    breaks
}

/// Where the kth of so many equal cells ends.
fn end([low, high]: [f64; 2], k: usize, cells: usize) -> f64 {
    low + (high - low) * (k as f64 / cells as f64)
}

/// Whether these are so many equal cells and positions about even in them: at least two in each, or one or two.
/// Where some cells have many and others one a spline follows the first and swings more from cell to cell of the others.
pub fn are_even(x: &[f64], breaks: &[f64], cells: usize) -> bool {
    let range = [breaks[0], breaks[breaks.len() - 1]];
    let mut inner = breaks.iter().enumerate().skip(1).take(cells - 1);
    if breaks.len() != cells + 1 || !inner.all(|(k, at)| *at == end(range, k, cells)) {
        return false;
    }
    let held = |k: usize| {
        let from = x.partition_point(|x| *x < breaks[k]);
        let to = if k + 1 == cells {
            x.len()
        } else {
            x.partition_point(|x| *x < breaks[k + 1])
        };
        &x[from..to]
    };
    let several = |x: &[f64]| x.first() < x.last();
    (0..cells).all(|k| several(held(k))) || (0..cells).all(|k| different(held(k)) <= 2)
}

/// A cell that can be split.
struct Splittable {
    left: f64,
    /// Where.
    at: f64,
    right: f64,
    /// Different positions of the channel that has most of them there.
    positions: usize,
}

/// Splits cells with most positions until there are so many.
fn split(
    channels: &[&[f64]],
    breaks: &mut Vec<f64>,
    cells: usize,
    mut told: impl FnMut(&[bool]) -> bool,
) {
    let [low, high] = [breaks[0], breaks[breaks.len() - 1]];
    let positions = channels.iter().map(|x| different(x)).max().unwrap_or(1);
    let narrowest = NARROWEST * (high - low) / positions as f64;
    let mut splittable = |left: f64, right: f64| {
        let inside: Vec<&[f64]> = channels
            .iter()
            .map(|x| {
                let from = x.partition_point(|x| *x < left);
                let to = x.partition_point(|x| *x < right || (right >= high && *x <= high));
                &x[from..to]
            })
            .collect();
        let most = inside.iter().max_by_key(|x| different(x))?;
        let at = between(most)?;
        if (at - left).min(right - at) < narrowest {
            return None;
        }
        let first: Vec<bool> = inside
            .iter()
            .map(|x| x.first().is_some_and(|x| *x < at))
            .collect();
        let second: Vec<bool> = inside
            .iter()
            .map(|x| x.last().is_some_and(|x| *x >= at))
            .collect();
        (told(&first) && told(&second)).then(|| Splittable {
            left,
            at,
            right,
            positions: different(most),
        })
    };
    let mut open: Vec<Splittable> = breaks
        .windows(2)
        .filter_map(|cell| splittable(cell[0], cell[1]))
        .collect();
    while breaks.len() <= cells {
        let Some(most) = (0..open.len()).max_by_key(|k| open[*k].positions) else {
            break;
        };
        let Splittable {
            left, at, right, ..
        } = open.swap_remove(most);
        breaks.push(at);
        open.extend(splittable(left, at));
        open.extend(splittable(at, right));
    }
    breaks.sort_by(f64::total_cmp);
}

/// Half way between two neighbours, in the middle of these positions.
fn between(x: &[f64]) -> Option<f64> {
    let middle = *x.get(x.len() / 2)?;
    let from = x.partition_point(|x| *x < middle);
    let to = x.partition_point(|x| *x <= middle);
    let second = if from > 0 && (to == x.len() || x.len() - from <= to) {
        from
    } else {
        to
    };
    let at = 0.5 * (x.get(second.checked_sub(1)?)? + x.get(second)?);
    // Neighbours one rounding apart have nothing between them.
    (x[second - 1] < at && at < x[second]).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(seen: &[bool]) -> bool {
        seen.iter().all(|seen| *seen)
    }

    /// Readings of a channel in each cell.
    fn held(x: &[f64], breaks: &[f64]) -> Vec<usize> {
        let to = |right: f64, last: bool| x.iter().filter(|x| **x < right || last).count();
        let ends: Vec<usize> = (1..breaks.len())
            .map(|k| to(breaks[k], k + 1 == breaks.len()))
            .collect();
        let from = std::iter::once(&0).chain(&ends);
        ends.iter().zip(from).map(|(to, from)| to - from).collect()
    }

    #[test]
    fn cells_at_even_positions_are_equal() {
        // Definition.
        let x: Vec<f64> = (0..41).map(f64::from).collect();
        for cells in 1..=38 {
            let own = breaks(&[&x, &x], [0.0, 40.0], cells, all);
            assert!(are_even(&x, &own, cells), "{cells}: {own:?}");
        }
    }

    #[test]
    fn uneven_positions_carry_as_many_cells_as_even_ones() {
        // Twenty positions 2 mm apart, then twenty 9 mm apart. Definition: as many cells as asked, each with a reading.
        let x: Vec<f64> = (0..20)
            .map(|k| 2.0 * f64::from(k))
            .chain((0..20).map(|k| 40.0 + 9.0 * f64::from(k)))
            .collect();
        let range = [0.0, x[39]];
        for cells in [10, 20, 30] {
            let own = breaks(&[&x, &x], range, cells, all);
            assert_eq!(own.len(), cells + 1);
            assert!(own.windows(2).all(|pair| pair[0] < pair[1]), "{own:?}");
            assert!(held(&x, &own).iter().all(|held| *held > 0), "{own:?}");
        }
        // Of ten equal cells the first holds ten positions, the last two; of twenty some hold one.
        for (cells, even) in [(10, true), (20, false), (30, false)] {
            let own = breaks(&[&x, &x], range, cells, all);
            assert_eq!(are_even(&x, &own, cells), even, "{cells}: {own:?}");
        }
    }

    #[test]
    fn every_cell_tells_all_forms_apart() {
        // Two channels at positions of their own, of which the second ends early: definition.
        let x: Vec<f64> = (0..30).map(|k| f64::from(k) + 0.3).collect();
        let y: Vec<f64> = (0..12).map(|k| 1.7 * f64::from(k)).collect();
        for cells in 1..=20 {
            let own = breaks(&[&x, &y], [0.0, 30.0], cells, all);
            for channel in [&x, &y] {
                assert!(held(channel, &own).iter().all(|held| *held > 0), "{own:?}");
            }
        }
    }
}
