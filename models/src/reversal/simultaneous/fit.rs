//! The fit: seed, knots, minimisation, noise of the channels.

use std::time::Instant;

use errsep_solvers::loss::Loss;
use errsep_solvers::structured::{Fit, Parameters, hat_traces, minimise};

use super::closure;
use super::error::ReversalError;
use super::gauge::Axis;
use super::knots::{Choice, KnotTrial, first_noise};
use super::options::{Knots, Noise, Options, Thickness};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::seed;
use super::solution::{ChannelNoise, Convergence, FittedKnots, Simultaneous};
use super::unknowns::Unknowns;
use crate::reversal::Observations;

/// Rounds in which the channels' noise is estimated anew.
const MOST_NOISE_ROUNDS: usize = 10;

/// The noise has settled when no channel's changes by more than this share.
const NOISE_SETTLED: f64 = 1e-4;

/// A robust fit is near its end, where curvature helps, when a step without it promises to lower
/// the cost by less than this share.
const NEAR: f64 = 0.1;

/// A channel's noise is never taken below this share of the noisiest: a channel without any noise
/// would otherwise be the only one to count.
const LEAST_NOISE: f64 = 1e-6;

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
    let near = errsep_solvers::structured::Options {
        cost_tolerance: NEAR,
        ..options.minimisation
    };
    let robust = options.loss != Loss::Quadratic;
    let first = if robust { near } else { options.minimisation };
    let start = match thickness_free {
        true => start_of_thickness(&mut problem, start, first)?,
        false => start,
    };
    let mut result = minimise(&problem, start, first)?;
    let mut history = result.iterations.clone();
    if robust {
        // From the least-squares solution on, outliers are those of the readings, not of the start.
        problem.loss = options.loss;
        for (far, stop) in [(true, near), (false, options.minimisation)] {
            if !result.converged() {
                break;
            }
            problem.far = far;
            result = minimise(&problem, result.parameters, stop)?;
            history.extend(&result.iterations);
        }
    }
    let first_run = history.len();
    let mut freedom = shared_freedom(&problem);
    for _ in 0..MOST_NOISE_ROUNDS {
        if options.noise != Noise::PerChannel || !result.converged() {
            break;
        }
        freedom = channel_freedom(&problem, &result)?;
        let next = estimate_noise(&problem, &result, &freedom)?;
        let change = next
            .iter()
            .zip(&sigmas)
            .map(|(a, b)| (a / b - 1.0).abs())
            .fold(0.0, f64::max);
        sigmas = next;
        problem.weights = weights_of(&sigmas);
        if change <= NOISE_SETTLED {
            break;
        }
        result = minimise(&problem, result.parameters, options.minimisation)?;
        history.extend(&result.iterations);
    }
    let Some(covariance) = result.covariance() else {
        return Err(ReversalError::NotConverged {
            ending: result.ending.to_string(),
        });
    };

    let mut residuals = vec![0.0; readings];
    problem.residuals(&result.parameters, |c, i, r| {
        residuals[channels[c].source[i] as usize] = -r;
    })?;
    let total: f64 = freedom.iter().sum();
    // With equal noise rows are in units of one: their own scatter gives the unit.
    let sigma_unit = match options.noise {
        Noise::Equal if total > 0.0 => (2.0 * result.cost / total).sqrt(),
        _ => 1.0,
    };
    let unit = sigma_unit * robust_unit(&problem, &result)?;
    let noise = channels
        .iter()
        .zip(&sigmas)
        .zip(&freedom)
        .map(|((c, sigma), freedom)| ChannelNoise {
            channel: c.channel,
            readings: c.len(),
            residual_rms: rms(c.source.iter().map(|i| residuals[*i as usize])),
            sigma: sigma * sigma_unit,
            degrees_of_freedom: *freedom,
        })
        .collect();
    let closure = closure::of(&problem, &result, &channels, &residuals, unit);
    let knots = FittedKnots::new(breaks, table, &channels, &residuals);
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
    start: Parameters,
    options: errsep_solvers::structured::Options,
) -> Result<Parameters, ReversalError> {
    let Some(index) = problem.unknowns.thickness_index() else {
        return Ok(start);
    };
    problem.hold(index, true);
    let held = minimise(problem, start, options)?;
    let released = held.if_released(problem, index);
    problem.hold(index, false);
    let freedom: f64 = shared_freedom(problem).iter().sum();
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

fn weights_of(sigmas: &[f64]) -> Vec<f64> {
    sigmas.iter().map(|s| 1.0 / s).collect()
}

/// Degrees of freedom of each channel if unknowns are shared out by readings.
fn shared_freedom(problem: &Reversal) -> Vec<f64> {
    let used = problem.unknowns.free_count() as f64;
    let readings: usize = problem.channels.iter().map(ChannelReadings::len).sum();
    problem
        .channels
        .iter()
        .map(|c| c.len() as f64 * (1.0 - used / readings as f64))
        .collect()
}

/// Degrees of freedom of each channel: readings less the trace of its part of the hat matrix.
fn channel_freedom(problem: &Reversal, result: &Fit) -> Result<Vec<f64>, ReversalError> {
    let Some(covariance) = result.covariance() else {
        return Ok(shared_freedom(problem));
    };
    let traces = hat_traces(problem, &result.parameters, &covariance)?;
    Ok(problem
        .channels
        .iter()
        .zip(traces)
        .map(|(c, trace)| (c.len() as f64 - trace).max(1.0))
        .collect())
}

/// Each channel's noise: σ_c² = RSS_c/(n_c − tr H_c), the iterated estimate of variance components
/// that is unbiased at its fixed point (Förstner 1979). Under a robust loss the median of the
/// residuals takes the place of their squares.
fn estimate_noise(
    problem: &Reversal,
    result: &Fit,
    freedom: &[f64],
) -> Result<Vec<f64>, ReversalError> {
    let count = problem.channels.len();
    let mut squares = vec![0.0; count];
    let mut sizes: Vec<Vec<f64>> = vec![Vec::new(); count];
    let robust = problem.loss != Loss::Quadratic;
    problem.residuals(&result.parameters, |c, _, r| {
        if robust {
            sizes[c].push(r.abs());
        } else {
            squares[c] += r * r;
        }
    })?;
    let sigmas: Vec<f64> = (0..count)
        .map(|c| {
            let readings = problem.channels[c].len() as f64;
            if robust {
                let middle = sizes[c].len() / 2;
                let (_, median, _) = sizes[c].select_nth_unstable_by(middle, f64::total_cmp);
                // The median of |z| of a normal z is 0.6745 σ.
                *median / 0.6745 * (readings / freedom[c]).sqrt()
            } else {
                (squares[c] / freedom[c]).sqrt()
            }
        })
        .collect();
    let largest = sigmas.iter().fold(0.0_f64, |m, s| m.max(*s));
    if !(largest > 0.0) {
        return Ok(vec![1.0; count]);
    }
    Ok(sigmas
        .into_iter()
        .map(|s| s.max(LEAST_NOISE * largest))
        .collect())
}

/// By how much a robust loss stretches the standard uncertainty: the rows, each times its factor w,
/// have given (Σ w² J Jᵀ)⁻¹; the covariance is E[ψ²]/E[ψ′]² (JᵀJ)⁻¹ (Huber 1981, section 7.6),
/// ψ = ρ′ r.
fn robust_unit(problem: &Reversal, result: &Fit) -> Result<f64, ReversalError> {
    if problem.loss == Loss::Quadratic {
        return Ok(1.0);
    }
    let (mut squares, mut slopes, mut weights) = (0.0, 0.0, 0.0);
    problem.residuals(&result.parameters, |c, _, r| {
        let weighted = r * problem.weights[c];
        let s = weighted * weighted;
        let rho = problem.loss.at(s);
        squares += rho.first * rho.first * s;
        slopes += rho.first + 2.0 * s * rho.second;
        weights += problem.loss.row_factors(weighted).0.powi(2);
    })?;
    Ok(if slopes > 0.0 {
        (squares * weights).sqrt() / slopes
    } else {
        1.0
    })
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    if count > 0.0 {
        f64::sqrt(sum / count)
    } else {
        0.0
    }
}
