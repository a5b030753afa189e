//! Where the fit begins with an effect: its variant and the values of its unknowns.
//!
//! The fit without it leaves residuals r. At each of the effect's starts its derivatives by its sizes, V,
//! are projected off the unknowns that the fit has already, and the start that lowers the sum of squares
//! most, rᵀWV (Vᵀ W P V)⁻¹ VᵀWr, is the best: a profile over shapes, a pass over the readings each. Forms
//! have generous knots meanwhile, so that what an effect leaves is not taken for detail of a form or the
//! other way round.

use std::sync::Arc;

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::structured::{Parameters, StructuredProblem};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::descent::{approach, minimise};
use super::effects::{CATALOGUE, Circumstances, Entry, JoinedEffect, Kind, Setting};
use super::error::ReversalError;
use super::ground::{Begun, Found, Ground};
use super::joined::Joined;
use super::knots;
use super::options::{Knots, With};
use super::placed::Placed;
use super::predict::Prediction;
use super::problem::Reversal;
use super::readings::ChannelReadings;

/// Readings over which starts are compared, evenly spread.
const MOST_READINGS: usize = 10_000;
/// Most cells of the forms meanwhile, and positions a cell.
const MOST_CELLS: usize = 40;
const POSITIONS_A_CELL: usize = 3;
/// A start whose change the fit takes up but for this share of its square tells nothing.
const TAKEN_UP: f64 = 1e-8;
/// Gains closer than this share of them differ by rounding.
const SAME_GAIN: f64 = 1e-9;

/// The effects that are asked for, with their values to begin with, and behind them what is there in any case.
///
/// # Errors
/// [`ReversalError`]: an effect that is not known, is asked for twice, or cannot join.
pub fn search(
    ground: &Ground,
    times: &[f64],
    setting: &Setting,
    beside: Option<Found>,
) -> Result<Vec<Found>, ReversalError> {
    let wanted = entries(&ground.options.effects, setting)?;
    let search = Search::new(ground, times, setting)?;
    let mut found: Vec<Option<Found>> = vec![None; wanted.len()];
    // Those with the fewest starts first: what is left then shows the others more clearly.
    let mut order: Vec<(usize, usize)> = (0..wanted.len())
        .map(|k| (search.start_count(wanted[k].0), k))
        .collect();
    order.sort_unstable();
    for (_, k) in &order {
        let present = found.iter().flatten().chain(&beside).cloned();
        found[*k] = Some(search.best(&wanted[*k], &present.collect::<Vec<_>>())?);
    }
    let several = order.iter().filter(|(starts, _)| *starts > 1).count();
    if wanted.len() > 1 && several > 0 {
        // Once more beside all others.
        for (_, k) in order.iter().filter(|(starts, _)| *starts > 1) {
            found[*k] = None;
            let present = found.iter().flatten().chain(&beside).cloned();
            found[*k] = Some(search.best(&wanted[*k], &present.collect::<Vec<_>>())?);
        }
    }
    Ok(found.into_iter().flatten().chain(beside).collect())
}

/// The entries of the catalogue that are asked for.
fn entries<'w>(
    wanted: &'w [With],
    setting: &Setting,
) -> Result<Vec<(&'static Entry, &'w With)>, ReversalError> {
    let mut entries: Vec<(&'static Entry, &With)> = Vec::new();
    for with in wanted {
        let entry = CATALOGUE
            .iter()
            .find(|e| e.name == with.effect)
            .ok_or_else(|| ReversalError::UnknownEffect {
                effect: with.effect.clone(),
            })?;
        if entries.iter().any(|(e, _)| e.name == entry.name) {
            return Err(ReversalError::EffectTwice { effect: entry.name });
        }
        if let Some((why, remedy)) = (entry.refused)(setting) {
            return Err(ReversalError::EffectRefused {
                effect: entry.name,
                why,
                remedy,
            });
        }
        entries.push((entry, with));
    }
    Ok(entries)
}

struct Search<'g, 'a> {
    ground: &'g Ground<'a>,
    times: &'g [f64],
    setting: &'g Setting,
    breaks: Vec<f64>,
}

impl<'g, 'a> Search<'g, 'a> {
    fn new(
        ground: &'g Ground<'a>,
        times: &'g [f64],
        setting: &'g Setting,
    ) -> Result<Self, ReversalError> {
        let breaks = match &ground.options.knots {
            Knots::At(breaks) => breaks.clone(),
            Knots::Cells(cells) => ground.breaks_of((*cells).min(ground.most_cells(None))),
            Knots::Chosen => {
                let cells = knots::positions(ground.channels) / POSITIONS_A_CELL;
                let most = MOST_CELLS.min(ground.most_cells(None));
                ground.breaks_of(cells.min(most).max(1))
            }
        };
        Ok(Self {
            ground,
            times,
            setting,
            breaks,
        })
    }

    fn start_count(&self, entry: &Entry) -> usize {
        let variants = (entry.variants)(self.setting);
        variants.iter().map(|v| v.starts().len()).sum()
    }

    /// The best variant and start of an effect beside those that are present.
    fn best(
        &self,
        (entry, with): &(&'static Entry, &With),
        present: &[Found],
    ) -> Result<Found, ReversalError> {
        let mut variants = (entry.variants)(self.setting);
        if let Some(name) = &with.variant {
            variants.retain(|v| v.variant().as_ref() == Some(name));
        }
        let refused = || ReversalError::EffectStart { effect: entry.name };
        let first = variants.first().cloned().ok_or_else(refused)?;
        if let Some(values) = &with.start {
            let fits = |v: &&Arc<dyn JoinedEffect>| v.unknowns().len() == values.len();
            let own = variants.iter().find(fits).ok_or_else(refused)?;
            return Ok((entry.name, Arc::clone(own), values.clone()));
        }
        let starts: Vec<(Arc<dyn JoinedEffect>, Vec<f64>)> = variants
            .iter()
            .flat_map(|v| v.starts().into_iter().map(|s| (Arc::clone(v), s)))
            .collect();
        let single = first.starts().into_iter().next().unwrap_or_default();
        let fallback = (entry.name, first, single);
        if starts.len() < 2 {
            return Ok(fallback);
        }
        let size = |effect: &Arc<dyn JoinedEffect>, values: &[f64]| {
            let sizes = effect.unknowns().into_iter().zip(values);
            sizes
                .filter(|(u, v)| u.kind == Kind::Amplitude && **v != 0.0)
                .count()
        };
        let found = if starts.iter().any(|(e, v)| size(e, v) > 0) {
            self.by_fits(entry.name, &starts, present)?
        } else {
            self.by_scores(entry.name, &starts, present)?
        };
        Ok(found.unwrap_or(fallback))
    }

    /// The fits from all starts, of which the lowest cost is the best: for effects whose size does not
    /// enter linearly.
    fn by_fits(
        &self,
        name: &'static str,
        starts: &[(Arc<dyn JoinedEffect>, Vec<f64>)],
        present: &[Found],
    ) -> Result<Option<Found>, ReversalError> {
        let fits: Result<Vec<Option<(f64, Found)>>, ReversalError> = starts
            .par_iter()
            .map(|start| self.by_fit(name, start, present))
            .collect();
        let mut best: Option<(f64, Found)> = None;
        for fit in fits?.into_iter().flatten() {
            if best.as_ref().is_none_or(|b| fit.0 < b.0) {
                best = Some(fit);
            }
        }
        Ok(best.map(|b| b.1))
    }

    /// The cost of the fit from a start, and where it ends; `None` where it does not.
    fn by_fit(
        &self,
        name: &'static str,
        (effect, values): &(Arc<dyn JoinedEffect>, Vec<f64>),
        present: &[Found],
    ) -> Result<Option<(f64, Found)>, ReversalError> {
        let mut all = present.to_vec();
        all.push((name, Arc::clone(effect), values.clone()));
        let begun = Begun::new(self.ground.observations, self.times, &all);
        let (problem, start) = self.ground_problem(Some(&begun))?;
        let thin;
        let mut problem = match thinned(&problem) {
            // What a play does hangs on every reading before.
            Some(readings) if !begun.joined.plays() => {
                thin = readings;
                problem.over(&thin)
            }
            _ => problem,
        };
        let options = &self.ground.options.minimisation;
        let fit = approach(&problem, start, options)
            .and_then(|start| minimise(&mut problem, start, options));
        Ok(fit.ok().map(|fit| {
            let own = problem.unknowns.effect_values(&fit.parameters.border);
            let own = own[own.len() - values.len()..].to_vec();
            (fit.cost, (name, Arc::clone(effect), own))
        }))
    }

    fn ground_problem<'s>(
        &'s self,
        begun: Option<&Begun<'s>>,
    ) -> Result<(Reversal<'s>, Parameters), ReversalError> {
        let ground: &'s Ground<'s> = self.ground;
        ground.problem(&self.breaks, begun)
    }

    /// The start that lowers the sum of squares most beside a fit of all that is present.
    fn by_scores(
        &self,
        name: &'static str,
        starts: &[(Arc<dyn JoinedEffect>, Vec<f64>)],
        present: &[Found],
    ) -> Result<Option<Found>, ReversalError> {
        let begun = Begun::new(self.ground.observations, self.times, present);
        let (problem, start) = self.ground_problem(Some(&begun))?;
        let thin;
        let mut problem = match thinned(&problem) {
            Some(readings) => {
                thin = readings;
                problem.over(&thin)
            }
            None => problem,
        };
        let options = &self.ground.options.minimisation;
        let start = approach(&problem, start, options)?;
        let Ok(fit) = minimise(&mut problem, start, options) else {
            return Ok(None);
        };
        let Some(covariance) = fit.covariance() else {
            return Ok(None);
        };
        let Some(placed) = problem.prepare(&fit.parameters)?.placed else {
            return Ok(None);
        };
        let score = Score::new(&problem, &placed, &covariance, &begun.joined);
        let scored: Vec<(f64, Found)> = starts
            .par_iter()
            .filter_map(|(effect, values)| {
                let single = Joined::new(
                    self.ground.observations,
                    self.times,
                    &[(name, Arc::clone(effect))],
                );
                let (gain, values) = score.of(&single, values)?;
                Some((gain, (name, Arc::clone(effect), values)))
            })
            .collect();
        // Of variants that the readings do not tell apart the last, the widest, whatever rounding says.
        let most = scored.iter().fold(f64::NEG_INFINITY, |m, s| m.max(s.0));
        let best = scored
            .into_iter()
            .rfind(|s| s.0 >= most - SAME_GAIN * most.abs());
        Ok(best.map(|b| b.1))
    }
}

/// At most so many readings that starts can be compared over, where there are more.
fn thinned(problem: &Reversal) -> Option<Vec<ChannelReadings>> {
    let readings: usize = problem.channels.iter().map(ChannelReadings::len).sum();
    (readings > MOST_READINGS).then(|| {
        let cells = problem.cell_count() * problem.channels.len();
        problem.thinned((MOST_READINGS / cells.max(1)).max(4))
    })
}

/// What it takes to score starts beside a fit.
struct Score<'s> {
    problem: &'s Reversal<'s>,
    placed: &'s Placed,
    covariance: &'s BorderedCovariance,
    /// The rows of the fit by channel.
    rows: Vec<Vec<Row>>,
}

/// A row of the fit: derivatives, what is left of the reading, where and when it was taken.
struct Row {
    prediction: Prediction,
    left: f64,
    at: Circumstances,
}

impl<'s> Score<'s> {
    fn new(
        problem: &'s Reversal<'s>,
        placed: &'s Placed,
        covariance: &'s BorderedCovariance,
        joined: &Joined,
    ) -> Self {
        let rows = problem.channels.iter().enumerate().map(|(c, readings)| {
            let own = (0..readings.len()).into_par_iter().map(|row| {
                let prediction = placed.prediction(problem, c, row);
                Row {
                    left: readings.value[row] - prediction.value,
                    at: joined.circumstances(readings.source[row]),
                    prediction,
                }
            });
            own.collect()
        });
        Self {
            problem,
            placed,
            covariance,
            rows: rows.collect(),
        }
    }

    /// By how much a start lowers the weighted sum of squares, and its values with the sizes that do.
    fn of(&self, single: &Joined, values: &[f64]) -> Option<(f64, Vec<f64>)> {
        let sizes: Vec<usize> = single
            .unknowns()
            .enumerate()
            .filter(|(_, u)| u.kind == Kind::Amplitude)
            .map(|(k, _)| k)
            .collect();
        let count = sizes.len();
        let (n, q) = (
            self.problem.unknowns.band_count(),
            self.problem.unknowns.border_count(),
        );
        let mut own = DMatrix::<f64>::zeros(count, count);
        let mut right = DVector::<f64>::zeros(count);
        let mut seen = vec![(vec![0.0; n], vec![0.0; q]); count];
        let mut by = vec![0.0; values.len()];
        for (c, rows) in self.rows.iter().enumerate() {
            let square = self.problem.weights[c].powi(2);
            for (k, row) in rows.iter().enumerate() {
                self.placed
                    .signature(single, (c, k), &row.at, values, &mut by);
                let Row {
                    prediction, left, ..
                } = row;
                for (a, k) in sizes.iter().enumerate() {
                    let v = by[*k];
                    if v == 0.0 {
                        continue;
                    }
                    for (b, l) in sizes.iter().enumerate() {
                        own[(a, b)] += square * v * by[*l];
                    }
                    right[a] += square * v * left;
                    let (band, border) = &mut seen[a];
                    for (j, d) in &prediction.band {
                        band[*j] += square * v * d;
                    }
                    for (sum, d) in border.iter_mut().zip(&prediction.border) {
                        *sum += square * v * d;
                    }
                }
            }
        }
        let mut left = own.clone();
        for (b, (band, border)) in seen.iter().enumerate() {
            let terms =
                |of: &[f64]| -> Vec<(usize, f64)> { of.iter().copied().enumerate().collect() };
            let (band, border) = self.covariance.times(&terms(band), &terms(border));
            for (a, other) in seen.iter().enumerate() {
                let product =
                    |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
                left[(a, b)] -= product(&other.0, &band) + product(&other.1, &border);
            }
        }
        if (0..count).any(|a| !(left[(a, a)] > TAKEN_UP * own[(a, a)])) {
            return None;
        }
        let found = left.cholesky()?.solve(&right);
        let gain = right.dot(&found);
        if !gain.is_finite() {
            return None;
        }
        let mut values = values.to_vec();
        for (k, size) in sizes.iter().zip(found.iter()) {
            values[*k] = *size;
        }
        Some((gain, values))
    }
}
