//! The slide turns while it travels.

use nalgebra::DMatrix;

use super::FourierScans;
use crate::basis::few_waves::{FEW_WAVES, root_mean_square};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Parameter, Shape};
use crate::units::UM_PER_MM;

/// See the head of the file.
pub(super) struct Yaw;

impl Effect<FourierScans> for Yaw {
    fn name(&self) -> &str {
        "yaw"
    }

    fn about(&self) -> About {
        About {
            physics: "the slide turns while it travels, so that a probe further along it reads more; in a vertical plane this is the pitch",
            confirm: "measure the rotation of the slide with an autocollimator or a level",
            source: "arm times angle, the angle a few waves over the travel; Abbe",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![Parameter::symmetric("angle", "rad", 1e-2)]
    }

    fn estimates(
        &self,
        _shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        root_mean_square("angle-rms", "rad", amplitudes, covariance)
    }

    fn columns(&self, model: &FourierScans, _shape: &Shape) -> Vec<Column> {
        FEW_WAVES
            .map(|wave| {
                Column::from_places(model.places(), |_, place| {
                    -UM_PER_MM * model.arm(place) * wave(model.share(place))
                })
            })
            .into()
    }
}
