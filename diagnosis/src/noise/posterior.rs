//! Which laws of noise the repeats allow, each with its probability.
//!
//! A single best law passes its own error on to every probability that is computed from it: a shift
//! of the traces that sixteen contrasts happen not to show would make each shift of a trace a
//! discovery. So the null law is drawn with laws of noise drawn from their posterior: four kinds of
//! law (white alone, with a correlated part, with shifts, with both), where whole traces may drift each without and with
//! that, all as probable beforehand; the
//! ratios of the standard deviations to the white one, of the drift at the ends of the travel, follow half-Cauchy laws of
//! scale one (Gelman, Bayesian Analysis 1 (2006) 515), the logarithm of the correlation length is uniform between the
//! spacing and the length of a trace, that of the white variance everywhere. The posterior is
//! sampled by importance resampling from Student's law about each mode.

use errsep_models::noise::Law;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use statrs::function::gamma::ln_gamma;

use crate::noise::contrasts::Contrasts;
use crate::noise::law::Drifts;
use crate::search::{Reach, coordinate_search};

/// Proposals for each kind of law.
const PROPOSALS: usize = 300;
/// Laws drawn.
const LAWS: usize = 400;
/// Degrees of freedom of the proposals: heavier tails than the posterior's.
const TAILS: f64 = 5.0;

/// Which parts a kind of law has.
#[derive(Debug, Clone, Copy)]
struct Kind {
    correlated: bool,
    shift: bool,
    drift: bool,
}

/// The kinds of law: white alone, with shifts, with a correlated part, with both; where traces may drift each without a drift
/// and with it.
fn kinds(drifts: Drifts) -> impl Iterator<Item = Kind> {
    let drifts = match drifts {
        Drifts::Never => &[false][..],
        Drifts::Possible => &[false, true],
    };
    drifts.iter().flat_map(|drift| {
        [(false, false), (false, true), (true, false), (true, true)].map(|(correlated, shift)| {
            Kind {
                correlated,
                shift,
                drift: *drift,
            }
        })
    })
}

/// A proposed law and its logarithmic weight.
pub(crate) struct Proposal {
    /// The law, its white variance one.
    pub ratios: Law,
    /// Square of what is seen in units of that law.
    pub quadratic: f64,
    pub weight: f64,
}

/// What contrasts allow.
pub(crate) struct Allowed {
    /// Laws of noise drawn from their posterior.
    pub laws: Vec<Law>,
    /// Logarithm of the probability density of the contrasts under all laws together, to a constant that their number
    /// and places alone decide.
    pub log_evidence: f64,
}

/// Laws of noise drawn from what the contrasts allow, where any can be told.
pub(crate) fn allowed(contrasts: &Contrasts, drifts: Drifts, seed: u64) -> Option<Allowed> {
    let (spacing, travel) = contrasts.reach()?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let scale = Scale {
        lengths: (spacing.ln(), travel.max(2.0 * spacing).ln()),
        half: 0.5 * travel,
    };
    let mut proposals: Vec<Proposal> = Vec::new();
    let mut tried = 0;
    for kind in kinds(drifts) {
        proposals.extend(proposed(contrasts, kind, scale, &mut random));
        tried += 1;
    }
    let mut allowed = resampled(&proposals, contrasts.count() as f64, &mut random)?;
    // Each kind is as probable as the others beforehand.
    allowed.log_evidence -= f64::from(tried).ln();
    Some(allowed)
}

/// What points of a search stand for.
#[derive(Debug, Clone, Copy)]
struct Scale {
    /// Logarithms of the least and the greatest correlation length.
    lengths: (f64, f64),
    /// Half a travel, at which a slope is taken.
    half: f64,
}

impl Kind {
    /// The law of a point: standard deviations in units of the white one, of the correlated part with ln of the length, of
    /// the shift, and of the drift at the ends of the travel.
    fn ratios(self, point: &[f64], scale: Scale) -> Law {
        let mut law = Law::of_white(1.0);
        let mut rest = point;
        if let (true, [sd, log_length, others @ ..]) = (self.correlated, rest) {
            law.correlated = sd * sd;
            law.length = log_length.exp();
            rest = others;
        }
        if let (true, [sd, others @ ..]) = (self.shift, rest) {
            law.shift = sd * sd;
            rest = others;
        }
        if let (true, [sd, ..]) = (self.drift, rest) {
            law.drift = (sd / scale.half).powi(2);
        }
        law
    }

    /// −ln of the prior density at a point, infinite outside.
    fn minus_log_prior(self, point: &[f64], (least, most): (f64, f64)) -> f64 {
        let half_cauchy = |sd: &f64| {
            if *sd < 0.0 {
                f64::INFINITY
            } else {
                (std::f64::consts::FRAC_PI_2 * (1.0 + sd * sd)).ln()
            }
        };
        let mut sum = 0.0;
        let mut rest = point;
        if let (true, [sd, log_length, others @ ..]) = (self.correlated, rest) {
            sum += half_cauchy(sd);
            sum += if *log_length < least || *log_length > most {
                f64::INFINITY
            } else {
                (most - least).ln()
            };
            rest = others;
        }
        sum + rest.iter().map(half_cauchy).sum::<f64>()
    }

    /// Where the search for the mode begins, and its steps.
    fn starts(self, (least, most): (f64, f64)) -> Vec<(Vec<f64>, Vec<f64>)> {
        let of_whole = vec![0.3; usize::from(self.shift) + usize::from(self.drift)];
        let at = |parts: &[f64], steps: &[f64]| {
            let (mut p, mut s) = (parts.to_vec(), steps.to_vec());
            p.extend(&of_whole);
            s.extend(of_whole.iter().map(|v| 0.5 * v));
            (p, s)
        };
        if !self.correlated {
            return vec![at(&[], &[])];
        }
        [0.1, 0.3, 0.55]
            .iter()
            .map(|part| at(&[0.5, least + part * (most - least)], &[0.25, 0.5]))
            .collect()
    }
}

/// Draws of one kind of law from Student's law about its mode, with their weights.
fn proposed(
    contrasts: &Contrasts,
    kind: Kind,
    scale: Scale,
    random: &mut ChaCha8Rng,
) -> Vec<Proposal> {
    let judged = |point: &[f64]| -> (f64, f64) {
        let prior = kind.minus_log_prior(point, scale.lengths);
        if !prior.is_finite() {
            return (f64::INFINITY, 1.0);
        }
        let likelihood = contrasts.likelihood(&kind.ratios(point, scale));
        (likelihood.minus_log + prior, likelihood.quadratic)
    };
    let mode = kind
        .starts(scale.lengths)
        .into_iter()
        .map(|(start, steps)| coordinate_search(&start, &steps, Reach::WIDE, |p| judged(p).0))
        .fold((Vec::new(), f64::INFINITY), |best, next| {
            if next.1 < best.1 { next } else { best }
        })
        .0;
    let d = mode.len();
    if d == 0 {
        let (value, quadratic) = judged(&mode);
        return vec![Proposal {
            ratios: kind.ratios(&mode, scale),
            quadratic,
            weight: -value,
        }];
    }
    let Some(spread) = spread(&mode, |p| judged(p).0) else {
        return Vec::new();
    };
    let log_volume: f64 = (0..d).map(|k| spread[(k, k)].ln()).sum();
    let dimension = d as f64;
    let norm = ln_gamma(0.5 * (TAILS + dimension))
        - ln_gamma(0.5 * TAILS)
        - 0.5 * dimension * (TAILS * std::f64::consts::PI).ln()
        - log_volume;
    let Ok(chi) = ChiSquared::new(TAILS) else {
        return Vec::new();
    };
    (0..PROPOSALS)
        .filter_map(|_| {
            let normal = DVector::from_fn(d, |_, _| StandardNormal.sample(random));
            let swell: f64 = (TAILS / chi.sample(random)).sqrt();
            let z: DVector<f64> = normal * swell;
            let step = &spread * &z;
            let point: Vec<f64> = mode.iter().zip(step.iter()).map(|(m, s)| m + s).collect();
            let (value, quadratic) = judged(&point);
            let density = norm - 0.5 * (TAILS + dimension) * (z.norm_squared() / TAILS).ln_1p();
            value.is_finite().then(|| Proposal {
                ratios: kind.ratios(&point, scale),
                quadratic,
                weight: -value - density - (PROPOSALS as f64).ln(),
            })
        })
        .collect()
}

/// The factor of the inverse curvature of a function at its least point, widened a little; a
/// coordinate that lies at a bound is looked at from inside.
fn spread(mode: &[f64], value: impl Fn(&[f64]) -> f64) -> Option<DMatrix<f64>> {
    let d = mode.len();
    let least = value(mode);
    // Steps that raise the function by about one half: one standard deviation.
    let steps: Vec<f64> = (0..d)
        .map(|k| {
            let rise = |h: f64| {
                let side = |sign: f64| {
                    let mut moved = mode.to_vec();
                    moved[k] += sign * h;
                    value(&moved) - least
                };
                let (up, down) = (side(1.0), side(-1.0));
                if up.is_finite() && down.is_finite() {
                    0.5 * (up + down)
                } else {
                    up.min(down)
                }
            };
            let mut h = 0.05;
            for _ in 0..12 {
                let r = rise(h);
                if r > 1.5 {
                    h *= 0.5;
                } else if r < 0.15 && h < 2.0 {
                    h *= 2.0;
                } else {
                    break;
                }
            }
            h
        })
        .collect();
    let at = |moves: &[(usize, f64)]| {
        let mut moved = mode.to_vec();
        for (k, sign) in moves {
            moved[*k] += sign * steps[*k];
        }
        value(&moved)
    };
    // Coordinates scaled by their steps.
    let mut curvature = DMatrix::zeros(d, d);
    for i in 0..d {
        let (up, down) = (at(&[(i, 1.0)]), at(&[(i, -1.0)]));
        let second = up + down - 2.0 * least;
        curvature[(i, i)] = if second.is_finite() {
            second
        } else {
            2.0 * (up.min(down) - least)
        }
        .max(0.05);
        for j in 0..i {
            let cross =
                at(&[(i, 1.0), (j, 1.0)]) - at(&[(i, 1.0), (j, -1.0)]) - at(&[(i, -1.0), (j, 1.0)])
                    + at(&[(i, -1.0), (j, -1.0)]);
            if cross.is_finite() {
                curvature[(i, j)] = 0.25 * cross;
                curvature[(j, i)] = 0.25 * cross;
            }
        }
    }
    let covariance = loop {
        if let Some(factor) = curvature.clone().cholesky() {
            break factor.inverse();
        }
        // The mixed terms of a function that is no parabola may be too great for its diagonal.
        for i in 0..d {
            for j in 0..d {
                if i != j {
                    curvature[(i, j)] *= 0.5;
                }
            }
        }
        if !curvature.iter().all(|v| v.is_finite()) {
            return None;
        }
    };
    let scaled = DMatrix::from_fn(d, d, |i, j| 1.2 * covariance[(i, j)] * steps[i] * steps[j]);
    scaled.cholesky().map(|factor| factor.unpack())
}

/// Laws drawn by their weights, each with a white variance drawn from its posterior.
pub(crate) fn resampled(
    proposals: &[Proposal],
    count: f64,
    random: &mut ChaCha8Rng,
) -> Option<Allowed> {
    let top = proposals
        .iter()
        .map(|p| p.weight)
        .fold(f64::NEG_INFINITY, f64::max);
    let mut sum = 0.0;
    let cumulative: Vec<f64> = proposals
        .iter()
        .map(|p| {
            sum += (p.weight - top).exp();
            sum
        })
        .collect();
    let chi = ChiSquared::new(count).ok()?;
    if !sum.is_finite() || sum <= 0.0 {
        return None;
    }
    // Systematic resampling: the only chance is where it begins.
    let begin: f64 = random.random();
    let laws = (0..LAWS)
        .map(|k| {
            let at = (k as f64 + begin) / LAWS as f64 * sum;
            let chosen = cumulative
                .partition_point(|c| *c < at)
                .min(proposals.len() - 1);
            let Proposal {
                ratios, quadratic, ..
            } = &proposals[chosen];
            let white = quadratic / chi.sample(random);
            ratios.times(white)
        })
        .collect();
    Some(Allowed {
        laws,
        log_evidence: top + sum.ln(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::NoiseLaw;
    use errsep_models::model::Place;

    /// Contrasts of four repeats of eight traces with noise of a law.
    fn contrasts(law: &NoiseLaw, seed: u64) -> Contrasts {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let n = 120;
        let x: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
        let traces: Vec<_> = (0..32).map(|t| t * n..(t + 1) * n).collect();
        let places: Vec<Place> = (0..32 * n)
            .map(|k| Place {
                channel: k / n / 4,
                x: x[k % n],
                time: (k / n % 4) as f64,
                repeat: (k / n % 4) as u32,
                direction: 1.0,
                cell: k / n / 4 * n + k % n,
            })
            .collect();
        let mut readings = DVector::zeros(32 * n);
        for trace in &traces {
            let rows = &mut readings.as_mut_slice()[trace.clone()];
            law.parts.draw(&x, &mut random, rows);
        }
        Contrasts::new(&places, &traces, &readings)
    }

    /// The middle nine tenths of the drawn laws hold the true variance of a reading, of the mean of
    /// a trace and of the step between neighbours nine times in ten: of 40 each, 36 expected, with
    /// a standard deviation of 1.9; 29 is below four of them.
    #[test]
    fn the_drawn_laws_hold_the_true_one() {
        for law in [
            NoiseLaw::of(1.0, 0.0, 1.0, 0.0),
            NoiseLaw::of(1.0, 0.6, 10.0, 0.0),
            NoiseLaw::of(1.0, 0.0, 1.0, 0.1),
            NoiseLaw::of(1.0, 0.6, 10.0, 0.1),
        ] {
            type Measure = fn(&Law) -> f64;
            let measures: [Measure; 3] = [
                |l| l.white + l.correlated + l.shift,
                |l| l.shift + l.white / 120.0 + l.correlated * 2.0 * l.length / 240.0,
                |l| l.white + l.correlated * (1.0 - (-2.0 / l.length).exp()),
            ];
            let mut held = [0; 3];
            for seed in 0..40 {
                let laws = allowed(&contrasts(&law, seed), Drifts::Never, seed)
                    .unwrap()
                    .laws;
                assert_eq!(laws.len(), LAWS);
                for (count, measure) in held.iter_mut().zip(measures) {
                    let mut values: Vec<f64> = laws.iter().map(measure).collect();
                    values.sort_by(f64::total_cmp);
                    let truth = measure(&law.parts);
                    let inside = truth > values[LAWS / 20] && truth < values[LAWS - LAWS / 20];
                    *count += usize::from(inside);
                }
            }
            // A law without a component lies at the edge of what is possible, not in the middle:
            // the mean of a trace is then on the low side more often.
            let least = if law.parts.shift > 0.0 && law.parts.correlated > 0.0 {
                29
            } else {
                24
            };
            assert!(held.iter().all(|h| *h >= least), "{held:?} {law:?}");
        }
    }
}
