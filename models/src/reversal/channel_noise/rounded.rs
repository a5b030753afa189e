//! What rounding adds to an uncertainty, where readings are rounded more coarsely than they scatter.
//!
//! An estimate is Σ w r over the readings r, w a row of cov JᵀW. Of each wave v of the error ([`rounding`](crate::reversal::rounding))
//! it is off by Σ w v: JᵀW v is made once, in one pass over the readings.

use std::f64::consts::FRAC_PI_2;

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::problem::NoValue;

use super::along::AtRest;
use super::gathered::Derivatives;
use super::survey::Survey;
use super::traces::{self, Group};
use crate::reversal::rounding::{Rounding, pooled, scatter_within, step_of};

/// The waves of all channels, each as JᵀW v: by the unknowns of band and border.
#[derive(Debug, Clone, Default)]
pub struct Rounded {
    waves: Vec<(Vec<f64>, Vec<f64>)>,
    /// That of the channel of which repeats have most of it in common.
    pub greatest: Option<Rounding>,
}

impl Rounded {
    /// The waves of a fit that leaves these residuals (µm, by channel); `None` where rounding does not matter.
    ///
    /// # Errors
    /// [`NoValue`] where a reading has no derivatives.
    pub fn of<R: Fn(usize, usize) -> Result<Derivatives, NoValue>>(
        fit: &AtRest<R>,
        survey: &Survey,
        residuals: &[Vec<f64>],
    ) -> Result<Option<Self>, NoValue> {
        let (in_band, in_border, _) = fit.counts;
        let mut all = Self::default();
        for (channel, rounding) in survey.rounding().into_iter().enumerate() {
            let Some(rounding) = rounding else { continue };
            let std = |own: &Rounding| own.std();
            if all.greatest.as_ref().map_or(0.0, std) < rounding.std() {
                all.greatest = Some(rounding);
            }
            let (waves, _) = rounding.waves();
            let phases = [0.0, FRAC_PI_2];
            let mut own = vec![(vec![0.0; in_band], vec![0.0; in_border]); 2 * waves.len()];
            let weight = fit.weights[channel].powi(2);
            let values = survey.values[channel].iter().zip(&residuals[channel]);
            for (row, (value, left)) in values.enumerate() {
                let (band, border) = (fit.row)(channel, row)?;
                let errors = waves.iter().flat_map(|wave| {
                    phases.map(|phase| wave.std * (wave.per_um * (value - left) + phase).cos())
                });
                for ((to_band, to_border), error) in own.iter_mut().zip(errors) {
                    let factor = weight * error;
                    band.iter().for_each(|(j, v)| to_band[*j] += factor * v);
                    let both = to_border.iter_mut().zip(&border);
                    both.for_each(|(to, v)| *to += factor * v);
                }
            }
            all.waves.append(&mut own);
        }
        Ok(all.greatest.is_some().then_some(all))
    }

    /// Variance that they add to a combination of unknowns.
    pub fn variance(
        &self,
        covariance: &BorderedCovariance,
        band: &[(usize, f64)],
        border: &[(usize, f64)],
    ) -> f64 {
        let (of_band, of_border) = covariance.times(band, border);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let offs = self.waves.iter();
        offs.map(|(band, border)| (dot(band, &of_band) + dot(border, &of_border)).powi(2))
            .sum()
    }
}

impl Survey<'_> {
    /// By channel, how its readings were rounded where that is more coarsely than they scatter.
    pub fn rounding(&self) -> Vec<Option<Rounding>> {
        let steps: Vec<Option<f64>> = (self.values.iter())
            .map(|values| step_of(values.iter().copied()))
            .collect();
        if steps.iter().all(Option::is_none) {
            return steps.iter().map(|_| None).collect();
        }
        let both;
        let groups: &[Group] = if self.repeats.is_empty() {
            both = traces::groups_of_channels(&self.x, &self.traces);
            &both
        } else {
            &self.repeats
        };
        let values: Vec<Vec<f64>> = self.values.iter().map(|own| own.to_vec()).collect();
        let of = |(channel, step): (usize, Option<f64>)| {
            let own = groups.iter().filter(|group| group.channel == channel);
            let within = pooled(own.map(|group| {
                let (square, freedom) = scatter_within(&self.complete_means(group, &values));
                (square * readings_a_cell(group), freedom)
            }));
            Rounding::of(step?, within?)
        };
        steps.into_iter().enumerate().map(of).collect()
    }
}

/// Mean number of readings in a cell of a trace.
fn readings_a_cell(group: &Group) -> f64 {
    let cells = || group.on_cells.iter().flat_map(|trace| &trace.cells);
    let readings: usize = cells().map(|(_, range)| range.len()).sum();
    readings as f64 / cells().count().max(1) as f64
}
