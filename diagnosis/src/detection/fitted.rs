//! The readings as a model has them.

use errsep_models::model::FittedModel;
use nalgebra::DVector;

use crate::detection::space::Space;
use crate::noise::law::{NoiseLaw, NoiseSource};

/// Readings that a model fits without a residual: its smooth state, or what the fit makes of every reading.
pub(crate) fn without_misfit<M: FittedModel>(model: &M) -> DVector<f64> {
    model.smooth().unwrap_or_else(|| {
        let unit = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
        let left = Space::new(model, &unit).forward_vector(&model.linearised());
        model.observed() - left
    })
}
