//! The separated surface, straightness and tilt between the positions too, from which effects take what a sensor
//! would see elsewhere.

use super::{FourSensors, Geometry, Separation};
use crate::basis::interpolant::Interpolant;
use crate::model::Place;
use crate::units::UM_PER_MM;

/// Splines through what was separated.
#[derive(Debug, Clone)]
pub(super) struct Curves {
    surface: Interpolant,
    straightness: Interpolant,
    tilt: Interpolant,
    step: f64,
}

impl Curves {
    pub(super) fn of(state: &Separation, geometry: &Geometry) -> Self {
        let through = |profile: &super::Profile| Interpolant::through(profile.values.as_slice());
        Self {
            surface: through(&state.surface),
            straightness: through(&state.straightness),
            tilt: through(&state.tilt),
            step: geometry.step(),
        }
    }

    /// Slope of the surface under a sensor, µm/mm.
    pub(super) fn surface_slope(&self, model: &FourSensors, place: &Place) -> f64 {
        self.surface.slope(model.under(place)) / self.step
    }

    /// How much higher the surface is a way further along than under a sensor, µm for each millimetre; the slope
    /// where the way is none.
    pub(super) fn surface_chord(&self, model: &FourSensors, place: &Place, way: f64) -> f64 {
        if way == 0.0 {
            return self.surface_slope(model, place);
        }
        let under = model.under(place) as f64;
        (self.surface.at(under + way / self.step) - self.surface.at(under)) / way
    }

    /// Slope of what a sensor reads, along the travel, µm/mm.
    pub(super) fn reading_slope(&self, model: &FourSensors, place: &Place) -> f64 {
        let at = model.at(place);
        let arm = UM_PER_MM * model.arm(place.channel);
        self.surface_slope(model, place)
            + (self.straightness.slope(at) + arm * self.tilt.slope(at)) / self.step
    }
}
