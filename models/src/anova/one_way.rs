//! The unbalanced one-way analysis.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::components::{Components, chi_squared, components};
use super::{AnovaError, Group, Groups};
use crate::uncertainty::{Budget, Correlation, DegreesOfFreedom, Quantity, welch_satterthwaite};

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
    pub(super) fn new(sum_of_squares: f64, degrees_of_freedom: usize) -> Self {
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
    analyse_with(groups, None, unit, confidence)
}

/// The analysis with a scatter within the groups that has fewer degrees of freedom than their readings have.
pub(super) fn analyse_with(
    groups: &Groups,
    within: Option<MeanSquare>,
    unit: &str,
    confidence: f64,
) -> Result<OneWay, AnovaError> {
    let grand = groups.weighted_mean();
    let list = groups.groups();
    let k = list.len();
    let n = groups.readings();
    let between = list
        .iter()
        .map(|g| g.readings.len() as f64 * (g.mean() - grand).powi(2))
        .sum();
    let between = MeanSquare::new(if k > 1 { between } else { 0.0 }, k - 1);
    let within = within.unwrap_or_else(|| {
        let squares = list.iter().map(|g| g.sum_of_squares().max(0.0)).sum();
        MeanSquare::new(squares, n - k)
    });
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
    let mean = mean(groups, grand, &within, &components, unit)?;
    let future_reading = future_reading(groups, &mean, &within, unit)?;
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

/// The mean `Σ p_i ȳ_i` of all readings, `p_i = n_i/N`, has the variance `Σ p_i² v_i` with
/// `v_i = σ_b² + σ_w²/n_i`. The components say how the `v_i` compare with one another; how large they are
/// is taken from the scatter of the group means alone, `q = Σ (ȳ_i - m)²/v_i / (k - 1)` about their mean
/// `m` weighted by `1/v_i`, as Hartung and Knapp do it (J. Hartung, G. Knapp, *Statistics in Medicine* 20
/// (2001) 3875). With `k - 1` degrees of freedom; for equal counts that is `MS_b/N`, exact for any `σ_b`.
fn mean(
    groups: &Groups,
    grand: f64,
    within: &MeanSquare,
    components: &Components,
    unit: &str,
) -> Result<Quantity, AnovaError> {
    let n = groups.readings() as f64;
    let list = groups.groups();
    let (variance, degrees) = if list.len() == 1 {
        (
            within.mean_square.unwrap_or(0.0) / n,
            within.degrees_of_freedom as f64,
        )
    } else {
        let sigma_b = components.between.map_or(1.0, |b| b.variance.max(0.0));
        let sigma_w = within.mean_square.unwrap_or(0.0);
        let spread = |g: &Group| {
            let v = sigma_b + sigma_w / g.readings.len() as f64;
            if v > 0.0 { v } else { 1.0 }
        };
        let weights: f64 = list.iter().map(|g| 1.0 / spread(g)).sum();
        let deviations = list.iter().map(|g| (g.mean() - grand) / spread(g));
        let centre = grand + deviations.sum::<f64>() / weights;
        let degrees = list.len() as f64 - 1.0;
        let q = list
            .iter()
            .map(|g| (g.mean() - centre).powi(2) / spread(g))
            .sum::<f64>()
            / degrees;
        let variance = list
            .iter()
            .map(|g| (g.readings.len() as f64 / n).powi(2) * spread(g))
            .sum::<f64>();
        (q * variance, degrees)
    };
    Ok(Quantity::new("mean", grand, variance.sqrt(), unit)?
        .with_degrees_of_freedom(DegreesOfFreedom::new(degrees)?))
}

/// The probability with which the spread of the group means is taken to be at most what the degrees of
/// freedom of a future reading count with.
const CAUTIOUS: f64 = 0.75;

/// A reading of a new group differs from the mean of all readings by the variance
/// `(1 + a) σ_b² + (1 + 1/N) σ_w²`, `a = Σ n_i²/N²`. The new group's own deviation and the mean rest on the
/// same group means, so they are one influence, `(1 + a) S²` with the variance `S²` of the group means, which
/// estimates `σ_b² + σ_w²/h` (`h` the harmonic mean count); what is left to the scatter within a group is
/// `(1 + 1/N - (1 + a)/h) MS_w`.
///
/// The degrees of freedom are Satterthwaite's for that sum. Where `S²` happens to be small the interval is
/// short and `ν` large at once, and intervals of three groups hold 93 % instead of 95; so `ν` counts with the
/// upper quartile of what `S²` says of its variance, `S² ν/χ²_ν(0.25)`.
fn future_reading(
    groups: &Groups,
    mean: &Quantity,
    within: &MeanSquare,
    unit: &str,
) -> Result<Option<Budget>, AnovaError> {
    let Some(within_square) = within.mean_square else {
        return Ok(None);
    };
    let n = groups.readings() as f64;
    let within_degrees = within.degrees_of_freedom as f64;
    let within_influence = influence("within a group", within_square, within_degrees, unit)?;
    let (inputs, degrees) = match groups.spread_of_means() {
        None => (
            vec![(within_influence, (1.0 + 1.0 / n).sqrt())],
            DegreesOfFreedom::new(within_degrees)?,
        ),
        Some(spread) => {
            let share = 1.0 + groups.sum_of_squared_counts() / (n * n);
            let rest = (1.0 + 1.0 / n - share / spread.harmonic_count).max(0.0);
            let caution = spread.degrees / chi_squared(spread.degrees)?.inverse_cdf(1.0 - CAUTIOUS);
            let counted = |variance: f64, degrees| -> Result<_, AnovaError> {
                Ok((variance.sqrt(), DegreesOfFreedom::new(degrees)?))
            };
            let degrees = welch_satterthwaite(&[
                counted(caution * share * spread.variance, spread.degrees)?,
                counted(rest * within_square, within_degrees)?,
            ]);
            let label = "between groups, with the mean";
            let between = influence(label, spread.variance, spread.degrees, unit)?;
            (
                vec![(between, share.sqrt()), (within_influence, rest.sqrt())],
                degrees,
            )
        }
    };
    let independent = Correlation::none(inputs.len());
    let mut budget = Budget::combine("future reading", mean.value, unit, inputs, &independent)?;
    budget.result = budget.result.with_degrees_of_freedom(degrees);
    Ok(Some(budget))
}

pub(super) fn influence(
    label: &str,
    variance: f64,
    degrees: f64,
    unit: &str,
) -> Result<Quantity, AnovaError> {
    Ok(Quantity::new(label, 0.0, variance.sqrt(), unit)?
        .with_degrees_of_freedom(DegreesOfFreedom::new(degrees)?))
}
