//! The unbalanced one-way analysis.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::components::{Components, components};
use super::{AnovaError, Groups};
use crate::uncertainty::{Budget, Correlation, DegreesOfFreedom, Quantity};

/// A line of the table of analysis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MeanSquare {
    /// Sum of squares, unit of the readings squared.
    pub sum_of_squares: f64,
    /// Degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Their quotient; `None` without degrees of freedom.
    pub mean_square: Option<f64>,
}

impl MeanSquare {
    fn new(sum_of_squares: f64, degrees_of_freedom: usize) -> Self {
        let mean_square =
            (degrees_of_freedom > 0).then(|| sum_of_squares / degrees_of_freedom as f64);
        Self {
            sum_of_squares,
            degrees_of_freedom,
            mean_square,
        }
    }
}

/// What replicates tell of a feature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OneWay {
    /// Number of groups, `k`.
    pub groups: usize,
    /// Number of readings, `N`.
    pub readings: usize,
    /// Readings a group counts for, `n0`; `None` for one group.
    pub effective_replicates: Option<f64>,
    /// Scatter of the group means about the mean of all readings.
    pub between: MeanSquare,
    /// Scatter of the readings about the means of their groups.
    pub within: MeanSquare,
    /// `F`, the quotient of the mean squares; `None` when one of them is missing or the readings
    /// of every group are all equal.
    pub f: Option<f64>,
    /// Probability of an `F` at least so large if the groups did not differ.
    pub p_value: Option<f64>,
    /// The components of variance.
    pub components: Components,
    /// Mean of all readings, with the uncertainty that the scatter of the groups gives it.
    pub mean: Quantity,
    /// The next reading of a group not yet seen, with the influences on it; `None` when the
    /// components could not be separated and there is more than one group.
    pub future_reading: Option<Budget>,
}

/// Analyses the groups; intervals are given for the coverage `confidence`, such as 0.95.
///
/// One group is the plain mean: no line between, and `s/√n` with `n - 1` degrees of freedom.
///
/// # Errors
/// A confidence outside 0..1.
pub fn analyse(groups: &Groups, unit: &str, confidence: f64) -> Result<OneWay, AnovaError> {
    let grand = groups.weighted_mean();
    let list = groups.groups();
    let k = list.len();
    let n = groups.readings();
    let between = list
        .iter()
        .map(|g| g.readings.len() as f64 * (g.mean() - grand).powi(2))
        .sum();
    let within = list.iter().map(|g| g.sum_of_squares().max(0.0)).sum();
    let between = MeanSquare::new(if k > 1 { between } else { 0.0 }, k - 1);
    let within = MeanSquare::new(within, n - k);
    let f = match (between.mean_square, within.mean_square) {
        (Some(b), Some(w)) if w > 0.0 => Some(b / w),
        _ => None,
    };
    let p_value = f.and_then(|f| {
        let b = between.degrees_of_freedom as f64;
        FisherSnedecor::new(b, within.degrees_of_freedom as f64)
            .ok()
            .map(|d| d.sf(f))
    });
    let components = components(groups, &between, &within, confidence)?;
    let mean = mean(groups, grand, &between, &within, &components, unit)?;
    let future_reading = future_reading(&mean, &components, unit)?;
    Ok(OneWay {
        groups: k,
        readings: n,
        effective_replicates: groups.effective_replicates(),
        between,
        within,
        f,
        p_value,
        components,
        mean,
        future_reading,
    })
}

/// The mean of all readings has the variance `σ_b² Σ n_i²/N² + σ_w²/N`, written here through the
/// mean squares: with `q = Σ n_i² / (N n0)` it is `[q MS_b + (1 - q) MS_w] / N`, which for equal
/// counts is `MS_b / N`. The degrees of freedom are Satterthwaite's for that sum.
fn mean(
    groups: &Groups,
    grand: f64,
    between: &MeanSquare,
    within: &MeanSquare,
    components: &Components,
    unit: &str,
) -> Result<Quantity, AnovaError> {
    let n = groups.readings() as f64;
    let (variance, degrees) = match (between.mean_square, within.mean_square) {
        (Some(b), Some(w)) if components.between_visible() => {
            let q =
                groups.sum_of_squared_counts() / (n * groups.effective_replicates().unwrap_or(1.0));
            let variance = q * b + (1.0 - q) * w;
            let spread = (q * b / variance).powi(2) / between.degrees_of_freedom as f64
                + ((1.0 - q) * w / variance).powi(2) / within.degrees_of_freedom as f64;
            (variance / n, 1.0 / spread)
        }
        (Some(b), None) => (b / n, between.degrees_of_freedom as f64),
        // No scatter between groups shows: all readings are one sample.
        _ => {
            let degrees = between.degrees_of_freedom + within.degrees_of_freedom;
            let squares = between.sum_of_squares + within.sum_of_squares;
            (squares / degrees as f64 / n, degrees as f64)
        }
    };
    let degrees = if variance > 0.0 {
        DegreesOfFreedom::new(degrees)?
    } else {
        DegreesOfFreedom::new(n - 1.0)?
    };
    Ok(
        Quantity::new("mean", grand, variance.max(0.0).sqrt(), unit)?
            .with_degrees_of_freedom(degrees),
    )
}

/// A reading of a new group: mean, the group's own deviation, the reading's own deviation.
fn future_reading(
    mean: &Quantity,
    components: &Components,
    unit: &str,
) -> Result<Option<Budget>, AnovaError> {
    let Some(within) = &components.within else {
        return Ok(None);
    };
    let mut inputs = vec![(mean.clone(), 1.0)];
    if let Some(between) = &components.between {
        inputs.push((
            deviation("between groups", between.variance, between.degrees, unit)?,
            1.0,
        ));
    }
    inputs.push((
        deviation("within a group", within.variance, within.degrees, unit)?,
        1.0,
    ));
    let independent = Correlation::none(inputs.len());
    Ok(Some(Budget::combine(
        "future reading",
        mean.value,
        unit,
        inputs,
        &independent,
    )?))
}

fn deviation(
    label: &str,
    variance: f64,
    degrees: DegreesOfFreedom,
    unit: &str,
) -> Result<Quantity, AnovaError> {
    Ok(Quantity::new(label, 0.0, variance.max(0.0).sqrt(), unit)?.with_degrees_of_freedom(degrees))
}
