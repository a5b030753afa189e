//! The noise of the channels beside the fit.
//!
//! All channels have one standard deviation, unless their own are told apart by neighbouring readings
//! ([`Levels`]), never by what the model leaves of them: where a model misses anything, one channel could
//! take it all and the others would be trusted. What the model misses is shared by all channels alike.

use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;
use errsep_solvers::outcome::Iteration;
use errsep_solvers::structured::{Parameters, StructuredFit, hat_traces};

use super::levels::{Level, Levels};
use super::survey::Survey;
use super::{Weighed, freedom_left, sum_of_squares, weights_of};
use crate::reversal::simultaneous::Noise;

/// Rounds in which the channels' noise is estimated anew.
const MOST_ROUNDS: usize = 10;

/// The noise has settled when the weights change by no more than this share.
const SETTLED: f64 = 1e-2;

/// Under a robust loss the scale decides what counts as an outlier.
const ROBUST_SETTLED: f64 = 1e-4;

/// A robust fit is near its end, where curvature helps, when a step without it promises to lower
/// the cost by less than this share.
const NEAR: f64 = 0.1;

/// Model and readings disagree where the variance left over exceeds the noise by so many standard
/// deviations of the logarithm of their ratio.
const CLEAR: f64 = 3.5;

/// A fit with settled noise.
pub struct Settled {
    /// The fit under the last weights.
    pub fit: StructuredFit,
    /// Reading less model, µm, by channel in the order of its sorted readings.
    pub residuals: Vec<Vec<f64>>,
    /// What the noise is known to be apart from the model, in weighted units; `None` where nothing
    /// tells.
    pub known: Option<Level>,
    /// One record a pass over all readings.
    pub history: Vec<Iteration>,
    /// How many of them until the first minimum.
    pub first_run: usize,
}

/// How to minimise, and what is known of the noise.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    pub noise: Noise,
    pub loss: Loss,
    pub minimisation: &'a Minimisation,
}

/// Minimises, and finds the weights of the channels if they are asked for.
///
/// # Errors
/// Those of the problem, where the model is not defined.
pub fn settle<P: Weighed>(
    problem: &mut P,
    start: Parameters,
    options: Asked,
    survey: &Survey,
    sigmas: &mut Vec<f64>,
) -> Result<Settled, P::Error> {
    let robust = options.loss != Loss::Quadratic;
    let (mut fit, mut history) = first_fit(problem, start, options)?;
    let first_run = history.len();
    let mut residuals = problem.residuals(&fit.parameters)?;
    let mut known = match options.noise {
        Noise::Declared(_) => Some(Level {
            variance: 1.0,
            whole: 1.0,
            freedom: f64::INFINITY,
        }),
        _ => None,
    };
    // Variance that every channel has got for what the model misses.
    let mut missed = 0.0;
    for round in 0..MOST_ROUNDS {
        if matches!(options.noise, Noise::Declared(_)) || !fit.converged() {
            break;
        }
        let levels = survey.levels(&residuals);
        let mut next = told_apart(problem, &fit, &levels, options.noise, survey)?;
        known = known_level(problem, &levels, sigmas);
        if robust {
            let scale = robust_scale(&residuals, &next, freedom_left(problem));
            next.iter_mut().for_each(|s| *s *= scale);
        } else if !all_equal(&next) && (round > 0 || !all_equal(sigmas)) {
            // Weights by the noise alone would hand what the model misses to the noisiest channel. Lines by which repeats
            // differ are theirs, not the model's.
            let (left, lines) = survey.left_of_repeats(&residuals);
            let freedom = freedom_left(problem) - lines as f64;
            missed = shared_misfit(&left, &next, &levels, freedom, missed);
            next.iter_mut().for_each(|s| *s = s.hypot(missed.sqrt()));
        }
        if change(&next, sigmas, robust) <= if robust { ROBUST_SETTLED } else { SETTLED } {
            break;
        }
        *sigmas = next;
        problem.weigh(weights_of(sigmas));
        fit = problem.minimise(fit.parameters, options.minimisation)?;
        history.extend(&fit.history);
        residuals = problem.residuals(&fit.parameters)?;
    }
    Ok(Settled {
        fit,
        residuals,
        known,
        history,
        first_run,
    })
}

/// The fit under the first weights; under a robust loss least squares first, so that outliers are
/// those of the readings, not of the start.
fn first_fit<P: Weighed>(
    problem: &mut P,
    start: Parameters,
    options: Asked,
) -> Result<(StructuredFit, Vec<Iteration>), P::Error> {
    if options.loss == Loss::Quadratic {
        let fit = problem.minimise(start, options.minimisation)?;
        let history = fit.history.clone();
        return Ok((fit, history));
    }
    let near = Minimisation {
        cost_tolerance: NEAR,
        ..options.minimisation.clone()
    };
    let mut fit = problem.minimise(start, &near)?;
    let mut history = fit.history.clone();
    problem.lose(options.loss, false);
    for (far, stop) in [(true, &near), (false, options.minimisation)] {
        if !fit.converged() {
            break;
        }
        problem.lose(options.loss, far);
        fit = problem.minimise(fit.parameters, stop)?;
        history.extend(&fit.history);
    }
    Ok((fit, history))
}

/// The share of its readings with which a channel tells of its own noise. H the hat matrix, the
/// information on the variances of channels a and b in the residuals is ½‖(I − H)_ab‖², and with
/// Σ_b ‖H_ab‖² = tr H_aa its least eigenvalue is at least ½ min (n_a − 3 tr H_aa).
fn share_left(readings: usize, used: f64) -> f64 {
    1.0 - 3.0 * used / readings as f64
}

/// The channels' standard deviations as far as they are told apart.
fn told_apart<P: Weighed>(
    problem: &P,
    fit: &StructuredFit,
    levels: &Levels,
    noise: Noise,
    survey: &Survey,
) -> Result<Vec<f64>, P::Error> {
    let channels = survey.channels();
    if noise == Noise::Equal || !levels.differ() {
        return Ok(levels.sigmas(&vec![0.0; channels]));
    }
    let kept = match fit.covariance() {
        // Repeats tell of their noise whatever the fit does.
        _ if !survey.repeats.is_empty() => vec![1.0; channels],
        None => vec![0.0; channels],
        Some(covariance) => hat_traces(problem, &fit.parameters, &covariance)?
            .into_iter()
            .zip(problem.lengths())
            .map(|(used, readings)| share_left(readings, used))
            .collect(),
    };
    Ok(levels.sigmas(&kept))
}

/// What is known of the noise apart from the model, in units of the weights; `None` where the model
/// has so many unknowns that neighbours are part of it.
fn known_level(problem: &impl Weighed, levels: &Levels, sigmas: &[f64]) -> Option<Level> {
    let readings: usize = problem.lengths().iter().sum();
    if share_left(readings, problem.free_count() as f64) <= 0.0 {
        return None;
    }
    let weighted = levels.0.iter().zip(sigmas).map(|(l, s)| Level {
        variance: l.variance / (s * s),
        whole: l.whole / (s * s),
        ..*l
    });
    let pooled = Levels(weighted.collect()).pooled();
    (pooled.freedom > 0.0).then_some(pooled)
}

/// Whether the variance left by a fit exceeds the noise clearly.
fn exceeds(left: f64, freedom: f64, known: Level) -> bool {
    let doubt = (2.0 / known.freedom + 2.0 / freedom).sqrt();
    left > known.whole * (CLEAR * doubt).exp()
}

/// What is left of the readings beside the noise: whether the model clearly misses something, and how
/// much, in weighted units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Left {
    /// Whether it does, where anything tells.
    pub clear: Option<bool>,
    /// Variance of what it misses; zero where that is not clear.
    pub variance: f64,
}

impl Left {
    /// From the residuals of single traces against what is known of the noise.
    pub fn of_residuals(
        problem: &impl Weighed,
        residuals: &[Vec<f64>],
        known: Option<Level>,
    ) -> Self {
        let freedom = freedom_left(problem);
        let left = weighted_squares(residuals, problem.weights()) / freedom;
        let clear = known
            .filter(|_| freedom > 0.0)
            .map(|known| exceeds(left, freedom, known));
        Self {
            clear,
            variance: match (clear, known) {
                (Some(true), Some(known)) => (left - known.whole).max(0.0),
                _ => 0.0,
            },
        }
    }
}

/// The variance, the same in every channel, that beside the noise accounts for the residuals:
/// Σ RSS_c/(σ_c² + s) = ν (after Mandel and Paule 1970); zero where the noise alone does.
fn shared_misfit(
    residuals: &[Vec<f64>],
    sigmas: &[f64],
    levels: &Levels,
    freedom: f64,
    before: f64,
) -> f64 {
    let squares: Vec<f64> = residuals.iter().map(|r| sum_of_squares(r)).collect();
    let left = |s: f64| -> f64 {
        let shares = squares.iter().zip(sigmas);
        shares.map(|(rss, sigma)| rss / (sigma * sigma + s)).sum()
    };
    let known = Level {
        variance: 1.0,
        whole: 1.0,
        freedom: levels.pooled().freedom,
    };
    if before <= 0.0 && !exceeds(left(0.0) / freedom, freedom, known) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, squares.iter().sum::<f64>() / freedom);
    // Halving to rounding.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left(middle) > freedom {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

fn all_equal(sigmas: &[f64]) -> bool {
    sigmas.windows(2).all(|pair| pair[0] == pair[1])
}

/// The largest change, relative: of the standard deviations, or of their ratios where nothing hangs on
/// the scale.
fn change(next: &[f64], sigmas: &[f64], scale_counts: bool) -> f64 {
    let ratios: Vec<f64> = next.iter().zip(sigmas).map(|(a, b)| a / b).collect();
    let unit = match ratios.first() {
        Some(first) if !scale_counts => *first,
        _ => 1.0,
    };
    let changes = ratios.iter().map(|r| (r / unit - 1.0).abs());
    changes.fold(0.0, f64::max)
}

/// Under a robust loss the median of all residuals takes the place of their squares; in units of the
/// channels' standard deviations.
fn robust_scale(residuals: &[Vec<f64>], sigmas: &[f64], freedom: f64) -> f64 {
    let scaled = residuals.iter().zip(sigmas);
    let mut sizes: Vec<f64> = scaled
        .flat_map(|(own, sigma)| own.iter().map(move |r| (r / sigma).abs()))
        .collect();
    let count = sizes.len();
    let (_, median, _) = sizes.select_nth_unstable_by(count / 2, f64::total_cmp);
    // The median of |z| of a normal z is 0.6745 σ.
    let scale = *median / 0.6745 * (count as f64 / freedom).sqrt();
    if scale > 0.0 { scale } else { 1.0 }
}

/// By how much a robust loss stretches the standard uncertainty: the rows, each times its factor w,
/// have given (Σ w² J Jᵀ)⁻¹; the covariance is E[ψ²]/E[ψ′]² (JᵀJ)⁻¹ (Huber 1981, section 7.6),
/// ψ = ρ′ r.
pub fn robust_unit(problem: &impl Weighed, residuals: &[Vec<f64>]) -> f64 {
    let loss = problem.loss();
    let (mut squares, mut slopes, mut weights) = (0.0, 0.0, 0.0);
    for (own, weight) in residuals.iter().zip(problem.weights()) {
        for r in own {
            let weighted = r * weight;
            let s = weighted * weighted;
            let rho = loss.at(s);
            squares += rho.first * rho.first * s;
            slopes += rho.first + 2.0 * s * rho.second;
            weights += loss.row_factors(weighted).0.powi(2);
        }
    }
    if slopes > 0.0 {
        (squares * weights).sqrt() / slopes
    } else {
        1.0
    }
}

/// Σ (residual/σ)².
pub fn weighted_squares(residuals: &[Vec<f64>], weights: &[f64]) -> f64 {
    let channels = residuals.iter().zip(weights);
    channels
        .map(|(own, weight)| weight * weight * sum_of_squares(own))
        .sum()
}
