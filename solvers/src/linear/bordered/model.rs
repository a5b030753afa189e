//! A bordered system at a point, as the minimiser speaks to it: parameters are the unknowns of the
//! band, then those of the border.

use std::sync::OnceLock;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::assemble::Bordered;
use super::constraints::Constraints;
use super::covariance::BorderedCovariance;
use super::solve::Solved;
use crate::linear::{DampedStep, LinearModel};
use crate::outcome::Combination;

/// Diagonals of the band below this share of their column count as zero.
const BAND_RANK_TOLERANCE: f64 = 1e-11;

/// The linear model of a banded and bordered problem under its constraints, with some unknowns of
/// the border held.
///
/// What is asked for is worked out when it first is, so that a point that is left at once costs its
/// factorisation only.
#[derive(Debug, Clone)]
pub struct BorderedModel<'a> {
    system: Bordered,
    constraints: &'a Constraints,
    held: &'a [bool],
    missing: DVector<f64>,
    solved: OnceLock<Result<Solved, usize>>,
    norms: OnceLock<DVector<f64>>,
    gradient: OnceLock<DVector<f64>>,
}

impl<'a> BorderedModel<'a> {
    /// The model of a finished system at a point (band, border), which the constraints may miss by
    /// what is left of rounding: the next step makes it good.
    pub fn new(
        system: Bordered,
        constraints: &'a Constraints,
        held: &'a [bool],
        (band, border): (&[f64], &[f64]),
    ) -> Self {
        Self {
            system,
            constraints,
            held,
            missing: constraints.missing(band, border),
            solved: OnceLock::new(),
            norms: OnceLock::new(),
            gradient: OnceLock::new(),
        }
    }

    /// The undamped solution, or the number of a constraint that repeats those before it.
    fn solved(&self) -> &Result<Solved, usize> {
        self.solved.get_or_init(|| self.solve(&self.system))
    }

    fn solve(&self, system: &Bordered) -> Result<Solved, usize> {
        system.solve(self.constraints, &self.missing, self.held)
    }

    /// The system, with its undamped solution; `None` where a constraint repeats others.
    pub fn into_parts(self) -> (Bordered, Option<Solved>) {
        let solved = match self.solved.into_inner() {
            Some(solved) => solved,
            None => self
                .system
                .solve(self.constraints, &self.missing, self.held),
        };
        (self.system, solved.ok())
    }

    fn split<'v>(&self, vector: &'v DVector<f64>) -> (&'v [f64], &'v [f64]) {
        vector.as_slice().split_at(self.system.band_len())
    }

    /// The step of a solution; none where there is no solution.
    fn step_of(&self, solved: &Result<Solved, usize>) -> DVector<f64> {
        match solved {
            Ok(solved) => joined(&solved.band, &solved.border),
            Err(_) => DVector::zeros(self.parameter_count()),
        }
    }

    /// g + E ν with the ν that make it least in the metric of D: the downhill direction −D⁻²(g + Eν)
    /// keeps the constraints Eᵀs = 0, E = (W, −Aᵀ), and leaves what is held.
    fn free_gradient(&self, scale: &DVector<f64>) -> DVector<f64> {
        let n = self.system.band_len();
        let (band, border) = self.system.gradient();
        let mut gradient = joined(&band, &border);
        let free = |j: usize| j < n || !self.held[j - n];
        for j in n..gradient.len() {
            if !free(j) {
                gradient[j] = 0.0;
            }
        }
        let p = self.constraints.len();
        if p == 0 {
            return gradient;
        }
        let columns = DMatrix::from_fn(gradient.len(), p, |j, l| match j.checked_sub(n) {
            None => self.constraints.band[l][j],
            Some(k) if free(j) => -self.constraints.border[(l, k)],
            Some(_) => 0.0,
        });
        let mut scaled = columns.clone();
        for (mut row, d) in scaled.row_iter_mut().zip(scale.iter()) {
            row /= *d;
        }
        let pull = scaled.tr_mul(&gradient.component_div(scale));
        if let Some(normal) = Cholesky::new(scaled.tr_mul(&scaled)) {
            gradient -= columns * normal.solve(&pull);
        }
        gradient
    }

    /// Column norms with one for columns that are zero.
    fn units(&self) -> DVector<f64> {
        self.column_norms()
            .map(|norm| if norm > 0.0 { norm } else { 1.0 })
    }
}

fn joined(band: &[f64], border: &[f64]) -> DVector<f64> {
    DVector::from_iterator(
        band.len() + border.len(),
        band.iter().chain(border).copied(),
    )
}

impl LinearModel for BorderedModel<'_> {
    fn parameter_count(&self) -> usize {
        self.system.band_len() + self.system.border_len()
    }

    fn gradient(&self) -> &DVector<f64> {
        self.gradient
            .get_or_init(|| self.free_gradient(&self.units()))
    }

    fn column_norms(&self) -> &DVector<f64> {
        self.norms.get_or_init(|| {
            let (band, border) = self.system.column_norms();
            joined(&band, &border)
        })
    }

    fn rank(&self) -> usize {
        self.parameter_count() - self.null_space().ncols()
    }

    fn undamped_step(&self) -> DVector<f64> {
        self.step_of(self.solved())
    }

    fn damped_step(&self, damping: f64, scale: &DVector<f64>) -> DampedStep {
        let (band, border) = self.split(scale);
        let damped = self.system.damped(damping, band, border);
        let solved = self.solve(&damped);
        let step = self.step_of(&solved);
        let length = step.component_mul(scale).norm();
        let slope = match &solved {
            Ok(solved) if length > 0.0 => {
                let q = step.component_mul(scale).component_mul(scale) / length;
                let (band, border) = self.split(&q);
                BorderedCovariance::new(&damped, solved)
                    .variance(&numbered(band), &numbered(border))
            }
            _ => 0.0,
        };
        DampedStep { step, slope }
    }

    fn image_norm(&self, step: &DVector<f64>) -> f64 {
        let (band, border) = self.split(step);
        self.system.image_norm(band, border)
    }

    fn predicted_reduction(&self, step: &DVector<f64>) -> f64 {
        let (band, border) = self.split(step);
        self.system.predicted_reduction(band, border)
    }

    /// Combinations of the border, whatever of the band compensates them, then unknowns of the band.
    fn null_space(&self) -> DMatrix<f64> {
        let n = self.system.band_len();
        let in_band = self.system.triangle().undetermined(BAND_RANK_TOLERANCE);
        let in_border = match self.solved() {
            Ok(solved) => solved.undetermined.as_slice(),
            Err(_) => &[],
        };
        let mut null = DMatrix::zeros(self.parameter_count(), in_border.len() + in_band.len());
        for (k, combination) in in_border.iter().enumerate() {
            for (j, weight) in combination.weights.iter().enumerate() {
                null[(n + j, k)] = *weight;
            }
        }
        for (k, j) in in_band.into_iter().enumerate() {
            null[(j, in_border.len() + k)] = 1.0;
        }
        null
    }

    fn undetermined(&self, names: &[String]) -> Vec<Combination> {
        let constraint = self.solved().as_ref().err().map(|index| Combination {
            terms: vec![(format!("constraint {index}"), 1.0)],
        });
        let null = self.null_space();
        let unknowns = null.column_iter().map(|column| {
            Combination::from_direction(&column.into_owned(), self.column_norms(), names)
        });
        constraint.into_iter().chain(unknowns).collect()
    }

    fn steepest_descent(&self, scale: &DVector<f64>) -> DVector<f64> {
        -self
            .free_gradient(scale)
            .component_div(scale)
            .component_div(scale)
    }

    fn probe(&self, _free: &[usize]) -> Option<DVector<f64>> {
        let direction = self.steepest_descent(&self.units());
        (self.image_norm(&direction) > 0.0).then_some(direction)
    }
}

fn numbered(values: &[f64]) -> Vec<(usize, f64)> {
    values.iter().copied().enumerate().collect()
}
