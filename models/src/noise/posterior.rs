//! Which laws of noise the readings allow, each with its probability.
//!
//! Eight kinds of law are weighed: white alone or with a correlated part, each without more, with shifts, with drifts of whole
//! traces, with both; all alike beforehand (where shifts are not seen there are two kinds). Beforehand, too, the
//! correlated part's share of the standard deviation beside the white one is uniform, and so are the logarithms of its length, of the
//! scale, and of 1 + r, r the standard deviation of the shift or of the drift (at the ends of the travel) in that of the rest: a few
//! traces that shift by much more than their readings scatter then tell their shifts with as many degrees of freedom as
//! there are traces. The scale is integrated in closed form; the others on a grid that closes in on where the probability lies.

use super::grid::{NEGLIGIBLE, explore};
use super::law::Law;
use super::likelihood::{Likelihood, OfWhole};
use super::moments::Moments;
use super::within_cells::WithinCells;
use statrs::function::gamma::ln_gamma;

/// Fewest values in contrasts from which a law can be told.
const FEWEST: usize = 8;
/// Variance of the correlated part of noise in that of the white part of a reading, at most; what is more is no noise.
const MOST_CORRELATED: f64 = 9.0;
/// Probability from which on noise is taken as correlated. Of 200 closures of 61 positions with white noise 22 reach 0.5, 8
/// this and 2 reach 0.8, of as many with half of the variance correlated over a twentieth of the travel 169, 148 and 113; with both directions
/// 12, 5, 0 and 200, 199, 199.
const PROBABLE: f64 = 0.65;

/// A law, its scale left open, that the contrasts allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Possible {
    /// The law at a scale of one.
    pub law: Law,
    /// Its probability.
    pub probability: f64,
    /// Quadratic form of the contrasts under it: the scale is this over χ² of as many degrees of
    /// freedom as there are values in the values.
    pub quadratic: f64,
}

/// The laws that contrasts allow.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    possible: Vec<Possible>,
    count: f64,
    log_evidence: f64,
}

/// Values that hold noise and nothing else, and how likely a law makes them.
pub trait NoiseValues {
    /// Number of values.
    fn count(&self) -> usize;

    /// Least and greatest correlation length that they can show, in the unit of the positions; `None` where
    /// they show no more than white noise.
    fn reach(&self) -> Option<(f64, f64)>;

    /// Whether a shift and a drift of a whole trace are seen in them.
    fn has_shifts(&self) -> bool;

    /// The likelihood of a law of a white and a correlated part with each of some shifts and drifts of whole traces.
    fn likelihoods(
        &self,
        white: f64,
        correlated: f64,
        length: f64,
        whole: &[OfWhole],
    ) -> Vec<Likelihood>;
}

impl Posterior {
    /// What values tell; `None` where they are too few, or all zero.
    pub fn of(values: &impl NoiseValues) -> Option<Self> {
        if values.count() < FEWEST {
            return None;
        }
        let plain = values.likelihoods(1.0, 0.0, 1.0, &[OfWhole::default()])[0];
        if !(plain.quadratic > f64::MIN_POSITIVE && plain.quadratic.is_finite()) {
            return None;
        }
        let mut possible = Vec::new();
        let lengths = values
            .reach()
            .map(|(spacing, travel)| (spacing.ln(), travel.max(2.0 * spacing).ln()));
        let kinds = [(false, false), (true, false), (false, true), (true, true)];
        // A drift is told from what is correlated where traces are long enough to show that.
        let kinds = match (values.has_shifts(), lengths) {
            (false, _) => &kinds[..1],
            (true, None) => &kinds[..2],
            (true, Some(_)) => &kinds[..],
        };
        for of_whole in kinds {
            explore(values, None, *of_whole, plain.minus_log, &mut possible);
            if lengths.is_some() {
                explore(values, lengths, *of_whole, plain.minus_log, &mut possible);
            }
        }
        let top = possible
            .iter()
            .map(|p| p.probability)
            .fold(f64::NEG_INFINITY, f64::max);
        for p in &mut possible {
            p.probability = (p.probability - top).exp();
        }
        possible.retain(|p| p.probability > 0.1 * NEGLIGIBLE);
        let sum: f64 = possible.iter().map(|p| p.probability).sum();
        for p in &mut possible {
            p.probability /= sum;
        }
        // The scale s with 1/s beforehand: ∫ s^(−n/2 − 1) e^(−q/2s) ds = Γ(n/2) (q/2)^(−n/2).
        let half = 0.5 * values.count() as f64;
        let of_scale = ln_gamma(half) - half * half.ln();
        let all = (2 * kinds.len()) as f64;
        let kinds = if lengths.is_some() { all } else { 0.5 * all };
        let log_evidence = of_scale + top + (sum / kinds).ln() - plain.minus_log;
        (sum > 0.0 && sum.is_finite()).then_some(Self {
            possible,
            count: values.count() as f64,
            log_evidence,
        })
    }

    /// White noise of a variance that is known as from so many values.
    pub fn of_white(variance: f64, count: usize) -> Self {
        Self {
            possible: vec![Possible {
                law: Law::of_white(1.0),
                probability: 1.0,
                quadratic: variance * (count.max(FEWEST) as f64 - 2.0),
            }],
            count: count.max(FEWEST) as f64,
            log_evidence: 0.0,
        }
    }

    /// Logarithm of the probability of the values, whatever the law, up to a constant that is the same for any values.
    pub fn log_evidence(&self) -> f64 {
        self.log_evidence
    }

    /// How many values tell it.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// The laws, their probabilities adding up to one.
    pub fn possible(&self) -> &[Possible] {
        &self.possible
    }

    /// Probability of laws in which a part is correlated along traces.
    pub fn correlated(&self) -> f64 {
        let own = self.possible.iter().filter(|p| p.law.correlated > 0.0);
        own.map(|p| p.probability).sum()
    }

    /// Whether a part of the noise is probably correlated from value to value.
    pub fn is_correlated(&self) -> bool {
        self.correlated() > PROBABLE
    }

    /// Whether readings are probably correlated along a trace, from value to value or within the cells of which these are means, and
    /// what goes on from value to value is no greater than noise may be.
    pub fn may_be_noise(&self, within: &WithinCells) -> bool {
        let law = self.mean();
        if self.is_correlated() {
            law.correlated <= MOST_CORRELATED * within.variance_of_a_reading(&law)
        } else {
            within.are_correlated(self)
        }
    }

    /// The mean of the laws.
    pub fn mean(&self) -> Law {
        let mean = |of: fn(&Law) -> f64| {
            let terms = self
                .possible
                .iter()
                .map(|p| p.probability * p.quadratic / (self.count - 2.0) * of(&p.law));
            terms.sum::<f64>()
        };
        let correlated = mean(|l| l.correlated);
        let length = if correlated > 0.0 {
            (mean(|l| l.correlated * l.length.ln()) / correlated).exp()
        } else {
            1.0
        };
        Law {
            white: mean(|l| l.white),
            correlated,
            length,
            shift: mean(|l| l.shift),
            drift: mean(|l| l.drift),
        }
    }

    /// What is known of a variance; `of` is it under each of [`Self::possible`], scale one.
    pub fn moments(&self, of: &[f64]) -> Moments {
        let n = self.count;
        let (mut mean, mut square) = (0.0, 0.0);
        for (p, v) in self.possible.iter().zip(of) {
            let scaled = p.quadratic * v;
            mean += p.probability * scaled / (n - 2.0);
            square += p.probability * scaled * scaled / ((n - 2.0) * (n - 4.0));
        }
        Moments {
            mean,
            variance: square - mean * mean,
            most_freedom: n,
        }
    }

    /// Scale and degrees of freedom of a variance; see [`Moments::student`].
    pub fn variance(&self, of: &[f64]) -> (f64, f64) {
        self.moments(of).student()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Contrasts;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use statrs::distribution::{ContinuousCDF, StudentsT};

    /// Three contrasts of each of eight traces.
    fn contrasts(law: &Law, n: usize, seed: u64) -> (Vec<f64>, Contrasts) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let x: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
        let mut contrasts = Contrasts::default();
        for _ in 0..8 {
            let repeats: Vec<Vec<f64>> = (0..4)
                .map(|_| {
                    let mut noise = vec![0.0; n];
                    law.draw(&x, &mut random, &mut noise);
                    noise
                })
                .collect();
            contrasts.add(&x, &repeats, 1.0);
        }
        (x, contrasts)
    }

    /// A further trace's mean and slope lie within their 95 % intervals as often as they should.
    #[test]
    fn intervals_of_a_further_trace_hold() {
        for law in [
            Law::of_white(1.0),
            Law {
                white: 1.0,
                correlated: 1.0,
                length: 15.0,
                shift: 0.0,
                drift: 0.0,
            },
            Law {
                white: 1.0,
                correlated: 0.0,
                length: 1.0,
                shift: 0.3,
                drift: 0.0,
            },
            Law {
                white: 1.0,
                correlated: 0.0,
                length: 1.0,
                shift: 9.0,
                drift: 2e-3,
            },
        ] {
            let (mut inside, seeds) = ([0; 2], 150);
            for seed in 0..seeds {
                let (x, contrasts) = contrasts(&law, 60, seed);
                let posterior = Posterior::of(&contrasts).unwrap();
                let mut noise = vec![0.0; x.len()];
                law.draw(
                    &x,
                    &mut ChaCha8Rng::seed_from_u64(10_000 + seed),
                    &mut noise,
                );
                let n = x.len() as f64;
                let middle = x.iter().sum::<f64>() / n;
                let spread: f64 = x.iter().map(|x| (x - middle).powi(2)).sum();
                let weights = [
                    vec![1.0 / n; x.len()],
                    x.iter().map(|x| (x - middle) / spread).collect::<Vec<_>>(),
                ];
                for (inside, w) in inside.iter_mut().zip(&weights) {
                    let of: Vec<f64> = posterior
                        .possible()
                        .iter()
                        .map(|p| {
                            let places = crate::noise::about_middle(&x);
                            p.law.form(&crate::noise::decays(&x, p.law.length), w, w)
                                + p.law.drift * crate::noise::drift_form(&places, w, w)
                        })
                        .collect();
                    let (variance, freedom) = posterior.variance(&of);
                    let error: f64 = noise.iter().zip(w).map(|(e, w)| e * w).sum();
                    let t = StudentsT::new(0.0, 1.0, freedom)
                        .unwrap()
                        .inverse_cdf(0.975);
                    *inside += u32::from(error.abs() < t * variance.sqrt());
                }
            }
            // k·u: a share of 0.95 of 150 is known to 0.018; four of them.
            for inside in inside {
                let share = f64::from(inside) / seeds as f64;
                assert!(share > 0.95 - 4.0 * 0.018, "{law:?} {share}");
            }
        }
    }

    #[test]
    fn many_repeats_give_the_law() {
        let law = Law {
            white: 1.0,
            correlated: 0.6,
            length: 10.0,
            shift: 0.2,
            drift: 0.0,
        };
        let (_, contrasts) = contrasts(&law, 400, 5);
        let mean = Posterior::of(&contrasts).unwrap().mean();
        // k·u: 24 contrasts of 400 values know the white part to 3 %, the correlated one to some 10 %
        // and the shift, of 24, to 30 %; three of each.
        assert!((mean.white - 1.0).abs() < 0.1, "{mean:?}");
        assert!((mean.correlated - 0.6).abs() < 0.2, "{mean:?}");
        assert!((mean.length / 10.0).ln().abs() < 0.5, "{mean:?}");
        assert!((mean.shift - 0.2).abs() < 0.2, "{mean:?}");
    }

    /// Indicators zeroed anew by three hundred times their noise.
    #[test]
    fn shifts_are_as_great_as_they_are() {
        let law = Law {
            white: 1.0,
            correlated: 0.0,
            length: 1.0,
            shift: 1e5,
            drift: 0.0,
        };
        let (_, contrasts) = contrasts(&law, 60, 5);
        let mean = Posterior::of(&contrasts).unwrap().mean();
        // k·u: of 24 contrasts the variance of the shift is known to 30 %; three of it.
        assert!((mean.shift / law.shift - 1.0).abs() < 0.9, "{mean:?}");
        assert!((mean.white - 1.0).abs() < 0.2, "{mean:?}");
    }

    #[test]
    fn too_few_or_no_noise_give_no_law() {
        assert!(Posterior::of(&Contrasts::default()).is_none());
        let mut still = Contrasts::default();
        still.add(&[0.0; 10], &[vec![1.0; 10], vec![1.0; 10]], 1.0);
        assert!(Posterior::of(&still).is_none());
    }
}
