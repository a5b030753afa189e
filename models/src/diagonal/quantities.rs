//! The results of the regression in the vocabulary of the GUM.

use super::StepDiagonalFit;
use crate::uncertainty::{Quantity, UncertaintyError};

impl StepDiagonalFit {
    /// The errors of location that are determined, under their ISO 230-1 names and signs, then the
    /// misalignments of the mirrors, rad. None where the noise of a reading is not known.
    ///
    /// The degrees of freedom are those of the noise of a reading.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn angles(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        let location = self.squareness.iter().map(|l| {
            (
                l.location.name().to_owned(),
                l.location.iso_sign(),
                l.value,
                l.std,
            )
        });
        let mirrors = self.mirrors.iter().map(|m| {
            let label = format!("mirror of {}, direction {}", m.diagonal.name(), m.direction);
            (label, 1.0, m.value, m.std)
        });
        location
            .chain(mirrors)
            .filter_map(|(label, sign, value, std)| Some((label, sign * value?, std?)))
            .map(|(label, value, std)| self.quantity(label, value, std, "rad"))
            .collect()
    }

    /// The values of the error functions that are determined, such as `EXX at 120 mm`, µm or rad.
    /// None where the noise of a reading is not known.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn components_at_positions(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        self.components
            .iter()
            .flat_map(|c| {
                let values = c.positions.iter().zip(&c.values).zip(&c.std);
                values.map(move |((position, value), std)| (c.component, *position, *value, *std))
            })
            .map(|(component, position, value, std)| {
                let unit = if component.rotation { "rad" } else { "um" };
                let label = format!("{} at {position} mm", component.name());
                self.quantity(label, value, std, unit)
            })
            .collect()
    }

    fn quantity(
        &self,
        label: String,
        value: f64,
        std: f64,
        unit: &str,
    ) -> Result<Quantity, UncertaintyError> {
        let quantity = Quantity::new(label, value, std, unit)?;
        Ok(match self.noise_degrees_of_freedom {
            Some(degrees) => quantity.with_degrees_of_freedom(degrees),
            None => quantity,
        })
    }
}
