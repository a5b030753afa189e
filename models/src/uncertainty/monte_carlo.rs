//! Propagation of distributions by a Monte Carlo method (JCGM 101:2008).

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{DegreesOfFreedom, Quantity, UncertaintyError};

/// Trials that share one stream of random numbers. The streams belong to the blocks and not to
/// the threads, so a seed gives the same trials on any number of threads.
const BLOCK: usize = 512;

/// Runs `count` trials of a model with `outputs` results each.
///
/// `workspace` makes what a trial needs to write into, once a block; `trial` draws its inputs from
/// the generator and fills the slice of results. The same seed gives the same trials whatever
/// the number of threads.
///
/// # Errors
/// Fewer than two trials; a trial with a result that is not finite.
pub fn simulate<W>(
    count: usize,
    outputs: usize,
    seed: u64,
    workspace: impl Fn() -> W + Sync,
    trial: impl Fn(&mut ChaCha8Rng, &mut W, &mut [f64]) + Sync,
) -> Result<Trials, UncertaintyError> {
    if count < 2 || outputs == 0 {
        return Err(UncertaintyError::TooFewObservations {
            needed: 2,
            found: count.min(outputs),
        });
    }
    let mut values = vec![0.0; count * outputs];
    values
        .par_chunks_mut(BLOCK * outputs)
        .enumerate()
        .for_each(|(block, rows)| {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            generator.set_stream(block as u64);
            let mut room = workspace();
            for row in rows.chunks_exact_mut(outputs) {
                trial(&mut generator, &mut room, row);
            }
        });
    match values.iter().position(|v| !v.is_finite()) {
        Some(at) => Err(UncertaintyError::BadTrial {
            trial: at / outputs,
            found: values[at],
        }),
        None => Ok(Trials { outputs, values }),
    }
}

/// The results of a simulation, one row a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    outputs: usize,
    values: Vec<f64>,
}

impl Trials {
    /// The results of every trial in turn.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.outputs)
    }

    /// The sample of one output, `None` when there is no such output.
    #[must_use]
    pub fn output(&self, index: usize) -> Option<Sample> {
        (index < self.outputs)
            .then(|| Sample::new(self.rows().map(|row| row[index]).collect()))
            .flatten()
    }
}

/// A coverage interval of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CoverageInterval {
    /// Share of the trials inside.
    pub coverage_probability: f64,
    /// Lower end.
    pub lower: f64,
    /// Upper end.
    pub upper: f64,
}

/// The trials of one result in ascending order, its discrete distribution (JCGM 101, 7.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    sorted: Vec<f64>,
}

impl Sample {
    /// Sorts the trials; `None` for fewer than two or for a value that is not a number.
    #[must_use]
    pub fn new(mut trials: Vec<f64>) -> Option<Self> {
        if trials.len() < 2 || trials.iter().any(|t| t.is_nan()) {
            return None;
        }
        trials.par_sort_unstable_by(f64::total_cmp);
        Some(Self { sorted: trials })
    }

    /// The trials in ascending order.
    #[must_use]
    pub fn sorted(&self) -> &[f64] {
        &self.sorted
    }

    /// Mean of the trials (JCGM 101, equation 16).
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sorted.iter().sum::<f64>() / self.sorted.len() as f64
    }

    /// Standard deviation of the trials (JCGM 101, equation 17).
    #[must_use]
    pub fn standard_deviation(&self) -> f64 {
        let mean = self.mean();
        let squares: f64 = self.sorted.iter().map(|t| (t - mean).powi(2)).sum();
        (squares / (self.sorted.len() as f64 - 1.0)).sqrt()
    }

    /// Mean and standard deviation as a quantity; its degrees of freedom are those of the inputs
    /// and so taken as infinite here.
    ///
    /// # Errors
    /// Trials that are not finite.
    pub fn quantity(
        &self,
        label: impl Into<String>,
        unit: impl Into<String>,
    ) -> Result<Quantity, UncertaintyError> {
        Ok(
            Quantity::new(label, self.mean(), self.standard_deviation(), unit)?
                .with_degrees_of_freedom(DegreesOfFreedom::Infinite),
        )
    }

    /// The probabilistically symmetric interval: equal shares beyond either end (JCGM 101, 7.7.2).
    ///
    /// # Errors
    /// A probability outside 0..1.
    pub fn symmetric_interval(
        &self,
        probability: f64,
    ) -> Result<CoverageInterval, UncertaintyError> {
        let inside = self.inside(probability)?;
        Ok(self.interval(probability, (self.sorted.len() - inside) / 2, inside))
    }

    /// The shortest interval with this coverage (JCGM 101, 7.7.2 and 5.3.4): the one to quote for a
    /// lopsided distribution such as that of a circularity.
    ///
    /// # Errors
    /// A probability outside 0..1.
    pub fn shortest_interval(
        &self,
        probability: f64,
    ) -> Result<CoverageInterval, UncertaintyError> {
        let inside = self.inside(probability)?;
        let first = (0..self.sorted.len() - inside)
            .min_by(|&a, &b| {
                let width = |r: usize| self.sorted[r + inside] - self.sorted[r];
                width(a).total_cmp(&width(b))
            })
            .unwrap_or(0);
        Ok(self.interval(probability, first, inside))
    }

    /// The number `q` of steps between the ends of an interval, at most one less than the trials.
    fn inside(&self, probability: f64) -> Result<usize, UncertaintyError> {
        if !(probability > 0.0 && probability < 1.0) {
            return Err(UncertaintyError::BadProbability { found: probability });
        }
        let count = self.sorted.len();
        Ok(((probability * count as f64 + 0.5) as usize).clamp(1, count - 1))
    }

    fn interval(&self, probability: f64, first: usize, inside: usize) -> CoverageInterval {
        let last = (first + inside).min(self.sorted.len() - 1);
        CoverageInterval {
            coverage_probability: probability,
            lower: self.sorted[first.min(last)],
            upper: self.sorted[last],
        }
    }
}
