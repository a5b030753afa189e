//! The arithmetic of NISTIR 6868 as its tables print it, for comparison with [`super::analyse`].
//!
//! The report calls the mean square between parts the variance of manufacturing. Its expectation
//! is `σ_w² + n0 σ_b²`, so its root overstates the spread of the parts by about `√n0`.

use serde::{Deserialize, Serialize};

use super::{AnovaError, Groups};

/// Which of the report's two ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recipe {
    /// Section 5.1: mean weighted by the number of readings, `Σ n_i (mean_i - mean)² / (k - 1)`.
    /// Tables B1 to B8 and C1 to C12.
    Section51,
    /// Tables G1, H1 and H2: plain mean of the part means, `Σ (n_i - 1) (mean_i - mean)² /
    /// Σ (n_i - 1)`.
    PartMeans,
}

/// The figures under a table of the report, in the unit of the readings or its square.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The recipe followed.
    pub recipe: Recipe,
    /// "Mean manufacturing error", "grand mean".
    pub mean: f64,
    /// "Variance of the manufacturing error", "variance of the means".
    pub variance_between: f64,
    /// "Metrology error variance", `Σ (n_i - 1) s_i² / Σ (n_i - 1)`.
    pub variance_within: f64,
    /// The quotient of the two variances; `None` when the second is zero.
    pub f: Option<f64>,
    /// Equation (17), `s_p / √N`: the noise of measuring only, not that of the parts.
    pub standard_uncertainty: f64,
    /// Equation (18), `s_p √(1 + 1/N)`: Tables B1 to B4.
    pub future_measurement: f64,
    /// The same factor with the number of groups on the variance between, Tables B5 to B8.
    pub future_manufacturing: f64,
}

/// Follows one of the report's recipes.
///
/// # Errors
/// One group only, or no group read twice.
pub fn summarise(groups: &Groups, recipe: Recipe) -> Result<Summary, AnovaError> {
    let list = groups.groups();
    let k = list.len() as f64;
    let n = groups.readings() as f64;
    if list.len() < 2 || n <= k {
        return Err(AnovaError::NothingToCompare);
    }
    let mean = match recipe {
        Recipe::Section51 => groups.weighted_mean(),
        Recipe::PartMeans => groups.mean_of_means(),
    };
    let squares = |weight: fn(f64) -> f64| -> f64 {
        list.iter()
            .map(|g| weight(g.readings.len() as f64) * (g.mean() - mean).powi(2))
            .sum()
    };
    let variance_between = match recipe {
        Recipe::Section51 => squares(|n| n) / (k - 1.0),
        Recipe::PartMeans => squares(|n| n - 1.0) / (n - k),
    };
    let within: f64 = list.iter().map(|g| g.sum_of_squares().max(0.0)).sum();
    let variance_within = within / (n - k);
    Ok(Summary {
        recipe,
        mean,
        variance_between,
        variance_within,
        f: (variance_within > 0.0).then(|| variance_between / variance_within),
        standard_uncertainty: (variance_within / n).sqrt(),
        future_measurement: future(variance_within, n),
        future_manufacturing: future(variance_between, k),
    })
}

/// The standard uncertainty of one more value, `√(variance (1 + 1/count))` (equation 18). The
/// report's count is 54 in Tables B1 to B4, 21 in B5 to B8, and 50 in Tables 14 to 16.
#[must_use]
pub fn future(variance: f64, count: f64) -> f64 {
    (variance * (1.0 + 1.0 / count)).sqrt()
}

/// Takes a wrong mean out of a mean square between groups that was formed about it: by Steiner's
/// theorem `Σ n_i (mean_i - wrong)² = Σ n_i (mean_i - right)² + N (right - wrong)²`. The Y tables of
/// the report carry the mean of another hole in this way.
#[must_use]
pub fn about_right_mean(
    variance_between: f64,
    readings: f64,
    groups: f64,
    right_mean: f64,
    wrong_mean: f64,
) -> f64 {
    variance_between - readings / (groups - 1.0) * (right_mean - wrong_mean).powi(2)
}
