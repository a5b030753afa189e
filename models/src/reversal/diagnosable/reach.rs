//! Which cells lie within reach of the readings of every channel.

use std::collections::BTreeMap;

use statrs::statistics::{Data, OrderStatistics};

use super::between_grids;
use super::missed::Members;
use super::sorting::TraceKey;
use crate::reversal::designs::DesignReading;

/// Cells on either side of one that tell how wide cells are there.
const BESIDE: usize = 3;
/// How far from the centre of its cell a reading may lie, in cells of the usual width there.
const REACH: f64 = 2.0;

/// Leaves out the cells that lie over a stretch in which some trace has no reading: what is read on one side of it says
/// nothing about the other. Widths of the cells in mm.
pub(super) fn leave_out_gaps(
    members: &mut [(TraceKey, Vec<&[usize]>)],
    readings: &[DesignReading],
    widths: &mut Vec<f64>,
) {
    let reached: Vec<bool> = (0..widths.len())
        .map(|cell| {
            let first = cell.saturating_sub(BESIDE);
            let last = (cell + BESIDE).min(widths.len() - 1);
            let beside = (first..=last).filter(|k| *k != cell).map(|k| widths[k]);
            let usual = Data::new(beside.collect::<Vec<f64>>()).median();
            let inside = || members.iter().flat_map(|(_, inside)| inside[cell]);
            let places = || inside().map(|k| readings[*k].x);
            let centre = places().sum::<f64>() / places().count() as f64;
            places().all(|x| (x - centre).abs() <= REACH * usual)
        })
        .collect();
    for (_, inside) in members {
        retain(inside, &reached);
    }
    retain(widths, &reached);
}

/// Those that are marked.
fn retain<T>(items: &mut Vec<T>, marked: &[bool]) {
    let mut marked = marked.iter();
    items.retain(|_| marked.next().is_some_and(|marked| *marked));
}

/// Whether the centre of the first cell, and of the last, lies beyond all readings of a channel. What the model misses
/// goes into the forms there, as none of the others is against it.
pub(super) fn are_beyond(
    members: &Members,
    readings: &[DesignReading],
    centres: &[f64],
    width: f64,
) -> [bool; 2] {
    let beyond = |cell: usize, sign: f64| {
        let mut nearest: BTreeMap<usize, f64> = BTreeMap::new();
        for ((channel, _, _), inside) in members {
            for k in inside[cell] {
                let inwards = sign * (readings[*k].x - centres[cell]);
                let own = nearest.entry(*channel).or_insert(inwards);
                *own = own.min(inwards);
            }
        }
        nearest
            .values()
            .any(|inwards| *inwards > between_grids::ALIKE * width)
    };
    [beyond(0, 1.0), beyond(centres.len() - 1, -1.0)]
}
