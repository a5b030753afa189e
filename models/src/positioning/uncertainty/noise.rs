//! How readings scatter, as far as simulated tests go.

use rand_distr::ChiSquared;

use super::super::readings::Deviations;
use super::Means;

/// Readings of one target and direction.
pub(super) struct Readings {
    /// How many.
    pub(super) count: f64,
    /// The law of their variance, times their degrees of freedom; none where it cannot be drawn.
    pub(super) law: Option<ChiSquared<f64>>,
}

impl Readings {
    /// Degrees of freedom of their standard deviation.
    pub(super) fn freedom(&self) -> f64 {
        self.count - 1.0
    }
}

/// How the means of a simulated test scatter.
pub(super) enum Noise {
    /// Every reading by itself, alike everywhere. By direction and target.
    Independent {
        std: f64,
        readings: [Vec<Readings>; 2],
    },
    /// Whole runs, as those that were measured: whatever they have in common stays so. By
    /// direction, target and run.
    ByRun {
        residuals: [Vec<Vec<f64>>; 2],
        runs: usize,
    },
}

impl Noise {
    pub(super) fn independent(std: f64, deviations: &Deviations) -> Self {
        let readings = deviations.by_direction.each_ref().map(|rows| {
            let rows = rows.iter().flatten();
            rows.map(|row| {
                let count = row.iter().flatten().count() as f64;
                let law = ChiSquared::new(count - 1.0).ok();
                Readings { count, law }
            })
            .collect()
        });
        Self::Independent { std, readings }
    }

    /// What each of n runs adds to the means, whose error is then (n(n − 1))^−½ Σ_j w_j r_ij with normal weights w_j.
    /// Of a mean of n_i < n readings less the heights z_j of their runs it is
    ///
    /// r_ij = z_j + √(n(n − 1)/(n_i(n_i − 1))) e_ij,   e_ij = x_ij − x̄_i − z_j, 0 where the reading is missing:
    ///
    /// the heights add what they add to every target, and e the variance Σ e²/(n_i(n_i − 1)) of a mean of n_i readings.
    pub(super) fn by_run(deviations: &Deviations, means: &Means) -> Self {
        let runs = deviations.runs;
        let pairs = |n: usize| (n * (n - 1)) as f64;
        let height = |run: usize| means.heights.get(run).copied().unwrap_or_default();
        let row = |row: &Vec<Option<f64>>, mean: f64| {
            let more = (pairs(runs) / pairs(row.iter().flatten().count())).sqrt();
            let own = |(run, x): (usize, &Option<f64>)| {
                let z = height(run);
                z + x.map_or(0.0, |x| more * (x - mean - z))
            };
            row.iter().enumerate().map(own).collect()
        };
        let residuals = [0, 1].map(|d| {
            let rows = deviations.by_direction[d].iter().flatten();
            let means = means.profile.mean[d].iter().flatten();
            rows.zip(means).map(|(r, mean)| row(r, *mean)).collect()
        });
        Self::ByRun { residuals, runs }
    }

    /// The standard deviation of a reading, where it is one.
    pub(super) const fn std(&self) -> Option<f64> {
        match self {
            Self::Independent { std, .. } => Some(*std),
            Self::ByRun { .. } => None,
        }
    }

    /// Variance of the standard deviation of one target and direction, σ²/(2(n − 1)), on average.
    pub(super) fn variance_of_std(&self) -> f64 {
        match self {
            Self::Independent { std, readings } => {
                std * std * average(readings, |r| 0.5 / r.freedom())
            }
            Self::ByRun { .. } => 0.0,
        }
    }

    /// Variance of a mean over the runs of a combination of both directions (of the one direction
    /// there is), `factor` times that of one mean where readings are independent; on average over the targets.
    pub(super) fn variance(&self, combine: impl Fn(f64, f64) -> f64, factor: f64) -> f64 {
        match self {
            Self::Independent { std, readings } => {
                factor * std * std * average(readings, |r| 1.0 / r.count)
            }
            Self::ByRun { residuals, runs } => {
                let Some(first) = residuals.iter().find(|rows| !rows.is_empty()) else {
                    return 0.0;
                };
                let second = Some(&residuals[1]).filter(|rows| !rows.is_empty());
                let second = second.unwrap_or(first);
                let targets = first.len();
                let mut sum = 0.0;
                for run in 0..*runs {
                    let of = |rows: &[Vec<f64>], i: usize| {
                        rows.get(i).and_then(|r| r.get(run)).copied().unwrap_or(0.0)
                    };
                    let values: Vec<f64> = (0..targets)
                        .map(|i| combine(of(first, i), of(second, i)))
                        .collect();
                    // What a run shifts at all targets alike is no spread over the targets.
                    let mean = values.iter().sum::<f64>() / targets as f64;
                    sum += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                }
                let freedom = (targets - 1) * (runs - 1) * runs;
                sum / freedom.max(1) as f64
            }
        }
    }
}

fn average(readings: &[Vec<Readings>; 2], of: impl Fn(&Readings) -> f64) -> f64 {
    let all = readings.iter().flatten();
    all.clone().map(of).sum::<f64>() / all.count().max(1) as f64
}
