//! What an uncertainty would be if noise taken as white were correlated along the traces.

use std::ops::Range;

use super::survey::Survey;
use super::traces::Group;
use crate::noise::{decays, markov_form};

/// What the readings of a trace count for in a combination of unknowns, cell by cell.
#[derive(Debug, Clone)]
pub struct Counted {
    /// Of the cells, mm.
    pub positions: Vec<f64>,
    /// Over the standard deviation of one reading.
    pub counting: Vec<f64>,
    /// How many there are in each cell.
    pub readings: Vec<f64>,
}

/// What each reading counts for (by channel and place among its sorted readings), on the cells of groups.
pub fn counted(survey: &Survey, groups: &[Group], by_reading: &[Vec<f64>]) -> Vec<Counted> {
    let mut all = Vec::new();
    for group in groups {
        let own = &by_reading[group.channel];
        for (trace, on_cells) in group.traces.iter().zip(&group.on_cells) {
            let rows = &survey.traces[group.channel][*trace];
            let cells = || on_cells.cells.iter();
            let sum = |range: &Range<usize>| range.clone().map(|k| own[rows.row(k)]).sum();
            all.push(Counted {
                positions: cells().map(|(cell, _)| group.positions[*cell]).collect(),
                counting: cells().map(|(_, range)| sum(range)).collect(),
                readings: cells().map(|(_, range)| range.len() as f64).collect(),
            });
        }
    }
    all
}

/// The variance of a combination if that share of the noise's variance were correlated along the traces
/// over a length, mm, relative to that under white noise of the same variance of one reading.
pub fn against_white(traces: &[Counted], share: f64, length: f64) -> f64 {
    let (mut white, mut correlated) = (0.0, 0.0);
    for trace in traces {
        let own = &trace.counting;
        let pairs = own.iter().zip(&trace.readings);
        white += pairs.map(|(w, count)| w * w / count).sum::<f64>();
        correlated += markov_form(&decays(&trace.positions, length), own, own);
    }
    if white > 0.0 {
        1.0 - share + share * correlated / white
    } else {
        1.0
    }
}
