//! The fit: seed, knots, minimisation, noise of the channels.

use std::sync::Arc;
use std::time::Instant;

use errsep_solvers::linear::bordered::BorderedCovariance;
use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::structured::{Parameters, StructuredFit, fit_structured};

use super::closure;
use super::descent::{approach, minimise};
use super::effects::{CATALOGUE, HEIGHTS, Heights, Setting, times};
use super::error::ReversalError;
use super::fitted_knots::FittedKnots;
use super::ground::{Begun, Breaks, Ground};
use super::knots::{self, Climbed, FEWEST_POSITIONS, Finest, MOST_CHOICES, NoiseOfWaves};
use super::levelled::{Level, with_values};
use super::options::{Knots, Noise, Options, Thickness};
use super::problem::Reversal;
use super::reached::Reached;
use super::readings::ChannelReadings;
use super::row_source::RowSource;
use super::search::search;
use super::solution::{ChannelNoise, Convergence, Simultaneous};
use super::told;
use crate::reversal::Observations;
use crate::reversal::channel_noise::along::AtRest;
use crate::reversal::channel_noise::rounded::Rounded;
use crate::reversal::channel_noise::settle::{Asked, Settled, settle};
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::white::Told;
use crate::reversal::channel_noise::{freedom_left, rms, weights_of};
use crate::units::mm_from_um;

/// Fits tilts, offsets and forms to all readings at once, with the effects that are asked for.
///
/// # Errors
/// [`ReversalError`]: input that cannot be used, or a fit that has no answer.
pub fn fit(observations: &Observations, options: &Options) -> Result<Simultaneous, ReversalError> {
    match fit_on(observations, options, Finest::Carried) {
        Err(why) if why.is_no_minimum() && matches!(options.knots, Knots::Chosen) => {
            fit_on(observations, options, Finest::ThreePositions).or(Err(why))
        }
        answer => answer,
    }
}

fn fit_on(
    observations: &Observations,
    options: &Options,
    finest: Finest,
) -> Result<Simultaneous, ReversalError> {
    let began = Instant::now();
    check(observations, options)?;
    let read = ChannelReadings::sort(observations);
    let survey = Survey::new(&read, |i| observations.taken(i));
    let level = Level::of(&survey, &read, options);
    let (channels, survey) = match &level {
        None => (&read, survey),
        Some(level) => {
            let of = |i| observations.taken(i);
            (&level.channels, Survey::new(&level.channels, of))
        }
    };
    let sigmas = survey.first_noise(options.noise);
    let chosen = matches!(options.knots, Knots::Chosen);
    let alike = chosen
        .then(|| survey.alike())
        .flatten()
        .map(|values| with_values(channels, values));
    let both = [&channels[..], alike.as_deref().unwrap_or(channels)];
    let mut ground = Ground::new(observations, options, both, weights_of(&sigmas))?;
    ground.finest = finest;
    let mut solution = if options.effects.is_empty() {
        solve(&ground, &survey, sigmas, None)?
    } else {
        let times = times(observations);
        let setting = Setting::of(
            observations,
            &times,
            options.convention,
            ground.thickness_free,
        );
        let time = |channel: usize, row: usize| times[channels[channel].source[row] as usize];
        let heights = survey.free_heights(time).map(|by_pass| {
            let heights = Heights::of(observations, by_pass);
            let none = vec![0.0; heights.unknowns().len()];
            (HEIGHTS, heights, none)
        });
        let found = search(&ground, &times, &setting, heights)?;
        let begun = Begun::new(observations, &times, &found);
        let mut solution = solve(&ground, &survey, sigmas, Some(&begun))?;
        solution.times_assumed = !setting.timed && asks_for_time(options);
        solution
    };
    if let Some(level) = level {
        level.tell(&read, &mut solution);
    }
    solution.convergence.seconds = began.elapsed().as_secs_f64();
    Ok(solution)
}

/// Whether any effect goes by the time of the readings.
fn asks_for_time(options: &Options) -> bool {
    let timed = CATALOGUE.iter().filter(|entry| entry.timed);
    timed
        .into_iter()
        .any(|entry| options.effects.iter().any(|with| with.effect == entry.name))
}

/// The fit with these effects: knots, minimum, noise, uncertainty.
fn solve(
    ground: &Ground,
    survey: &Survey,
    sigmas: Vec<f64>,
    effects: Option<&Begun>,
) -> Result<Simultaneous, ReversalError> {
    let mut breaks = ground.breaks(effects)?;
    let mut solution = solve_on(&mut breaks, ground, survey, sigmas.clone(), effects)?;
    // Knots are chosen as if noise were white, of which fine ones take up less; and what they take up is not seen as noise.
    for _ in 0..MOST_CHOICES {
        let Some(law) = solution.scatter.correlated() else {
            break;
        };
        let Some((step, readings)) = survey.pass() else {
            break;
        };
        let waves = NoiseOfWaves::new(law, step, readings);
        let waves_um = waves.in_weights(&solution.weights, &vec![1.0; solution.weights.len()]);
        solution.knots.waves = Some(waves_um);
        let at_first = waves.in_weights(&solution.weights, &ground.weights);
        if !ground.choose_under(&mut breaks, effects, &at_first) {
            break;
        }
        match solve_on(&mut breaks, ground, survey, sigmas.clone(), effects) {
            Ok(better) => solution = better,
            Err(_) => break,
        }
        solution.knots.waves = Some(waves_um);
    }
    Ok(solution)
}

/// The fit on these breaks.
fn solve_on(
    on: &mut Breaks,
    ground: &Ground,
    survey: &Survey,
    mut sigmas: Vec<f64>,
    effects: Option<&Begun>,
) -> Result<Simultaneous, ReversalError> {
    let (options, channels) = (ground.options, ground.channels);
    let breaks = on.points.clone();
    let linear = on.climbed.as_mut().and_then(Climbed::linear);
    let readings = ground.observations.readings.len();
    let unknowns = ground.unknowns(breaks.len() + 2, effects);
    enough(
        channels,
        readings,
        unknowns.free_count(),
        ground.fewest_free(),
    )?;
    let (mut problem, start) = ground.problem(&breaks, effects)?;
    let start = match problem.unknowns.thickness_index() {
        Some(index) => start_of_thickness(&mut problem, index, start, &options.minimisation)?,
        None => head_start(&problem, &start, &options.minimisation)
            .or_else(|| ground.linear_start(&problem, &start, linear))
            .unwrap_or(start),
    };
    let start = approach(&problem, start, &options.minimisation)?;
    let asked = Asked {
        noise: options.noise,
        loss: options.loss,
        minimisation: &options.minimisation,
    };
    let settled = settle(&mut problem, start, asked, survey, &mut sigmas)?;
    let knots = FittedKnots::new(breaks, on.table(), &settled.residuals);
    let mut solution = assemble(ground, &problem, &settled, &sigmas, knots)?;
    let forms = |climbed: &Climbed| climbed.forms(knots::most_read(ground.alike));
    solution.finer = on.climbed.as_ref().and_then(forms);
    is_determined(&solution, &solution.covariance, channels, &problem.weights)?;
    let declared = matches!(options.noise, Noise::Declared(_));
    if !declared && options.loss == Loss::Quadratic {
        learn_law(&mut solution, &problem, survey, &settled, &sigmas)?;
    }
    let (fit, residuals) = (&settled.fit, &settled.residuals);
    let ends = survey.spread_of_ends();
    solution.closure = closure::of(&problem, fit, channels, residuals, &solution, ends);
    if problem.joined.is_some() {
        solution.effects = told::effects(&solution, &problem)?;
        solution.effect_changes = told::changes(&solution, &problem)?;
        solution.levelled_um = told::greatest_height(&solution, &problem);
    }
    Ok(solution)
}

/// The solution with white noise.
fn assemble(
    ground: &Ground,
    problem: &Reversal,
    settled: &Settled,
    sigmas: &[f64],
    knots: FittedKnots,
) -> Result<Simultaneous, ReversalError> {
    let (options, channels) = (ground.options, ground.channels);
    let (result, by_channel) = (&settled.fit, &settled.residuals);
    let Some(covariance) = result.covariance() else {
        return Err(not_converged(problem, result));
    };
    let freedom = freedom_left(problem);
    let told = Told::white(problem, settled, sigmas, options.noise, options.loss);
    let noise = channel_noise(channels, sigmas, by_channel, &told, freedom);
    let mut residuals = vec![0.0; ground.observations.readings.len()];
    for (channel, own) in channels.iter().zip(by_channel) {
        for (i, r) in channel.source.iter().zip(own) {
            residuals[*i as usize] = *r;
        }
    }
    let joined = problem.joined.iter().flat_map(|j| j.members());
    Ok(Simultaneous {
        convention: options.convention,
        unknowns: problem.unknowns.clone(),
        bases: problem.bases.clone(),
        axis: ground.axis,
        thickness_mm: problem.thickness(&result.parameters),
        cubics: problem.cubics(&result.parameters),
        finer: None,
        gauge: problem.gauge().clone(),
        parameters: result.parameters.clone(),
        covariance,
        scatter: told.scatter,
        weights: problem.weights.clone(),
        noise,
        noise_origin: told.origin,
        agreement: told.agreement,
        residuals,
        degrees_of_freedom: freedom,
        closure: None,
        effects: Vec::new(),
        effect_changes: Vec::new(),
        times_assumed: false,
        levelled_um: None,
        joined: joined.map(|m| (m.name, Arc::clone(&m.effect))).collect(),
        knots,
        convergence: Convergence {
            ending: result.ending.clone(),
            history: settled.history.clone(),
            first_run: settled.first_run,
            seconds: 0.0,
        },
    })
}

/// The fit has no answer, with the effects in it named.
pub(super) fn not_converged(problem: &Reversal, fit: &StructuredFit) -> ReversalError {
    let ending = fit.ending.to_string();
    let reached = Box::new(Reached::of(problem, fit));
    match &problem.joined {
        None => ReversalError::NotConverged { ending, reached },
        Some(joined) => {
            let members = joined.members().iter().map(|m| m.name);
            let names: Vec<&str> = members.filter(|name| *name != HEIGHTS).collect();
            ReversalError::EffectsNotConverged {
                effects: names.join(" and "),
                ending,
                reached,
            }
        }
    }
}

/// Puts the laws of noise that repeats allow, or channels against each other, in the place of white noise, where they tell.
fn learn_law(
    solution: &mut Simultaneous,
    problem: &Reversal,
    survey: &Survey,
    settled: &Settled,
    sigmas: &[f64],
) -> Result<(), ReversalError> {
    let source = RowSource::new(solution, problem)?;
    let fit = AtRest {
        row: |channel, row| source.derivatives(channel, row),
        covariance: &solution.covariance,
        weights: &problem.weights,
        counts: (
            problem.unknowns.band_count(),
            problem.unknowns.border_count(),
            problem.unknowns.free_count(),
        ),
    };
    let residuals = &settled.residuals;
    let rounded = Rounded::of(&fit, survey, residuals)?;
    if let Some(told) = Told::along(&fit, survey, residuals, sigmas)? {
        let freedom = solution.degrees_of_freedom;
        solution.noise = channel_noise(problem.channels, sigmas, residuals, &told, freedom);
        solution.noise_origin = told.origin;
        solution.agreement = told.agreement;
        solution.knots = solution.knots.clone().under(&told);
        solution.scatter = told.scatter;
    }
    solution.scatter = solution.scatter.clone().beside(rounded);
    Ok(())
}

/// Whether there are as many readings and positions as the unknowns need.
fn enough(
    channels: &[ChannelReadings],
    readings: usize,
    unknowns: usize,
    free: usize,
) -> Result<(), ReversalError> {
    if readings < unknowns {
        return Err(ReversalError::TooFewReadings { readings, unknowns });
    }
    if readings < unknowns + free {
        return Err(ReversalError::TooFewToTellNoise {
            readings,
            unknowns,
            freedom: readings - unknowns,
        });
    }
    let positions = knots::positions(channels);
    if positions < FEWEST_POSITIONS {
        return Err(ReversalError::TooFewPositions { positions });
    }
    Ok(())
}

/// A tilt's standard uncertainty is not determined beyond so many times that of a channel's line.
const MOST_TIMES: f64 = 1e3;

/// Whether the readings determine the tilts: each against the slope of the worst channel's line.
fn is_determined(
    solution: &Simultaneous,
    covariance: &BorderedCovariance,
    channels: &[ChannelReadings],
    weights: &[f64],
) -> Result<(), ReversalError> {
    let line = channels
        .iter()
        .zip(weights)
        .map(|(c, weight)| {
            let mean = c.x.iter().sum::<f64>() / c.len() as f64;
            let spread: f64 = c.x.iter().map(|x| (x - mean).powi(2)).sum();
            mm_from_um(1.0) / (weight * spread.sqrt())
        })
        .fold(0.0, f64::max);
    for (name, terms) in solution.tilt_terms() {
        let times = covariance.variance(&[], &terms).sqrt() / line;
        if !(times <= MOST_TIMES) {
            return Err(ReversalError::NotDetermined {
                name,
                cells: solution.knots.cells(),
                times,
            });
        }
    }
    Ok(())
}

/// The noise of the channels: the weights' standard deviations times the unit in which they are.
fn channel_noise(
    channels: &[ChannelReadings],
    sigmas: &[f64],
    residuals: &[Vec<f64>],
    told: &Told,
    freedom: f64,
) -> Vec<ChannelNoise> {
    let readings: usize = channels.iter().map(ChannelReadings::len).sum();
    channels
        .iter()
        .zip(sigmas)
        .zip(residuals)
        .map(|((c, sigma), residuals)| ChannelNoise {
            channel: c.channel,
            readings: c.len(),
            residual_rms: rms(residuals),
            sigma: told.sigma(*sigma),
            degrees_of_freedom: freedom * c.len() as f64 / readings as f64,
        })
        .collect()
}

fn check(observations: &Observations, options: &Options) -> Result<(), ReversalError> {
    if observations.readings.is_empty() {
        return Err(ReversalError::NoReadings);
    }
    let refuse = |what: &str, value: f64, must: &'static str| {
        Err(ReversalError::NotUsable {
            what: what.to_owned(),
            value,
            must,
        })
    };
    for (i, reading) in observations.readings.iter().enumerate() {
        if !reading.x.is_finite() {
            return refuse(
                &format!("the position of reading {}", i + 1),
                reading.x,
                "finite",
            );
        }
        if !reading.value.is_finite() {
            return refuse(&format!("reading {}", i + 1), reading.value, "finite");
        }
        if let Some(time) = reading.time
            && !(time.is_finite() || options.effects.is_empty())
        {
            return refuse(&format!("the time of reading {}", i + 1), time, "finite");
        }
    }
    if let Thickness::Known(mm) | Thickness::Fitted(mm) = options.thickness
        && !(mm >= 0.0 && mm.is_finite())
    {
        return refuse("the thickness", mm, "zero or more");
    }
    if let Noise::Declared(sigma) = options.noise
        && !(sigma > 0.0 && sigma.is_finite())
    {
        return refuse("the noise", sigma, "greater than zero");
    }
    Ok(())
}

/// The fit with the thickness held, where to start from with the thickness free: small tilts leave
/// hardly a trace of it in the readings, and a search for it would go astray.
///
/// # Errors
/// [`ReversalError::ThicknessNotDetermined`] where its uncertainty would exceed the value it starts
/// from.
fn start_of_thickness(
    problem: &mut Reversal,
    index: usize,
    start: Parameters,
    options: &Minimisation,
) -> Result<Parameters, ReversalError> {
    problem.hold(index, true);
    let start = head_start(problem, &start, options).unwrap_or(start);
    let held = minimise(problem, start, options)?;
    let released = held.released(problem, index);
    problem.hold(index, false);
    let unit = (2.0 * held.cost / freedom_left(problem).max(1.0)).sqrt();
    let std_mm = released.map_or(f64::INFINITY, |(_, covariance)| {
        unit * covariance.border()[(index, index)].sqrt()
    });
    if std_mm > problem.thickness_mm {
        return Err(ReversalError::ThicknessNotDetermined { std_mm });
    }
    Ok(held.parameters)
}

/// Readings a cell and channel from which a head start is made.
const HEAD_START_READINGS: usize = 24;

/// A head start costs passes over a part of the readings: it must be this many times fewer.
const HEAD_START_GAIN: usize = 4;

/// The minimum over a few readings of each cell: from within the noise of that of all readings,
/// where one more step is enough. `None` where there are not many more readings than that, or
/// where those few determine no minimum.
fn head_start(
    problem: &Reversal,
    start: &Parameters,
    options: &Minimisation,
) -> Option<Parameters> {
    if problem.joined.is_some() {
        return None;
    }
    let readings: usize = problem.channels.iter().map(ChannelReadings::len).sum();
    if HEAD_START_GAIN * problem.thinned_count(HEAD_START_READINGS) > readings {
        return None;
    }
    let thin = problem.thinned(HEAD_START_READINGS);
    let fit = fit_structured(&problem.over(&thin), start.clone(), options).ok()?;
    fit.converged().then_some(fit.parameters)
}
