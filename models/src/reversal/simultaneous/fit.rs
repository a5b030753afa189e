//! The fit: seed, knots, minimisation, noise of the channels.

use std::time::Instant;

use errsep_solvers::structured::{Options as Minimisation, Parameters, minimise};

use rayon::prelude::*;

use super::closure;
use super::error::ReversalError;
use super::gauge::Axis;
use super::knots::{Choice, KnotTrial};
use super::noise::{self, Settled, first_noise, weights_of};
use super::options::{Knots, Noise, Options, Thickness};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::seed;
use super::solution::{ChannelNoise, Convergence, FittedKnots, Simultaneous};
use super::unknowns::Unknowns;
use crate::reversal::Observations;

/// Fits tilts, offsets and forms to all readings at once.
///
/// # Errors
/// [`ReversalError`]: input that cannot be used, or a fit that has no answer.
pub fn fit(observations: &Observations, options: &Options) -> Result<Simultaneous, ReversalError> {
    let began = Instant::now();
    check(observations, options)?;
    let channels = ChannelReadings::sort(observations);
    let lines = seed::lines(&channels)?;
    let axis = Axis::of(&channels).ok_or(ReversalError::OnePosition {
        channel: channels[0].channel.name(),
        x: channels[0].x[0],
    })?;
    let (thickness_mm, thickness_free) = match options.thickness {
        Thickness::NotKnown => (0.0, false),
        Thickness::Known(mm) => (mm, false),
        Thickness::Fitted(mm) => (mm, true),
    };
    let mut sigmas = first_noise(&channels, options.noise);
    let unknowns_of = |coefficients: usize| {
        Unknowns::new(
            channels.iter().map(|c| c.channel).collect(),
            options.convention,
            thickness_free,
            coefficients,
        )
    };
    let choice = Choice {
        channels: &channels,
        lines: &lines,
        axis,
        thickness_mm,
        weights: &weights_of(&sigmas),
    };
    let (breaks, table) = choose_breaks(&choice, &options.knots, unknowns_of)?;
    let unknowns = unknowns_of(breaks.len() + 2);
    let readings = observations.readings.len();
    if readings < unknowns.free_count() + 1 {
        return Err(ReversalError::TooFewReadings {
            readings,
            unknowns: unknowns.free_count(),
        });
    }
    let bases = match &options.knots {
        Knots::At(_) => {
            let basis = crate::basis::bspline::CubicBSpline::new(breaks.clone())?;
            vec![basis; unknowns.forms.len()]
        }
        _ => choice.bases(&unknowns, &breaks)?,
    };
    let tilts = match &options.start_tilts_rad {
        None => seed::tilts(&unknowns, &lines),
        Some(given) if given.len() == unknowns.tilt_count() => given.clone(),
        Some(given) => {
            return Err(ReversalError::StartLength {
                given: given.len(),
                needed: unknowns.tilt_count(),
            });
        }
    };
    let start = seed::start(&unknowns, &tilts, &lines, thickness_mm);
    let mut problem = Reversal::new(
        &channels,
        unknowns,
        bases,
        axis,
        thickness_mm,
        weights_of(&sigmas),
    );
    let start = match problem.unknowns.thickness_index() {
        Some(index) => start_of_thickness(&mut problem, index, start, options.minimisation)?,
        None => head_start(&problem, &start, options.minimisation).unwrap_or(start),
    };
    let Settled {
        fit: result,
        freedom,
        history,
        first_run,
    } = noise::settle(&mut problem, start, options, &mut sigmas)?;
    let Some(covariance) = result.covariance() else {
        return Err(ReversalError::NotConverged {
            ending: result.ending.to_string(),
        });
    };

    let by_channel = problem.residuals(&result.parameters)?;
    let total: f64 = freedom.iter().sum();
    // With equal noise rows are in units of one: their own scatter gives the unit.
    let sigma_unit = match options.noise {
        Noise::Equal if total > 0.0 => (2.0 * result.cost / total).sqrt(),
        _ => 1.0,
    };
    let unit = sigma_unit * noise::robust_unit(&problem, &by_channel);
    let noise = channels
        .par_iter()
        .zip(&sigmas)
        .zip(&freedom)
        .zip(&by_channel)
        .map(|(((c, sigma), freedom), residuals)| ChannelNoise {
            channel: c.channel,
            readings: c.len(),
            residual_rms: rms(residuals),
            sigma: sigma * sigma_unit,
            degrees_of_freedom: *freedom,
        })
        .collect();
    let closure = closure::of(&problem, &result, &channels, &by_channel, unit);
    let knots = FittedKnots::new(breaks, table, &by_channel);
    let mut residuals = vec![0.0; readings];
    for (channel, own) in channels.iter().zip(&by_channel) {
        for (i, r) in channel.source.iter().zip(own) {
            residuals[*i as usize] = *r;
        }
    }
    Ok(Simultaneous {
        convention: options.convention,
        unknowns: problem.unknowns.clone(),
        bases: problem.bases.clone(),
        axis,
        thickness_mm: problem.thickness(&result.parameters),
        cubics: problem.cubics(&result.parameters),
        gauge: problem.gauge().clone(),
        parameters: result.parameters,
        covariance,
        unit_variance: unit * unit,
        noise,
        residuals,
        degrees_of_freedom: total,
        closure,
        knots,
        convergence: Convergence {
            ending: result.ending,
            history,
            first_run,
            seconds: began.elapsed().as_secs_f64(),
        },
    })
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
    options: Minimisation,
) -> Result<Parameters, ReversalError> {
    problem.hold(index, true);
    let start = head_start(problem, &start, options).unwrap_or(start);
    let held = minimise(problem, start, options)?;
    let released = held.if_released(problem, index);
    problem.hold(index, false);
    let freedom: f64 = noise::shared_freedom(problem).iter().sum();
    let unit = (2.0 * held.cost / freedom.max(1.0)).sqrt();
    let std_mm = released.map_or(f64::INFINITY, |(_, variance)| unit * variance.sqrt());
    if std_mm > problem.thickness_mm {
        return Err(ReversalError::ThicknessNotDetermined { std_mm });
    }
    Ok(held.parameters)
}

fn choose_breaks(
    choice: &Choice,
    knots: &Knots,
    unknowns_of: impl Fn(usize) -> Unknowns,
) -> Result<(Vec<f64>, Vec<KnotTrial>), ReversalError> {
    match knots {
        Knots::At(breaks) => Ok((breaks.clone(), Vec::new())),
        Knots::Cells(cells) => Ok((choice.breaks(&unknowns_of(cells + 3), *cells)?, Vec::new())),
        Knots::Chosen => {
            let (cells, table) = choice.choose(&unknowns_of)?;
            Ok((choice.breaks(&unknowns_of(cells + 3), cells)?, table))
        }
    }
}

/// Readings a cell and channel from which a head start is made.
const HEAD_START_READINGS: usize = 24;

/// A head start costs passes over a part of the readings: it must be this many times fewer.
const HEAD_START_GAIN: usize = 4;

/// The minimum over a few readings of each cell: from within the noise of that of all readings,
/// where one more step is enough. `None` where there are not many more readings than that, or
/// where those few determine no minimum.
fn head_start(problem: &Reversal, start: &Parameters, options: Minimisation) -> Option<Parameters> {
    let thin = problem.thinned(HEAD_START_READINGS);
    let count = |channels: &[ChannelReadings]| channels.iter().map(|c| c.len()).sum::<usize>();
    if HEAD_START_GAIN * count(&thin) > count(problem.channels) {
        return None;
    }
    let fit = minimise(&problem.over(&thin), start.clone(), options).ok()?;
    fit.converged().then_some(fit.parameters)
}

fn rms(values: &[f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
