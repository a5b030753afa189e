//! The noise of the channels: a first guess, then estimated together with the fit.

use errsep_solvers::loss::Loss;
use errsep_solvers::structured::{
    Fit, Iteration, Minimiser, Options as Minimisation, Parameters, Progress, hat_traces, minimise,
};

use super::error::ReversalError;
use super::options::{Noise, Options};
use super::problem::Reversal;
use super::readings::ChannelReadings;

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

/// While a step promises to lower the cost by more than this share of it, residuals tell of the
/// start, not of the noise.
const FAR_FROM_MINIMUM: f64 = 0.5;

/// A fit with settled noise.
pub struct Settled {
    /// The fit under the last weights.
    pub fit: Fit,
    /// Degrees of freedom of each channel.
    pub freedom: Vec<f64>,
    /// One record a pass over all readings.
    pub history: Vec<Iteration>,
    /// How many of them until the first minimum.
    pub first_run: usize,
}

/// Minimises, and estimates the noise of each channel if that is asked for.
///
/// # Errors
/// [`ReversalError`] where the model is not defined.
pub fn settle(
    problem: &mut Reversal,
    start: Parameters,
    options: &Options,
    sigmas: &mut Vec<f64>,
) -> Result<Settled, ReversalError> {
    let estimated = options.noise == Noise::PerChannel;
    if options.loss == Loss::Quadratic && estimated {
        return settle_on_the_way(problem, start, options, sigmas);
    }
    let near = Minimisation {
        cost_tolerance: NEAR,
        ..options.minimisation
    };
    let robust = options.loss != Loss::Quadratic;
    let first = if robust { near } else { options.minimisation };
    let mut fit = minimise(problem, start, first)?;
    let mut history = fit.iterations.clone();
    if robust {
        // From the least-squares solution on, outliers are those of the readings, not of the start.
        problem.loss = options.loss;
        for (far, stop) in [(true, near), (false, options.minimisation)] {
            if !fit.converged() {
                break;
            }
            problem.far = far;
            fit = minimise(problem, fit.parameters, stop)?;
            history.extend(&fit.iterations);
        }
    }
    let first_run = history.len();
    let mut freedom = shared_freedom(problem);
    for _ in 0..MOST_NOISE_ROUNDS {
        let Some(covariance) = fit.covariance().filter(|_| estimated) else {
            break;
        };
        let traces = hat_traces(problem, &fit.parameters, &covariance)?;
        freedom = freedom_left(problem, &traces);
        let residuals = problem.residuals(&fit.parameters)?;
        let next = floored(robust_sigmas(&residuals, &freedom));
        let change = largest_change(&next, sigmas);
        *sigmas = next;
        problem.weights = weights_of(sigmas);
        if change <= NOISE_SETTLED {
            break;
        }
        fit = minimise(problem, fit.parameters, options.minimisation)?;
        history.extend(&fit.iterations);
    }
    Ok(Settled {
        fit,
        freedom,
        history,
        first_run,
    })
}

/// Least squares: at every point the noise is brought to its fixed point on the linear prediction,
/// whose rows are at hand in compressed form; no pass over the readings is spent on it.
///
/// σ_c² = RSS_c/(n_c − tr H_c), the iterated estimate of variance components that is unbiased at
/// its fixed point (Förstner 1979).
fn settle_on_the_way(
    problem: &mut Reversal,
    start: Parameters,
    options: &Options,
    sigmas: &mut Vec<f64>,
) -> Result<Settled, ReversalError> {
    let mut freedom = shared_freedom(problem);
    let mut minimiser = Minimiser::gathering(problem, start, options.minimisation)?;
    let ending = loop {
        for _ in 0..MOST_NOISE_ROUNDS {
            let Some(parts) = minimiser.parts(problem) else {
                break;
            };
            let far = !(parts.predicted <= FAR_FROM_MINIMUM * minimiser.cost());
            if far && !parts.last {
                break;
            }
            freedom = freedom_left(problem, &parts.traces);
            let next = floored(
                sigmas
                    .iter()
                    .zip(&parts.squares)
                    .zip(&freedom)
                    .map(|((sigma, squares), freedom)| sigma * (squares / freedom).sqrt())
                    .collect(),
            );
            let change = largest_change(&next, sigmas);
            if change <= NOISE_SETTLED {
                break;
            }
            let factors: Vec<f64> = sigmas
                .iter()
                .zip(&next)
                .map(|(old, new)| old / new)
                .collect();
            minimiser.reweigh(&factors);
            *sigmas = next;
            problem.weights = weights_of(sigmas);
            // The next change is smaller by the share of the readings that unknowns use up.
            let readings = problem.channels.iter().map(|c| c.len() as f64);
            let used = parts.traces.iter().zip(readings).map(|(t, n)| t / n);
            if change * used.fold(0.0, f64::max) <= NOISE_SETTLED {
                break;
            }
        }
        if let Progress::Done(ending) = minimiser.advance(problem) {
            break ending;
        }
    };
    let fit = minimiser.finish(ending);
    Ok(Settled {
        freedom,
        history: fit.iterations.clone(),
        first_run: fit.iterations.len(),
        fit,
    })
}

/// 1/σ by channel.
pub fn weights_of(sigmas: &[f64]) -> Vec<f64> {
    sigmas.iter().map(|s| 1.0 / s).collect()
}

fn largest_change(next: &[f64], sigmas: &[f64]) -> f64 {
    let shares = next.iter().zip(sigmas).map(|(a, b)| (a / b - 1.0).abs());
    shares.fold(0.0, f64::max)
}

/// Degrees of freedom of each channel if unknowns are shared out by readings.
pub fn shared_freedom(problem: &Reversal) -> Vec<f64> {
    let used = problem.unknowns.free_count() as f64;
    let readings: usize = problem.channels.iter().map(ChannelReadings::len).sum();
    problem
        .channels
        .iter()
        .map(|c| c.len() as f64 * (1.0 - used / readings as f64))
        .collect()
}

/// Degrees of freedom of each channel: readings less the trace of its part of the hat matrix.
fn freedom_left(problem: &Reversal, traces: &[f64]) -> Vec<f64> {
    problem
        .channels
        .iter()
        .zip(traces)
        .map(|(c, trace)| (c.len() as f64 - trace).max(1.0))
        .collect()
}

/// Under a robust loss the median of the residuals takes the place of their squares.
fn robust_sigmas(residuals: &[Vec<f64>], freedom: &[f64]) -> Vec<f64> {
    residuals
        .iter()
        .zip(freedom)
        .map(|(own, freedom)| {
            let mut sizes: Vec<f64> = own.iter().map(|r| r.abs()).collect();
            let middle = sizes.len() / 2;
            let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
            // The median of |z| of a normal z is 0.6745 σ.
            *median / 0.6745 * (own.len() as f64 / freedom).sqrt()
        })
        .collect()
}

fn floored(sigmas: Vec<f64>) -> Vec<f64> {
    let largest = sigmas.iter().fold(0.0_f64, |m, s| m.max(*s));
    if !(largest > 0.0) {
        return vec![1.0; sigmas.len()];
    }
    sigmas
        .into_iter()
        .map(|s| s.max(LEAST_NOISE * largest))
        .collect()
}

/// By how much a robust loss stretches the standard uncertainty: the rows, each times its factor w,
/// have given (Σ w² J Jᵀ)⁻¹; the covariance is E[ψ²]/E[ψ′]² (JᵀJ)⁻¹ (Huber 1981, section 7.6),
/// ψ = ρ′ r.
pub fn robust_unit(problem: &Reversal, residuals: &[Vec<f64>]) -> f64 {
    if problem.loss == Loss::Quadratic {
        return 1.0;
    }
    let (mut squares, mut slopes, mut weights) = (0.0, 0.0, 0.0);
    for (own, weight) in residuals.iter().zip(&problem.weights) {
        for r in own {
            let weighted = r * weight;
            let s = weighted * weighted;
            let rho = problem.loss.at(s);
            squares += rho.first * rho.first * s;
            slopes += rho.first + 2.0 * s * rho.second;
            weights += problem.loss.row_factors(weighted).0.powi(2);
        }
    }
    if slopes > 0.0 {
        (squares * weights).sqrt() / slopes
    } else {
        1.0
    }
}

/// First guess of each channel's noise, µm: from every reading against the line through its
/// neighbours, by the median, so that neither smooth forms nor outliers count.
pub fn first_noise(channels: &[ChannelReadings], noise: Noise) -> Vec<f64> {
    match noise {
        Noise::Declared(sigma) => vec![sigma; channels.len()],
        Noise::Equal => vec![1.0; channels.len()],
        Noise::PerChannel => {
            let guesses: Vec<f64> = channels.iter().map(median_second_difference).collect();
            let largest = guesses.iter().fold(0.0_f64, |m, g| m.max(*g));
            // Channels whose readings show no noise at all get a share of the noisiest.
            guesses
                .into_iter()
                .map(|g| {
                    if largest > 0.0 {
                        g.max(1e-3 * largest)
                    } else {
                        1.0
                    }
                })
                .collect()
        }
    }
}

/// Most differences that enter the median.
const DIFFERENCES: usize = 4096;

fn median_second_difference(channel: &ChannelReadings) -> f64 {
    let count = channel.len().saturating_sub(2);
    let step = count.div_ceil(DIFFERENCES).max(1);
    let mut scaled: Vec<f64> = (0..count)
        .step_by(step)
        .map(|i| {
            let (x, y) = (&channel.x[i..i + 3], &channel.value[i..i + 3]);
            let share = if x[2] > x[0] {
                (x[1] - x[0]) / (x[2] - x[0])
            } else {
                0.5
            };
            let rest = y[1] - (1.0 - share) * y[0] - share * y[2];
            rest.abs() / (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt()
        })
        .collect();
    if scaled.is_empty() {
        return 0.0;
    }
    let middle = scaled.len() / 2;
    let (_, median, _) = scaled.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of |z| of a normal z is 0.6745 σ.
    *median / 0.6745
}
