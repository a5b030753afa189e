//! How many cells the positions carry.
//!
//! At positions that all channels share the readings of a place belong together whatever the forms are between the
//! places. Where channels were read at positions of their own, or at uneven ones, forms that are too fine swing between
//! them, and what they make of the straight part is paid by the tilts: their uncertainty tells how fine is too fine.

use std::cell::OnceCell;

use super::breaks::are_even;
use super::{different, most_by_positions};
use crate::reversal::finer_forms::TIMES;

/// Positions of a channel a cell has where nothing need be asked.
const POSITIONS_A_CELL: usize = 3;

/// Positions of a channel a cell has on few cells.
const POSITIONS_A_CELL_OF_FEW: usize = 12;

/// By so much at most the uncertainty of a tilt may be larger than on few cells. Of 1.2, 1.5, 2 and 3 it is the one that
/// denies fewest sound readings without errors of tilts beyond their uncertainty (docs/theory/reversal-simultaneous.md).
const DEARER: f64 = 1.5;

/// Rungs in a row that may be refused before the ladder ends: equal cells may lie badly to uneven positions.
pub const REFUSED: usize = 2;

/// How fine chosen knots may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finest {
    /// As fine as the positions carry.
    Carried,
    /// Three positions of a channel a cell: where finer ones left a fit without a minimum or a tilt open.
    ThreePositions,
}

/// How many cells the positions of channels carry.
pub struct Carried<'a> {
    finest: Finest,
    channels: Vec<&'a [f64]>,
    positions: usize,
    /// The positions of the channel that has most different ones.
    most_read: &'a [f64],
    shared: OnceCell<usize>,
    most: OnceCell<usize>,
    coarse: OnceCell<Option<Vec<f64>>>,
}

impl<'a> Carried<'a> {
    /// Of channels' positions in ascending order.
    pub fn by(channels: Vec<&'a [f64]>, finest: Finest) -> Self {
        let counted = channels.iter().map(|x| (different(x), *x));
        let most = counted.reduce(|most, own| if own.0 > most.0 { own } else { most });
        let (positions, most_read) = most.unwrap_or_default();
        Self {
            finest,
            positions,
            most_read,
            channels,
            shared: OnceCell::new(),
            most: OnceCell::new(),
            coarse: OnceCell::new(),
        }
    }

    /// The rungs that are carried, until some in a row are not; in place of one that is not the most cells between it and the
    /// last that are.
    pub fn rungs<'c>(
        &'c self,
        rungs: impl Iterator<Item = usize> + 'c,
        carries: impl Fn(usize) -> bool + 'c,
    ) -> impl Iterator<Item = usize> + 'c {
        let (mut last, mut refused) = (0, 0);
        let all = rungs.map_while(move |cells| {
            let within = self.at_most(cells) == cells;
            let found = within.then(|| self.below(cells, last, &carries)).flatten();
            refused = if found == Some(cells) { 0 } else { refused + 1 };
            last = found.unwrap_or(last);
            (refused <= REFUSED).then_some(found)
        });
        all.flatten()
    }

    /// Twice as many cells, or the most below that are carried.
    pub fn finer(&self, cells: usize, carries: impl Fn(usize) -> bool) -> Option<usize> {
        self.below(TIMES * cells, cells, carries)
    }

    /// So many cells, or the most below that are carried, of numbers an eighth apart; more than the last.
    pub fn below(
        &self,
        cells: usize,
        last: usize,
        carries: impl Fn(usize) -> bool,
    ) -> Option<usize> {
        let fewer = |cells: &usize| Some(cells - cells.div_ceil(8));
        std::iter::successors(Some(self.at_most(cells)), fewer)
            .take_while(|cells| *cells > last)
            .find(|cells| carries(*cells))
    }

    /// So many cells, but no more than a form has that all channels show.
    pub fn at_most(&self, cells: usize) -> usize {
        if cells <= most_by_positions(self.positions) {
            return cells;
        }
        let most = self.most.get_or_init(|| {
            let mut all: Vec<f64> = self.channels.concat();
            all.sort_by(f64::total_cmp);
            most_by_positions(different(&all))
        });
        cells.min(*most)
    }

    /// Whether a rung of so many cells is carried by three positions of a channel each, or by the positions that all
    /// channels share, where positions are even in its cells; `breaks` of so many.
    pub fn surely_carries(&self, cells: usize, breaks: impl Fn(usize) -> Vec<f64>) -> bool {
        let shared = || self.shared.get_or_init(|| shared(&self.channels));
        let enough = cells <= self.positions / POSITIONS_A_CELL
            || (self.finest == Finest::Carried && cells <= most_by_positions(*shared()));
        enough && are_even(self.most_read, &breaks(cells), cells)
    }

    /// Whether a rung of so many cells is carried, surely or because tilts are nearly as sure there as on few cells.
    /// `variances` are those of the tilts, `None` where nothing determines them.
    pub fn carries(
        &self,
        cells: usize,
        breaks: impl Fn(usize) -> Vec<f64>,
        variances: impl Fn(usize) -> Option<Vec<f64>>,
    ) -> bool {
        if self.finest == Finest::ThreePositions {
            return cells <= (self.positions / POSITIONS_A_CELL).max(1);
        }
        if self.surely_carries(cells, breaks) {
            return true;
        }
        if self.at_most(cells) < cells {
            return false;
        }
        let coarse = self.coarse.get_or_init(|| {
            let cells = self.positions / POSITIONS_A_CELL_OF_FEW;
            variances(cells.max(1))
        });
        let Some((coarse, fine)) = coarse.as_ref().zip(variances(cells)) else {
            return false;
        };
        let mut pairs = coarse.iter().zip(&fine);
        coarse.len() == fine.len() && pairs.all(|(coarse, fine)| *fine <= DEARER.powi(2) * coarse)
    }
}

/// Positions that all channels have.
fn shared(channels: &[&[f64]]) -> usize {
    let Some((first, others)) = channels.split_first() else {
        return 0;
    };
    let mut at = vec![0; others.len()];
    let mut here = |x: f64| {
        others.iter().zip(&mut at).all(|(other, at)| {
            *at += other[*at..].iter().take_while(|own| **own < x).count();
            other.get(*at) == Some(&x)
        })
    };
    first
        .chunk_by(|a, b| a == b)
        .filter(|same| here(same[0]))
        .count()
}
