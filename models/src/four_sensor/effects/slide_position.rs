//! The slide does not stand where it is commanded.

use nalgebra::DMatrix;

use super::FourSensors;
use crate::basis::few_waves::{FEW_WAVES, root_mean_square};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Parameter, Shape};

/// See the head of the file.
pub(super) struct SlidePosition;

impl Effect<FourSensors> for SlidePosition {
    fn name(&self) -> &str {
        "slide-position"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide stands elsewhere than commanded: a pitch error of the screw, so that all sensors read another place of the surface",
            confirm: "measure the positioning of the slide with a laser",
            source: "f(x + e(x) + p) - f(x + p), e of a few waves over the travel; Zhao et al. (2019), equation (20)",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("position", "mm", 1.0)]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        root_mean_square("position-rms", "mm", amplitudes, covariance)
    }

    fn columns(&self, model: &FourSensors, _shape: &Shape) -> Vec<Column> {
        FEW_WAVES
            .map(|wave| {
                Column::from_places(model.places(), |_, place| {
                    wave(model.share(place)) * model.curves().surface_slope(model, place)
                })
            })
            .into()
    }
}
