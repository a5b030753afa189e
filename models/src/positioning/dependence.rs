//! How one reading scatters: pooled over all targets and directions, whether it scatters alike
//! everywhere, and whether readings of a run are independent.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal};

use super::drift::Drift;
use super::readings::{Deviations, Targets, mean};
use super::uncertainty::NoUncertainty;
use crate::missing::{apart, heights};

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
        let variances: Vec<(f64, f64)> = left
            .iter()
            .flatten()
            .map(|row| {
                let freedom = (row.iter().flatten().count() - 1) as f64;
                let squares: f64 = row.iter().flatten().map(|v| v * v).sum();
                (squares / freedom, freedom)
            })
            .collect();
        let freedom: f64 = variances.iter().map(|(_, freedom)| freedom).sum();
        let squares = variances.iter().map(|(v, freedom)| v * freedom);
        let pooled = squares.sum::<f64>() / freedom;
        Some(Self {
            std: pooled.sqrt(),
            degrees_of_freedom: freedom as usize,
            equal: bartlett(&variances, pooled, freedom),
            independent: alike(&left),
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

/// Whether readings scatter alike and independently of each other.
pub(super) struct Dependence {
    /// Standard deviation of one reading; none with one run.
    pub(super) std: Option<f64>,
    /// Why figures that rest on scatter have no uncertainty.
    pub(super) why: Option<NoUncertainty>,
    /// Why what a drift shifts has none.
    pub(super) shifted: Option<NoUncertainty>,
}

impl Dependence {
    pub(super) fn of(scatter: Option<&Scatter>, drift: Option<&Drift>) -> Self {
        let shows = drift.is_some_and(Drift::shows);
        let may = drift.is_some_and(|d| d.may);
        let why = scatter.and_then(|scatter| {
            let why = [
                (shows, NoUncertainty::Drifts),
                (scatter.runs_differ() || may, NoUncertainty::RunsDiffer),
                (scatter.depends(), NoUncertainty::ReadingsAlike),
                (scatter.differs(), NoUncertainty::ScatterDiffers),
            ];
            why.into_iter().find(|(is, _)| *is).map(|(_, why)| why)
        });
        let shifted = match why {
            Some(NoUncertainty::Drifts) => why,
            Some(_) if may => Some(NoUncertainty::MayDrift),
            _ => None,
        };
        Self {
            std: scatter.map(|s| s.std),
            why,
            shifted,
        }
    }

    /// Whether runs have something in common, so that they are what is independent and not the readings.
    pub(super) fn by_run(&self) -> bool {
        let alone = [None, Some(NoUncertainty::ScatterDiffers)];
        !alone.contains(&self.why)
    }
}

/// Readings less the mean of their target and direction, by direction.
pub(super) fn residuals(deviations: &Deviations) -> Vec<Targets> {
    let row = |row: &Vec<Option<f64>>| {
        let mean = mean(row);
        row.iter().map(|v| Some((*v)? - mean)).collect()
    };
    deviations
        .directions()
        .map(|(_, rows)| rows.iter().map(row).collect())
        .collect()
}

/// M. S. Bartlett's test of equal variances, each with its degrees of freedom; `freedom` is their sum.
fn bartlett(variances: &[(f64, f64)], pooled: f64, freedom: f64) -> Option<f64> {
    let count = variances.len() as f64;
    if count < 2.0 || variances.iter().any(|(v, _)| !(*v > 0.0)) {
        return None;
    }
    let logs: f64 = variances.iter().map(|(v, f)| f * (v / pooled).ln()).sum();
    let inverse: f64 = variances.iter().map(|(_, f)| 1.0 / f).sum();
    let correction = 1.0 + (inverse - 1.0 / freedom) / (3.0 * (count - 1.0));
    let law = ChiSquared::new(count - 1.0).ok()?;
    Some(law.sf((-logs / correction).max(0.0)))
}

/// F of the heights of the runs against what is left beside them.
fn level(left: &[Targets], runs: usize) -> Option<f64> {
    let rows = || left.iter().flatten().map(Vec::as_slice);
    let there = rows().flatten().flatten();
    let (count, all) = there.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v * v));
    // What least squares take from the squares: the solution times the right side of its equations.
    let right = apart(rows(), runs, |_, value| value);
    let own = heights(rows(), runs);
    let taken: f64 = own.iter().zip(&right).map(|(z, b)| z * b).sum();
    let between = (runs - 1) as f64;
    let within = count - rows().count() as f64 - between;
    let rest = all - taken;
    // Less than rounding leaves of the squares is no scatter.
    if !(within > 0.0) || !(rest > 1e-14 * all) {
        return None;
    }
    let law = FisherSnedecor::new(between, within).ok()?;
    Some(law.sf(taken / between / (rest / within)))
}

/// Correlations over the runs between a target and its neighbour, and between both directions of a
/// target, each over the n runs that both have. Of independent normal readings each has mean 0 and variance
/// 1/(n − 1), and any two of them are uncorrelated, so that their sum is normal for many targets.
fn alike(left: &[Targets]) -> Option<f64> {
    let mut sum = 0.0;
    let mut variance = 0.0;
    let mut add = |a: &[Option<f64>], b: &[Option<f64>]| {
        let both = || a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?)));
        let count = both().count() as f64;
        let (mean_a, mean_b) =
            both().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / count, y + b / count));
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b) in both().map(|(a, b)| (a - mean_a, b - mean_b)) {
            aa += a * a;
            bb += b * b;
            ab += a * b;
        }
        let scale = (aa * bb).sqrt();
        if count > 1.0 && scale > 0.0 {
            sum += ab / scale;
            variance += 1.0 / (count - 1.0);
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
    if variance == 0.0 {
        return None;
    }
    let law = Normal::new(0.0, 1.0).ok()?;
    Some(law.sf(sum / variance.sqrt()))
}
