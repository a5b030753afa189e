//! Uncertainty under noise that is correlated along traces, and what repeats say of the model.
//!
//! The fit weighs readings as if their noise were white; an estimate is then Σ w r over the readings r,
//! w a row of J⁺ = cov JᵀW, and its variance wᵀVw with V the covariance of the noise, one pass along
//! each trace. Readings are gathered on the cells of their group: w hardly changes within one.

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::problem::NoValue;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::supposed::Counted;
use super::survey::Survey;
use super::traces::Group;
use super::{rms, sum_of_squares};
use crate::noise::{Contrasts, Law, Posterior, about_middle, decays, drift_form, markov_form};

/// Readings of a cell whose derivatives stand for all of it.
const MOST_ROWS: usize = 4;
/// Draws behind the share of the noise that the fit takes up.
const PROBES: usize = 32;
/// Their seed: an answer must not depend on chance.
const SEED: u64 = 0x7472_6163;
/// The means of the repeats leave more than noise where their sum of squares exceeds what the noise
/// explains by so many standard deviations.
const CLEAR: f64 = 4.0;

/// The derivatives of what one reading would be: by unknowns of the band (one may appear twice) and by
/// all of the border.
pub type Derivatives = (Vec<(usize, f64)>, Vec<f64>);

/// A fit at its minimum.
pub struct AtRest<'a, R> {
    /// The derivatives of a reading, by its channel and its place among the channel's.
    pub row: R,
    /// Covariance of the unknowns for rows of unit variance.
    pub covariance: &'a BorderedCovariance,
    /// 1/σ by channel, 1/µm.
    pub weights: &'a [f64],
    /// Unknowns of band and border, and those that the fit chooses.
    pub counts: (usize, usize, usize),
}

/// The derivatives of the sum of a cell's readings, over their standard deviation.
#[derive(Debug, Clone)]
struct Row {
    band: Vec<(usize, f64)>,
    border: Vec<f64>,
    count: f64,
}

/// A trace on cells.
#[derive(Debug, Clone)]
struct Cells {
    positions: Vec<f64>,
    /// The same from the middle of the trace.
    about_middle: Vec<f64>,
    /// What a shift of one is in weighted units, against readings of the mean weight.
    one: f64,
    rows: Vec<Row>,
    /// The place of each cell among all channels', directions' and positions'; repeats share it.
    places: Vec<usize>,
}

/// The rows of all traces, gathered on cells.
#[derive(Debug, Clone)]
pub struct Gathered {
    traces: Vec<Cells>,
    places: usize,
}

impl Gathered {
    /// Gathers the readings of groups around a solution.
    pub fn new(
        row: impl Fn(usize, usize) -> Result<Derivatives, NoValue>,
        survey: &Survey,
        groups: &[Group],
        weights: &[f64],
    ) -> Result<Self, NoValue> {
        let ones = ones(weights);
        let mut traces = Vec::new();
        let mut places = 0;
        for group in groups {
            for (trace, on_cells) in group.traces.iter().zip(&group.on_cells) {
                let rows_of = &survey.traces[group.channel][*trace];
                let mut cells = Cells {
                    positions: Vec::with_capacity(on_cells.cells.len()),
                    about_middle: Vec::new(),
                    one: ones[group.channel],
                    rows: Vec::with_capacity(on_cells.cells.len()),
                    places: Vec::with_capacity(on_cells.cells.len()),
                };
                for (cell, range) in &on_cells.cells {
                    let taken = range.len().min(MOST_ROWS);
                    let count = range.len() as f64;
                    let factor = weights[group.channel] * count / taken as f64;
                    let mut sum = Row {
                        band: Vec::new(),
                        border: Vec::new(),
                        count,
                    };
                    for k in 0..taken {
                        let at = range.start + (2 * k + 1) * range.len() / (2 * taken);
                        let (band, border) = row(group.channel, rows_of.row(at))?;
                        sum.band.extend(band.iter().map(|(j, v)| (*j, factor * v)));
                        sum.border.resize(border.len(), 0.0);
                        for (sum, v) in sum.border.iter_mut().zip(&border) {
                            *sum += factor * v;
                        }
                    }
                    cells.positions.push(group.positions[*cell]);
                    cells.rows.push(sum);
                    cells.places.push(places + cell);
                }
                cells.about_middle = about_middle(&cells.positions);
                traces.push(cells);
            }
            places += group.positions.len();
        }
        Ok(Self { traces, places })
    }

    /// What the readings of each cell count for, trace by trace, for a combination of unknowns whose
    /// covariances with all unknowns these are.
    fn counting(&self, (band, border): &(Vec<f64>, Vec<f64>)) -> Vec<Vec<f64>> {
        let of = |row: &Row| {
            let near: f64 = row.band.iter().map(|(j, v)| v * band[*j]).sum();
            near + row
                .border
                .iter()
                .zip(border)
                .map(|(v, z)| v * z)
                .sum::<f64>()
        };
        self.traces
            .iter()
            .map(|trace| trace.rows.iter().map(of).collect())
            .collect()
    }

    /// Σ of squares of what repeats of one place count for together.
    fn shared_squares(&self, counting: &[Vec<f64>]) -> f64 {
        let mut sums = vec![0.0; self.places];
        for (trace, own) in self.traces.iter().zip(counting) {
            for (place, w) in trace.places.iter().zip(own) {
                sums[*place] += w;
            }
        }
        sum_of_squares(&sums)
    }

    /// What the cells count for in a combination of unknowns of the border, trace by trace.
    pub fn counted(
        &self,
        covariance: &BorderedCovariance,
        border: &[(usize, f64)],
    ) -> Vec<Counted> {
        let counting = self.counting(&covariance.times(&[], border));
        let traces = self.traces.iter().zip(counting);
        traces
            .map(|(trace, counting)| Counted {
                positions: trace.positions.clone(),
                counting,
                readings: trace.rows.iter().map(|row| row.count).collect(),
            })
            .collect()
    }
}

/// What a shift of one is in the weighted units of each channel, against channels of the mean weight: an indicator that is
/// zeroed anew, or drifts, does so by as much whether it is noisy or not.
fn ones(weights: &[f64]) -> Vec<f64> {
    let sigmas: Vec<f64> = weights.iter().map(|w| 1.0 / w).collect();
    let mean = rms(&sigmas);
    weights.iter().map(|w| w * mean).collect()
}

/// The laws that repeats allow, and the variance of what the model misses.
#[derive(Debug, Clone)]
pub struct AlongTraces {
    gathered: Gathered,
    posterior: Posterior,
    /// The lengths that occur among the laws, with the decays of every trace.
    lengths: Vec<(f64, Vec<Vec<f64>>)>,
    /// Which of them each law has.
    length_of: Vec<usize>,
    /// Variance, in weighted units, of what the model misses at a place in all repeats alike, and its
    /// degrees of freedom.
    missed: (f64, f64),
    /// Readings of a trace in a cell, on average.
    readings_a_cell: f64,
}

impl AlongTraces {
    /// Which laws the repeats of the residuals allow and how far the model misses their means; `None`
    /// without repeats that tell.
    pub fn new<R: Fn(usize, usize) -> Result<Derivatives, NoValue>>(
        fit: &AtRest<R>,
        survey: &Survey,
        residuals: &[Vec<f64>],
    ) -> Result<Option<Self>, NoValue> {
        let weighted: Vec<Vec<f64>> = residuals
            .iter()
            .zip(fit.weights)
            .map(|(own, weight)| own.iter().map(|r| weight * r).collect())
            .collect();
        let ones = ones(fit.weights);
        let mut contrasts = Contrasts::default();
        for group in &survey.repeats {
            let complete = group.complete();
            let positions: Vec<f64> = complete.iter().map(|k| group.positions[*k]).collect();
            let repeats = survey.complete_means(group, &weighted);
            contrasts.add(&positions, &repeats, ones[group.channel]);
        }
        let Some(posterior) = Posterior::of(&contrasts) else {
            return Ok(None);
        };
        let gathered = Gathered::new(&fit.row, survey, &survey.repeats, fit.weights)?;
        let mut lengths: Vec<(f64, Vec<Vec<f64>>)> = Vec::new();
        let length_of = posterior
            .possible()
            .iter()
            .map(|p| {
                let length = p.law.length;
                lengths
                    .iter()
                    .position(|l| l.0 == length)
                    .unwrap_or_else(|| {
                        let of = |t: &Cells| decays(&t.positions, length);
                        lengths.push((length, gathered.traces.iter().map(of).collect()));
                        lengths.len() - 1
                    })
            })
            .collect();
        let (cells, readings) = gathered
            .traces
            .iter()
            .flat_map(|t| &t.rows)
            .fold((0.0, 0.0), |(c, r), row| (c + 1.0, r + row.count));
        let mut along = Self {
            gathered,
            posterior,
            lengths,
            length_of,
            missed: (0.0, 1.0),
            readings_a_cell: readings / f64::max(cells, 1.0),
        };
        along.missed = along.missed(fit, survey, &weighted);
        Ok(Some(along))
    }

    /// The variance of a combination in weighted units, and its degrees of freedom.
    pub fn variance(
        &self,
        covariance: &BorderedCovariance,
        band: &[(usize, f64)],
        border: &[(usize, f64)],
    ) -> (f64, f64) {
        let counting = self.gathered.counting(&covariance.times(band, border));
        let white: f64 = counting.iter().map(|own| sum_of_squares(own)).sum();
        let traces = || self.gathered.traces.iter().zip(&counting);
        let shift: f64 = traces()
            .map(|(trace, own)| (trace.one * own.iter().sum::<f64>()).powi(2))
            .sum();
        let drift: f64 = traces()
            .map(|(trace, own)| trace.one.powi(2) * drift_form(&trace.about_middle, own, own))
            .sum();
        let correlated: Vec<f64> = self
            .lengths
            .iter()
            .map(|(_, decays)| {
                let traces = decays.iter().zip(&counting);
                traces.map(|(d, own)| markov_form(d, own, own)).sum()
            })
            .collect();
        let of: Vec<f64> = self
            .posterior
            .possible()
            .iter()
            .zip(&self.length_of)
            .map(|(p, l)| {
                p.law.white * white
                    + p.law.correlated * correlated[*l]
                    + p.law.shift * shift
                    + p.law.drift * drift
            })
            .collect();
        let (noise, freedom) = self.posterior.variance(&of);
        let (missed, missed_freedom) = self.missed;
        if missed <= 0.0 {
            return (noise, freedom);
        }
        // Welch and Satterthwaite.
        let own = missed * self.gathered.shared_squares(&counting);
        let whole = noise + own;
        let doubt = noise * noise / freedom + own * own / missed_freedom;
        (whole, whole * whole / doubt.max(f64::MIN_POSITIVE))
    }

    /// The law of one reading of the mean weight in weighted units: the mean of what the repeats allow.
    pub fn law(&self) -> Law {
        let law = self.posterior.mean();
        Law {
            white: law.white * self.readings_a_cell,
            ..law
        }
    }

    /// Variance of what the model misses, in weighted units; zero where nothing stands out.
    pub fn missed_variance(&self) -> f64 {
        self.missed.0
    }

    /// The variance of what the means of the repeats hold beyond the noise, zero where they do not
    /// clearly, and its degrees of freedom.
    ///
    /// With V the covariance of the noise and H the hat matrix their sum of squares is expected to be
    /// tr V − tr HV; the last is found by drawn signs, ηᵀHVη.
    fn missed<R>(&self, fit: &AtRest<R>, survey: &Survey, weighted: &[Vec<f64>]) -> (f64, f64) {
        let mean_law = self.posterior.mean();
        let (mut squares, mut expected, mut variance) = (0.0, 0.0, 0.0);
        let (mut readings, mut cells) = (0.0, 0.0);
        let mut first = 0;
        for group in &survey.repeats {
            let traces = &self.gathered.traces[first..first + group.traces.len()];
            first += group.traces.len();
            let law = mean_law.where_whole_is(traces.first().map_or(1.0, |t| t.one));
            let mut sums = vec![(0.0, 0.0, 0.0); group.positions.len()];
            for (t, trace) in traces.iter().enumerate() {
                let means = survey.cell_means(group, t, weighted);
                let offset = trace.places.first().map_or(0, |p| {
                    p - group.on_cells[t].cells.first().map_or(0, |c| c.0)
                });
                for (row, place) in trace.rows.iter().zip(&trace.places) {
                    let sum = &mut sums[place - offset];
                    sum.0 += means[place - offset];
                    sum.1 += 1.0;
                    sum.2 += row.count;
                }
            }
            let places = about_middle(&group.positions);
            let seen: Vec<_> = sums
                .into_iter()
                .zip(places)
                .filter(|(s, _)| s.1 > 0.0)
                .map(|((sum, repeats, count), place)| (sum, repeats, count, place * place))
                .collect();
            let mut drifting = 0.0;
            for (sum, repeats, count, square) in &seen {
                squares += count * (sum / repeats).powi(2);
                expected += count * (law.variance() + law.drift * square) / repeats;
                drifting += square;
                readings += count;
                cells += 1.0;
            }
            let mean = |of: fn(&(f64, f64, f64, f64)) -> f64| {
                seen.iter().map(of).sum::<f64>() / seen.len().max(1) as f64
            };
            let (repeats, count) = (mean(|s| s.1), mean(|s| s.2));
            variance += 2.0
                * (count / repeats).powi(2)
                * (law.squares(
                    &decays(&group.positions, law.length),
                    &decays(&group.positions, 0.5 * law.length),
                ) + (law.drift * drifting).powi(2));
        }
        let unknowns = fit.counts.2 as f64;
        let freedom = cells - unknowns;
        if !(freedom > 0.0 && expected > 0.0) {
            return (0.0, 1.0);
        }
        expected -= self.taken_up(fit.covariance, fit.counts, &mean_law);
        let ones = vec![1.0; self.posterior.possible().len()];
        let (_, known) = self.posterior.variance(&ones);
        let doubt = (variance + 2.0 / known * expected * expected).sqrt();
        if squares - expected <= CLEAR * doubt {
            return (0.0, 1.0);
        }
        (
            (squares - expected) / (readings * (freedom / cells)),
            freedom,
        )
    }

    /// tr HV: the part of the noise's variance that the fit takes up.
    fn taken_up(
        &self,
        covariance: &BorderedCovariance,
        (in_band, in_border, _): (usize, usize, usize),
        law: &Law,
    ) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let traces = &self.gathered.traces;
        let along: Vec<Vec<f64>> = traces
            .iter()
            .map(|t| decays(&t.positions, law.length))
            .collect();
        let probes: Vec<Vec<Vec<f64>>> = (0..PROBES)
            .map(|_| {
                let mut sign = || if random.random::<bool>() { 1.0 } else { -1.0 };
                let of = |t: &Cells| t.rows.iter().map(|_| sign()).collect::<Vec<f64>>();
                traces.iter().map(of).collect()
            })
            .collect();
        let sum: f64 = probes
            .par_iter()
            .map(|signs| {
                let mut band = vec![0.0; in_band];
                let mut border = vec![0.0; in_border];
                for (trace, signs) in traces.iter().zip(signs) {
                    for (row, sign) in trace.rows.iter().zip(signs) {
                        for (j, v) in &row.band {
                            band[*j] += sign * v;
                        }
                        for (sum, v) in border.iter_mut().zip(&row.border) {
                            *sum += sign * v;
                        }
                    }
                }
                let band: Vec<(usize, f64)> = band.into_iter().enumerate().collect();
                let border: Vec<(usize, f64)> = border.into_iter().enumerate().collect();
                let taken = self.gathered.counting(&covariance.times(&band, &border));
                let own = taken.iter().zip(signs).zip(&along).zip(traces);
                own.map(|(((taken, signs), d), trace)| {
                    let law = law.where_whole_is(trace.one);
                    law.form(d, taken, signs)
                        + law.drift * drift_form(&trace.about_middle, taken, signs)
                })
                .sum::<f64>()
            })
            .collect::<Vec<f64>>()
            .iter()
            .sum();
        sum / PROBES as f64
    }
}
