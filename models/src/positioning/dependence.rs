//! How one reading scatters: pooled over all targets and directions, whether it scatters alike
//! everywhere, and whether readings of a run are independent.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal};

use super::readings::Deviations;

/// Scatter of one reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Standard deviation of one reading, pooled over targets and directions.
    pub std: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of standard deviations as different as these where all are equal (Bartlett);
    /// none where a standard deviation is zero.
    pub equal: Option<f64>,
    /// Probability of neighbouring readings of the same runs as alike as these where all are
    /// independent; none where nothing scatters.
    pub independent: Option<f64>,
    /// Probability of runs at heights as different as these where all readings are independent; none where
    /// nothing scatters within the runs.
    pub level: Option<f64>,
}

/// Below this probability scatter is taken to differ, or readings to depend on each other.
pub(super) const LEVEL: f64 = 0.01;

impl Scatter {
    /// The scatter of a test with two runs or more.
    #[must_use]
    pub fn of(deviations: &Deviations) -> Option<Self> {
        if deviations.runs < 2 {
            return None;
        }
        let left = residuals(deviations);
        let freedom = (deviations.runs - 1) as f64;
        let variances: Vec<f64> = left
            .iter()
            .flatten()
            .map(|row| row.iter().map(|v| v * v).sum::<f64>() / freedom)
            .collect();
        let count = variances.len();
        let pooled = variances.iter().sum::<f64>() / count as f64;
        Some(Self {
            std: pooled.sqrt(),
            degrees_of_freedom: count * (deviations.runs - 1),
            equal: bartlett(&variances, pooled, freedom),
            independent: alike(&left, deviations.runs),
            level: level(&left, deviations.runs),
        })
    }

    /// Whether the standard deviations differ from target to target.
    #[must_use]
    pub fn differs(&self) -> bool {
        self.equal.is_some_and(|p| p < LEVEL)
    }

    /// Whether whole runs lie at heights of their own.
    #[must_use]
    pub fn runs_differ(&self) -> bool {
        self.level.is_some_and(|p| p < LEVEL)
    }

    /// Whether neighbouring readings of a run are alike.
    #[must_use]
    pub fn depends(&self) -> bool {
        self.independent.is_some_and(|p| p < LEVEL)
    }
}

/// Readings less the mean of their target and direction, by direction.
pub(super) fn residuals(deviations: &Deviations) -> Vec<Vec<Vec<f64>>> {
    deviations
        .directions()
        .map(|(_, rows)| {
            rows.iter()
                .map(|row| {
                    let mean = row.iter().sum::<f64>() / row.len() as f64;
                    row.iter().map(|v| v - mean).collect()
                })
                .collect()
        })
        .collect()
}

/// M. S. Bartlett's test of equal variances, all of the same degrees of freedom.
fn bartlett(variances: &[f64], pooled: f64, freedom: f64) -> Option<f64> {
    let count = variances.len() as f64;
    if count < 2.0 || variances.iter().any(|v| !(*v > 0.0)) {
        return None;
    }
    let logs: f64 = variances.iter().map(|v| (v / pooled).ln()).sum();
    let correction = 1.0 + (count + 1.0) / (3.0 * count * freedom);
    let law = ChiSquared::new(count - 1.0).ok()?;
    Some(law.sf((-freedom * logs / correction).max(0.0)))
}

/// F of the heights of the runs against what is left beside them.
fn level(left: &[Vec<Vec<f64>>], runs: usize) -> Option<f64> {
    let rows = || left.iter().flatten();
    let count = rows().count() as f64;
    let all: f64 = rows().flatten().map(|v| v * v).sum();
    let heights: f64 = (0..runs)
        .map(|run| {
            let sum: f64 = rows().filter_map(|row| row.get(run)).sum();
            sum * sum / count
        })
        .sum();
    let between = (runs - 1) as f64;
    let within = (count - 1.0) * between;
    let rest = all - heights;
    // Less than rounding leaves of the squares is no scatter.
    if !(within > 0.0) || !(rest > 1e-14 * all) {
        return None;
    }
    let law = FisherSnedecor::new(between, within).ok()?;
    Some(law.sf(heights / between / (rest / within)))
}

/// Correlations over the runs between a target and its neighbour, and between both directions of a
/// target. Of independent normal readings each has mean 0 and variance 1/(n − 1), and any two of
/// them are uncorrelated, so that their sum is normal for many targets.
fn alike(left: &[Vec<Vec<f64>>], runs: usize) -> Option<f64> {
    let mut sum = 0.0;
    let mut pairs = 0.0;
    let mut add = |a: &[f64], b: &[f64]| {
        let squares = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        let scale = (squares(a) * squares(b)).sqrt();
        if scale > 0.0 {
            sum += a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>() / scale;
            pairs += 1.0;
        }
    };
    for rows in left {
        for pair in rows.windows(2) {
            if let [a, b] = pair {
                add(a, b);
            }
        }
    }
    if let [forward, backward] = left {
        for (a, b) in forward.iter().zip(backward) {
            add(a, b);
        }
    }
    if pairs == 0.0 {
        return None;
    }
    let z = sum / (pairs / (runs - 1) as f64).sqrt();
    Normal::new(0.0, 1.0).ok().map(|law| law.sf(z))
}
