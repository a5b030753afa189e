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

use super::between;
use super::gathered::{Cells, Derivatives, Gathered, ones};
use super::laws::{Laws, Products};
use super::pairs::{Pair, Pairs};
use super::sum_of_squares;
use super::survey::Survey;
use super::traces::Group;
use crate::noise::{Contrasts, Law, Moments, Posterior, WithinCells, about_middle, decays};
use crate::reversal::simultaneous::SharedNoise;

/// Draws behind the share of the noise that the fit takes up.
const PROBES: usize = 32;
/// Their seed: an answer must not depend on chance.
const SEED: u64 = 0x7472_6163;
/// What two indicators share is judged beforehand as likely as that they share nothing, and the ratio of the variances of
/// sum and difference as anything from one over this to this.
const RATIO: f64 = 100.0;
/// Probability below which it is not thought of.
const NEGLIGIBLE: f64 = 1e-3;
/// The means of the repeats, or traces that are not repeated, leave more than noise where their sum of squares exceeds what the noise
/// explains by so many standard deviations.
const CLEAR: f64 = 4.0;

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

/// The laws that repeats allow, and the variance of what the model misses.
#[derive(Debug, Clone)]
pub struct AlongTraces {
    gathered: Gathered,
    /// Every trace with noise of its own.
    apart: Laws,
    together: Option<Together>,
    /// Variance, in weighted units, of what the model misses at a place in all repeats alike, and its
    /// degrees of freedom.
    missed: (f64, f64),
    /// The law of a reading, and whether its noise is probably correlated.
    of_a_reading: Law,
    is_correlated: bool,
    /// Variance of a reading, if the means of cells were those of independent ones.
    white_of_a_reading: f64,
}

/// Opposite indicators that may share what they read in one pass.
#[derive(Debug, Clone)]
struct Together {
    pairs: Pairs,
    /// Of what both say together, and of one against the other.
    laws: [Laws; 2],
    probability: f64,
}

impl AlongTraces {
    /// Which laws the repeats of the residuals allow and how far the model misses their means; `None`
    /// without repeats that tell.
    pub fn new<R: Fn(usize, usize) -> Result<Derivatives, NoValue>>(
        fit: &AtRest<R>,
        survey: &Survey,
        residuals: &[Vec<f64>],
    ) -> Result<Option<Self>, NoValue> {
        let weighted = times(residuals, fit.weights);
        let ones = ones(fit.weights);
        let mut contrasts = Contrasts::default();
        for group in &survey.repeats {
            let complete = group.complete();
            let positions: Vec<f64> = complete.iter().map(|k| group.positions[*k]).collect();
            let repeats = survey.complete_means(group, &weighted);
            contrasts.add(&positions, &repeats, ones[group.channel]);
        }
        let Some(apart) = Posterior::of(&contrasts) else {
            return Ok(None);
        };
        let gathered = Gathered::new(&fit.row, survey, &survey.repeats, fit.weights)?;
        let together = Pairs::of(survey, &gathered, fit.weights)
            .and_then(|pairs| Together::new(pairs, survey, &weighted, &ones));
        let within = survey.within_cells(&survey.repeats, &weighted);
        let mut along = Self::with(gathered, apart, within, together);
        along.missed = along.missed(fit, survey, &survey.repeats, &weighted);
        Ok(Some(along))
    }

    /// The laws that channels allow against each other where nothing is repeated; `None` where noise may be white.
    pub fn between_channels<R: Fn(usize, usize) -> Result<Derivatives, NoValue>>(
        fit: &AtRest<R>,
        survey: &Survey,
        residuals: &[Vec<f64>],
    ) -> Result<Option<Self>, NoValue> {
        let weighted = times(residuals, fit.weights);
        let within = |groups: &[Group]| survey.within_cells(groups, &weighted);
        let found = between::correlated(survey, residuals, fit.weights, within);
        let Some((groups, posterior, within)) = found else {
            return Ok(None);
        };
        let gathered = Gathered::new(&fit.row, survey, &groups, fit.weights)?;
        let mut along = Self::with(gathered, posterior, within, None);
        along.missed = along.missed(fit, survey, &groups, &weighted);
        Ok(Some(along))
    }

    /// Nothing missed as yet.
    fn with(
        gathered: Gathered,
        apart: Posterior,
        within: WithinCells,
        together: Option<Together>,
    ) -> Self {
        let of_a_reading = within.law(&apart);
        let is_correlated = apart.is_correlated() || within.are_correlated(&apart);
        let white_of_a_reading = within.readings_a_cell() * apart.mean().white;
        let positions = gathered.traces.iter().map(|t| &t.positions[..]);
        let apart = Laws::new(apart, positions);
        Self {
            gathered,
            apart,
            together,
            missed: (0.0, 1.0),
            of_a_reading,
            is_correlated,
            white_of_a_reading,
        }
    }

    /// The variance of a combination in weighted units, and its degrees of freedom.
    ///
    /// Of a form on knots finer than the cells a part of what readings count for, w, changes within a cell: the cells miss
    /// Σ w² − Σ (Σ w)²/n of n readings a cell, in which the noise is taken to be as great as between cells.
    pub fn variance(
        &self,
        covariance: &BorderedCovariance,
        band: &[(usize, f64)],
        border: &[(usize, f64)],
    ) -> (f64, f64) {
        let times = covariance.times(band, border);
        let counting = self.gathered.counting(&times);
        let of = |terms: &[(usize, f64)], times: &[f64]| -> f64 {
            terms.iter().map(|(j, v)| v * times[*j]).sum()
        };
        let all = of(band, &times.0) + of(border, &times.1);
        let within = (all - self.gathered.squares_of_cells(&counting)).max(0.0);
        let traces = self.gathered.traces.iter().map(Cells::whole);
        let apart = self.apart.moments(traces, &counting);
        let moments = match &self.together {
            None => apart,
            Some(together) => apart.or(together.moments(&counting), together.probability),
        };
        let (between, freedom) = moments.student();
        let noise = between + within * self.white_of_a_reading;
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
        self.of_a_reading
    }

    /// Whether readings are probably correlated along their traces.
    pub fn is_correlated(&self) -> bool {
        self.is_correlated
    }

    /// What opposite indicators share in one reading, where that is likelier than that they share nothing; `unit` is the
    /// variance of a weighted unit, µm².
    pub fn shared(&self, unit: f64) -> Option<SharedNoise> {
        let shared = self.likelier()?;
        let means = self.apart.mean();
        let of_a_reading = (self.of_a_reading.of_readings() - means.correlated) / means.white;
        let [together, against] = shared.means().map(|law| Law {
            white: law.white * of_a_reading,
            ..law
        });
        let [both, one] = [&together, &against].map(|law| shared.variance_of_a_reading(law));
        Some(SharedNoise {
            correlation: (both - one) / (both + one),
            together: together.times(unit),
            against: against.times(unit),
        })
    }

    /// What indicators share, where it is likelier than that they share nothing.
    fn likelier(&self) -> Option<&Together> {
        self.together.as_ref().filter(|t| t.probability > 0.5)
    }

    /// Variance of what the model misses, in weighted units; zero where nothing stands out.
    pub fn missed_variance(&self) -> f64 {
        self.missed.0
    }

    /// The variance of what the means of the repeats hold beyond the noise, zero where they do not
    /// clearly, and its degrees of freedom.
    ///
    /// With V the covariance of the noise and H the hat matrix their sum of squares is expected to be
    /// tr V − tr HV; the last is found by drawn signs, ηᵀHVη. What repeats have in common of their rounding is no misfit; the fit
    /// takes up a part of it as of what is independent from place to place.
    fn missed<R>(
        &self,
        fit: &AtRest<R>,
        survey: &Survey,
        groups: &[Group],
        weighted: &[Vec<f64>],
    ) -> (f64, f64) {
        let mean_law = self.apart.mean();
        let shared = self.likelier().map(Together::means);
        let (mut squares, mut expected, mut variance) = (0.0, 0.0, 0.0);
        let (mut readings, mut cells) = (0.0, 0.0);
        let rounding = survey.rounding();
        let mut rounded = 0.0;
        let mut first = 0;
        for group in groups {
            let traces = &self.gathered.traces[first..first + group.traces.len()];
            first += group.traces.len();
            let one = traces.first().map_or(1.0, |t| t.one);
            let law = mean_law.where_whole_is(one);
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
            let squares_of = |law: &Law| {
                let law = law.where_whole_is(one);
                law.squares(
                    &decays(&group.positions, law.length),
                    &decays(&group.positions, 0.5 * law.length),
                ) + (law.drift * drifting).powi(2)
            };
            let of_group = match &shared {
                None => squares_of(&mean_law),
                Some(both) => 0.5 * both.iter().map(squares_of).sum::<f64>(),
            };
            variance += 2.0 * (count / repeats).powi(2) * of_group;
            if let Some(rounding) = &rounding[group.channel] {
                let (waves, rest) = rounding.waves();
                let weight = fit.weights[group.channel].powi(2);
                // Of the readings of one trace in a cell each stands elsewhere in its step.
                let of = |variance: f64| weight * variance * repeats * seen.len() as f64;
                let waves = waves.iter().map(|wave| of(wave.std * wave.std));
                rounded += of(rest) + waves.clone().sum::<f64>();
                // A sine and a cosine of one chance each.
                variance += waves.map(|wave| wave * wave).sum::<f64>();
            }
        }
        let unknowns = fit.counts.2 as f64;
        let freedom = cells - unknowns;
        if !(freedom > 0.0 && expected > 0.0) {
            return (0.0, 1.0);
        }
        expected -= self.taken_up(fit.covariance, fit.counts, &mean_law);
        expected += rounded * freedom / cells;
        let known = self.apart.freedom();
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
        let probes: Vec<Vec<Vec<f64>>> = (0..PROBES)
            .map(|_| {
                let mut sign = || if random.random::<bool>() { 1.0 } else { -1.0 };
                let of = |t: &Cells| t.rows.iter().map(|_| sign()).collect::<Vec<f64>>();
                traces.iter().map(of).collect()
            })
            .collect();
        let apart: Vec<&[f64]> = traces.iter().map(|t| &t.positions[..]).collect();
        let apart = Products::new(*law, &apart);
        let shared = self.likelier().map(Together::products);
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
                match (&shared, &self.together) {
                    (Some(products), Some(together)) => {
                        let taken = together.pairs.combined(&taken);
                        let signs = together.pairs.combined(signs);
                        let whole = || together.pairs.pairs.iter().map(Pair::whole);
                        let of = |k: usize| products[k].form(whole(), &taken[k], &signs[k]);
                        of(0) + of(1)
                    }
                    _ => apart.form(traces.iter().map(Cells::whole), &taken, signs),
                }
            })
            .collect::<Vec<f64>>()
            .iter()
            .sum();
        sum / PROBES as f64
    }
}

/// Residuals in weighted units.
fn times(residuals: &[Vec<f64>], weights: &[f64]) -> Vec<Vec<f64>> {
    let all = residuals.iter().zip(weights);
    all.map(|(own, weight)| own.iter().map(|r| weight * r).collect())
        .collect()
}

impl Together {
    /// `None` where it is not worth a thought beside independent traces, or nothing is repeated in both.
    fn new(pairs: Pairs, survey: &Survey, weighted: &[Vec<f64>], ones: &[f64]) -> Option<Self> {
        let [both, against] = pairs.contrasts(survey, weighted, ones);
        let mut whole = both.clone();
        whole.extend(&against);
        let whole = Posterior::of(&whole)?.log_evidence();
        let [both, against] = [Posterior::of(&both)?, Posterior::of(&against)?];
        let odds = both.log_evidence() + against.log_evidence() - whole - (2.0 * RATIO.ln()).ln();
        let probability = 1.0 / (1.0 + (-odds).exp());
        if probability < NEGLIGIBLE {
            return None;
        }
        let laws =
            [both, against].map(|own| Laws::new(own, pairs.pairs.iter().map(|p| &p.positions[..])));
        Some(Self {
            pairs,
            laws,
            probability,
        })
    }

    fn moments(&self, counting: &[Vec<f64>]) -> Moments {
        let combined = self.pairs.combined(counting);
        let whole = || self.pairs.pairs.iter().map(Pair::whole);
        let of = |k: usize| self.laws[k].moments(whole(), &combined[k]);
        of(0).and(of(1))
    }

    fn means(&self) -> [Law; 2] {
        [0, 1].map(|k| self.laws[k].mean())
    }

    fn products(&self) -> [Products; 2] {
        let positions: Vec<&[f64]> = self.pairs.pairs.iter().map(|p| &p.positions[..]).collect();
        self.means().map(|law| Products::new(law, &positions))
    }

    /// Variance of one reading under a law, on average over the traces.
    fn variance_of_a_reading(&self, law: &Law) -> f64 {
        let (mut squares, mut count) = (0.0, 0.0);
        for pair in &self.pairs.pairs {
            squares += sum_of_squares(&pair.about_middle);
            count += pair.about_middle.len() as f64;
        }
        law.variance() + law.drift * squares / f64::max(count, 1.0)
    }
}
