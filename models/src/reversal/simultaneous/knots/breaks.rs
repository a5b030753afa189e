//! Break points of equal cells, and of as many where positions are uneven.
//!
//! A cell needs readings of channels that tell all fitted forms apart; otherwise coefficients there would be determined
//! by nothing. Where equal cells lack them they are joined, and in place of each the cell with most positions is split
//! between two of them: as many cells as positions at uneven places carry then follow the forms where they are read. A
//! cell much narrower than positions are apart is none of them: the slope of a form between two neighbours close to each
//! other is noise, by which it swings wildly in a gap beside them.

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

/// Whether these are those of so many equal cells.
pub fn are_equal(breaks: &[f64], cells: usize) -> bool {
    let range = [breaks[0], breaks[breaks.len() - 1]];
    let mut inner = breaks.iter().enumerate().skip(1).take(cells - 1);
    breaks.len() == cells + 1 && inner.all(|(k, at)| *at == end(range, k, cells))
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
