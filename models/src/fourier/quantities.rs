//! The separated profile in the vocabulary of the GUM.

use super::result::Separation;
use crate::uncertainty::{Quantity, UncertaintyError};

impl Separation {
    /// The workpiece at each position, such as `workpiece at 12.5 mm`, µm, with the degrees of freedom
    /// of the noise of a reading.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite, as for a noise from no degrees of freedom.
    pub fn profile_quantities(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        self.x
            .iter()
            .zip(&self.workpiece)
            .zip(&self.workpiece_std)
            .map(|((x, &value), &std)| self.quantity(format!("workpiece at {x} mm"), value, std))
            .collect()
    }

    /// Real and imaginary part of the coefficient of every order that is not lost, µm.
    ///
    /// # Errors
    /// As for [`Separation::profile_quantities`].
    pub fn order_quantities(&self) -> Result<Vec<Quantity>, UncertaintyError> {
        self.orders
            .iter()
            .filter(|o| !o.lost)
            .flat_map(|o| {
                [
                    ("real", o.coefficient.re, o.real_std),
                    ("imaginary", o.coefficient.im, o.imaginary_std),
                ]
                .map(|(part, value, std)| (format!("order {}, {part}", o.order), value, std))
            })
            .map(|(label, value, std)| self.quantity(label, value, std))
            .collect()
    }

    fn quantity(&self, label: String, value: f64, std: f64) -> Result<Quantity, UncertaintyError> {
        Ok(
            Quantity::new(label, value, std, "um")?
                .with_degrees_of_freedom(self.degrees_of_freedom),
        )
    }
}
