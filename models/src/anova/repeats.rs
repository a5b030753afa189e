//! What each repeat has in common over the parts: parts that were measured one after the other, then all of
//! them again, share in every repeat how the instrument was zeroed or how warm it was.
//!
//! `y_ij = µ + b_i + c_j + e_ij`. Reading `j` of a part is of repeat `j`. If the repeats differ, the scatter
//! within the parts is not that of one measurement, and the mean of all readings is known no better than the
//! mean of as many repeats: `σ_c²` does not fall with the number of parts.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::components::{Interval, difference_degrees, limits};
use super::one_way::{analyse_with, influence};
use super::{AnovaError, Group, Groups, MeanSquare, OneWay};
use crate::uncertainty::{Budget, Correlation, DegreesOfFreedom, welch_satterthwaite};

/// Below this probability repeats count as different.
const LEVEL: f64 = 0.01;

/// What the numbers of the repeats tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Repeats {
    /// How many repeats there are.
    pub repeats: usize,
    /// Scatter of the repeats beside the parts.
    pub between: MeanSquare,
    /// `F` against what is left beside parts and repeats.
    pub f: f64,
    /// Probability of an `F` at least so large if the repeats did not differ.
    pub p_value: f64,
    /// Whether they do, at the 1 % level. The mean and a future reading hold it then, and the scatter of one
    /// measurement is that beside parts and repeats.
    pub differ: bool,
    /// The component of variance.
    pub component: Interval,
}

/// [`analyse`](super::analyse) where each reading has the number of its repeat, in the order of the readings of
/// its group. None of the repeats where the readings do not tell them: one repeat, or nothing left beside them.
///
/// # Errors
/// A confidence outside 0..1.
pub fn analyse_repeats(
    groups: &Groups,
    numbers: &[Vec<u32>],
    unit: &str,
    confidence: f64,
) -> Result<(OneWay, Option<Repeats>), AnovaError> {
    let plain = analyse_with(groups, None, unit, confidence)?;
    let Some(fit) = Fit::of(groups, numbers) else {
        return Ok((plain, None));
    };
    let rest = fit.rest;
    let (Some(square), Some(left)) = (fit.between.mean_square, rest.mean_square) else {
        return Ok((plain, None));
    };
    let law = FisherSnedecor::new(
        fit.between.degrees_of_freedom as f64,
        rest.degrees_of_freedom as f64,
    );
    let Ok(law) = law else {
        return Ok((plain, None));
    };
    let f = square / left;
    let p_value = law.sf(f);
    let variance = (square - left) / fit.count;
    let (lower, upper) = limits(
        (square, fit.between.degrees_of_freedom as f64),
        (left, rest.degrees_of_freedom as f64),
        fit.count,
        0.5 * (1.0 - confidence),
    )?;
    let repeats = Repeats {
        repeats: fit.effects.len(),
        between: fit.between,
        f,
        p_value,
        differ: p_value < LEVEL,
        component: Interval {
            variance,
            standard_deviation: variance.max(0.0).sqrt(),
            lower,
            upper,
            degrees: difference_degrees(square, &fit.between, left, &rest)?,
        },
    };
    if !repeats.differ {
        return Ok((plain, Some(repeats)));
    }
    let mut found = analyse_with(&fit.freed(groups, numbers)?, Some(rest), unit, confidence)?;
    fit.add_to(&mut found, square, unit)?;
    Ok((found, Some(repeats)))
}

/// Least squares of parts and repeats.
struct Fit {
    /// Effect of each repeat; their mean over all readings is zero.
    effects: BTreeMap<u32, f64>,
    /// `Σ p_j²`, with `p_j` the share of the readings that repeat `j` has.
    shares: f64,
    between: MeanSquare,
    /// What is left beside parts and repeats.
    rest: MeanSquare,
    /// Readings that a repeat counts for in the expectation of the mean square of the repeats.
    count: f64,
}

impl Fit {
    /// With the parts eliminated: `A c = b`, `A = diag(m_j) − Σ_i n_ij n_ij'/n_i`, `b_j` the sum of the readings
    /// of repeat `j` less the means of their parts. `E[c'b] = tr(A) σ_c² + rank σ_e²`.
    fn of(groups: &Groups, numbers: &[Vec<u32>]) -> Option<Self> {
        let mut place = BTreeMap::new();
        for number in numbers.iter().flatten() {
            place.insert(*number, 0_usize);
        }
        for (i, value) in place.values_mut().enumerate() {
            *value = i;
        }
        let many = place.len();
        if many < 2 {
            return None;
        }
        let (mut a, mut b) = (DMatrix::zeros(many, many), DVector::zeros(many));
        let mut of_repeat = vec![0.0; many];
        let mut within = 0.0;
        for (group, numbers) in groups.groups().iter().zip(numbers) {
            let mean = group.mean();
            within += group.sum_of_squares().max(0.0);
            let places: Vec<usize> = numbers
                .iter()
                .filter_map(|n| place.get(n).copied())
                .collect();
            for (&j, reading) in places.iter().zip(&group.readings) {
                b[j] += reading - mean;
                a[(j, j)] += 1.0;
                of_repeat[j] += 1.0;
                for &other in &places {
                    a[(j, other)] -= 1.0 / places.len() as f64;
                }
            }
        }
        let count: f64 = a.trace();
        let parts = a.symmetric_eigen();
        let greatest = parts.eigenvalues.max();
        let (mut rank, mut explained) = (0, 0.0);
        let mut c = DVector::zeros(many);
        for (value, vector) in parts
            .eigenvalues
            .iter()
            .zip(parts.eigenvectors.column_iter())
        {
            if *value > 1e-9 * greatest {
                let along = vector.dot(&b);
                rank += 1;
                explained += along * along / value;
                c += vector * (along / value);
            }
        }
        let freedom = groups
            .readings()
            .checked_sub(groups.groups().len() + rank)?;
        let left = within - explained;
        // Less than rounding leaves of the squares is no scatter.
        if rank == 0 || freedom == 0 || !(left > 1e-12 * within) {
            return None;
        }
        let n = groups.readings() as f64;
        let middle = c.iter().zip(&of_repeat).map(|(c, m)| c * m).sum::<f64>() / n;
        Some(Self {
            effects: place
                .iter()
                .map(|(number, &j)| (*number, c[j] - middle))
                .collect(),
            shares: of_repeat.iter().map(|m| (m / n).powi(2)).sum(),
            between: MeanSquare::new(explained, rank),
            rest: MeanSquare::new(left, freedom),
            count: count / rank as f64,
        })
    }

    /// The readings less the effects of their repeats.
    fn freed(&self, groups: &Groups, numbers: &[Vec<u32>]) -> Result<Groups, AnovaError> {
        let freed = groups.groups().iter().zip(numbers).map(|(group, numbers)| {
            let effect = |n: &u32| self.effects.get(n).copied().unwrap_or_default();
            Group {
                name: group.name.clone(),
                readings: group
                    .readings
                    .iter()
                    .zip(numbers)
                    .map(|(reading, n)| reading - effect(n))
                    .collect(),
            }
        });
        Groups::new(freed.collect())
    }

    /// Adds to the mean what the repeats leave open of it, `Σ p_j² S_c²`, and to a future reading that and the
    /// deviation of the repeat in which it is taken, with the variance `S_c²` of the effects.
    fn add_to(&self, found: &mut OneWay, square: f64, unit: &str) -> Result<(), AnovaError> {
        let variance = square / self.count;
        let freedom = DegreesOfFreedom::new(self.between.degrees_of_freedom as f64)?;
        let add = |own: f64, degrees, more: f64| {
            let sum = (own * own + more).sqrt();
            (
                sum,
                welch_satterthwaite(&[(own, degrees), (more.sqrt(), freedom)]),
            )
        };
        let mean = &mut found.mean;
        let (std, degrees) = add(
            mean.standard_uncertainty,
            mean.degrees_of_freedom,
            self.shares * variance,
        );
        mean.standard_uncertainty = std;
        *mean = mean.clone().with_degrees_of_freedom(degrees);
        if let Some(budget) = &found.future_reading {
            let label = "between repeats, with the mean";
            let own = influence(
                label,
                variance,
                self.between.degrees_of_freedom as f64,
                unit,
            )?;
            let share = 1.0 + self.shares;
            let (_, degrees) = add(
                budget.result.standard_uncertainty,
                budget.result.degrees_of_freedom,
                share * variance,
            );
            let mut inputs: Vec<_> = budget
                .contributions
                .iter()
                .map(|c| (c.input.clone(), c.sensitivity))
                .collect();
            inputs.push((own, share.sqrt()));
            let independent = Correlation::none(inputs.len());
            let value = found.mean.value;
            let mut sum = Budget::combine("future reading", value, unit, inputs, &independent)?;
            sum.result = sum.result.with_degrees_of_freedom(degrees);
            found.future_reading = Some(sum);
        }
        Ok(())
    }
}
