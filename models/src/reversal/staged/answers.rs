//! What can be asked of a staged solution.

use super::estimates::{ErrorEstimates, rms};
use super::{ErrorRms, Form, Staged, Value};
use crate::reversal::{Channel, Contrast};
use crate::units::um_from_mm;

impl Staged {
    /// A tilt of the convention, where the channels determine it by itself.
    pub fn tilt(&self, contrast: Contrast) -> Option<Value> {
        let index = self
            .convention
            .tilts()
            .iter()
            .position(|c| *c == contrast)?;
        let tilt = self
            .tilts
            .iter()
            .find(|t| t.combination.single() == Some(index))?;
        Some(tilt.angle)
    }

    /// Mean reading less model, µm, a row a channel, at the positions of the [closure](Staged::closure):
    /// ± its profile and the slope that the convention says is zero. Fewer than four channels leave
    /// nothing.
    pub fn residuals(&self) -> Vec<(Channel, Vec<f64>)> {
        let Some(closure) = &self.closure else {
            return Vec::new();
        };
        let center = closure.x.iter().sum::<f64>() / closure.x.len() as f64;
        let slope = um_from_mm(closure.slope.value.tan());
        let closing = self.convention.closure();
        let rest = |channel: Channel| {
            let (form, tilt) = (channel.spindle_sign(), closing.sign(channel) * slope);
            let points = closure.x.iter().zip(&closure.profile);
            points
                .map(|(x, c)| form * c + tilt * (x - center))
                .collect()
        };
        self.lines
            .iter()
            .map(|l| (l.channel, rest(l.channel)))
            .collect()
    }

    /// Root mean squares of the method's estimated errors.
    pub fn error_rms(&self) -> ErrorRms {
        let over = |of: fn(&ErrorEstimates) -> &Vec<f64>| {
            rms(self.lines.iter().flat_map(|l| of(&l.estimates)))
        };
        let has_thickness = self.lines.iter().any(|l| !l.estimates.thickness.is_empty());
        ErrorRms {
            shear: over(|e| &e.shear),
            interpolation: over(|e| &e.interpolation),
            shear_as_printed: over(|e| &e.shear_as_printed),
            interpolation_as_printed: over(|e| &e.interpolation_as_printed),
            thickness: has_thickness.then(|| over(|e| &e.thickness)),
        }
    }

    /// A form (index in [`FORMS`](super::FORMS)), where the channels determine it by itself.
    pub fn form(&self, index: usize) -> Option<&Form> {
        self.forms
            .iter()
            .find(|f| f.combination.single() == Some(index))
    }
}
