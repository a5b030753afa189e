//! The simultaneous fit of a design: start, knots, minimum.

use std::time::Instant;

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::loss::Loss;
use errsep_solvers::structured::{Parameters, StructuredFit, fit_structured};

use super::determined::{Determined, Zero};
use super::error::DesignFitError;
use super::ground::Ground;
use super::knots::{self, Chosen};
use super::options::DesignOptions;
use super::problem::DesignProblem;
use super::readings::{DesignObservations, Trace};
use super::solution::{DesignFit, Reached};
use crate::reversal::channel_noise::along::AtRest;
use crate::reversal::channel_noise::rounded::Rounded;
use crate::reversal::channel_noise::settle::{Asked, Settled, settle};
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::white::Told;
use crate::reversal::channel_noise::{freedom_left, weights_of};
use crate::reversal::finer_forms::FinerForms;
use crate::reversal::simultaneous::fitted_knots::FittedKnots;
use crate::reversal::simultaneous::knots::{FEWEST_POSITIONS, Finest, MOST_CHOICES, NoiseOfWaves};
use crate::reversal::simultaneous::{self, Knots};

/// Fewest readings beyond the unknowns from which the noise is told.
pub const FEWEST_FREE: usize = 3;

/// Fits slopes, constants and forms of a design to all readings at once.
///
/// # Errors
/// [`DesignFitError`]: readings or options that cannot be used, or a fit that has no answer.
pub fn fit(
    observations: &DesignObservations,
    options: &DesignOptions,
) -> Result<DesignFit, DesignFitError> {
    match fit_on(observations, options, Finest::Carried) {
        Err(why @ DesignFitError::NotConverged { .. }) if options.knots == Knots::Chosen => {
            fit_on(observations, options, Finest::ThreePositions).or(Err(why))
        }
        answer => answer,
    }
}

fn fit_on(
    observations: &DesignObservations,
    options: &DesignOptions,
    finest: Finest,
) -> Result<DesignFit, DesignFitError> {
    let began = Instant::now();
    options.check(observations)?;
    let read = Trace::sort(observations);
    let determined = Determined::of(&observations.design, options.zero);
    let survey = Survey::new(&read, |i| observations.taken(i));
    // Zeros that are kept are told, and their repeats say how well.
    let kept = options.zero == Zero::Kept;
    let level = survey
        .levelled()
        .filter(|level| level.matters && !kept)
        .map(|level| {
            let taken_out: Vec<usize> = (0..read.len()).map(|c| level.taken_out(c)).collect();
            let mut traces = with_values(&read, level.values);
            for (trace, taken_out) in traces.iter_mut().zip(taken_out) {
                trace.taken_out = taken_out;
            }
            (traces, level.greatest)
        });
    let (traces, survey) = match &level {
        None => (&read, survey),
        Some((traces, _)) => {
            let of = |i| observations.taken(i);
            (traces, Survey::new(traces, of))
        }
    };
    let sigmas = survey.first_noise(options.noise);
    let weights = weights_of(&sigmas);
    let mut ground = Ground::new(&observations.design, &determined, traces, weights, options)?;
    ground.finest = finest;
    let mut minimum = minimum_on(breaks(&ground, &survey, None)?, &ground, &survey, &sigmas)?;
    for _ in 0..MOST_CHOICES {
        let Some(better) = minimum.chosen_again(&ground, &survey, &sigmas) else {
            break;
        };
        minimum = better;
    }
    let beside = minimum
        .problem
        .at(&minimum.settled.fit.parameters)?
        .beside();
    let reached = Reached {
        beside,
        problem: &minimum.problem,
        settled: minimum.settled,
        covariance: minimum.covariance,
        told: minimum.told,
        sigmas: minimum.sigmas,
        knots: minimum.knots,
        finer: minimum.forms,
    };
    let mut solution = DesignFit::new(observations, determined.clone(), reached);
    if let Some((level, greatest)) = &level {
        solution.levelled_um = Some(*greatest);
        put_back(&read, level, &mut solution.residuals);
    }
    solution.convergence.seconds = began.elapsed().as_secs_f64();
    Ok(solution)
}

/// The minimum on some break points, with its noise.
struct Minimum<'g> {
    problem: DesignProblem<'g>,
    settled: Settled,
    covariance: BorderedCovariance,
    told: Told,
    sigmas: Vec<f64>,
    knots: FittedKnots,
    forms: Option<FinerForms>,
    /// By form, mm.
    breaks: Vec<Vec<f64>>,
}

fn minimum_on<'g>(
    chosen: Chosen,
    ground: &'g Ground,
    survey: &Survey,
    sigmas: &[f64],
) -> Result<Minimum<'g>, DesignFitError> {
    let options = ground.options;
    let mut sigmas = sigmas.to_vec();
    let unknowns = ground.layout.on(&chosen.breaks).free_count();
    enough(ground, unknowns)?;
    let breaks = chosen.breaks.clone();
    let (mut problem, mut start) = ground.problem(chosen.breaks)?;
    if let Some(index) = problem.layout.thickness_index() {
        start = start_of_thickness(&mut problem, index, start, options)?;
    }
    let asked = Asked {
        noise: options.noise,
        loss: Loss::Quadratic,
        minimisation: &options.minimisation,
    };
    let settled = settle(&mut problem, start, asked, survey, &mut sigmas)?;
    let Some(covariance) = settled.fit.covariance() else {
        return Err(not_converged(&problem, &settled.fit));
    };
    let told = told(&problem, &settled, &covariance, survey, &sigmas, options)?;
    let knots = FittedKnots::new(chosen.common, chosen.table, &settled.residuals).under(&told);
    Ok(Minimum {
        problem,
        settled,
        covariance,
        told,
        sigmas,
        knots,
        forms: chosen.forms,
        breaks,
    })
}

impl Minimum<'_> {
    /// The minimum on the knots that are best under the noise that this one tells, where these are others; `None` too where that
    /// fit has no answer.
    fn chosen_again<'g>(
        &self,
        ground: &'g Ground,
        survey: &Survey,
        sigmas: &[f64],
    ) -> Option<Minimum<'g>> {
        if !matches!(ground.options.knots, Knots::Chosen) || self.knots.refuted().is_some() {
            return None;
        }
        let (step, readings) = survey.pass()?;
        let waves = NoiseOfWaves::new(self.told.scatter.correlated()?, step, readings)
            .in_weights(&self.problem.weights, &ground.weights);
        let chosen = breaks(ground, survey, Some(waves)).ok()?;
        // No finer: what the model misses would be taken up.
        if chosen.breaks == self.breaks || chosen.common.len() > self.knots.breaks.len() {
            return None;
        }
        minimum_on(chosen, ground, survey, sigmas).ok()
    }
}

/// The break points; where they are chosen, lines by which traces of a channel differ are no detail of a form.
fn breaks(
    ground: &Ground,
    survey: &Survey,
    waves: Option<NoiseOfWaves>,
) -> Result<Chosen, DesignFitError> {
    let chosen = matches!(ground.options.knots, Knots::Chosen);
    let Some(values) = chosen.then(|| survey.alike()).flatten() else {
        return knots::breaks(ground, waves);
    };
    knots::breaks(&ground.of(&with_values(ground.traces, values)), waves)
}

/// Puts the heights that were taken out back into the residuals, which are those of the readings.
fn put_back(read: &[Trace], level: &[Trace], residuals: &mut [f64]) {
    for (read, level) in read.iter().zip(level) {
        let heights = read.value.iter().zip(&level.value).map(|(r, l)| r - l);
        for (i, height) in read.source.iter().zip(heights) {
            residuals[*i] += height;
        }
    }
}

fn with_values(traces: &[Trace], values: Vec<Vec<f64>>) -> Vec<Trace> {
    let of = |(trace, value): (&Trace, _)| Trace {
        value,
        ..trace.clone()
    };
    traces.iter().zip(values).map(of).collect()
}

/// The fit has no answer: how it ended, and where.
fn not_converged(problem: &DesignProblem, fit: &StructuredFit) -> DesignFitError {
    let (layout, at) = (&problem.layout, &fit.parameters);
    let slopes = layout.names.iter().take(layout.slope_count).cloned();
    let residuals = problem.residuals(at).ok().map(|all| all.concat());
    let rms =
        |all: Vec<f64>| (all.iter().map(|r| r * r).sum::<f64>() / all.len().max(1) as f64).sqrt();
    DesignFitError::NotConverged {
        ending: fit.ending.to_string(),
        reached: Box::new(simultaneous::Reached {
            tilts: slopes.zip(at.border.iter().copied()).collect(),
            thickness_mm: layout.thickness.then(|| 2.0 * problem.half_mm(at)),
            effects: Vec::new(),
            residual_rms_um: residuals.map(rms),
            iterations: fit.iterations,
        }),
    }
}

/// What the fit tells of its noise: white, unless repeats or channels tell more.
fn told(
    problem: &DesignProblem,
    settled: &Settled,
    covariance: &BorderedCovariance,
    survey: &Survey,
    sigmas: &[f64],
    options: &DesignOptions,
) -> Result<Told, DesignFitError> {
    let white = Told::white(problem, settled, sigmas, options.noise, Loss::Quadratic);
    if options.is_declared() {
        return Ok(white);
    }
    let prepared = problem.at(&settled.fit.parameters)?;
    let layout = &problem.layout;
    let at_rest = AtRest {
        row: |channel, row| problem.derivatives(&prepared, channel, row),
        covariance,
        weights: &problem.weights,
        counts: (
            layout.band_count(),
            layout.border_count(),
            layout.free_count(),
        ),
    };
    let rounded = Rounded::of(&at_rest, survey, &settled.residuals)?;
    let mut told = Told::along(&at_rest, survey, &settled.residuals, sigmas)?.unwrap_or(white);
    told.scatter = told.scatter.beside(rounded);
    Ok(told)
}

/// The largest difference between an analytic derivative of a residual at the fit and a central
/// difference, as a share of the largest derivative by the same unknown: a check of the model.
///
/// # Errors
/// As [`fit`].
#[doc(hidden)]
pub fn central_differences(
    observations: &DesignObservations,
    options: &DesignOptions,
) -> Result<f64, DesignFitError> {
    let traces = Trace::sort(observations);
    let determined = Determined::of(&observations.design, options.zero);
    let survey = Survey::new(&traces, |i| observations.taken(i));
    let weights = weights_of(&survey.first_noise(options.noise));
    let ground = Ground::new(&observations.design, &determined, &traces, weights, options)?;
    let (problem, start) = ground.problem(knots::breaks(&ground, None)?.breaks)?;
    let at = fit_structured(&problem, start, &options.minimisation)?.parameters;
    let analytic = problem.jacobian(&at)?;
    let n = at.band.len();
    let slopes = n..n + problem.layout.constants_from();
    let thickness = problem.layout.thickness_index().map(|j| n + j);
    let by_row: Vec<f64> = traces
        .iter()
        .zip(&problem.weights)
        .flat_map(|(t, weight)| vec![*weight; t.len()])
        .collect();
    let mut worst: f64 = 0.0;
    for (j, column) in analytic.column_iter().enumerate() {
        let step = match slopes.contains(&j) {
            true => 1e-7,
            false if thickness == Some(j) => 2e-2,
            false => 1e-2,
        };
        let residuals = |by: f64| -> Result<Vec<f64>, DesignFitError> {
            let mut moved = at.clone();
            match j.checked_sub(n) {
                None => moved.band[j] += by,
                Some(k) => moved.border[k] += by,
            }
            Ok(problem.residuals(&moved)?.concat())
        };
        let (up, down) = (residuals(step)?, residuals(-step)?);
        let largest = column.amax();
        for (i, own) in column.iter().enumerate() {
            // The rows are model less reading.
            let difference = -by_row[i] * (up[i] - down[i]) / (2.0 * step);
            worst = worst.max((own - difference).abs() / largest);
        }
    }
    Ok(worst)
}

/// Whether there are as many readings and positions as the unknowns need.
fn enough(ground: &Ground, unknowns: usize) -> Result<(), DesignFitError> {
    let readings = ground.readings();
    let free = match ground.options.is_declared() {
        true => 0,
        false => FEWEST_FREE,
    };
    if readings < unknowns + free {
        return Err(DesignFitError::TooFewReadings { readings, unknowns });
    }
    let positions = ground.positions();
    if positions < FEWEST_POSITIONS {
        return Err(DesignFitError::TooFewPositions { positions });
    }
    Ok(())
}

/// The fit with the thickness held, where to start from with the thickness free: small slopes leave hardly
/// a trace of it in the readings, and a search for it would go astray.
///
/// # Errors
/// [`DesignFitError::ThicknessNotDetermined`] where its uncertainty would exceed the value it starts from.
fn start_of_thickness(
    problem: &mut DesignProblem,
    index: usize,
    start: Parameters,
    options: &DesignOptions,
) -> Result<Parameters, DesignFitError> {
    problem.hold(index, true);
    let held = fit_structured(problem, start, &options.minimisation)?;
    let released = held.released(problem, index);
    problem.hold(index, false);
    let unit = (2.0 * held.cost / freedom_left(problem).max(1.0)).sqrt();
    let std_mm = released.map_or(f64::INFINITY, |(_, covariance)| {
        unit * covariance.border()[(index, index)].sqrt()
    });
    if !(std_mm <= options.thickness_mm) {
        return Err(DesignFitError::ThicknessNotDetermined { std_mm });
    }
    Ok(held.parameters)
}
