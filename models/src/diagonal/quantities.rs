//! The results of the regression in the vocabulary of the GUM.

use super::{ComponentEstimate, StepDiagonalFit};
use crate::uncertainty::{Quantity, UncertaintyError};

impl StepDiagonalFit {
    /// The errors of location that are determined, under their ISO 230-1 names and signs, then the
    /// misalignments of the mirrors, rad. None where the noise of a reading is not known.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn angles(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        let location = self.squareness.iter().map(|l| {
            let label = l.location.name().to_owned();
            let value = l.value.map(|s| l.location.iso_sign() * s);
            (label, value, l.std, l.degrees_of_freedom)
        });
        let mirrors = self.mirrors.iter().map(|m| {
            let label = format!("mirror of {}, direction {}", m.diagonal.name(), m.direction);
            (label, m.value, m.std, m.degrees_of_freedom)
        });
        location
            .chain(mirrors)
            .filter_map(|(label, value, std, degrees)| Some((label, value?, std?, degrees?)))
            .map(|(label, value, std, degrees)| {
                Ok(Quantity::new(label, value, std, "rad")?.with_degrees_of_freedom(degrees))
            })
            .collect()
    }

    /// The values of the error functions that are determined, such as `EXX at 120 mm`, µm or rad.
    /// None where the noise of a reading is not known.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn components_at_positions(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        let mut all = Vec::new();
        for c in &self.components {
            all.extend(c.quantities()?);
        }
        Ok(all)
    }
}

impl ComponentEstimate {
    /// The values at the positions, such as `EXX at 120 mm`, µm or rad; none where the function is not
    /// determined or the noise of a reading is not known.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn quantities(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        let unit = if self.component.rotation { "rad" } else { "um" };
        let uncertain = self.std.iter().zip(&self.degrees_of_freedom);
        self.positions
            .iter()
            .zip(&self.values)
            .zip(uncertain)
            .map(|((position, &value), (&std, &degrees))| {
                let label = format!("{} at {position} mm", self.component.name());
                Ok(Quantity::new(label, value, std, unit)?.with_degrees_of_freedom(degrees))
            })
            .collect()
    }
}
