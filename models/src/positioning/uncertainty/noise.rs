//! How readings scatter, as far as simulated tests go.

use super::super::readings::Targets;

/// How the means of a simulated test scatter.
pub(super) enum Noise {
    /// Every reading by itself, alike everywhere.
    Independent { std: f64, runs: usize },
    /// Whole runs, as those that were measured: whatever they have in common stays so. By
    /// direction, target and run.
    ByRun {
        residuals: Vec<Targets>,
        runs: usize,
    },
}

impl Noise {
    /// The standard deviation of a reading, where it is one.
    pub(super) const fn std(&self) -> Option<f64> {
        match self {
            Self::Independent { std, .. } => Some(*std),
            Self::ByRun { .. } => None,
        }
    }

    /// Variance of the standard deviation of one target and direction, σ²/(2(n − 1)).
    pub(super) fn variance_of_std(&self) -> f64 {
        match self {
            Self::Independent { std, runs } => std * std / (2 * (runs - 1)) as f64,
            Self::ByRun { .. } => 0.0,
        }
    }

    /// Variance of a mean over the runs of a combination of both directions (of the one direction
    /// there is), `factor` times that of one mean where readings are independent.
    pub(super) fn variance(&self, combine: impl Fn(f64, f64) -> f64, factor: f64) -> f64 {
        match self {
            Self::Independent { std, runs } => factor * std * std / *runs as f64,
            Self::ByRun { residuals, runs } => {
                let Some(first) = residuals.first() else {
                    return 0.0;
                };
                let second = residuals.get(1).unwrap_or(first);
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
