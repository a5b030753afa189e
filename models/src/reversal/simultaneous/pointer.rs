//! The pointer of an indicator with play: which reading pushed it last.

use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;

use super::joined::{Joined, Turn};
use super::placed::{Placed, PlacedChannel};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use crate::reversal::channel_noise::traces::Trace;

/// The pointer's last pushes along a trace whose readings, in the order in which they were taken, show
/// what they show without play: the stylus.
fn turns(
    order: impl Iterator<Item = usize>,
    shows: &[f64],
    width: f64,
    begins: f64,
) -> Vec<(usize, Turn)> {
    let half = 0.5 * width.max(0.0);
    let mut turns = Vec::new();
    let mut state: Option<(f64, Turn)> = None;
    for row in order {
        let stylus = shows[row];
        let at = u32::try_from(row).unwrap_or(u32::MAX);
        let next = match state {
            None => (stylus + begins * half, Turn { at, side: 0 }),
            Some((pointer, _)) if stylus - half > pointer => (stylus - half, Turn { at, side: -1 }),
            Some((pointer, _)) if stylus + half < pointer => (stylus + half, Turn { at, side: 1 }),
            Some(held) => held,
        };
        turns.push((row, next.1));
        state = Some(next);
    }
    turns
}

/// Where the pointer was last pushed, for every reading of a channel: place and turn.
pub fn pushed(
    joined: &Joined,
    readings: &ChannelReadings,
    traces: &[Trace],
    placed: &PlacedChannel,
    values: &[f64],
) -> Vec<(usize, Turn)> {
    let shows: Vec<f64> = placed.spots.iter().map(|s| s.shows).collect();
    let mut turned = Vec::with_capacity(readings.len());
    for trace in traces {
        let Some(play) = joined.play(readings.channel, trace.backward) else {
            continue;
        };
        let count = trace.len();
        let order = (0..count).map(|k| trace.row(if trace.backward { count - 1 - k } else { k }));
        turned.extend(turns(
            order,
            &shows,
            values[play.width],
            values[play.begins],
        ));
    }
    turned
}

impl Placed {
    /// The turning points of the play at this point, by channel.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn turning(
        problem: &Reversal,
        joined: &Joined,
        at: &Parameters,
    ) -> Result<Vec<Vec<Turn>>, NoValue> {
        let values = problem.unknowns.effect_values(&at.border);
        let traces = joined.traces(problem.channels);
        let cubics = problem.cubics(at);
        let placed = Self::new(problem, &joined.before_play(), at, &cubics)?;
        Ok(problem
            .channels
            .iter()
            .zip(&placed.channels)
            .enumerate()
            .map(|(c, (readings, own))| {
                let mut turned = vec![Turn { at: 0, side: 0 }; readings.len()];
                for (row, turn) in pushed(joined, readings, &traces[c], own, values) {
                    turned[row] = turn;
                }
                turned
            })
            .collect())
    }
}

impl PlacedChannel {
    /// Readings whose pointer stands still have the row of the reading that pushed it last.
    pub fn play(
        &mut self,
        joined: &Joined,
        readings: &ChannelReadings,
        turned: &[(usize, Turn)],
        values: &[f64],
    ) {
        let effects = joined.count();
        let (spots, by) = (self.spots.clone(), self.by.clone());
        for (row, turn) in turned {
            let at = joined.circumstances(readings.source[*row]);
            let Some(play) = joined.play(readings.channel, at.direction < 0.0) else {
                continue;
            };
            let from = turn.at as usize;
            let half = 0.5 * values[play.width];
            let place = match turn.side {
                0 => values[play.begins],
                side => f64::from(side),
            };
            self.spots[*row] = spots[from];
            self.spots[*row].shows += place * half;
            let own = &mut self.by[row * effects..(row + 1) * effects];
            own.copy_from_slice(&by[from * effects..(from + 1) * effects]);
            own[play.width] = 0.5 * place;
            own[play.begins] = if turn.side == 0 { half } else { 0.0 };
        }
    }
}
