//! How to fit a design.

use errsep_solvers::options::Options as Minimisation;

use super::determined::Zero;
use super::error::DesignFitError;
use super::readings::DesignObservations;
use crate::reversal::simultaneous::{Knots, Noise};

/// How to fit a design.
#[derive(Debug, Clone)]
pub struct DesignOptions {
    /// What becomes of the indicators' zeros.
    pub zero: Zero,
    /// Diameter of the artefact, mm; zero where it is not known: no shift between probe points.
    pub thickness_mm: f64,
    /// Whether the thickness is an unknown, from that first guess. Determined only where slopes and forms
    /// are large.
    pub fit_thickness: bool,
    /// The crest of a bar, where its loss is a term of the model.
    pub crest: Option<Crest>,
    /// Noise of a reading.
    pub noise: Noise,
    /// Break points of the forms.
    pub knots: Knots,
    /// Whether knots that are chosen are as many for all forms; otherwise each form has its own number.
    pub alike: bool,
    /// Settings of the minimisation.
    pub minimisation: Minimisation,
}

/// A round bar, of the diameter of [`DesignOptions::thickness_mm`], under styluses that stand beside its
/// crest.
#[derive(Debug, Clone, PartialEq)]
pub struct Crest {
    /// Radius of the stylus, mm.
    pub tip_mm: f64,
    /// By channel: how far the axis of the bar stands beside the stylus at the middle of the travel, mm;
    /// positive towards growing angles of the indicator. With zeros that are kept without the eccentricity
    /// of the bar, which is found.
    pub offset_mm: Vec<f64>,
}

impl Default for DesignOptions {
    fn default() -> Self {
        Self {
            zero: Zero::default(),
            thickness_mm: 0.0,
            fit_thickness: false,
            crest: None,
            noise: Noise::default(),
            knots: Knots::default(),
            alike: false,
            minimisation: Minimisation::structured(),
        }
    }
}

impl DesignOptions {
    /// Whether the noise is declared.
    pub(super) fn is_declared(&self) -> bool {
        matches!(self.noise, Noise::Declared(_))
    }

    /// Whether options and readings can be used.
    pub(super) fn check(&self, observations: &DesignObservations) -> Result<(), DesignFitError> {
        let not_usable =
            |what: String, value: f64, must| Err(DesignFitError::NotUsable { what, value, must });
        if !(self.thickness_mm >= 0.0 && self.thickness_mm.is_finite()) {
            return not_usable("the thickness".into(), self.thickness_mm, "0 mm or more");
        }
        if let Noise::Declared(sigma) = self.noise
            && !(sigma > 0.0 && sigma.is_finite())
        {
            return not_usable("the noise".into(), sigma, "above 0 um");
        }
        let channels = observations.design.channels();
        if let Some(crest) = &self.crest {
            if !(self.thickness_mm > 0.0) {
                let must = "above 0 mm: a crest belongs to a bar";
                return not_usable("the thickness".into(), self.thickness_mm, must);
            }
            if !(crest.tip_mm >= 0.0 && crest.tip_mm.is_finite()) {
                return not_usable(
                    "the radius of the stylus".into(),
                    crest.tip_mm,
                    "0 mm or more",
                );
            }
            let radius = 0.5 * self.thickness_mm + crest.tip_mm;
            let count = crest.offset_mm.len();
            if count != channels.len() {
                let must = "as many as the channels";
                return not_usable("the number of offsets".into(), count as f64, must);
            }
            for (offset, channel) in crest.offset_mm.iter().zip(channels) {
                if !(offset.abs() < radius) {
                    let what = format!(
                        "how far the bar stands beside the stylus of {}",
                        channel.name
                    );
                    let must = "less than the radii of bar and stylus together";
                    return not_usable(what, *offset, must);
                }
            }
        }
        for reading in &observations.readings {
            let Some(channel) = channels.get(reading.channel) else {
                return not_usable(
                    "a channel's place".into(),
                    reading.channel as f64,
                    "in the design",
                );
            };
            for (what, value) in [("position", reading.x), ("reading", reading.value)] {
                if !value.is_finite() {
                    return not_usable(
                        format!("a {what} of channel {}", channel.name),
                        value,
                        "finite",
                    );
                }
            }
        }
        Ok(())
    }
}
