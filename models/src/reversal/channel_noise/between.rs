//! What channels read against each other where nothing is repeated: noise, whatever the forms are.
//!
//! Two opposite indicators read a slide's form with opposite signs and each surface once in either position of the spindle, so
//!
//! ```text
//!     (R1A + R1B − R2A − R2B)/2
//! ```
//!
//! holds no form, and the readings of one channel there less those back hold none either. Both are orthonormal
//! combinations, with the covariance of one trace beside a line (offsets, tilts). What a model misses is in them too; only where
//! it is as smooth, and no greater, than noise may be does it pass for that.

use rayon::prelude::*;

use super::survey::Survey;
use super::traces::{self, Group};
use super::{Seat, rms};
use crate::noise::{Posterior, WithinCells, WithoutLines};

/// Fewest cells on which passes at positions of their own are held against each other.
const FEWEST_CELLS: usize = 8;

/// A trace of each channel and direction on its cells, and what is left of its readings there, in weighted units.
struct Passes {
    groups: Vec<Group>,
    left: Vec<Vec<f64>>,
}

impl Passes {
    fn of(survey: &Survey, residuals: &[Vec<f64>], weights: &[f64]) -> Self {
        let of_channel =
            |c: usize| traces::of_directions(c, survey.x[c], &survey.traces[c]).into_par_iter();
        let channels = (0..survey.channels()).into_par_iter();
        let mut groups: Vec<Group> = channels.flat_map(of_channel).collect();
        if groups.windows(2).any(|g| g[0].positions != g[1].positions) {
            let shared = traces::on_shared_cells(&survey.x, &survey.traces, FEWEST_CELLS);
            if !shared.is_empty() {
                groups = shared;
            }
        }
        let left = groups.par_iter().map(|group| {
            let means = survey.cell_means(group, 0, residuals);
            let left = means.into_iter().map(|mean| weights[group.channel] * mean);
            left.collect()
        });
        Self {
            left: left.collect(),
            groups,
        }
    }

    /// The pass of a channel in one direction.
    fn of_channel(&self, survey: &Survey, channel: usize, backward: bool) -> Option<usize> {
        self.groups.iter().position(|group| {
            let own = group
                .traces
                .first()
                .map(|t| &survey.traces[group.channel][*t]);
            group.channel == channel && own.is_some_and(|own| own.backward == backward)
        })
    }

    /// The sum of passes with weights, where they share their cells and leave none empty.
    fn combined(&self, terms: &[(usize, f64)]) -> Option<(&[f64], Vec<f64>)> {
        let (first, _) = terms.first()?;
        let positions = &self.groups[*first].positions;
        let mut sum = vec![0.0; positions.len()];
        for (pass, weight) in terms {
            if self.groups[*pass].positions != *positions {
                return None;
            }
            for (sum, value) in sum.iter_mut().zip(&self.left[*pass]) {
                *sum += weight * value;
            }
        }
        sum.iter()
            .all(|s| s.is_finite())
            .then_some((positions, sum))
    }
}

/// Two opposite indicators at two opposite positions of the spindle, with the signs with which forms drop out.
fn closures(seats: &[Seat]) -> Vec<[(usize, f64); 4]> {
    let mut found = Vec::new();
    for (a, seat) in seats.iter().enumerate() {
        let at = |indicator: f64, spindle: f64| {
            let wanted = Seat { indicator, spindle };
            (0..seats.len()).find(|k| {
                let own = &seats[*k];
                own.has_indicator_of(&wanted) && own.is_at_the_spindle_of(&wanted)
            })
        };
        let others = || {
            Some([
                (a, 0.5),
                (at(seat.indicator + 180.0, seat.spindle)?, 0.5),
                (at(seat.indicator, seat.spindle + 180.0)?, -0.5),
                (at(seat.indicator + 180.0, seat.spindle + 180.0)?, -0.5),
            ])
        };
        // Once for the four of them.
        found.extend(others().filter(|four| four.iter().all(|(k, _)| a <= *k)));
    }
    found
}

/// The laws of noise that channels allow against each other, with their passes, where a part of it is likelier to be
/// correlated along a trace than not and no greater than noise may be. `within`: their readings beside the means of the cells.
pub(super) fn correlated(
    survey: &Survey,
    residuals: &[Vec<f64>],
    weights: &[f64],
    within: impl FnOnce(&[Group]) -> WithinCells,
) -> Option<(Vec<Group>, Posterior, WithinCells)> {
    if survey.traces.iter().any(|own| own.len() > 2) || !survey.repeats.is_empty() {
        return None;
    }
    let passes = Passes::of(survey, residuals, weights);
    let mut values = WithoutLines::default();
    let mut add = |terms: &[(usize, f64)]| {
        if let Some((positions, row)) = passes.combined(terms) {
            values.add(positions, row);
        }
    };
    let both = |channel: usize| {
        let [there, back] = [false, true].map(|b| passes.of_channel(survey, channel, b));
        Some([there?, back?])
    };
    for channel in 0..survey.channels() {
        if let Some([there, back]) = both(channel) {
            let half = 0.5_f64.sqrt();
            add(&[(back, half), (there, -half)]);
        }
    }
    // Forms drop out in micrometres.
    let sigmas: Vec<f64> = weights.iter().map(|w| 1.0 / w).collect();
    for four in closures(&survey.seats) {
        let mean = rms(&four.map(|(channel, _)| sigmas[channel]));
        let terms = |directions: &[bool]| -> Option<Vec<(usize, f64)>> {
            let share = (directions.len() as f64).sqrt() * mean;
            let each = four
                .iter()
                .flat_map(|(channel, sign)| directions.iter().map(move |b| (*channel, *sign, *b)));
            each.map(|(channel, sign, b)| {
                let pass = passes.of_channel(survey, channel, b)?;
                Some((pass, sign * sigmas[channel] / share))
            })
            .collect()
        };
        let found = terms(&[false, true])
            .or_else(|| terms(&[false]))
            .or_else(|| terms(&[true]));
        if let Some(found) = found {
            add(&found);
        }
    }
    let posterior = Posterior::of(&values)?;
    let within = within(&passes.groups);
    (posterior.may_be_noise(&within)).then_some((passes.groups, posterior, within))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of four and of eight channels the fours are found once each, and of an odd angle none.
    #[test]
    fn each_four_is_found_once() {
        let seats = |angles: &[(f64, f64)]| -> Vec<Seat> {
            let seat = |(indicator, spindle): &(f64, f64)| Seat {
                indicator: *indicator,
                spindle: *spindle,
            };
            angles.iter().map(seat).collect()
        };
        let plane = [(0.0, 0.0), (180.0, 0.0), (0.0, 180.0), (180.0, 180.0)];
        let four = closures(&seats(&plane));
        assert_eq!(four, [[(0, 0.5), (1, 0.5), (2, -0.5), (3, -0.5)]]);
        let upright = plane.map(|(indicator, spindle)| (indicator + 90.0, spindle));
        let eight: Vec<(f64, f64)> = plane.into_iter().chain(upright).collect();
        assert_eq!(closures(&seats(&eight)).len(), 2);
        assert!(
            closures(&seats(&[
                (0.0, 0.0),
                (180.0, 0.0),
                (0.0, 90.0),
                (180.0, 90.0)
            ]))
            .is_empty()
        );
    }
}
