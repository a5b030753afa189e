//! Readings by group.

use super::AnovaError;

/// The replicates of one group, such as one part.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Name of the group.
    pub name: String,
    /// Its readings, in the unit of the feature; at least one, all finite.
    pub readings: Vec<f64>,
}

impl Group {
    /// Mean of the readings, in their unit. Deviations from the first are averaged, so a large
    /// common part of the readings costs no digits.
    #[must_use]
    pub fn mean(&self) -> f64 {
        let first = self.readings.first().copied().unwrap_or_default();
        let sum: f64 = self.readings.iter().map(|x| x - first).sum();
        first + sum / self.readings.len() as f64
    }

    /// Sum of squared deviations from the mean.
    #[must_use]
    pub fn sum_of_squares(&self) -> f64 {
        let mean = self.mean();
        let (squares, rest) = self.readings.iter().fold((0.0, 0.0), |(s, r), x| {
            let d = x - mean;
            (s + d * d, r + d)
        });
        squares - rest * rest / self.readings.len() as f64
    }

    /// Sample standard deviation; `None` for a single reading.
    #[must_use]
    pub fn standard_deviation(&self) -> Option<f64> {
        let degrees = self.readings.len() as f64 - 1.0;
        (degrees > 0.0).then(|| (self.sum_of_squares() / degrees).max(0.0).sqrt())
    }
}

/// Groups of readings that can be analysed.
#[derive(Debug, Clone, PartialEq)]
pub struct Groups {
    groups: Vec<Group>,
}

/// Scatter of the group means about their plain mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpreadOfMeans {
    /// Sample variance, unit of the readings squared: it estimates `σ_b² + σ_w²/h`.
    pub variance: f64,
    /// `k - 1`.
    pub degrees: f64,
    /// Harmonic mean `h` of the counts.
    pub harmonic_count: f64,
}

impl Groups {
    /// Checks the groups: at least two readings in all, every group with a reading and a name of
    /// its own.
    ///
    /// # Errors
    /// Whatever is wrong with the first group that is wrong.
    pub fn new(groups: Vec<Group>) -> Result<Self, AnovaError> {
        if groups.is_empty() {
            return Err(AnovaError::Empty);
        }
        let mut names = std::collections::HashSet::new();
        for group in &groups {
            let name = || group.name.clone();
            if group.readings.is_empty() {
                return Err(AnovaError::EmptyGroup { group: name() });
            }
            if !names.insert(group.name.as_str()) {
                return Err(AnovaError::RepeatedGroup { group: name() });
            }
            if let Some(at) = group.readings.iter().position(|x| !x.is_finite()) {
                return Err(AnovaError::NotFinite {
                    group: name(),
                    number: at + 1,
                    found: group.readings[at],
                });
            }
        }
        let groups = Self { groups };
        if groups.readings() < 2 {
            return Err(AnovaError::OneReading);
        }
        // Degrees of freedom need the squares of variances.
        if !groups.total_square().powi(2).is_finite() {
            return Err(AnovaError::Overflow);
        }
        Ok(groups)
    }

    /// The groups in the order given.
    #[must_use]
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Number of readings in all groups, `N`.
    #[must_use]
    pub fn readings(&self) -> usize {
        self.groups.iter().map(|g| g.readings.len()).sum()
    }

    /// Mean of all readings: every group weighs as many times as it was read (NISTIR 6868,
    /// equation 15).
    #[must_use]
    pub fn weighted_mean(&self) -> f64 {
        let origin = self.groups.first().map_or(0.0, Group::mean);
        let sum: f64 = self
            .groups
            .iter()
            .map(|g| g.readings.len() as f64 * (g.mean() - origin))
            .sum();
        origin + sum / self.readings() as f64
    }

    /// Mean of the group means: every group weighs the same.
    #[must_use]
    pub fn mean_of_means(&self) -> f64 {
        let origin = self.groups.first().map_or(0.0, Group::mean);
        let sum: f64 = self.groups.iter().map(|g| g.mean() - origin).sum();
        origin + sum / self.groups.len() as f64
    }

    /// `n0 = (N - Σ n_i² / N) / (k - 1)`: how many readings a group counts for in the expectation
    /// of the mean square between groups. `None` for one group.
    #[must_use]
    pub fn effective_replicates(&self) -> Option<f64> {
        let k = self.groups.len() as f64;
        let n = self.readings() as f64;
        (k > 1.0).then(|| (n - self.sum_of_squared_counts() / n) / (k - 1.0))
    }

    /// How the group means scatter; `None` for one group.
    pub(super) fn spread_of_means(&self) -> Option<SpreadOfMeans> {
        let k = self.groups.len() as f64;
        let inverse_counts: f64 = self
            .groups
            .iter()
            .map(|g| 1.0 / g.readings.len() as f64)
            .sum();
        let centre = self.mean_of_means();
        let squares: f64 = self
            .groups
            .iter()
            .map(|g| (g.mean() - centre).powi(2))
            .sum();
        (k > 1.0).then(|| SpreadOfMeans {
            variance: squares / (k - 1.0),
            degrees: k - 1.0,
            harmonic_count: k / inverse_counts,
        })
    }

    /// `Σ n_i²`.
    pub(super) fn sum_of_squared_counts(&self) -> f64 {
        self.groups
            .iter()
            .map(|g| (g.readings.len() as f64).powi(2))
            .sum()
    }

    fn total_square(&self) -> f64 {
        self.groups
            .iter()
            .flat_map(|g| &g.readings)
            .map(|x| x * x)
            .sum()
    }
}
