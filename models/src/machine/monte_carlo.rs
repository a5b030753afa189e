//! Propagation of distributions through the machine to any feature (NISTIR 6868, equations 46 to
//! 49; JCGM 101).
//!
//! A component whose uncertainty rests on ν degrees of freedom is drawn from Student's distribution
//! (JCGM 101, 6.4.9): a normal deviation times √(ν/χ²_ν), the same for the coefficients and the scatter
//! of one component, because both rest on the same sum of squares. Its deviations spread by
//! √(ν/(ν − 2)) more than the law of propagation has it, and by no finite amount for ν ≤ 2; their
//! coverage intervals hold what they say. Infinite degrees of freedom make them normal.

use nalgebra::{DMatrix, Vector3};
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};

use super::joint_draws::{Joint, Part};
use super::model::coordinate;
use super::{Independence, Kind, Machine, MachineError, Position, Prediction};
use crate::uncertainty::{DegreesOfFreedom, Trials, simulate};

/// A component as the sampler needs it.
#[derive(Debug, Clone)]
pub(super) struct Influence {
    /// Lower factor of the covariance of the coefficients.
    factor: DMatrix<f64>,
    /// Powers at each point, point after point.
    powers: Vec<f64>,
    /// Motion of each point, um per unit of the component.
    pub(super) motions: Vec<Vector3<f64>>,
    /// Standard deviation at each point when the points are independent.
    own: Vec<f64>,
    /// Standard deviation of the scatter.
    scatter: f64,
    /// One draw of the scatter serves all points.
    common_scatter: bool,
    /// Degrees of freedom ν of its standard deviations with the distribution of χ²_ν; `None` when they
    /// are infinite.
    pub(super) degrees: Option<(f64, ChiSquared<f64>)>,
}

/// Draws the deviations of a set of points. Everything that does not change from draw to draw is
/// worked out once.
#[derive(Debug, Clone)]
pub struct Sampler {
    means: Vec<Vector3<f64>>,
    influences: Vec<Influence>,
    /// Standard deviation of each coordinate, for [`Independence::Coordinates`].
    coordinates: Vec<Vector3<f64>>,
    independence: Independence,
}

impl Sampler {
    /// Prepares the points.
    ///
    /// # Errors
    /// A position outside a table or not finite; a covariance that is not positive semidefinite.
    pub fn new(
        machine: &Machine,
        points: &[Position],
        independence: Independence,
        prediction: Prediction,
    ) -> Result<Self, MachineError> {
        let means = points
            .iter()
            .map(|p| machine.deviation(p))
            .collect::<Result<Vec<_>, _>>()?;
        let mut influences = Vec::new();
        let mut variances = vec![Vector3::zeros(); points.len()];
        for error in machine.errors() {
            let spread = &error.spread;
            let scatter = match prediction {
                Prediction::Future => spread.scatter,
                Prediction::Mean => 0.0,
            };
            let motions: Vec<Vector3<f64>> = points
                .iter()
                .map(|p| machine.sensitivity(error.component, p))
                .collect();
            let at = |p: &Position| coordinate(error.component, p);
            let own: Vec<f64> = points
                .iter()
                .map(|p| (spread.of_function(at(p)) + scatter).sqrt())
                .collect();
            for ((sum, motion), u) in variances.iter_mut().zip(&motions).zip(&own) {
                *sum += motion.component_mul(motion) * (u * u);
            }
            if own.iter().all(|u| *u == 0.0) {
                continue;
            }
            influences.push(Influence {
                factor: lower_factor(&spread.covariance).ok_or_else(|| {
                    MachineError::BadComponent {
                        component: error.component,
                        why: "the covariance of its coefficients has a negative variance".into(),
                    }
                })?,
                powers: points
                    .iter()
                    .flat_map(|p| spread.basis.powers(at(p)))
                    .collect(),
                motions,
                own,
                scatter: scatter.sqrt(),
                common_scatter: error.component.kind == Kind::Squareness,
                degrees: match spread.degrees {
                    DegreesOfFreedom::Infinite => None,
                    DegreesOfFreedom::Finite(number) => ChiSquared::new(number)
                        .ok()
                        .map(|squares| (number, squares)),
                },
            });
        }
        let coordinates = variances.iter().map(|v| v.map(f64::sqrt)).collect();
        Ok(Self {
            means,
            influences,
            coordinates,
            independence,
        })
    }

    /// Takes the standard deviations of all components as known, so that their draws are normal: for
    /// simulating a machine rather than what is known of one.
    #[must_use]
    pub fn with_known_spreads(mut self) -> Self {
        for influence in &mut self.influences {
            influence.degrees = None;
        }
        self
    }

    /// Number of points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.means.len()
    }

    /// What many draws share; `None` where coordinates are drawn one by one.
    fn joint(&self) -> Option<Joint<'_>> {
        let part: fn(&Influence) -> Part<'_> = match self.independence {
            Independence::Coordinates => return None,
            Independence::Points => Influence::by_point,
            Independence::Scatter => Influence::by_coefficient,
        };
        let parts = self.influences.iter().map(part).collect();
        Some(Joint::new(&self.means, parts))
    }

    /// Draws the deviation of every point, um. Points beyond the slice are left out.
    ///
    /// [`Independence::Coordinates`] draws each coordinate from a normal distribution, as the report
    /// does: what it adds up to has no one number of degrees of freedom.
    pub fn draw(&self, rng: &mut impl Rng, deviations: &mut [Vector3<f64>]) {
        for (deviation, mean) in deviations.iter_mut().zip(&self.means) {
            *deviation = *mean;
        }
        match self.independence {
            Independence::Coordinates => {
                for (deviation, std) in deviations.iter_mut().zip(&self.coordinates) {
                    *deviation += std.map(|u| if u > 0.0 { u * normal(rng) } else { 0.0 });
                }
            }
            Independence::Points => {
                for influence in &self.influences {
                    // All its points rest on the same readings.
                    let widening = influence.widening(rng);
                    let parts = influence.motions.iter().zip(&influence.own);
                    for (deviation, (motion, u)) in deviations.iter_mut().zip(parts) {
                        *deviation += motion * (u * widening * normal(rng));
                    }
                }
            }
            Independence::Scatter => {
                for influence in &self.influences {
                    influence.draw_common(rng, deviations);
                }
            }
        }
    }
}

impl Influence {
    /// √(ν/χ²_ν), which makes a normal deviate one of Student's; 1 for infinite degrees of freedom.
    pub(super) fn widening(&self, rng: &mut impl Rng) -> f64 {
        self.degrees.as_ref().map_or(1.0, |(number, squares)| {
            (number / squares.sample(rng)).sqrt()
        })
    }

    /// Every point is drawn for itself.
    fn by_point(&self) -> Part<'_> {
        Part {
            influence: self,
            own: self.own.iter().map(|u| u * u).collect(),
            shared: Vec::new(),
        }
    }

    /// Coefficients are drawn for all points, the scatter for each.
    fn by_coefficient(&self) -> Part<'_> {
        let terms = self.factor.nrows();
        let by_deviate = |k: usize| {
            let motions = self.motions.iter().enumerate();
            let along = motions.map(|(i, motion)| {
                let powers = &self.powers[i * terms..(i + 1) * terms];
                let value = (k..terms).map(|j| self.factor[(j, k)] * powers[j]);
                motion * value.sum::<f64>()
            });
            along.collect::<Vec<_>>()
        };
        let mut shared: Vec<_> = (0..terms).map(by_deviate).collect();
        let mut own = Vec::new();
        if self.common_scatter {
            shared.push(self.motions.iter().map(|m| m * self.scatter).collect());
        } else if self.scatter > 0.0 {
            own = vec![self.scatter * self.scatter; self.motions.len()];
        }
        Part {
            influence: self,
            own,
            shared,
        }
    }

    fn draw_common(&self, rng: &mut impl Rng, deviations: &mut [Vector3<f64>]) {
        let terms = self.factor.nrows();
        let widening = self.widening(rng);
        let scatter = widening * self.scatter;
        // Few coefficients: a fixed array keeps the draw free of allocation.
        let mut coefficients = [0.0; MOST_TERMS];
        for k in 0..terms {
            let z = widening * normal(rng);
            for (i, c) in coefficients.iter_mut().enumerate().take(terms).skip(k) {
                *c += self.factor[(i, k)] * z;
            }
        }
        let common = if self.common_scatter {
            scatter * normal(rng)
        } else {
            0.0
        };
        let fresh = !self.common_scatter && scatter > 0.0;
        for (i, (deviation, motion)) in deviations.iter_mut().zip(&self.motions).enumerate() {
            let powers = &self.powers[i * terms..(i + 1) * terms];
            let mut value: f64 = powers.iter().zip(&coefficients).map(|(p, c)| p * c).sum();
            value += if fresh { scatter * normal(rng) } else { common };
            *deviation += motion * value;
        }
    }
}

/// Coefficients a sampled component can have.
const MOST_TERMS: usize = 32;

pub(super) fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Lower triangular factor of a covariance that may be singular; `None` when it is indefinite or
/// has more rows than are sampled.
fn lower_factor(covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = covariance.nrows();
    if n > MOST_TERMS {
        return None;
    }
    let mut factor: DMatrix<f64> = DMatrix::zeros(n, n);
    for j in 0..n {
        let mut pivot = covariance[(j, j)];
        for k in 0..j {
            pivot -= factor[(j, k)] * factor[(j, k)];
        }
        if pivot < -1e-12 * covariance[(j, j)].abs() {
            return None;
        }
        if pivot <= 1e-15 * covariance[(j, j)].abs() {
            continue;
        }
        factor[(j, j)] = pivot.sqrt();
        for i in j + 1..n {
            let mut sum = covariance[(i, j)];
            for k in 0..j {
                sum -= factor[(i, k)] * factor[(j, k)];
            }
            factor[(i, j)] = sum / factor[(j, j)];
        }
    }
    Some(factor)
}

/// Draws `trials` sets of deviations and works out features of each, in parallel. `features` gets
/// the deviations (um) and fills the results; the same seed gives the same trials on any number
/// of threads.
///
/// # Errors
/// Fewer than two trials, or a feature that is not finite.
pub fn sample_features(
    sampler: &Sampler,
    trials: usize,
    results: usize,
    seed: u64,
    features: impl Fn(&[Vector3<f64>], &mut [f64]) + Sync,
) -> Result<Trials, MachineError> {
    let zeros = || vec![Vector3::zeros(); sampler.points()];
    let Some(joint) = sampler.joint() else {
        return Ok(simulate(
            trials,
            results,
            seed,
            zeros,
            |rng, deviations, out| {
                sampler.draw(rng, deviations);
                features(deviations, out);
            },
        )?);
    };
    Ok(simulate(
        trials,
        results,
        seed,
        || (joint.room(), zeros()),
        |rng, (room, deviations), out| {
            joint.draw(rng, room, deviations);
            features(deviations, out);
        },
    )?)
}
