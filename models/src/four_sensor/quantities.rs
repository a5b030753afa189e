//! The separated profiles in the vocabulary of the GUM.

use super::{Outputs, Profile, Separation};
use crate::uncertainty::{Quantity, UncertaintyError};

impl Separation {
    /// S and γ at every slide position, then f at every surface position of `outputs`, such as
    /// `S at 15 mm`, µm, γ in rad.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn quantities(&self, outputs: &Outputs) -> Result<Vec<Quantity>, UncertaintyError> {
        let (slide, surface) = (outputs.slide_positions(), outputs.surface_positions());
        [
            ("S", "um", &self.straightness, &slide),
            ("gamma", "rad", &self.tilt, &slide),
            ("f", "um", &self.surface, &surface),
        ]
        .into_iter()
        .flat_map(|(name, unit, profile, positions)| self.along(name, unit, profile, positions))
        .collect()
    }

    fn along(
        &self,
        name: &str,
        unit: &str,
        profile: &Profile,
        positions: &[f64],
    ) -> Vec<Result<Quantity, UncertaintyError>> {
        positions
            .iter()
            .zip(profile.values.iter().zip(&profile.std))
            .map(|(x, (&value, &std))| {
                let quantity = Quantity::new(format!("{name} at {x} mm"), value, std, unit)?;
                Ok(match self.degrees_of_freedom {
                    Some(degrees) => quantity.with_degrees_of_freedom(degrees),
                    None => quantity,
                })
            })
            .collect()
    }
}
