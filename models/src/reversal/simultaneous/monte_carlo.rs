//! Uncertainty by propagation of distributions (JCGM 101:2008, clause 7): readings are drawn anew
//! around the fitted model with the estimated noise, and fitted again on the same knots.

use std::collections::BTreeMap;

use errsep_solvers::options::Options as Minimisation;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::descent::minimise;
use super::effects::times;
use super::error::ReversalError;
use super::fit::not_converged;
use super::readings::ChannelReadings;
use super::solution::{NoiseOrigin, SharedNoise, Simultaneous};
use crate::noise::Law;
use crate::reversal::Observations;
use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::channel_noise::traces::Trace;

/// What the trials say of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Its name.
    pub name: String,
    /// Mean over the trials.
    pub mean: f64,
    /// Standard deviation over the trials.
    pub std: f64,
    /// The 2.5 % and 97.5 % quantiles: the probabilistically symmetric 95 % interval.
    pub interval_95: [f64; 2],
}

/// The result of the trials.
#[derive(Debug, Clone, PartialEq)]
pub struct MonteCarlo {
    /// Number of trials.
    pub trials: usize,
    /// The tilts, rad, in the order of [`Simultaneous::tilts`].
    pub tilts: Vec<Spread>,
    /// The forms, µm, in the order of [`Simultaneous::forms`]: one a position.
    pub forms: Vec<Vec<Spread>>,
}

/// Draws and fits `trials` times; forms are looked at in the positions `x`, mm.
///
/// # Errors
/// [`ReversalError`] where a trial has no answer, or for fewer than two trials.
pub fn monte_carlo(
    solution: &Simultaneous,
    observations: &Observations,
    x: &[f64],
    trials: usize,
    seed: u64,
) -> Result<MonteCarlo, ReversalError> {
    if trials < 2 {
        return Err(ReversalError::NotUsable {
            what: "the number of trials".to_owned(),
            value: trials as f64,
            must: "two or more",
        });
    }
    let mut channels = ChannelReadings::sort(observations);
    let models: Vec<Vec<f64>> = channels
        .iter()
        .map(|c| {
            c.value
                .iter()
                .zip(&c.source)
                .map(|(value, i)| value - solution.residuals.get(*i as usize).unwrap_or(&0.0))
                .collect()
        })
        .collect();
    let sigmas: Vec<f64> = solution.noise.iter().map(|n| n.sigma).collect();
    let laws = laws(solution);
    let shared = match solution.noise_origin {
        NoiseOrigin::Repeats { shared, .. } => shared,
        _ => None,
    };
    let times = times(observations);
    let joined = solution.joined(observations, &times);
    let sorted = channels.clone();
    let survey = Survey::new(&sorted, |i| observations.taken(i));
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut tilts: Vec<Vec<f64>> = Vec::new();
    let mut forms: Vec<Vec<f64>> = Vec::new();
    for _ in 0..trials {
        let mut noise = Noise::new(&laws, shared, &survey);
        for (c, (channel, model)) in channels.iter_mut().zip(&models).enumerate() {
            for trace in &survey.traces[c] {
                let rows: Vec<usize> = (0..trace.len()).map(|k| trace.row(k)).collect();
                let x: Vec<f64> = rows.iter().map(|row| channel.x[*row]).collect();
                let drawn = noise.of_trace(c, trace, &x, &mut rng);
                for (row, noise) in rows.into_iter().zip(drawn) {
                    channel.value[row] = model[row] + noise;
                }
            }
        }
        let mut problem = solution.problem(&channels, joined.as_ref());
        problem.weights = sigmas.iter().map(|s| 1.0 / s).collect();
        let fit = minimise(
            &mut problem,
            solution.parameters.clone(),
            &Minimisation::structured(),
        )?;
        if !fit.converged() {
            return Err(not_converged(&problem, &fit));
        }
        let mut trial = solution.clone();
        trial.cubics = problem.cubics(&fit.parameters);
        trial.parameters = fit.parameters;
        tilts.push(trial.tilts().iter().map(|t| t.angle.value).collect());
        forms.push(
            trial
                .form_values(x)
                .into_iter()
                .flat_map(|(_, values)| values)
                .collect(),
        );
    }
    let tilt_names: Vec<String> = solution.tilts().into_iter().map(|t| t.name).collect();
    let form_names: Vec<String> = solution
        .form_values(&[])
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    Ok(MonteCarlo {
        trials,
        tilts: tilt_names
            .into_iter()
            .enumerate()
            .map(|(j, name)| spread(name, tilts.iter().map(|t| t[j]).collect()))
            .collect(),
        forms: form_names
            .into_iter()
            .enumerate()
            .map(|(f, name)| {
                (0..x.len())
                    .map(|k| {
                        let at = f * x.len() + k;
                        spread(name.clone(), forms.iter().map(|t| t[at]).collect())
                    })
                    .collect()
            })
            .collect(),
    })
}

/// Draws the noise of all traces of a trial.
struct Noise<'a> {
    laws: &'a [Law],
    shared: Option<SharedNoise>,
    survey: &'a Survey<'a>,
    /// Of traces whose partner has been drawn: channel, direction, repeat.
    waiting: BTreeMap<(usize, bool, u32), Vec<f64>>,
}

impl<'a> Noise<'a> {
    fn new(laws: &'a [Law], shared: Option<SharedNoise>, survey: &'a Survey<'a>) -> Self {
        Self {
            laws,
            shared,
            survey,
            waiting: BTreeMap::new(),
        }
    }

    /// The noise of a trace at these positions.
    fn of_trace(&mut self, c: usize, trace: &Trace, x: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        if let Some(noise) = (self.waiting).remove(&(c, trace.backward, trace.repeat)) {
            return noise;
        }
        let mut draw = |law: &Law| {
            let mut noise = vec![0.0; x.len()];
            law.draw(x, rng, &mut noise);
            noise
        };
        let partner = self.survey.read_together(c, trace).zip(self.shared);
        let Some((other, shared)) = partner else {
            return draw(&self.laws[c]);
        };
        let (both, against) = (draw(&shared.together), draw(&shared.against));
        let combined = |sign: f64| {
            let of = both.iter().zip(&against);
            of.map(|(s, d)| (s + sign * d) * std::f64::consts::FRAC_1_SQRT_2)
                .collect::<Vec<f64>>()
        };
        let key = (other, trace.backward, trace.repeat);
        self.waiting.insert(key, combined(-1.0));
        combined(1.0)
    }
}

/// The law of each channel's readings.
fn laws(solution: &Simultaneous) -> Vec<Law> {
    let variances = || solution.noise.iter().map(|n| n.sigma * n.sigma);
    match solution.noise_origin {
        // Shifts and drifts are as great in channels of any noise.
        NoiseOrigin::Repeats { law, .. } | NoiseOrigin::BetweenChannels { law } => variances()
            .map(|v| {
                let own = (v - law.shift) / law.of_readings().max(f64::MIN_POSITIVE);
                Law {
                    shift: law.shift,
                    drift: law.drift,
                    ..law.times(own.max(0.0))
                }
            })
            .collect(),
        NoiseOrigin::Declared | NoiseOrigin::Residuals => variances().map(Law::of_white).collect(),
    }
}

fn spread(name: String, mut values: Vec<f64>) -> Spread {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    values.sort_by(f64::total_cmp);
    let quantile = |p: f64| {
        let at = p * (n - 1.0);
        let (low, share) = (at.floor() as usize, at.fract());
        let high = (low + 1).min(values.len() - 1);
        values[low] + share * (values[high] - values[low])
    };
    Spread {
        interval_95: [quantile(0.025), quantile(0.975)],
        name,
        mean,
        std: (squares / (n - 1.0)).sqrt(),
    }
}
