//! The way of Zhao et al. as published: Tikhonov regularization of the triples' system, (17), S from
//! sensor 1, (18), and γ from sensors 1 and 4, (19).
//!
//! Kept as a named choice, to be compared with; [`Separator`](super::Separator) is the better way.

use errsep_solvers::regularization::Decomposition;
use nalgebra::DVector;

use super::{Choice, Chosen, FourSensorError, Geometry, Outputs, choice, triples};
use crate::units::UM_PER_MM;

/// What the published way finds.
#[derive(Debug, Clone)]
pub struct PublishedSeparation {
    /// f, µm, length N.
    pub surface: DVector<f64>,
    /// S, µm, length K.
    pub straightness: DVector<f64>,
    /// γ, rad, length K; e₄ is left in it as a constant.
    pub tilt: DVector<f64>,
    /// λ and how it came about; absent for plain least squares.
    pub chosen: Option<Chosen>,
}

/// The published system of one geometry, decomposed.
#[derive(Debug, Clone)]
pub struct PublishedSeparator {
    decomposition: Decomposition,
}

impl PublishedSeparator {
    /// Decomposes the constrained system; its matrix does not depend on the readings.
    ///
    /// # Errors
    /// The decomposition did not converge.
    pub fn new(geometry: &Geometry) -> Result<Self, FourSensorError> {
        let silent = vec![[0.0; 4]; geometry.output_count()];
        let (matrix, _) = triples::constrained_system(&Outputs::new(*geometry, 0.0, silent)?);
        Ok(Self {
            decomposition: Decomposition::standard(&matrix)?,
        })
    }

    /// Regularized with ‖X‖².
    ///
    /// # Errors
    /// The outputs belong to another geometry, or the system has no range of λ.
    pub fn separate(
        &self,
        outputs: &Outputs,
        choice: Choice,
    ) -> Result<PublishedSeparation, FourSensorError> {
        let (_, data) = triples::constrained_system(outputs);
        let spectrum = self.decomposition.with_data(&data)?;
        let chosen = choice::choose(&spectrum, choice, None)?;
        let solution = spectrum.solution(chosen.point.lambda)?;
        Ok(separated(outputs, &solution, Some(chosen)))
    }

    /// Plain least squares, which the paper shows to fail.
    ///
    /// # Errors
    /// The outputs belong to another geometry.
    pub fn least_squares(&self, outputs: &Outputs) -> Result<PublishedSeparation, FourSensorError> {
        let (_, data) = triples::constrained_system(outputs);
        let spectrum = self.decomposition.with_data(&data)?;
        let solution = spectrum.truncated(self.decomposition.rank());
        Ok(separated(outputs, &solution, None))
    }
}

fn separated(
    outputs: &Outputs,
    solution: &DVector<f64>,
    chosen: Option<Chosen>,
) -> PublishedSeparation {
    let geometry = outputs.geometry();
    let surface = solution.rows(0, geometry.point_count()).into_owned();
    let last = geometry.offsets()[3];
    let arm = UM_PER_MM * geometry.positions()[3];
    let readings = outputs.readings();
    PublishedSeparation {
        straightness: DVector::from_fn(readings.len(), |n, _| readings[n][0] - surface[n]),
        tilt: DVector::from_fn(readings.len(), |n, _| {
            (readings[n][3] - readings[n][0] - surface[n + last] + surface[n]) / arm
        }),
        surface,
        chosen,
    }
}
